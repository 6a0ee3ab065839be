// Generated from `embed/shaders/wgsl/points.wgsl` and `points_buffers.wgsl`.
// Needs `#version 310 es` and `precision highp` for float and int.

struct DapplePointsTrack {
    uint first_bucket;
    uint first_cell;
    uint bucket_count;
    uint cell_count;
    uvec3 dims;
    uint widths;
    float cell_edge;
    float radius;
    uvec2 pad;
    vec4 row_x;
    vec4 row_y;
    vec4 row_z;
};
struct DapplePointsResult {
    float ao;
    uint case_and_points;
};
struct DapplePointsPoint {
    vec3 position;
    vec3 normal;
    float ao;
};
const uint DAPPLE_POINTS_NONE = 4294967295u;
const uint DAPPLE_POINTS_EMPTY = 4294967295u;
const float DAPPLE_POINTS_T_N = 0.1;
const float DAPPLE_POINTS_T_D = 0.7;
const float DAPPLE_POINTS_FILL_WEIGHT = 0.1;
const uint DAPPLE_POINTS_FALLBACK_FILL = 1u;
const uint DAPPLE_POINTS_CASE_FOUND = 0u;
const uint DAPPLE_POINTS_CASE_FILLED = 1u;
const uint DAPPLE_POINTS_CASE_NONE = 2u;

// Define DAPPLE_POINTS_CUSTOM to bring these functions.
#ifndef DAPPLE_POINTS_CUSTOM
layout(std430, binding = 1) readonly buffer dapple_points_type_7_block_0Fragment { uint dapple_points_buckets[][8]; };
layout(std430, binding = 2) readonly buffer dapple_points_type_7_block_1Fragment { uint dapple_points_cells[][8]; };
layout(std430, binding = 0) readonly buffer dapple_points_type_9_block_2Fragment { DapplePointsTrack dapple_points_tracks[]; };
uint dapple_points_bucket(uint bucket, uint entry) {
    uint _e5 = dapple_points_buckets[bucket][entry];
    return _e5;
}
uint dapple_points_cell(uint cell, uint word_3) {
    uint _e5 = dapple_points_cells[cell][word_3];
    return _e5;
}
DapplePointsTrack dapple_points_track(uint track) {
    DapplePointsTrack _e3 = dapple_points_tracks[track];
    return _e3;
}

#else
uint dapple_points_bucket(uint bucket, uint entry);
uint dapple_points_cell(uint cell, uint word_3);
DapplePointsTrack dapple_points_track(uint track);
#endif

uint dapple_points_hash(uvec3 p, DapplePointsTrack t) {
    return (((p.x + ((p.y * t.dims.x) * 17u)) + (((p.z * t.dims.x) * t.dims.y) * 31u)) % t.bucket_count);
}

uint dapple_points_key(uvec3 p_1, DapplePointsTrack t_1) {
    return (p_1.x + (t_1.dims.x * (p_1.y + (t_1.dims.y * p_1.z))));
}

uint dapple_points_field(uint word, uint shift, uint bits) {
    return ((word >> shift) & ((1u << bits) - 1u));
}

float dapple_points_octahedral(uint word_1, uint shift_1, uint bits_1) {
    int code = (int((word_1 << ((32u - shift_1) - bits_1))) >> (32u - bits_1));
    return max((float(code) / float(((1 << (bits_1 - 1u)) - 1))), -1.0);
}

vec3 dapple_points_octahedron_decode(float u, float v) {
    float z = ((1.0 - abs(u)) - abs(v));
    if ((z < 0.0)) {
        float x_1 = ((1.0 - abs(v)) * ((u < 0.0) ? -1.0 : 1.0));
        float y = ((1.0 - abs(u)) * ((v < 0.0) ? -1.0 : 1.0));
        return normalize(vec3(x_1, y, z));
    }
    return normalize(vec3(u, v, z));
}

DapplePointsPoint dapple_points_unpack(uint word_2, DapplePointsTrack t_2) {
    uint bp = (t_2.widths & 255u);
    uint bn = ((t_2.widths >> 8u) & 255u);
    uint ba = ((t_2.widths >> 16u) & 255u);
    uint _e16 = dapple_points_field(word_2, 0u, ba);
    float ao = (float(_e16) / float(((1u << ba) - 1u)));
    float _e24 = dapple_points_octahedral(word_2, ba, bn);
    float _e26 = dapple_points_octahedral(word_2, (ba + bn), bn);
    uint base = (ba + (2u * bn));
    uint _e30 = dapple_points_field(word_2, base, bp);
    uint _e33 = dapple_points_field(word_2, (base + bp), bp);
    uint _e38 = dapple_points_field(word_2, (base + (2u * bp)), bp);
    vec3 q = vec3(float(_e30), float(_e33), float(_e38));
    vec3 position_2 = (((q + vec3(0.5)) / vec3(float((1u << bp)))) * t_2.cell_edge);
    vec3 _e51 = dapple_points_octahedron_decode(_e24, _e26);
    return DapplePointsPoint(position_2, _e51, ao);
}

