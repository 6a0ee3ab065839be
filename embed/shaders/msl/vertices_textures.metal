// Generated from `embed/shaders/wgsl/vertices.wgsl` and `vertices_textures.wgsl`.
// Needs Metal 2.1; what a function reads is passed to it.

#include <metal_stdlib>
#include <simd/simd.h>
using metal::uint;
struct DappleVerticesMesh {
    uint first;
    uint signals;
    float share;
};
uint dapple_vertices_naga_mod(uint lhs, uint rhs) {
    return lhs % metal::select(rhs, 1u, rhs == 0u);
}
uint dapple_vertices_naga_div(uint lhs, uint rhs) {
    return lhs / metal::select(rhs, 1u, rhs == 0u);
}

uint dapple_vertices_value(
    uint index,
    metal::texture2d<uint, metal::access::sample> dapple_vertices_values
) {
    uint width = metal::uint2(dapple_vertices_values.get_width(), dapple_vertices_values.get_height()).x;
    metal::uint4 _e9 = dapple_vertices_values.read(metal::uint2(metal::uint2(dapple_vertices_naga_mod(index, width), dapple_vertices_naga_div(index, width))), 0);
    return _e9.x;
}

float dapple_vertices_signal(
    DappleVerticesMesh mesh,
    metal::uint3 vertices,
    metal::float3 weights,
    uint which,
    metal::texture2d<uint, metal::access::sample> dapple_vertices_values
) {
    metal::uint3 at = ((vertices * mesh.signals) + metal::uint3(mesh.first)) + metal::uint3(which);
    uint _e13 = dapple_vertices_value(at.x, dapple_vertices_values);
    uint _e18 = dapple_vertices_value(at.y, dapple_vertices_values);
    uint _e24 = dapple_vertices_value(at.z, dapple_vertices_values);
    float sum = ((weights.x * static_cast<float>(_e13)) + (weights.y * static_cast<float>(_e18))) + (weights.z * static_cast<float>(_e24));
    return sum / 255.0;
}

float dapple_vertices_ao(
    DappleVerticesMesh mesh_1,
    metal::uint3 vertices_1,
    metal::float3 weights_1,
    metal::texture2d<uint, metal::access::sample> dapple_vertices_values
) {
    float _e4 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 0u, dapple_vertices_values);
    if (mesh_1.signals == 1u) {
        return _e4;
    }
    float _e9 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 1u, dapple_vertices_values);
    return _e4 + ((_e9 - _e4) * mesh_1.share);
}
