//! What the light of a scene in motion costs to send: `packed`, and `raw` under a general compressor.

use crate::cli::progress::Progress;
use crate::codec::probes::{Coding, Probe, Volume};
use crate::codec::{Compression, Encoder, EncoderConfig, GroupStart};
use crate::measure::table::{Table, Value};
use crate::models::Source as _;
use crate::probes::server::Hysteresis;
use crate::probes::source::{Packing, Request, Source};
use crate::scene::Scene;
use crate::world::World;
use crate::{Error, Result};
use glam::Vec3;

/// Hysteresis of a light that moves, and the tolerances that `packed` is measured with.
const HYSTERESIS: f32 = 0.95;
const TOLERANCES: [f32; 3] = [0.002, 0.004, 0.008];
/// Level of zstd: the best that is not called ultra.
const LEVEL: i32 = 19;

/// Runs the server over `frames` frames of the scene from `time` on, `fps` a second, for each coding.
///
/// # Errors
/// Those of the codec, and `Invalid` for a volume that cannot be.
pub fn rates(scene: &Scene, request: &Request, time: f64, fps: f64, frames: u32) -> Result<Table> {
    let mut request = *request;
    request.server.hysteresis = Hysteresis::Fixed(HYSTERESIS);
    let steps = TOLERANCES.len() as u64 * u64::from(frames + request.warm_up);
    let bar = Progress::new("Rates", steps);
    let mut rows = Vec::new();
    for (number, tolerance) in TOLERANCES.into_iter().enumerate() {
        request.packing = Packing::packed(tolerance);
        let mut world = World::new(scene, time);
        let mut probes = Source::new(&world, &request, 0)?;
        for _ in 0..request.warm_up {
            probes.trace(&world);
            bar.step(1);
        }
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out)?;
        encoder.group(&mut out, GroupStart::Keyframes)?;
        encoder.tracks(&mut out, &[probes.track()])?;
        let mut general = General::new(probes.volume());
        for frame in 0..frames {
            world.advance(time + f64::from(frame) / fps, |_| {});
            probes.update(&world);
            bar.step(1);
            match frame {
                0 => probes.write_keyframe(&mut encoder, Compression::None, &mut out)?,
                _ => probes.write_delta(&mut encoder, Compression::None, &mut out)?,
            }
            encoder.commit(&mut out, frame.into(), None)?;
            if number == 0 {
                general.frame(&probes)?;
            }
        }
        let report = probes.statistics();
        let count = report.probes as f64;
        if number == 0 {
            for (name, bytes) in [
                ("raw, zstd", general.whole),
                ("raw, XOR, zstd", general.xor),
            ] {
                let bytes = bytes as f64 / (count * f64::from(frames - 1).max(1.0));
                rows.push(vec![
                    Value::Text(format!("{name} {LEVEL}")),
                    Value::Number(general.first as f64 / count, 2),
                    Value::Number(bytes, 2),
                    Value::Missing,
                    Value::Missing,
                ]);
            }
        }
        rows.push(vec![
            Value::Text(format!("packed, tolerance {tolerance}")),
            Value::Number(report.bytes_first as f64 / count, 2),
            Value::Number(report.bytes_per_probe_frame, 3),
            Value::number(report.irradiance_psnr, 1),
            Value::number(report.irradiance_relative_rms, 4),
        ]);
    }
    let columns = [
        "coding",
        "first frame (B/probe)",
        "then (B/probe and frame)",
        "irradiance PSNR (dB)",
        "relative rms",
    ];
    Ok(Table {
        title: format!("{}: bytes of a scene in motion", scene.name),
        columns: columns.map(String::from).to_vec(),
        rows,
        note: format!(
            "{frames} frames at {fps} a second, hysteresis {HYSTERESIS}, all probes counted, absent ones \
             too; the visibility block, which comes once, is not. Raw probes are 56 bytes; XOR is with \
             the frame before."
        ),
    })
}

/// The paper's 56 bytes under a general compressor.
struct General {
    volume: Volume,
    last: Vec<u8>,
    first: usize,
    whole: usize,
    xor: usize,
}

impl General {
    fn new(volume: &Volume) -> General {
        General {
            volume: Volume {
                coding: Coding::Raw,
                ..*volume
            },
            last: Vec::new(),
            first: 0,
            whole: 0,
            xor: 0,
        }
    }

    fn frame(&mut self, probes: &Source) -> Result<()> {
        let probes = probes.light().iter().enumerate().map(|(index, light)| {
            match probes.server().is_present(index) {
                true => self.volume.quantize(&light.map(|c: Vec3| c.to_array())),
                false => Probe::ABSENT,
            }
        });
        let bytes: Vec<u8> = probes
            .flat_map(|probe| probe.codes.into_iter().chain([0]))
            .flat_map(i16::to_le_bytes)
            .collect();
        let size = |bytes: &[u8]| {
            zstd::bulk::compress(bytes, LEVEL)
                .map(|packed| packed.len())
                .map_err(|e| Error::Invalid(format!("zstd: {e}")))
        };
        if self.last.is_empty() {
            self.first = size(&bytes)?;
        } else {
            let xor: Vec<u8> = bytes.iter().zip(&self.last).map(|(a, b)| a ^ b).collect();
            self.whole += size(&bytes)?;
            self.xor += size(&xor)?;
        }
        self.last = bytes;
        Ok(())
    }
}
