// Generated from `embed/shaders/wgsl/vertices.wgsl` and `vertices_textures.wgsl`.
// Needs shader model 5.0.

struct DappleVerticesMesh {
    uint first;
    uint signals;
    float share;
};
uint dapple_vertices_naga_mod(uint lhs, uint rhs) {
    return lhs % (rhs == 0u ? 1u : rhs);
}
uint dapple_vertices_naga_div(uint lhs, uint rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}
uint2 dapple_vertices_NagaDimensions2D(Texture2D<uint4> tex)
{
    uint4 ret;
    tex.GetDimensions(0, ret.x, ret.y, ret.z);
    return ret.xy;
}

// Define DAPPLE_VERTICES_CUSTOM to bring these functions.
#ifndef DAPPLE_VERTICES_CUSTOM
Texture2D<uint4> dapple_vertices_values : register(t40);
uint dapple_vertices_value(uint index)
{
    uint width = dapple_vertices_NagaDimensions2D(dapple_vertices_values).x;
    uint4 _e9 = dapple_vertices_values.Load(int3(uint2(dapple_vertices_naga_mod(index, width), dapple_vertices_naga_div(index, width)), int(0)));
    return _e9.x;
}

#else
uint dapple_vertices_value(uint index);
#endif

float dapple_vertices_signal(DappleVerticesMesh mesh, uint3 vertices_, float3 weights, uint which)
{
    uint3 at = (((vertices_ * mesh.signals) + (mesh.first).xxx) + (which).xxx);
    const uint _e13 = dapple_vertices_value(at.x);
    const uint _e18 = dapple_vertices_value(at.y);
    const uint _e24 = dapple_vertices_value(at.z);
    float sum = (((weights.x * float(_e13)) + (weights.y * float(_e18))) + (weights.z * float(_e24)));
    return (sum / 255.0);
}

float dapple_vertices_ao(DappleVerticesMesh mesh_1, uint3 vertices_1, float3 weights_1)
{
    const float _e4 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 0u);
    if ((mesh_1.signals == 1u)) {
        return _e4;
    }
    const float _e9 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 1u);
    return (_e4 + ((_e9 - _e4) * mesh_1.share));
}
