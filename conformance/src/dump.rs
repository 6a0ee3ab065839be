//! The canonical dump (`spec/dump.md`): one text for what a stream decodes to, the same from every
//! decoder, whatever cells it keeps content in.

use std::fmt::Write as _;

use dapple_codec::points::{EMPTY, Grid, State};
use dapple_codec::{Decoder, Event, GroupStart, LiveTrack, LookupSpace, Model};

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
    if let Model::Points(grid) = &track.model {
        parameters_of_points(track.id, grid, out);
    }
    if let Some(transform) = &live.transform {
        let _ = write!(out, "transform {}", track.id);
        floats(transform.world_from_grid.as_flattened(), out);
        out.push('\n');
    }
    if let Model::Points(grid) = &track.model {
        buckets(decoder.points(), live, grid, out);
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
