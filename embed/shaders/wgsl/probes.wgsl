// Sampler of the `probes` model: the light at a surface from the probes of one volume, and what a material makes
// of it. Twin of `sample.rs`, `visibility.rs`, `sh.rs` and `ggx` of `src/probes/`: same names without the prefix,
// same order of operations. Constants marked SHARED stand on both sides. Everything is in grid space.
//
// The arrays come through five functions, which `probes_buffers.wgsl` and `probes_textures.wgsl` define:
// - dapple_probes_filtered(uvw: vec3f) -> DappleProbesFlat: values by hardware trilinear filtering
// - dapple_probes_values(volume: DappleProbesVolume, probe: u32) -> DappleProbesFlat
// - dapple_probes_present(probe: u32) -> bool
// - dapple_probes_visibility(texel: u32) -> vec2u: mean and deviation, 0 to 255
// - dapple_probes_environment_entry(entry: u32) -> vec2f: the table of `embed/shaders/tables`

const DAPPLE_PROBES_PI: f32 = 3.14159265;
const DAPPLE_PROBES_NORMAL_BIAS: f32 = 0.045; // SHARED
const DAPPLE_PROBES_VIEW_BIAS: f32 = 0.18; // SHARED
const DAPPLE_PROBES_WRAP: f32 = 0.2; // SHARED
const DAPPLE_PROBES_UNSEEN: f32 = 1e-6; // SHARED
const DAPPLE_PROBES_ABSENT: f32 = 1e-12; // SHARED
const DAPPLE_PROBES_CRUSH: f32 = 0.2; // SHARED
const DAPPLE_PROBES_DIELECTRIC: f32 = 0.04; // SHARED
const DAPPLE_PROBES_LOBE_SMOOTH = vec3f(1.0, 0.8, 0.5); // SHARED
const DAPPLE_PROBES_LOBE_ROUGH = vec3f(1.0, 0.66666667, 0.25); // SHARED
const DAPPLE_PROBES_ENVIRONMENT_SIDE: f32 = 32.0; // SHARED
const DAPPLE_PROBES_COSINE = vec3f(3.14159265, 2.09439510, 0.78539816); // SHARED

// 112 bytes.
struct DappleProbesVolume {
    grid_from_world: mat4x3f,
    dims: vec3u,
    // Side of a probe's visibility block; 0: the volume has none.
    side: u32,
    spacing: vec3f,
    // Two to the volume's exponent.
    scale: f32,
    // Metres that code 255 of visibility stands for.
    range: f32,
}

// The values of a probe, before the scale: four a plane.
alias DappleProbesFlat = array<vec4f, 7>;
alias DappleProbesL2 = array<vec3f, 9>;

fn dapple_probes_expansion(v: DappleProbesFlat) -> DappleProbesL2 {
    return DappleProbesL2(
        v[0].xyz,
        vec3f(v[0].w, v[1].xy),
        vec3f(v[1].zw, v[2].x),
        v[2].yzw,
        v[3].xyz,
        vec3f(v[3].w, v[4].xy),
        vec3f(v[4].zw, v[5].x),
        v[5].yzw,
        v[6].xyz,
    );
}

fn dapple_probes_trilinear(volume: DappleProbesVolume, x: vec3f) -> DappleProbesL2 {
    let dims = vec3f(volume.dims);
    // Clamped before the sampler clamps: its coordinates have few bits far outside.
    let at = clamp(x / volume.spacing, vec3f(0.0), dims - 1.0);
    let uvw = (at + 0.5) / dims;
    let s = volume.scale;
    var sum = dapple_probes_filtered(uvw);
    for (var t = 0u; t < 7u; t++) {
        sum[t] *= s;
    }
    return dapple_probes_expansion(sum);
}

fn dapple_probes_index_of(volume: DappleProbesVolume, at: vec3u) -> u32 {
    return at.x + volume.dims.x * (at.y + volume.dims.y * at.z);
}

