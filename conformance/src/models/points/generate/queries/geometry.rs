//! Where the query lies: distances, directions, cubes, sizes of grids.

use super::{Draw, QuerySet, X, Y, Z, any_point, beside, cube_of_27, oriented, still};
use crate::generate::Draft;
use crate::models::points::frames::WIDTHS;

/// Both criteria of Eq. 3 from both sides.
pub(super) fn one_point(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let point = oriented(&entry, [16; 3], [0, 0], 100);
    let mut set = QuerySet::of("at-the-point", still(&entry, &[([1; 3], vec![point])]));
    set.query(1, beside([0.0; 3]), Z)?
        .query(1, beside([0.0; 3]), [3, 4, 12])?
        .query(1, beside([0.0; 3]), [0, 0, -1])?
        .query(1, beside([0.0; 3]), X)?;
    set.finish(
        drafts,
        &["P-046", "P-045", "P-040", "P-041"],
        "The fragment is at a point: only the normals count.",
    );
    let frames = still(&entry, &[([1; 3], vec![point])]);
    let mut set = QuerySet::of("normals-that-agree", frames);
    // Cosines of 0.102, 0.098, 0.11, 0.09, 0.9, 0 and -1.
    for normal in [
        [994_784, 0, 102_000],
        [0, 995_186, 98_000],
        [-993_932, 0, 110_000],
        [0, -995_942, 90_000],
        [435_890, 0, 900_000],
        [1, 1, 0],
        [0, 0, -7],
    ] {
        set.query(1, beside([0.1, 0.02, 0.0]), normal)?;
    }
    set.finish(
        drafts,
        &["P-045", "P-048"],
        "The cosine between the normals of point and fragment is on either side of T_n.",
    );
    let frames = still(&entry, &[([1; 3], vec![point])]);
    let mut set = QuerySet::of("directions-across", frames);
    // Squared cosines of the direction to the point.
    for slope in [0.0, 0.3, 0.5, 0.69, 0.698f64, 0.702, 0.71, 0.84, 1.0] {
        let (along, across) = (0.1 * slope.sqrt(), 0.1 * (1.0 - slope).sqrt());
        set.query(1, beside([across, 0.0, along]), Z)?;
        set.query(1, beside([0.0, -across, -along]), Z)?;
    }
    set.finish(
        drafts,
        &["P-045", "P-048"],
        "The squared cosine between the point's normal and the direction to it is on either side of T_d.",
    );
    Ok(())
}

/// The weight of Eq. 2: a second point at another distance takes its share.
pub(super) fn distances(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let near = oriented(&entry, [16; 3], [0, 0], 255);
    let far = oriented(&entry, [24, 16, 16], [0, 0], 0);
    let mut set = QuerySet::of("distances", still(&entry, &[([1; 3], vec![near, far])]));
    for dx in [-0.2, -0.1, -0.03, 0.02, 0.05, 0.0625, 0.1, 0.12, 0.2, 0.3] {
        set.query(1, beside([dx, 0.03, 0.0]), Z)?;
    }
    set.finish(
        drafts,
        &["P-045", "P-047"],
        "Two points share a fragment by their distances.",
    );
    let mut set = QuerySet::of(
        "edge-of-the-radius",
        still(&entry, &[([1; 3], vec![near - 99])]),
    );
    for share in [0.9, 0.99, 0.998, 1.002, 1.01, 1.1] {
        let d = 0.25 * share;
        set.query(1, beside([d, 0.0, 0.0]), Z)?;
        set.query(1, beside([-0.6 * d, 0.8 * d, 0.0]), Z)?;
    }
    set.finish(
        drafts,
        &["P-045", "P-047", "P-048"],
        "A single point just within the radius counts as much as a near one, and just beyond it not at all.",
    );
    Ok(())
}

/// Points in each of the eight cubes of a block, and of all blocks of the grid.
pub(super) fn octants(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1];
    // About the corner of cubes 0 and 1; cube i has an AO of 32 i + 20.
    let content: Vec<_> = (0..8)
        .map(|i| {
            let at = corner(i).map(|high| if high == 1 { 4 } else { 27 });
            (corner(i), vec![oriented(&entry, at, [0, 0], 32 * i + 20)])
        })
        .collect();
    let mut set = QuerySet::of("eight-cubes", still(&entry, &content));
    for i in 0..8 {
        let step = corner(i).map(|high| if high == 1 { 0.02 } else { -0.02 });
        set.query(1, step.map(|v| 0.5 + v), [1, 1, 3])?;
        set.query(1, step.map(|v| 0.5 + 2.5 * v), [-1, 0, 4])?;
    }
    set.finish(
        drafts,
        &["P-043", "P-044", "P-047"],
        "Each of the eight cubes about a corner has a point.",
    );
    for (i, one) in content.iter().enumerate() {
        // Only one of the eight has a point, so that a sampler which leaves it out finds nothing.
        let name = match i {
            0 => "own-cube-alone".to_string(),
            _ => format!(
                "neighbour-alone-{}",
                ["x", "y", "x-y", "z", "x-z", "y-z", "x-y-z"][i - 1]
            ),
        };
        let mut only = QuerySet::of(&name, still(&entry, std::slice::from_ref(one)));
        only.query(1, [0.48; 3], [1, 1, 3])?;
        only.query(1, [0.46, 0.47, 0.48], Z)?;
        only.query(1, [0.52; 3], [1, 1, 3])?;
        let comment = "A single cube of the block has a point.";
        only.finish(drafts, &["P-043", "P-044"], comment);
    }
    let mut draw = Draw(5);
    let everywhere: Vec<_> = (0..27)
        .map(|i| {
            let points = (0..2).map(|_| any_point(&mut draw, &entry)).collect();
            ([i % 3, i / 3 % 3, i / 9], points)
        })
        .collect();
    let mut set = QuerySet::of("all-cubes", still(&entry, &everywhere));
    set.draw(1, 6, 16)?;
    set.finish(
        drafts,
        &["P-043", "P-044", "P-045", "P-047"],
        "Two points in every cube of the grid, with any position and normal.",
    );
    Ok(())
}

