// Generated from `embed/shaders/wgsl/probes.wgsl` and `probes_textures.wgsl`.
// Needs Metal 2.1; what a function reads is passed to it.

#include <metal_stdlib>
#include <simd/simd.h>
using metal::uint;
struct DappleProbesVolume {
    metal::float4x3 grid_from_world;
    metal::packed_uint3 dims;
    uint side;
    metal::packed_float3 spacing;
    float scale;
    float range;
    char _pad6[12];
};
struct DappleProbesFlat {
    metal::float4 inner[7];
};
struct DappleProbesL2_ {
    metal::float3 inner[9];
};
struct DappleProbesIncomingLight {
    metal::float3 irradiance;
    metal::float3 filtered;
};
struct DappleProbesIndirect {
    metal::float3 diffuse;
    metal::float3 glossy;
};
constant float DAPPLE_PROBES_PI = 3.1415927;
constant float DAPPLE_PROBES_NORMAL_BIAS = 0.045;
constant float DAPPLE_PROBES_VIEW_BIAS = 0.18;
constant float DAPPLE_PROBES_WRAP = 0.2;
constant float DAPPLE_PROBES_UNSEEN = 0.000001;
constant float DAPPLE_PROBES_ABSENT = 0.000000000001;
constant float DAPPLE_PROBES_CRUSH = 0.2;
constant float DAPPLE_PROBES_DIELECTRIC = 0.04;
constant metal::float3 DAPPLE_PROBES_LOBE_SMOOTH = metal::float3(1.0, 0.8, 0.5);
constant metal::float3 DAPPLE_PROBES_LOBE_ROUGH = metal::float3(1.0, 0.6666667, 0.25);
constant float DAPPLE_PROBES_ENVIRONMENT_SIDE = 32.0;
constant metal::float3 DAPPLE_PROBES_COSINE = metal::float3(3.1415927, 2.0943952, 0.7853982);
uint dapple_probes_naga_mod(uint lhs, uint rhs) {
    return lhs % metal::select(rhs, 1u, rhs == 0u);
}
uint dapple_probes_naga_div(uint lhs, uint rhs) {
    return lhs / metal::select(rhs, 1u, rhs == 0u);
}
int dapple_probes_naga_f2i32(float value) {
    return static_cast<int>(metal::clamp(value, -2147483600.0, 2147483500.0));
}
metal::uint3 dapple_probes_naga_f2u32(metal::float3 value) {
    return static_cast<metal::uint3>(metal::clamp(value, 0.0, 4294967000.0));
}
metal::uint2 dapple_probes_naga_f2u32(metal::float2 value) {
    return static_cast<metal::uint2>(metal::clamp(value, 0.0, 4294967000.0));
}

DappleProbesL2_ dapple_probes_expansion(
    DappleProbesFlat v
) {
    return DappleProbesL2_ {{v.inner[0].xyz, metal::float3(v.inner[0].w, v.inner[1].xy), metal::float3(v.inner[1].zw, v.inner[2].x), v.inner[2].yzw, v.inner[3].xyz, metal::float3(v.inner[3].w, v.inner[4].xy), metal::float3(v.inner[4].zw, v.inner[5].x), v.inner[5].yzw, v.inner[6].xyz}};
}

DappleProbesFlat dapple_probes_filtered(
    metal::float3 uvw,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_a,
    metal::sampler dapple_probes_filtering,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_b,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_c,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_d,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_e,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_f,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_g
) {
    metal::float4 _e4 = dapple_probes_plane_a.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e8 = dapple_probes_plane_b.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e12 = dapple_probes_plane_c.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e16 = dapple_probes_plane_d.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e20 = dapple_probes_plane_e.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e24 = dapple_probes_plane_f.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    metal::float4 _e28 = dapple_probes_plane_g.sample(dapple_probes_filtering, uvw, metal::level(0.0));
    return DappleProbesFlat {{_e4, _e8, _e12, _e16, _e20, _e24, _e28}};
}

