//! Records with valid checksums, in any order, whose fields are plausible more often than not.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::{Packing, record_type};
use dapple_codec::{Decoder, ModelKind};

use crate::stream_builder::StreamBuilder;
use crate::{models, server};

/// Appends a record that fits, or nearly fits, what `decoder` has read so far.
pub fn record(
    u: &mut Unstructured<'_>,
    decoder: &Decoder,
    builder: &mut StreamBuilder,
) -> Result<()> {
    let choice = u.int_in_range(0..=15)?;
    let (record_type, mut payload) = match choice {
        _ if decoder.tick_rate().is_none() && choice != 0 => (record_type::STREAM, stream(u)?),
        0 => (record_type::STREAM, stream(u)?),
        1 | 2 => (record_type::GROUP, group(u, decoder)?),
        3 | 4 => (record_type::TRACK, tracks(u, decoder)?),
        5 => (record_type::TRACK_REMOVE, removed(u, decoder)?),
        6 => (record_type::TRANSFORMS, transforms(u, decoder)?),
        7..=10 => {
            let kind = *u.choose(&ModelKind::ALL)?;
            (kind.record_type(), models::payload(u, kind, decoder)?)
        }
        11 | 12 => (record_type::COMMIT, commit(u, decoder)?),
        13 => (record_type::END, builder.end.end_payload().to_vec()),
        _ => (
            u.int_in_range(0..=0x50)?,
            u.bytes(u.len().min(24))?.to_vec(),
        ),
    };
    // A word that is wrong.
    if u.ratio(1, 6)? && payload.len() >= 4 {
        let at = u.choose_index(payload.len() / 4)? * 4;
        let value = if u.arbitrary()? {
            u.arbitrary()?
        } else {
            u32::from(u.arbitrary::<u8>()?)
        };
        payload[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    if u.ratio(1, 20)? {
        payload.truncate(u.choose_index(payload.len() + 1)?);
    }
    let packing = match u.int_in_range(0..=4)? {
        0 => Packing::Lz4,
        1 => Packing::Zstd,
        _ => Packing::None,
    };
    let (known, odd) = (u.ratio(19, 20)?, u.arbitrary::<u8>()?);
    builder.record(record_type, &payload, packing, |header| {
        header.critical = choice < 15 || odd & 1 == 1;
        if known {
            return;
        }
        match odd >> 1 & 7 {
            0 => header.critical = !header.critical,
            1 => header.version = odd,
            2 => header.packing = odd >> 4,
            3 => {
                header.sequence = header
                    .sequence
                    .wrapping_add(u64::from(odd >> 4))
                    .wrapping_sub(7)
            }
            4 => header.unpacked_bytes = header.unpacked_bytes.wrapping_add(u32::from(odd >> 4)),
            5 => header.unpacked_bytes = u32::from(odd) << 16,
            6 => header.stored_bytes = header.stored_bytes.wrapping_add(u32::from(odd >> 4)),
            _ => header.payload_crc ^= 1,
        }
    });
    Ok(())
}

/// Appends words.
pub fn put(payload: &mut Vec<u8>, words: &[u32]) {
    payload.extend(words.iter().flat_map(|word| word.to_le_bytes()));
}

fn stream(u: &mut Unstructured<'_>) -> Result<Vec<u8>> {
    let mut payload = Vec::new();
    put(&mut payload, &[u.int_in_range(0..=60)? ^ 60, 1]);
    Ok(payload)
}

fn group(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let mut payload = Vec::new();
    let start = u.int_in_range(0..=3)? / 2;
    put(&mut payload, &[u.arbitrary::<u8>()?.into(), start]);
    let digest = if start == 1 {
        decoder.state_digest()
    } else {
        0
    };
    payload.extend(digest.to_le_bytes());
    Ok(payload)
}

fn tracks(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let mut payload = Vec::new();
    let count = u.int_in_range(0..=3)?;
    put(&mut payload, &[count, 0]);
    let declared = decoder.tracks();
    let last = declared.last();
    let mut id = last.map_or(0, |last| last.track.id.wrapping_add(1));
    if !declared.is_empty() && u.ratio(1, 4)? {
        id = declared[u.choose_index(declared.len())?].track.id;
    }
    for _ in 0..count {
        // A known one is declared again as it was, mostly.
        let known = declared
            .binary_search_by_key(&id, |track| track.track.id)
            .ok();
        let track = match known {
            Some(at) if u.ratio(7, 8)? => declared[at].track.clone(),
            _ => server::track(u, id)?,
        };
        id = id.wrapping_add(u.int_in_range(1..=3)?);
        let path = track.target.path.as_bytes();
        // Now and then more than the limit of decoded state.
        let scale = if u.ratio(1, 24)? { 4000 } else { 1 };
        let (model, coding, parameters) = models::parameters(&track.model, scale);
        let model = u32::from(model) | u32::from(coding) << 16;
        let size = 56 + parameters.len() + path.len();
        let padding = size.next_multiple_of(4) - size;
        put(&mut payload, &[(size + padding) as u32, track.id, model]);
        payload.push(track.space as u8);
        payload.push(track.target.content_hash.is_some().into());
        payload.extend((path.len() as u16).to_le_bytes());
        payload.extend(track.target.application_id.to_le_bytes());
        payload.extend(track.target.content_hash.unwrap_or(0).to_le_bytes());
        let floats = track.aabb_min.iter().chain(&track.aabb_max);
        payload.extend(floats.flat_map(|f| f.to_le_bytes()));
        payload.extend(parameters);
        payload.extend(path);
        payload.resize(payload.len() + padding, 0);
    }
    Ok(payload)
}

/// What the parameters of both models begin with.
pub fn matrix_and_dims(grid_from_mesh: &[[f32; 4]; 3], dims: [u16; 3]) -> Vec<u8> {
    let floats = grid_from_mesh.as_flattened().iter();
    let mut bytes: Vec<u8> = floats.flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend(dims.iter().flat_map(|d| d.to_le_bytes()));
    bytes.extend([0, 0]);
    bytes
}

/// Ids of some of the tracks.
pub fn some(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u32>> {
    let mut ids = Vec::new();
    for track in decoder.tracks() {
        if u.arbitrary()? {
            ids.push(track.track.id);
        }
    }
    Ok(ids)
}

fn removed(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let mut payload = Vec::new();
    put(&mut payload, &[ids.len() as u32]);
    put(&mut payload, &ids);
    Ok(payload)
}

fn transforms(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let mut payload = Vec::new();
    put(&mut payload, &[ids.len() as u32, 0]);
    for id in ids {
        put(&mut payload, &[id]);
        for _ in 0..12 {
            let value = f32::from(u.arbitrary::<i8>()?);
            payload.extend(value.to_le_bytes());
        }
    }
    Ok(payload)
}

fn commit(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let (frame, tick) = decoder.last_frame().unwrap_or((0, 0));
    let mut payload = Vec::new();
    payload.extend((tick + u64::from(u.arbitrary::<u8>()? & 3)).to_le_bytes());
    let frame = frame.saturating_add(if u.ratio(1, 30)? { 0 } else { 1 });
    // A digest that holds only where the frame changes nothing.
    let digest = u.ratio(1, 8)?;
    put(&mut payload, &[frame, digest.into()]);
    if digest {
        payload.extend(decoder.state_digest().to_le_bytes());
    }
    Ok(payload)
}
