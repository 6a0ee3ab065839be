//! The codec of probes against oracles, and how contexts start.

use alloc::vec::Vec;
use std::{print, println};

#[path = "../../../tests/common/field.rs"]
mod field;

use super::f16::{f16_from_units, units_from_f16};
use super::*;
use crate::entropy::{Coder, Writer};
use crate::memory::index_set::IndexSet;
use field::{Coefficients, Field, FieldOptions, USUAL};
use packed::{Walk, code};
use values::{POWERS, Scales};

fn volume(dims: [u16; 3], coding: Coding) -> Volume {
    Volume {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims,
        spacing: [1.0; 3],
        exponent: 0,
        visibility: Visibility::default(),
        coding,
    }
}

fn draw(state: &mut u64) -> u32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 32) as u32
}

/// The nearest f16 to a number of units, by the table of all of them.
fn slow_f16(units: i64, all: &[i64]) -> u16 {
    let magnitude = units.abs();
    let above = all.partition_point(|&value| value < magnitude);
    let bits = match (above.checked_sub(1), all.get(above)) {
        (None, _) => 0,
        (Some(below), None) => below,
        (Some(below), Some(&value)) => match (magnitude - all[below]).cmp(&(value - magnitude)) {
            core::cmp::Ordering::Less => below,
            core::cmp::Ordering::Greater => above,
            core::cmp::Ordering::Equal => below + below % 2,
        },
    };
    bits as u16 | if units < 0 { 0x8000 } else { 0 }
}

#[test]
fn f16_is_the_nearest_for_every_integer_that_matters() {
    let all: Vec<i64> = (0..0x7c00).map(units_from_f16).collect();
    assert!(all.is_sorted_by(|a, b| a < b));
    assert_eq!(all[0x7bff], 65504 << 24);
    assert_eq!((all[0x3c00], all[1]), (1 << 24, 1));
    let check = |units: i64| {
        for units in [units, -units] {
            assert_eq!(f16_from_units(units), slow_f16(units, &all), "{units}");
        }
    };
    // Every f16, every middle between two, and what is beside them.
    for pair in all.windows(2) {
        for units in [pair[0], (pair[0] + pair[1]) / 2] {
            (-2..=2)
                .filter(|d| units + d >= 0)
                .for_each(|d| check(units + d));
        }
    }
    for units in [65504 << 24, 65520 << 24, 65536 << 24, 1 << 45, i64::MAX] {
        (-3..=0).for_each(|d| check(units + d));
    }
    let mut state = 1;
    for _ in 0..200_000 {
        let wide = i64::from(draw(&mut state)) << 31 | i64::from(draw(&mut state) >> 1);
        check(wide >> (draw(&mut state) % 62));
    }
    for bits in 0..=u16::MAX {
        let value = f32_from_f16(bits);
        let finite = bits & 0x7c00 != 0x7c00;
        assert_eq!(value.is_finite(), finite);
        assert_eq!(value.is_sign_negative(), bits >> 15 == 1);
        if finite && bits != 0x8000 {
            assert_eq!(f16_from_f32(value), bits);
        }
    }
    assert_eq!(f16_from_f32(f32::NAN), 0);
    assert_eq!(f16_from_f32(f32::NEG_INFINITY), 0xfbff);
}

#[test]
fn powers_are_rounded_right() {
    for (i, &power) in POWERS.iter().enumerate() {
        let exact = 2f64.powf(15.0 + i as f64 / 256.0);
        assert_eq!(f64::from(power), exact.round(), "{i}");
        // So far from a tie that no other way of computing it comes out otherwise.
        let to_tie = (exact - exact.floor() - 0.5).abs();
        assert!(i == 0 || to_tie > 1e-3, "{i}: {to_tie}");
    }
    // What the specification prints.
    let bytes: Vec<u8> = POWERS
        .iter()
        .flat_map(|power| power.to_le_bytes())
        .collect();
    let digest = twox_hash::XxHash64::oneshot(0, &bytes);
    let chapter = include_str!("../../../../spec/probes.md");
    assert!(
        chapter.contains(&std::format!("{digest:016x}")),
        "{digest:016x}"
    );
    let digest = twox_hash::XxHash64::oneshot(0, &contexts::initial_table());
    assert!(
        chapter.contains(&std::format!("{digest:016x}")),
        "{digest:016x}"
    );
}

