//! Models in the form that the format holds.

use super::model::{Derivatives, Form, Model};
use crate::codec::regions::{
    Coding, Content, Derivatives as Stored, Form as StoredForm, RegionSet,
};
use crate::codec::signals::Signals;
use crate::{Error, Result};

/// Largest coefficient of the format, either sign: 2^3.
pub const LARGEST: f64 = 8.0;
const MAX_EXPONENT: u8 = 3;

/// Bounds on the sum of the magnitudes of the polynomials up to a degree, over all normals: 1;
/// |x| + |y| + |z| up to sqrt(3); |xy| + |yz| + |xz| up to 1, |3z^2 - 1| up to 2, |x^2 - y^2| up to 1.
const POLYNOMIALS: [f32; 3] = [1.0, 2.733, 6.733];

/// The parameters of a track and its content: for each region the part of a model that a form names. The
/// exponent is the smallest that reaches all coefficients, the step the largest with which no AO is off by
/// more than `bound` (or 1, which may be off by more than a bound below 1e-3).
///
/// `kernels` is the number of signals that the models were fitted for.
///
/// # Errors
/// `Invalid` for a bound that is not a positive number, and for what the format does not hold: no region,
/// more than 2^20, a box that is too far away. Coefficients beyond [`LARGEST`], which
/// [`super::fit()`](super::fit::fit) does not give, are cut off there.
pub fn store(
    regions: &[(&Model, Form)],
    kernels: usize,
    signals: Signals,
    bound: f32,
    coding: Coding,
) -> Result<(RegionSet, Content)> {
    if !(bound > 0.0 && bound.is_finite()) {
        return Err(Error::Invalid(format!(
            "the bound on the error of quantising is {bound}; it must be a positive number"
        )));
    }
    let share = f64::from(signals.share);
    let largest = LARGEST as f32;
    let coefficients: Vec<Vec<f32>> = regions
        .iter()
        .map(|(model, form)| {
            let mut all = model.coefficients(*form, kernels, share);
            all.iter_mut().for_each(|c| *c = c.clamp(-largest, largest));
            all
        })
        .collect();
    let most = coefficients.iter().flatten();
    let most = most.fold(0.0, |most: f32, c| c.abs().max(most));
    let exponent = (0..MAX_EXPONENT).find(|e| most <= f32::from(1u16 << e));
    let pairs: usize = coefficients.iter().map(|c| c.len().div_ceil(2)).sum();
    let too_many = |_| Error::Invalid(format!("{} regions are too many", regions.len()));
    let mut set = RegionSet {
        signals,
        count: u32::try_from(regions.len()).map_err(too_many)?,
        capacity: u32::try_from(pairs).map_err(too_many)?,
        exponent: exponent.unwrap_or(MAX_EXPONENT),
        step: 1,
        coding,
    };
    let worst = regions.iter().map(|(model, form)| weight(model, *form));
    let worst = worst.fold(1.0, f32::max);
    // Half a step is the error of a coefficient.
    let steps = bound / (0.5 * worst * set.scale());
    set.step = steps.clamp(1.0, f32::from(i16::MAX)) as u16;
    // A step that does not divide the largest value would put the nearest code of a coefficient there out
    // of reach.
    while set.step > 1 && most > set.most() {
        set.step -= 1;
    }
    let mut content = Content::default();
    for ((model, form), coefficients) in regions.iter().zip(&coefficients) {
        let centred = model.centre == Model::middle(&model.bounds);
        let bounds = [model.bounds.min.to_array(), model.bounds.max.to_array()];
        let centre = (!centred).then(|| model.centre.to_array());
        set.push(
            &mut content,
            bounds,
            centre,
            stored(*form, centred),
            coefficients,
        )
        .map_err(|e| Error::Invalid(format!("a region cannot be stored: {e}")))?;
    }
    Ok((set, content))
}

fn stored(form: Form, centred: bool) -> StoredForm {
    StoredForm {
        derivatives: match form.derivatives {
            Derivatives::None => Stored::Constant,
            Derivatives::Gradient => Stored::Gradient,
            Derivatives::Sided => Stored::Sided,
        },
        degree: form.degree as u8,
        signals: form.signals as u8,
        centred,
    }
}

/// The most that an error of 1 in every coefficient can make of AO.
fn weight(model: &Model, form: Form) -> f32 {
    let far = |corner| Model::offset(&model.bounds, model.centre, corner).abs();
    let offsets = far(model.bounds.min).max(far(model.bounds.max));
    let terms = match form.derivatives {
        Derivatives::None => 1.0,
        _ => 1.0 + offsets.element_sum(),
    };
    terms * POLYNOMIALS[form.degree.min(2)]
}
