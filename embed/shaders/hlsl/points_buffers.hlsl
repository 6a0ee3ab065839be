// Generated from `embed/shaders/wgsl/points.wgsl` and `points_buffers.wgsl`.
// Needs shader model 5.0.

struct DapplePointsTrack {
    uint first_bucket;
    uint first_cell;
    uint bucket_count;
    uint cell_count;
    uint3 dims;
    uint widths;
    float cell_edge;
    float radius;
    uint2 pad;
    float4 row_x;
    float4 row_y;
    float4 row_z;
};
struct DapplePointsResult {
    float ao;
    uint case_and_points;
};
struct DapplePointsPoint {
    float3 position;
    int _pad1_0;
    float3 normal;
    float ao;
};
static const uint DAPPLE_POINTS_NONE = 4294967295u;
static const uint DAPPLE_POINTS_EMPTY = 4294967295u;
static const float DAPPLE_POINTS_T_N = 0.1;
static const float DAPPLE_POINTS_T_D = 0.7;
static const float DAPPLE_POINTS_FILL_WEIGHT = 0.1;
static const uint DAPPLE_POINTS_FALLBACK_FILL = 1u;
static const uint DAPPLE_POINTS_CASE_FOUND = 0u;
static const uint DAPPLE_POINTS_CASE_FILLED = 1u;
static const uint DAPPLE_POINTS_CASE_NONE = 2u;
uint dapple_points_naga_mod(uint lhs, uint rhs) {
    return lhs % (rhs == 0u ? 1u : rhs);
}
DapplePointsPoint dapple_points_ConstructDapplePointsPoint(float3 arg0, float3 arg1, float arg2) {
    DapplePointsPoint ret = (DapplePointsPoint)0;
    ret.position = arg0;
    ret.normal = arg1;
    ret.ao = arg2;
    return ret;
}
DapplePointsResult dapple_points_ConstructDapplePointsResult(float arg0, uint arg1) {
    DapplePointsResult ret = (DapplePointsResult)0;
    ret.ao = arg0;
    ret.case_and_points = arg1;
    return ret;
}
int3 dapple_points_naga_f2i32(float3 value) {
    return int3(clamp(value, -2147483600.0, 2147483500.0));
}
DapplePointsTrack dapple_points_ConstructDapplePointsTrack(uint arg0, uint arg1, uint arg2, uint arg3, uint3 arg4, uint arg5, float arg6, float arg7, uint2 arg8, float4 arg9, float4 arg10, float4 arg11) {
    DapplePointsTrack ret = (DapplePointsTrack)0;
    ret.first_bucket = arg0;
    ret.first_cell = arg1;
    ret.bucket_count = arg2;
    ret.cell_count = arg3;
    ret.dims = arg4;
    ret.widths = arg5;
    ret.cell_edge = arg6;
    ret.radius = arg7;
    ret.pad = arg8;
    ret.row_x = arg9;
    ret.row_y = arg10;
    ret.row_z = arg11;
    return ret;
}

// Define DAPPLE_POINTS_CUSTOM to bring these functions.
#ifndef DAPPLE_POINTS_CUSTOM
ByteAddressBuffer dapple_points_buckets : register(t33);
ByteAddressBuffer dapple_points_cells : register(t34);
ByteAddressBuffer dapple_points_tracks : register(t32);
uint dapple_points_bucket(uint bucket, uint entry)
{
    uint _e5 = asuint(dapple_points_buckets.Load(entry*4+bucket*32));
    return _e5;
}
uint dapple_points_cell(uint cell, uint word_3)
{
    uint _e5 = asuint(dapple_points_cells.Load(word_3*4+cell*32));
    return _e5;
}
DapplePointsTrack dapple_points_track(uint track)
{
    DapplePointsTrack _e3 = dapple_points_ConstructDapplePointsTrack(asuint(dapple_points_tracks.Load(track*96+0)), asuint(dapple_points_tracks.Load(track*96+4)), asuint(dapple_points_tracks.Load(track*96+8)), asuint(dapple_points_tracks.Load(track*96+12)), asuint(dapple_points_tracks.Load3(track*96+16)), asuint(dapple_points_tracks.Load(track*96+28)), asfloat(dapple_points_tracks.Load(track*96+32)), asfloat(dapple_points_tracks.Load(track*96+36)), asuint(dapple_points_tracks.Load2(track*96+40)), asfloat(dapple_points_tracks.Load4(track*96+48)), asfloat(dapple_points_tracks.Load4(track*96+64)), asfloat(dapple_points_tracks.Load4(track*96+80)));
    const DapplePointsTrack dapplepointstrack = _e3;
    return dapplepointstrack;
}

