// Sampler of the `points` model: PSAO Eq. 2-4. Twin of `src/points/sample.rs`: same names without the prefix,
// same order of operations. Constants marked SHARED stand on both sides.
//
// The arrays come through three functions, which `points_buffers.wgsl` and `points_textures.wgsl` define:
// - dapple_points_track(track: u32) -> DapplePointsTrack
// - dapple_points_bucket(bucket: u32, entry: u32) -> u32: a word of `PointsBuckets`, entry 0 to 7
// - dapple_points_cell(cell: u32, word: u32) -> u32: a word of `PointsCells`, the key at 0, points at 1 to 7

const DAPPLE_POINTS_NONE: u32 = 0xffffffffu; // SHARED NO_TRACK
const DAPPLE_POINTS_EMPTY: u32 = 0xffffffffu; // SHARED dapple_codec::points::EMPTY
const DAPPLE_POINTS_T_N: f32 = 0.1; // SHARED
const DAPPLE_POINTS_T_D: f32 = 0.7; // SHARED
const DAPPLE_POINTS_FILL_WEIGHT: f32 = 0.1; // SHARED
const DAPPLE_POINTS_FALLBACK_FILL: u32 = 1u; // SHARED Fallback::Fill
const DAPPLE_POINTS_CASE_FOUND: u32 = 0u; // SHARED Case::Found
const DAPPLE_POINTS_CASE_FILLED: u32 = 1u; // SHARED Case::Filled
const DAPPLE_POINTS_CASE_NONE: u32 = 2u; // SHARED Case::None

// 96 bytes.
struct DapplePointsTrack {
    first_bucket: u32,
    first_cell: u32,
    bucket_count: u32,
    cell_count: u32,
    dims: vec3u,
    // position | normal << 8 | ao << 16
    widths: u32,
    cell_edge: f32,
    radius: f32,
    pad: vec2u,
    // Rows of the 3x4 matrix from mesh space to grid space.
    row_x: vec4f,
    row_y: vec4f,
    row_z: vec4f,
}

// 8 bytes: AO, then `case | points << 8`.
struct DapplePointsResult {
    ao: f32,
    case_and_points: u32,
}

// Eq. 1, reduced by the track's bucket count.
fn dapple_points_hash(p: vec3u, t: DapplePointsTrack) -> u32 {
    return (p.x + p.y * t.dims.x * 17u + p.z * t.dims.x * t.dims.y * 31u) % t.bucket_count;
}

fn dapple_points_key(p: vec3u, t: DapplePointsTrack) -> u32 {
    return p.x + t.dims.x * (p.y + t.dims.y * p.z);
}

fn dapple_points_field(word: u32, shift: u32, bits: u32) -> u32 {
    return (word >> shift) & ((1u << bits) - 1u);
}

struct DapplePointsPoint {
    // Relative to the cell's corner, metres.
    position: vec3f,
    normal: vec3f,
    ao: f32,
}

fn dapple_points_unpack(word: u32, t: DapplePointsTrack) -> DapplePointsPoint {
    let bp = t.widths & 0xffu;
    let bn = (t.widths >> 8u) & 0xffu;
    let ba = (t.widths >> 16u) & 0xffu;
    let ao = f32(dapple_points_field(word, 0u, ba)) / f32((1u << ba) - 1u);
    let u = dapple_points_octahedral(word, ba, bn);
    let v = dapple_points_octahedral(word, ba + bn, bn);
    let base = ba + 2u * bn;
    let q = vec3f(
        f32(dapple_points_field(word, base, bp)),
        f32(dapple_points_field(word, base + bp, bp)),
        f32(dapple_points_field(word, base + 2u * bp, bp)),
    );
    let position = (q + vec3f(0.5)) / f32(1u << bp) * t.cell_edge;
    return DapplePointsPoint(position, dapple_points_octahedron_decode(u, v), ao);
}

// One octahedral coordinate: two's complement over 2^(b-1) - 1.
fn dapple_points_octahedral(word: u32, shift: u32, bits: u32) -> f32 {
    let code = bitcast<i32>(word << (32u - shift - bits)) >> (32u - bits);
    return max(f32(code) / f32((1 << (bits - 1u)) - 1), -1.0);
}

fn dapple_points_octahedron_decode(u: f32, v: f32) -> vec3f {
    let z = 1.0 - abs(u) - abs(v);
    if z < 0.0 {
        let x = (1.0 - abs(v)) * select(1.0, -1.0, u < 0.0);
        let y = (1.0 - abs(u)) * select(1.0, -1.0, v < 0.0);
        return normalize(vec3f(x, y, z));
    }
    return normalize(vec3f(u, v, z));
}

