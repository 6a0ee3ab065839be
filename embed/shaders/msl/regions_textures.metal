// Generated from `embed/shaders/wgsl/regions.wgsl` and `regions_textures.wgsl`.
// Needs Metal 2.1; what a function reads is passed to it.

#include <metal_stdlib>
#include <simd/simd.h>
using metal::uint;
struct DappleRegionsRegion {
    metal::packed_float3 min;
    uint first;
    metal::packed_float3 max;
    uint form;
    metal::packed_float3 centre;
    uint reserved;
};
struct DappleRegionsSet {
    float scale;
    float share;
};
uint dapple_regions_naga_mod(uint lhs, uint rhs) {
    return lhs % metal::select(rhs, 1u, rhs == 0u);
}
uint dapple_regions_naga_div(uint lhs, uint rhs) {
    return lhs / metal::select(rhs, 1u, rhs == 0u);
}

uint dapple_regions_pair(
    uint index,
    metal::texture2d<uint, metal::access::sample> dapple_regions_pairs
) {
    uint width = metal::uint2(dapple_regions_pairs.get_width(), dapple_regions_pairs.get_height()).x;
    metal::uint4 _e9 = dapple_regions_pairs.read(metal::uint2(metal::uint2(dapple_regions_naga_mod(index, width), dapple_regions_naga_div(index, width))), 0);
    return _e9.x;
}

float dapple_regions_value(
    DappleRegionsSet region_set,
    uint at,
    metal::texture2d<uint, metal::access::sample> dapple_regions_pairs
) {
    uint _e4 = dapple_regions_pair(dapple_regions_naga_div(at, 2u), dapple_regions_pairs);
    uint low = ((at & 1u) == 1u) ? _e4 : (_e4 << 16u);
    return static_cast<float>(as_type<int>(low) >> 16u) * region_set.scale;
}

metal::float3 dapple_regions_offsets(
    DappleRegionsRegion region,
    metal::float3 p
) {
    metal::float3 half_extent = (region.max - region.min) * 0.5;
    metal::float3 away = metal::min(metal::max(p, region.min), region.max) - region.centre;
    metal::bool3 flat_axis = half_extent <= metal::float3(0.0);
    return metal::select(away / metal::select(half_extent, metal::float3(1.0), flat_axis), metal::float3(0.0), flat_axis);
}

float dapple_regions_polynomial(
    uint k,
    metal::float3 n
) {
    switch(k) {
        case 0u: {
            return 1.0;
        }
        case 1u: {
            return n.y;
        }
        case 2u: {
            return n.z;
        }
        case 3u: {
            return n.x;
        }
        case 4u: {
            return n.x * n.y;
        }
        case 5u: {
            return n.y * n.z;
        }
        case 6u: {
            return ((3.0 * n.z) * n.z) - 1.0;
        }
        case 7u: {
            return n.x * n.z;
        }
        default: {
            return (n.x * n.x) - (n.y * n.y);
        }
    }
}

uint dapple_regions_count(
    metal::texture2d<uint, metal::access::sample> dapple_regions_regions
) {
    return metal::uint2(dapple_regions_regions.get_width(), dapple_regions_regions.get_height()).y;
}

DappleRegionsRegion dapple_regions_region(
    uint index_1,
    metal::texture2d<uint, metal::access::sample> dapple_regions_regions
) {
    metal::uint4 a = dapple_regions_regions.read(metal::uint2(metal::uint2(0u, index_1)), 0);
    metal::uint4 b = dapple_regions_regions.read(metal::uint2(metal::uint2(1u, index_1)), 0);
    metal::uint4 c_1 = dapple_regions_regions.read(metal::uint2(metal::uint2(2u, index_1)), 0);
    return DappleRegionsRegion {as_type<metal::float3>(a.xyz), a.w, as_type<metal::float3>(b.xyz), b.w, as_type<metal::float3>(c_1.xyz), c_1.w};
}

float dapple_regions_sample(
    DappleRegionsSet region_set_1,
    uint index_2,
    metal::float3 p_1,
    metal::float3 n_1,
    metal::texture2d<uint, metal::access::sample> dapple_regions_pairs,
    metal::texture2d<uint, metal::access::sample> dapple_regions_regions
) {
    metal::uint3 rows = metal::uint3(1u, 2u, 3u);
    metal::float2 sum = metal::float2(0.0);
    uint k_1 = 0u;
    uint at_1 = {};
    metal::float2 c = {};
    uint axis = {};
    uint _e4 = dapple_regions_count(dapple_regions_regions);
    if (index_2 >= _e4) {
        return 1.0;
    }
    DappleRegionsRegion _e7 = dapple_regions_region(index_2, dapple_regions_regions);
    metal::float3 _e8 = dapple_regions_offsets(_e7, p_1);
    uint derivatives = _e7.form & 3u;
    uint side = ((_e7.form >> 2u) & 3u) + 1u;
    uint count = side * side;
    uint signals = ((_e7.form >> 4u) & 1u) + 1u;
    if (derivatives == 2u) {
        rows = metal::uint3(1u, 3u, 5u) + static_cast<metal::uint3>(_e8 < metal::float3(0.0));
    }
    uint first = 2u * _e7.first;
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e104 = k_1;
            k_1 = _e104 + 1u;
        }
        loop_init = false;
        uint _e51 = k_1;
        if (_e51 < count) {
        } else {
            break;
        }
        {
            uint _e53 = k_1;
            at_1 = first + (_e53 * signals);
            uint _e57 = at_1;
            float _e58 = dapple_regions_value(region_set_1, _e57, dapple_regions_pairs);
            uint _e59 = at_1;
            float _e63 = dapple_regions_value(region_set_1, (_e59 + signals) - 1u, dapple_regions_pairs);
            c = metal::float2(_e58, _e63);
            if (derivatives != 0u) {
                axis = 0u;
                bool loop_init_1 = true;
                while(true) {
                    if (!loop_init_1) {
                        uint _e95 = axis;
                        axis = _e95 + 1u;
                    }
                    loop_init_1 = false;
                    uint _e70 = axis;
                    if (_e70 < 3u) {
                    } else {
                        break;
                    }
                    {
                        uint _e73 = axis;
                        uint _e75 = rows[_e73];
                        uint _e77 = k_1;
                        at_1 = first + (((_e75 * count) + _e77) * signals);
                        metal::float2 _e81 = c;
                        uint _e82 = at_1;
                        float _e83 = dapple_regions_value(region_set_1, _e82, dapple_regions_pairs);
                        uint _e84 = at_1;
                        float _e88 = dapple_regions_value(region_set_1, (_e84 + signals) - 1u, dapple_regions_pairs);
                        uint _e90 = axis;
                        c = _e81 + (metal::float2(_e83, _e88) * _e8[_e90]);
                    }
                }
            }
            metal::float2 _e97 = sum;
            metal::float2 _e98 = c;
            uint _e99 = k_1;
            float _e100 = dapple_regions_polynomial(_e99, n_1);
            sum = _e97 + (_e98 * _e100);
        }
    }
    metal::float2 _e106 = sum;
    metal::float2 signal = metal::clamp(_e106, metal::float2(0.0), metal::float2(1.0));
    return signal.x + ((signal.y - signal.x) * region_set_1.share);
}