DappleProbesL2_ dapple_probes_trilinear(
    DappleProbesVolume volume,
    metal::float3 x,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_a,
    metal::sampler dapple_probes_filtering,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_b,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_c,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_d,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_e,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_f,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_g
) {
    DappleProbesFlat sum = {};
    uint t = 0u;
    metal::float3 dims = static_cast<metal::float3>(volume.dims);
    metal::float3 at_1 = metal::clamp(x / volume.spacing, metal::float3(0.0), dims - metal::float3(1.0));
    metal::float3 uvw_1 = (at_1 + metal::float3(0.5)) / dims;
    float s = volume.scale;
    DappleProbesFlat _e17 = dapple_probes_filtered(uvw_1, dapple_probes_plane_a, dapple_probes_filtering, dapple_probes_plane_b, dapple_probes_plane_c, dapple_probes_plane_d, dapple_probes_plane_e, dapple_probes_plane_f, dapple_probes_plane_g);
    sum = _e17;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e29 = t;
            t = _e29 + 1u;
        }
        loop_init = false;
        uint _e21 = t;
        if (_e21 < 7u) {
        } else {
            break;
        }
        {
            uint _e24 = t;
            metal::float4 _e26 = sum.inner[_e24];
            sum.inner[_e24] = _e26 * s;
        }
    }
    DappleProbesFlat _e31 = sum;
    DappleProbesL2_ _e32 = dapple_probes_expansion(_e31);
    return _e32;
}

uint dapple_probes_index_of(
    DappleProbesVolume volume_1,
    metal::uint3 at
) {
    return at.x + (volume_1.dims[0] * (at.y + (volume_1.dims[1] * at.z)));
}

bool dapple_probes_present(
    uint probe,
    metal::texture2d<uint, metal::access::sample> dapple_probes_presence
) {
    uint width = metal::uint2(dapple_probes_presence.get_width(), dapple_probes_presence.get_height()).x;
    metal::uint4 _e9 = dapple_probes_presence.read(metal::uint2(metal::uint2(dapple_probes_naga_mod(probe, width), dapple_probes_naga_div(probe, width))), 0);
    return _e9.x != 0u;
}

metal::float2 dapple_probes_octahedral(
    metal::float3 d
) {
    float sum_2 = (metal::abs(d.x) + metal::abs(d.y)) + metal::abs(d.z);
    if (!((sum_2 > 0.0))) {
        return metal::float2(0.0);
    }
    metal::float2 p = d.xy / metal::float2(sum_2);
    if (d.z < 0.0) {
        metal::float2 signs = metal::select(metal::float2(1.0), metal::float2(-1.0), p < metal::float2(0.0));
        return (metal::float2(1.0) - metal::abs(p.yx)) * signs;
    }
    return p;
}

uint dapple_probes_fold(
    int row,
    int column,
    int n
) {
    int row_1 = {};
    int column_1 = {};
    bool local = {};
    bool local_1 = {};
    row_1 = row;
    column_1 = column;
    int _e5 = column_1;
    if (!((_e5 < 0))) {
        int _e11 = column_1;
        local = _e11 >= n;
    } else {
        local = true;
    }
    bool _e14 = local;
    if (_e14) {
        int _e17 = row_1;
        row_1 = as_type<int>(as_type<uint>(as_type<int>(as_type<uint>(n) - as_type<uint>(1))) - as_type<uint>(_e17));
        int _e19 = column_1;
        column_1 = metal::clamp(_e19, 0, as_type<int>(as_type<uint>(n) - as_type<uint>(1)));
    }
    int _e24 = row_1;
    if (!((_e24 < 0))) {
        int _e30 = row_1;
        local_1 = _e30 >= n;
    } else {
        local_1 = true;
    }
    bool _e33 = local_1;
    if (_e33) {
        int _e34 = row_1;
        row_1 = metal::clamp(_e34, 0, as_type<int>(as_type<uint>(n) - as_type<uint>(1)));
        int _e41 = column_1;
        column_1 = as_type<int>(as_type<uint>(as_type<int>(as_type<uint>(n) - as_type<uint>(1))) - as_type<uint>(_e41));
    }
    int _e43 = row_1;
    int _e45 = column_1;
    return static_cast<uint>(metal::clamp(as_type<int>(as_type<uint>(as_type<int>(as_type<uint>(_e43) * as_type<uint>(n))) + as_type<uint>(_e45)), 0, as_type<int>(as_type<uint>(as_type<int>(as_type<uint>(n) * as_type<uint>(n))) - as_type<uint>(1))));
}