/// Values against the same formulas in f64.
#[test]
fn values_are_those_of_the_formulas() {
    let steps = Steps {
        luma: [3, 40, 77],
        chroma: [51, 33, 129],
    };
    let volume = volume([1; 3], Coding::Packed(steps));
    let mut state = 3;
    for round in 0..20_000 {
        let mut probe = Probe {
            level: 3,
            codes: [0; CODES],
        };
        for (group, step) in GROUPS.iter().zip(steps.flat()) {
            for code in &mut probe.codes[group.start..group.end] {
                let range = (32768 / i32::from(step)) >> (round % 7);
                *code = (draw(&mut state) as i32 % (range + 1)) as i16;
            }
        }
        probe.codes[0] = (draw(&mut state) % 3414) as i16;
        let probe = probe.cut(1 + (draw(&mut state) % 3) as u8);
        let values = volume.values(&probe);
        let code = |at: usize| f64::from(probe.codes[at]);
        let y0 = match probe.codes[0] {
            0 => 0.0,
            q => 2f64.powf(f64::from(q) * 3.0 / 256.0 - 24.0),
        };
        for lm in 0..9 {
            let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][lm];
            let i = lm - degree * degree;
            let (lumas, chromas) = (GROUPS[2 * degree].start, GROUPS[2 * degree + 1].start);
            let [luma_step, chroma_step] =
                [steps.luma[degree], steps.chroma[degree]].map(f64::from);
            let y = match degree {
                0 => y0,
                _ => y0 * code(lumas + i) * luma_step / 4096.0,
            };
            let co = y0 * code(chromas + 2 * i) * chroma_step / 4096.0;
            let cg = y0 * code(chromas + 2 * i + 1) * chroma_step / 4096.0;
            for (c, exact) in [y + co - cg, y + cg, y - co - cg].into_iter().enumerate() {
                let exact = if lm == 0 { exact.max(0.0) } else { exact };
                let exact = exact.clamp(-65504.0, 65504.0);
                let got = f64::from(f32_from_f16(values[3 * lm + c]));
                // Half a step of f16, a table of 16 bits, and roundings down: that of the luma of
                // degree 0 counts eight times in each of three terms.
                let error = exact.abs() / 2048.0 + y0 * 24.0 / 65536.0 + 30.0 / 16_777_216.0;
                assert!((got - exact).abs() <= error, "{got} {exact} {y0} {lm} {c}");
            }
        }
    }
}

/// What was asked for, in luma and chroma.
fn ycocg([r, g, b]: [f32; 3]) -> [f64; 3] {
    let [r, g, b] = [r, g, b].map(f64::from);
    [
        (r + 2.0 * g + b) / 4.0,
        (r - b) / 2.0,
        (2.0 * g - r - b) / 4.0,
    ]
}

