// Accessors of `probes.wgsl` by textures alone, 36 bytes a probe: those of `src/probes/pack.rs`. The binding numbers
// are yours to change.

// `r8uint`, any width: probe after probe, row by row, 0 where it is absent.
@group(1) @binding(2) var dapple_probes_presence: texture_2d<u32>;
// `rg8uint`, any width: the texels of `ProbesVisibility` row by row.
@group(1) @binding(3) var dapple_probes_blocks: texture_2d<u32>;
// `rg32float`, 32x32: scale and bias.
@group(1) @binding(4) var dapple_probes_environments: texture_2d<f32>;
// Linear, clamped to the edge.
@group(1) @binding(5) var dapple_probes_filtering: sampler;
// A texture a function, `rgb9e5ufloat`; see SHIFTS for what is added to those of degree 1 and 2.
@group(1) @binding(6) var dapple_probes_light_a: texture_3d<f32>;
@group(1) @binding(7) var dapple_probes_light_b: texture_3d<f32>;
@group(1) @binding(8) var dapple_probes_light_c: texture_3d<f32>;
@group(1) @binding(9) var dapple_probes_light_d: texture_3d<f32>;
@group(1) @binding(10) var dapple_probes_light_e: texture_3d<f32>;
@group(1) @binding(11) var dapple_probes_light_f: texture_3d<f32>;
@group(1) @binding(12) var dapple_probes_light_g: texture_3d<f32>;
@group(1) @binding(13) var dapple_probes_light_h: texture_3d<f32>;
@group(1) @binding(14) var dapple_probes_light_i: texture_3d<f32>;

// How much of degree 0 is added, SHARED SHIFTS: to the values of order 0 of degree 2, and to all others.
const DAPPLE_PROBES_SHIFT_20: f32 = 2.25;
const DAPPLE_PROBES_SHIFT: f32 = 2.0;

fn dapple_probes_unpack(texels: DappleProbesL2) -> DappleProbesFlat {
    let l = texels[0];
    let shift = l * DAPPLE_PROBES_SHIFT;
    let a = texels[1] - shift;
    let b = texels[2] - shift;
    let c = texels[3] - shift;
    let d = texels[4] - shift;
    let e = texels[5] - shift;
    let f = texels[6] - l * DAPPLE_PROBES_SHIFT_20;
    let g = texels[7] - shift;
    let h = texels[8] - shift;
    return DappleProbesFlat(
        vec4f(l, a.x),
        vec4f(a.yz, b.xy),
        vec4f(b.z, c),
        vec4f(d, e.x),
        vec4f(e.yz, f.xy),
        vec4f(f.z, g),
        vec4f(h, 0.0),
    );
}

fn dapple_probes_filtered(uvw: vec3f) -> DappleProbesFlat {
    return dapple_probes_unpack(DappleProbesL2(
        textureSampleLevel(dapple_probes_light_a, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_b, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_c, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_d, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_e, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_f, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_g, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_h, dapple_probes_filtering, uvw, 0.0).xyz,
        textureSampleLevel(dapple_probes_light_i, dapple_probes_filtering, uvw, 0.0).xyz,
    ));
}

fn dapple_probes_values(volume: DappleProbesVolume, probe: u32) -> DappleProbesFlat {
    let row = probe / volume.dims.x;
    let at = vec3u(probe % volume.dims.x, row % volume.dims.y, row / volume.dims.y);
    return dapple_probes_unpack(DappleProbesL2(
        textureLoad(dapple_probes_light_a, at, 0).xyz,
        textureLoad(dapple_probes_light_b, at, 0).xyz,
        textureLoad(dapple_probes_light_c, at, 0).xyz,
        textureLoad(dapple_probes_light_d, at, 0).xyz,
        textureLoad(dapple_probes_light_e, at, 0).xyz,
        textureLoad(dapple_probes_light_f, at, 0).xyz,
        textureLoad(dapple_probes_light_g, at, 0).xyz,
        textureLoad(dapple_probes_light_h, at, 0).xyz,
        textureLoad(dapple_probes_light_i, at, 0).xyz,
    ));
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
