//! Size and speed of the codings of `vertices` beside meshoptimizer's vertex codec, on the values of a bake.
//!
//! ```text
//! cargo bench --profile dev --no-default-features --features encode --bench vertices_format -- SCENE.glb
//!     [--rays N] [--rounds N]
//! ```
//!
//! All tracks of a scene are one record, in order 0 (the file's vertices) and 1 (distinct ones), as the 97 : 3
//! blend in 8 bits, as both signals in 8 bits, and as the blend in 5 bits with dither. zstd is of level 19
//! everywhere. meshoptimizer takes elements of a multiple of four bytes: `padded` has a vertex in each,
//! `packed 4` four values; the smaller of both after zstd is compared. Each mesh is encoded by itself, and
//! zstd runs over all of them.
//!
//! Decoding is that of the whole stream, with CRC, checks and commit, against zstd and
//! `meshopt_decodeVertexBuffer`, on one core, in turns; the best of the rounds. Values a second are of what
//! is decoded: for `padded` not of the padding.

use std::path::Path;
use std::time::Instant;

use dapple::codec::vertices::*;
use dapple::codec::*;
use dapple::scene::{Mesh, Scene};
use dapple::trace::Tracer;
use dapple::vertices::server::{self as baked, Settings};

const LEVEL: i32 = 19;
const SHARE: f32 = 0.97;

/// Values of all meshes in one form.
struct Case {
    name: String,
    bits: u8,
    order: u8,
    signals: usize,
    /// Codes of each mesh, signals of a vertex side by side.
    meshes: Vec<Vec<u8>>,
}

fn main() {
    if let Err(message) = run() {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

fn run() -> std::result::Result<(), String> {
    let (mut scene_path, mut rays, mut rounds) = (String::new(), 64, 20);
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        let mut number = || {
            let value = arguments.next().and_then(|text| text.parse().ok());
            value.ok_or(format!("{argument} needs a number"))
        };
        match argument.as_str() {
            "--rays" => rays = number()?,
            "--rounds" => rounds = number()?,
            _ => scene_path = argument,
        }
    }
    if scene_path.is_empty() {
        return Err("name a scene: cargo bench --bench vertices_format -- SCENE.glb".into());
    }
    let scene = Scene::load(Path::new(&scene_path)).map_err(|e| e.to_string())?;
    let pose = scene.pose(0.0);
    let tracer = Tracer::new(&scene, &pose);
    let settings = Settings {
        rays,
        ..Settings::default()
    };
    let baked = baked::bake(&scene, &pose, &tracer, &settings);
    let (bake, _) = baked.map_err(|e| e.to_string())?;
    println!(
        "{}: {} meshes, {rays} rays a sample",
        scene.name,
        scene.instances.len()
    );
    println!(
        "{:<26} {:>8} {:>8} {:>9} {:>9} {:>9}  {:>7}  {:>9} {:>9} {:>9}  {:>6}",
        "values",
        "count",
        "raw",
        "raw zstd",
        "packed z.",
        "meshopt z.",
        "smaller",
        "raw M/s",
        "packed M/s",
        "meshopt M/s",
        "faster"
    );
    for order in [Vertices::FILE_ORDER, Vertices::DISTINCT_ORDER] {
        for (name, bits, signals) in [
            ("blend, 8 bits", 8, 1),
            ("both signals, 8 bits", 8, 2),
            ("blend, 5 bits dithered", 5, 1),
        ] {
            let meshes = scene.instances.iter().zip(&bake.instances);
            let case = Case {
                name: format!("{name}, order {order}"),
                bits,
                order,
                signals,
                meshes: meshes
                    .map(|(instance, values)| {
                        let mesh = &scene.meshes[instance.mesh];
                        codes(mesh, &values.values, bits, signals, order)
                    })
                    .collect(),
            };
            measure(&case, rounds);
        }
    }
    Ok(())
}

fn codes(mesh: &Mesh, values: &[Vec<f32>], bits: u8, signals: usize, order: u8) -> Vec<u8> {
    let vector = |v: &glam::Vec3| v.to_array();
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(vector).collect();
    let normals: Vec<[f32; 3]> = mesh.normals.iter().map(vector).collect();
    let remap = remap(&positions, &normals);
    let mut codes = Vec::new();
    let mut distinct = 0;
    for (vertex, &number) in remap.iter().enumerate() {
        if order == Vertices::DISTINCT_ORDER && number < distinct {
            continue;
        }
        distinct = distinct.max(number + 1);
        let (short, long) = (values[0][vertex], values[1][vertex]);
        if signals == 2 {
            codes.extend([nearest(short, bits), nearest(long, bits)]);
        } else {
            let blend = short + (long - short) * SHARE;
            codes.push(match bits {
                5 => dithered(blend, bits, number),
                _ => nearest(blend, bits),
            });
        }
    }
    codes
}

/// The stream of a case, one record.
fn stream(case: &Case, coding: Coding, compression: Compression) -> Vec<u8> {
    let (short, long) = (Kernel::exponential(2.0), Kernel::exponential(300.0));
    let signals = match case.signals {
        1 => Signals::blended(short, long, SHARE),
        _ => Signals::two(short, long, SHARE),
    };
    let meshes = (0u32..)
        .zip(&case.meshes)
        .filter(|(_, codes)| !codes.is_empty());
    let mut tracks = Vec::new();
    let mut updates = Vec::new();
    for (id, codes) in meshes {
        updates.push(Update { track: id, codes });
        tracks.push(Track {
            id,
            target: Target::default(),
            aabb_min: [0.0; 3],
            aabb_max: [1.0; 3],
            space: LookupSpace::Mesh,
            model: Model::Vertices(Vertices {
                signals,
                count: (codes.len() / case.signals) as u32,
                bits: case.bits,
                order: case.order,
                coding,
            }),
        });
    }
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).expect("preamble");
    encoder
        .group(&mut out, GroupStart::Keyframes)
        .expect("group");
    encoder.tracks(&mut out, &tracks).expect("tracks");
    encoder
        .vertices(&mut out, &updates, compression)
        .expect("values");
    encoder.commit(&mut out, 0, None).expect("commit");
    encoder.end(&mut out).expect("end");
    out
}

