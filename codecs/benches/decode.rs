//! Decoding uncompressed `cells` records on one core, as a ratio to `memcpy` of the same bytes in
//! the same run: `cargo bench -p dapple-codec --bench decode`, with `-- WORD` only the rows that
//! have the word in their names.
//!
//! "Cells" counts the bytes of the decoded cells alone, 32 each; "state" adds the buckets, 32 each,
//! of which a keyframe has one for every two cells here. Time without CRC is the time less that of the same CRC over the same bytes.

use std::hint::black_box;
use std::time::Instant;

use dapple_codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
use dapple_codec::*;

const FRAMES: u64 = 4;
const ROUNDS: usize = 30;

struct Case {
    name: &'static str,
    cells: u32,
    widths: PointWidths,
    /// One in this many cells is sent.
    every: usize,
    coverage: Coverage,
}

/// A table of `cells` cells of seven points, all reachable, about four cells a bucket.
fn table(case: &Case) -> (Track, Vec<Bucket>, Vec<Cell>) {
    let side = (f64::from(case.cells) * 4.0).cbrt().ceil() as u16;
    let grid = Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims: [side; 3],
        cell_edge: 0.1,
        radius: 0.05,
        widths: case.widths,
        // PSAO 3.2: four times the average number of cells, by eight entries.
        bucket_count: (case.cells / 2) | 1,
        cell_capacity: case.cells,
        coding: Coding::Cells,
    };
    let mut buckets = vec![Bucket::EMPTY; grid.bucket_count as usize];
    let mut cells = Vec::new();
    let mut key = 0u32;
    while cells.len() < case.cells as usize {
        key = (key + 3) % grid.volume() as u32;
        let bucket = &mut buckets[grid.bucket_of_key(key) as usize].0;
        let Some(free) = bucket.iter_mut().find(|entry| **entry == EMPTY) else {
            continue;
        };
        *free = cells.len() as u32;
        let point = case
            .widths
            .pack([0.3, 0.6, 0.9], [0.0, 1.0, 0.0], (key % 9) as f32 / 9.0);
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

/// The fastest of many: what the code costs when nothing else runs. All columns are taken so.
fn best(times: Vec<f64>) -> f64 {
    times.into_iter().fold(f64::INFINITY, f64::min)
}

fn run(case: &Case) -> Result<()> {
    let (track, buckets, cells) = table(case);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out)?;
    encoder.group(&mut out, GroupStart::Keyframes)?;
    encoder.tracks(&mut out, &[track])?;
    let bucket_indices: Vec<u32> = (0..buckets.len() as u32).collect();
    let all: Vec<u32> = (0..cells.len() as u32).collect();
    let whole = Update {
        track: 0,
        bucket_indices: &bucket_indices,
        buckets: &buckets,
        cell_indices: &all,
        cells: &cells,
    };
    encoder.points(&mut out, Coverage::Keyframe, &[whole], Compression::None)?;
    encoder.commit(&mut out, 0, None)?;
    let some: Vec<u32> = all.iter().copied().step_by(case.every).collect();
    let some_cells: Vec<Cell> = cells.iter().copied().step_by(case.every).collect();
    let part = Update {
        bucket_indices: &[],
        buckets: &[],
        cell_indices: &some,
        cells: &some_cells,
        ..whole
    };
    let update = if case.coverage == Coverage::Keyframe {
        whole
    } else {
        part
    };
    let mut starts = vec![out.len()];
    for tick in 1..=FRAMES {
        encoder.points(&mut out, case.coverage, &[update], Compression::None)?;
        encoder.commit(&mut out, tick, None)?;
        starts.push(out.len());
    }

    let cell_bytes = 32 * update.cells.len();
    let mut decoder = Decoder::new(Limits::default());
    let mut copy = vec![Cell::FREE; update.cells.len()];
    let (mut decode, mut crc, mut memcpy) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        decoder.reset();
        decoder.push_all(&out[..starts[0]], |_, _| {})?;
        for pair in starts.windows(2) {
            let start = Instant::now();
            decoder.push_all(&out[pair[0]..pair[1]], |_, _| {})?;
            let decoded = start.elapsed().as_secs_f64();
            decoder.clear_dirty();
            let start = Instant::now();
            black_box(container::crc32c(black_box(&out[pair[0]..pair[1]])));
            let summed = start.elapsed().as_secs_f64();
            let start = Instant::now();
            copy.copy_from_slice(black_box(update.cells));
            black_box(&mut copy);
            // The first round grows the buffers.
            if round > 0 {
                decode.push(decoded);
                crc.push(summed);
                memcpy.push(start.elapsed().as_secs_f64());
            }
        }
    }
    assert_eq!(decoder.points().cells(), cells);
    let (decode, crc, memcpy) = (best(decode), best(crc), best(memcpy));
    let rate = |seconds: f64| cell_bytes as f64 / seconds / 1e9;
    println!(
        "{:<34} {:>9.2} {:>9.2} {:>11.2} {:>11.2} {:>9.2} {:>13.2}",
        case.name,
        cell_bytes as f64 / 1e6,
        rate(decode) * (1.0 + update.buckets.len() as f64 / update.cells.len() as f64),
        rate(decode),
        rate(decode - crc),
        rate(memcpy),
        memcpy / decode,
    );
    Ok(())
}

fn main() -> Result<()> {
    println!(
        "{:<34} {:>9} {:>9} {:>11} {:>11} {:>9} {:>13}\n{:<34} {:>9} {:>9} {:>11} {:>11} {:>9} {:>13}",
        "frame",
        "cells",
        "state",
        "cells",
        "no CRC",
        "memcpy",
        "decode/memcpy",
        "",
        "MB",
        "GB/s",
        "GB/s",
        "GB/s",
        "GB/s",
        ""
    );
    let (w32, w24, w16) = (
        PointWidths::BITS_32,
        PointWidths::BITS_24,
        PointWidths::BITS_16,
    );
    let (key, delta) = (Coverage::Keyframe, Coverage::Delta);
    let case = |name, cells, widths, every, coverage| Case {
        name,
        cells,
        widths,
        every,
        coverage,
    };
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    for case in [
        case("keyframe, 4k cells, 32 bits", 4096, w32, 1, key),
        case("keyframe, 200k cells, 32 bits", 200_000, w32, 1, key),
        case("delta, all of 4k cells, 32 bits", 4096, w32, 1, delta),
        case("delta, all of 200k cells, 32 bits", 200_000, w32, 1, delta),
        case("delta, 1 in 20 of 200k, 32 bits", 200_000, w32, 20, delta),
        case("delta, all of 200k cells, 24 bits", 200_000, w24, 1, delta),
        case("delta, all of 200k cells, 16 bits", 200_000, w16, 1, delta),
    ] {
        if !words.iter().all(|word| case.name.contains(word.as_str())) {
            continue;
        }
        run(&case)?;
    }
    Ok(())
}
