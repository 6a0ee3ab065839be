//! The oracle of the queries of `probes` against the text of its chapter, and what it must refuse.

use std::f64::consts::PI;

use dapple_conformance::clauses;
use dapple_conformance::generate::expected::TrackContent;
use dapple_conformance::generate::frames::Frames;
use dapple_conformance::models::Expected;
use dapple_conformance::models::entry::Entry;
use dapple_conformance::models::probes::expected::Content;
use dapple_conformance::models::probes::oracle::{
    self, CONSTANTS, Field, Surface, look_up, with_intervals,
};
use dapple_conformance::models::probes::queries::Interpolation;
use dapple_conformance::models::probes::queries::ProbesQuery;
use dapple_conformance::models::probes::writer::{Probe, Volume};

/// A track of one frame with raw probes and the same texel everywhere.
fn track(volume: &Volume, probes: Vec<Probe>, texel: Option<[u8; 2]>) -> TrackContent {
    let texels = texel.map(|texel| vec![texel; volume.visibility_bytes() / 2].concat());
    let content = Content {
        visibility: texels,
        ..Content::new(1, probes)
    };
    Frames::new(&[Entry::of_volume(1, volume.clone())])
        .probes(true, &[content])
        .commit()
        .tracks
        .remove(0)
}

/// Degree 0 alone, in grey, from an f16.
fn grey(bits: u16) -> Probe {
    Probe::raw(&[bits; 3])
}

fn query(x: [f64; 3], interpolation: Interpolation) -> ProbesQuery {
    ProbesQuery {
        track: 1,
        position: x.map(|v| (v * 65536.0) as i32),
        normal: [0, 1, 0],
        view: [1, 2, 0],
        roughness: 32768,
        interpolation,
        irradiance: [[0; 2]; 3],
        radiance: [[0; 2]; 3],
    }
}

#[test]
fn questions_that_rounding_decides_are_refused() {
    use Interpolation::{Trilinear, VisibilityWeighted};
    let volume = Volume::raw([2, 1, 1]);
    let (one, four) = (grey(0x3c00), grey(0x4400));
    let at_absent = track(&volume, vec![Probe::ABSENT, four], None);
    let there = query([0.0; 3], VisibilityWeighted);
    assert!(
        with_intervals(&at_absent, there.clone()).is_ok(),
        "its fill is alike"
    );
    let wide = Volume::raw([3, 1, 1]);
    let between = track(&wide, vec![one, Probe::ABSENT, four], None);
    let middle = query([0.5, 0.0, 0.0], VisibilityWeighted);
    assert!(
        with_intervals(&between, middle).is_err(),
        "at an absent probe"
    );
    assert!(with_intervals(&between, query([0.5, 0.0, 0.0], Trilinear)).is_ok());
    assert!(with_intervals(&between, query([0.45, 0.0, 0.0], VisibilityWeighted)).is_ok());
    let seeing = Volume {
        range: 0.1,
        ..volume.clone().seeing(4)
    };
    let within = query([0.25, 0.0, 0.0], VisibilityWeighted);
    let probes = vec![one, four];
    let nearly =
        |texel| with_intervals(&track(&seeing, probes.clone(), Some(texel)), within.clone());
    assert!(nearly([255, 0]).is_ok() && nearly([100, 0]).is_ok());
    // Between 254 and 255 a mean may lie on either side of 254.5.
    let mut mixed = track(&seeing, probes.clone(), Some([255, 0]));
    let Expected::Probes(state) = &mut mixed.state else {
        panic!("a track of probes");
    };
    let bytes = state.visibility.as_mut().expect("a block");
    bytes.iter_mut().step_by(4).for_each(|byte| *byte = 254);
    let refused = (0..200).any(|i| {
        let x = [0.25, 0.01 * f64::from(i) - 1.0, 0.3];
        with_intervals(&mixed, query(x, VisibilityWeighted))
            .is_err_and(|e| e.contains("mean distance"))
    });
    assert!(refused, "a mean between two codes");
    let lost = ProbesQuery {
        view: [0, -1, 0],
        roughness: (0.7706 * 65536.0) as u32,
        ..within.clone()
    };
    let open = track(&volume, probes, None);
    assert!(with_intervals(&open, lost).is_err_and(|e| e.contains("lobe")));
    let far = ProbesQuery {
        position: [(1 << 25) + 1, 7, 7],
        ..within.clone()
    };
    assert!(with_intervals(&open, far).is_err(), "no f32");
    for wrong in [
        ProbesQuery {
            normal: [0; 3],
            ..within.clone()
        },
        ProbesQuery {
            view: [0; 3],
            ..within.clone()
        },
        ProbesQuery {
            roughness: 65537,
            ..within
        },
    ] {
        assert!(with_intervals(&open, wrong).is_err());
    }
}

/// Light that is linear along x comes back so, and its irradiance is pi times it.
#[test]
fn the_oracle_reproduces_what_is_linear() {
    let volume = Volume::raw([3, 2, 2]);
    // 1, 2 and 3 at x of 0, 0.5 and 1.
    let probes = (0..12).map(|i| grey([0x3c00, 0x4000, 0x4200][i % 3]));
    let field = Field::of(&track(&volume, probes.collect(), None)).expect("a volume");
    for i in 0..20 {
        let x = [f64::from(i) / 19.0, 0.3, 0.4];
        let found = look_up(&field, &Surface::of(&query(x, Interpolation::Trilinear)));
        let found = found.expect("nothing is near");
        let position = (x[0] * 65536.0).trunc() / 65536.0;
        let radiance = (1.0 + 2.0 * position) * (1.0 / (4.0 * PI)).sqrt();
        assert!((found.values[0][0] - PI * radiance).abs() < 1e-9);
        assert!((found.values[1][2] - radiance).abs() < 1e-9);
        let [low, high] = found.ends[0][1];
        assert!(low < found.values[0][1] && found.values[0][1] < high);
    }
}

fn read(name: &str) -> String {
    std::fs::read_to_string(clauses::folder().join(name)).expect("a chapter")
}

fn chapter() -> String {
    read("probes.md")
}

/// The share that is worked out over a map of its own is the oracle's.
#[test]
fn the_worked_share_is_the_oracles() {
    let text = read("examples-probes.md");
    let texels: Vec<[u8; 2]> = (0..16)
        .map(|t| (t % 4, t / 4))
        .map(|(i, j)| [40 + 4 * i + 10 * j, 10 + i + j])
        .collect();
    let q: [f64; 3] = [0.3, -0.1, -0.6];
    let d = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    let code = 2.0 / 255.0;
    let (mean, square) = oracle::moments(4, 2.0, &texels, q);
    let share = oracle::share(mean, square, d, code);
    // The other way of the crush, as the share is crushed.
    let cubed = (share * 0.2 * 0.2).cbrt();
    for (name, value) in [
        ("M", mean),
        ("M2", square),
        ("d", d),
        ("b", cubed.cbrt()),
        ("b^3", cubed),
        ("share", share),
    ] {
        let line = format!("{name:<13}{value:.6}");
        assert!(text.lines().any(|l| l == line), "{line}");
    }
}

/// The table of constants is the oracle's.
#[test]
fn the_constants_are_those_of_the_text() {
    let text = chapter();
    for (name, value) in CONSTANTS {
        let row = format!("| {name} | ");
        let rows: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix(&row)).collect();
        assert_eq!(rows.len(), 1, "{name}");
        let stated = rows[0].split(' ').next().and_then(|v| v.parse().ok());
        assert_eq!(stated, Some(value), "{name}");
    }
}
