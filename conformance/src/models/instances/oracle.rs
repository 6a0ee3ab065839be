//! What the sampling of `spec/instances.md` §8 gives, in f64 and with the bounds of an answer.

use twox_hash::XxHash64;

use super::expected::Entries;
use super::queries::InstancesQuery;

/// What a sampler may be off by, in parts of the sum of magnitudes.
const TOLERANCE: f64 = 1.0 / 4096.0;

/// A mistake that a sampler can make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mistake {
    /// The exponent is left out.
    NoExponent,
    /// Values are divided by 32768.
    WrongDivisor,
    /// Positions are not centred.
    NotCentred,
    /// Positions are divided by the extent and not by its half.
    WholeExtent,
    /// Positions outside the bounds go on.
    NotLimited,
    /// Axes are in another order.
    AxesTurned,
    /// Signals are not kept above 0 before they are blended.
    BlendedFirst,
    /// The second signal is left out.
    FirstSignal,
    /// The share is that of the first signal.
    ShareTurned,
    /// The local AO is left out.
    NoLocal,
    /// AO above 1 is kept.
    Above1,
    /// An instance without an entry has no light.
    MissingIs0,
    /// The entry next to the one of the key is taken.
    Neighbour,
}

/// All mistakes.
pub const MISTAKES: [Mistake; 13] = [
    Mistake::NoExponent,
    Mistake::WrongDivisor,
    Mistake::NotCentred,
    Mistake::WholeExtent,
    Mistake::NotLimited,
    Mistake::AxesTurned,
    Mistake::BlendedFirst,
    Mistake::FirstSignal,
    Mistake::ShareTurned,
    Mistake::NoLocal,
    Mistake::Above1,
    Mistake::MissingIs0,
    Mistake::Neighbour,
];

/// AO, and what a right sampler may be off by; with a mistake what that gives.
pub fn ao(
    entries: &Entries,
    aabb: &[f32; 6],
    query: &InstancesQuery,
    mistake: Option<Mistake>,
) -> (f64, f64) {
    let is = |m| mistake == Some(m);
    let local = f64::from(query.local) / 65536.0;
    let key = XxHash64::oneshot(0, query.instance.as_bytes());
    let mut found = entries.instances.iter().position(|i| i.key == key);
    if is(Mistake::Neighbour) {
        found = found.map(|at| (at + 1) % entries.instances.len());
    }
    let Some(instance) = found.map(|at| entries.instances[at]) else {
        let missing = if is(Mistake::MissingIs0) { 0.0 } else { local };
        return (missing, TOLERANCE);
    };
    let table = &entries.table;
    let mut u = [0, 1, 2].map(|axis| {
        let p = f64::from(query.position[axis]) / 65536.0;
        let (low, high) = (f64::from(aabb[axis]), f64::from(aabb[axis + 3]));
        if low == high {
            return 0.0;
        }
        let centre = if is(Mistake::NotCentred) {
            low
        } else {
            (low + high) / 2.0
        };
        let half = if is(Mistake::WholeExtent) {
            high - low
        } else {
            (high - low) / 2.0
        };
        let u = (p - centre) / half;
        if is(Mistake::NotLimited) {
            u
        } else {
            u.clamp(-1.0, 1.0)
        }
    });
    if is(Mistake::AxesTurned) {
        u.rotate_left(1);
    }
    let exponent = if is(Mistake::NoExponent) {
        0
    } else {
        table.exponent
    };
    let divisor = if is(Mistake::WrongDivisor) {
        32768.0 * 1.01
    } else {
        32767.0
    };
    let unit = f64::from(1u32 << exponent) / divisor * f64::from(table.step);
    let mut magnitude = 0.0f64;
    let mut signal = |codes: [i32; 4]| {
        let c = codes.map(|code| f64::from(code) * unit);
        magnitude = magnitude.max(c.iter().map(|c| c.abs()).sum());
        let value = c[0] + c[1] * u[0] + c[2] * u[1] + c[3] * u[2];
        if is(Mistake::BlendedFirst) {
            value
        } else {
            value.max(0.0)
        }
    };
    let a = signal(instance.codes[0]);
    let global = match table.signals {
        2 if !is(Mistake::FirstSignal) => {
            let b = signal(instance.codes[1]);
            let share = f64::from(table.share);
            let share = if is(Mistake::ShareTurned) {
                1.0 - share
            } else {
                share
            };
            a + (b - a) * share
        }
        _ => a,
    };
    let global = global.max(0.0);
    let ao = if is(Mistake::NoLocal) {
        global
    } else {
        global * local
    };
    let most = if is(Mistake::Above1) {
        f64::INFINITY
    } else {
        1.0
    };
    (ao.min(most), TOLERANCE * magnitude)
}

/// The query with the interval of its answer.
pub fn with_interval(
    entries: &Entries,
    aabb: &[f32; 6],
    mut query: InstancesQuery,
) -> InstancesQuery {
    let (ao, off) = ao(entries, aabb, &query, None);
    let low = ((ao - off).max(0.0) * 65536.0).floor();
    let high = ((ao + off).min(1.0) * 65536.0).ceil();
    query.ao = [low as u32, high as u32];
    query
}
