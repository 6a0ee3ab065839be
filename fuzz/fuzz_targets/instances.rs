//! Any bytes as `instances` payloads, packed and raw, of tables that the input chooses, in a stream that
//! is otherwise right: every committed state keeps the rules of `spec/instances.md`.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::instances::{Coding, Table};
use dapple_codec::{ModelKind, Track};
use dapple_fuzz::payloads;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let u = &mut Unstructured::new(data);
    let _ = payloads::show(u, ModelKind::Instances, payloads);
});

/// One payload for the first track, or one for each of two.
fn payloads(u: &mut Unstructured<'_>, _: u32, tracks: &[Track]) -> Result<Vec<Vec<u8>>> {
    let both = tracks.len() > 1 && u.arbitrary()?;
    let tracks = if both { tracks } else { &tracks[..1] };
    let payload = |track: &Track| payload(u, track.id, track.instance_table().expect("instances"));
    tracks.iter().map(payload).collect()
}

/// A right head; the section is the input's, of raw tables often with keys that ascend and of a size that
/// fits.
fn payload(u: &mut Unstructured<'_>, id: u32, table: &Table) -> Result<Vec<u8>> {
    let kind: u8 = u.int_in_range(0..=15)?;
    let mut section = Vec::new();
    let mut wanted = None;
    if kind > 0 && table.coding == Coding::Raw {
        let mut key = u64::from(u.arbitrary::<u8>()?);
        for _ in 0..table.count {
            section.extend(key.to_le_bytes());
            key = key.wrapping_add(u64::from(u.arbitrary::<u8>()?) << (4 * kind));
        }
        let mut linear = 0;
        for at in 0..table.count.div_ceil(8) {
            let left = (table.count - 8 * at).min(8);
            let forms = u.arbitrary::<u8>()? & (0xff >> (8 - left));
            linear += forms.count_ones();
            section.push(forms);
        }
        let codes = u32::from(table.signals.count) * (table.count + 3 * linear);
        wanted = Some(section.len() + 2 * codes as usize);
    }
    let length = u.int_in_range(0..=u.len().min(400))?;
    section.extend(u.bytes(length.min(u.len()))?);
    match wanted {
        Some(size) => section.resize(size, 0),
        // Zeros that a decoder may want: the input need not hit on a length.
        None => section.resize(section.len() + usize::from(kind % 5), 0),
    }
    let mut payload = Vec::new();
    let words = [1, 1, 0, 0, id, section.len() as u32, 0];
    payload.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
    payload.extend(section);
    Ok(payload)
}