#else
uint dapple_points_bucket(uint bucket, uint entry);
uint dapple_points_cell(uint cell, uint word_3);
DapplePointsTrack dapple_points_track(uint track);
#endif

uint dapple_points_hash(uint3 p, DapplePointsTrack t)
{
    return dapple_points_naga_mod(((p.x + ((p.y * t.dims.x) * 17u)) + (((p.z * t.dims.x) * t.dims.y) * 31u)), t.bucket_count);
}

uint dapple_points_key(uint3 p_1, DapplePointsTrack t_1)
{
    return (p_1.x + (t_1.dims.x * (p_1.y + (t_1.dims.y * p_1.z))));
}

uint dapple_points_field(uint word, uint shift, uint bits)
{
    return ((word >> shift) & ((1u << bits) - 1u));
}

float dapple_points_octahedral(uint word_1, uint shift_1, uint bits_1)
{
    int code = (asint((word_1 << ((32u - shift_1) - bits_1))) >> (32u - bits_1));
    return max((float(code) / float(asint(asuint((int(1) << (bits_1 - 1u))) - asuint(int(1))))), -1.0);
}

float3 dapple_points_octahedron_decode(float u, float v)
{
    float z = ((1.0 - abs(u)) - abs(v));
    if ((z < 0.0)) {
        float x_1 = ((1.0 - abs(v)) * ((u < 0.0) ? -1.0 : 1.0));
        float y = ((1.0 - abs(u)) * ((v < 0.0) ? -1.0 : 1.0));
        return normalize(float3(x_1, y, z));
    }
    return normalize(float3(u, v, z));
}

DapplePointsPoint dapple_points_unpack(uint word_2, DapplePointsTrack t_2)
{
    uint bp = (t_2.widths & 255u);
    uint bn = ((t_2.widths >> 8u) & 255u);
    uint ba = ((t_2.widths >> 16u) & 255u);
    const uint _e16 = dapple_points_field(word_2, 0u, ba);
    float ao = (float(_e16) / float(((1u << ba) - 1u)));
    const float _e24 = dapple_points_octahedral(word_2, ba, bn);
    const float _e26 = dapple_points_octahedral(word_2, (ba + bn), bn);
    uint base = (ba + (2u * bn));
    const uint _e30 = dapple_points_field(word_2, base, bp);
    const uint _e33 = dapple_points_field(word_2, (base + bp), bp);
    const uint _e38 = dapple_points_field(word_2, (base + (2u * bp)), bp);
    float3 q = float3(float(_e30), float(_e33), float(_e38));
    float3 position_3 = (((q + (0.5).xxx) / (float((1u << bp))).xxx) * t_2.cell_edge);
    const float3 _e51 = dapple_points_octahedron_decode(_e24, _e26);
    const DapplePointsPoint dapplepointspoint = dapple_points_ConstructDapplePointsPoint(position_3, _e51, ao);
    return dapplepointspoint;
}

