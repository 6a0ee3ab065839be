// Generated from `embed/shaders/wgsl/instances.wgsl` and `instances_textures.wgsl`.
// Needs Metal 2.1; what a function reads is passed to it.

#include <metal_stdlib>
#include <simd/simd.h>
using metal::uint;
struct DappleInstancesTable {
    metal::packed_float3 centre;
    float share;
    metal::packed_float3 per_half_extent;
    float scale;
    uint signals;
    char _pad5[12];
};
constant uint DAPPLE_INSTANCES_NO_ENTRY = 4294967295u;
uint dapple_instances_naga_mod(uint lhs, uint rhs) {
    return lhs % metal::select(rhs, 1u, rhs == 0u);
}
uint dapple_instances_naga_div(uint lhs, uint rhs) {
    return lhs / metal::select(rhs, 1u, rhs == 0u);
}

float dapple_instances_coefficient(
    DappleInstancesTable table,
    uint bits
) {
    return (static_cast<float>(as_type<int>(bits << 16u) >> 16u) / 32767.0) * table.scale;
}

metal::float4 dapple_instances_coefficients(
    DappleInstancesTable table_1,
    metal::uint2 value
) {
    float _e3 = dapple_instances_coefficient(table_1, value.x);
    float _e7 = dapple_instances_coefficient(table_1, value.x >> 16u);
    float _e9 = dapple_instances_coefficient(table_1, value.y);
    float _e13 = dapple_instances_coefficient(table_1, value.y >> 16u);
    return metal::float4(_e3, _e7, _e9, _e13);
}

metal::float3 dapple_instances_normalized(
    DappleInstancesTable table_2,
    metal::float3 position
) {
    return metal::clamp((position - table_2.centre) * table_2.per_half_extent, metal::float3(-1.0), metal::float3(1.0));
}

float dapple_instances_signal(
    metal::float4 c,
    metal::float3 u
) {
    return metal::max(((c.x + (c.y * u.x)) + (c.z * u.y)) + (c.w * u.z), 0.0);
}

metal::uint2 dapple_instances_value(
    uint index,
    metal::texture2d<uint, metal::access::sample> dapple_instances_values
) {
    uint width = metal::uint2(dapple_instances_values.get_width(), dapple_instances_values.get_height()).x;
    metal::uint4 _e9 = dapple_instances_values.read(metal::uint2(metal::uint2(dapple_instances_naga_mod(index, width), dapple_instances_naga_div(index, width))), 0);
    return _e9.xy;
}

float dapple_instances_global(
    DappleInstancesTable table_3,
    uint entry,
    metal::float3 position_1,
    metal::texture2d<uint, metal::access::sample> dapple_instances_values
) {
    if (entry == DAPPLE_INSTANCES_NO_ENTRY) {
        return 1.0;
    }
    metal::float3 _e6 = dapple_instances_normalized(table_3, position_1);
    uint first = entry * table_3.signals;
    metal::uint2 _e9 = dapple_instances_value(first, dapple_instances_values);
    metal::float4 _e10 = dapple_instances_coefficients(table_3, _e9);
    float _e11 = dapple_instances_signal(_e10, _e6);
    if (table_3.signals == 1u) {
        return _e11;
    }
    metal::uint2 _e17 = dapple_instances_value(first + 1u, dapple_instances_values);
    metal::float4 _e18 = dapple_instances_coefficients(table_3, _e17);
    float _e19 = dapple_instances_signal(_e18, _e6);
    return _e11 + ((_e19 - _e11) * table_3.share);
}

float dapple_instances_ao(
    DappleInstancesTable table_4,
    uint entry_1,
    metal::float3 position_2,
    float local,
    metal::texture2d<uint, metal::access::sample> dapple_instances_values
) {
    float _e4 = dapple_instances_global(table_4, entry_1, position_2, dapple_instances_values);
    return metal::clamp(_e4 * local, 0.0, 1.0);
}
