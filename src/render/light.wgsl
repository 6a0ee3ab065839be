// Light of a rasterised picture, a thread a pixel: `direct` from punctual lights through shadow maps,
// `indirect` from one volume of probes. Stands behind `shadow.wgsl` and the sampler of `probes`. Twin
// of `light.rs` and of `trace/path/bsdf.rs`: same names, same order of operations. Constants marked
// SHARED stand on both sides.

const PI: f32 = 3.14159265;
const MIN_ROUGHNESS: f32 = 0.04; // SHARED
const MIN_VIEW_COSINE: f32 = 0.01; // SHARED
const NEAREST_SQUARED: f32 = 1e-4; // SHARED
const NO_VOLUME: u32 = 0xffffffffu; // SHARED
const SKY: u32 = 0xfffffffeu; // SHARED
const DIRECTIONAL: u32 = 0u; // SHARED
const SPOT: u32 = 2u; // SHARED
const RESISTANT: u32 = 1u; // SHARED

struct Pass {
    eye: vec3f,
    width: u32,
    height: u32,
    lights: u32,
    // Number of the volume that is bound.
    volume: u32,
    interpolation: u32,
}

// 64 bytes. World space.
struct Pixel {
    position: vec3f,
    // Number of the volume that lights it, NO_VOLUME, or SKY.
    volume: u32,
    geometric_normal: vec3f,
    roughness: f32,
    normal: vec3f,
    metallic: f32,
    base_color: vec3f,
    // Factor on indirect light.
    open: f32,
}

// 64 bytes.
struct Light {
    position: vec3f,
    kind: u32,
    direction: vec3f,
    range: f32,
    intensity: vec3f,
    first_face: u32,
    cos_inner: f32,
    cos_outer: f32,
    face_count: u32,
    // 1 where the range is none.
    unlimited: u32,
}

// 48 bytes: radiance towards the eye.
struct Lit {
    direct: vec3f,
    diffuse: vec3f,
    glossy: vec3f,
}

@group(0) @binding(0) var<uniform> pass_: Pass;
@group(0) @binding(1) var<storage, read> pixels: array<Pixel>;
@group(0) @binding(2) var<storage, read_write> results: array<Lit>;
@group(1) @binding(0) var<uniform> volume: DappleProbesVolume;
@group(1) @binding(20) var<storage, read> lights: array<Light>;

struct Bsdf {
    diffuse: vec3f,
    f0: vec3f,
    alpha: f32,
}

fn bsdf(p: Pixel) -> Bsdf {
    let metallic = clamp(p.metallic, 0.0, 1.0);
    let roughness = clamp(p.roughness, MIN_ROUGHNESS, 1.0);
    return Bsdf(
        p.base_color * (1.0 - metallic),
        mix(vec3f(0.04), p.base_color, metallic),
        roughness * roughness,
    );
}

fn seen_normal(normal: vec3f, view: vec3f) -> vec3f {
    let cosine = dot(normal, view);
    if cosine >= MIN_VIEW_COSINE {
        return normal;
    }
    let n = normal + view * (MIN_VIEW_COSINE - cosine);
    let size = length(n);
    return select(view, n / size, size > 1e-30);
}

fn evaluate(b: Bsdf, normal: vec3f, view: vec3f, light: vec3f) -> vec3f {
    let nv = dot(normal, view);
    let nl = dot(normal, light);
    if nv <= 0.0 || nl <= 0.0 {
        return vec3f(0.0);
    }
    let sum = view + light;
    let size = length(sum);
    let half_vector = select(normal, sum / size, size > 1e-30);
    let a2 = b.alpha * b.alpha;
    let cosine = dot(normal, half_vector);
    let sine = cross(normal, half_vector);
    let spread = cosine * cosine * a2 + dot(sine, sine);
    let d = a2 / (PI * spread * spread);
    let masked_v = sqrt(a2 + (1.0 - a2) * nv * nv);
    let masked_l = sqrt(a2 + (1.0 - a2) * nl * nl);
    let m = clamp(1.0 - dot(view, half_vector), 0.0, 1.0);
    let m2 = m * m;
    let fresnel = b.f0 + (1.0 - b.f0) * (m2 * m2 * m);
    let coat = fresnel * (0.5 * d * nl / (nl * masked_v + nv * masked_l));
    return coat + (1.0 - fresnel) * b.diffuse * (nl / PI);
}

// Direction to the light and its falloff. Twin of `LightPose::ray`.
fn ray(light: Light, position: vec3f) -> vec4f {
    if light.kind == DIRECTIONAL {
        return vec4f(-light.direction, 1.0);
    }
    let offset = light.position - position;
    let d2 = max(dot(offset, offset), NEAREST_SQUARED);
    var window = 1.0;
    if light.unlimited == 0u {
        let share = d2 / (light.range * light.range);
        window = clamp(1.0 - share * share, 0.0, 1.0);
    }
    let size = length(offset);
    let direction = select(vec3f(0.0), offset / size, size > 1e-30);
    var cone = 1.0;
    if light.kind == SPOT {
        let width = max(light.cos_inner - light.cos_outer, 1e-3);
        let t = clamp((dot(light.direction, -direction) - light.cos_outer) / width, 0.0, 1.0);
        cone = t * t;
    }
    return vec4f(direction, window / d2 * cone);
}

@compute @workgroup_size(8, 8)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= pass_.width || id.y >= pass_.height {
        return;
    }
    let at = id.y * pass_.width + id.x;
    let p = pixels[at];
    var sum = vec3f(0.0);
    if p.volume != SKY {
        let v = normalize(pass_.eye - p.position);
        let n = seen_normal(p.normal, v);
        let b = bsdf(p);
        for (var i = 0u; i < pass_.lights; i++) {
            let light = lights[i];
            let to = ray(light, p.position);
            if to.w <= 0.0 || dot(to.xyz, p.geometric_normal) <= 0.0 {
                continue;
            }
            let f = evaluate(b, n, v, to.xyz);
            let open = lit(light.first_face, light.face_count, p.position, p.geometric_normal);
            sum += f * light.intensity * (to.w * open);
        }
    }
    results[at] = Lit(sum, vec3f(0.0), vec3f(0.0));
}

@compute @workgroup_size(8, 8)
fn indirect(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= pass_.width || id.y >= pass_.height {
        return;
    }
    let at = id.y * pass_.width + id.x;
    let p = pixels[at];
    if p.volume != pass_.volume {
        return;
    }
    let v = normalize(pass_.eye - p.position);
    let n = seen_normal(p.normal, v);
    let x = volume.grid_from_world * vec4f(p.position, 1.0);
    let grid_n = volume.grid_from_world * vec4f(n, 0.0);
    let grid_v = volume.grid_from_world * vec4f(v, 0.0);
    var radiance: DappleProbesL2;
    if pass_.interpolation == RESISTANT {
        // Which probes see a place is a matter of geometry, not of a normal map.
        let facing = volume.grid_from_world * vec4f(p.geometric_normal, 0.0);
        radiance = dapple_probes_visibility_weighted(volume, x, facing, grid_v);
    } else {
        radiance = dapple_probes_trilinear(volume, x);
    }
    let light = dapple_probes_shade(radiance, p.base_color, p.metallic, p.roughness, grid_n, grid_v);
    results[at].diffuse = light.diffuse * p.open;
    results[at].glossy = light.glossy * p.open;
}
