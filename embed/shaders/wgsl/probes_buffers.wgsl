// Accessors of `probes.wgsl` by storage buffers, and textures for hardware trilinear filtering. The binding
// numbers are yours to change.

// `ProbesTexels` as it is: seven planes of one texel a probe, four f16 each.
@group(1) @binding(1) var<storage, read> dapple_probes_texels: array<vec2u>;
// A bit a probe, low bit first.
@group(1) @binding(2) var<storage, read> dapple_probes_presence: array<u32>;
// `ProbesVisibility` as it is. Two texels a word: mean and deviation, a byte each.
@group(1) @binding(3) var<storage, read> dapple_probes_blocks: array<u32>;
// Scale and bias.
@group(1) @binding(4) var<storage, read> dapple_probes_environments: array<vec2f>;
// The planes again, for the texture unit: `rgba16float`, linear, clamped to the edge.
@group(1) @binding(5) var dapple_probes_filtering: sampler;
@group(1) @binding(6) var dapple_probes_plane_a: texture_3d<f32>;
@group(1) @binding(7) var dapple_probes_plane_b: texture_3d<f32>;
@group(1) @binding(8) var dapple_probes_plane_c: texture_3d<f32>;
@group(1) @binding(9) var dapple_probes_plane_d: texture_3d<f32>;
@group(1) @binding(10) var dapple_probes_plane_e: texture_3d<f32>;
@group(1) @binding(11) var dapple_probes_plane_f: texture_3d<f32>;
@group(1) @binding(12) var dapple_probes_plane_g: texture_3d<f32>;

fn dapple_probes_filtered(uvw: vec3f) -> DappleProbesFlat {
    return DappleProbesFlat(
        textureSampleLevel(dapple_probes_plane_a, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_b, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_c, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_d, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_e, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_f, dapple_probes_filtering, uvw, 0.0),
        textureSampleLevel(dapple_probes_plane_g, dapple_probes_filtering, uvw, 0.0),
    );
}

fn dapple_probes_values(volume: DappleProbesVolume, probe: u32) -> DappleProbesFlat {
    let count = volume.dims.x * volume.dims.y * volume.dims.z;
    var values: DappleProbesFlat;
    for (var t = 0u; t < 7u; t++) {
        let bits = dapple_probes_texels[t * count + probe];
        values[t] = vec4f(unpack2x16float(bits.x), unpack2x16float(bits.y));
    }
    return values;
}

fn dapple_probes_present(probe: u32) -> bool {
    return ((dapple_probes_presence[probe / 32u] >> (probe % 32u)) & 1u) == 1u;
}

fn dapple_probes_visibility(texel: u32) -> vec2u {
    let word = dapple_probes_blocks[texel / 2u] >> (16u * (texel % 2u));
    return vec2u(word & 255u, (word >> 8u) & 255u);
}

fn dapple_probes_environment_entry(entry: u32) -> vec2f {
    return dapple_probes_environments[entry];
}
