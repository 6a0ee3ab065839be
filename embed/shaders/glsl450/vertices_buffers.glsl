// Generated from `embed/shaders/wgsl/vertices.wgsl` and `vertices_buffers.wgsl`.
// Needs `#version 450`.

struct DappleVerticesMesh {
    uint first;
    uint signals;
    float share;
};

// Define DAPPLE_VERTICES_CUSTOM to bring these functions.
#ifndef DAPPLE_VERTICES_CUSTOM
layout(std430, binding = 8) readonly buffer dapple_vertices_type_2_block_0Fragment { uint dapple_vertices_values[]; };
uint dapple_vertices_value(uint index) {
    uint _e5 = dapple_vertices_values[(index / 4u)];
    return ((_e5 >> (8u * (index % 4u))) & 255u);
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