metal::uint2 dapple_probes_visibility(
    uint texel,
    metal::texture2d<uint, metal::access::sample> dapple_probes_blocks
) {
    uint width_1 = metal::uint2(dapple_probes_blocks.get_width(), dapple_probes_blocks.get_height()).x;
    metal::uint4 _e9 = dapple_probes_blocks.read(metal::uint2(metal::uint2(dapple_probes_naga_mod(texel, width_1), dapple_probes_naga_div(texel, width_1))), 0);
    return _e9.xy;
}

metal::float2 dapple_probes_moments(
    DappleProbesVolume volume_2,
    uint probe_1,
    metal::float3 direction,
    metal::texture2d<uint, metal::access::sample> dapple_probes_blocks
) {
    metal::float2 sums = metal::float2(0.0);
    int row_2 = 0;
    int column_2 = {};
    int n_5 = static_cast<int>(volume_2.side);
    metal::float2 _e5 = dapple_probes_octahedral(direction);
    metal::float2 at_2 = ((_e5 + metal::float2(1.0)) * (0.5 * static_cast<float>(n_5))) - metal::float2(0.5);
    metal::float2 base = metal::floor(at_2);
    metal::float2 f_1 = at_2 - base;
    bool loop_init_1 = true;
    while(true) {
        if (!loop_init_1) {
            int _e83 = row_2;
            row_2 = as_type<int>(as_type<uint>(_e83) + as_type<uint>(1));
        }
        loop_init_1 = false;
        int _e23 = row_2;
        if (_e23 < 2) {
        } else {
            break;
        }
        {
            column_2 = 0;
            bool loop_init_2 = true;
            while(true) {
                if (!loop_init_2) {
                    int _e80 = column_2;
                    column_2 = as_type<int>(as_type<uint>(_e80) + as_type<uint>(1));
                }
                loop_init_2 = false;
                int _e28 = column_2;
                if (_e28 < 2) {
                } else {
                    break;
                }
                {
                    int _e35 = row_2;
                    int _e43 = column_2;
                    float weight = ((_e35 == 1) ? f_1.y : (1.0 - f_1.y)) * ((_e43 == 1) ? f_1.x : (1.0 - f_1.x));
                    int _e50 = row_2;
                    int _e54 = column_2;
                    uint _e56 = dapple_probes_fold(as_type<int>(as_type<uint>(dapple_probes_naga_f2i32(base.y)) + as_type<uint>(_e50)), as_type<int>(as_type<uint>(dapple_probes_naga_f2i32(base.x)) + as_type<uint>(_e54)), n_5);
                    metal::uint2 _e61 = dapple_probes_visibility((probe_1 * static_cast<uint>(as_type<int>(as_type<uint>(n_5) * as_type<uint>(n_5)))) + _e56, dapple_probes_blocks);
                    metal::float2 metres = static_cast<metal::float2>(_e61) * (volume_2.range / 255.0);
                    metal::float2 _e67 = sums;
                    sums = _e67 + (weight * metal::float2(metres.x, (metres.x * metres.x) + (metres.y * metres.y)));
                }
            }
        }
    }
    metal::float2 _e85 = sums;
    return _e85;
}

float dapple_probes_share(
    DappleProbesVolume volume_3,
    uint probe_2,
    metal::float3 offset,
    metal::texture2d<uint, metal::access::sample> dapple_probes_blocks
) {
    bool local_2 = {};
    float distance = metal::length(offset);
    metal::float2 _e4 = dapple_probes_moments(volume_3, probe_2, offset, dapple_probes_blocks);
    float mean = _e4.x;
    float code = volume_3.range / 255.0;
    if (!((distance <= mean))) {
        local_2 = mean >= (volume_3.range - (0.5 * code));
    } else {
        local_2 = true;
    }
    bool _e19 = local_2;
    if (_e19) {
        return 1.0;
    }
    float variance = metal::max(_e4.y - (mean * mean), code * code);
    float beyond = distance - mean;
    float bound = variance / (variance + (beyond * beyond));
    float cubed = (bound * bound) * bound;
    float crushed = metal::min(cubed / DAPPLE_PROBES_CRUSH, 1.0);
    return cubed * (crushed * crushed);
}

