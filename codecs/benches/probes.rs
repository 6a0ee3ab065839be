//! The model `probes`: bytes a probe and frame, and time to decode on one core, of 1,024 probes in a
//! made-up light field (`tests/common/field.rs`: three lamps that move, noise of a path tracer,
//! hysteresis 0.95): `cargo bench -p dapple-codec --bench probes`.
//!
//! Rows stand for the same frames: `raw`, and `packed` in several qualities. `zstd` is level 19 of
//! the raw record, `xor` of the raw record after an XOR with the frame before. Decoding is from the
//! stream to texels with CRC and commit. PSNR is of irradiance, against the field, in the last frame.

#[path = "../tests/common/field.rs"]
mod field;

use std::time::Instant;

use dapple_codec::probes::*;
use dapple_codec::*;
use field::{Coefficients, Field, USUAL};

const FRAMES: usize = 90;
/// Frames after the first that are not counted.
const SETTLING: usize = 30;
const ROUNDS: usize = 20;

struct Case {
    name: &'static str,
    coding: Coding,
    tolerance: Tolerance,
}

fn track(coding: Coding) -> Track {
    Track {
        id: 0,
        target: Target::default(),
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Probes(Volume {
            grid_from_mesh: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            dims: USUAL.dims,
            spacing: [1.0; 3],
            exponent: 0,
            visibility: Visibility::default(),
            coding,
        }),
    }
}

/// Steps for a quality, and tolerances relative to a luma: errors of degrees 1 and 2 count for less
/// in irradiance, by 2/3 and 1/4.
fn quality(name: &'static str, fine: f64, near: f64, peak: f64) -> Case {
    let s = |v: f64| (v * fine) as u16;
    let t = |v: f64| (v * near * peak) as f32;
    let each = [t(0.002), t(0.003), t(0.008)];
    Case {
        name,
        coding: Coding::Packed(Steps {
            luma: [s(8.0), s(128.0), s(320.0)],
            chroma: [s(88.0), s(128.0), s(320.0)],
        }),
        tolerance: Tolerance {
            luma: each,
            chroma: each,
        },
    }
}

fn shown(volume: &Volume, probe: &Probe) -> Coefficients {
    let values = volume.values(probe);
    std::array::from_fn(|lm| std::array::from_fn(|c| f32_from_f16(values[3 * lm + c])))
}

/// The 56 bytes of each probe.
fn raw_bytes(probes: &[Probe]) -> Vec<u8> {
    let bytes = probes.iter().flat_map(|probe| {
        let codes = probe.codes.into_iter().chain([0]);
        codes.flat_map(i16::to_le_bytes)
    });
    bytes.collect()
}