fn dapple_probes_visibility_weighted(
    volume: DappleProbesVolume,
    x: vec3f,
    n: vec3f,
    v: vec3f,
) -> DappleProbesL2 {
    let spacing = volume.spacing;
    let least = min(spacing.x, min(spacing.y, spacing.z));
    let seen_at = x + (n * DAPPLE_PROBES_NORMAL_BIAS + v * DAPPLE_PROBES_VIEW_BIAS) * least;
    let last = volume.dims - 1u;
    let at = clamp(x / spacing, vec3f(0.0), vec3f(last));
    let base = min(vec3u(at), max(last, vec3u(1u)) - 1u);
    let f = at - vec3f(base);
    var sum = DappleProbesFlat();
    var plain = DappleProbesFlat();
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let pick = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let sides = select(1.0 - f, f, pick == vec3u(1u));
        let trilinear_weight = sides.x * sides.y * sides.z;
        let place = min(base + pick, last);
        let number = dapple_probes_index_of(volume, place);
        let probe = vec3f(place) * spacing;
        var to_probe = probe - x;
        let distance = length(to_probe);
        to_probe = select(n, to_probe / distance, distance > 1e-30);
        let half_cosine = 0.5 + 0.5 * dot(to_probe, n);
        let wrap = half_cosine * half_cosine + DAPPLE_PROBES_WRAP;
        var trust = 1.0;
        if !dapple_probes_present(number) {
            trust = DAPPLE_PROBES_ABSENT;
        } else if volume.side > 0u {
            trust = max(dapple_probes_share(volume, number, seen_at - probe), DAPPLE_PROBES_UNSEEN);
        }
        let weight = trilinear_weight * wrap * trust;
        total += weight;
        let values = dapple_probes_values(volume, number);
        for (var t = 0u; t < 7u; t++) {
            sum[t] += values[t] * weight;
            plain[t] += values[t] * trilinear_weight;
        }
    }
    for (var t = 0u; t < 7u; t++) {
        if total > 0.0 {
            sum[t] = sum[t] / total * volume.scale;
        } else {
            sum[t] = plain[t] * volume.scale;
        }
    }
    return dapple_probes_expansion(sum);
}

fn dapple_probes_share(volume: DappleProbesVolume, probe: u32, offset: vec3f) -> f32 {
    let distance = length(offset);
    let m = dapple_probes_moments(volume, probe, offset);
    let mean = m.x;
    let code = volume.range / 255.0;
    // Rounding may leave a mean of texels that are all 255 a little below the range.
    if distance <= mean || mean >= volume.range - 0.5 * code {
        return 1.0;
    }
    let variance = max(m.y - mean * mean, code * code);
    let beyond = distance - mean;
    let bound = variance / (variance + beyond * beyond);
    let cubed = bound * bound * bound;
    let crushed = min(cubed / DAPPLE_PROBES_CRUSH, 1.0);
    return cubed * (crushed * crushed);
}

fn dapple_probes_moments(volume: DappleProbesVolume, probe: u32, direction: vec3f) -> vec2f {
    let n = i32(volume.side);
    let at = (dapple_probes_octahedral(direction) + 1.0) * (0.5 * f32(n)) - 0.5;
    let base = floor(at);
    let f = at - base;
    var sums = vec2f(0.0);
    for (var row = 0; row < 2; row++) {
        for (var column = 0; column < 2; column++) {
            let weight = select(1.0 - f.y, f.y, row == 1) * select(1.0 - f.x, f.x, column == 1);
            let texel = dapple_probes_fold(i32(base.y) + row, i32(base.x) + column, n);
            let codes = dapple_probes_visibility(probe * u32(n * n) + texel);
            let metres = vec2f(codes) * (volume.range / 255.0);
            sums += weight * vec2f(metres.x, metres.x * metres.x + metres.y * metres.y);
        }
    }
    return sums;
}

fn dapple_probes_fold(row_: i32, column_: i32, n: i32) -> u32 {
    var row = row_;
    var column = column_;
    if column < 0 || column >= n {
        row = n - 1 - row;
        column = clamp(column, 0, n - 1);
    }
    if row < 0 || row >= n {
        row = clamp(row, 0, n - 1);
        column = n - 1 - column;
    }
    return u32(clamp(row * n + column, 0, n * n - 1));
}

fn dapple_probes_octahedral(d: vec3f) -> vec2f {
    let sum = abs(d.x) + abs(d.y) + abs(d.z);
    if !(sum > 0.0) {
        return vec2f(0.0);
    }
    let p = d.xy / sum;
    if d.z < 0.0 {
        let signs = select(vec2f(1.0), vec2f(-1.0), p < vec2f(0.0));
        return (1.0 - abs(p.yx)) * signs;
    }
    return p;
}