DappleProbesFlat dapple_probes_values(
    DappleProbesVolume volume_4,
    uint probe_3,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_a,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_b,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_c,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_d,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_e,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_f,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_g
) {
    uint row_3 = dapple_probes_naga_div(probe_3, volume_4.dims[0]);
    metal::uint3 at_3 = metal::uint3(dapple_probes_naga_mod(probe_3, volume_4.dims[0]), dapple_probes_naga_mod(row_3, volume_4.dims[1]), dapple_probes_naga_div(row_3, volume_4.dims[1]));
    metal::float4 _e17 = dapple_probes_plane_a.read(metal::uint3(at_3), 0);
    metal::float4 _e20 = dapple_probes_plane_b.read(metal::uint3(at_3), 0);
    metal::float4 _e23 = dapple_probes_plane_c.read(metal::uint3(at_3), 0);
    metal::float4 _e26 = dapple_probes_plane_d.read(metal::uint3(at_3), 0);
    metal::float4 _e29 = dapple_probes_plane_e.read(metal::uint3(at_3), 0);
    metal::float4 _e32 = dapple_probes_plane_f.read(metal::uint3(at_3), 0);
    metal::float4 _e35 = dapple_probes_plane_g.read(metal::uint3(at_3), 0);
    return DappleProbesFlat {{_e17, _e20, _e23, _e26, _e29, _e32, _e35}};
}

DappleProbesL2_ dapple_probes_visibility_weighted(
    DappleProbesVolume volume_5,
    metal::float3 x_1,
    metal::float3 n_1,
    metal::float3 v_1,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_a,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_b,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_c,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_d,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_e,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_f,
    metal::texture3d<float, metal::access::sample> dapple_probes_plane_g,
    metal::texture2d<uint, metal::access::sample> dapple_probes_presence,
    metal::texture2d<uint, metal::access::sample> dapple_probes_blocks
) {
    DappleProbesFlat sum_1 = DappleProbesFlat {};
    DappleProbesFlat plain = DappleProbesFlat {};
    float total = 0.0;
    uint corner = 0u;
    metal::float3 to_probe = {};
    float trust = {};
    uint t_1 = {};
    uint t_2 = 0u;
    metal::float3 spacing = volume_5.spacing;
    float least = metal::min(volume_5.spacing[0], metal::min(volume_5.spacing[1], volume_5.spacing[2]));
    metal::float3 seen_at = x_1 + (((n_1 * DAPPLE_PROBES_NORMAL_BIAS) + (v_1 * DAPPLE_PROBES_VIEW_BIAS)) * least);
    metal::uint3 last = volume_5.dims - metal::uint3(1u);
    metal::float3 at_4 = metal::clamp(x_1 / spacing, metal::float3(0.0), static_cast<metal::float3>(last));
    metal::uint3 base_1 = metal::min(dapple_probes_naga_f2u32(at_4), metal::max(last, metal::uint3(1u)) - metal::uint3(1u));
    metal::float3 f_2 = at_4 - static_cast<metal::float3>(base_1);
    bool loop_init_3 = true;
    while(true) {
        if (!loop_init_3) {
            uint _e136 = corner;
            corner = _e136 + 1u;
        }
        loop_init_3 = false;
        uint _e44 = corner;
        if (_e44 < 8u) {
        } else {
            break;
        }
        {
            uint _e47 = corner;
            uint _e50 = corner;
            uint _e55 = corner;
            metal::uint3 pick = metal::uint3(_e47 & 1u, (_e50 >> 1u) & 1u, _e55 >> 2u);
            metal::float3 sides = metal::select(metal::float3(1.0) - f_2, f_2, pick == metal::uint3(1u));
            float trilinear_weight = (sides.x * sides.y) * sides.z;
            metal::uint3 place = metal::min(base_1 + pick, last);
            uint _e73 = dapple_probes_index_of(volume_5, place);
            metal::float3 probe_4 = static_cast<metal::float3>(place) * spacing;
            to_probe = probe_4 - x_1;
            metal::float3 _e78 = to_probe;
            float distance_1 = metal::length(_e78);
            metal::float3 _e80 = to_probe;
            to_probe = (distance_1 > 0.000000000000000000000000000001) ? (_e80 / metal::float3(distance_1)) : n_1;
            metal::float3 _e86 = to_probe;
            float half_cosine = 0.5 + (0.5 * metal::dot(_e86, n_1));
            float wrap = (half_cosine * half_cosine) + DAPPLE_PROBES_WRAP;
            trust = 1.0;
            bool _e97 = dapple_probes_present(_e73, dapple_probes_presence);
            if (!(_e97)) {
                trust = DAPPLE_PROBES_ABSENT;
            } else {
                if (volume_5.side > 0u) {
                    float _e104 = dapple_probes_share(volume_5, _e73, seen_at - probe_4, dapple_probes_blocks);
                    trust = metal::max(_e104, DAPPLE_PROBES_UNSEEN);
                }
            }
            float _e108 = trust;
            float weight_1 = (trilinear_weight * wrap) * _e108;
            float _e110 = total;
            total = _e110 + weight_1;
            DappleProbesFlat _e112 = dapple_probes_values(volume_5, _e73, dapple_probes_plane_a, dapple_probes_plane_b, dapple_probes_plane_c, dapple_probes_plane_d, dapple_probes_plane_e, dapple_probes_plane_f, dapple_probes_plane_g);
            t_1 = 0u;
            bool loop_init_4 = true;
            while(true) {
                if (!loop_init_4) {
                    uint _e133 = t_1;
                    t_1 = _e133 + 1u;
                }
                loop_init_4 = false;
                uint _e115 = t_1;
                if (_e115 < 7u) {
                } else {
                    break;
                }
                {
                    uint _e118 = t_1;
                    metal::float4 _e120 = sum_1.inner[_e118];
                    uint _e121 = t_1;
                    sum_1.inner[_e118] = _e120 + (_e112.inner[_e121] * weight_1);
                    uint _e125 = t_1;
                    metal::float4 _e127 = plain.inner[_e125];
                    uint _e128 = t_1;
                    plain.inner[_e125] = _e127 + (_e112.inner[_e128] * trilinear_weight);
                }
            }
        }
    }
    bool loop_init_5 = true;
    while(true) {
        if (!loop_init_5) {
            uint _e164 = t_2;
            t_2 = _e164 + 1u;
        }
        loop_init_5 = false;
        uint _e140 = t_2;
        if (_e140 < 7u) {
        } else {
            break;
        }
        {
            float _e143 = total;
            if (_e143 > 0.0) {
                uint _e146 = t_2;
                uint _e148 = t_2;
                metal::float4 _e150 = sum_1.inner[_e148];
                float _e151 = total;
                sum_1.inner[_e146] = (_e150 / metal::float4(_e151)) * volume_5.scale;
            } else {
                uint _e156 = t_2;
                uint _e158 = t_2;
                metal::float4 _e160 = plain.inner[_e158];
                sum_1.inner[_e156] = _e160 * volume_5.scale;
            }
        }
    }
    DappleProbesFlat _e166 = sum_1;
    DappleProbesL2_ _e167 = dapple_probes_expansion(_e166);
    return _e167;
}

