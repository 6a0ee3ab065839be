//! The rungs by which an instance can be described, from few bytes to many, and which of them it takes.
//!
//! | rung | tracks (`spec/obscurance.md` §5) |
//! | --- | --- |
//! | scalar, linear | an entry of `instances` |
//! | local | a `vertices` track that the instances of a mesh share |
//! | local with scalar, local with linear | the same, and an entry of `instances` |
//! | vertices | a `vertices` track of its own |
//! | points | a `points` track of its own ([`super::escalate`]) |
//!
//! Errors are those of samples that were held out of the fit ([`is_held_out`]), so that a rung is not praised for what
//! it was told. They include the noise of a sample's rays.

use super::Tone;
use crate::instances::server::fit::{self, Linear};
use glam::DVec3;

/// Of so many successive samples of an instance one is held out.
const HOLD_OUT: usize = 4;

/// Bytes that a choice between rungs reckons with, compressed: an entry's key and form, a coefficient, a track's
/// declaration and header, and a value of a vertex.
const ENTRY_BYTES: f64 = 9.0;
const COEFFICIENT_BYTES: f64 = 1.2;
const TRACK_BYTES: f64 = 90.0;
const VALUE_BYTES: f64 = 0.5;

/// Whether the sample of an instance with this number tells errors and enters no fit.
pub fn is_held_out(sample: usize) -> bool {
    sample % HOLD_OUT == HOLD_OUT - 1
}

/// A way to describe an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rung {
    Scalar,
    Linear,
    Local,
    LocalScalar,
    LocalLinear,
    Vertices,
    /// Never chosen by its bytes, which are not known before points are placed.
    Points,
}

impl Rung {
    /// All of them.
    pub const ALL: [Rung; 7] = [
        Rung::Scalar,
        Rung::Linear,
        Rung::Local,
        Rung::LocalScalar,
        Rung::LocalLinear,
        Rung::Vertices,
        Rung::Points,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Rung::Scalar => "scalar",
            Rung::Linear => "linear",
            Rung::Local => "local",
            Rung::LocalScalar => "local, scalar",
            Rung::LocalLinear => "local, linear",
            Rung::Vertices => "vertices",
            Rung::Points => "points",
        }
    }

    /// Whether it takes the values that all instances of its mesh share.
    pub fn has_local(self) -> bool {
        matches!(self, Rung::Local | Rung::LocalScalar | Rung::LocalLinear)
    }

    /// Bytes of an instance by itself, about, for so many signals and vertices of its mesh.
    fn bytes(self, signals: usize, vertices: usize) -> f64 {
        let coefficients = match self {
            Rung::Scalar | Rung::LocalScalar => 1,
            Rung::Linear | Rung::LocalLinear => 4,
            Rung::Local => return 0.0,
            Rung::Vertices => return mesh_bytes(signals, vertices),
            Rung::Points => return f64::INFINITY,
        };
        ENTRY_BYTES + COEFFICIENT_BYTES * (coefficients * signals) as f64
    }
}

/// Bytes of a `vertices` track, about.
fn mesh_bytes(signals: usize, vertices: usize) -> f64 {
    TRACK_BYTES + VALUE_BYTES * (signals * vertices) as f64
}

/// A sample of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Place in the box of the mesh, -1 to 1 on each axis.
    pub at: DVec3,
    /// Area that it stands for.
    pub weight: f64,
    /// Per signal what is there.
    pub gold: Vec<f32>,
    pub held_out: bool,
}

/// A rung of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    pub rung: Rung,
    /// Root mean square error of what is shown over the held-out samples.
    pub error: f64,
    /// Per signal the function of an entry; empty for a rung without.
    pub functions: Vec<Linear>,
}

/// All rungs of an instance that were tried.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ladder {
    pub rungs: Vec<Measured>,
    /// Area of its held-out samples.
    pub weight: f64,
}

