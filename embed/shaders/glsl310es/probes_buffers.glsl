// Generated from `embed/shaders/wgsl/probes.wgsl` and `probes_buffers.wgsl`.
// Needs `#version 310 es` and `precision highp` for float and int.

struct DappleProbesVolume {
    mat4x3 grid_from_world;
    uvec3 dims;
    uint side;
    vec3 spacing;
    float scale;
    float range;
};
struct DappleProbesIncomingLight {
    vec3 irradiance;
    vec3 filtered;
};
struct DappleProbesIndirect {
    vec3 diffuse;
    vec3 glossy;
};
const float DAPPLE_PROBES_PI = 3.1415927;
const float DAPPLE_PROBES_NORMAL_BIAS = 0.045;
const float DAPPLE_PROBES_VIEW_BIAS = 0.18;
const float DAPPLE_PROBES_WRAP = 0.2;
const float DAPPLE_PROBES_UNSEEN = 1e-6;
const float DAPPLE_PROBES_ABSENT = 1e-12;
const float DAPPLE_PROBES_CRUSH = 0.2;
const float DAPPLE_PROBES_DIELECTRIC = 0.04;
const vec3 DAPPLE_PROBES_LOBE_SMOOTH = vec3(1.0, 0.8, 0.5);
const vec3 DAPPLE_PROBES_LOBE_ROUGH = vec3(1.0, 0.6666667, 0.25);
const float DAPPLE_PROBES_ENVIRONMENT_SIDE = 32.0;
const vec3 DAPPLE_PROBES_COSINE = vec3(3.1415927, 2.0943952, 0.7853982);

// Define DAPPLE_PROBES_CUSTOM to bring these functions.
#ifndef DAPPLE_PROBES_CUSTOM
layout(binding = 12) uniform highp sampler3D dapple_probes_plane_a;
layout(binding = 13) uniform highp sampler3D dapple_probes_plane_b;
layout(binding = 14) uniform highp sampler3D dapple_probes_plane_c;
layout(binding = 15) uniform highp sampler3D dapple_probes_plane_d;
layout(binding = 16) uniform highp sampler3D dapple_probes_plane_e;
layout(binding = 17) uniform highp sampler3D dapple_probes_plane_f;
layout(binding = 18) uniform highp sampler3D dapple_probes_plane_g;
layout(std430, binding = 4) readonly buffer dapple_probes_type_8_block_0Fragment { uint dapple_probes_presence[]; };
layout(std430, binding = 5) readonly buffer dapple_probes_type_8_block_1Fragment { uint dapple_probes_blocks[]; };
layout(std430, binding = 3) readonly buffer dapple_probes_type_13_block_2Fragment { uvec2 dapple_probes_texels[]; };
layout(std430, binding = 6) readonly buffer dapple_probes_type_14_block_3Fragment { vec2 dapple_probes_environments[]; };
vec4[7] dapple_probes_filtered(vec3 uvw) {
    vec4 _e4 = textureLod(dapple_probes_plane_a, vec3(uvw), 0.0);
    vec4 _e8 = textureLod(dapple_probes_plane_b, vec3(uvw), 0.0);
    vec4 _e12 = textureLod(dapple_probes_plane_c, vec3(uvw), 0.0);
    vec4 _e16 = textureLod(dapple_probes_plane_d, vec3(uvw), 0.0);
    vec4 _e20 = textureLod(dapple_probes_plane_e, vec3(uvw), 0.0);
    vec4 _e24 = textureLod(dapple_probes_plane_f, vec3(uvw), 0.0);
    vec4 _e28 = textureLod(dapple_probes_plane_g, vec3(uvw), 0.0);
    return vec4[7](_e4, _e8, _e12, _e16, _e20, _e24, _e28);
}
bool dapple_probes_present(uint probe) {
    uint _e5 = dapple_probes_presence[(probe / 32u)];
    return (((_e5 >> (probe % 32u)) & 1u) == 1u);
}
uvec2 dapple_probes_visibility(uint texel) {
    uint _e5 = dapple_probes_blocks[(texel / 2u)];
    uint word = (_e5 >> (16u * (texel % 2u)));
    return uvec2((word & 255u), ((word >> 8u) & 255u));
}
vec4[7] dapple_probes_values(DappleProbesVolume volume_4, uint probe_3) {
    vec4 values[7] = vec4[7](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
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
            uvec2 bits = dapple_probes_texels[((_e17 * count) + probe_3)];
            uint _e22 = t_1;
            values[_e22] = vec4(unpackHalf2x16(bits.x), unpackHalf2x16(bits.y));
        }
    }
    vec4 _e32[7] = values;
    return _e32;
}
vec2 dapple_probes_environment_entry(uint entry) {
    vec2 _e3 = dapple_probes_environments[entry];
    return _e3;
}