/// Fragments beyond the grid, on each side.
pub(super) fn outside(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]).with_grid(|grid| {
        grid.dims = [2; 3];
    });
    // A point near the middle of each side, its normal along the side.
    let mut content = Vec::new();
    for (axis, normal) in [[0, 7], [7, 0], [7, 0]].into_iter().enumerate() {
        for high in [0, 1] {
            let (mut cube, mut at) = ([1; 3], [8; 3]);
            (cube[axis], at[axis]) = (high, if high == 1 { 30 } else { 1 });
            let ao = 40 * axis as u32 + 20 * high + 7;
            content.push((cube, vec![oriented(&entry, at, normal, ao)]));
        }
    }
    let mut set = QuerySet::of("outside", still(&entry, &content));
    for axis in 0..3 {
        let normal = [Y, X, X][axis];
        for (low, high) in [
            (-0.02, 1.03),
            (-0.1, 1.1),
            (-0.3, 1.3),
            (-0.6, 1.6),
            (-3.1, 4.1),
        ] {
            for beyond in [low, high] {
                let mut x = [0.64; 3];
                x[axis] = beyond;
                set.query(1, x, normal)?;
            }
        }
    }
    for x in [[-0.05; 3], [1.05; 3], [-30_000.625; 3], [30_000.625; 3]] {
        set.query(1, x, [1, 1, 1])?;
    }
    set.finish(
        drafts,
        &["P-043", "P-048"],
        "Fragments lie beyond the grid, at negative and at large coordinates.",
    );
    Ok(())
}

/// Grids so large that the hash wraps; all their numbers are exact in f32.
pub(super) fn large(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let grids: [(&str, [u16; 3], u32, f32); 4] = [
        ("large-block", [4000, 4000, 200], 997, 0.25),
        ("large-layer", [65535, 65535, 1], 11, 0.5),
        ("large-wall", [1, 65535, 65535], 64, 0.25),
        ("large-row", [65535, 1, 1], 7, 0.125),
    ];
    for (name, dims, buckets, cell_edge) in grids {
        let entry = cube_of_27([3, 4, 6]).with_grid(|grid| {
            grid.dims = dims;
            grid.buckets = buckets;
            grid.cell_edge = cell_edge;
            grid.radius = cell_edge / 2.0;
        });
        let last = dims.map(|dim| u32::from(dim) - 1);
        let middle = dims.map(|dim| u32::from(dim) / 3);
        let content: Vec<_> = [[0; 3], middle, last]
            .into_iter()
            .zip([13, 31, 57])
            .map(|(cube, ao)| (cube, vec![oriented(&entry, [2, 5, 3], [0, 0], ao)]))
            .collect();
        let mut set = QuerySet::of(name, still(&entry, &content));
        for (cube, _) in &content {
            // In 32nds of a cube from its corner.
            for step in [
                [10, 22, 14],
                [12, 20, 15],
                [6, 25, 12],
                [14, 18, 17],
                [30, 30, 30],
            ] {
                let x = [0, 1, 2].map(|axis| {
                    (f64::from(cube[axis]) + f64::from(step[axis]) / 32.0) * f64::from(cell_edge)
                });
                set.query(1, x, [1, 2, 4])?;
            }
        }
        let comment = "The hash of far cubes wraps, and positions are far from the origin.";
        set.finish(drafts, &["P-005", "P-043", "P-044"], comment);
    }
    Ok(())
}

/// Small and large cubes, and radii from half an edge down.
pub(super) fn sizes(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, cell_edge, radius) in [
        ("small-cubes", 0.03125, 0.015625),
        ("large-cubes", 64.0, 30.0),
        ("radius-of-a-tenth", 0.5, 0.05f32),
        ("radius-half-of-a-third", 1.0 / 3.0, 0.5 / 3.0),
    ] {
        let entry = cube_of_27(WIDTHS[0]).with_grid(|grid| {
            grid.cell_edge = cell_edge;
            grid.radius = radius;
        });
        let mut draw = Draw(31);
        let content: Vec<_> = (0..10)
            .map(|i| {
                let points = (0..3).map(|_| any_point(&mut draw, &entry)).collect();
                ([i % 3, i / 3 % 3, i / 9], points)
            })
            .collect();
        let mut set = QuerySet::of(name, still(&entry, &content));
        set.draw(1, 32, 8)?;
        let comment = format!("Cubes of {cell_edge} m and a radius of {radius} m.");
        set.finish(drafts, &["P-040", "P-043", "P-045"], &comment);
    }
    Ok(())
}
