// Generated from `embed/shaders/wgsl/probes.wgsl` and `probes_buffers.wgsl`.
// Needs shader model 5.0.

struct DappleProbesVolume {
    row_major float4x3 grid_from_world;
    int _pad1_0;
    uint3 dims;
    uint side;
    float3 spacing;
    float scale;
    float range;
    int _end_pad_0;
    int _end_pad_1;
    int _end_pad_2;
};
struct DappleProbesIncomingLight {
    float3 irradiance;
    int _pad1_0;
    float3 filtered;
    int _end_pad_0;
};
struct DappleProbesIndirect {
    float3 diffuse;
    int _pad1_0;
    float3 glossy;
    int _end_pad_0;
};
static const float DAPPLE_PROBES_PI = 3.1415927;
static const float DAPPLE_PROBES_NORMAL_BIAS = 0.045;
static const float DAPPLE_PROBES_VIEW_BIAS = 0.18;
static const float DAPPLE_PROBES_WRAP = 0.2;
static const float DAPPLE_PROBES_UNSEEN = 1e-6;
static const float DAPPLE_PROBES_ABSENT = 1e-12;
static const float DAPPLE_PROBES_CRUSH = 0.2;
static const float DAPPLE_PROBES_DIELECTRIC = 0.04;
static const float3 DAPPLE_PROBES_LOBE_SMOOTH = float3(1.0, 0.8, 0.5);
static const float3 DAPPLE_PROBES_LOBE_ROUGH = float3(1.0, 0.6666667, 0.25);
static const float DAPPLE_PROBES_ENVIRONMENT_SIDE = 32.0;
static const float3 DAPPLE_PROBES_COSINE = float3(3.1415927, 2.0943952, 0.7853982);
typedef float3 dapple_probes_ret_Constructarray9_float3_[9];
dapple_probes_ret_Constructarray9_float3_ dapple_probes_Constructarray9_float3_(float3 arg0, float3 arg1, float3 arg2, float3 arg3, float3 arg4, float3 arg5, float3 arg6, float3 arg7, float3 arg8) {
    float3 ret[9] = { arg0, arg1, arg2, arg3, arg4, arg5, arg6, arg7, arg8 };
    return ret;
}
typedef float3 ret_dapple_probes_expansion[9];
typedef float4 dapple_probes_ret_Constructarray7_float4_[7];
dapple_probes_ret_Constructarray7_float4_ dapple_probes_Constructarray7_float4_(float4 arg0, float4 arg1, float4 arg2, float4 arg3, float4 arg4, float4 arg5, float4 arg6) {
    float4 ret[7] = { arg0, arg1, arg2, arg3, arg4, arg5, arg6 };
    return ret;
}
typedef float4 ret_dapple_probes_filtered[7];
typedef float3 ret_dapple_probes_trilinear[9];
uint dapple_probes_naga_div(uint lhs, uint rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}
uint dapple_probes_naga_mod(uint lhs, uint rhs) {
    return lhs % (rhs == 0u ? 1u : rhs);
}
int dapple_probes_naga_f2i32(float value) {
    return int(clamp(value, -2147483600.0, 2147483500.0));
}
typedef float4 ret_dapple_probes_values[7];
typedef float4 dapple_probes_ret_ZeroValuearray7_float4_[7];
dapple_probes_ret_ZeroValuearray7_float4_ dapple_probes_ZeroValuearray7_float4_() {
    float4 ret[7] = { (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0 };
    return ret;
}
uint3 dapple_probes_naga_f2u32(float3 value) {
    return uint3(clamp(value, 0.0, 4294967000.0));
}
typedef float3 ret_dapple_probes_visibility_weighted[9];
uint2 dapple_probes_naga_f2u32(float2 value) {
    return uint2(clamp(value, 0.0, 4294967000.0));
}
DappleProbesIncomingLight dapple_probes_ConstructDappleProbesIncomingLight(float3 arg0, float3 arg1) {
    DappleProbesIncomingLight ret = (DappleProbesIncomingLight)0;
    ret.irradiance = arg0;
    ret.filtered = arg1;
    return ret;
}

// Define DAPPLE_PROBES_CUSTOM to bring these functions.
#ifndef DAPPLE_PROBES_CUSTOM
Texture3D<float4> dapple_probes_plane_a : register(t6);
SamplerState dapple_probes_filtering : register(s6);
Texture3D<float4> dapple_probes_plane_b : register(t7);
Texture3D<float4> dapple_probes_plane_c : register(t8);
Texture3D<float4> dapple_probes_plane_d : register(t9);
Texture3D<float4> dapple_probes_plane_e : register(t10);
Texture3D<float4> dapple_probes_plane_f : register(t11);
Texture3D<float4> dapple_probes_plane_g : register(t12);
ByteAddressBuffer dapple_probes_presence : register(t2);
ByteAddressBuffer dapple_probes_blocks : register(t3);
ByteAddressBuffer dapple_probes_texels : register(t1);
ByteAddressBuffer dapple_probes_environments : register(t4);
ret_dapple_probes_filtered dapple_probes_filtered(float3 uvw)
{
    float4 _e4 = dapple_probes_plane_a.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e8 = dapple_probes_plane_b.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e12 = dapple_probes_plane_c.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e16 = dapple_probes_plane_d.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e20 = dapple_probes_plane_e.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e24 = dapple_probes_plane_f.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    float4 _e28 = dapple_probes_plane_g.SampleLevel(dapple_probes_filtering, uvw, 0.0);
    return dapple_probes_Constructarray7_float4_(_e4, _e8, _e12, _e16, _e20, _e24, _e28);
}
bool dapple_probes_present(uint probe)
{
    uint _e5 = asuint(dapple_probes_presence.Load(dapple_probes_naga_div(probe, 32u)*4));
    return (((_e5 >> dapple_probes_naga_mod(probe, 32u)) & 1u) == 1u);
}
uint2 dapple_probes_visibility(uint texel)
{
    uint _e5 = asuint(dapple_probes_blocks.Load(dapple_probes_naga_div(texel, 2u)*4));
    uint word = (_e5 >> (16u * dapple_probes_naga_mod(texel, 2u)));
    return uint2((word & 255u), ((word >> 8u) & 255u));
}
ret_dapple_probes_values dapple_probes_values(DappleProbesVolume volume_4, uint probe_3)
{
    float4 values[7] = { (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0 };
    uint t_1 = 0u;

    uint count = ((volume_4.dims.x * volume_4.dims.y) * volume_4.dims.z);
    bool loop_init_3 = true;
    while(true) {
        if (!loop_init_3) {
            uint _e30 = t_1;
            t_1 = (_e30 + 1u);
        }
        loop_init_3 = false;
        uint _e13 = t_1;
        if ((_e13 < 7u)) {
        } else {
            break;
        }
        {
            uint _e17 = t_1;
            uint2 bits = asuint(dapple_probes_texels.Load2(((_e17 * count) + probe_3)*8));
            uint _e22 = t_1;
            uint _e24 = bits.x;
            uint _e26 = bits.y;
            values[_e22] = float4(float2(f16tof32(_e24), f16tof32((_e24) >> 16)), float2(f16tof32(_e26), f16tof32((_e26) >> 16)));
        }
    }
    float4 _e32[7] = values;
    return _e32;
}
float2 dapple_probes_environment_entry(uint entry)
{
    float2 _e3 = asfloat(dapple_probes_environments.Load2(entry*8));
    return _e3;
}

#else
ret_dapple_probes_filtered dapple_probes_filtered(float3 uvw);
bool dapple_probes_present(uint probe);
uint2 dapple_probes_visibility(uint texel);
ret_dapple_probes_values dapple_probes_values(DappleProbesVolume volume_4, uint probe_3);
float2 dapple_probes_environment_entry(uint entry);
#endif

ret_dapple_probes_expansion dapple_probes_expansion(float4 v[7])
{
    return dapple_probes_Constructarray9_float3_(v[0].xyz, float3(v[0].w, v[1].xy), float3(v[1].zw, v[2].x), v[2].yzw, v[3].xyz, float3(v[3].w, v[4].xy), float3(v[4].zw, v[5].x), v[5].yzw, v[6].xyz);
}

ret_dapple_probes_trilinear dapple_probes_trilinear(DappleProbesVolume volume, float3 x)
{
    float4 sum[7] = { (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0, (float4)0 };
    uint t = 0u;

    float3 dims = float3(volume.dims);
    float3 at_1 = clamp((x / volume.spacing), (0.0).xxx, (dims - (1.0).xxx));
    float3 uvw_1 = ((at_1 + (0.5).xxx) / dims);
    float s = volume.scale;
    const float4 _e17[7] = dapple_probes_filtered(uvw_1);
    sum = _e17;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e29 = t;
            t = (_e29 + 1u);
        }
        loop_init = false;
        uint _e21 = t;
        if ((_e21 < 7u)) {
        } else {
            break;
        }
        {
            uint _e24 = t;
            float4 _e26 = sum[_e24];
            sum[_e24] = (_e26 * s);
        }
    }
    float4 _e31[7] = sum;
    const float3 _e32[9] = dapple_probes_expansion(_e31);
    return _e32;
}

uint dapple_probes_index_of(DappleProbesVolume volume_1, uint3 at)
{
    return (at.x + (volume_1.dims.x * (at.y + (volume_1.dims.y * at.z))));
}

float2 dapple_probes_octahedral(float3 d)
{
    float sum_2 = ((abs(d.x) + abs(d.y)) + abs(d.z));
    if (!((sum_2 > 0.0))) {
        return (0.0).xx;
    }
    float2 p = (d.xy / (sum_2).xx);
    if ((d.z < 0.0)) {
        float2 signs = ((p < (0.0).xx) ? (-1.0).xx : (1.0).xx);
        return (((1.0).xx - abs(p.yx)) * signs);
    }
    return p;
}

uint dapple_probes_fold(int row, int column, int n)
{
    int row_1 = (int)0;
    int column_1 = (int)0;
    bool local = (bool)0;
    bool local_1 = (bool)0;

    row_1 = row;
    column_1 = column;
    int _e5 = column_1;
    if (!((_e5 < int(0)))) {
        int _e11 = column_1;
        local = (_e11 >= n);
    } else {
        local = true;
    }
    bool _e14 = local;
    if (_e14) {
        int _e17 = row_1;
        row_1 = asint(asuint(asint(asuint(n) - asuint(int(1)))) - asuint(_e17));
        int _e19 = column_1;
        column_1 = clamp(_e19, int(0), asint(asuint(n) - asuint(int(1))));
    }
    int _e24 = row_1;
    if (!((_e24 < int(0)))) {
        int _e30 = row_1;
        local_1 = (_e30 >= n);
    } else {
        local_1 = true;
    }
    bool _e33 = local_1;
    if (_e33) {
        int _e34 = row_1;
        row_1 = clamp(_e34, int(0), asint(asuint(n) - asuint(int(1))));
        int _e41 = column_1;
        column_1 = asint(asuint(asint(asuint(n) - asuint(int(1)))) - asuint(_e41));
    }
    int _e43 = row_1;
    int _e45 = column_1;
    return uint(clamp(asint(asuint(asint(asuint(_e43) * asuint(n))) + asuint(_e45)), int(0), asint(asuint(asint(asuint(n) * asuint(n))) - asuint(int(1)))));
}

float2 dapple_probes_moments(DappleProbesVolume volume_2, uint probe_1, float3 direction)
{
    float2 sums = (0.0).xx;
    int row_2 = int(0);
    int column_2 = (int)0;

    int n_5 = int(volume_2.side);
    const float2 _e5 = dapple_probes_octahedral(direction);
    float2 at_2 = (((_e5 + (1.0).xx) * (0.5 * float(n_5))) - (0.5).xx);
    float2 base = floor(at_2);
    float2 f_1 = (at_2 - base);
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            int _e83 = row_2;
            row_2 = asint(asuint(_e83) + asuint(int(1)));
        }
        loop_init_1 = false;
        int _e23 = row_2;
        if ((_e23 < int(2))) {
        } else {
            break;
        }
        {
            column_2 = int(0);
            bool loop_init_2 = true;
            while(true) {
                if (!loop_init_2) {
                    int _e80 = column_2;
                    column_2 = asint(asuint(_e80) + asuint(int(1)));
                }
                loop_init_2 = false;
                int _e28 = column_2;
                if ((_e28 < int(2))) {
                } else {
                    break;
                }
                {
                    int _e35 = row_2;
                    int _e43 = column_2;
                    float weight = (((_e35 == int(1)) ? f_1.y : (1.0 - f_1.y)) * ((_e43 == int(1)) ? f_1.x : (1.0 - f_1.x)));
                    int _e50 = row_2;
                    int _e54 = column_2;
                    const uint _e56 = dapple_probes_fold(asint(asuint(dapple_probes_naga_f2i32(base.y)) + asuint(_e50)), asint(asuint(dapple_probes_naga_f2i32(base.x)) + asuint(_e54)), n_5);
                    const uint2 _e61 = dapple_probes_visibility(((probe_1 * uint(asint(asuint(n_5) * asuint(n_5)))) + _e56));
                    float2 metres = (float2(_e61) * (volume_2.range / 255.0));
                    float2 _e67 = sums;
                    sums = (_e67 + (weight * float2(metres.x, ((metres.x * metres.x) + (metres.y * metres.y)))));
                }
            }
        }
    }
    float2 _e85 = sums;
    return _e85;
}

