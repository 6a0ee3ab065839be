// Generated from `embed/shaders/wgsl/vertices.wgsl` and `vertices_textures.wgsl`.
// Needs `#version 450`.

struct DappleVerticesMesh {
    uint first;
    uint signals;
    float share;
};

// Define DAPPLE_VERTICES_CUSTOM to bring these functions.
#ifndef DAPPLE_VERTICES_CUSTOM
layout(binding = 8) uniform usampler2D dapple_vertices_values;
uint dapple_vertices_value(uint index) {
    uint width = uvec2(textureSize(dapple_vertices_values, 0).xy).x;
    uvec4 _e9 = texelFetch(dapple_vertices_values, ivec2(uvec2((index % width), (index / width))), 0);
    return _e9.x;
}

#else
uint dapple_vertices_value(uint index);
#endif

float dapple_vertices_signal(DappleVerticesMesh mesh, uvec3 vertices, vec3 weights, uint which) {
    uvec3 at = (((vertices * mesh.signals) + uvec3(mesh.first)) + uvec3(which));
    uint _e13 = dapple_vertices_value(at.x);
    uint _e18 = dapple_vertices_value(at.y);
    uint _e24 = dapple_vertices_value(at.z);
    float sum = (((weights.x * float(_e13)) + (weights.y * float(_e18))) + (weights.z * float(_e24)));
    return (sum / 255.0);
}

float dapple_vertices_ao(DappleVerticesMesh mesh_1, uvec3 vertices_1, vec3 weights_1) {
    float _e4 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 0u);
    if ((mesh_1.signals == 1u)) {
        return _e4;
    }
    float _e9 = dapple_vertices_signal(mesh_1, vertices_1, weights_1, 1u);
    return (_e4 + ((_e9 - _e4) * mesh_1.share));
}
