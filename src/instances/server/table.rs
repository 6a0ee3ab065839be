//! From the functions of instances to the table of a track (`spec/instances.md`).

use super::fit::Linear;
use crate::codec::instances::{Coding, Entry, Form, Table, key};
use crate::codec::signals::Signals;
use crate::{Error, Result};

/// How far G may be from what was fitted, by quantising, anywhere in the box of the mesh: a quarter of a step of 8-bit
/// obscurance by default.
pub const BOUND: f32 = 1.0 / 1024.0;

/// The largest exponent of a table.
const MAX_EXPONENT: u8 = 3;

/// An instance's entry before it is quantised.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    pub key: u64,
    pub form: Form,
    /// One set per signal.
    pub coefficients: Vec<[f32; 4]>,
}

impl Function {
    /// Of an instance by its path ([`crate::scene::Instance::name`]), one function per signal; of a scalar the first
    /// coefficient counts.
    pub fn new(path: &str, form: Form, functions: &[Linear]) -> Function {
        let used = form.coefficients();
        let set = |function: &Linear| {
            std::array::from_fn(|i| if i < used { function[i] as f32 } else { 0.0 })
        };
        Function {
            key: key(path),
            form,
            coefficients: functions.iter().map(set).collect(),
        }
    }
}

/// The table of a mesh and its entries, keys ascending: the smallest exponent that reaches all coefficients, and the largest
/// step with which no G is off by more than `bound`. `None` without a function.
///
/// # Errors
/// `Invalid` for a bound that is not a positive number, and where two paths have one key or a set is missing. Coefficients
/// of [`super::fit::fit`] always fit.
pub fn table(
    signals: Signals,
    functions: &[Function],
    bound: f32,
    coding: Coding,
) -> Result<Option<(Table, Vec<Entry>)>> {
    if !(bound > 0.0 && bound.is_finite()) {
        return Err(Error::Invalid(format!(
            "the bound on the error of quantising is {bound}; it must be a positive number"
        )));
    }
    if functions.is_empty() {
        return Ok(None);
    }
    let all = functions.iter().flat_map(|f| f.coefficients.as_flattened());
    let largest = all.fold(0.0, |largest: f32, c| c.abs().max(largest));
    let exponent = (0..MAX_EXPONENT).find(|e| largest <= f32::from(1u16 << e));
    let mut table = Table {
        signals,
        count: u32::try_from(functions.len()).unwrap_or(u32::MAX),
        exponent: exponent.unwrap_or(MAX_EXPONENT),
        step: 1,
        coding,
    };
    let richest = functions.iter().any(|f| f.form == Form::Linear);
    let form = if richest { Form::Linear } else { Form::Scalar };
    // The error is proportional to the step. Codes are rounded: a step that does not divide the largest value would put
    // the nearest code of a coefficient there out of reach.
    let steps = bound / table.worst_error(form);
    table.step = steps.clamp(1.0, f32::from(i16::MAX)) as u16;
    while table.step > 1 && !reaches(&table, functions) {
        table.step -= 1;
    }
    let quantize = |f: &Function| table.quantize(f.key, f.form, &f.coefficients);
    let entries: std::result::Result<Vec<Entry>, _> = functions.iter().map(quantize).collect();
    let mut entries = entries
        .map_err(|e| Error::Invalid(format!("an instance's function cannot be quantised: {e}")))?;
    entries.sort_by_key(|entry| entry.key);
    if entries.windows(2).any(|pair| pair[0].key == pair[1].key) {
        return Err(Error::Invalid(
            "the paths of two instances of a mesh have the same hash; rename one".into(),
        ));
    }
    Ok(Some((table, entries)))
}

/// Whether the codes of all functions are in range.
fn reaches(table: &Table, functions: &[Function]) -> bool {
    let quantize = |f: &Function| table.quantize(f.key, f.form, &f.coefficients);
    functions.iter().all(|f| quantize(f).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::signals::Kernel;
    use crate::rng::Rng;

    fn functions(count: usize, size: f32) -> Vec<Function> {
        let mut random = Rng::new(11);
        (0..count)
            .map(|i| {
                let form = [Form::Scalar, Form::Linear][i % 2];
                let mut number = || f64::from(size) * (2.0 * random.unit_f64() - 1.0);
                let functions = [0; 2].map(|_| [0; 4].map(|_| number()));
                Function::new(&format!("tree {i}"), form, &functions)
            })
            .collect()
    }

    fn two() -> Signals {
        Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.97)
    }

    #[test]
    fn bound_holds_anywhere_in_the_box() {
        for size in [0.3, 1.0, 1.7, 8.0] {
            for bound in [1.0 / 64.0, BOUND] {
                let functions = functions(50, size);
                let made = table(two(), &functions, bound, Coding::Packed).expect("sound");
                let (table, entries) = made.expect("functions");
                assert!(entries.windows(2).all(|pair| pair[0].key < pair[1].key));
                for f in &functions {
                    let entry = entries.iter().find(|e| e.key == f.key).expect("an entry");
                    assert_eq!(entry.form, f.form);
                    for (codes, c) in entry.codes.iter().zip(&f.coefficients) {
                        let back = table.coefficients(codes.map(|code| code * table.step as i16));
                        let used = f.form.coefficients();
                        // At the corner where all errors add up.
                        let error: f32 = (0..used).map(|i| (back[i] - c[i]).abs()).sum();
                        assert!(error <= 1.001 * bound, "{error} {bound} {size}");
                    }
                }
                // Coarser would not do: half as many steps would be off by more.
                assert!(2.1 * table.worst_error(Form::Linear) > bound || table.step > 100);
            }
        }
    }

    #[test]
    fn largest_coefficients_keep_a_code() {
        let f = Function {
            key: 1,
            form: Form::Linear,
            coefficients: vec![[8.0, -8.0, 8.0, 0.0]],
        };
        let one = Signals::one(Kernel::cut_off(1.0));
        for bound in [1e-4, 1e-3, 0.03, 0.7] {
            let made = table(one, std::slice::from_ref(&f), bound, Coding::Raw).expect("sound");
            assert!(made.is_some());
        }
    }

    #[test]
    fn unsound_tables_are_refused() {
        let mut same = functions(2, 1.0);
        same[1].key = same[0].key;
        assert!(table(two(), &same, BOUND, Coding::Raw).is_err());
        for bound in [0.0, -1.0, f32::NAN] {
            assert!(table(two(), &functions(2, 1.0), bound, Coding::Raw).is_err());
        }
        let one = Signals::one(Kernel::cut_off(1.0));
        assert!(table(one, &functions(2, 1.0), BOUND, Coding::Raw).is_err());
        assert_eq!(table(one, &[], BOUND, Coding::Raw).expect("empty"), None);
    }
}
