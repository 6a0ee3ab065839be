//! The model of a region (Eq. 4), and the forms in which it can be stored.

use super::basis::{self, COUNT};
use super::dense::MAX;
use super::samples::{Channels, MAX_SIGNALS};
use crate::trace::Aabb;
use glam::Vec3;

/// How a model changes over its region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Derivatives {
    /// Not at all.
    None,
    /// One derivative per axis.
    Gradient,
    /// Two per axis, one on each side of the centre: Eq. 4.
    Sided,
}

impl Derivatives {
    pub const ALL: [Derivatives; 3] =
        [Derivatives::None, Derivatives::Gradient, Derivatives::Sided];

    /// Parameters of a channel: the value at the centre, and the derivatives.
    pub const fn terms(self) -> usize {
        match self {
            Derivatives::None => 1,
            Derivatives::Gradient => 4,
            Derivatives::Sided => 7,
        }
    }

    /// What each parameter is multiplied by at `u`, the offset from the centre in half extents of the
    /// box: 1; x, y, z; or 1; +x, -x, +y, -y, +z, -z. The rest is 0.
    pub fn features(self, u: Vec3) -> [f64; MAX] {
        let [x, y, z] = u.as_dvec3().to_array();
        match self {
            Derivatives::None => [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            Derivatives::Gradient => [1.0, x, y, z, 0.0, 0.0, 0.0],
            Derivatives::Sided => [
                1.0,
                x.max(0.0),
                x.min(0.0),
                y.max(0.0),
                y.min(0.0),
                z.max(0.0),
                z.min(0.0),
            ],
        }
    }
}

/// What of a model is stored: a rung of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    pub derivatives: Derivatives,
    /// Of the functions of the normal: 0 to 2.
    pub degree: usize,
    /// 1 (the blend) or 2.
    pub signals: usize,
}

impl Form {
    /// Coefficients of a region.
    pub const fn coefficients(self) -> usize {
        self.derivatives.terms() * basis::count(self.degree) * self.signals
    }
}

/// Obscurance in a region as a function of position and normal, for all channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// World space, metres.
    pub bounds: Aabb,
    pub centre: Vec3,
    pub derivatives: Derivatives,
    /// Per term of [`Derivatives::features`].
    pub terms: Vec<Channels>,
}

impl Model {
    /// The offset of a point from a centre, in half extents of a box; 0 along axes on which it is flat.
    pub fn offset(bounds: &Aabb, centre: Vec3, p: Vec3) -> Vec3 {
        let half = 0.5 * (bounds.max - bounds.min);
        let offset = p - centre;
        Vec3::from_array(std::array::from_fn(|i| match half[i] > 0.0 {
            true => offset[i] / half[i],
            false => 0.0,
        }))
    }

    /// The middle of a box, rounded as in the format.
    pub fn middle(bounds: &Aabb) -> Vec3 {
        0.5 * bounds.min + 0.5 * bounds.max
    }

    pub fn features(&self, p: Vec3) -> [f64; MAX] {
        let u = Model::offset(&self.bounds, self.centre, p);
        self.derivatives.features(u)
    }

    /// All channels at a point, which is moved into the box first.
    pub fn channels(&self, p: Vec3) -> Channels {
        let p = p.clamp(self.bounds.min, self.bounds.max);
        let mut channels = [0.0; MAX_SIGNALS * COUNT];
        for (feature, term) in self.features(p).iter().zip(&self.terms) {
            for (channel, term) in channels.iter_mut().zip(term) {
                *channel += feature * term;
            }
        }
        channels
    }

    /// The coefficients of a form in the order of the format: term by term, in each function by function, in
    /// each signal by signal. One signal of two is their blend with that share of the second.
    ///
    /// Terms that the model lacks are 0.
    pub fn coefficients(&self, form: Form, kernels: usize, share: f64) -> Vec<f32> {
        let mut all = Vec::with_capacity(form.coefficients());
        for term in 0..form.derivatives.terms() {
            for i in 0..basis::count(form.degree) {
                for signal in 0..form.signals {
                    let channels = self.terms.get(term).unwrap_or(&[0.0; MAX_SIGNALS * COUNT]);
                    let value = match (form.signals, kernels) {
                        (1, 2) => blend(channels[i], channels[COUNT + i], share),
                        _ => channels[signal * COUNT + i],
                    };
                    all.push(value as f32);
                }
            }
        }
        all
    }
}

/// Both signals as one value.
pub fn blend(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

/// Obscurance of each signal for a unit normal by the functions up to a degree, in 0..=1.
pub fn evaluate(channels: &Channels, degree: usize, normal: Vec3) -> [f64; MAX_SIGNALS] {
    let values = basis::values(normal);
    std::array::from_fn(|signal| {
        let own = &channels[signal * COUNT..][..basis::count(degree)];
        let sum: f64 = own.iter().zip(values).map(|(c, y)| c * f64::from(y)).sum();
        sum.clamp(0.0, 1.0)
    })
}
