//! The codec of probes against oracles, and how contexts start.

use alloc::vec::Vec;
use std::{print, println};

#[path = "../../tests/common/field.rs"]
mod field;

use super::*;
use crate::entropy::{Coder, Context, Reader, Writer};
use field::{Coefficients, Field, Knobs, USUAL};
use packed::code;
use values::Scales;

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

/// Counts the bits of each sort on their way to a writer.
struct Counting<'a> {
    writer: Writer<'a>,
    counts: &'a mut [[u32; 2]; contexts::CONTEXTS],
    bits: u64,
}

impl Coder for Counting<'_> {
    fn bit(&mut self, context: usize, bit: bool) -> bool {
        self.counts[context][usize::from(bit)] += 1;
        self.bits += 1;
        self.writer.bit(context, bit)
    }

    fn even_bit(&mut self, bit: bool) -> bool {
        self.bits += 1;
        self.writer.even_bit(bit)
    }
}

struct Outcome {
    bytes: Vec<usize>,
    bits: Vec<u64>,
    psnr: (f64, f64),
}

/// Frames of a field, the first from nothing.
fn encode(
    knobs: Knobs,
    steps: Steps,
    tolerance: Tolerance,
    frames: usize,
    counts: &mut [[u32; 2]; contexts::CONTEXTS],
) -> Outcome {
    let volume = volume(knobs.dims, Coding::Packed(steps));
    let mut field = Field::new(knobs);
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
        let mut coder = Counting {
            writer: Writer::new(&mut bytes, &mut initial),
            counts,
            bits: 0,
        };
        let mut written = alloc::vec![Probe::ABSENT; probes.len()];
        let mut marks = alloc::vec![0; probes.len()];
        let known = (frame > 0).then_some(&base[..]);
        code(
            &mut coder,
            &volume,
            &Scales::new(&steps),
            known,
            Some(&probes),
            &mut written,
            &mut marks,
        )
        .unwrap();
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

fn peak_luma(knobs: Knobs) -> f64 {
    let mut field = Field::new(knobs);
    let mut lumas: Vec<f32> = field.next().iter().flatten().map(|c| c[0][1]).collect();
    lumas.sort_unstable_by(f32::total_cmp);
    f64::from(lumas[(lumas.len() - 1) * 999 / 1000])
}

/// Prints what the fields cost, and a table of starts that fits all of them.
#[test]
#[ignore = "a measurement"]
fn starts() {
    let small = Knobs {
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
            Knobs {
                noise: 0.03,
                seed: 2,
                ..USUAL
            },
            1.0,
            1.0
        ),
        (
            "noisy",
            Knobs {
                noise: 0.3,
                seed: 3,
                ..USUAL
            },
            1.0,
            1.0
        ),
        (
            "fast",
            Knobs {
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
            Knobs {
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
    let mut mean = [[0.0f64; 2]; contexts::CONTEXTS];
    for (name, knobs, fine, near) in cases {
        let (steps, tolerance) = quality(fine, near, peak_luma(knobs));
        let mut counts = [[0; 2]; contexts::CONTEXTS];
        let frames = 60;
        let o = encode(knobs, steps, tolerance, frames, &mut counts);
        let probes = knobs.dims.iter().map(|&d| f64::from(d)).product::<f64>();
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
    print!("const INITIAL: [u8; CONTEXTS] = [");
    for (i, [zeros, ones]) in mean.iter().enumerate() {
        let p = (zeros + 1.0) / (zeros + ones + 2.0);
        let p = ((p * 256.0) as u32).clamp(4, 251);
        print!("{}{p},", if i % 16 == 0 { "\n    " } else { " " });
    }
    println!("\n];");
}
