//! Any bytes as `probes` payloads, packed and raw, of volumes that the input chooses, in a stream that
//! is otherwise right: every committed state keeps the rules of `spec/probes.md`.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::{ModelKind, Track};
use dapple_fuzz::payloads;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let u = &mut Unstructured::new(data);
    let _ = payloads::show(u, ModelKind::Probes, payloads);
});

/// One payload for the first track, or one for each of two.
fn payloads(u: &mut Unstructured<'_>, frame: u32, tracks: &[Track]) -> Result<Vec<Vec<u8>>> {
    let both = tracks.len() > 1 && u.arbitrary()?;
    let tracks = if both { tracks } else { &tracks[..1] };
    let payload = |track: &Track| payload(u, frame, track.id, track.volume().expect("probes"));
    tracks.iter().map(payload).collect()
}

/// A right head; the section is the input's, in so many bytes as its coding may want.
fn payload(
    u: &mut Unstructured<'_>,
    frame: u32,
    id: u32,
    volume: &dapple_codec::probes::Volume,
) -> Result<Vec<u8>> {
    let kind = u.int_in_range(0..=15)?;
    let keyframe = frame == 0 || kind < 6;
    let base = if keyframe { 0 } else { frame - 1 };
    let seen = volume.visibility.side > 0 && u.arbitrary()?;
    let mut section = vec![
        kind;
        if seen {
            volume.visibility_bytes() as usize
        } else {
            0
        }
    ];
    let rest = u.len();
    let length = u.int_in_range(0..=rest.min(400))?;
    let bytes = u.bytes(length.min(u.len()))?;
    if volume.coding == dapple_codec::probes::Coding::Raw && kind > 0 {
        raw(volume.count(), bytes, &mut section);
    } else {
        section.extend(bytes);
        // Zeros that a decoder may want: the input need not hit on a length.
        section.resize(section.len() + usize::from(kind % 5), 0);
    }
    let mut payload = Vec::new();
    let words = [
        1,
        keyframe.into(),
        base,
        0,
        id,
        section.len() as u32,
        seen.into(),
    ];
    payload.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
    payload.extend(section);
    Ok(payload)
}

/// Bitmaps without spare bits, and as many probes as they say.
fn raw(count: usize, bytes: &[u8], section: &mut Vec<u8>) {
    let map = count.div_ceil(8);
    let start = section.len();
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let bit = |at: usize| at / 8 * 8 + 8 > count && at % 8 >= count - at / 8 * 8;
    for at in 0..map {
        let spare = (0..8)
            .filter(|&b| bit(8 * at + b))
            .fold(0, |m, b| m | 1 << b);
        section.push(byte(at) & !spare);
    }
    for at in 0..map {
        let changed = section[start + at];
        section.push(byte(map + at) & changed);
    }
    let present: u32 = section[start + map..].iter().map(|b| b.count_ones()).sum();
    for probe in 0..present as usize {
        for value in 0..27 {
            let at = 2 * map + 2 * (probe * 27 + value);
            // Finite now and then not; those of degree 0 seldom negative.
            let low = byte(at);
            let high = byte(at + 1);
            let high = if low & 31 == 31 { high } else { high & !0x40 };
            let high = if value < 3 && low & 32 == 0 {
                high & 0x7f
            } else {
                high
            };
            section.extend([low, high]);
        }
        section.extend([0; 2]);
    }
}
