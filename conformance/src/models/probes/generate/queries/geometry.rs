//! Where the query lies, and where the grid: cells, faces, beyond them, spacings, axes.

use super::{At, Draft, FLOOR, QuerySet, Trilinear, VisibilityWeighted, Volume, all_lit, still};

/// Within cells, at probes, on faces and edges.
pub(super) fn places(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume::raw([3, 3, 2]);
    let frames = || still(&volume, all_lit(&volume, 1), None);
    let mut set = QuerySet::of("within-cells", frames());
    set.facing(
        &[[0.1, 0.2, 0.3], [0.61, 1.1, 0.9], [0.45, 0.8, 0.05]],
        &[Trilinear, VisibilityWeighted],
    )?;
    set.draw(1, 2, 12, &[Trilinear, VisibilityWeighted])?;
    let comment = "Surfaces within the cells of a grid, facing many ways.";
    set.finish(
        drafts,
        &["B-070", "B-071", "B-072", "B-077", "B-078", "B-079"],
        comment,
    );
    // Spacing 0.5, 0.75, 1.
    let mut set = QuerySet::of("at-probes", frames());
    set.facing(
        &[[0.0; 3], [0.5, 0.75, 0.0], [1.0, 1.5, 1.0], [0.5, 0.0, 1.0]],
        &[Trilinear, VisibilityWeighted],
    )?;
    let comment = "A surface at a probe gets that probe's light, whatever it faces.";
    set.finish(drafts, &["B-070", "B-071", "B-072"], comment);
    let mut set = QuerySet::of("on-faces", frames());
    let places = [
        [0.5, 0.4, 0.3],
        [0.2, 0.75, 0.6],
        [0.7, 1.2, 1.0],
        [0.5, 0.75, 0.25],
        [1.0, 0.3, 0.5],
        [0.25, 0.0, 0.5],
    ];
    set.facing(&places, &[Trilinear, VisibilityWeighted])?;
    let comment = "Surfaces in the planes of probes, and on lines between them.";
    set.finish(drafts, &["B-070", "B-071", "B-072"], comment);
    Ok(())
}

/// Beyond the box, on each side and far away.
pub(super) fn outside(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume::raw([3, 3, 2]);
    let mut set = QuerySet::of("outside", still(&volume, all_lit(&volume, 3), None));
    let mut places = Vec::new();
    for axis in 0..3 {
        let far = [1.0, 1.5, 1.0][axis];
        for beyond in [-0.05, far + 0.05, -0.6, far + 0.8, -9.0, far + 70.0] {
            let mut x = [0.3, 0.5, 0.4];
            x[axis] = beyond;
            places.push(x);
        }
    }
    places.extend([
        [-0.1; 3],
        [2.1; 3],
        [-30_000.625; 3],
        [30_000.625, -2.0, 0.7],
    ]);
    for (i, &x) in places.iter().enumerate() {
        let n = super::NORMALS[i % 5];
        let v = [n[0] - 1, n[1] + 1, n[2] + 1];
        set.query(1, At { x, n, v, ..FLOOR }, &[Trilinear, VisibilityWeighted])?;
    }
    let comment = "Surfaces beyond the box of the grid: cells and weights are those of its nearest \
                   point, directions to probes those of the surface.";
    set.finish(drafts, &["B-070", "B-071", "B-072"], comment);
    Ok(())
}

/// Axes of one probe.
pub(super) fn layers(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, dims) in [
        ("one-layer", [3, 1, 2]),
        ("one-row", [1, 1, 4]),
        ("one-probe", [1, 1, 1]),
    ] {
        let volume = Volume::raw(dims);
        let mut set = QuerySet::of(name, still(&volume, all_lit(&volume, 4), None));
        set.facing(
            &[[0.2, 0.1, 0.3], [-0.4, 0.9, 0.6]],
            &[Trilinear, VisibilityWeighted],
        )?;
        set.draw(1, 5, 6, &[Trilinear, VisibilityWeighted])?;
        let comment = "Along an axis of one probe that probe counts alone.";
        set.finish(drafts, &["B-070", "B-072"], comment);
    }
    Ok(())
}

/// Spacings that differ, and that no sum of powers of two is.
pub(super) fn spacings(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, spacing) in [
        ("spacing-of-thirds", [1.0 / 3.0, 0.7, 2.3]),
        ("spacing-narrow-y", [4.0, 0.3, 1.1]),
        ("spacing-narrow-z", [1.9, 2.5, 0.4]),
        ("spacing-large", [48.0, 31.0, 55.0]),
    ] {
        let volume = Volume {
            spacing,
            ..Volume::raw([3, 2, 4])
        };
        let mut set = QuerySet::of(name, still(&volume, all_lit(&volume, 6), None));
        set.draw(1, 7, 14, &[VisibilityWeighted, Trilinear])?;
        let comment = format!("Probes {spacing:?} m apart along the axes.");
        set.finish(drafts, &["B-070", "B-071", "B-072"], &comment);
    }
    Ok(())
}

/// A grid that is turned in the mesh: queries are in grid space, and so is the basis.
pub(super) fn turned(drafts: &mut Vec<Draft>) -> Result<(), String> {
    // 3-4-5 about z, then 5-12-13 about x.
    let (c, s) = (5.0 / 13.0, 12.0 / 13.0);
    let rows = [
        [0.6, -0.8, 0.0, 2.0],
        [0.8 * c, 0.6 * c, -s, -1.0],
        [0.8 * s, 0.6 * s, c, 0.5],
    ];
    let volume = Volume {
        grid_from_mesh: std::array::from_fn(|i| rows[i / 4][i % 4]),
        ..Volume::raw([2, 3, 2])
    };
    let mut set = QuerySet::of("turned", still(&volume, all_lit(&volume, 8), None));
    set.facing(&[[0.2, 0.9, 0.4]], &[Trilinear, VisibilityWeighted])?;
    set.draw(1, 9, 8, &[Trilinear, VisibilityWeighted])?;
    let moved = still(&volume, all_lit(&volume, 8), None);
    let moved = moved.transforms(&[(1, volume.grid_from_mesh)]).commit();
    let comment = "The grid is turned in its mesh: a sampler that turns position, normal or \
                   coefficients once more finds other light.";
    set.finish(drafts, &["B-071", "B-077", "B-078"], comment);
    let mut set = QuerySet::of("moved", moved);
    set.draw(1, 10, 8, &[Trilinear, VisibilityWeighted])?;
    let comment = "The track has a transform, which grid space knows nothing of.";
    set.finish(drafts, &["B-071", "B-077", "B-078"], comment);
    Ok(())
}
