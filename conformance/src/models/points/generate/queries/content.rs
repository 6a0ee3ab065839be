//! What the grid holds: widths, normals, buckets that are shared, states that change.

use super::{Draw, MIDDLE, QuerySet, Z, any_point, cube_of_27, cubes, oriented, still};
use crate::generate::Draft;
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::points::frames::WIDTHS;
use crate::models::points::oracle::all;
use crate::models::points::writer::Part;

/// Points of many widths.
pub(super) fn widths(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for widths in [
        WIDTHS[0],
        WIDTHS[1],
        WIDTHS[2],
        [1, 6, 8],
        [8, 2, 3],
        [2, 8, 1],
        [3, 8, 6],
        [6, 6, 1],
    ] {
        let entry = cube_of_27(widths).with_grid(|grid| {
            grid.dims = [3, 2, 3];
            grid.cell_edge = 0.3;
            grid.radius = 0.15;
        });
        let mut draw = Draw(u64::from(widths[0]) * 100 + u64::from(widths[1]));
        let content: Vec<_> = (0..18)
            .map(|i| {
                let count = 1 + draw.below(4);
                let points = (0..count).map(|_| any_point(&mut draw, &entry)).collect();
                ([i % 3, i / 3 % 2, i / 6], points)
            })
            .collect();
        let [p, n, a] = widths;
        let name = format!("widths-{p}-{n}-{a}");
        let mut set = QuerySet::of(&name, still(&entry, &content));
        set.draw(1, 77, 10)?;
        set.finish(
            drafts,
            &["P-007", "P-040", "P-041", "P-042", "P-047"],
            "Points with any bits, in a grid whose cell edge is no sum of powers of two.",
        );
    }
    Ok(())
}

/// Normals of one point at a time: lowest codes, folds, axes.
pub(super) fn normals(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let codes = [
        // The lowest code is -1, as is the one above it.
        [-8, 0],
        [0, -8],
        [-8, -8],
        [-7, 0],
        // Straight down, at a corner of the folded half.
        [7, -7],
        // Folded.
        [6, 4],
        [-6, 4],
        [4, -6],
        [-4, -6],
        // On the rim and above it.
        [0, 7],
        [3, -2],
        [-3, 4],
    ];
    let entry = cube_of_27(WIDTHS[0]);
    let content: Vec<_> = (0..12u32)
        .zip(codes)
        .map(|(i, code)| {
            let cube = [i % 3, i / 3 % 3, i / 9 * 2];
            let point = oriented(&entry, [15, 16, 14], code, 20 * i + 9);
            (cube, vec![point])
        })
        .collect();
    let mut set = QuerySet::of("normal-codes", still(&entry, &content));
    for point in all(&set.track(1)?.clone()) {
        let own = point.normal.map(|v| (v * 1e6).round() as i32);
        set.query(1, point.position, own)?.ring(1, &point, 4)?;
    }
    set.finish(
        drafts,
        &["P-042", "P-046", "P-045"],
        "Normal codes -8 and -7, folded ones with either sign, axes and rims.",
    );
    for widths in [
        [2, 2, 5],
        [4, 3, 5],
        [1, 5, 2],
        [1, 6, 8],
        [2, 7, 3],
        [2, 8, 1],
    ] {
        let [p, n, _] = widths;
        let entry = cube_of_27(widths);
        let (middle, top) = (1 << (p - 1), (1 << (n - 1)) - 1);
        let codes = [
            [-top - 1, 1],
            [top, -top],
            [-top, top - 1],
            [top / 2, -1 - top / 2],
        ];
        let content: Vec<_> = [[0, 0, 0], [1, 1, 1], [2, 0, 1], [0, 2, 2]]
            .into_iter()
            .zip(codes)
            .map(|(cube, code)| (cube, vec![oriented(&entry, [middle; 3], code, 0)]))
            .collect();
        let name = format!("normal-codes-of-{n}-bits");
        let mut set = QuerySet::of(&name, still(&entry, &content));
        for point in all(&set.track(1)?.clone()) {
            set.ring(1, &point, 2)?;
        }
        let comment = "Cosines with point normals are on either side of T_n, all around them.";
        set.finish(drafts, &["P-042", "P-046"], comment);
    }
    // Two sides of a thin wall.
    let content: Vec<_> = [[0, 1, 1], [1, 1, 1], [2, 1, 1]]
        .into_iter()
        .map(|cube| {
            let side = |normal, ao| oriented(&entry, [12, 16, 16], normal, ao);
            (cube, vec![side([0, 0], 30), side([7, 7], 220)])
        })
        .collect();
    let mut set = QuerySet::of("opposite-normals", still(&entry, &content));
    for x in [0.13, 0.3, 0.63, 0.71, 1.2] {
        for normal in [Z, [0, 0, -1], [2, 1, 9], [2, 1, -9]] {
            set.query(1, [x, MIDDLE + 0.02, MIDDLE], normal)?;
        }
    }
    set.finish(
        drafts,
        &["P-042", "P-045"],
        "Two points at one place face opposite ways, as on the sides of a thin wall.",
    );
    Ok(())
}

