//! Any bytes as `regions` payloads, packed and raw, of tracks that the input chooses, in a stream that is
//! otherwise right: every committed state keeps the rules of `spec/regions.md`.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::regions::{Coding, RegionSet};
use dapple_codec::{ModelKind, Track};
use dapple_fuzz::payloads;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let u = &mut Unstructured::new(data);
    let _ = payloads::show(u, ModelKind::Regions, payloads);
});

/// One payload for the first track, or one for each of two.
fn payloads(u: &mut Unstructured<'_>, _: u32, tracks: &[Track]) -> Result<Vec<Vec<u8>>> {
    let both = tracks.len() > 1 && u.arbitrary()?;
    let tracks = if both { tracks } else { &tracks[..1] };
    let payload = |track: &Track| payload(u, track.id, track.region_set().expect("regions"));
    tracks.iter().map(payload).collect()
}

/// A right head; the section is the input's, often with boxes that hold.
fn payload(u: &mut Unstructured<'_>, id: u32, set: &RegionSet) -> Result<Vec<u8>> {
    let kind = u.int_in_range(0u8..=15)?;
    let mut section = Vec::new();
    if kind > 0 {
        regions(u, set, &mut section)?;
    }
    let length = u.int_in_range(0..=u.len().min(400))?;
    section.extend(u.bytes(length.min(u.len()))?);
    // Zeros that a decoder may want: the input need not hit on a length.
    section.resize(section.len() + usize::from(kind % 5), 0);
    let mut payload = Vec::new();
    let words = [1, 1, 0, 0, id, section.len() as u32, 0];
    payload.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
    payload.extend(section);
    Ok(payload)
}

/// Everything before the codes.
fn regions(u: &mut Unstructured<'_>, set: &RegionSet, section: &mut Vec<u8>) -> Result<()> {
    let mut given = Vec::new();
    for _ in 0..set.count {
        let mut corner = || -> Result<[f32; 3]> {
            let byte = u.arbitrary::<u8>()?;
            Ok([byte & 3, byte >> 2 & 3, byte >> 4].map(f32::from))
        };
        let (min, size) = (corner()?, corner()?);
        let max = std::array::from_fn(|axis| min[axis] + size[axis]);
        let (form, own): (u8, bool) = (u.arbitrary()?, u.arbitrary()?);
        let boxes = [min, max];
        section.extend(boxes.iter().flatten().flat_map(|v: &f32| v.to_le_bytes()));
        match set.coding {
            Coding::Raw => {
                let centre = if own { min } else { [0.0; 3] };
                section.extend(centre.iter().flat_map(|v| v.to_le_bytes()));
                let form = form & 0x1f | if own { 0 } else { 0x20 };
                section.extend(u32::from(form).to_le_bytes());
            }
            Coding::Packed => given.push(own.then_some(max)),
        }
    }
    for part in given.chunks(8) {
        let bits = part.iter().enumerate();
        let byte = bits.fold(0u8, |byte, (at, centre)| {
            byte | u8::from(centre.is_some()) << at
        });
        section.push(byte);
    }
    for centre in given.iter().flatten() {
        section.extend(centre.iter().flat_map(|v| v.to_le_bytes()));
    }
    Ok(())
}
