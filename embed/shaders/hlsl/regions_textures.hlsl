// Generated from `embed/shaders/wgsl/regions.wgsl` and `regions_textures.wgsl`.
// Needs shader model 5.0.

struct DappleRegionsRegion {
    float3 min_;
    uint first;
    float3 max_;
    uint form;
    float3 centre;
    uint reserved;
};
struct DappleRegionsSet {
    float scale;
    float share;
};
uint dapple_regions_naga_mod(uint lhs, uint rhs) {
    return lhs % (rhs == 0u ? 1u : rhs);
}
uint dapple_regions_naga_div(uint lhs, uint rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}
uint2 dapple_regions_NagaDimensions2D(Texture2D<uint4> tex)
{
    uint4 ret;
    tex.GetDimensions(0, ret.x, ret.y, ret.z);
    return ret.xy;
}
DappleRegionsRegion dapple_regions_ConstructDappleRegionsRegion(float3 arg0, uint arg1, float3 arg2, uint arg3, float3 arg4, uint arg5) {
    DappleRegionsRegion ret = (DappleRegionsRegion)0;
    ret.min_ = arg0;
    ret.first = arg1;
    ret.max_ = arg2;
    ret.form = arg3;
    ret.centre = arg4;
    ret.reserved = arg5;
    return ret;
}

// Define DAPPLE_REGIONS_CUSTOM to bring these functions.
#ifndef DAPPLE_REGIONS_CUSTOM
Texture2D<uint4> dapple_regions_pairs : register(t57);
Texture2D<uint4> dapple_regions_regions : register(t56);
uint dapple_regions_pair(uint index)
{
    uint width = dapple_regions_NagaDimensions2D(dapple_regions_pairs).x;
    uint4 _e9 = dapple_regions_pairs.Load(int3(uint2(dapple_regions_naga_mod(index, width), dapple_regions_naga_div(index, width)), int(0)));
    return _e9.x;
}
uint dapple_regions_count()
{
    return dapple_regions_NagaDimensions2D(dapple_regions_regions).y;
}
DappleRegionsRegion dapple_regions_region(uint index_1)
{
    uint4 a = dapple_regions_regions.Load(int3(uint2(0u, index_1), int(0)));
    uint4 b = dapple_regions_regions.Load(int3(uint2(1u, index_1), int(0)));
    uint4 c_1 = dapple_regions_regions.Load(int3(uint2(2u, index_1), int(0)));
    const DappleRegionsRegion dappleregionsregion = dapple_regions_ConstructDappleRegionsRegion(asfloat(a.xyz), a.w, asfloat(b.xyz), b.w, asfloat(c_1.xyz), c_1.w);
    return dappleregionsregion;
}

#else
uint dapple_regions_pair(uint index);
uint dapple_regions_count();
DappleRegionsRegion dapple_regions_region(uint index_1);
#endif

float dapple_regions_value(DappleRegionsSet region_set, uint at)
{
    const uint _e4 = dapple_regions_pair(dapple_regions_naga_div(at, 2u));
    uint low = (((at & 1u) == 1u) ? _e4 : (_e4 << 16u));
    return (float((asint(low) >> 16u)) * region_set.scale);
}

float3 dapple_regions_offsets(DappleRegionsRegion region, float3 p)
{
    float3 half_extent = ((region.max_ - region.min_) * 0.5);
    float3 away = (min(max(p, region.min_), region.max_) - region.centre);
    bool3 flat_axis = (half_extent <= (0.0).xxx);
    return (flat_axis ? (0.0).xxx : (away / (flat_axis ? (1.0).xxx : half_extent)));
}

float dapple_regions_polynomial(uint k, float3 n)
{
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

float dapple_regions_sample(DappleRegionsSet region_set_1, uint index_2, float3 p_1, float3 n_1)
{
    uint3 rows = uint3(1u, 2u, 3u);
    float2 sum = (0.0).xx;
    uint k_1 = 0u;
    uint at_1 = (uint)0;
    float2 c = (float2)0;
    uint axis = (uint)0;

    const uint _e4 = dapple_regions_count();
    if ((index_2 >= _e4)) {
        return 1.0;
    }
    const DappleRegionsRegion _e7 = dapple_regions_region(index_2);
    const float3 _e8 = dapple_regions_offsets(_e7, p_1);
    uint derivatives = (_e7.form & 3u);
    uint side = (((_e7.form >> 2u) & 3u) + 1u);
    uint count = (side * side);
    uint signals = (((_e7.form >> 4u) & 1u) + 1u);
    if ((derivatives == 2u)) {
        rows = (uint3(1u, 3u, 5u) + uint3((_e8 < (0.0).xxx)));
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
            const float _e58 = dapple_regions_value(region_set_1, _e57);
            uint _e59 = at_1;
            const float _e63 = dapple_regions_value(region_set_1, ((_e59 + signals) - 1u));
            c = float2(_e58, _e63);
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
                        float2 _e81 = c;
                        uint _e82 = at_1;
                        const float _e83 = dapple_regions_value(region_set_1, _e82);
                        uint _e84 = at_1;
                        const float _e88 = dapple_regions_value(region_set_1, ((_e84 + signals) - 1u));
                        uint _e90 = axis;
                        c = (_e81 + (float2(_e83, _e88) * _e8[_e90]));
                    }
                }
            }
            float2 _e97 = sum;
            float2 _e98 = c;
            uint _e99 = k_1;
            const float _e100 = dapple_regions_polynomial(_e99, n_1);
            sum = (_e97 + (_e98 * _e100));
        }
    }
    float2 _e106 = sum;
    float2 signal = clamp(_e106, (0.0).xx, (1.0).xx);
    return (signal.x + ((signal.y - signal.x) * region_set_1.share));
}