float dapple_probes_share(DappleProbesVolume volume_3, uint probe_2, float3 offset)
{
    bool local_2 = (bool)0;

    float distance_ = length(offset);
    const float2 _e4 = dapple_probes_moments(volume_3, probe_2, offset);
    float mean = _e4.x;
    float code = (volume_3.range / 255.0);
    if (!((distance_ <= mean))) {
        local_2 = (mean >= (volume_3.range - (0.5 * code)));
    } else {
        local_2 = true;
    }
    bool _e19 = local_2;
    if (_e19) {
        return 1.0;
    }
    float variance = max((_e4.y - (mean * mean)), (code * code));
    float beyond = (distance_ - mean);
    float bound = (variance / (variance + (beyond * beyond)));
    float cubed = ((bound * bound) * bound);
    float crushed = min((cubed / DAPPLE_PROBES_CRUSH), 1.0);
    return (cubed * (crushed * crushed));
}

ret_dapple_probes_visibility_weighted dapple_probes_visibility_weighted(DappleProbesVolume volume_5, float3 x_1, float3 n_1, float3 v_1)
{
    float4 sum_1[7] = dapple_probes_ZeroValuearray7_float4_();
    float4 plain[7] = dapple_probes_ZeroValuearray7_float4_();
    float total = 0.0;
    uint corner = 0u;
    float3 to_probe = (float3)0;
    float trust = (float)0;
    uint t_2 = (uint)0;
    uint t_3 = 0u;

    float3 spacing = volume_5.spacing;
    float least = min(spacing.x, min(spacing.y, spacing.z));
    float3 seen_at = (x_1 + (((n_1 * DAPPLE_PROBES_NORMAL_BIAS) + (v_1 * DAPPLE_PROBES_VIEW_BIAS)) * least));
    uint3 last = (volume_5.dims - (1u).xxx);
    float3 at_3 = clamp((x_1 / spacing), (0.0).xxx, float3(last));
    uint3 base_1 = min(dapple_probes_naga_f2u32(at_3), (max(last, (1u).xxx) - (1u).xxx));
    float3 f_2 = (at_3 - float3(base_1));
    bool loop_init_4 = true;
    while(true) {
        if (!loop_init_4) {
            uint _e136 = corner;
            corner = (_e136 + 1u);
        }
        loop_init_4 = false;
        uint _e44 = corner;
        if ((_e44 < 8u)) {
        } else {
            break;
        }
        {
            uint _e47 = corner;
            uint _e50 = corner;
            uint _e55 = corner;
            uint3 pick = uint3((_e47 & 1u), ((_e50 >> 1u) & 1u), (_e55 >> 2u));
            float3 sides = ((pick == (1u).xxx) ? f_2 : ((1.0).xxx - f_2));
            float trilinear_weight = ((sides.x * sides.y) * sides.z);
            uint3 place = min((base_1 + pick), last);
            const uint _e73 = dapple_probes_index_of(volume_5, place);
            float3 probe_4 = (float3(place) * spacing);
            to_probe = (probe_4 - x_1);
            float3 _e78 = to_probe;
            float distance_1 = length(_e78);
            float3 _e80 = to_probe;
            to_probe = ((distance_1 > 1e-30) ? (_e80 / (distance_1).xxx) : n_1);
            float3 _e86 = to_probe;
            float half_cosine = (0.5 + (0.5 * dot(_e86, n_1)));
            float wrap = ((half_cosine * half_cosine) + DAPPLE_PROBES_WRAP);
            trust = 1.0;
            const bool _e97 = dapple_probes_present(_e73);
            if (!(_e97)) {
                trust = DAPPLE_PROBES_ABSENT;
            } else {
                if ((volume_5.side > 0u)) {
                    const float _e104 = dapple_probes_share(volume_5, _e73, (seen_at - probe_4));
                    trust = max(_e104, DAPPLE_PROBES_UNSEEN);
                }
            }
            float _e108 = trust;
            float weight_1 = ((trilinear_weight * wrap) * _e108);
            float _e110 = total;
            total = (_e110 + weight_1);
            const float4 _e112[7] = dapple_probes_values(volume_5, _e73);
            t_2 = 0u;
            bool loop_init_5 = true;
            while(true) {
                if (!loop_init_5) {
                    uint _e133 = t_2;
                    t_2 = (_e133 + 1u);
                }
                loop_init_5 = false;
                uint _e115 = t_2;
                if ((_e115 < 7u)) {
                } else {
                    break;
                }
                {
                    uint _e118 = t_2;
                    float4 _e120 = sum_1[_e118];
                    uint _e121 = t_2;
                    sum_1[_e118] = (_e120 + (_e112[_e121] * weight_1));
                    uint _e125 = t_2;
                    float4 _e127 = plain[_e125];
                    uint _e128 = t_2;
                    plain[_e125] = (_e127 + (_e112[_e128] * trilinear_weight));
                }
            }
        }
    }
    bool loop_init_6 = true;
    while(true) {
        if (!loop_init_6) {
            uint _e164 = t_3;
            t_3 = (_e164 + 1u);
        }
        loop_init_6 = false;
        uint _e140 = t_3;
        if ((_e140 < 7u)) {
        } else {
            break;
        }
        {
            float _e143 = total;
            if ((_e143 > 0.0)) {
                uint _e146 = t_3;
                uint _e148 = t_3;
                float4 _e150 = sum_1[_e148];
                float _e151 = total;
                sum_1[_e146] = ((_e150 / (_e151).xxxx) * volume_5.scale);
            } else {
                uint _e156 = t_3;
                uint _e158 = t_3;
                float4 _e160 = plain[_e158];
                sum_1[_e156] = (_e160 * volume_5.scale);
            }
        }
    }
    float4 _e166[7] = sum_1;
    const float3 _e167[9] = dapple_probes_expansion(_e166);
    return _e167;
}