// AO at position x with unit normal n, grid space.
fn dapple_points_sample(t: DapplePointsTrack, x: vec3f, n: vec3f, fallback: u32) -> DapplePointsResult {
    let present_shift = 3u * (t.widths & 0xffu) + 2u * ((t.widths >> 8u) & 0xffu)
        + ((t.widths >> 16u) & 0xffu);
    let scaled = clamp(x / t.cell_edge, vec3f(-2.0), vec3f(65537.0));
    let base = floor(scaled);
    let near = scaled - base;
    let side = select(vec3f(-1.0), vec3f(1.0), near >= vec3f(0.5));
    let window = abs(near - vec3f(0.5)) * 2.0;
    var weight = 0.0;
    var weighted = 0.0;
    var points = 0u;
    var fill = 0.0;
    var filled = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let pick = vec3u(corner, corner >> 1u, corner >> 2u) & vec3u(1u);
        let offset = vec3f(pick) * side;
        let at = vec3i(base + offset);
        if any(at < vec3i(0)) || any(at >= vec3i(t.dims)) {
            continue;
        }
        let cell_window = select(1.0, window.x, pick.x == 1u)
            * select(1.0, window.y, pick.y == 1u)
            * select(1.0, window.z, pick.z == 1u);
        let wanted = dapple_points_key(vec3u(at), t);
        let bucket = t.first_bucket + dapple_points_hash(vec3u(at), t);
        // x relative to the cell's corner, as the points are: keeps precision far from the origin.
        let x_cell = x - vec3f(at) * t.cell_edge;
        for (var entry = 0u; entry < 8u; entry++) {
            let index = dapple_points_bucket(bucket, entry);
            if index == DAPPLE_POINTS_EMPTY {
                break;
            }
            if index >= t.cell_count || dapple_points_cell(t.first_cell + index, 0u) != wanted {
                continue;
            }
            for (var slot = 0u; slot < 7u; slot++) {
                let word = dapple_points_cell(t.first_cell + index, slot + 1u);
                if ((word >> present_shift) & 1u) == 0u {
                    continue;
                }
                let p = dapple_points_unpack(word, t);
                let agreement = dot(p.normal, n);
                if agreement <= DAPPLE_POINTS_T_N {
                    continue;
                }
                let to_point = p.position - x_cell;
                let distance = length(to_point);
                var slope = 0.0;
                if distance > 0.0 {
                    slope = dot(p.normal, to_point / distance);
                }
                let slope2 = slope * slope;
                if slope2 >= DAPPLE_POINTS_T_D {
                    continue;
                }
                let alpha = max(0.0, (t.radius - distance) / t.radius);
                if alpha > 0.0 {
                    points++;
                }
                weight += alpha;
                weighted += alpha * p.ao;
                let ratio = t.radius / max(distance, t.radius);
                let tail = cell_window * ratio * ratio
                    * (agreement - DAPPLE_POINTS_T_N) * (DAPPLE_POINTS_T_D - slope2);
                fill += tail;
                filled += tail * p.ao;
            }
        }
    }
    if fallback == DAPPLE_POINTS_FALLBACK_FILL && weight < DAPPLE_POINTS_FILL_WEIGHT && fill > 0.0 {
        let rest = DAPPLE_POINTS_FILL_WEIGHT - weight;
        let ao = (weighted + rest * (filled / fill)) / DAPPLE_POINTS_FILL_WEIGHT;
        let case_ = select(DAPPLE_POINTS_CASE_FOUND, DAPPLE_POINTS_CASE_FILLED, weight == 0.0);
        return DapplePointsResult(ao, case_ | (points << 8u));
    }
    if weight > 0.0 {
        return DapplePointsResult(weighted / weight, DAPPLE_POINTS_CASE_FOUND | (points << 8u));
    }
    return DapplePointsResult(1.0, DAPPLE_POINTS_CASE_NONE);
}

fn dapple_points_position(t: DapplePointsTrack, position: vec3f) -> vec3f {
    let p = vec4f(position, 1.0);
    return vec3f(dot(t.row_x, p), dot(t.row_y, p), dot(t.row_z, p));
}

// By the cofactors, which are the inverse transpose times the determinant and exist for flat transforms, too.
// Their sign follows a mirror so that outward stays outward.
fn dapple_points_normal(t: DapplePointsTrack, normal: vec3f) -> vec3f {
    let x = cross(t.row_y.xyz, t.row_z.xyz);
    let y = cross(t.row_z.xyz, t.row_x.xyz);
    let z = cross(t.row_x.xyz, t.row_y.xyz);
    let side = select(1.0, -1.0, dot(t.row_x.xyz, x) < 0.0);
    return normalize(vec3f(dot(x, normal), dot(y, normal), dot(z, normal)) * side);
}

// AO of a fragment by the number of its track, which may be DAPPLE_POINTS_NONE, and its position and normal in
// mesh space: those of the rest pose where the track is looked up there.
fn dapple_points_ao(track: u32, position: vec3f, normal: vec3f, fallback: u32) -> f32 {
    if track == DAPPLE_POINTS_NONE {
        return 1.0;
    }
    let t = dapple_points_track(track);
    return dapple_points_sample(t, dapple_points_position(t, position), dapple_points_normal(t, normal), fallback).ao;
}
