//! What the probes hold: absent ones, degrees, exponents, light that rings, lobes; several tracks
//! and frames.

use super::{
    At, Content, Draft, Draw, Entry, FLOOR, Frames, Probe, QuerySet, Trilinear, VisibilityWeighted,
    Volume, all_lit, grey, lit, still,
};

/// Absent probes among others, and alone.
pub(super) fn absent(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, volume) in [
        ("absent-some", Volume::raw([4, 3, 3])),
        ("absent-some-packed", Volume::packed([4, 3, 3])),
    ] {
        let mut probes = all_lit(&volume, 11);
        for (i, probe) in probes.iter_mut().enumerate() {
            if i * 7 % 5 < 2 {
                *probe = Probe::ABSENT;
            }
        }
        let mut set = QuerySet::of(name, still(&volume, probes, None));
        set.draw(
            1,
            12,
            20,
            &[VisibilityWeighted, VisibilityWeighted, Trilinear],
        )?;
        let comment = "Absent probes count with what they are filled with, in the visibility-weighted \
                       interpolation as good as not.";
        set.finish(drafts, &["B-071", "B-073", "B-060"], comment);
    }
    // One probe of 5 x 2 x 2 is present, far from the first cells.
    let volume = Volume::raw([5, 2, 2]);
    let mut probes = vec![Probe::ABSENT; volume.count()];
    let some = all_lit(&volume, 13);
    probes[4] = some[4];
    probes[13] = some[13];
    let mut set = QuerySet::of("absent-eight", still(&volume, probes, None));
    let places = [[0.1, 0.2, 0.3], [0.4, 0.6, 0.9], [-0.3, 0.1, 0.5]];
    set.facing(&places, &[Trilinear, VisibilityWeighted])?;
    let comment = "All eight corners are absent: the result is the mean of their fill.";
    set.finish(drafts, &["B-073", "B-060"], comment);
    let dark = vec![Probe::ABSENT; volume.count()];
    let mut set = QuerySet::of("absent-all", still(&volume, dark, None));
    set.query(
        1,
        At {
            x: [0.7, 0.2, 0.3],
            ..FLOOR
        },
        &[Trilinear, VisibilityWeighted],
    )?;
    let comment = "A volume without a present probe is dark.";
    set.finish(drafts, &["B-073", "B-060"], comment);
    Ok(())
}

/// Probes of degree 0, of degrees to 1, to 2, and of all.
pub(super) fn levels(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume::packed([3, 2, 2]);
    for (name, levels) in [
        ("degree-0", [1, 1, 1]),
        ("degree-1", [2, 2, 2]),
        ("degree-2", [3, 3, 3]),
        ("degrees-mixed", [3, 1, 2]),
    ] {
        let mut draw = Draw(14);
        let probes = (0..volume.count()).map(|i| lit(&volume, &mut draw, levels[i % 3]));
        let mut set = QuerySet::of(name, still(&volume, probes.collect(), None));
        set.facing(&[[0.3, 0.2, 0.6]], &[Trilinear, VisibilityWeighted])?;
        set.draw(1, 15, 6, &[Trilinear, VisibilityWeighted])?;
        let comment = "Packed probes of several levels.";
        set.finish(drafts, &["B-071", "B-072", "B-077", "B-078"], comment);
    }
    // One function alone lights all: its sign and place show.
    let volume = Volume::raw([2, 1, 1]);
    for lm in 0..9 {
        let mut coefficients = [0.0; 9];
        coefficients[0] = 1.0;
        coefficients[lm] = 1.0;
        let probe = grey(&coefficients);
        let name = format!("function-{lm}");
        let mut set = QuerySet::of(&name, still(&volume, vec![probe; 2], None));
        for (i, n) in [[1, 2, 3], [-3, 1, 2], [2, -3, -1], [-1, -2, 2]]
            .into_iter()
            .enumerate()
        {
            let at = At {
                x: [0.2, 0.0, 0.0],
                n,
                v: [n[0] + 2, n[1], n[2] - 1],
                roughness: [0.0, 0.25, 0.5, 0.75][i],
            };
            set.query(1, at, &[Trilinear])?;
        }
        let comment = "Two probes alike, of degree 0 and one function.";
        set.finish(drafts, &["B-077", "B-078", "B-079"], comment);
    }
    Ok(())
}