impl Ladder {
    /// The rungs of an instance that are functions of place: by themselves, and times `local`, which gives the local
    /// values of the mesh at a sample, per signal.
    pub fn functions(
        samples: &[Sample],
        signals: usize,
        tone: &Tone,
        local: Option<&dyn Fn(usize) -> Vec<f32>>,
    ) -> Ladder {
        let ones = |_: usize| vec![1.0; signals];
        let mut ladder = Ladder {
            weight: held_out(samples).map(|(_, s)| s.weight).sum(),
            rungs: Vec::new(),
        };
        let alone: (&dyn Fn(usize) -> Vec<f32>, _) =
            (&ones, [None, Some(Rung::Scalar), Some(Rung::Linear)]);
        let with_local = local.map(|local| {
            let rungs = [Rung::Local, Rung::LocalScalar, Rung::LocalLinear];
            (local, rungs.map(Some))
        });
        for (local, rungs) in std::iter::once(alone).chain(with_local) {
            let locals: Vec<Vec<f32>> = (0..samples.len()).map(local).collect();
            let fits: Vec<fit::Fit> = (0..signals)
                .map(|signal| {
                    let all = samples.iter().zip(&locals);
                    let all: Vec<fit::Sample> = all
                        .map(|(sample, local)| fit::Sample {
                            at: sample.at,
                            weight: sample.weight,
                            local: f64::from(local[signal]),
                            gold: f64::from(sample.gold[signal]),
                            held_out: sample.held_out,
                        })
                        .collect();
                    fit::fit(&all)
                })
                .collect();
            let picks: [fn(&fit::Fit) -> Linear; 3] =
                [|f| f.none.global, |f| f.scalar.global, |f| f.linear.global];
            for (rung, pick) in rungs.into_iter().zip(picks) {
                let Some(rung) = rung else { continue };
                let functions: Vec<Linear> = fits.iter().map(pick).collect();
                let error = error(samples, tone, |i| {
                    shown(&functions, samples[i].at, &locals[i])
                });
                ladder.rungs.push(Measured {
                    rung,
                    error,
                    functions: if rung == Rung::Local {
                        Vec::new()
                    } else {
                        functions
                    },
                });
            }
        }
        ladder
    }

    /// Adds the rung of values at vertices, which has `value` per signal at a sample.
    pub fn add_vertices(
        &mut self,
        samples: &[Sample],
        tone: &Tone,
        value: impl Fn(usize) -> Vec<f32>,
    ) {
        self.rungs.push(Measured {
            rung: Rung::Vertices,
            error: error(samples, tone, value),
            functions: Vec::new(),
        });
    }

    pub fn get(&self, rung: Rung) -> Option<&Measured> {
        self.rungs.iter().find(|measured| measured.rung == rung)
    }

    /// The cheapest rung with at most this error among those that `allowed` picks, or else the one with the least error,
    /// of equal ones the cheapest.
    pub fn choose(
        &self,
        tolerance: f64,
        (signals, vertices): (usize, usize),
        allowed: impl Fn(Rung) -> bool,
    ) -> Option<&Measured> {
        let mut rungs: Vec<&Measured> = self.rungs.iter().filter(|m| allowed(m.rung)).collect();
        rungs.sort_by(|a, b| {
            let bytes = |m: &Measured| m.rung.bytes(signals, vertices);
            bytes(a).total_cmp(&bytes(b)).then(a.rung.cmp(&b.rung))
        });
        let within = rungs.iter().copied().find(|m| m.error <= tolerance);
        let least = |a: &'_ Measured, b: &'_ Measured| a.error.total_cmp(&b.error);
        within.or_else(|| rungs.iter().copied().min_by(|a, b| least(a, b)))
    }
}

/// Whether the instances of a mesh take its local values: whether the cheapest rungs within the tolerance cost less with
/// them, or, where some miss it, err less.
pub fn takes_local(
    ladders: &[&Ladder],
    tolerance: f64,
    (signals, vertices): (usize, usize),
) -> bool {
    // Excess over the tolerance first, then bytes.
    let cost = |has_local: bool| -> (f64, f64) {
        let shared = if has_local {
            mesh_bytes(signals, vertices)
        } else {
            0.0
        };
        let mut cost = (0.0, shared);
        for ladder in ladders {
            let allowed = |rung: Rung| rung.has_local() == has_local || rung == Rung::Vertices;
            if let Some(chosen) = ladder.choose(tolerance, (signals, vertices), allowed) {
                cost.0 += ladder.weight * (chosen.error - tolerance).max(0.0).powi(2);
                cost.1 += chosen.rung.bytes(signals, vertices);
            }
        }
        cost
    };
    let (without, with) = (cost(false), cost(true));
    with.0
        .total_cmp(&without.0)
        .then(with.1.total_cmp(&without.1))
        .is_lt()
}

