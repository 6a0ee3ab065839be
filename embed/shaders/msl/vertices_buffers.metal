// Generated from `embed/shaders/wgsl/vertices.wgsl` and `vertices_buffers.wgsl`.
// Needs Metal 2.1; what a function reads is passed to it.

#include <metal_stdlib>
#include <simd/simd.h>
using metal::uint;
struct dapple_vertices_mslBufferSizes {
    uint size0;
};
struct DappleVerticesMesh {
    uint first;
    uint signals;
    float share;
};
typedef uint dapple_vertices_type_2[1];
uint dapple_vertices_naga_div(uint lhs, uint rhs) {
    return lhs / metal::select(rhs, 1u, rhs == 0u);
}
uint dapple_vertices_naga_mod(uint lhs, uint rhs) {
    return lhs % metal::select(rhs, 1u, rhs == 0u);
}

uint dapple_vertices_value(
    uint index,
    device dapple_vertices_type_2 const& dapple_vertices_values,
    constant dapple_vertices_mslBufferSizes& _buffer_sizes
) {
    uint _e5 = dapple_vertices_values[dapple_vertices_naga_div(index, 4u)];
    return (_e5 >> (8u * dapple_vertices_naga_mod(index, 4u))) & 255u;
}

float dapple_vertices_signal(
    DappleVerticesMesh mesh,
    metal::uint3 vertices,
    metal::float3 weights,
    uint which,
    device dapple_vertices_type_2 const& dapple_vertices_values,
    constant dapple_vertices_mslBufferSizes& _buffer_sizes
) {
    metal::uint3 at = ((vertices * mesh.signals) + metal::uint3(mesh.first)) + metal::uint3(which);
    uint _e13 = dapple_vertices_value(at.x, dapple_vertices_values, _buffer_sizes);
    uint _e18 = dapple_vertices_value(at.y, dapple_vertices_values, _buffer_sizes);
    uint _e24 = dapple_vertices_value(at.z, dapple_vertices_values, _buffer_sizes);
    float sum = ((weights.x * static_cast<float>(_e13)) + (weights.y * static_cast<float>(_e18))) + (weights.z * static_cast<float>(_e24));
    return sum / 255.0;
}

float dapple_vertices_ao(
    DappleVerticesMesh mesh_1,
    metal::uint3 vertices_1,
    metal::float3 weights_1,
    device dapple_vertices_type_2 const& dapple_vertices_values,
    constant dapple_vertices_mslBufferSizes& _buffer_sizes
) {
    float _e4 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 0u, dapple_vertices_values, _buffer_sizes);
    if (mesh_1.signals == 1u) {
        return _e4;
    }
    float _e9 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 1u, dapple_vertices_values, _buffer_sizes);
    return _e4 + ((_e9 - _e4) * mesh_1.share);
}