/// Buckets of several cubes, and cubes of several cells.
pub(super) fn shared_buckets(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[1]).with_grid(|grid| {
        grid.dims = [4, 2, 1];
        grid.buckets = 1;
    });
    let mut draw = Draw(21);
    let mut content: Vec<_> = (0..8)
        .map(|i| {
            let points = (0..2).map(|_| any_point(&mut draw, &entry)).collect();
            ([i % 4, i / 4, 0], points)
        })
        .collect();
    let mut set = QuerySet::of("one-bucket", still(&entry, &content));
    set.draw(1, 22, 10)?;
    set.finish(
        drafts,
        &["P-044", "P-005"],
        "All cubes have the same bucket, so that most of its cells are of other cubes.",
    );
    content.truncate(2);
    // 21 points of one cube in three cells, and 8 of another in two, entries of both interleaved.
    content[0].1 = (0..21).map(|_| any_point(&mut draw, &entry)).collect();
    content[1].1 = (0..8).map(|_| any_point(&mut draw, &entry)).collect();
    let mut part = cubes(&entry, &content);
    part.buckets[0].1 = vec![3, 0, 4, 1, 2];
    let frames = Frames::new(std::slice::from_ref(&entry));
    let mut set = QuerySet::of("several-cells-of-a-cube", frames.keyframe(&[part]).commit());
    set.draw(1, 23, 12)?;
    set.finish(
        drafts,
        &["P-044", "P-019", "P-047"],
        "Two cubes of three and two cells, interleaved in one bucket.",
    );
    // Cubes (0, 0, 0) and (1, 1, 0) have one bucket, and both are in the block.
    let collide = cube_of_27(WIDTHS[0]).with_grid(|grid| {
        grid.dims = [3, 3, 1];
        grid.buckets = 52;
    });
    let content = [
        (
            [0, 0, 0],
            vec![oriented(&collide, [28, 28, 16], [0, 0], 10)],
        ),
        ([1, 1, 0], vec![oriented(&collide, [3, 3, 16], [0, 0], 200)]),
        ([1, 0, 0], vec![oriented(&collide, [3, 28, 16], [0, 0], 90)]),
    ];
    let mut set = QuerySet::of("colliding-neighbours", still(&collide, &content));
    for x in [
        [0.47, 0.47],
        [0.53, 0.53],
        [0.48, 0.54],
        [0.54, 0.46],
        [0.3, 0.3],
        [0.7, 0.7],
    ] {
        set.query(1, [x[0], x[1], MIDDLE - 0.5], Z)?;
    }
    set.finish(
        drafts,
        &["P-044", "P-005"],
        "Two cubes of a block share a bucket: the points of each count once.",
    );
    // Eight full cells in the eight cubes of a block.
    let full = cube_of_27(WIDTHS[2]);
    let content: Vec<_> = (0..8u32)
        .map(|i| {
            let points = (0..7).map(|_| any_point(&mut draw, &full)).collect();
            ([1 + (i & 1), 1 + (i >> 1 & 1), 1 + (i >> 2)], points)
        })
        .collect();
    let mut set = QuerySet::of("full-block", still(&full, &content));
    set.draw(1, 24, 10)?;
    set.finish(
        drafts,
        &["P-044", "P-047"],
        "Eight full cells in one block.",
    );
    Ok(())
}

/// What a sampler sees of several frames and of several tracks.
pub(super) fn states(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entries = [1, 2].map(|id| Entry {
        id,
        ..cube_of_27(WIDTHS[id as usize - 1])
    });
    let point = |i: usize, ao| oriented(&entries[i], [5, 5, 5], [0, 0], ao);
    let place = |i: usize, ao| cubes(&entries[i], &[([1; 3], vec![point(i, ao)])]);
    let spots = [[0.58, 0.6, 0.585], [0.66, 0.6, 0.6], [1.1, 1.1, 1.1]];
    let frames = Frames::new(&entries).keyframe(&[place(0, 10), place(1, 30)]);
    let mut set = QuerySet::of("two-tracks", frames.clone().commit());
    for x in spots {
        set.query(1, x, Z)?.query(2, x, Z)?;
    }
    let comment = "Two tracks have the same grid and other points.";
    set.finish(drafts, &["P-044", "P-047"], comment);

    let cell = Part::of(&entries[0]).cell(0, entries[0].grid().key([1; 3]), &[point(0, 200)]);
    let mut set = QuerySet::of(
        "last-frame",
        frames.clone().commit().delta(&[cell]).commit(),
    );
    for x in spots {
        set.query(1, x, Z)?.query(2, x, [1, 0, 5])?;
    }
    let comment = "A delta changes the AO of one track's point.";
    set.finish(drafts, &["P-016", "P-047"], comment);

    let bucket = entries[0].grid().bucket(entries[0].grid().key([1; 3]));
    let forgotten = Part::of(&entries[0]).bucket(bucket, &[]);
    let frames = frames.commit().delta(&[forgotten]).commit();
    let mut set = QuerySet::of("cell-that-no-bucket-names", frames);
    for x in spots {
        set.query(1, x, Z)?.query(2, x, Z)?;
    }
    let comment = "A cell with points is named by no bucket any more.";
    set.finish(drafts, &["P-018", "P-048"], comment);

    let mut set = QuerySet::of("no-points", Frames::new(&entries).commit());
    for x in spots {
        set.query(1, x, Z)?.query(2, x, [0, 0, -1])?;
    }
    let comment = "Tracks without content are open everywhere.";
    set.finish(drafts, &["P-048"], comment);
    Ok(())
}
