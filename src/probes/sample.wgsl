// The client's sampler of the `probes` model: the light at a surface from the probes of one volume,
// and what a material makes of it. Twin of `sample.rs`, `visibility.rs`, `sh.rs` and `ggx`: same
// names, same order of operations. Constants marked SHARED stand on both sides. Everything is in
// grid space.

const PI: f32 = 3.14159265;
const NORMAL_BIAS: f32 = 0.045; // SHARED
const VIEW_BIAS: f32 = 0.18; // SHARED
const WRAP: f32 = 0.2; // SHARED
const UNSEEN: f32 = 1e-6; // SHARED
const ABSENT: f32 = 1e-12; // SHARED
const CRUSH: f32 = 0.2; // SHARED
const DIELECTRIC: f32 = 0.04; // SHARED
const LOBE_ENTRIES: f32 = 64.0; // SHARED
const ENVIRONMENT_SIDE: f32 = 32.0; // SHARED
const COSINE = vec3f(3.14159265, 2.09439510, 0.78539816); // SHARED

// 112 bytes.
struct Volume {
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

@group(1) @binding(0) var<uniform> volume: Volume;
// Seven planes of one texel a probe, four f16 each.
@group(1) @binding(1) var<storage, read> texels: array<vec2u>;
// A bit a probe, low bit first.
@group(1) @binding(2) var<storage, read> present: array<u32>;
// Two texels a word: mean and deviation, a byte each.
@group(1) @binding(3) var<storage, read> visibility: array<u32>;
// Factors of degree 1 to 4.
@group(1) @binding(4) var<storage, read> lobes: array<vec4f>;
// Scale and bias.
@group(1) @binding(5) var<storage, read> environments: array<vec2f>;
// The planes again, for the texture unit: linear, clamped to the edge.
@group(1) @binding(6) var filtering: sampler;
@group(1) @binding(7) var plane0: texture_3d<f32>;
@group(1) @binding(8) var plane1: texture_3d<f32>;
@group(1) @binding(9) var plane2: texture_3d<f32>;
@group(1) @binding(10) var plane3: texture_3d<f32>;
@group(1) @binding(11) var plane4: texture_3d<f32>;
@group(1) @binding(12) var plane5: texture_3d<f32>;
@group(1) @binding(13) var plane6: texture_3d<f32>;

// Flat values, four a plane.
alias Flat = array<vec4f, 7>;
alias L2 = array<vec3f, 9>;

fn expansion(v: Flat) -> L2 {
    return L2(
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

fn trilinear(x: vec3f) -> L2 {
    let dims = vec3f(volume.dims);
    // Clamped before the sampler clamps: its coordinates have few bits far outside.
    let at = clamp(x / volume.spacing, vec3f(0.0), dims - 1.0);
    let uvw = (at + 0.5) / dims;
    let s = volume.scale;
    return expansion(Flat(
        textureSampleLevel(plane0, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane1, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane2, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane3, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane4, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane5, filtering, uvw, 0.0) * s,
        textureSampleLevel(plane6, filtering, uvw, 0.0) * s,
    ));
}

fn index_of(at: vec3u) -> u32 {
    return at.x + volume.dims.x * (at.y + volume.dims.y * at.z);
}

fn visibility_weighted(x: vec3f, n: vec3f, v: vec3f) -> L2 {
    let spacing = volume.spacing;
    let least = min(spacing.x, min(spacing.y, spacing.z));
    let seen_at = x + (n * NORMAL_BIAS + v * VIEW_BIAS) * least;
    let last = volume.dims - 1u;
    let at = clamp(x / spacing, vec3f(0.0), vec3f(last));
    let base = min(vec3u(at), max(last, vec3u(1u)) - 1u);
    let f = at - vec3f(base);
    let count = volume.dims.x * volume.dims.y * volume.dims.z;
    var sum = Flat();
    var plain = Flat();
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let pick = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let sides = select(1.0 - f, f, pick == vec3u(1u));
        let trilinear_weight = sides.x * sides.y * sides.z;
        let place = min(base + pick, last);
        let number = index_of(place);
        let probe = vec3f(place) * spacing;
        var to_probe = probe - x;
        let distance = length(to_probe);
        to_probe = select(n, to_probe / distance, distance > 1e-30);
        let half_cosine = 0.5 + 0.5 * dot(to_probe, n);
        let wrap = half_cosine * half_cosine + WRAP;
        var trust = 1.0;
        if ((present[number / 32u] >> (number % 32u)) & 1u) == 0u {
            trust = ABSENT;
        } else if volume.side > 0u {
            trust = max(share(number, seen_at - probe), UNSEEN);
        }
        let weight = trilinear_weight * wrap * trust;
        total += weight;
        for (var t = 0u; t < 7u; t++) {
            let bits = texels[t * count + number];
            let values = vec4f(unpack2x16float(bits.x), unpack2x16float(bits.y));
            sum[t] += values * weight;
            plain[t] += values * trilinear_weight;
        }
    }
    for (var t = 0u; t < 7u; t++) {
        if total > 0.0 {
            sum[t] = sum[t] / total * volume.scale;
        } else {
            sum[t] = plain[t] * volume.scale;
        }
    }
    return expansion(sum);
}

fn share(probe: u32, offset: vec3f) -> f32 {
    let distance = length(offset);
    let m = moments(probe, offset);
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
    let crushed = min(cubed / CRUSH, 1.0);
    return cubed * (crushed * crushed);
}

fn moments(probe: u32, direction: vec3f) -> vec2f {
    let n = i32(volume.side);
    let at = (octahedral(direction) + 1.0) * (0.5 * f32(n)) - 0.5;
    let base = floor(at);
    let f = at - base;
    var sums = vec2f(0.0);
    for (var row = 0; row < 2; row++) {
        for (var column = 0; column < 2; column++) {
            let weight = select(1.0 - f.y, f.y, row == 1) * select(1.0 - f.x, f.x, column == 1);
            let texel = fold(i32(base.y) + row, i32(base.x) + column, n);
            let index = probe * u32(n * n) + texel;
            let word = visibility[index / 2u] >> (16u * (index % 2u));
            let codes = vec2f(f32(word & 255u), f32((word >> 8u) & 255u));
            let metres = codes * (volume.range / 255.0);
            sums += weight * vec2f(metres.x, metres.x * metres.x + metres.y * metres.y);
        }
    }
    return sums;
}

fn fold(row_: i32, column_: i32, n: i32) -> u32 {
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

fn octahedral(d: vec3f) -> vec2f {
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

fn convolved(c: L2, factors: vec3f, d: vec3f) -> vec3f {
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
fn lobe(roughness: f32) -> vec3f {
    let at = clamp(roughness, 0.0, 1.0) * (LOBE_ENTRIES - 1.0);
    let entry = min(u32(at), u32(LOBE_ENTRIES) - 2u);
    let f = at - f32(entry);
    let a = lobes[entry].xy;
    return vec3f(1.0, a + (lobes[entry + 1u].xy - a) * f);
}

fn environment(n_v: f32, roughness: f32) -> vec2f {
    let at = clamp(vec2f(sqrt(max(n_v, 0.0)), roughness), vec2f(0.0), vec2f(1.0))
        * (ENVIRONMENT_SIDE - 1.0);
    let cell = min(vec2u(at), vec2u(u32(ENVIRONMENT_SIDE) - 2u));
    let f = at - vec2f(cell);
    let side = u32(ENVIRONMENT_SIDE);
    let first = cell.y * side + cell.x;
    let low = environments[first] + (environments[first + 1u] - environments[first]) * f.x;
    let second = first + side;
    let high = environments[second] + (environments[second + 1u] - environments[second]) * f.x;
    return low + (high - low) * f.y;
}

fn lobe_direction(n: vec3f, v: vec3f, roughness: f32) -> vec3f {
    let mirror = n * (2.0 * dot(n, v)) - v;
    let alpha = clamp(roughness * roughness, 0.0, 1.0);
    let smooth_ = 1.0 - alpha;
    let share = smooth_ * (sqrt(smooth_) + alpha);
    let d = n + (mirror - n) * share;
    let size = length(d);
    return select(n, d / size, size > 1e-30);
}

struct IncomingLight {
    irradiance: vec3f,
    filtered: vec3f,
}

fn incoming_light(radiance: L2, n: vec3f, v: vec3f, roughness: f32) -> IncomingLight {
    let direction = lobe_direction(n, v, roughness);
    let irradiance = max(convolved(radiance, COSINE, n), vec3f(0.0));
    let filtered = max(convolved(radiance, lobe(roughness), direction), vec3f(0.0));
    return IncomingLight(irradiance, filtered);
}

struct Indirect {
    diffuse: vec3f,
    glossy: vec3f,
}

fn shade(
    radiance: L2,
    base_color: vec3f,
    metallic_: f32,
    roughness_: f32,
    n: vec3f,
    v: vec3f,
) -> Indirect {
    let roughness = clamp(roughness_, 0.0, 1.0);
    let metallic = clamp(metallic_, 0.0, 1.0);
    let e = environment(dot(n, v), roughness);
    let f0 = mix(vec3f(DIELECTRIC), base_color, metallic);
    let light = incoming_light(radiance, n, v, roughness);
    let left = 1.0 - (DIELECTRIC * e.x + e.y);
    var out: Indirect;
    out.diffuse = base_color * light.irradiance * ((1.0 - metallic) * left / PI);
    out.glossy = light.filtered * (f0 * e.x + e.y);
    return out;
}