float3 dapple_probes_convolved(float3 c[9], float3 factors, float3 d_1)
{
    float x_2 = d_1.x;
    float y = d_1.y;
    float z = d_1.z;
    float3 band1_ = (((c[1] * (0.4886025 * y)) + (c[2] * (0.4886025 * z))) + (c[3] * (0.4886025 * x_2)));
    float3 band2_ = (((((c[4] * ((1.0925484 * x_2) * y)) + (c[5] * ((1.0925484 * y) * z))) + (c[6] * (0.31539157 * (((3.0 * z) * z) - 1.0)))) + (c[7] * ((1.0925484 * x_2) * z))) + (c[8] * (0.5462742 * ((x_2 * x_2) - (y * y)))));
    return (((c[0] * (0.28209478 * factors.x)) + (band1_ * factors.y)) + (band2_ * factors.z));
}

float3 dapple_probes_lobe(float roughness)
{
    float share = clamp(roughness, 0.0, 1.0);
    return (DAPPLE_PROBES_LOBE_SMOOTH + (float3(0.0, -0.13333333, -0.25) * share));
}

float2 dapple_probes_environment(float n_v, float roughness_1)
{
    float2 at_4 = (clamp(float2(sqrt(max(n_v, 0.0)), roughness_1), (0.0).xx, (1.0).xx) * 31.0);
    uint2 cell = min(dapple_probes_naga_f2u32(at_4), (30u).xx);
    float2 f_3 = (at_4 - float2(cell));
    uint first = ((cell.y * 32u) + cell.x);
    uint second = (first + 32u);
    const float2 _e25 = dapple_probes_environment_entry(first);
    const float2 _e28 = dapple_probes_environment_entry((first + 1u));
    float2 low = (_e25 + ((_e28 - _e25) * f_3.x));
    const float2 _e33 = dapple_probes_environment_entry(second);
    const float2 _e36 = dapple_probes_environment_entry((second + 1u));
    float2 high = (_e33 + ((_e36 - _e33) * f_3.x));
    return (low + ((high - low) * f_3.y));
}

