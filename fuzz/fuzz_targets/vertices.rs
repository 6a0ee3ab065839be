//! Any bytes as `vertices` payloads, packed and raw, of tracks that the input chooses, in a stream that is
//! otherwise right: every committed state keeps the rules of `spec/vertices.md`.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::vertices::{Coding, Vertices};
use dapple_codec::{ModelKind, Track};
use dapple_fuzz::payloads;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let u = &mut Unstructured::new(data);
    let _ = payloads::show(u, ModelKind::Vertices, payloads);
});

/// One payload for the first track, or one for each of two.
fn payloads(u: &mut Unstructured<'_>, _: u32, tracks: &[Track]) -> Result<Vec<Vec<u8>>> {
    let both = tracks.len() > 1 && u.arbitrary()?;
    let tracks = if both { tracks } else { &tracks[..1] };
    let payload = |track: &Track| payload(u, track.id, track.vertices().expect("vertices"));
    tracks.iter().map(payload).collect()
}

/// A right head; the section is the input's, most often of the size that it must have.
fn payload(u: &mut Unstructured<'_>, id: u32, vertices: &Vertices) -> Result<Vec<u8>> {
    let kind = u.int_in_range(0..=15)?;
    let five = vertices.bits == 5;
    let right = match (vertices.coding, five) {
        (Coding::Raw, true) => (5 * vertices.values()).div_ceil(8),
        _ => vertices.values(),
    };
    let size = match kind {
        0 => u.int_in_range(0..=2 * right)?,
        _ => right,
    };
    let mut section = u.bytes(size.min(u.len()))?.to_vec();
    section.resize(size, 0);
    match vertices.coding {
        Coding::Packed if five && kind < 12 => section.iter_mut().for_each(|d| *d &= 31),
        Coding::Raw if five && kind < 12 => {
            let used = 5 * vertices.values() % 8;
            if let Some(last) = section.last_mut().filter(|_| used > 0) {
                *last &= (1 << used) - 1;
            }
        }
        _ => {}
    }
    let mut payload = Vec::new();
    let words = [1, 1, 0, 0, id, section.len() as u32, u32::from(kind == 1)];
    payload.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
    payload.extend(section);
    Ok(payload)
}
