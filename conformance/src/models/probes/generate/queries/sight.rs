//! What probes see: maps of every side, walls, the lift off the surface, blocks that come and go.

use super::{
    At, Content, Draft, Draw, Entry, FLOOR, Frames, Probe, QuerySet, Trilinear, VisibilityWeighted,
    Volume, all_lit, grey, still,
};
use crate::models::probes::oracle;

/// Sides of maps.
const SIDES: [u8; 3] = [4, 8, 16];

/// A range of 2 m, which codes are fine steps of.
pub(super) fn seeing(dims: [u16; 3], side: u8) -> Volume {
    Volume {
        spacing: [1.0, 0.8, 1.25],
        range: 2.0,
        ..Volume::raw(dims).seeing(side)
    }
}

/// Any distances about half of the spacing, blurred; no two texels alike.
pub(super) fn blurred(volume: &Volume, seed: u64) -> Vec<u8> {
    let mut draw = Draw(seed);
    let texels = (0..volume.visibility_bytes() / 2).flat_map(|_| {
        let mean = 50 + draw.below(90) as u8;
        [mean, 12 + draw.below(30) as u8]
    });
    texels.collect()
}

/// Maps of all directions: within texels, over the edges of the map, at its corners.
pub(super) fn maps(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for side in SIDES {
        let volume = seeing([2, 2, 2], side);
        let frames = still(&volume, all_lit(&volume, 31), Some(blurred(&volume, 32)));
        let name = format!("map-of-{side}");
        let mut set = QuerySet::of(&name, frames);
        set.draw(1, 33, 40, &[VisibilityWeighted])?;
        set.draw(1, 34, 4, &[Trilinear])?;
        let comment = "Each probe sees any distances in each direction.";
        set.finish(
            drafts,
            &["B-072", "B-073", "B-074", "B-075", "B-076"],
            comment,
        );
        // Of two probes side by side the second sees all; the map of the first decides.
        let volume = seeing([2, 1, 1], side);
        let mut map = blurred(&volume, 35);
        let block = map.len() / 2;
        map[block..].fill(255);
        let probes = vec![grey(&[4.0]), grey(&[1.0])];
        let name = format!("map-edges-of-{side}");
        let mut set = QuerySet::of(&name, still(&volume, probes, Some(map)));
        let mut draw = Draw(36);
        let mut found = 0;
        // Below the equator, near the four folds of the edge and its corners.
        for try_ in 0..4000 {
            if found == 40 {
                break;
            }
            let across = draw.signed() * 0.15;
            let away = 0.7 + 0.1 * draw.signed();
            let x = match try_ % 3 {
                0 => [0.5 + 0.3 * draw.signed(), across, -away],
                1 => [0.05 + 0.05 * draw.signed(), across, -away],
                _ => [0.3, 0.5 * draw.signed(), -0.5 + 0.3 * draw.signed()],
            };
            let at = At { x, ..FLOOR };
            if set.query(1, at, &[VisibilityWeighted]).is_ok() {
                found += 1;
            }
        }
        if found < 40 {
            return Err(format!("{name}: no place for a query"));
        }
        let comment = "Directions below the equator, where the map's edges fold.";
        set.finish(drafts, &["B-074", "B-075"], comment);
    }
    Ok(())
}

/// The distance from a place along x to a wall at `wall`, in a direction; the range where it is not
/// met.
fn to_wall(from: f64, along: f64, wall: f64, range: f64) -> f64 {
    match (wall - from) / along {
        distance if distance > 0.0 => distance.min(range),
        _ => range,
    }
}

/// The maps of probes on both sides of a wall across x.
fn walled(volume: &Volume, wall: f64) -> Vec<u8> {
    let side = usize::from(volume.side);
    let (range, n) = (f64::from(volume.range), side as f64);
    let mut bytes = Vec::new();
    for probe in 0..volume.count() {
        let from = (probe % usize::from(volume.dims[0])) as f64 * f64::from(volume.spacing[0]);
        for texel in 0..side * side {
            let middle = |i: usize| (2 * i + 1) as f64 / n - 1.0;
            let (u, v) = (middle(texel % side), middle(texel / side));
            let z = 1.0 - u.abs() - v.abs();
            let x = match z < 0.0 {
                true => (1.0 - v.abs()) * if u < 0.0 { -1.0 } else { 1.0 },
                false => u,
            };
            let y = match z < 0.0 {
                true => (1.0 - u.abs()) * if v < 0.0 { -1.0 } else { 1.0 },
                false => v,
            };
            let along = x / (x * x + y * y + z * z).sqrt();
            let distance = to_wall(from, along, wall, range);
            bytes.extend([(distance / range * 255.0) as u8, 3]);
        }
    }
    bytes
}

/// A wall between bright and dark probes.
pub(super) fn walls(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for side in SIDES {
        let volume = Volume {
            spacing: [1.0; 3],
            range: 4.0,
            ..Volume::raw([2, 2, 2]).seeing(side)
        };
        let probes: Vec<Probe> = (0..8)
            .map(|i| match i % 2 {
                0 => grey(&[1000.0, 200.0, 0.0, 300.0]),
                _ => grey(&[2.0, 0.5, -0.25, 0.5]),
            })
            .collect();
        let name = format!("behind-a-wall-{side}");
        let frames = still(&volume, probes.clone(), Some(walled(&volume, 0.5)));
        let mut set = QuerySet::of(&name, frames);
        set.draw(1, 41, 30, &[VisibilityWeighted])?;
        let comment = "A thin wall stands half-way between bright probes and dark ones.";
        set.finish(drafts, &["B-073", "B-074", "B-076"], comment);
        // Nobody sees the place: walls on both sides of it.
        let name = format!("seen-by-none-{side}");
        let near = vec![[13, 1]; volume.visibility_bytes() / 2].concat();
        let mut set = QuerySet::of(&name, still(&volume, probes, Some(near)));
        let places = [[0.5, 0.4, 0.45], [0.4, 0.6, 0.5], [0.62, 0.35, 0.55]];
        set.facing(&places, &[VisibilityWeighted])?;
        let comment = "No probe sees the place: their mean without visibility.";
        set.finish(drafts, &["B-073", "B-076"], comment);
    }
    Ok(())
}

