//! Prints what smaller textures cost in accuracy, for each volume of a stream as of its last frame:
//!
//! ```sh
//! dapple encode hall --model probes --frames 1 -o hall.dapple
//! cargo run --no-default-features --example pack_probes -- hall.dapple
//! ```
//!
//! Errors are of irradiance over all directions at one place, rms over rms, against the format's own values in f32:
//! what half of the places have at most, and 95 % of them. "At probes" is what packing costs, "between" is what a
//! texture unit's filter makes of it at the middle of each eight probes.

use std::error::Error;

use dapple::probes::client::ProbesVolume;
use dapple::probes::fidelity::Fidelity;
use dapple::probes::pack::{self, Packed};
use dapple::probes::sample::trilinear;
use dapple::probes::sh::L2;
use dapple_codec::{Decoder, Limits, decode_all};
use glam::{UVec3, Vec3};

/// What a way of packing makes of the probes, and of a place between them.
struct Way<'a> {
    name: &'static str,
    bytes: usize,
    at_probe: Box<dyn Fn(usize) -> L2 + 'a>,
    between: Box<dyn Fn(Vec3) -> L2 + 'a>,
}

/// Degree 0 and 1 alone.
fn without_degree_2(mut expansion: L2) -> L2 {
    expansion[4..].fill(Vec3::ZERO);
    expansion
}

/// Values of degree 1 and 2 as ratios to degree 0 in 8 bits, which the filter takes means of apart from degree 0.
fn by_ratio(volume: &ProbesVolume, probes: &[(usize, f32)]) -> L2 {
    let mut sums = L2::default();
    for &(probe, weight) in probes {
        let expansion = &volume.radiance()[probe];
        let light = expansion[0].max(Vec3::splat(f32::MIN_POSITIVE));
        sums[0] += expansion[0] * weight;
        for (lm, sum) in sums.iter_mut().enumerate().skip(1) {
            let ratio = (expansion[lm] / light / pack::SHIFTS[lm]).clamp(Vec3::NEG_ONE, Vec3::ONE);
            *sum += (ratio * 127.0).round() / 127.0 * weight;
        }
    }
    let light = sums[0];
    for (value, shift) in sums[1..].iter_mut().zip(&pack::SHIFTS[1..]) {
        *value *= light * *shift;
    }
    sums
}

fn report(volume: &ProbesVolume) {
    let (lattice, field) = (volume.lattice, volume.field());
    let packed = Packed::new(volume.radiance(), volume.scale());
    let (packed, scale) = (&packed, volume.scale());
    let ways = [
        Way {
            name: "seven `rgba16float`",
            bytes: 56,
            at_probe: Box::new(|p| volume.radiance()[p]),
            between: Box::new(|x| trilinear(&field, x)),
        },
        Way {
            name: "nine `rgb9e5ufloat`",
            bytes: pack::BYTES,
            at_probe: Box::new(|p| packed.expansion(p, scale)),
            between: Box::new(|x| packed.trilinear(&lattice, x, scale)),
        },
        Way {
            name: "four of them, without degree 2",
            bytes: 16,
            at_probe: Box::new(|p| without_degree_2(packed.expansion(p, scale))),
            between: Box::new(|x| without_degree_2(packed.trilinear(&lattice, x, scale))),
        },
        Way {
            name: "`rgb9e5ufloat` and six `rgba8snorm` of ratios",
            bytes: 28,
            at_probe: Box::new(|p| by_ratio(volume, &[(p, 1.0)])),
            between: Box::new(|x| {
                by_ratio(volume, &lattice.corners(x).map(|c| (c.probe, c.weight)))
            }),
        },
    ];
    let last = UVec3::from(lattice.dims.map(u32::from)) - 1;
    println!("| textures | bytes a probe | at probes | between |");
    println!("| --- | --- | --- | --- |");
    for way in &ways {
        let (mut at_probes, mut between) = (Vec::new(), Vec::new());
        for p in (0..lattice.count()).filter(|p| volume.present[*p]) {
            at_probes.extend(error(&volume.radiance()[p], &(way.at_probe)(p)));
            if lattice.place(p).cmplt(last).all() {
                let x = lattice.position(p) + 0.5 * lattice.spacing;
                between.extend(error(&trilinear(&field, x), &(way.between)(x)));
            }
        }
        let (name, bytes) = (way.name, way.bytes);
        let (at_probes, between) = (shares(at_probes), shares(between));
        println!("| {name} | {bytes} | {at_probes} | {between} |");
    }
}

/// Rms error of irradiance over its rms at one place; `None` where there is no light.
fn error(exact: &L2, got: &L2) -> Option<f64> {
    let mut fidelity = Fidelity::default();
    fidelity.add(exact, got);
    fidelity.relative_rms()
}

/// The error that half of the places have at most, and 95 % of them.
fn shares(mut errors: Vec<f64>) -> String {
    errors.sort_by(f64::total_cmp);
    let share = |of: f64| {
        let at = (errors.len() as f64 * of) as usize;
        errors.get(at.min(errors.len().saturating_sub(1)))
    };
    match (share(0.5), share(0.95)) {
        (Some(half), Some(most)) => format!("{:.2} %, {:.2} %", 100.0 * half, 100.0 * most),
        _ => "no light".to_owned(),
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let stream = std::env::args().nth(1).ok_or("usage: pack_probes STREAM")?;
    let mut volumes = Vec::new();
    let keep = |decoder: &mut Decoder, _| {
        let tracks = decoder.tracks().iter();
        let of = |live| Some(ProbesVolume::new(decoder, live)?.into_owned());
        volumes = tracks.filter_map(of).collect();
    };
    decode_all(&std::fs::read(&stream)?, Limits::default(), keep)?;
    if volumes.is_empty() {
        return Err(format!("{stream}: has no track of probes").into());
    }
    for volume in &volumes {
        let [x, y, z] = volume.lattice.dims;
        println!("{x}x{y}x{z} probes\n");
        report(volume);
    }
    Ok(())
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            std::process::ExitCode::FAILURE
        }
    }
}
