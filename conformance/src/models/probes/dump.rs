//! Lines of `probes` in dumps (`spec/dump.md`).

use std::fmt::Write as _;
use std::hash::Hasher as _;

use dapple_codec::TrackState;
use dapple_codec::probes::{CODES, Coding, State, Steps, Volume};
use twox_hash::XxHash64;

use crate::text::{commas, floats};

/// The line of the parameters.
pub fn parameters(id: u32, volume: &Volume, out: &mut String) {
    let [dx, dy, dz] = volume.dims;
    let (exponent, side) = (volume.exponent, volume.visibility.side);
    let _ = write!(out, "volume {id} {dx} {dy} {dz} {exponent} {side} ");
    let steps = match volume.coding {
        Coding::Raw => [0; 6],
        Coding::Packed(Steps {
            luma: [y0, y1, y2],
            chroma: [c0, c1, c2],
        }) => [y0, c0, y1, c1, y2, c2],
    };
    let [t0, t1] = volume.visibility.steps;
    let _ = write!(out, "{t0},{t1} ");
    commas(steps, out, |step, out| write!(out, "{step}"));
    floats(&volume.spacing, out);
    floats(&[volume.visibility.range], out);
    floats(volume.grid_from_mesh.as_flattened(), out);
    out.push('\n');
}

/// Each present probe with its codes, and digests of what a client sees.
pub fn probes(state: &State, live: &TrackState, volume: &Volume, out: &mut String) {
    let id = live.track.id;
    for (index, probe) in state.probes_of(live).iter().enumerate() {
        if probe.level == 0 {
            continue;
        }
        let _ = write!(out, "probe {id} {index} {} ", probe.level);
        let codes = probe.codes.map(|code| code as u16);
        commas(codes, out, |code, out| write!(out, "{code:04x}"));
        out.push('\n');
    }
    let texels = state.texels_of(live);
    let count = volume.count();
    let mut digest = XxHash64::with_seed(0);
    for index in 0..count {
        for value in 0..CODES {
            let texel = texels[value / 4 * count + index];
            digest.write(&texel[value % 4].to_le_bytes());
        }
    }
    let _ = writeln!(out, "values {id} {:016x}", digest.finish());
    if let Some(bytes) = state.visibility_of(live) {
        let digest = XxHash64::oneshot(0, bytes);
        let _ = writeln!(out, "visibility {id} {digest:016x}");
    }
}