/// Per signal what a client shows of functions times local values.
pub fn shown(functions: &[Linear], at: DVec3, local: &[f32]) -> Vec<f32> {
    let pairs = functions.iter().zip(local);
    pairs
        .map(|(function, local)| fit::shown(function, at, f64::from(*local)) as f32)
        .collect()
}

fn held_out(samples: &[Sample]) -> impl Iterator<Item = (usize, &Sample)> {
    // An instance of few samples has none to spare.
    let any = samples.iter().any(|sample| sample.held_out);
    let numbered = samples.iter().enumerate();
    numbered.filter(move |(_, sample)| sample.held_out || !any)
}

/// Root mean square error by area over held-out samples of what is shown of `value`, which gives signals; 0 without
/// samples.
pub(super) fn error(samples: &[Sample], tone: &Tone, value: impl Fn(usize) -> Vec<f32>) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for (i, sample) in held_out(samples) {
        let error = tone.shown(&value(i)) - tone.shown(&sample.gold);
        sum += sample.weight * f64::from(error).powi(2);
        weight += sample.weight;
    }
    if weight > 0.0 {
        (sum / weight).sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// Samples of a function of place.
    fn samples(count: usize, value: impl Fn(DVec3) -> f32) -> Vec<Sample> {
        let mut random = Rng::new(8);
        (0..count)
            .map(|i| {
                let at = DVec3::from_array([0; 3].map(|_| 2.0 * random.unit_f64() - 1.0));
                Sample {
                    at,
                    weight: 1.0,
                    gold: vec![value(at)],
                    held_out: is_held_out(i),
                }
            })
            .collect()
    }

    const SIZE: (usize, usize) = (1, 1000);

    fn rung(ladder: &Ladder, tolerance: f64) -> Rung {
        ladder
            .choose(tolerance, SIZE, |_| true)
            .expect("a rung")
            .rung
    }

    #[test]
    fn cheapest_rung_that_holds_is_taken() {
        let tone = Tone::default();
        let flat = samples(64, |_| 0.5);
        let ladder = Ladder::functions(&flat, 1, &tone, None);
        assert_eq!(rung(&ladder, 0.01), Rung::Scalar);
        let slope = samples(64, |u| 0.5 + 0.3 * u.x as f32);
        let mut ladder = Ladder::functions(&slope, 1, &tone, None);
        assert_eq!(rung(&ladder, 0.01), Rung::Linear);
        assert_eq!(rung(&ladder, 0.5), Rung::Scalar);
        // Exact, and dear.
        ladder.add_vertices(&slope, &tone, |i| slope[i].gold.clone());
        assert_eq!(rung(&ladder, 0.01), Rung::Linear);
        assert_eq!(rung(&ladder, 0.0), Rung::Vertices);
    }

    #[test]
    fn rung_with_the_least_error_is_taken_where_none_holds() {
        let tone = Tone::default();
        let step = samples(64, |u| if u.x > 0.3 { 1.0 } else { 0.0 });
        let ladder = Ladder::functions(&step, 1, &tone, None);
        let linear = ladder.get(Rung::Linear).expect("linear").error;
        assert!(linear < ladder.get(Rung::Scalar).expect("scalar").error);
        assert_eq!(rung(&ladder, 0.01), Rung::Linear);
    }

    #[test]
    fn local_values_are_shared_where_they_pay() {
        let tone = Tone::default();
        let detail = |u: DVec3| if (4.0 * u.y).sin() > 0.0 { 0.9 } else { 0.2 };
        let of_instance = samples(96, |u| 0.8 * detail(u));
        let local = |i: usize| vec![detail(of_instance[i].at)];
        let ladder = Ladder::functions(&of_instance, 1, &tone, Some(&local));
        assert!(ladder.get(Rung::LocalScalar).expect("a rung").error < 0.01);
        assert!(ladder.get(Rung::Linear).expect("a rung").error > 0.1);
        let ladders = vec![&ladder; 50];
        assert!(takes_local(&ladders, 0.02, SIZE));
        // Where a scalar does, the shared values cost for nothing.
        assert!(!takes_local(&ladders, 0.9, SIZE));
    }

    #[test]
    fn instance_without_samples_has_no_error() {
        let ladder = Ladder::functions(&[], 2, &Tone::default(), None);
        assert!(ladder.rungs.iter().all(|m| m.error == 0.0));
        assert_eq!(rung(&ladder, 0.0), Rung::Scalar);
    }
}
