//! A valid stream whose records are lost, damaged, doubled or cut, with `resume` and `reset` as the
//! input says: every committed state is the one that the undamaged stream has at that frame.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::Event;
use dapple_fuzz::models::Content;
use dapple_fuzz::server::Script;
use dapple_fuzz::stream_builder::record_starts;
use dapple_fuzz::viewer::{ShownTrack, Viewer};
use dapple_fuzz::{LIMITS, server};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = run(data);
});

fn run(data: &[u8]) -> Result<()> {
    // Faults come from the front, so that they stay the same while the stream changes.
    let (faults, rest) = data.split_at(data.len().min(24));
    let script = server::script(&mut Unstructured::new(rest))?;
    let mut u = Unstructured::new(faults);
    let damaged = damage(&mut u, &script.bytes)?;

    let mut viewer = Viewer::new(LIMITS);
    let mut stream = &damaged[..];
    let mut lost = false;
    let mut at = 0;
    for _ in 0..16 {
        match watch(&mut viewer, &stream[at..], &script, lost) {
            Ok(()) => {
                assert!(lost || stream != script.bytes || viewer.decoder.finish().is_ok());
                return Ok(());
            }
            Err(id) => assert!(
                stream != script.bytes || lost,
                "error {id} in a valid stream"
            ),
        }
        if u.ratio(7, 8)? && viewer.decoder.resume() {
            lost = true;
            at = viewer.decoder.position() as usize;
        } else {
            viewer.reset();
            (stream, lost, at) = (&script.bytes, false, 0);
        }
    }
    Ok(())
}

/// Pushes to the end or to an error, whose number it gives.
fn watch(
    viewer: &mut Viewer,
    mut rest: &[u8],
    script: &Script,
    lost: bool,
) -> std::result::Result<(), u16> {
    loop {
        let (consumed, seen) = viewer.push(rest).map_err(|error| error.id)?;
        rest = &rest[consumed..];
        match seen.event {
            Event::Frame(frame) => compare(&viewer.shown(), frame.number, script, lost),
            Event::NeedInput => return Ok(()),
            Event::End if rest.is_empty() => return Ok(()),
            _ => {}
        }
    }
}

/// After a loss, tracks may differ where nothing told the decoder of them: a track whose declaration
/// was lost is missing only while it is empty, and one whose removal was lost keeps what it last
/// had or is empty. Cells that no bucket names mean nothing.
fn compare(shown: &[ShownTrack], frame: u32, script: &Script, lost: bool) {
    let wanted = &script.frames[&frame];
    if !lost {
        assert_eq!(shown, wanted);
        return;
    }
    let blank = |t: &ShownTrack| {
        let empty = Content::empty(&t.track.model);
        t.transform.is_none() && t.content.reachable() == empty.reachable()
    };
    for track in wanted {
        match shown.iter().find(|t| t.track.id == track.track.id) {
            Some(t) => assert!(same(t, track), "track {}", track.track.id),
            None => assert!(blank(track), "track {} is missing", track.track.id),
        }
    }
    for track in shown {
        if wanted.iter().any(|t| t.track.id == track.track.id) {
            continue;
        }
        let mut before = script.frames.range(..frame).rev().map(|(_, tracks)| tracks);
        let last = before.find_map(|tracks| tracks.iter().find(|t| t.track.id == track.track.id));
        assert!(blank(track) || last.is_some_and(|last| same(track, last)));
    }
}

/// What a lookup can reach is the same.
fn same(a: &ShownTrack, b: &ShownTrack) -> bool {
    a.track == b.track
        && a.transform == b.transform
        && a.content.reachable() == b.content.reachable()
}

fn damage(u: &mut Unstructured<'_>, bytes: &[u8]) -> Result<Vec<u8>> {
    let starts = record_starts(bytes);
    let ends = starts.iter().skip(1).copied().chain([bytes.len()]);
    let records = starts.iter().copied().zip(ends);
    let mut records: Vec<Vec<u8>> = records
        .map(|(start, end)| bytes[start..end].to_vec())
        .collect();
    for _ in 0..u.int_in_range(0..=3)? {
        let at = u.choose_index(records.len())?;
        match u.int_in_range(0..=7)? {
            0..=2 => {
                let count = u.int_in_range(1..=4)?.min(records.len() - at);
                records.drain(at..at + count);
            }
            3 | 4 => {
                let byte = 32 + usize::from(u.arbitrary::<u16>()?);
                let record = &mut records[at];
                if byte < record.len() {
                    record[byte] ^= u.int_in_range(1..=255)?;
                }
            }
            5 => {
                let again = records[at].clone();
                records.insert(at, again);
            }
            6 => {
                let to = u.choose_index(records.len())?;
                records.swap(at, to);
            }
            _ => {
                let left = u.choose_index(records[at].len() + 1)?;
                records[at].truncate(left);
            }
        }
        if records.is_empty() {
            break;
        }
    }
    Ok([&bytes[..16], &records.concat()].concat())
}
