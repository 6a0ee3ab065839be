//! Points of all sorts of widths, and how many of them a cell has.

use super::{AREA, Draft, content};
use crate::generate::frames::Frames;
use crate::models::points::frames::{WIDTHS, entry, filled, point, some};
use crate::models::points::writer::Part;
use crate::stream_builder::Pack;

/// Widths (position, normal, AO) with each value that a field can have in points of 16, 24 and 32
/// bits. [`tests::each_value_of_each_width`] counts them.
const ALL: &[[u8; 3]] = &[
    [1, 2, 8],
    [1, 3, 6],
    [1, 4, 4],
    [1, 5, 2],
    [2, 2, 5],
    [2, 3, 3],
    [2, 4, 1],
    [3, 2, 2],
    [1, 6, 8],
    [2, 5, 7],
    [2, 7, 3],
    [2, 8, 1],
    [3, 4, 6],
    [3, 6, 2],
    [4, 3, 5],
    [5, 2, 4],
    [6, 2, 1],
    [3, 8, 6],
    [4, 6, 7],
    [4, 7, 5],
    [5, 4, 8],
    [5, 7, 2],
    [6, 5, 3],
    [6, 6, 1],
    [7, 3, 4],
    [8, 2, 3],
];

pub fn add(drafts: &mut Vec<Draft>) {
    for &widths in ALL {
        let entry = entry(7, widths);
        let [p, n, a] = widths.map(|bits| (1 << bits) - 1);
        // All bits of one field at a time, none and all.
        let fields = [
            entry.grid().point([0; 3], [0; 2], a),
            entry.grid().point([0; 3], [n, 0], 0),
            entry.grid().point([0; 3], [0, n], 0),
            entry.grid().point([p, 0, 0], [0; 2], 0),
            entry.grid().point([0, p, 0], [0; 2], 0),
            entry.grid().point([0, 0, p], [0; 2], 0),
            entry.grid().point([p; 3], [n; 2], a),
        ];
        let none = entry.grid().point([0; 3], [0; 2], 0);
        let first = filled(&entry, &[(1, 9, fields.to_vec()), (2, 9, vec![none])]);
        let second = Part::of(&entry).cell(1, 9, &some(&entry, 3, 3));
        let frames = Frames::new(&[entry])
            .keyframe(&[first])
            .commit()
            .delta(&[second])
            .commit();
        let [p, n, a] = widths;
        let bits = 1 + 3 * p + 2 * n + a;
        let name = format!("widths-{bits}-bits-{p}-{n}-{a}");
        let comment = format!(
            "Points of {bits} bits: {p} for each position, {n} for each normal, {a} for AO."
        );
        drafts.push(Draft::valid(
            AREA,
            &name,
            &["P-003", "P-007", "P-031"],
            &comment,
            frames.ended(),
        ));
    }
    for (bits, widths) in [32, 24, 16].into_iter().zip(WIDTHS) {
        counts(drafts, bits, widths);
        packings(drafts, bits, widths);
    }
}

/// Cells of 0 to 7 points, and from as many to others.
fn counts(drafts: &mut Vec<Draft>, bits: u32, widths: [u8; 3]) {
    let entry = entry(7, widths);
    let keyed = |count: fn(u32) -> u32| {
        let cells: Vec<_> = (0..8)
            .map(|cell| (cell, cell, some(&entry, 3 * cell, count(cell))))
            .collect();
        filled(&entry, &cells)
    };
    let frames = Frames::new(std::slice::from_ref(&entry)).keyframe(&[keyed(|cell| cell)]);
    let frames = frames.commit().delta(&[keyed(|cell| 7 - cell)]).commit();
    let name = format!("cells-of-0-to-7-points-{bits}-bits");
    let comment = "Cells of every number of points, then of 7 less that.";
    drafts.push(Draft::valid(
        AREA,
        &name,
        &["P-016", "P-024"],
        comment,
        frames.ended(),
    ));

    // Padding: 7 C w modulo 4 runs through all values.
    let mut frames = Frames::new(std::slice::from_ref(&entry));
    for count in 1..5 {
        let cells: Vec<_> = (0..count)
            .map(|cell| (cell, 2 * cell, vec![point(&entry, cell + count)]))
            .collect();
        frames = frames.keyframe(&[filled(&entry, &cells)]).commit();
    }
    let name = format!("padding-{bits}-bits");
    let comment = "Keyframes of 1 to 4 cells, with all the padding there is.";
    drafts.push(Draft::valid(
        AREA,
        &name,
        &["P-008", "P-010", "P-011"],
        comment,
        frames.ended(),
    ));
}

/// A keyframe and a delta in each packing.
fn packings(drafts: &mut Vec<Draft>, bits: u32, widths: [u8; 3]) {
    for (name, pack) in [
        ("plain", Pack::None),
        ("lz4", Pack::Lz4),
        ("zstd", Pack::Zstd(3)),
        ("zstd-19", Pack::Zstd(19)),
    ] {
        let entry = entry(7, widths);
        let next = Part::of(&entry).cell(5, 5, &some(&entry, 30, 7));
        let frames = Frames::new(std::slice::from_ref(&entry))
            .packed(pack)
            .keyframe(&[content(&entry)])
            .commit()
            .delta(&[next.cell(7, 11, &some(&entry, 40, 1))])
            .commit();
        let name = format!("packed-{name}-{bits}-bits");
        let comment = "A keyframe and a delta in one packing.";
        drafts.push(Draft::valid(
            AREA,
            &name,
            &["P-016", "C-034"],
            comment,
            frames.ended(),
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::ALL;
    use std::collections::BTreeSet;

    fn legal() -> impl Iterator<Item = (u8, [u8; 3])> {
        let triples =
            (1..=8).flat_map(|p| (2..=8).flat_map(move |n| (1..=8).map(move |a| [p, n, a])));
        triples
            .map(|[p, n, a]| (1 + 3 * p + 2 * n + a, [p, n, a]))
            .filter(|(bits, _)| [16, 24, 32].contains(bits))
    }

    #[test]
    fn each_value_of_each_width() {
        let values =
            |triples: &mut dyn Iterator<Item = (u8, [u8; 3])>| -> BTreeSet<(u8, usize, u8)> {
                triples
                    .flat_map(|(bits, widths)| {
                        (0..3).map(move |field| (bits, field, widths[field]))
                    })
                    .collect()
            };
        let own = |widths: &[u8; 3]| legal().find(|(_, legal)| legal == widths);
        let mut used = ALL
            .iter()
            .map(|widths| own(widths).unwrap_or_else(|| panic!("{widths:?}")));
        let used = values(&mut used);
        let missing: Vec<_> = values(&mut legal()).difference(&used).copied().collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
