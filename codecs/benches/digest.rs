//! State digests of `points` on one core, as a ratio to XXH64 of the same bytes in one piece in the same run: of the
//! committed state, and of a pending frame with a digest, without the time that the frame takes:
//! `cargo bench -p dapple-codec --bench digest`.

use std::hint::black_box;
use std::time::Instant;

use dapple_codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
use dapple_codec::*;
use twox_hash::XxHash64;

const ROUNDS: usize = 20;
const CELLS: u32 = 200_000;

/// A table of cells of seven points, all reachable, about four cells a bucket.
fn table(widths: PointWidths) -> (Track, Vec<Bucket>, Vec<Cell>) {
    let grid = Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims: [100; 3],
        cell_edge: 0.1,
        radius: 0.05,
        widths,
        bucket_count: (CELLS / 2) | 1,
        cell_capacity: CELLS,
        coding: Coding::Cells,
    };
    let mut buckets = vec![Bucket::EMPTY; grid.bucket_count as usize];
    let mut cells = Vec::new();
    let mut key = 0u32;
    while cells.len() < CELLS as usize {
        key = (key + 3) % grid.volume() as u32;
        let bucket = &mut buckets[grid.bucket_of_key(key) as usize].0;
        let Some(free) = bucket.iter_mut().find(|entry| **entry == EMPTY) else {
            continue;
        };
        *free = cells.len() as u32;
        let point = widths.pack([0.3, 0.6, 0.9], [0.0, 1.0, 0.0], (key % 9) as f32 / 9.0);
        cells.push(Cell {
            key,
            points: [point; 7],
        });
    }
    let track = Track {
        id: 0,
        target: Target::default(),
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Points(grid),
    };
    (track, buckets, cells)
}

/// The fastest of some runs: what the code costs when nothing else runs.
fn best(mut run: impl FnMut()) -> f64 {
    let times = (0..ROUNDS).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn main() -> Result<()> {
    println!("200k cells       ms      ratio to XXH64");
    for (name, widths, every) in [
        ("keyframe, 32 bits", PointWidths::BITS_32, 1),
        ("keyframe, 16 bits", PointWidths::BITS_16, 1),
        ("delta of one in 20", PointWidths::BITS_32, 20),
    ] {
        let (track, buckets, cells) = table(widths);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out)?;
        encoder.group(&mut out, GroupStart::Keyframes)?;
        encoder.tracks(&mut out, &[track])?;
        let bucket_indices: Vec<u32> = (0..buckets.len() as u32).collect();
        let all: Vec<u32> = (0..CELLS).collect();
        let whole = Update {
            track: 0,
            bucket_indices: &bucket_indices,
            buckets: &buckets,
            cell_indices: &all,
            cells: &cells,
        };
        encoder.points(&mut out, Coverage::Keyframe, &[whole], Compression::None)?;
        encoder.commit(&mut out, 0, None)?;
        let digest = encoder.state_digest();
        let some: Vec<u32> = all.iter().copied().step_by(every).collect();
        let some_cells: Vec<Cell> = cells.iter().copied().step_by(every).collect();
        let (update, coverage) = match every {
            1 => (whole, Coverage::Keyframe),
            _ => {
                let part = Update {
                    bucket_indices: &[],
                    buckets: &[],
                    cell_indices: &some,
                    cells: &some_cells,
                    ..whole
                };
                (part, Coverage::Delta)
            }
        };
        // One frame that states the digest, which the update does not change, and one that does not.
        let mut frame = |digest: Option<u64>, tick| {
            let mut bytes = Vec::new();
            encoder.points(&mut bytes, coverage, &[update], Compression::None)?;
            encoder.commit(&mut bytes, tick, digest)?;
            Ok(bytes)
        };
        let (stated, plain) = (frame(Some(digest), 1)?, frame(None, 2)?);
        let time = |frames: [&[u8]; 2]| {
            let mut times = [f64::INFINITY; 2];
            for _ in 0..ROUNDS {
                let mut decoder = Decoder::new(Limits::default());
                decoder.push_all(&out, |_, _| {}).expect("valid");
                for (frame, best) in frames.iter().zip(&mut times) {
                    let start = Instant::now();
                    decoder.push_all(frame, |_, _| {}).expect("valid");
                    *best = best.min(start.elapsed().as_secs_f64());
                }
            }
            times
        };
        let [with, without] = time([&stated, &plain]);
        let mut decoder = Decoder::new(Limits::default());
        decoder.push_all(&out, |_, _| {})?;
        let committed = best(|| {
            black_box(decoder.state_digest());
        });
        // What the digest covers: 8 bytes a bucket and 32 a cell.
        let used = buckets.iter().filter(|bucket| bucket.0[0] != EMPTY).count();
        let bytes = vec![7u8; 8 * used + 32 * cells.len()];
        let hash = best(|| {
            black_box(XxHash64::oneshot(0, black_box(&bytes)));
        });
        println!("{name}");
        for (what, seconds) in [("committed", committed), ("pending", with - without)] {
            println!(
                "  {what:<12} {:>6.2} {:>10.1}",
                1e3 * seconds,
                seconds / hash
            );
        }
    }
    Ok(())
}