DapplePointsResult dapple_points_sample(DapplePointsTrack t_3, float3 x, float3 n, uint fallback)
{
    float weight = 0.0;
    float weighted = 0.0;
    uint points = 0u;
    float fill = 0.0;
    float filled = 0.0;
    uint corner = 0u;
    bool local = (bool)0;
    uint entry_1 = (uint)0;
    bool local_1 = (bool)0;
    uint slot = (uint)0;
    float slope = (float)0;
    bool local_2 = (bool)0;
    bool local_3 = (bool)0;

    uint present_shift = (((3u * (t_3.widths & 255u)) + (2u * ((t_3.widths >> 8u) & 255u))) + ((t_3.widths >> 16u) & 255u));
    float3 scaled = clamp((x / (t_3.cell_edge).xxx), (-2.0).xxx, (65537.0).xxx);
    float3 base_1 = floor(scaled);
    float3 near = (scaled - base_1);
    float3 side = ((near >= (0.5).xxx) ? (1.0).xxx : (-1.0).xxx);
    float3 window = (abs((near - (0.5).xxx)) * 2.0);
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e220 = corner;
            corner = (_e220 + 1u);
        }
        loop_init = false;
        uint _e59 = corner;
        if ((_e59 < 8u)) {
        } else {
            break;
        }
        {
            uint _e62 = corner;
            uint _e63 = corner;
            uint _e66 = corner;
            uint3 pick = (uint3(_e62, (_e63 >> 1u), (_e66 >> 2u)) & (1u).xxx);
            float3 offset = (float3(pick) * side);
            int3 at = dapple_points_naga_f2i32((base_1 + offset));
            if (!(any((at < (int(0)).xxx)))) {
                local = any((at >= int3(t_3.dims)));
            } else {
                local = true;
            }
            bool _e89 = local;
            if (_e89) {
                continue;
            }
            float cell_window = ((((pick.x == 1u) ? window.x : 1.0) * ((pick.y == 1u) ? window.y : 1.0)) * ((pick.z == 1u) ? window.z : 1.0));
            const uint _e111 = dapple_points_key(uint3(at), t_3);
            const uint _e114 = dapple_points_hash(uint3(at), t_3);
            uint bucket_1 = (t_3.first_bucket + _e114);
            float3 x_cell = (x - (float3(at) * t_3.cell_edge));
            entry_1 = 0u;
            bool loop_init_1 = true;
            while(true) {
                if (!loop_init_1) {
                    uint _e217 = entry_1;
                    entry_1 = (_e217 + 1u);
                }
                loop_init_1 = false;
                uint _e122 = entry_1;
                if ((_e122 < 8u)) {
                } else {
                    break;
                }
                {
                    uint _e125 = entry_1;
                    const uint _e126 = dapple_points_bucket(bucket_1, _e125);
                    if ((_e126 == DAPPLE_POINTS_EMPTY)) {
                        break;
                    }
                    if (!((_e126 >= t_3.cell_count))) {
                        const uint _e137 = dapple_points_cell((t_3.first_cell + _e126), 0u);
                        local_1 = (_e137 != _e111);
                    } else {
                        local_1 = true;
                    }
                    bool _e140 = local_1;
                    if (_e140) {
                        continue;
                    }
                    slot = 0u;
                    bool loop_init_2 = true;
                    while(true) {
                        if (!loop_init_2) {
                            uint _e214 = slot;
                            slot = (_e214 + 1u);
                        }
                        loop_init_2 = false;
                        uint _e143 = slot;
                        if ((_e143 < 7u)) {
                        } else {
                            break;
                        }
                        {
                            uint _e148 = slot;
                            const uint _e151 = dapple_points_cell((t_3.first_cell + _e126), (_e148 + 1u));
                            if ((((_e151 >> present_shift) & 1u) == 0u)) {
                                continue;
                            }
                            const DapplePointsPoint _e157 = dapple_points_unpack(_e151, t_3);
                            float agreement = dot(_e157.normal, n);
                            if ((agreement <= DAPPLE_POINTS_T_N)) {
                                continue;
                            }
                            float3 to_point = (_e157.position - x_cell);
                            float distance_ = length(to_point);
                            slope = 0.0;
                            if ((distance_ > 0.0)) {
                                slope = dot(_e157.normal, (to_point / (distance_).xxx));
                            }
                            float _e173 = slope;
                            float _e174 = slope;
                            float slope2_ = (_e173 * _e174);
                            if ((slope2_ >= DAPPLE_POINTS_T_D)) {
                                continue;
                            }
                            float alpha = max(0.0, ((t_3.radius - distance_) / t_3.radius));
                            if ((alpha > 0.0)) {
                                uint _e187 = points;
                                points = (_e187 + 1u);
                            }
                            float _e189 = weight;
                            weight = (_e189 + alpha);
                            float _e191 = weighted;
                            weighted = (_e191 + (alpha * _e157.ao));
                            float ratio = (t_3.radius / max(distance_, t_3.radius));
                            float tail = ((((cell_window * ratio) * ratio) * (agreement - DAPPLE_POINTS_T_N)) * (DAPPLE_POINTS_T_D - slope2_));
                            float _e207 = fill;
                            fill = (_e207 + tail);
                            float _e209 = filled;
                            filled = (_e209 + (tail * _e157.ao));
                        }
                    }
                }
            }
        }
    }
    if ((fallback == DAPPLE_POINTS_FALLBACK_FILL)) {
        float _e226 = weight;
        local_2 = (_e226 < DAPPLE_POINTS_FILL_WEIGHT);
    } else {
        local_2 = false;
    }
    bool _e230 = local_2;
    if (_e230) {
        float _e233 = fill;
        local_3 = (_e233 > 0.0);
    } else {
        local_3 = false;
    }
    bool _e237 = local_3;
    if (_e237) {
        float _e239 = weight;
        float rest = (DAPPLE_POINTS_FILL_WEIGHT - _e239);
        float _e241 = weighted;
        float _e242 = filled;
        float _e243 = fill;
        float ao_1 = ((_e241 + (rest * (_e242 / _e243))) / DAPPLE_POINTS_FILL_WEIGHT);
        float _e251 = weight;
        uint case_ = ((_e251 == 0.0) ? DAPPLE_POINTS_CASE_FILLED : DAPPLE_POINTS_CASE_FOUND);
        uint _e255 = points;
        const DapplePointsResult dapplepointsresult = dapple_points_ConstructDapplePointsResult(ao_1, (case_ | (_e255 << 8u)));
        return dapplepointsresult;
    }
    float _e260 = weight;
    if ((_e260 > 0.0)) {
        float _e263 = weighted;
        float _e264 = weight;
        uint _e267 = points;
        const DapplePointsResult dapplepointsresult_1 = dapple_points_ConstructDapplePointsResult((_e263 / _e264), (DAPPLE_POINTS_CASE_FOUND | (_e267 << 8u)));
        return dapplepointsresult_1;
    }
    const DapplePointsResult dapplepointsresult_2 = dapple_points_ConstructDapplePointsResult(1.0, 2u);
    return dapplepointsresult_2;
}

