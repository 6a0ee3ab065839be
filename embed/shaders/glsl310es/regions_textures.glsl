// Generated from `embed/shaders/wgsl/regions.wgsl` and `regions_textures.wgsl`.
// Needs `#version 310 es` and `precision highp` for float and int.

struct DappleRegionsRegion {
    vec3 min_;
    uint first;
    vec3 max_;
    uint form;
    vec3 centre;
    uint reserved;
};
struct DappleRegionsSet {
    float scale;
    float share;
};

// Define DAPPLE_REGIONS_CUSTOM to bring these functions.
#ifndef DAPPLE_REGIONS_CUSTOM
layout(binding = 11) uniform highp usampler2D dapple_regions_pairs;
layout(binding = 10) uniform highp usampler2D dapple_regions_regions;
uint dapple_regions_pair(uint index) {
    uint width = uvec2(textureSize(dapple_regions_pairs, 0).xy).x;
    uvec4 _e9 = texelFetch(dapple_regions_pairs, ivec2(uvec2((index % width), (index / width))), 0);
    return _e9.x;
}
uint dapple_regions_count() {
    return uvec2(textureSize(dapple_regions_regions, 0).xy).y;
}
DappleRegionsRegion dapple_regions_region(uint index_1) {
    uvec4 a = texelFetch(dapple_regions_regions, ivec2(uvec2(0u, index_1)), 0);
    uvec4 b = texelFetch(dapple_regions_regions, ivec2(uvec2(1u, index_1)), 0);
    uvec4 c_1 = texelFetch(dapple_regions_regions, ivec2(uvec2(2u, index_1)), 0);
    return DappleRegionsRegion(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), b.w, uintBitsToFloat(c_1.xyz), c_1.w);
}

#else
uint dapple_regions_pair(uint index);
uint dapple_regions_count();
DappleRegionsRegion dapple_regions_region(uint index_1);
#endif

float dapple_regions_value(DappleRegionsSet region_set, uint at) {
    uint _e4 = dapple_regions_pair((at / 2u));
    uint low = (((at & 1u) == 1u) ? _e4 : (_e4 << 16u));
    return (float((int(low) >> 16u)) * region_set.scale);
}

vec3 dapple_regions_offsets(DappleRegionsRegion region, vec3 p) {
    vec3 half_extent = ((region.max_ - region.min_) * 0.5);
    vec3 away = (min(max(p, region.min_), region.max_) - region.centre);
    bvec3 flat_axis = lessThanEqual(half_extent, vec3(0.0));
    return mix((away / mix(half_extent, vec3(1.0), flat_axis)), vec3(0.0), flat_axis);
}

float dapple_regions_polynomial(uint k, vec3 n) {
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
            return (n.x * n.y);
        }
        case 5u: {
            return (n.y * n.z);
        }
        case 6u: {
            return (((3.0 * n.z) * n.z) - 1.0);
        }
        case 7u: {
            return (n.x * n.z);
        }
        default: {
            return ((n.x * n.x) - (n.y * n.y));
        }
    }
}

float dapple_regions_sample(DappleRegionsSet region_set_1, uint index_2, vec3 p_1, vec3 n_1) {
    uvec3 rows = uvec3(1u, 2u, 3u);
    vec2 sum = vec2(0.0);
    uint k_1 = 0u;
    uint at_1 = 0u;
    vec2 c = vec2(0.0);
    uint axis = 0u;
    uint _e4 = dapple_regions_count();
    if ((index_2 >= _e4)) {
        return 1.0;
    }
    DappleRegionsRegion _e7 = dapple_regions_region(index_2);
    vec3 _e8 = dapple_regions_offsets(_e7, p_1);
    uint derivatives = (_e7.form & 3u);
    uint side = (((_e7.form >> 2u) & 3u) + 1u);
    uint count = (side * side);
    uint signals = (((_e7.form >> 4u) & 1u) + 1u);
    if ((derivatives == 2u)) {
        rows = (uvec3(1u, 3u, 5u) + uvec3(lessThan(_e8, vec3(0.0))));
    }
    uint first = (2u * _e7.first);
    bool loop_init = true;
    while(true) {
        if (!loop_init) {
            uint _e104 = k_1;
            k_1 = (_e104 + 1u);
        }
        loop_init = false;
        uint _e51 = k_1;
        if ((_e51 < count)) {
        } else {
            break;
        }
        {
            uint _e53 = k_1;
            at_1 = (first + (_e53 * signals));
            uint _e57 = at_1;
            float _e58 = dapple_regions_value(region_set_1, _e57);
            uint _e59 = at_1;
            float _e63 = dapple_regions_value(region_set_1, ((_e59 + signals) - 1u));
            c = vec2(_e58, _e63);
            if ((derivatives != 0u)) {
                axis = 0u;
                bool loop_init_1 = true;
                while(true) {
                    if (!loop_init_1) {
                        uint _e95 = axis;
                        axis = (_e95 + 1u);
                    }
                    loop_init_1 = false;
                    uint _e70 = axis;
                    if ((_e70 < 3u)) {
                    } else {
                        break;
                    }
                    {
                        uint _e73 = axis;
                        uint _e75 = rows[_e73];
                        uint _e77 = k_1;
                        at_1 = (first + (((_e75 * count) + _e77) * signals));
                        vec2 _e81 = c;
                        uint _e82 = at_1;
                        float _e83 = dapple_regions_value(region_set_1, _e82);
                        uint _e84 = at_1;
                        float _e88 = dapple_regions_value(region_set_1, ((_e84 + signals) - 1u));
                        uint _e90 = axis;
                        c = (_e81 + (vec2(_e83, _e88) * _e8[_e90]));
                    }
                }
            }
            vec2 _e97 = sum;
            vec2 _e98 = c;
            uint _e99 = k_1;
            float _e100 = dapple_regions_polynomial(_e99, n_1);
            sum = (_e97 + (_e98 * _e100));
        }
    }
    vec2 _e106 = sum;
    vec2 signal = clamp(_e106, vec2(0.0), vec2(1.0));
    return (signal.x + ((signal.y - signal.x) * region_set_1.share));
}