metal::float3 dapple_probes_convolved(
    DappleProbesL2_ c,
    metal::float3 factors,
    metal::float3 d_1
) {
    float x_2 = d_1.x;
    float y = d_1.y;
    float z = d_1.z;
    metal::float3 band1_ = ((c.inner[1] * (0.4886025 * y)) + (c.inner[2] * (0.4886025 * z))) + (c.inner[3] * (0.4886025 * x_2));
    metal::float3 band2_ = ((((c.inner[4] * ((1.0925484 * x_2) * y)) + (c.inner[5] * ((1.0925484 * y) * z))) + (c.inner[6] * (0.31539157 * (((3.0 * z) * z) - 1.0)))) + (c.inner[7] * ((1.0925484 * x_2) * z))) + (c.inner[8] * (0.5462742 * ((x_2 * x_2) - (y * y))));
    return ((c.inner[0] * (0.28209478 * factors.x)) + (band1_ * factors.y)) + (band2_ * factors.z);
}

metal::float3 dapple_probes_lobe(
    float roughness
) {
    float share = metal::clamp(roughness, 0.0, 1.0);
    return DAPPLE_PROBES_LOBE_SMOOTH + (metal::float3(0.0, -0.13333333, -0.25) * share);
}

metal::float2 dapple_probes_environment_entry(
    uint entry,
    metal::texture2d<float, metal::access::sample> dapple_probes_environments
) {
    metal::float4 _e7 = dapple_probes_environments.read(metal::uint2(metal::uint2(dapple_probes_naga_mod(entry, 32u), dapple_probes_naga_div(entry, 32u))), 0);
    return _e7.xy;
}

