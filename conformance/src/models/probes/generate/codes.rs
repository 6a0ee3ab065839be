//! Codes at the ends of their ranges, clause B-042.

use super::{Content, Draft, Place, Volume, invalid, streams, valid};
use crate::models::probes::writer::{GROUPS, Probe};

/// Steps of three sorts, and the largest code of luma and of group g >= 1 with each.
fn volumes() -> [(&'static str, Volume); 3] {
    [
        ("step-1", [1; 6]),
        ("odd-steps", [7, 3, 5, 7, 9, 11]),
        ("steps-most", [2560, 32768, 32768, 32768, 32768, 32768]),
    ]
    .map(|(name, steps)| {
        let volume = Volume {
            steps,
            ..Volume::packed([2, 2, 1])
        };
        (name, volume)
    })
}

/// The largest and the least code of a group.
fn ends(volume: &Volume, group: usize) -> (i32, i32) {
    let step = i32::from(volume.steps[group]);
    match group {
        0 => (10239 / step, 0),
        _ => ((32768 / step).min(32767), -(32768 / step)),
    }
}

/// A probe whose codes are 0 but the last of a group.
fn with(group: usize, code: i32) -> Probe {
    let mut probe = Probe::new(3, &[]);
    probe.codes[GROUPS[group + 1] - 1] = code;
    probe
}

pub fn add(drafts: &mut Vec<Draft>) {
    for (name, volume) in volumes() {
        for group in 0..6 {
            let (most, least) = ends(&volume, group);
            for (end, code, words) in [
                ("above", most + 1, "One code above the largest"),
                ("below", least - 1, "One code below the least"),
            ] {
                for place in Place::ALL {
                    // In every place for one sort of steps, in one for the others.
                    if place != Place::Keyframe && name != "odd-steps" {
                        continue;
                    }
                    let mut probes = vec![Probe::ABSENT; 4];
                    probes[2] = with(group, code);
                    let refused = place.with_probes(&volume, probes);
                    let fault = format!("code-{end}-group-{group}-{name}-{}", place.name());
                    let comment = format!("{words} of group {group}, in {}.", place.words());
                    drafts.push(invalid((3104, &fault), &["B-042"], &comment, refused));
                }
            }
        }
        let all = |which: fn((i32, i32)) -> i32| {
            let mut probe = Probe::new(3, &[]);
            for group in 0..6 {
                probe.codes[GROUPS[group]..GROUPS[group + 1]].fill(which(ends(&volume, group)));
            }
            probe
        };
        let (most, least) = (all(|ends| ends.0), all(|ends| ends.1));
        let bright = |mut probe: Probe| {
            probe.codes[0] = most.codes[0];
            probe
        };
        let probes = vec![most, bright(least), least, most];
        let frames = streams(std::slice::from_ref(&volume))
            .probes(true, &[Content::new(1, probes.clone())])
            .commit()
            .probes(
                false,
                &[Content::new(1, probes.into_iter().rev().collect())],
            )
            .commit();
        let comment = "The largest and the least code of each group.";
        let clauses = ["B-042", "B-050", "B-051", "B-053"];
        drafts.push(valid(
            &format!("codes-extreme-{name}"),
            &clauses,
            comment,
            frames,
        ));
    }
    far(drafts);
}

/// Magnitudes that go far beyond a range, to one end and to the other.
fn far(drafts: &mut Vec<Draft>) {
    let (_, volume) = &volumes()[0];
    for (name, group, codes) in [
        ("luma-65535", 0, [0, 65535]),
        ("luma-minus-65535", 0, [0, -65535]),
        ("luma-32768", 0, [0, 32768]),
        ("code-65535", 5, [0, 65535]),
        ("code-minus-65535", 5, [0, -65535]),
        ("code-from-end-to-end-and-one", 3, [32766, -32769]),
        ("code-from-the-least", 3, [-32768, -32769]),
        ("code-to-32768", 4, [-32767, 32768]),
    ] {
        let probes = codes.map(|code| with(group, code));
        let probes = vec![probes[0], probes[1], probes[0], probes[0]];
        let refused = Place::Keyframe.with_probes(volume, probes);
        let comment = format!(
            "A code of group {group} goes from {} to {}.",
            codes[0], codes[1]
        );
        drafts.push(invalid(
            (3104, &format!("far-{name}")),
            &["B-042"],
            &comment,
            refused,
        ));
    }
    // A sum that comes back into range later is no way out: the range is checked at each residual.
    let mut probes = vec![Probe::ABSENT; 4];
    probes[0] = Probe::new(3, &[-1, 5, 5, 7]);
    let refused = Place::Keyframe.with_probes(volume, probes);
    let comment = "Luma of degree 0 is -1.";
    drafts.push(invalid(
        (3104, "luma-minus-1"),
        &["B-042"],
        comment,
        refused,
    ));
    // From one end to the other within the range: 65535 is the largest residual that is taken.
    let probes = [
        with(3, 32767),
        with(3, -32768),
        with(3, 32767),
        Probe::ABSENT,
    ];
    let frames = streams(std::slice::from_ref(volume))
        .probes(true, &[Content::new(1, probes.to_vec())])
        .commit();
    let comment = "Codes go from one end of their range to the other, a residual of 65535.";
    drafts.push(valid(
        "codes-from-end-to-end",
        &["B-040", "B-042"],
        comment,
        frames,
    ));
}