#else
vec4[7] dapple_probes_filtered(vec3 uvw);
bool dapple_probes_present(uint probe);
uvec2 dapple_probes_visibility(uint texel);
vec4[7] dapple_probes_values(DappleProbesVolume volume_4, uint probe_3);
vec2 dapple_probes_environment_entry(uint entry);
#endif

vec3[9] dapple_probes_expansion(vec4 v[7]) {
    return vec3[9](v[0].xyz, vec3(v[0].w, v[1].xy), vec3(v[1].zw, v[2].x), v[2].yzw, v[3].xyz, vec3(v[3].w, v[4].xy), vec3(v[4].zw, v[5].x), v[5].yzw, v[6].xyz);
}

vec3[9] dapple_probes_trilinear(DappleProbesVolume volume, vec3 x) {
    vec4 sum[7] = vec4[7](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    uint t = 0u;
    vec3 dims = vec3(volume.dims);
    vec3 at_1 = clamp((x / volume.spacing), vec3(0.0), (dims - vec3(1.0)));
    vec3 uvw_1 = ((at_1 + vec3(0.5)) / dims);
    float s = volume.scale;
    vec4 _e17[7] = dapple_probes_filtered(uvw_1);
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
            vec4 _e26 = sum[_e24];
            sum[_e24] = (_e26 * s);
        }
    }
    vec4 _e31[7] = sum;
    vec3 _e32[9] = dapple_probes_expansion(_e31);
    return _e32;
}

uint dapple_probes_index_of(DappleProbesVolume volume_1, uvec3 at) {
    return (at.x + (volume_1.dims.x * (at.y + (volume_1.dims.y * at.z))));
}

vec2 dapple_probes_octahedral(vec3 d) {
    float sum_2 = ((abs(d.x) + abs(d.y)) + abs(d.z));
    if (!((sum_2 > 0.0))) {
        return vec2(0.0);
    }
    vec2 p = (d.xy / vec2(sum_2));
    if ((d.z < 0.0)) {
        vec2 signs = mix(vec2(1.0), vec2(-1.0), lessThan(p, vec2(0.0)));
        return ((vec2(1.0) - abs(p.yx)) * signs);
    }
    return p;
}

uint dapple_probes_fold(int row, int column, int n) {
    int row_1 = 0;
    int column_1 = 0;
    bool local = false;
    bool local_1 = false;
    row_1 = row;
    column_1 = column;
    int _e5 = column_1;
    if (!((_e5 < 0))) {
        int _e11 = column_1;
        local = (_e11 >= n);
    } else {
        local = true;
    }
    bool _e14 = local;
    if (_e14) {
        int _e17 = row_1;
        row_1 = ((n - 1) - _e17);
        int _e19 = column_1;
        column_1 = min(max(_e19, 0), (n - 1));
    }
    int _e24 = row_1;
    if (!((_e24 < 0))) {
        int _e30 = row_1;
        local_1 = (_e30 >= n);
    } else {
        local_1 = true;
    }
    bool _e33 = local_1;
    if (_e33) {
        int _e34 = row_1;
        row_1 = min(max(_e34, 0), (n - 1));
        int _e41 = column_1;
        column_1 = ((n - 1) - _e41);
    }
    int _e43 = row_1;
    int _e45 = column_1;
    return uint(min(max(((_e43 * n) + _e45), 0), ((n * n) - 1)));
}

vec2 dapple_probes_moments(DappleProbesVolume volume_2, uint probe_1, vec3 direction) {
    vec2 sums = vec2(0.0);
    int row_2 = 0;
    int column_2 = 0;
    int n_5 = int(volume_2.side);
    vec2 _e5 = dapple_probes_octahedral(direction);
    vec2 at_2 = (((_e5 + vec2(1.0)) * (0.5 * float(n_5))) - vec2(0.5));
    vec2 base = floor(at_2);
    vec2 f_1 = (at_2 - base);
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            int _e83 = row_2;
            row_2 = (_e83 + 1);
        }
        loop_init_1 = false;
        int _e23 = row_2;
        if ((_e23 < 2)) {
        } else {
            break;
        }
        {
            column_2 = 0;
            bool loop_init_2 = true;
            while(true) {
                if (!loop_init_2) {
                    int _e80 = column_2;
                    column_2 = (_e80 + 1);
                }
                loop_init_2 = false;
                int _e28 = column_2;
                if ((_e28 < 2)) {
                } else {
                    break;
                }
                {
                    int _e35 = row_2;
                    int _e43 = column_2;
                    float weight = (((_e35 == 1) ? f_1.y : (1.0 - f_1.y)) * ((_e43 == 1) ? f_1.x : (1.0 - f_1.x)));
                    int _e50 = row_2;
                    int _e54 = column_2;
                    uint _e56 = dapple_probes_fold((int(base.y) + _e50), (int(base.x) + _e54), n_5);
                    uvec2 _e61 = dapple_probes_visibility(((probe_1 * uint((n_5 * n_5))) + _e56));
                    vec2 metres = (vec2(_e61) * (volume_2.range / 255.0));
                    vec2 _e67 = sums;
                    sums = (_e67 + (weight * vec2(metres.x, ((metres.x * metres.x) + (metres.y * metres.y)))));
                }
            }
        }
    }
    vec2 _e85 = sums;
    return _e85;
}

