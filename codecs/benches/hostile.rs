//! Time of frames that cost a decoder as much as they can for their bytes, and the seconds that 1 MB
//! of them costs under default limits:
//! `cargo bench -p dapple-codec --bench hostile`.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/volumes.rs"]
mod volumes;

#[allow(unused_imports)]
use common::Random;
use std::time::Instant;

use dapple_codec::probes::{Coding, Probe};
use dapple_codec::*;

/// Frames of a stream after the first.
const FRAMES: u64 = 60;

/// Bytes of a stream that the seconds are for.
const BYTES: u64 = 1_000_000;

/// Probes of a volume that takes nearly all of the default `state_bytes`.
const DIMS: [u16; 3] = [142; 3];

/// A stream over one volume and the bytes of its first frame; `frame` appends the records of one.
fn stream(
    mut frame: impl FnMut(&mut Encoder, &mut volumes::VolumeFixture, u64, &mut Vec<u8>) -> Result<()>,
) -> (Vec<u8>, usize) {
    let volume = volumes::volume(DIMS, 0, Coding::Packed(volumes::STEPS));
    let mut fixture = volumes::VolumeFixture::new(1, volume);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).expect("a stream");
    encoder
        .group(&mut out, GroupStart::Keyframes)
        .expect("a group");
    encoder
        .tracks(&mut out, std::slice::from_ref(&fixture.track))
        .expect("a track");
    let (mut number, mut first) = (0, 0);
    loop {
        let before = out.len();
        let written = frame(&mut encoder, &mut fixture, number, &mut out);
        if written.is_err() || number > FRAMES {
            out.truncate(before);
            return (out, first);
        }
        fixture.base.clone_from(&fixture.probes);
        if number == 0 {
            first = out.len();
        }
        number += 1;
    }
}

/// Lets one probe come and go.
fn toggle(fixture: &mut volumes::VolumeFixture, number: u64) {
    fixture.probes[1_400_000] = match number % 2 {
        0 => Probe {
            level: 1,
            codes: std::array::from_fn(|code| if code == 0 { 200 } else { 0 }),
        },
        _ => Probe::ABSENT,
    };
}

fn send(
    encoder: &mut Encoder,
    fixture: &volumes::VolumeFixture,
    coverage: Coverage,
    number: u64,
    out: &mut Vec<u8>,
) -> Result<()> {
    encoder.probes(out, coverage, &[fixture.update()], Compression::None)?;
    encoder.commit(out, number, None)?;
    Ok(())
}

fn main() {
    let first = |number| match number {
        0 => Coverage::Keyframe,
        _ => Coverage::Delta,
    };
    let streams = [
        (
            "a probe comes and goes",
            stream(|encoder, fixture, number, out| {
                toggle(fixture, number);
                send(encoder, fixture, first(number), number, out)
            }),
        ),
        (
            "the same, with a digest for each frame",
            stream(|encoder, fixture, number, out| {
                toggle(fixture, number);
                send(encoder, fixture, first(number), number, out)?;
                let digest = encoder.state_digest();
                encoder.group(out, GroupStart::State(digest))
            }),
        ),
        (
            "a keyframe in each frame",
            stream(|encoder, fixture, number, out| {
                if number > 0 {
                    encoder.group(out, GroupStart::Keyframes)?;
                    encoder.tracks(out, std::slice::from_ref(&fixture.track))?;
                }
                toggle(fixture, number);
                send(encoder, fixture, Coverage::Keyframe, number, out)
            }),
        ),
    ];
    for (name, (bytes, first)) in &streams {
        let mut decoder = Decoder::new(Limits::default());
        let mut feed = |bytes: &[u8]| {
            let start = Instant::now();
            if let Err(error) = decoder.push_all(bytes, |_, _| {}) {
                panic!("{name}: {error}");
            }
            (start.elapsed().as_secs_f64(), decoder.work() as f64)
        };
        let (start_up, before) = feed(&bytes[..*first]);
        let (seconds, work) = feed(&bytes[*first..]);
        // As many as 1 MB holds, or as the limit of work lets pass.
        let limits = Limits::default();
        let most = (limits.state_bytes / 2 + u64::from(limits.work_per_byte) * BYTES) as f64;
        let size = (bytes.len() - first) as f64 / FRAMES as f64;
        let frames = (BYTES as f64 / size).min((most - before) / ((work - before) / FRAMES as f64));
        println!(
            "{name}: {size:.0} bytes, {:.3} ms a frame; 1 MB: {frames:.0} frames, {:.1} s",
            seconds / FRAMES as f64 * 1e3,
            start_up + frames * seconds / FRAMES as f64,
        );
    }
}