/// Errors of luma and chroma before the rounding to f16 are within half a step, or within the
/// tolerance where that is more; and codes near the base are kept.
#[test]
fn errors_of_the_quantizer_are_bounded() {
    let steps = Steps {
        luma: [6, 90, 150],
        chroma: [70, 100, 170],
    };
    let mut state = 8;
    let (mut kept, mut all) = (0, 0);
    for round in 0..4000 {
        let mut volume = volume([1; 3], Coding::Packed(steps));
        volume.exponent = [-20, 0, 3, 20][round % 4];
        let unit = |state: &mut u64| f64::from(draw(state)) / 4_294_967_296.0;
        let scale =
            2f64.powi(i32::from(volume.exponent)) * 2f64.powf(unit(&mut state) * 12.0 - 6.0);
        let mut coefficients = [[0f32; 3]; 9];
        for (lm, rgb) in coefficients.iter_mut().enumerate() {
            for value in rgb {
                let v = unit(&mut state) * scale;
                *value = if lm == 0 { v + scale } else { v - scale / 2.0 } as f32;
            }
        }
        let tolerance = if round % 3 == 0 { 0.0 } else { scale * 0.03 };
        let t = tolerance as f32;
        let each = Tolerance {
            luma: [t; 3],
            chroma: [t; 3],
        };
        let near = coefficients.map(|rgb| rgb.map(|v| v * (1.0 + 0.01 * unit(&mut state) as f32)));
        let base = volume.quantize(&near);
        let probe = volume.quantize_near(&coefficients, &base, &each);
        let tolerance = f64::from(t);
        let small = 2f64.powi(i32::from(volume.exponent) - 24);
        let y0 = values::log_luma(i32::from(probe.codes[0]) * 6) as f64 * small;
        for lm in 0..9 {
            let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][lm];
            let i = lm - degree * degree;
            let (lumas, chromas) = (GROUPS[2 * degree].start, GROUPS[2 * degree + 1].start);
            let wanted = ycocg(coefficients[lm]);
            for (k, at) in [lumas + i, chromas + 2 * i, chromas + 2 * i + 1]
                .into_iter()
                .enumerate()
            {
                let step = [
                    steps.luma[degree],
                    steps.chroma[degree],
                    steps.chroma[degree],
                ][k];
                let (got, half) = match at {
                    // Half a step of 6/256 octave above, and a table of 16 bits.
                    0 => (
                        y0,
                        wanted[0] * (2f64.powf(3.0 / 256.0) - 1.0 + 1.0 / 32768.0),
                    ),
                    _ => {
                        let scaled = i64::from(probe.codes[at]) * i64::from(step);
                        let units = values::relative((y0 / small) as i64, scaled as i32);
                        (units as f64 * small, y0 * f64::from(step) / 8192.0)
                    }
                };
                let error = (got - wanted[k]).abs();
                let bound = half.max(tolerance) * (1.0 + 1e-6) + small;
                assert!(error <= bound, "{error} {bound} {at} {round}");
                all += 1;
                kept += u32::from(probe.codes[at] == base.codes[at]);
            }
        }
    }
    assert!(kept > all / 2, "{kept} of {all}");
}

#[test]
fn odd_numbers_are_quantized_without_a_panic() {
    let steps = Steps {
        luma: [1, 1, 32768],
        chroma: [32768, 1, 7],
    };
    let odd = [
        0.0,
        -0.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-45,
        1.0,
        1e5,
    ];
    let mut state = 5;
    for round in 0..5000 {
        let coding = match round % 2 {
            0 => Coding::Raw,
            _ => Coding::Packed(steps),
        };
        let mut volume = volume([1; 3], coding);
        volume.exponent = [-64, 0, 64][round % 3];
        let mut pick = || odd[draw(&mut state) as usize % odd.len()];
        let coefficients: Coefficients = core::array::from_fn(|_| core::array::from_fn(|_| pick()));
        let each = [pick(), pick(), pick()];
        let tolerance = Tolerance {
            luma: each,
            chroma: each,
        };
        let first = volume.quantize(&coefficients);
        let second = volume.quantize_near(&coefficients, &first, &tolerance);
        for probe in [first, second] {
            match coding {
                Coding::Raw => raw::check_probe(&probe).unwrap(),
                Coding::Packed(steps) => packed::check_probe(&Scales::new(&steps), &probe).unwrap(),
            }
            assert!(
                volume
                    .values(&probe)
                    .iter()
                    .all(|bits| bits & 0x7c00 != 0x7c00)
            );
        }
    }
    // A sun of 1e5, with and without an exponent for it.
    let sun = [[1e5f32; 3]; 9];
    let mut volume = volume([1; 3], Coding::Raw);
    assert_eq!(
        f32_from_f16(volume.values(&volume.quantize(&sun))[0]),
        65504.0
    );
    volume.exponent = 4;
    let value = f32_from_f16(volume.values(&volume.quantize(&sun))[0]) * 16.0;
    assert!((value - 1e5).abs() < 64.0);
}

