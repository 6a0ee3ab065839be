// Accessors of `probes.wgsl` by textures alone. The binding numbers are yours to change.

// `r8uint`, any width: probe after probe, row by row, 0 where it is absent.
@group(1) @binding(2) var dapple_probes_presence: texture_2d<u32>;
// `rg8uint`, any width: the texels of `ProbesVisibility` row by row.
@group(1) @binding(3) var dapple_probes_blocks: texture_2d<u32>;
// `rg32float`, 32x32: scale and bias.
@group(1) @binding(4) var dapple_probes_environments: texture_2d<f32>;
// The seven planes of `ProbesTexels`, `rgba16float`; the sampler is linear and clamps to the edge.
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
    let row = probe / volume.dims.x;
    let at = vec3u(probe % volume.dims.x, row % volume.dims.y, row / volume.dims.y);
    return DappleProbesFlat(
        textureLoad(dapple_probes_plane_a, at, 0),
        textureLoad(dapple_probes_plane_b, at, 0),
        textureLoad(dapple_probes_plane_c, at, 0),
        textureLoad(dapple_probes_plane_d, at, 0),
        textureLoad(dapple_probes_plane_e, at, 0),
        textureLoad(dapple_probes_plane_f, at, 0),
        textureLoad(dapple_probes_plane_g, at, 0),
    );
}

fn dapple_probes_present(probe: u32) -> bool {
    let width = textureDimensions(dapple_probes_presence).x;
    return textureLoad(dapple_probes_presence, vec2u(probe % width, probe / width), 0).x != 0u;
}

fn dapple_probes_visibility(texel: u32) -> vec2u {
    let width = textureDimensions(dapple_probes_blocks).x;
    return textureLoad(dapple_probes_blocks, vec2u(texel % width, texel / width), 0).xy;
}

fn dapple_probes_environment_entry(entry: u32) -> vec2f {
    let side = u32(DAPPLE_PROBES_ENVIRONMENT_SIDE);
    return textureLoad(dapple_probes_environments, vec2u(entry % side, entry / side), 0).xy;
}
