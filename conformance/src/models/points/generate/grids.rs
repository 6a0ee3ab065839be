//! Grids whose hash wraps, and bucket counts of all sorts.

use super::{AREA, Draft};
use crate::generate::frames::Frames;
use crate::models::points::frames::{WIDTHS, entry, filled, some};

/// Name, dims, buckets, cubes other than the first and the last.
type Grid = (&'static str, [u16; 3], u32, &'static [[u32; 3]]);

const GRIDS: &[Grid] = &[
    ("one-cube", [1, 1, 1], 7, &[]),
    (
        "row",
        [65535, 1, 1],
        10,
        &[[1, 0, 0], [32768, 0, 0], [65533, 0, 0]],
    ),
    (
        "column",
        [1, 65535, 1],
        10,
        &[[0, 1, 0], [0, 32768, 0], [0, 65533, 0]],
    ),
    (
        "pile",
        [1, 1, 65535],
        10,
        &[[0, 0, 1], [0, 0, 32768], [0, 0, 65533]],
    ),
    (
        "layer-65535-65535",
        [65535, 65535, 1],
        11,
        &[[0, 65534, 0], [65534, 0, 0], [9, 3856, 0], [65534, 3855, 0]],
    ),
    (
        "wall-1-65535-65535",
        [1, 65535, 65535],
        11,
        &[[0, 65534, 0], [0, 0, 65534], [0, 9, 2114]],
    ),
    (
        "wall-65535-1-65535",
        [65535, 1, 65535],
        11,
        &[[65534, 0, 0], [0, 0, 65534], [9, 0, 2114]],
    ),
    (
        "block-4000-4000-200",
        [4000, 4000, 200],
        997,
        &[[3999, 0, 0], [0, 3999, 0], [0, 0, 199], [1234, 2345, 67]],
    ),
    (
        "block-1625-1625-1625",
        [1625; 3],
        64,
        &[[1624, 0, 0], [0, 1624, 0], [0, 0, 1624], [811, 812, 813]],
    ),
    // 4 below 2^32 cubes, as near as three numbers of 16 bits come.
    (
        "largest",
        [65534, 32769, 2],
        13,
        &[[65533, 32768, 0], [0, 0, 1], [1, 32767, 1]],
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for &(name, dims, buckets, cubes) in GRIDS {
        let entry = entry(7, WIDTHS[0]).with_grid(|grid| {
            grid.dims = dims;
            grid.buckets = buckets;
        });
        let last = dims.map(|dim| u32::from(dim) - 1);
        let all: Vec<_> = [[0; 3]]
            .iter()
            .chain(cubes)
            .chain([&last])
            .copied()
            .collect();
        let cells: Vec<_> = (0..)
            .zip(&all)
            .map(|(i, cube)| (i, entry.grid().key(*cube), some(&entry, 5 * i, 1 + i % 3)))
            .collect();
        // A delta turns the cubes about, so that keys meet other buckets than those of the keyframe.
        let turned: Vec<_> = (0..)
            .zip(all.iter().rev())
            .map(|(i, cube)| (i, entry.grid().key(*cube), some(&entry, 7 * i, 2)))
            .collect();
        let mut second = filled(&entry, &turned);
        for (bucket, _) in &filled(&entry, &cells).buckets {
            if second.buckets.iter().all(|(index, _)| index != bucket) {
                second.buckets.push((*bucket, vec![]));
            }
        }
        second.buckets.sort_by_key(|bucket| bucket.0);
        let frames = Frames::new(std::slice::from_ref(&entry))
            .keyframe(&[filled(&entry, &cells)])
            .commit()
            .delta(&[second])
            .commit();
        let name = format!("grid-{name}");
        let comment = format!(
            "Cells at the ends of a grid of {} x {} x {} cubes.",
            dims[0], dims[1], dims[2]
        );
        drafts.push(Draft::valid(
            AREA,
            &name,
            &["P-005", "P-001", "P-029"],
            &comment,
            frames.ended(),
        ));
    }
    for buckets in [1, 2, 3, 7, 8, 12, 24, 25, 64, 257, 4096, 65537] {
        let entry = entry(7, WIDTHS[buckets as usize % 3]).with_grid(|grid| {
            grid.buckets = buckets;
        });
        // Eight cells, which fit into a single bucket.
        let cells: Vec<_> = [0, 1, 5, 10, 14, 17, 22, 23]
            .iter()
            .zip(2..)
            .map(|(&key, i)| (i, key, some(&entry, i, 1)))
            .collect();
        let frames = Frames::new(std::slice::from_ref(&entry));
        let frames = frames.keyframe(&[filled(&entry, &cells)]).commit();
        let name = format!("buckets-{buckets}");
        let comment = format!("Eight cells in {buckets} buckets.");
        drafts.push(Draft::valid(
            AREA,
            &name,
            &["P-005", "P-004"],
            &comment,
            frames.ended(),
        ));
    }
}
