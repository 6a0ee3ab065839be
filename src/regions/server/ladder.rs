//! The rungs of a region: every form that its samples allow, with its error on held-out samples.

use super::fit::{self, Centres, Layout};
use super::model::{self, Form, Model};
use super::samples::RegionSamples;
use crate::trace::Aabb;

/// A form and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    pub form: Form,
    /// Root mean square over the held-out samples of what the form shows less what is there: of the
    /// blend with one signal, of both signals with two. `None` where there are no samples.
    pub error: Option<f64>,
}

/// All that is known of one region by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionFit {
    pub layout: Layout,
    /// By derivatives, from none to the richest that the samples allow.
    pub models: Vec<Model>,
    /// By the number of coefficients, then by error.
    pub rungs: Vec<Rung>,
}

impl RegionFit {
    /// The model that a form is a part of; the richest there is where it is richer.
    pub fn model(&self, form: Form) -> &Model {
        let wanted = form.derivatives as usize;
        &self.models[wanted.min(self.models.len() - 1)]
    }
}

/// Fits a region and measures its rungs. `share` is that of the second signal in the blend.
///
/// A pure function of its arguments.
pub fn fit_region(
    bounds: Aabb,
    samples: &RegionSamples,
    share: f64,
    centres: Centres,
) -> RegionFit {
    let (layout, fitted) = fit::fit(bounds, samples, centres);
    let models: Vec<Model> = fitted.into_iter().map(|fitted| fitted.model).collect();
    let mut rungs = Vec::new();
    for model in &models {
        for degree in 0..=2 {
            for signals in 1..=samples.signals {
                let form = Form {
                    derivatives: model.derivatives,
                    degree,
                    signals,
                };
                let error = error(model, form, samples, share);
                rungs.push(Rung { form, error });
            }
        }
    }
    let key = |rung: &Rung| (rung.form.coefficients(), rung.error.unwrap_or(0.0));
    rungs.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    RegionFit {
        layout,
        models,
        rungs,
    }
}

/// The error of a form of a model on held-out samples; `None` where there are none.
pub fn error(model: &Model, form: Form, samples: &RegionSamples, share: f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    for point in &samples.held_out {
        let channels = model.channels(point.position);
        for (i, normal) in point.normals.iter().enumerate() {
            let got = model::evaluate(&channels, form.degree, *normal);
            let want = point.values.map(|values| f64::from(values[i]));
            if form.signals == 1 && samples.signals == 2 {
                let blend = |[a, b]: [f64; 2]| model::blend(a, b, share);
                sum += (blend(got) - blend(want)).powi(2);
                count += 1;
            } else {
                for signal in 0..form.signals {
                    sum += (got[signal] - want[signal]).powi(2);
                    count += 1;
                }
            }
        }
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}
