// The stream that the examples decode. They include this file, since examples that are shown in the
// crate's documentation have no modules in files.

use dapple_codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
use dapple_codec::*;

/// Frames of the stream.
pub const FRAMES: u32 = 8;

/// A floor of 512 cells with one point each, of which one changes a frame.
pub fn stream() -> Result<Vec<u8>> {
    let grid = Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims: [16, 1, 32],
        cell_edge: 0.5,
        radius: 0.25,
        widths: PointWidths::BITS_32,
        bucket_count: 1031,
        cell_capacity: 512,
        coding: Coding::Cells,
    };
    let track = Track {
        id: 1,
        target: Target {
            path: "hall/floor".into(),
            ..Target::default()
        },
        aabb_min: [0.0; 3],
        aabb_max: [8.0, 0.5, 16.0],
        space: LookupSpace::Mesh,
        model: Model::Points(grid),
    };
    let point = |ao| grid.widths.pack([0.5, 0.5, 0.5], [0.0, 1.0, 0.0], ao);
    let cell = |key, ao| Cell {
        key,
        points: [point(ao), 0, 0, 0, 0, 0, 0],
    };
    let cells: Vec<Cell> = (0..512).map(|key| cell(key, 1.0)).collect();
    let mut buckets = vec![Bucket::EMPTY; grid.bucket_count as usize];
    for (index, cell) in cells.iter().enumerate() {
        let entries = &mut buckets[grid.bucket_of_key(cell.key) as usize].0;
        let free = entries.iter().position(|&entry| entry == EMPTY);
        entries[free.expect("no bucket overflows")] = index as u32;
    }

    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out)?;
    encoder.group(&mut out, GroupStart::Keyframes)?;
    encoder.tracks(&mut out, &[track])?;
    let keyframe = Update {
        track: 1,
        bucket_indices: &(0..grid.bucket_count).collect::<Vec<_>>(),
        buckets: &buckets,
        cell_indices: &(0..512).collect::<Vec<_>>(),
        cells: &cells,
    };
    encoder.points(&mut out, Coverage::Keyframe, &[keyframe], Compression::Lz4)?;
    encoder.commit(&mut out, 0, None)?;
    for frame in 1..FRAMES {
        let index = 60 * frame;
        let delta = Update {
            track: 1,
            bucket_indices: &[],
            buckets: &[],
            cell_indices: &[index],
            cells: &[cell(index, frame as f32 / FRAMES as f32)],
        };
        encoder.points(&mut out, Coverage::Delta, &[delta], Compression::Lz4)?;
        encoder.commit(&mut out, u64::from(frame), None)?;
    }
    encoder.end(&mut out)?;
    Ok(out)
}