/// Bytes of the stored payload of the record of values, with its head and table.
fn record_bytes(stream: &[u8]) -> usize {
    let mut at = container::PREAMBLE_BYTES;
    loop {
        let word = |offset: usize| {
            let bytes = stream[at + offset..at + offset + 4].try_into();
            u32::from_le_bytes(bytes.expect("four bytes"))
        };
        let (record_type, stored) = (word(0) as u16 & 0x7fff, word(16) as usize);
        if record_type == container::record_type::VERTICES {
            return stored;
        }
        at += container::HEADER_BYTES + stored;
    }
}

/// Buffers of meshoptimizer: of each mesh its elements, and the bytes before zstd.
struct Meshopt {
    counts: Vec<(usize, usize)>,
    packed: Vec<u8>,
    /// Values of an element.
    values: usize,
}

fn meshopt_of(case: &Case, values: usize) -> Meshopt {
    let mut result = Meshopt {
        counts: Vec::new(),
        packed: Vec::new(),
        values,
    };
    for codes in &case.meshes {
        let element = |chunk: &[u8]| -> [u8; 4] {
            std::array::from_fn(|byte| chunk.get(byte).copied().unwrap_or(0))
        };
        let elements: Vec<[u8; 4]> = codes.chunks(values).map(element).collect();
        let encoded = meshopt::encode_vertex_buffer(&elements).expect("meshopt");
        result.counts.push((elements.len(), encoded.len()));
        result.packed.extend(encoded);
    }
    result
}

fn measure(case: &Case, rounds: u32) {
    let count: usize = case.meshes.iter().map(Vec::len).sum();
    let zstd = Compression::Zstd {
        level: LEVEL,
        lazy: false,
    };
    let raw = stream(case, Coding::Raw, Compression::None);
    let raw_zstd = stream(case, Coding::Raw, zstd);
    let packed = stream(case, Coding::Packed, zstd);
    let best = [case.signals, 4]
        .map(|values| {
            let meshopt = meshopt_of(case, values);
            let bytes = zstd::bulk::compress(&meshopt.packed, LEVEL).expect("zstd");
            (bytes.len(), bytes, meshopt)
        })
        .into_iter()
        .min_by_key(|(length, ..)| *length)
        .expect("two");
    let (_, meshopt_bytes, meshopt) = best;

    let mut seconds = [f64::INFINITY; 3];
    for _ in 0..rounds {
        for (bytes, best) in [&raw, &packed].into_iter().zip(&mut seconds) {
            let begin = Instant::now();
            let decoder = decode_all(bytes, Limits::default(), |_, _| {}).expect("a stream");
            *best = best.min(begin.elapsed().as_secs_f64());
            std::hint::black_box(decoder.vertices().values());
        }
        let begin = Instant::now();
        let unpacked = zstd::bulk::decompress(&meshopt_bytes, meshopt.packed.len()).expect("zstd");
        let mut rest = &unpacked[..];
        for &(elements, bytes) in &meshopt.counts {
            let (own, after) = rest.split_at(bytes);
            rest = after;
            let decoded: Vec<[u8; 4]> =
                meshopt::decode_vertex_buffer(own, elements).expect("meshopt");
            std::hint::black_box(decoded);
        }
        seconds[2] = seconds[2].min(begin.elapsed().as_secs_f64());
    }
    let speed = seconds.map(|s| count as f64 / s / 1e6);
    let bytes = record_bytes(&packed);
    println!(
        "{:<26} {count:>8} {:>8} {:>9} {bytes:>9} {:>9}  {:>6.2}x  {:>9.0} {:>9.0} {:>9.0}  {:>5.2}x  ({} values an element)",
        case.name,
        record_bytes(&raw),
        record_bytes(&raw_zstd),
        meshopt_bytes.len(),
        meshopt_bytes.len() as f64 / bytes as f64,
        speed[0],
        speed[1],
        speed[2],
        speed[1] / speed[2],
        meshopt.values,
    );
}
