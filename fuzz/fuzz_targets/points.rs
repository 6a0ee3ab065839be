//! Any bytes as `points` payloads of tracks that the input chooses, in a stream that is otherwise
//! right: every committed state keeps the rules of `spec/points.md` §5.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::{ModelKind, Track};
use dapple_fuzz::payloads;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let u = &mut Unstructured::new(data);
    let _ = payloads::show(u, ModelKind::Points, payloads);
});

/// One or two payloads for a track each.
fn payloads(u: &mut Unstructured<'_>, frame: u32, tracks: &[Track]) -> Result<Vec<Vec<u8>>> {
    let mut payloads = Vec::new();
    for _ in 0..u.int_in_range(1..=2)? {
        let rest = u.len();
        let bytes = u.int_in_range(0..=rest.min(600))?;
        let raw = u.bytes(bytes.min(u.len()))?;
        let mut payload = Vec::new();
        match u.int_in_range(0..=7)? {
            0 => payload.extend(raw),
            kind => {
                // A right head; the sections are the input's.
                let keyframe = frame == 0 || kind < 4;
                let base = if keyframe { 0 } else { frame - 1 };
                let (buckets, cells) = (u.int_in_range(0..=3u32)?, u.int_in_range(0..=3u32)?);
                let id = u.int_in_range(1..=tracks.len() as u32)?;
                for word in [1, keyframe.into(), base, 0, id, buckets, cells] {
                    payload.extend(word.to_le_bytes());
                }
                let size = tracks[id as usize - 1]
                    .grid()
                    .expect("points")
                    .widths
                    .bits()
                    / 8;
                let wanted = (36 * buckets + 8 * cells + 7 * size * cells).next_multiple_of(4);
                payload.extend(raw);
                payload.resize(28 + wanted as usize, 0);
            }
        }
        payloads.push(payload);
    }
    Ok(payloads)
}