float3 dapple_points_position(DapplePointsTrack t_4, float3 position)
{
    float4 p_2 = float4(position, 1.0);
    return float3(dot(t_4.row_x, p_2), dot(t_4.row_y, p_2), dot(t_4.row_z, p_2));
}

float3 dapple_points_normal(DapplePointsTrack t_5, float3 normal)
{
    float3 x_2 = cross(t_5.row_y.xyz, t_5.row_z.xyz);
    float3 y_1 = cross(t_5.row_z.xyz, t_5.row_x.xyz);
    float3 z_1 = cross(t_5.row_x.xyz, t_5.row_y.xyz);
    float side_1 = ((dot(t_5.row_x.xyz, x_2) < 0.0) ? -1.0 : 1.0);
    return normalize((float3(dot(x_2, normal), dot(y_1, normal), dot(z_1, normal)) * side_1));
}

float dapple_points_ao(uint track_1, float3 position_1, float3 normal_1, uint fallback_1)
{
    if ((track_1 == DAPPLE_POINTS_NONE)) {
        return 1.0;
    }
    const DapplePointsTrack _e7 = dapple_points_track(track_1);
    const float3 _e8 = dapple_points_position(_e7, position_1);
    const float3 _e9 = dapple_points_normal(_e7, normal_1);
    const DapplePointsResult _e10 = dapple_points_sample(_e7, _e8, _e9, fallback_1);
    return _e10.ao;
}