DapplePointsResult dapple_points_sample(DapplePointsTrack t_3, vec3 x, vec3 n, uint fallback) {
    float weight = 0.0;
    float weighted = 0.0;
    uint points = 0u;
    float fill = 0.0;
    float filled = 0.0;
    uint corner = 0u;
    bool local = false;
    uint entry_1 = 0u;
    bool local_1 = false;
    uint slot = 0u;
    float slope = 0.0;
    bool local_2 = false;
    bool local_3 = false;
    uint present_shift = (((3u * (t_3.widths & 255u)) + (2u * ((t_3.widths >> 8u) & 255u))) + ((t_3.widths >> 16u) & 255u));
    vec3 scaled = clamp((x / vec3(t_3.cell_edge)), vec3(-2.0), vec3(65537.0));
    vec3 base_1 = floor(scaled);
    vec3 near = (scaled - base_1);
    vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(near, vec3(0.5)));
    vec3 window = (abs((near - vec3(0.5))) * 2.0);
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
            uvec3 pick = (uvec3(_e62, (_e63 >> 1u), (_e66 >> 2u)) & uvec3(1u));
            vec3 offset = (vec3(pick) * side);
            ivec3 at = ivec3((base_1 + offset));
            if (!(any(lessThan(at, ivec3(0))))) {
                local = any(greaterThanEqual(at, ivec3(t_3.dims)));
            } else {
                local = true;
            }
            bool _e89 = local;
            if (_e89) {
                continue;
            }
            float cell_window = ((((pick.x == 1u) ? window.x : 1.0) * ((pick.y == 1u) ? window.y : 1.0)) * ((pick.z == 1u) ? window.z : 1.0));
            uint _e111 = dapple_points_key(uvec3(at), t_3);
            uint _e114 = dapple_points_hash(uvec3(at), t_3);
            uint bucket_1 = (t_3.first_bucket + _e114);
            vec3 x_cell = (x - (vec3(at) * t_3.cell_edge));
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
                    uint _e126 = dapple_points_bucket(bucket_1, _e125);
                    if ((_e126 == DAPPLE_POINTS_EMPTY)) {
                        break;
                    }
                    if (!((_e126 >= t_3.cell_count))) {
                        uint _e137 = dapple_points_cell((t_3.first_cell + _e126), 0u);
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
                            uint _e151 = dapple_points_cell((t_3.first_cell + _e126), (_e148 + 1u));
                            if ((((_e151 >> present_shift) & 1u) == 0u)) {
                                continue;
                            }
                            DapplePointsPoint _e157 = dapple_points_unpack(_e151, t_3);
                            float agreement = dot(_e157.normal, n);
                            if ((agreement <= DAPPLE_POINTS_T_N)) {
                                continue;
                            }
                            vec3 to_point = (_e157.position - x_cell);
                            float distance_ = length(to_point);
                            slope = 0.0;
                            if ((distance_ > 0.0)) {
                                slope = dot(_e157.normal, (to_point / vec3(distance_)));
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
        return DapplePointsResult(ao_1, (case_ | (_e255 << 8u)));
    }
    float _e260 = weight;
    if ((_e260 > 0.0)) {
        float _e263 = weighted;
        float _e264 = weight;
        uint _e267 = points;
        return DapplePointsResult((_e263 / _e264), (DAPPLE_POINTS_CASE_FOUND | (_e267 << 8u)));
    }
    return DapplePointsResult(1.0, 2u);
}

vec3 dapple_points_position(DapplePointsTrack t_4, vec3 position) {
    vec4 p_2 = vec4(position, 1.0);
    return vec3(dot(t_4.row_x, p_2), dot(t_4.row_y, p_2), dot(t_4.row_z, p_2));
}

vec3 dapple_points_normal(DapplePointsTrack t_5, vec3 normal) {
    vec3 x_2 = cross(t_5.row_y.xyz, t_5.row_z.xyz);
    vec3 y_1 = cross(t_5.row_z.xyz, t_5.row_x.xyz);
    vec3 z_1 = cross(t_5.row_x.xyz, t_5.row_y.xyz);
    float side_1 = ((dot(t_5.row_x.xyz, x_2) < 0.0) ? -1.0 : 1.0);
    return normalize((vec3(dot(x_2, normal), dot(y_1, normal), dot(z_1, normal)) * side_1));
}

float dapple_points_ao(uint track_1, vec3 position_1, vec3 normal_1, uint fallback_1) {
    if ((track_1 == DAPPLE_POINTS_NONE)) {
        return 1.0;
    }
    DapplePointsTrack _e7 = dapple_points_track(track_1);
    vec3 _e8 = dapple_points_position(_e7, position_1);
    vec3 _e9 = dapple_points_normal(_e7, normal_1);
    DapplePointsResult _e10 = dapple_points_sample(_e7, _e8, _e9, fallback_1);
    return _e10.ao;
}
