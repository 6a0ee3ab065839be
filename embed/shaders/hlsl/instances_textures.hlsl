// Generated from `embed/shaders/wgsl/instances.wgsl` and `instances_textures.wgsl`.
// Needs shader model 5.0.

struct DappleInstancesTable {
    float3 centre;
    float share;
    float3 per_half_extent;
    float scale;
    uint signals;
    int _end_pad_0;
    int _end_pad_1;
    int _end_pad_2;
};
static const uint DAPPLE_INSTANCES_NO_ENTRY = 4294967295u;
uint dapple_instances_naga_mod(uint lhs, uint rhs) {
    return lhs % (rhs == 0u ? 1u : rhs);
}
uint dapple_instances_naga_div(uint lhs, uint rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}
uint2 dapple_instances_NagaDimensions2D(Texture2D<uint4> tex)
{
    uint4 ret;
    tex.GetDimensions(0, ret.x, ret.y, ret.z);
    return ret.xy;
}

// Define DAPPLE_INSTANCES_CUSTOM to bring these functions.
#ifndef DAPPLE_INSTANCES_CUSTOM
Texture2D<uint4> dapple_instances_values : register(t48);
uint2 dapple_instances_value(uint index)
{
    uint width = dapple_instances_NagaDimensions2D(dapple_instances_values).x;
    uint4 _e9 = dapple_instances_values.Load(int3(uint2(dapple_instances_naga_mod(index, width), dapple_instances_naga_div(index, width)), int(0)));
    return _e9.xy;
}

#else
uint2 dapple_instances_value(uint index);
#endif

float dapple_instances_coefficient(DappleInstancesTable table, uint bits)
{
    return ((float((asint((bits << 16u)) >> 16u)) / 32767.0) * table.scale);
}

float4 dapple_instances_coefficients(DappleInstancesTable table_1, uint2 value)
{
    const float _e3 = dapple_instances_coefficient(table_1, value.x);
    const float _e7 = dapple_instances_coefficient(table_1, (value.x >> 16u));
    const float _e9 = dapple_instances_coefficient(table_1, value.y);
    const float _e13 = dapple_instances_coefficient(table_1, (value.y >> 16u));
    return float4(_e3, _e7, _e9, _e13);
}

float3 dapple_instances_normalized(DappleInstancesTable table_2, float3 position)
{
    return clamp(((position - table_2.centre) * table_2.per_half_extent), (-1.0).xxx, (1.0).xxx);
}

float dapple_instances_signal(float4 c, float3 u)
{
    return max((((c.x + (c.y * u.x)) + (c.z * u.y)) + (c.w * u.z)), 0.0);
}

float dapple_instances_global(DappleInstancesTable table_3, uint entry, float3 position_1)
{
    if ((entry == DAPPLE_INSTANCES_NO_ENTRY)) {
        return 1.0;
    }
    const float3 _e6 = dapple_instances_normalized(table_3, position_1);
    uint first = (entry * table_3.signals);
    const uint2 _e9 = dapple_instances_value(first);
    const float4 _e10 = dapple_instances_coefficients(table_3, _e9);
    const float _e11 = dapple_instances_signal(_e10, _e6);
    if ((table_3.signals == 1u)) {
        return _e11;
    }
    const uint2 _e17 = dapple_instances_value((first + 1u));
    const float4 _e18 = dapple_instances_coefficients(table_3, _e17);
    const float _e19 = dapple_instances_signal(_e18, _e6);
    return (_e11 + ((_e19 - _e11) * table_3.share));
}

float dapple_instances_ao(DappleInstancesTable table_4, uint entry_1, float3 position_2, float local)
{
    const float _e4 = dapple_instances_global(table_4, entry_1, position_2);
    return clamp((_e4 * local), 0.0, 1.0);
}
