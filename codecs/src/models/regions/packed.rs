//! The entropy-coded part of `packed` regions, `spec/regions.md` §7: one walk for reader and writer.

use super::contexts::{self, LONGEST, POLYNOMIALS, ROWS};
use super::{Derivatives, Form, MOST_COEFFICIENTS};
use crate::entropy::Coder;
use crate::error::ErrorKind;

/// What is remembered of the regions before.
pub(super) struct Walk {
    /// Signals of the track.
    signals: u8,
    step: i32,
    /// By class of rows: codes are predicted from the last one.
    follow: [bool; 3],
    form: Form,
    last: [[[Seen; 2]; POLYNOMIALS]; ROWS],
}

/// The last code of a row, polynomial and signal, and the magnitude of its residual.
#[derive(Clone, Copy, Default)]
struct Seen {
    code: i16,
    residual: u16,
}

/// The form before the first region.
pub(super) const FIRST: Form = Form {
    derivatives: Derivatives::Constant,
    degree: 0,
    signals: 1,
    centred: true,
};

/// First row and class of the derivatives.
fn rows(derivatives: Derivatives) -> (usize, usize) {
    match derivatives {
        Derivatives::Constant => (0, 0),
        Derivatives::Gradient => (1, 1),
        Derivatives::Sided => (4, 2),
    }
}

impl Walk {
    /// Codes what comes before the first region. `follow` is what a writer wants.
    pub(super) fn start<C: Coder>(
        coder: &mut C,
        signals: u8,
        step: u16,
        follow: [bool; 3],
    ) -> Walk {
        Walk {
            signals,
            step: step.into(),
            follow: follow.map(|bit| coder.bypass_bit(bit)),
            form: FIRST,
            last: [[[Seen::default(); 2]; POLYNOMIALS]; ROWS],
        }
    }

    /// Codes a form; whether it is centred stands elsewhere.
    pub(super) fn form<C: Coder>(&mut self, coder: &mut C, wanted: Form) -> Form {
        let before = Form {
            centred: self.form.centred,
            ..wanted
        };
        if coder.bit(contexts::OTHER, before != self.form) {
            let number = wanted.derivatives as usize;
            let number = three(coder, contexts::DERIVATIVES, number);
            self.form.derivatives = Derivatives::ALL[number];
            self.form.degree = three(coder, contexts::DEGREE, wanted.degree.into()) as u8;
            let two = self.signals == 2 && coder.bit(contexts::SIGNALS, wanted.signals == 2);
            self.form.signals = 1 + u8::from(two);
        }
        self.form
    }

    /// Codes the codes of a region of the form that came last. `codes` are what a writer wants, and
    /// afterwards what came.
    pub(super) fn codes<C: Coder>(
        &mut self,
        coder: &mut C,
        codes: &mut [i16; MOST_COEFFICIENTS],
    ) -> Result<(), ErrorKind> {
        let form = self.form;
        let (first, class) = rows(form.derivatives);
        let (polynomials, signals) = (form.polynomials(), usize::from(form.signals));
        let mut codes = codes.iter_mut();
        for at in 0..=form.derivatives.count() {
            let (row, class) = match at {
                0 => (0, 0),
                _ => (first + at - 1, class),
            };
            for polynomial in 0..polynomials {
                for (signal, code) in codes.by_ref().take(signals).enumerate() {
                    let group = contexts::group(signal, class, polynomial);
                    let sign = contexts::sign(row, polynomial);
                    let seen = &mut self.last[row][polynomial][signal];
                    let predicted = if self.follow[class] { seen.code } else { 0 };
                    let (came, residual) = code_code(
                        coder,
                        (group, sign),
                        seen.residual,
                        i32::from(*code) - i32::from(predicted),
                        predicted.into(),
                    );
                    *code = check_code(came, self.step)?;
                    *seen = Seen {
                        code: *code,
                        residual,
                    };
                }
            }
        }
        Ok(())
    }
}

/// A number of 0 to 2.
fn three<C: Coder>(coder: &mut C, context: usize, wanted: usize) -> usize {
    if !coder.bit(context, wanted != 0) {
        return 0;
    }
    1 + usize::from(coder.bit(context + 1, wanted == 2))
}

/// A code by its residual. Returns it, and the magnitude of the residual.
#[inline(always)]
fn code_code<C: Coder>(
    coder: &mut C,
    (group, sign): (usize, usize),
    last: u16,
    wanted: i32,
    predicted: i32,
) -> (i32, u16) {
    if !coder.bit(contexts::significant(group, last), wanted != 0) {
        return (predicted, 0);
    }
    let negative = coder.bit(sign, wanted < 0);
    let magnitude = code_magnitude(coder, group, wanted.unsigned_abs());
    let residual = magnitude as i32;
    let code = predicted + if negative { -residual } else { residual };
    (code, magnitude as u16)
}

/// A magnitude of 1 to 65535.
#[inline(always)]
fn code_magnitude<C: Coder>(coder: &mut C, group: usize, wanted: u32) -> u32 {
    let prefix = |length| contexts::prefix(group, length);
    coder.exp_golomb(LONGEST, prefix, |_| contexts::suffix(group), wanted)
}

/// A code whose value is in range.
#[inline(always)]
pub(super) fn check_code(code: i32, step: i32) -> Result<i16, ErrorKind> {
    // A code is within 2^17, a step within 2^15.
    let value = i64::from(code) * i64::from(step);
    match value.unsigned_abs() <= 32767 {
        true => Ok(code as i16),
        false => Err(ErrorKind::RegionCode),
    }
}

/// Which classes cost fewer bits where they are predicted: the digits of their residuals are counted.
pub(super) fn follow<'a>(regions: impl Iterator<Item = (Form, &'a [i16])>) -> [bool; 3] {
    let digits = |value: i32| u64::from(u32::BITS - value.unsigned_abs().leading_zeros());
    let mut last = [[[0i32; 2]; POLYNOMIALS]; ROWS];
    let mut sums = [[0u64; 2]; 3];
    for (form, codes) in regions {
        let (first, class) = rows(form.derivatives);
        let (polynomials, signals) = (form.polynomials(), usize::from(form.signals));
        for (at, &code) in codes.iter().enumerate() {
            let (signal, at) = (at % signals, at / signals);
            let (polynomial, at) = (at % polynomials, at / polynomials);
            let (row, class) = match at {
                0 => (0, 0),
                _ => (first + at - 1, class),
            };
            let seen = &mut last[row][polynomial][signal];
            let code = i32::from(code);
            sums[class][0] += digits(code);
            sums[class][1] += digits(code - *seen);
            *seen = code;
        }
    }
    sums.map(|[alone, following]| following < alone)
}
