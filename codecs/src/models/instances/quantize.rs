//! From coefficients to codes and back: what an encoder needs beside the format.

use super::{COEFFICIENTS, Entry, Form, Table, Value};
use crate::error::{ErrorDetail, ErrorKind, Result};

/// What a value of 1 is in a coefficient, before the exponent.
const ONE: f64 = 32767.0;

impl Table {
    /// The entry nearest to these coefficients, one set for each signal of the track. Of a scalar the first
    /// one of a set is looked at. Each is off by at most [`Table::worst_coefficient_error`].
    ///
    /// # Errors
    /// 3305 for a coefficient that the exponent and the step do not reach, or that is not a number,
    /// and 4012 for another number of sets than the track has signals, both at offset 0.
    pub fn quantize(
        &self,
        key: u64,
        form: Form,
        coefficients: &[[f32; COEFFICIENTS]],
    ) -> Result<Entry> {
        let at_0 = |kind| ErrorDetail::from(kind).at(0);
        if coefficients.len() != self.signals() {
            return Err(at_0(ErrorKind::EncoderUse));
        }
        let mut codes = [[0; COEFFICIENTS]; 2];
        for (codes, coefficients) in codes.iter_mut().zip(coefficients) {
            let all = codes.iter_mut().zip(coefficients).take(form.coefficients());
            for (code, &coefficient) in all {
                let exact = f64::from(coefficient) / self.code_value();
                let nearest = if exact < 0.0 {
                    exact - 0.5
                } else {
                    exact + 0.5
                };
                // A conversion rounds towards 0.
                if exact.is_nan() || nearest as i64 != i64::from(nearest as i32) {
                    return Err(at_0(ErrorKind::InstanceCode));
                }
                self.check_code(nearest as i32).map_err(at_0)?;
                *code = nearest as i16;
            }
        }
        Ok(Entry { key, form, codes })
    }

    /// The coefficients that a decoded value stands for.
    pub fn coefficients(&self, value: Value) -> [f32; COEFFICIENTS] {
        let scale = f32::from(1u16 << self.exponent.min(15));
        value.map(|number| f32::from(number) / ONE as f32 * scale)
    }

    /// How far a coefficient that was quantised may be from what it was: half a step.
    pub fn worst_coefficient_error(&self) -> f32 {
        (self.code_value() / 2.0) as f32
    }

    /// How far the value of an entry may be, within the bounds of its mesh, from that of the coefficients
    /// before they were quantised: an error of half a step in each.
    pub fn worst_error(&self, form: Form) -> f32 {
        form.coefficients() as f32 * self.worst_coefficient_error()
    }

    /// What a code of 1 stands for.
    fn code_value(&self) -> f64 {
        f64::from(self.step) * f64::from(1u16 << self.exponent.min(15)) / ONE
    }
}