float3 dapple_probes_lobe_direction(float3 n_2, float3 v_2, float roughness_2)
{
    float3 mirror = ((n_2 * (2.0 * dot(n_2, v_2))) - v_2);
    float alpha = clamp((roughness_2 * roughness_2), 0.0, 1.0);
    float smooth = (1.0 - alpha);
    float share_1 = (smooth * (sqrt(smooth) + alpha));
    float3 d_2 = (n_2 + ((mirror - n_2) * share_1));
    float size = length(d_2);
    return ((size > 1e-30) ? (d_2 / (size).xxx) : n_2);
}

DappleProbesIncomingLight dapple_probes_incoming_light(float3 radiance_1[9], float3 n_3, float3 v_3, float roughness_3)
{
    const float3 _e4 = dapple_probes_lobe_direction(n_3, v_3, roughness_3);
    const float3 _e6 = dapple_probes_convolved(radiance_1, DAPPLE_PROBES_COSINE, n_3);
    float3 irradiance = max(_e6, (0.0).xxx);
    const float3 _e10 = dapple_probes_lobe(roughness_3);
    const float3 _e11 = dapple_probes_convolved(radiance_1, _e10, _e4);
    float3 filtered = max(_e11, (0.0).xxx);
    const DappleProbesIncomingLight dappleprobesincominglight = dapple_probes_ConstructDappleProbesIncomingLight(irradiance, filtered);
    return dappleprobesincominglight;
}

DappleProbesIndirect dapple_probes_shade(float3 radiance_2[9], float3 base_color, float metallic, float roughness_4, float3 n_4, float3 v_4)
{
    DappleProbesIndirect out_ = (DappleProbesIndirect)0;

    float roughness_5 = clamp(roughness_4, 0.0, 1.0);
    float metallic_1 = clamp(metallic, 0.0, 1.0);
    const float2 _e13 = dapple_probes_environment(dot(n_4, v_4), roughness_5);
    float3 f0_ = lerp((0.04).xxx, base_color, metallic_1);
    const DappleProbesIncomingLight _e17 = dapple_probes_incoming_light(radiance_2, n_4, v_4, roughness_5);
    float left = (1.0 - ((DAPPLE_PROBES_DIELECTRIC * _e13.x) + _e13.y));
    out_.diffuse = ((base_color * _e17.irradiance) * (((1.0 - metallic_1) * left) / DAPPLE_PROBES_PI));
    out_.glossy = (_e17.filtered * ((f0_ * _e13.x) + (_e13.y).xxx));
    DappleProbesIndirect _e43 = out_;
    const DappleProbesIndirect dappleprobesindirect = _e43;
    return dappleprobesindirect;
}
