//! Quantising, prediction and the layout of regions.

use std::vec::Vec;

use super::packed::follow;
use super::*;
use crate::models::Parameters;
use crate::models::signals::Kernel;

fn set(step: u16, exponent: u8) -> RegionSet {
    RegionSet {
        signals: Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.97),
        count: 4,
        capacity: 4 * 63,
        exponent,
        step,
        coding: Coding::Packed,
    }
}

const SIDED: Form = Form {
    derivatives: Derivatives::Sided,
    degree: 2,
    signals: 2,
    centred: true,
};
const BOX: [[f32; 3]; 2] = [[0.0; 3], [2.0, 3.0, 4.0]];

fn draw(state: &mut u64) -> f32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 40) as f32 / (1 << 23) as f32 - 1.0
}

#[test]
fn forms_have_bits_and_sizes_of_their_own() {
    let mut seen = Vec::new();
    for derivatives in Derivatives::ALL {
        for degree in 0..3 {
            for signals in [1, 2] {
                for centred in [false, true] {
                    let form = Form {
                        derivatives,
                        degree,
                        signals,
                        centred,
                    };
                    assert_eq!(Form::read(form.bits()), Ok(form));
                    assert!(!seen.contains(&form.bits()));
                    seen.push(form.bits());
                    assert!(form.coefficients() <= MOST_COEFFICIENTS);
                }
            }
        }
    }
    let forms = (0..64).filter(|&bits| Form::read(bits).is_ok()).count();
    assert_eq!(forms, seen.len());
    assert_eq!(SIDED.coefficients(), MOST_COEFFICIENTS);
    let scalar = Form {
        derivatives: Derivatives::Constant,
        degree: 0,
        signals: 1,
        centred: false,
    };
    assert_eq!((scalar.coefficients(), scalar.pairs()), (1, 1));
}

#[test]
fn quantised_coefficients_keep_their_bound() {
    let mut state = 1;
    for (step, exponent) in [(1, 0), (1, 3), (7, 1), (64, 0), (1000, 2), (32767, 3)] {
        let set = set(step, exponent);
        assert_eq!(set.check(), Ok(()));
        for _ in 0..200 {
            let asked: Vec<f32> = (0..126).map(|_| draw(&mut state) * set.most()).collect();
            let mut content = Content::default();
            set.push(&mut content, BOX, None, SIDED, &asked).unwrap();
            assert_eq!(content.regions[0].centre, [1.0, 1.5, 2.0]);
            let values = content.pairs.as_flattened();
            for (&value, asked) in values.iter().zip(asked) {
                assert_eq!(i32::from(value) % i32::from(step), 0);
                let error = (f32::from(value) * set.scale() - asked).abs();
                assert!(error <= set.error_bound(), "{error} of {asked}");
            }
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_and_leaves_no_trace() {
    let set = set(1, 0);
    let mut content = Content::default();
    let form = Form {
        derivatives: Derivatives::Constant,
        degree: 0,
        signals: 1,
        centred: true,
    };
    set.push(&mut content, BOX, None, form, &[1.0]).unwrap();
    let before = content.clone();
    let own = Form {
        centred: false,
        ..form
    };
    let mut refused = |bounds, centre, form, coefficients: &[f32], id| {
        let pushed = set.push(&mut content, bounds, centre, form, coefficients);
        assert_eq!(pushed.map_err(|e| e.id), Err(id));
        assert_eq!(content, before);
    };
    for value in [1.0001, -1.0001, f32::NAN, f32::INFINITY, f32::MIN] {
        refused(BOX, None, form, &[value], 3405);
    }
    refused([BOX[1], BOX[0]], None, form, &[0.5], 3403);
    refused([[f32::NAN; 3], BOX[1]], None, form, &[0.5], 3403);
    refused([BOX[0], [2f32.powi(40); 3]], None, form, &[0.5], 3403);
    refused(BOX, Some([3.0; 3]), own, &[0.5], 3403);
    refused(BOX, Some([f32::NAN; 3]), own, &[0.5], 3403);
    refused(BOX, Some([1.0; 3]), form, &[0.5], 4012);
    refused(BOX, None, own, &[0.5], 4012);
    refused(BOX, None, form, &[0.5, 0.5], 4012);
    let deep = Form { degree: 3, ..form };
    refused(BOX, None, deep, &[0.5; 9], 3404);
    let narrow = RegionSet {
        signals: Signals::one(Kernel::exponential(2.0)),
        capacity: 4,
        ..set
    };
    let two = Form { signals: 2, ..form };
    let pushed = narrow.push(&mut content, BOX, None, two, &[0.5; 2]);
    assert_eq!(pushed.map_err(|e| e.id), Err(3404));
    let wide = Form { degree: 1, ..form };
    for id in [None, Some(3407)] {
        let pushed = narrow.push(&mut content, BOX, None, wide, &[0.0; 4]);
        assert_eq!(pushed.err().map(|e| e.id), id);
    }
    for pushed in [Ok(()), Err(4012)] {
        let full = RegionSet { count: 3, ..set };
        let got = full.push(&mut content, BOX, None, form, &[0.5]);
        assert_eq!(got.map_err(|e| e.id), pushed);
    }
}

#[test]
fn classes_are_predicted_where_that_is_shorter() {
    let forms = [SIDED; 3];
    let level = |mean: i16, slope: i16| {
        let mut codes = [slope; MOST_COEFFICIENTS];
        codes[..18].fill(mean);
        codes
    };
    let steady = [level(900, 40), level(905, -3), level(898, 2)];
    let regions = forms.into_iter().zip(steady.iter().map(|c| &c[..]));
    assert_eq!(follow(regions), [true, false, false]);
}