/// The lift along the normal and towards the viewer, by the smallest spacing.
pub(super) fn lifted(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, spacing) in [
        ("lifted-x", [0.5, 1.0, 1.5]),
        ("lifted-y", [1.5, 0.5, 1.0]),
        ("lifted-z", [1.0, 1.5, 0.5]),
    ] {
        let volume = Volume {
            spacing,
            ..seeing([2, 2, 2], 8)
        };
        let probes = all_lit(&volume, 45);
        let mut set = QuerySet::of(name, still(&volume, probes, Some(blurred(&volume, 46))));
        let x = spacing.map(|s| f64::from(s) / 2.0);
        // Normal and view across each other, then along.
        for (n, v) in [
            ([0, 1, 0], [1, 0, 0]),
            ([1, 0, 0], [0, 0, 1]),
            ([0, 0, 1], [0, -1, 0]),
            ([1, 1, 1], [-1, 1, 0]),
            ([2, -1, 1], [2, -1, 1]),
        ] {
            let at = At {
                x,
                n,
                v,
                roughness: 0.3,
            };
            set.query(1, at, &[VisibilityWeighted])?;
        }
        set.draw(1, 47, 12, &[VisibilityWeighted])?;
        let comment = "The place at which probes are looked up is lifted by the smallest spacing.";
        set.finish(drafts, &["B-074", "B-076"], comment);
    }
    Ok(())
}

/// Codes of 255 in all texels: nothing within the range, however far the place; and codes of 0 in all
/// deviations.
pub(super) fn nothing_seen(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume {
        range: 0.7,
        ..seeing([2, 2, 2], 4)
    };
    // The probes of the first column see nothing within the range, the others a wall.
    let texels = (0..8 * 16).flat_map(|t| match t / 16 % 2 {
        0 => [255, 0],
        _ => [100, 30],
    });
    let frames = still(&volume, all_lit(&volume, 48), Some(texels.collect()));
    let mut set = QuerySet::of("nothing-in-range", frames);
    let places = [[0.5, 0.4, 0.6], [0.7, 0.3, 0.5], [0.3, 0.5, 0.8]];
    set.facing(&places, &[VisibilityWeighted])?;
    let comment = "A mean of 255 hides nothing, though the place is beyond the range.";
    set.finish(drafts, &["B-076"], comment);
    // Maps of one distance without deviation, and places a few codes of it farther.
    let volume = seeing([2, 1, 1], 4);
    let texels = (0..2 * 16).flat_map(|t| [[128, 0], [255, 0]][t / 16]);
    let probes = vec![grey(&[4.0]), grey(&[1.0])];
    let mut set = QuerySet::of(
        "least-deviation",
        still(&volume, probes, Some(texels.collect())),
    );
    let code = f64::from(volume.range) / 255.0;
    let lift = 0.8 * (oracle::NORMAL_BIAS + oracle::VIEW_BIAS);
    for codes in [-1.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0] {
        let distance = (128.0 + codes) * code;
        let y = (distance * distance - 0.25f64).sqrt() - lift;
        let at = At {
            x: [0.5, y, 0.0],
            n: [0, 1, 0],
            v: [0, 1, 0],
            roughness: 0.5,
        };
        set.query(1, at, &[VisibilityWeighted])?;
    }
    let comment = "Without any deviation the distance is still known to a code alone.";
    set.finish(drafts, &["B-076"], comment);
    Ok(())
}

/// Volumes whose block has not come, comes, and goes.
pub(super) fn blocks(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = seeing([2, 2, 2], 8);
    let probes = all_lit(&volume, 51);
    let content = |visibility| Content {
        visibility,
        ..Content::new(1, probes.clone())
    };
    let entry = [Entry::of_volume(1, volume.clone())];
    let frames = Frames::new(&entry).probes(true, &[content(None)]).commit();
    let clauses = &["B-073", "B-061"];
    let mut set = QuerySet::of("block-not-come", frames.clone());
    set.draw(1, 52, 8, &[VisibilityWeighted])?;
    let comment = "A volume with visibility whose block has not come.";
    set.finish(drafts, clauses, comment);
    let frames = frames.probes(false, &[content(Some(blurred(&volume, 53)))]);
    let frames = frames.commit();
    let mut set = QuerySet::of("block-comes", frames.clone());
    set.draw(1, 52, 8, &[VisibilityWeighted])?;
    set.finish(drafts, clauses, "A delta brings the block.");
    let mut changed = content(None);
    changed.probes[3] = Probe::ABSENT;
    let kept = frames.clone().probes(false, &[changed]).commit();
    let mut set = QuerySet::of("block-stays", kept);
    set.draw(1, 54, 8, &[VisibilityWeighted])?;
    let comment = "A delta without a block leaves it; a probe that goes absent has a map still.";
    set.finish(drafts, clauses, comment);
    let mut set = QuerySet::of("block-goes", frames.probes(true, &[content(None)]).commit());
    set.draw(1, 52, 8, &[VisibilityWeighted])?;
    set.finish(drafts, clauses, "A keyframe without a block takes it away.");
    Ok(())
}