float dapple_probes_share(DappleProbesVolume volume_3, uint probe_2, vec3 offset) {
    bool local_2 = false;
    float distance_ = length(offset);
    vec2 _e4 = dapple_probes_moments(volume_3, probe_2, offset);
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

vec3[9] dapple_probes_visibility_weighted(DappleProbesVolume volume_5, vec3 x_1, vec3 n_1, vec3 v_1) {
    vec4 sum_1[7] = vec4[7](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    vec4 plain[7] = vec4[7](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    float total = 0.0;
    uint corner = 0u;
    vec3 to_probe = vec3(0.0);
    float trust = 0.0;
    uint t_2 = 0u;
    uint t_3 = 0u;
    vec3 spacing = volume_5.spacing;
    float least = min(spacing.x, min(spacing.y, spacing.z));
    vec3 seen_at = (x_1 + (((n_1 * DAPPLE_PROBES_NORMAL_BIAS) + (v_1 * DAPPLE_PROBES_VIEW_BIAS)) * least));
    uvec3 last = (volume_5.dims - uvec3(1u));
    vec3 at_3 = clamp((x_1 / spacing), vec3(0.0), vec3(last));
    uvec3 base_1 = min(uvec3(at_3), (max(last, uvec3(1u)) - uvec3(1u)));
    vec3 f_2 = (at_3 - vec3(base_1));
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
            uvec3 pick = uvec3((_e47 & 1u), ((_e50 >> 1u) & 1u), (_e55 >> 2u));
            vec3 sides = mix((vec3(1.0) - f_2), f_2, equal(pick, uvec3(1u)));
            float trilinear_weight = ((sides.x * sides.y) * sides.z);
            uvec3 place = min((base_1 + pick), last);
            uint _e73 = dapple_probes_index_of(volume_5, place);
            vec3 probe_4 = (vec3(place) * spacing);
            to_probe = (probe_4 - x_1);
            vec3 _e78 = to_probe;
            float distance_1 = length(_e78);
            vec3 _e80 = to_probe;
            to_probe = ((distance_1 > 1e-30) ? (_e80 / vec3(distance_1)) : n_1);
            vec3 _e86 = to_probe;
            float half_cosine = (0.5 + (0.5 * dot(_e86, n_1)));
            float wrap = ((half_cosine * half_cosine) + DAPPLE_PROBES_WRAP);
            trust = 1.0;
            bool _e97 = dapple_probes_present(_e73);
            if (!(_e97)) {
                trust = DAPPLE_PROBES_ABSENT;
            } else {
                if ((volume_5.side > 0u)) {
                    float _e104 = dapple_probes_share(volume_5, _e73, (seen_at - probe_4));
                    trust = max(_e104, DAPPLE_PROBES_UNSEEN);
                }
            }
            float _e108 = trust;
            float weight_1 = ((trilinear_weight * wrap) * _e108);
            float _e110 = total;
            total = (_e110 + weight_1);
            vec4 _e112[7] = dapple_probes_values(volume_5, _e73);
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
                    vec4 _e120 = sum_1[_e118];
                    uint _e121 = t_2;
                    sum_1[_e118] = (_e120 + (_e112[_e121] * weight_1));
                    uint _e125 = t_2;
                    vec4 _e127 = plain[_e125];
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
                vec4 _e150 = sum_1[_e148];
                float _e151 = total;
                sum_1[_e146] = ((_e150 / vec4(_e151)) * volume_5.scale);
            } else {
                uint _e156 = t_3;
                uint _e158 = t_3;
                vec4 _e160 = plain[_e158];
                sum_1[_e156] = (_e160 * volume_5.scale);
            }
        }
    }
    vec4 _e166[7] = sum_1;
    vec3 _e167[9] = dapple_probes_expansion(_e166);
    return _e167;
}

