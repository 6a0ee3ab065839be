// The client's sampler as a compute pass: PSAO Eq. 2-4 over a list of queries, one a pixel.
// Twin of `sample.rs`: same names, same order of operations. Constants marked SHARED stand on both
// sides.

const NONE: u32 = 0xffffffffu; // SHARED NO_TRACK
const EMPTY: u32 = 0xffffffffu; // SHARED dapple_codec::points::EMPTY
const T_N: f32 = 0.1; // SHARED
const T_D: f32 = 0.7; // SHARED
const FILL_WEIGHT: f32 = 0.1; // SHARED
const FALLBACK_FILL: u32 = 1u; // SHARED Fallback::Fill
const CASE_FOUND: u32 = 0u; // SHARED Case::Found
const CASE_FILLED: u32 = 1u; // SHARED Case::Filled
const CASE_NONE: u32 = 2u; // SHARED Case::None

struct Pass {
    width: u32,
    height: u32,
    fallback: u32,
    pad: u32,
}

// 32 bytes. Position and unit normal in grid space.
struct Query {
    position: vec3f,
    track: u32,
    normal: vec3f,
    pad: u32,
}

// 48 bytes.
struct Track {
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
}

struct Cell {
    key: u32,
    points: array<u32, 7>,
}

// 8 bytes: AO, then `case | points << 8`.
struct Result {
    ao: f32,
    case_and_points: u32,
}

@group(0) @binding(0) var<uniform> pass_: Pass;
@group(0) @binding(1) var<storage, read> queries: array<Query>;
@group(0) @binding(2) var<storage, read> tracks: array<Track>;
@group(0) @binding(3) var<storage, read> buckets: array<array<u32, 8>>;
@group(0) @binding(4) var<storage, read> cells: array<Cell>;
@group(0) @binding(5) var<storage, read_write> results: array<Result>;

// Eq. 1, reduced by the track's bucket count.
fn hash(p: vec3u, t: Track) -> u32 {
    return (p.x + p.y * t.dims.x * 17u + p.z * t.dims.x * t.dims.y * 31u) % t.bucket_count;
}

fn key(p: vec3u, t: Track) -> u32 {
    return p.x + t.dims.x * (p.y + t.dims.y * p.z);
}

fn field(word: u32, shift: u32, bits: u32) -> u32 {
    return extractBits(word, shift, bits);
}

struct Point {
    // Relative to the cell's corner, metres.
    position: vec3f,
    normal: vec3f,
    ao: f32,
}

fn unpack(word: u32, t: Track) -> Point {
    let bp = t.widths & 0xffu;
    let bn = (t.widths >> 8u) & 0xffu;
    let ba = (t.widths >> 16u) & 0xffu;
    let ao = f32(field(word, 0u, ba)) / f32((1u << ba) - 1u);
    let u = octahedral(word, ba, bn);
    let v = octahedral(word, ba + bn, bn);
    let base = ba + 2u * bn;
    let q = vec3f(
        f32(field(word, base, bp)),
        f32(field(word, base + bp, bp)),
        f32(field(word, base + 2u * bp, bp)),
    );
    let position = (q + vec3f(0.5)) / f32(1u << bp) * t.cell_edge;
    return Point(position, octahedron_decode(u, v), ao);
}

// One octahedral coordinate: two's complement over 2^(b-1) - 1.
fn octahedral(word: u32, shift: u32, bits: u32) -> f32 {
    let code = extractBits(bitcast<i32>(word), shift, bits);
    return max(f32(code) / f32((1 << (bits - 1u)) - 1), -1.0);
}

fn octahedron_decode(u: f32, v: f32) -> vec3f {
    let z = 1.0 - abs(u) - abs(v);
    if z < 0.0 {
        let x = (1.0 - abs(v)) * select(1.0, -1.0, u < 0.0);
        let y = (1.0 - abs(u)) * select(1.0, -1.0, v < 0.0);
        return normalize(vec3f(x, y, z));
    }
    return normalize(vec3f(u, v, z));
}

fn sample_points(t: Track, x: vec3f, n: vec3f, fallback: u32) -> Result {
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
        let wanted = key(vec3u(at), t);
        let bucket = t.first_bucket + hash(vec3u(at), t);
        // x relative to the cell's corner, as the points are: keeps precision far from the origin.
        let x_cell = x - vec3f(at) * t.cell_edge;
        for (var entry = 0u; entry < 8u; entry++) {
            let index = buckets[bucket][entry];
            if index == EMPTY {
                break;
            }
            if index >= t.cell_count || cells[t.first_cell + index].key != wanted {
                continue;
            }
            for (var slot = 0u; slot < 7u; slot++) {
                let word = cells[t.first_cell + index].points[slot];
                if ((word >> present_shift) & 1u) == 0u {
                    continue;
                }
                let p = unpack(word, t);
                let agreement = dot(p.normal, n);
                if agreement <= T_N {
                    continue;
                }
                let to_point = p.position - x_cell;
                let distance = length(to_point);
                var slope = 0.0;
                if distance > 0.0 {
                    slope = dot(p.normal, to_point / distance);
                }
                let slope2 = slope * slope;
                if slope2 >= T_D {
                    continue;
                }
                let alpha = max(0.0, (t.radius - distance) / t.radius);
                if alpha > 0.0 {
                    points++;
                }
                weight += alpha;
                weighted += alpha * p.ao;
                let ratio = t.radius / max(distance, t.radius);
                let tail = cell_window * ratio * ratio * (agreement - T_N) * (T_D - slope2);
                fill += tail;
                filled += tail * p.ao;
            }
        }
    }
    if fallback == FALLBACK_FILL && weight < FILL_WEIGHT && fill > 0.0 {
        let ao = (weighted + (FILL_WEIGHT - weight) * (filled / fill)) / FILL_WEIGHT;
        let case_ = select(CASE_FOUND, CASE_FILLED, weight == 0.0);
        return Result(ao, case_ | (points << 8u));
    }
    if weight > 0.0 {
        return Result(weighted / weight, CASE_FOUND | (points << 8u));
    }
    return Result(1.0, CASE_NONE);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= pass_.width || id.y >= pass_.height {
        return;
    }
    let i = id.y * pass_.width + id.x;
    let query = queries[i];
    if query.track == NONE {
        results[i] = Result(1.0, CASE_NONE);
        return;
    }
    results[i] = sample_points(tracks[query.track], query.position, query.normal, pass_.fallback);
}