fn dapple_probes_convolved(c: DappleProbesL2, factors: vec3f, d: vec3f) -> vec3f {
    let x = d.x;
    let y = d.y;
    let z = d.z;
    let band1 = c[1] * (0.4886025 * y) + c[2] * (0.4886025 * z) + c[3] * (0.4886025 * x);
    let band2 = c[4] * (1.0925484 * x * y) + c[5] * (1.0925484 * y * z)
        + c[6] * (0.31539157 * (3.0 * z * z - 1.0)) + c[7] * (1.0925484 * x * z)
        + c[8] * (0.5462742 * (x * x - y * y));
    return c[0] * (0.28209479 * factors.x) + band1 * factors.y + band2 * factors.z;
}

// Factors of degree 0 to 2.
fn dapple_probes_lobe(roughness: f32) -> vec3f {
    let share = clamp(roughness, 0.0, 1.0);
    return DAPPLE_PROBES_LOBE_SMOOTH
        + (DAPPLE_PROBES_LOBE_ROUGH - DAPPLE_PROBES_LOBE_SMOOTH) * share;
}

fn dapple_probes_environment(n_v: f32, roughness: f32) -> vec2f {
    let at = clamp(vec2f(sqrt(max(n_v, 0.0)), roughness), vec2f(0.0), vec2f(1.0))
        * (DAPPLE_PROBES_ENVIRONMENT_SIDE - 1.0);
    let cell = min(vec2u(at), vec2u(u32(DAPPLE_PROBES_ENVIRONMENT_SIDE) - 2u));
    let f = at - vec2f(cell);
    let side = u32(DAPPLE_PROBES_ENVIRONMENT_SIDE);
    let first = cell.y * side + cell.x;
    let second = first + side;
    let a = dapple_probes_environment_entry(first);
    let low = a + (dapple_probes_environment_entry(first + 1u) - a) * f.x;
    let b = dapple_probes_environment_entry(second);
    let high = b + (dapple_probes_environment_entry(second + 1u) - b) * f.x;
    return low + (high - low) * f.y;
}

fn dapple_probes_lobe_direction(n: vec3f, v: vec3f, roughness: f32) -> vec3f {
    let mirror = n * (2.0 * dot(n, v)) - v;
    let alpha = clamp(roughness * roughness, 0.0, 1.0);
    let smooth_ = 1.0 - alpha;
    let share = smooth_ * (sqrt(smooth_) + alpha);
    let d = n + (mirror - n) * share;
    let size = length(d);
    return select(n, d / size, size > 1e-30);
}

struct DappleProbesIncomingLight {
    irradiance: vec3f,
    filtered: vec3f,
}

fn dapple_probes_incoming_light(
    radiance: DappleProbesL2,
    n: vec3f,
    v: vec3f,
    roughness: f32,
) -> DappleProbesIncomingLight {
    let direction = dapple_probes_lobe_direction(n, v, roughness);
    let irradiance = max(dapple_probes_convolved(radiance, DAPPLE_PROBES_COSINE, n), vec3f(0.0));
    let filtered = max(dapple_probes_convolved(radiance, dapple_probes_lobe(roughness), direction), vec3f(0.0));
    return DappleProbesIncomingLight(irradiance, filtered);
}

struct DappleProbesIndirect {
    diffuse: vec3f,
    glossy: vec3f,
}

fn dapple_probes_shade(
    radiance: DappleProbesL2,
    base_color: vec3f,
    metallic_: f32,
    roughness_: f32,
    n: vec3f,
    v: vec3f,
) -> DappleProbesIndirect {
    let roughness = clamp(roughness_, 0.0, 1.0);
    let metallic = clamp(metallic_, 0.0, 1.0);
    let e = dapple_probes_environment(dot(n, v), roughness);
    let f0 = mix(vec3f(DAPPLE_PROBES_DIELECTRIC), base_color, metallic);
    let light = dapple_probes_incoming_light(radiance, n, v, roughness);
    let left = 1.0 - (DAPPLE_PROBES_DIELECTRIC * e.x + e.y);
    var out: DappleProbesIndirect;
    out.diffuse = base_color * light.irradiance * ((1.0 - metallic) * left / DAPPLE_PROBES_PI);
    out.glossy = light.filtered * (f0 * e.x + e.y);
    return out;
}