/// Counts the bits of each sort on their way to a writer.
struct CountingCoder<'a> {
    writer: Writer<'a>,
    counts: &'a mut [[u32; 2]; contexts::PROBE_CONTEXTS],
    bits: u64,
}

impl Coder for CountingCoder<'_> {
    fn bit(&mut self, context: usize, bit: bool) -> bool {
        self.counts[context][usize::from(bit)] += 1;
        self.bits += 1;
        self.writer.bit(context, bit)
    }

    fn bypass_bit(&mut self, bit: bool) -> bool {
        self.bits += 1;
        self.writer.bypass_bit(bit)
    }
}

struct Outcome {
    bytes: Vec<usize>,
    bits: Vec<u64>,
    psnr: (f64, f64),
}

/// Frames of a field, the first from nothing.
fn encode(
    options: FieldOptions,
    steps: Steps,
    tolerance: Tolerance,
    frames: usize,
    counts: &mut [[u32; 2]; contexts::PROBE_CONTEXTS],
) -> Outcome {
    let volume = volume(options.dims, Coding::Packed(steps));
    let mut field = Field::new(options);
    let mut base: Vec<Probe> = Vec::new();
    let mut outcome = Outcome {
        bytes: Vec::new(),
        bits: Vec::new(),
        psnr: (0.0, 0.0),
    };
    for frame in 0..frames {
        let coefficients = field.next();
        let probes: Vec<Probe> = coefficients
            .iter()
            .enumerate()
            .map(|(i, c)| match c {
                None => Probe::ABSENT,
                Some(c) if frame == 0 => volume.quantize(c),
                Some(c) => volume.quantize_near(c, &base[i], &tolerance),
            })
            .collect();
        let mut bytes = Vec::new();
        let mut initial = contexts::initial();
        let mut coder = CountingCoder {
            writer: Writer::new(&mut bytes, &mut initial),
            counts,
            bits: 0,
        };
        base.resize(probes.len(), Probe::ABSENT);
        let mut walk = Walk {
            probes: &mut base,
            present: None,
            marks: &mut alloc::vec![0; probes.len()],
            changed: &mut IndexSet::new(probes.len()).unwrap(),
        };
        let scales = Scales::new(&steps);
        code(&mut coder, &volume, &scales, Some(&probes), &mut walk).unwrap();
        outcome.bits.push(coder.bits);
        coder.writer.end();
        outcome.bytes.push(bytes.len());
        base = probes;
        if frame + 1 == frames {
            let pairs: (Vec<Coefficients>, Vec<Coefficients>) = coefficients
                .iter()
                .zip(&base)
                .filter_map(|(c, p)| Some((c.as_ref().copied()?, shown(&volume, p))))
                .unzip();
            outcome.psnr = field::psnr(&pairs.0, &pairs.1);
        }
    }
    outcome
}

fn shown(volume: &Volume, probe: &Probe) -> Coefficients {
    let values = volume.values(probe);
    core::array::from_fn(|lm| core::array::from_fn(|c| f32_from_f16(values[3 * lm + c])))
}

/// Steps, and tolerances relative to the luma of degree 0 of the brightest probe. Errors of degrees
/// 1 and 2 count for less in irradiance, by 2/3 and 1/4.
fn quality(fine: f64, near: f64, peak: f64) -> (Steps, Tolerance) {
    let s = |v: f64| (v * fine).max(1.0) as u16;
    let t = |v: f64| (v * near * peak) as f32;
    let steps = Steps {
        luma: [s(8.0), s(128.0), s(320.0)],
        chroma: [s(88.0), s(128.0), s(320.0)],
    };
    let each = [t(0.002), t(0.003), t(0.008)];
    let tolerance = Tolerance {
        luma: each,
        chroma: each,
    };
    (steps, tolerance)
}