vec3 dapple_probes_convolved(vec3 c[9], vec3 factors, vec3 d_1) {
    float x_2 = d_1.x;
    float y = d_1.y;
    float z = d_1.z;
    vec3 band1_ = (((c[1] * (0.4886025 * y)) + (c[2] * (0.4886025 * z))) + (c[3] * (0.4886025 * x_2)));
    vec3 band2_ = (((((c[4] * ((1.0925484 * x_2) * y)) + (c[5] * ((1.0925484 * y) * z))) + (c[6] * (0.31539157 * (((3.0 * z) * z) - 1.0)))) + (c[7] * ((1.0925484 * x_2) * z))) + (c[8] * (0.5462742 * ((x_2 * x_2) - (y * y)))));
    return (((c[0] * (0.28209478 * factors.x)) + (band1_ * factors.y)) + (band2_ * factors.z));
}

vec3 dapple_probes_lobe(float roughness) {
    float share = clamp(roughness, 0.0, 1.0);
    return (DAPPLE_PROBES_LOBE_SMOOTH + (vec3(0.0, -0.13333333, -0.25) * share));
}

vec2 dapple_probes_environment(float n_v, float roughness_1) {
    vec2 at_4 = (clamp(vec2(sqrt(max(n_v, 0.0)), roughness_1), vec2(0.0), vec2(1.0)) * 31.0);
    uvec2 cell = min(uvec2(at_4), uvec2(30u));
    vec2 f_3 = (at_4 - vec2(cell));
    uint first = ((cell.y * 32u) + cell.x);
    uint second = (first + 32u);
    vec2 _e25 = dapple_probes_environment_entry(first);
    vec2 _e28 = dapple_probes_environment_entry((first + 1u));
    vec2 low = (_e25 + ((_e28 - _e25) * f_3.x));
    vec2 _e33 = dapple_probes_environment_entry(second);
    vec2 _e36 = dapple_probes_environment_entry((second + 1u));
    vec2 high = (_e33 + ((_e36 - _e33) * f_3.x));
    return (low + ((high - low) * f_3.y));
}

vec3 dapple_probes_lobe_direction(vec3 n_2, vec3 v_2, float roughness_2) {
    vec3 mirror = ((n_2 * (2.0 * dot(n_2, v_2))) - v_2);
    float alpha = clamp((roughness_2 * roughness_2), 0.0, 1.0);
    float smooth_ = (1.0 - alpha);
    float share_1 = (smooth_ * (sqrt(smooth_) + alpha));
    vec3 d_2 = (n_2 + ((mirror - n_2) * share_1));
    float size = length(d_2);
    return ((size > 1e-30) ? (d_2 / vec3(size)) : n_2);
}

DappleProbesIncomingLight dapple_probes_incoming_light(vec3 radiance_1[9], vec3 n_3, vec3 v_3, float roughness_3) {
    vec3 _e4 = dapple_probes_lobe_direction(n_3, v_3, roughness_3);
    vec3 _e6 = dapple_probes_convolved(radiance_1, DAPPLE_PROBES_COSINE, n_3);
    vec3 irradiance = max(_e6, vec3(0.0));
    vec3 _e10 = dapple_probes_lobe(roughness_3);
    vec3 _e11 = dapple_probes_convolved(radiance_1, _e10, _e4);
    vec3 filtered = max(_e11, vec3(0.0));
    return DappleProbesIncomingLight(irradiance, filtered);
}

DappleProbesIndirect dapple_probes_shade(vec3 radiance_2[9], vec3 base_color, float metallic, float roughness_4, vec3 n_4, vec3 v_4) {
    DappleProbesIndirect out_ = DappleProbesIndirect(vec3(0.0), vec3(0.0));
    float roughness_5 = clamp(roughness_4, 0.0, 1.0);
    float metallic_1 = clamp(metallic, 0.0, 1.0);
    vec2 _e13 = dapple_probes_environment(dot(n_4, v_4), roughness_5);
    vec3 f0_ = mix(vec3(0.04), base_color, metallic_1);
    DappleProbesIncomingLight _e17 = dapple_probes_incoming_light(radiance_2, n_4, v_4, roughness_5);
    float left = (1.0 - ((DAPPLE_PROBES_DIELECTRIC * _e13.x) + _e13.y));
    out_.diffuse = ((base_color * _e17.irradiance) * (((1.0 - metallic_1) * left) / DAPPLE_PROBES_PI));
    out_.glossy = (_e17.filtered * ((f0_ * _e13.x) + vec3(_e13.y)));
    DappleProbesIndirect _e43 = out_;
    return _e43;
}