fn best(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

fn run(case: &Case) -> Result<()> {
    let track = track(case.coding);
    let Model::Probes(volume) = track.model else {
        return Ok(());
    };
    let count = volume.count();
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out)?;
    encoder.group(&mut out, GroupStart::Keyframes)?;
    encoder.tracks(&mut out, &[track])?;
    let mut starts = vec![out.len()];
    let mut field = Field::new(USUAL);
    let mut base: Vec<Probe> = vec![Probe::ABSENT; count];
    let (mut zstd_bytes, mut xor_bytes) = (Vec::new(), Vec::new());
    let mut encode = Vec::new();
    let mut quality = (0.0, 0.0);
    for frame in 0..FRAMES {
        let coefficients = field.next();
        let start = Instant::now();
        let quantize = |(c, base): (&Option<Coefficients>, &Probe)| match c {
            None => Probe::ABSENT,
            Some(c) => volume.quantize_near(c, base, &case.tolerance),
        };
        let probes: Vec<Probe> = coefficients.iter().zip(&base).map(quantize).collect();
        let update = Update {
            track: 0,
            base: &base,
            probes: &probes,
            visibility: None,
        };
        let coverage = match frame {
            0 => Coverage::Keyframe,
            _ => Coverage::Delta,
        };
        encoder.probes(&mut out, coverage, &[update], Compression::None)?;
        encoder.commit(&mut out, frame as u64, None)?;
        encode.push(start.elapsed().as_secs_f64());
        starts.push(out.len());
        if case.coding == Coding::Raw {
            let (now, before) = (raw_bytes(&probes), raw_bytes(&base));
            let xor: Vec<u8> = now.iter().zip(&before).map(|(a, b)| a ^ b).collect();
            let packed = |bytes: &[u8]| zstd::bulk::compress(bytes, 19).map_or(0, |b| b.len());
            zstd_bytes.push(packed(&now));
            xor_bytes.push(packed(&xor));
        }
        base = probes;
        if frame + 1 == FRAMES {
            let there = coefficients.iter().zip(&base);
            let (wanted, got): (Vec<_>, Vec<_>) = there
                .filter_map(|(c, p)| Some(((*c)?, shown(&volume, p))))
                .unzip();
            quality = field::psnr(&wanted, &got);
        }
    }

    let mut decoder = Decoder::new(Limits::default());
    let mut times = vec![Vec::new(); FRAMES];
    for _ in 0..ROUNDS {
        decoder.reset();
        decoder.push_all(&out[..starts[0]], |_, _| {})?;
        for (pair, times) in starts.windows(2).zip(&mut times) {
            let start = Instant::now();
            decoder.push_all(&out[pair[0]..pair[1]], |_, _| {})?;
            times.push(start.elapsed().as_secs_f64());
            decoder.clear_dirty();
        }
    }
    let track = &decoder.tracks()[0];
    assert_eq!(decoder.probes().probes_of(track), base);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let later = SETTLING..FRAMES;
    let times: Vec<f64> = times.iter().map(|times| best(times) * 1e3).collect();
    let bytes: Vec<f64> = starts
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) as f64 / count as f64)
        .collect();
    println!(
        "{:<18} {:>8.2} {:>8.3} {:>9.3} {:>9.3} {:>9.3} {:>8.2} {:>8.4}",
        case.name,
        bytes[0],
        mean(&bytes[later.clone()]),
        times[0],
        mean(&times[later.clone()]),
        mean(&encode[later.clone()]) * 1e3,
        quality.0,
        quality.1,
    );
    if case.coding == Coding::Raw {
        for (name, bytes) in [("raw, zstd", zstd_bytes), ("raw, xor, zstd", xor_bytes)] {
            let bytes: Vec<f64> = bytes.iter().map(|&b| b as f64 / count as f64).collect();
            println!(
                "{name:<18} {:>8.2} {:>8.3}",
                bytes[0],
                mean(&bytes[later.clone()])
            );
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut lumas: Vec<f32> = Field::new(USUAL)
        .next()
        .iter()
        .flatten()
        .map(|c| c[0][1])
        .collect();
    lumas.sort_unstable_by(f32::total_cmp);
    let peak = f64::from(lumas[(lumas.len() - 1) * 999 / 1000]);
    println!(
        "{:<18} {:>8} {:>8} {:>9} {:>9} {:>9} {:>8} {:>8}\n{:<18} {:>8} {:>8} {:>9} {:>9} {:>9} {:>8} {:>8}",
        "1,024 probes",
        "first",
        "steady",
        "first",
        "steady",
        "encode",
        "PSNR",
        "rms",
        "",
        "B/probe",
        "B/probe",
        "ms",
        "ms",
        "ms",
        "dB",
        "rel."
    );
    for case in [
        Case {
            name: "raw",
            coding: Coding::Raw,
            tolerance: Tolerance::default(),
        },
        quality("packed, finest", 0.5, 0.5, peak),
        quality("packed, finer", 1.0, 1.0, peak),
        quality("packed", 1.4, 1.0, peak),
        quality("packed, coarser", 2.0, 2.0, peak),
    ] {
        run(&case)?;
    }
    Ok(())
}
