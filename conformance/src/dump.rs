//! The canonical dump (`spec/dump.md`): one text for what a stream decodes to, the same from every
//! decoder, whatever cells it keeps content in.

use std::fmt::Write as _;
use std::hash::Hasher as _;

use dapple_codec::points::{EMPTY, Grid, State};
use dapple_codec::probes::{self, CODES, Coding, Steps, Volume};
use dapple_codec::{Decoder, Event, GroupStart, LiveTrack, LookupSpace, Model};
use twox_hash::XxHash64;

/// The first line.
pub const HEAD: &str = "dapple-dump 1\n";

/// Appends what an event adds to the dump; most add nothing or a line, a frame all committed
/// content.
pub fn event(decoder: &Decoder, event: Event, out: &mut String) {
    // Writing to a String does not fail.
    let _ = match event {
        Event::Stream(rate) => writeln!(out, "stream {} {}", rate.numerator, rate.denominator),
        Event::Group { id, start } => match start {
            GroupStart::Keyframes => writeln!(out, "group {id} keyframes"),
            GroupStart::State(digest) => writeln!(out, "group {id} state {digest:016x}"),
        },
        Event::Frame(frame) => {
            let digest = decoder.state_digest();
            let written = writeln!(out, "frame {} {} {digest:016x}", frame.number, frame.tick);
            for live in decoder.tracks() {
                track(decoder, live, out);
            }
            written
        }
        Event::End => writeln!(out, "end"),
        _ => Ok(()),
    };
}

fn track(decoder: &Decoder, live: &LiveTrack, out: &mut String) {
    let track = &live.track;
    let space = match track.space {
        LookupSpace::Mesh => "mesh",
        LookupSpace::Rest => "rest",
    };
    let (model, coding) = match &track.model {
        Model::Points(_) => ("points", "cells"),
        Model::Probes(volume) => match volume.coding {
            Coding::Raw => ("probes", "raw"),
            Coding::Packed(_) => ("probes", "packed"),
        },
        _ => ("unknown", "unknown"),
    };
    let target = &track.target;
    let _ = write!(
        out,
        "track {} {model} {coding} {space} {:016x} ",
        track.id, target.application_id
    );
    match target.content_hash {
        Some(hash) => {
            let _ = write!(out, "{hash:016x}");
        }
        None => out.push('-'),
    }
    floats(&track.aabb_min, out);
    floats(&track.aabb_max, out);
    out.push(' ');
    quoted(&target.path, out);
    out.push('\n');
    match &track.model {
        Model::Points(grid) => parameters_of_points(track.id, grid, out),
        Model::Probes(volume) => parameters_of_probes(track.id, volume, out),
        _ => {}
    }
    if let Some(transform) = &live.transform {
        let _ = write!(out, "transform {}", track.id);
        floats(transform.world_from_grid.as_flattened(), out);
        out.push('\n');
    }
    match &track.model {
        Model::Points(grid) => buckets(decoder.points(), live, grid, out),
        Model::Probes(volume) => probes(decoder.probes(), live, volume, out),
        _ => {}
    }
}

fn parameters_of_points(id: u32, grid: &Grid, out: &mut String) {
    let [dx, dy, dz] = grid.dims;
    let widths = grid.widths;
    let _ = write!(
        out,
        "grid {id} {dx} {dy} {dz} {} {} {},{},{}",
        grid.bucket_count, grid.cell_capacity, widths.position, widths.normal, widths.ao
    );
    floats(&[grid.cell_edge, grid.radius], out);
    floats(grid.grid_from_mesh.as_flattened(), out);
    out.push('\n');
}

fn parameters_of_probes(id: u32, volume: &Volume, out: &mut String) {
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
    commas(steps, out, |step, out| write!(out, "{step}"));
    floats(&volume.spacing, out);
    floats(&[volume.visibility.range], out);
    floats(volume.grid_from_mesh.as_flattened(), out);
    out.push('\n');
}

/// Each present probe with its codes, and digests of what a client sees.
fn probes(state: &probes::State, live: &LiveTrack, volume: &Volume, out: &mut String) {
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

/// Items with commas between.
fn commas<T>(
    items: impl IntoIterator<Item = T>,
    out: &mut String,
    write: impl Fn(T, &mut String) -> std::fmt::Result,
) {
    for (at, item) in items.into_iter().enumerate() {
        if at > 0 {
            out.push(',');
        }
        let _ = write(item, out);
    }
}

/// Each bucket that names a cell, with the cells in its order.
fn buckets(state: &State, live: &LiveTrack, grid: &Grid, out: &mut String) {
    let digits = grid.widths.bits() as usize / 4;
    for (index, bucket) in state.buckets_of(live).iter().enumerate() {
        if bucket.0[0] == EMPTY {
            continue;
        }
        let _ = write!(out, "bucket {} {index}", live.track.id);
        for cell in state.cells_in(live, bucket) {
            let _ = write!(out, " {}:", cell.key);
            let used = cell.points.iter().take_while(|&&point| point != 0);
            for (slot, point) in used.enumerate() {
                let comma = if slot > 0 { "," } else { "" };
                let _ = write!(out, "{comma}{point:0digits$x}");
            }
        }
        out.push('\n');
    }
}

fn floats(values: &[f32], out: &mut String) {
    for value in values {
        let _ = write!(out, " {:08x}", value.to_bits());
    }
}

fn quoted(text: &str, out: &mut String) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\0'..='\x1f' | '\x7f' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            _ => out.push(c),
        }
    }
    out.push('"');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_what_would_break_a_line() {
        let mut out = String::new();
        quoted("a\"b\\c\nd\u{7f}é\u{85}", &mut out);
        assert_eq!(out, "\"a\\\"b\\\\c\\u000ad\\u007fé\u{85}\"");
    }
}