metal::float2 dapple_probes_environment(
    float n_v,
    float roughness_1,
    metal::texture2d<float, metal::access::sample> dapple_probes_environments
) {
    metal::float2 at_5 = metal::clamp(metal::float2(metal::sqrt(metal::max(n_v, 0.0)), roughness_1), metal::float2(0.0), metal::float2(1.0)) * 31.0;
    metal::uint2 cell = metal::min(dapple_probes_naga_f2u32(at_5), metal::uint2(30u));
    metal::float2 f_3 = at_5 - static_cast<metal::float2>(cell);
    uint first = (cell.y * 32u) + cell.x;
    uint second = first + 32u;
    metal::float2 _e25 = dapple_probes_environment_entry(first, dapple_probes_environments);
    metal::float2 _e28 = dapple_probes_environment_entry(first + 1u, dapple_probes_environments);
    metal::float2 low = _e25 + ((_e28 - _e25) * f_3.x);
    metal::float2 _e33 = dapple_probes_environment_entry(second, dapple_probes_environments);
    metal::float2 _e36 = dapple_probes_environment_entry(second + 1u, dapple_probes_environments);
    metal::float2 high = _e33 + ((_e36 - _e33) * f_3.x);
    return low + ((high - low) * f_3.y);
}

metal::float3 dapple_probes_lobe_direction(
    metal::float3 n_2,
    metal::float3 v_2,
    float roughness_2
) {
    metal::float3 mirror = (n_2 * (2.0 * metal::dot(n_2, v_2))) - v_2;
    float alpha = metal::clamp(roughness_2 * roughness_2, 0.0, 1.0);
    float smooth = 1.0 - alpha;
    float share_1 = smooth * (metal::sqrt(smooth) + alpha);
    metal::float3 d_2 = n_2 + ((mirror - n_2) * share_1);
    float size = metal::length(d_2);
    return (size > 0.000000000000000000000000000001) ? (d_2 / metal::float3(size)) : n_2;
}

DappleProbesIncomingLight dapple_probes_incoming_light(
    DappleProbesL2_ radiance_1,
    metal::float3 n_3,
    metal::float3 v_3,
    float roughness_3
) {
    metal::float3 _e4 = dapple_probes_lobe_direction(n_3, v_3, roughness_3);
    metal::float3 _e6 = dapple_probes_convolved(radiance_1, DAPPLE_PROBES_COSINE, n_3);
    metal::float3 irradiance = metal::max(_e6, metal::float3(0.0));
    metal::float3 _e10 = dapple_probes_lobe(roughness_3);
    metal::float3 _e11 = dapple_probes_convolved(radiance_1, _e10, _e4);
    metal::float3 filtered = metal::max(_e11, metal::float3(0.0));
    return DappleProbesIncomingLight {irradiance, filtered};
}

DappleProbesIndirect dapple_probes_shade(
    DappleProbesL2_ radiance_2,
    metal::float3 base_color,
    float metallic,
    float roughness_4,
    metal::float3 n_4,
    metal::float3 v_4,
    metal::texture2d<float, metal::access::sample> dapple_probes_environments
) {
    DappleProbesIndirect out = {};
    float roughness_5 = metal::clamp(roughness_4, 0.0, 1.0);
    float metallic_1 = metal::clamp(metallic, 0.0, 1.0);
    metal::float2 _e13 = dapple_probes_environment(metal::dot(n_4, v_4), roughness_5, dapple_probes_environments);
    metal::float3 f0_ = metal::mix(metal::float3(0.04), base_color, metallic_1);
    DappleProbesIncomingLight _e17 = dapple_probes_incoming_light(radiance_2, n_4, v_4, roughness_5);
    float left = 1.0 - ((DAPPLE_PROBES_DIELECTRIC * _e13.x) + _e13.y);
    out.diffuse = (base_color * _e17.irradiance) * (((1.0 - metallic_1) * left) / DAPPLE_PROBES_PI);
    out.glossy = _e17.filtered * ((f0_ * _e13.x) + metal::float3(_e13.y));
    DappleProbesIndirect _e43 = out;
    return _e43;
}
