//! The canonical dump (`spec/dump.md`): one text for what a stream decodes to, the same from every
//! decoder, whatever cells it keeps content in.

use std::fmt::Write as _;

use dapple_codec::{Decoder, Event, GroupStart, LookupSpace, TrackState};

use crate::models;
use crate::text::{floats, quoted};

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

fn track(decoder: &Decoder, live: &TrackState, out: &mut String) {
    let track = &live.track;
    let space = match track.space {
        LookupSpace::Mesh => "mesh",
        LookupSpace::Rest => "rest",
    };
    let of_model = models::of(&track.model);
    let [model, coding] = of_model.names();
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
    of_model.dump_parameters(track.id, out);
    if let Some(transform) = &live.transform {
        let _ = write!(out, "transform {}", track.id);
        floats(transform.world_from_grid.as_flattened(), out);
        out.push('\n');
    }
    of_model.dump_content(decoder, live, out);
}