/// Exponents other than 0.
pub(super) fn exponents(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, exponent) in [
        ("exponent-3", 3),
        ("exponent-17", 17),
        ("exponent-below", -4),
    ] {
        let volume = Volume {
            exponent,
            ..Volume::packed([2, 2, 2])
        };
        let mut set = QuerySet::of(name, still(&volume, all_lit(&volume, 16), None));
        set.draw(1, 17, 6, &[Trilinear, VisibilityWeighted])?;
        let comment = format!("Coefficients are values times 2^{exponent}.");
        set.finish(drafts, &["B-071", "B-072"], &comment);
    }
    Ok(())
}

/// Expansions that fall below zero.
pub(super) fn ringing(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume::raw([2, 2, 1]);
    let mut probe = grey(&[1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.5]);
    // Blue does not ring.
    probe.codes[8] = 0;
    probe.codes[20] = 0;
    let mut set = QuerySet::of("ringing", still(&volume, vec![probe; 4], None));
    for (n, v) in [
        ([0, 0, -1], [1, 0, -2]),
        ([0, 0, 1], [1, 0, 2]),
        ([1, 0, 0], [3, 1, 1]),
        ([2, 0, -1], [1, 2, 0]),
        ([1, 2, -3], [-1, 1, -3]),
    ] {
        for roughness in [0.0, 0.5, 1.0] {
            let x = [0.2, 0.3, 0.1];
            let at = At { x, n, v, roughness };
            set.query(1, at, &[Trilinear, VisibilityWeighted])?;
        }
    }
    let comment = "Where an expansion rings below zero, each channel by itself is 0.";
    set.finish(drafts, &["B-077", "B-078"], comment);
    Ok(())
}

/// Lobes of all widths, about directions from the mirror's to the normal.
pub(super) fn roughness(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volume = Volume::raw([2, 2, 2]);
    let mut set = QuerySet::of("roughness", still(&volume, all_lit(&volume, 18), None));
    for step in 0..=21 {
        let roughness = f64::from(step) / 21.0;
        for (n, v) in [([1, 9, 2], [-5, 6, 2]), ([0, -1, 0], [9, -3, 2])] {
            let x = [0.2, 0.3, 0.4];
            let at = At { x, n, v, roughness };
            set.query(1, at, &[Trilinear])?;
        }
    }
    for roughness in [0.004, 0.012, 0.33, 0.5, 0.777, 0.99, 0.999] {
        for v in [[1, 0, 0], [3, 1, 0], [1, 1, 1], [0, 1, 0]] {
            let x = [0.4, 0.1, 0.7];
            let n = [0, 1, 0];
            let at = At { x, n, v, roughness };
            set.query(1, at, &[VisibilityWeighted])?;
        }
    }
    let comment = "Lobes of roughness 0 to 1, seen from above and at grazing angles.";
    set.finish(drafts, &["B-078", "B-079"], comment);
    Ok(())
}

/// What a sampler sees of several frames and of several tracks.
pub(super) fn states(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let volumes = [Volume::packed([2, 2, 2]), Volume::raw([3, 2, 1])];
    let entries = [1u32, 2].map(|id| Entry::of_volume(id, volumes[id as usize - 1].clone()));
    let content = |id: u32, seed| Content::new(id, all_lit(&volumes[id as usize - 1], seed));
    let frames = Frames::new(&entries).probes(true, &[content(1, 21), content(2, 22)]);
    let frames = frames.commit();
    let mut set = QuerySet::of("two-tracks", frames.clone());
    set.draw(1, 23, 6, &[Trilinear, VisibilityWeighted])?;
    set.draw(2, 24, 6, &[Trilinear, VisibilityWeighted])?;
    let comment = "Two volumes, one packed and one raw.";
    set.finish(drafts, &["B-071", "B-072"], comment);
    let mut later = content(2, 22);
    later.probes[1] = Probe::ABSENT;
    later.probes[4] = all_lit(&volumes[1], 25)[4];
    let mut set = QuerySet::of("last-frame", frames.probes(false, &[later]).commit());
    set.draw(1, 26, 4, &[VisibilityWeighted])?;
    set.draw(2, 27, 10, &[Trilinear, VisibilityWeighted])?;
    let comment = "A delta changes a probe and takes one away.";
    set.finish(drafts, &["B-011", "B-071", "B-073"], comment);
    let mut set = QuerySet::of("no-probes", Frames::new(&entries).commit());
    let x = [0.2, 0.4, 0.3];
    set.query(1, At { x, ..FLOOR }, &[Trilinear, VisibilityWeighted])?;
    set.query(2, At { x, ..FLOOR }, &[Trilinear, VisibilityWeighted])?;
    set.finish(drafts, &["B-073"], "Volumes without content are dark.");
    Ok(())
}
