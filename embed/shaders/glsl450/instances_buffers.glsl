// Generated from `embed/shaders/wgsl/instances.wgsl` and `instances_buffers.wgsl`.
// Needs `#version 450`.

struct DappleInstancesTable {
    vec3 centre;
    float share;
    vec3 per_half_extent;
    float scale;
    uint signals;
};
const uint DAPPLE_INSTANCES_NO_ENTRY = 4294967295u;

// Define DAPPLE_INSTANCES_CUSTOM to bring these functions.
#ifndef DAPPLE_INSTANCES_CUSTOM
layout(std430, binding = 9) readonly buffer dapple_instances_type_5_block_0Fragment { uvec2 dapple_instances_values[]; };
uvec2 dapple_instances_value(uint index) {
    uvec2 _e3 = dapple_instances_values[index];
    return _e3;
}

#else
uvec2 dapple_instances_value(uint index);
#endif

float dapple_instances_coefficient(DappleInstancesTable table, uint bits) {
    return ((float((int((bits << 16u)) >> 16u)) / 32767.0) * table.scale);
}

vec4 dapple_instances_coefficients(DappleInstancesTable table_1, uvec2 value) {
    float _e3 = dapple_instances_coefficient(table_1, value.x);
    float _e7 = dapple_instances_coefficient(table_1, (value.x >> 16u));
    float _e9 = dapple_instances_coefficient(table_1, value.y);
    float _e13 = dapple_instances_coefficient(table_1, (value.y >> 16u));
    return vec4(_e3, _e7, _e9, _e13);
}

vec3 dapple_instances_normalized(DappleInstancesTable table_2, vec3 position) {
    return clamp(((position - table_2.centre) * table_2.per_half_extent), vec3(-1.0), vec3(1.0));
}

float dapple_instances_signal(vec4 c, vec3 u) {
    return max((((c.x + (c.y * u.x)) + (c.z * u.y)) + (c.w * u.z)), 0.0);
}

float dapple_instances_global(DappleInstancesTable table_3, uint entry, vec3 position_1) {
    if ((entry == DAPPLE_INSTANCES_NO_ENTRY)) {
        return 1.0;
    }
    vec3 _e6 = dapple_instances_normalized(table_3, position_1);
    uint first = (entry * table_3.signals);
    uvec2 _e9 = dapple_instances_value(first);
    vec4 _e10 = dapple_instances_coefficients(table_3, _e9);
    float _e11 = dapple_instances_signal(_e10, _e6);
    if ((table_3.signals == 1u)) {
        return _e11;
    }
    uvec2 _e17 = dapple_instances_value((first + 1u));
    vec4 _e18 = dapple_instances_coefficients(table_3, _e17);
    float _e19 = dapple_instances_signal(_e18, _e6);
    return (_e11 + ((_e19 - _e11) * table_3.share));
}

float dapple_instances_ao(DappleInstancesTable table_4, uint entry_1, vec3 position_2, float local) {
    float _e4 = dapple_instances_global(table_4, entry_1, position_2);
    return clamp((_e4 * local), 0.0, 1.0);
}
