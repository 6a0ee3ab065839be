//! What decides alone: the sign of 0 in the fold of a map, the weights of probes that do not see the
//! place and of absent ones, and from which mean on nothing is seen within the range.

use super::sight::{blurred, seeing};
use super::{At, Draft, Probe, QuerySet, VisibilityWeighted, Volume, all_lit, grey, half, still};

/// Directions with a 0 along x or y, below a probe: the edge of the map, which `sign(0)` keeps there.
pub(super) fn on_axes(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = seeing([2, 2, 2], 8);
    let frames = still(&volume, all_lit(&volume, 61), Some(blurred(&volume, 62)));
    let mut set = QuerySet::of("below-on-axes", frames);
    let roughness = 0.5;
    for z in [-0.9, -0.7, 0.4, 0.6] {
        for across in [0.25, 0.375, 0.5] {
            let (n, v) = ([0, 1, 2], [0, -1, 3]);
            let x = [0.0, across, z];
            set.query(1, At { x, n, v, roughness }, &[VisibilityWeighted])?;
            let (n, v) = ([1, 0, 2], [-1, 0, 3]);
            let x = [across, 0.0, z];
            set.query(1, At { x, n, v, roughness }, &[VisibilityWeighted])?;
        }
    }
    // Straight down, from a corner of the map to its middle.
    for z in [0.3, 0.4, 0.5, 0.6] {
        let (x, n, v) = ([0.0, 0.0, z], [0, 0, 1], [0, 0, 1]);
        set.query(1, At { x, n, v, roughness }, &[VisibilityWeighted])?;
    }
    let comment = "Directions below a probe that have a 0 along x, along y, or both: sign(0) is 1.";
    set.finish(drafts, &["B-074", "B-075"], comment);
    Ok(())
}

/// Lit alike from all sides.
fn coloured(rgb: [f64; 3]) -> Probe {
    Probe::raw(&rgb.map(half))
}

/// Shares about as small as UNSEEN beside it, and an absent probe beside one that does not see the
/// place.
pub(super) fn weights(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = seeing([2, 1, 1], 4);
    // The second probe does not see the place, the first less and less of it.
    let texels = (0..2 * 16).flat_map(|t| [[60, 20], [13, 1]][t / 16]);
    let probes = vec![coloured([4.0, 1.0, 0.25]), coloured([0.25, 1.0, 4.0])];
    let frames = still(&volume, probes, Some(texels.collect()));
    let mut set = QuerySet::of("shares-about-unseen", frames);
    for step in 0..12 {
        let at = At {
            x: [0.5, 0.4 + 0.02 * f64::from(step), 0.0],
            n: [0, 1, 0],
            v: [0, 1, 0],
            roughness: 0.5,
        };
        set.query(1, at, &[VisibilityWeighted])?;
    }
    let comment = "One probe's share of visibility is about UNSEEN, the other's is below it.";
    set.finish(drafts, &["B-073", "B-076"], comment);
    // The absent probe is filled with half of a light a million times brighter.
    let volume = seeing([3, 1, 1], 4);
    let near = vec![[13, 1]; volume.visibility_bytes() / 2].concat();
    let probes = vec![grey(&[1.0 / 64.0]), Probe::ABSENT, grey(&[32768.0])];
    let mut set = QuerySet::of("absent-beside-unseen", still(&volume, probes, Some(near)));
    for x in [0.25, 0.375, 0.5, 0.625, 0.75] {
        let at = At {
            x: [x, 0.3, 0.2],
            n: [0, 1, 0],
            v: [1, 2, 0],
            roughness: 0.5,
        };
        set.query(1, at, &[VisibilityWeighted])?;
    }
    let comment = "Of a dark probe that does not see the place and an absent one with the fill of a \
                   bright one, the first counts a million times as much.";
    set.finish(drafts, &["B-073", "B-060"], comment);
    Ok(())
}

/// Means between the codes 254 and 255, of places beyond the range.
pub(super) fn threshold(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume {
        range: 0.7,
        ..seeing([2, 1, 1], 4)
    };
    // Of the first probe 254 in the rows below v = 0 and 255 above; the second sees all.
    let texels = (0..2 * 16).flat_map(|t| [if t < 8 { 254 } else { 255 }, 0]);
    let probes = vec![coloured([4.0, 1.0, 0.25]), coloured([0.25, 1.0, 4.0])];
    let frames = still(&volume, probes, Some(texels.collect()));
    let mut set = QuerySet::of("nothing-in-range-from-254-and-a-half", frames);
    // With q = (0.5, y, 1.08) the mean is 254.5 + 2 v.
    for v in [-0.2, -0.15, -0.1, -0.07, 0.07, 0.1, 0.15, 0.2f64] {
        let at = At {
            x: [0.5, v / (1.0 - v.abs()) * 1.58, 0.9],
            n: [0, 0, 1],
            v: [0, 0, 1],
            roughness: 0.5,
        };
        set.query(1, at, &[VisibilityWeighted])?;
    }
    let comment =
        "Means between the codes 254 and 255: nothing is within the range from half-way on.";
    set.finish(drafts, &["B-076"], comment);
    Ok(())
}