fn peak_luma(options: FieldOptions) -> f64 {
    let mut field = Field::new(options);
    let mut lumas: Vec<f32> = field.next().iter().flatten().map(|c| c[0][1]).collect();
    lumas.sort_unstable_by(f32::total_cmp);
    f64::from(lumas[(lumas.len() - 1) * 999 / 1000])
}

/// Prints what the fields cost, and a table of starts that fits all of them.
#[test]
#[ignore = "a measurement"]
fn starts() {
    let small = FieldOptions {
        dims: [8, 8, 8],
        lamps: 2,
        seed: 9,
        ..USUAL
    };
    let mut cases = alloc::vec![
        ("usual", USUAL, 1.0, 1.0),
        ("usual, finer", USUAL, 0.5, 0.5),
        ("usual, coarser", USUAL, 2.0, 2.0),
        (
            "quiet",
            FieldOptions {
                noise: 0.03,
                seed: 2,
                ..USUAL
            },
            1.0,
            1.0
        ),
        (
            "noisy",
            FieldOptions {
                noise: 0.3,
                seed: 3,
                ..USUAL
            },
            1.0,
            1.0
        ),
        (
            "fast",
            FieldOptions {
                speed: 0.2,
                seed: 4,
                ..USUAL
            },
            1.0,
            1.0
        ),
        ("small", small, 1.0, 1.0),
        (
            "still",
            FieldOptions {
                speed: 0.0,
                noise: 0.05,
                hysteresis: 0.99,
                seed: 5,
                ..USUAL
            },
            1.0,
            1.0
        ),
    ];
    if std::env::var_os("GRID").is_some() {
        cases.clear();
        for fine in [0.5, 0.7, 1.0, 1.4] {
            for near in [0.5, 0.7, 1.0, 1.4] {
                cases.push(("usual", USUAL, fine, near));
            }
        }
    }
    let mut mean = [[0.0f64; 2]; contexts::PROBE_CONTEXTS];
    for (name, options, fine, near) in cases {
        let (steps, tolerance) = quality(fine, near, peak_luma(options));
        let mut counts = [[0; 2]; contexts::PROBE_CONTEXTS];
        let frames = 60;
        let o = encode(options, steps, tolerance, frames, &mut counts);
        let probes = options.dims.iter().map(|&d| f64::from(d)).product::<f64>();
        let steady = o.bytes[20..].iter().sum::<usize>() as f64 / (frames - 20) as f64;
        let bits = o.bits[20..].iter().sum::<u64>() as f64 / (frames - 20) as f64;
        println!(
            "{name:<16} {fine} {near} first {:6.2} B {:6.1} bins  steady {:6.3} B {:6.1} bins a probe, {:.2} dB, {:.4}",
            o.bytes[0] as f64 / probes,
            o.bits[0] as f64 / probes,
            steady / probes,
            bits / probes,
            o.psnr.0,
            o.psnr.1,
        );
        for (sum, [zeros, ones]) in mean.iter_mut().zip(counts) {
            // Each field counts alike, and what is rare counts little.
            let all = f64::from(zeros) + f64::from(ones);
            let weight = all.min(200.0) / all.max(1.0);
            sum[0] += f64::from(zeros) * weight;
            sum[1] += f64::from(ones) * weight;
        }
    }
    print!("const INITIAL: [u8; PROBE_CONTEXTS] = [");
    for (i, [zeros, ones]) in mean.iter().enumerate() {
        let p = (zeros + 1.0) / (zeros + ones + 2.0);
        let p = ((p * 256.0) as u32).clamp(4, 251);
        print!("{}{p},", if i % 16 == 0 { "\n    " } else { " " });
    }
    println!("\n];");
}
