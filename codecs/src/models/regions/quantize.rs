//! From coefficients to values: what an encoder needs beside the format.

use alloc::vec::Vec;

use super::{Form, Pair, Region, RegionSet};
use crate::error::{ErrorDetail, ErrorKind, Result};

/// The content of a track as an encoder takes it, region by region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Regions.
    pub regions: Vec<Region>,
    /// Their coefficients.
    pub pairs: Vec<Pair>,
}

impl RegionSet {
    /// How far a coefficient may be from the one that was asked for: half a step, and what f32 rounds.
    pub fn error_bound(&self) -> f32 {
        // A coefficient is at most 8.
        0.5 * f32::from(self.step) * self.scale() + 8.0 * f32::EPSILON
    }

    /// The largest coefficient that has a value, either sign.
    pub fn most(&self) -> f32 {
        f32::from(32767 / self.step.max(1) * self.step) * self.scale()
    }

    /// Adds a region to `content`, each coefficient to within [`RegionSet::error_bound`]. `centre` is given
    /// where the region is not centred; coefficients are in the order of [`Form::coefficients`].
    ///
    /// # Errors
    /// 3403 for a box or a centre, 3404 for a form that the track does not have, 3405 for a coefficient
    /// beyond [`RegionSet::most`] or not a number, 3407 for more pairs than the capacity, 4012 for
    /// coefficients of another number or more regions than the track has. `content` stays as it was.
    pub fn push(
        &self,
        content: &mut Content,
        bounds: [[f32; 3]; 2],
        centre: Option<[f32; 3]>,
        form: Form,
        coefficients: &[f32],
    ) -> Result<()> {
        let (regions, pairs) = (content.regions.len(), content.pairs.len());
        let pushed = self.try_push(content, bounds, centre, form, coefficients);
        pushed.map_err(|kind| {
            content.regions.truncate(regions);
            content.pairs.truncate(pairs);
            ErrorDetail::from(kind).at(0)
        })
    }

    fn try_push(
        &self,
        content: &mut Content,
        [min, max]: [[f32; 3]; 2],
        centre: Option<[f32; 3]>,
        form: Form,
        coefficients: &[f32],
    ) -> core::result::Result<(), ErrorKind> {
        if form.centred != centre.is_none()
            || coefficients.len() != form.coefficients()
            || content.regions.len() >= self.count as usize
        {
            return Err(ErrorKind::EncoderUse);
        }
        let mut region = Region {
            min,
            first: content.pairs.len() as u32,
            max,
            form: form.bits(),
            centre: [0.0; 3],
            reserved: 0,
        };
        region.centre = centre.unwrap_or_else(|| region.middle());
        let step = f64::from(self.step) * f64::from(1u32 << self.exponent.min(3)) / 32767.0;
        let mut value = |&coefficient: &f32| {
            // Rounds halves away from 0, which is the same everywhere.
            let scaled = f64::from(coefficient) / step;
            let code = (scaled.abs() + 0.5) as i64 * if scaled < 0.0 { -1 } else { 1 };
            let value = code.saturating_mul(self.step.into());
            match coefficient.is_finite() && value.unsigned_abs() <= 32767 {
                true => Ok(value as i16),
                false => Err(ErrorKind::RegionCode),
            }
        };
        for pair in coefficients.chunks(2) {
            let second = pair.get(1).map_or(Ok(0), &mut value)?;
            content.pairs.push([value(&pair[0])?, second]);
        }
        content.regions.push(region);
        self.check_region(&region, region.first as usize, &content.pairs)?;
        Ok(())
    }

    /// A region that an encoder may write, whose pairs start at `first`. Returns its form.
    pub(super) fn check_region(
        &self,
        region: &Region,
        first: usize,
        pairs: &[Pair],
    ) -> core::result::Result<Form, ErrorKind> {
        region.check_box()?;
        let form = Form::read(region.form)?;
        if form.signals > self.signals.count {
            return Err(ErrorKind::RegionForm);
        }
        region.check_centre()?;
        let end = first + form.pairs();
        if end > self.capacity as usize {
            return Err(ErrorKind::RegionsCapacity);
        }
        let values = pairs.get(first..end).ok_or(ErrorKind::EncoderUse)?;
        let (values, rest) = values.as_flattened().split_at(form.coefficients());
        let whole =
            |&value: &i16| value != i16::MIN && i32::from(value) % i32::from(self.step) == 0;
        let middle = !form.centred || region.centre == region.middle();
        let right = middle
            && region.first as usize == first
            && region.reserved == 0
            && values.iter().all(whole)
            && rest.iter().all(|&value| value == 0);
        match right {
            true => Ok(form),
            false => Err(ErrorKind::EncoderUse),
        }
    }
}
