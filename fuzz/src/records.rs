//! Records with valid checksums, in any order, whose fields are plausible more often than not.

use std::collections::{BTreeMap, BTreeSet};

use arbitrary::{Result, Unstructured};
use dapple_codec::container::{HEADER_BYTES, Packing, record_type};
use dapple_codec::points::{Bucket, CELL_POINTS, Cell, Coverage, EMPTY, Grid, PointWidths};
use dapple_codec::probes::{Coding, Probe, Update, Volume};
use dapple_codec::{Compression, Decoder, Encoder, EncoderConfig, GroupStart, Model};

use crate::stream_builder::StreamBuilder;
use crate::{server, volumes};

/// Appends a record that fits, or nearly fits, what `decoder` has seen so far.
pub fn record(u: &mut Unstructured<'_>, decoder: &Decoder, builder: &mut StreamBuilder) -> Result<()> {
    let choice = u.int_in_range(0..=15)?;
    let (record_type, mut payload) = match choice {
        _ if decoder.tick_rate().is_none() && choice != 0 => (record_type::STREAM, stream(u)?),
        0 => (record_type::STREAM, stream(u)?),
        1 | 2 => (record_type::GROUP, group(u, decoder)?),
        3 | 4 => (record_type::TRACK, tracks(u, decoder)?),
        5 => (record_type::TRACK_REMOVE, removed(u, decoder)?),
        6 => (record_type::TRANSFORMS, transforms(u, decoder)?),
        7 | 8 => (record_type::POINTS, points(u, decoder)?),
        9 | 10 => (record_type::PROBES, probes(u, decoder)?),
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

fn put(payload: &mut Vec<u8>, words: &[u32]) {
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
    let live = decoder.tracks();
    let mut id = live.last().map_or(0, |live| live.track.id.wrapping_add(1));
    if !live.is_empty() && u.ratio(1, 4)? {
        id = live[u.choose_index(live.len())?].track.id;
    }
    for _ in 0..count {
        // A live one is declared again as it was, mostly.
        let known = live.binary_search_by_key(&id, |live| live.track.id).ok();
        let track = match known {
            Some(at) if u.ratio(7, 8)? => live[at].track.clone(),
            _ => server::any_track(u, id)?,
        };
        id = id.wrapping_add(u.int_in_range(1..=3)?);
        let path = track.target.path.as_bytes();
        // Now and then more than the limit of decoded state.
        let large = if u.ratio(1, 24)? { 4000 } else { 1 };
        let (model, parameters) = match &track.model {
            Model::Probes(volume) => (
                2 | u32::from(volume.coding != Coding::Raw) << 16,
                parameters_of_volume(volume, large),
            ),
            Model::Points(grid) => (1, parameters_of_grid(grid, large)),
        };
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

fn parameters_of_grid(grid: &Grid, large: u32) -> Vec<u8> {
    let mut bytes = parameters(&grid.grid_from_mesh, grid.dims);
    put(
        &mut bytes,
        &[grid.cell_edge.to_bits(), grid.radius.to_bits()],
    );
    bytes.extend([grid.widths.position, grid.widths.normal, grid.widths.ao, 0]);
    put(
        &mut bytes,
        &[grid.bucket_count * large, grid.cell_capacity * large],
    );
    bytes
}

fn parameters_of_volume(volume: &Volume, large: u32) -> Vec<u8> {
    let [dx, dy, dz] = volume.dims;
    let mut bytes = parameters(
        &volume.grid_from_mesh,
        [dx, dy, dz.saturating_mul(large as u16)],
    );
    put(&mut bytes, &volume.spacing.map(f32::to_bits));
    let visibility = volume.visibility;
    bytes.extend([volume.exponent as u8, visibility.side, 0, 0]);
    put(&mut bytes, &[visibility.range.to_bits()]);
    let steps = match volume.coding {
        Coding::Raw => [0; 6],
        Coding::Packed(steps) => {
            let ([y0, y1, y2], [c0, c1, c2]) = (steps.luma, steps.chroma);
            [y0, c0, y1, c1, y2, c2]
        }
    };
    bytes.extend(steps.iter().flat_map(|step| step.to_le_bytes()));
    bytes
}

/// What both models begin with.
fn parameters(grid_from_mesh: &[[f32; 4]; 3], dims: [u16; 3]) -> Vec<u8> {
    let floats = grid_from_mesh.as_flattened().iter();
    let mut bytes: Vec<u8> = floats.flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend(dims.iter().flat_map(|d| d.to_le_bytes()));
    bytes.extend([0, 0]);
    bytes
}

/// Some of the live tracks.
fn some(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u32>> {
    let mut ids = Vec::new();
    for live in decoder.tracks() {
        if u.arbitrary()? {
            ids.push(live.track.id);
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

fn points(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let last = decoder.last_frame();
    let keyframe = last.is_none() || u.ratio(1, 2)?;
    let base = if keyframe {
        0
    } else {
        last.map_or(0, |(frame, _)| frame)
    };
    let (mut table, mut sections) = (Vec::new(), Vec::new());
    put(&mut table, &[ids.len() as u32, keyframe.into(), base, 0]);
    for live in decoder
        .tracks()
        .iter()
        .filter(|live| ids.contains(&live.track.id))
    {
        let Some(grid) = live.track.grid().copied() else {
            continue;
        };
        let old = |index: u32| match keyframe {
            true => Cell::FREE,
            false => decoder.points().cells_of(live)[index as usize],
        };
        let old_bucket = |index: u32| match keyframe {
            true => Bucket::EMPTY,
            false => decoder.points().buckets_of(live)[index as usize],
        };
        let (buckets, cells) = content(u, &grid, old, old_bucket)?;
        put(
            &mut table,
            &[live.track.id, buckets.len() as u32, cells.len() as u32],
        );
        gaps(&mut sections, buckets.keys());
        buckets
            .values()
            .for_each(|entries| put(&mut sections, entries));
        gaps(&mut sections, cells.keys());
        cells
            .values()
            .for_each(|cell| put(&mut sections, &[cell.key]));
        let size = grid.widths.bits() as usize / 8;
        let points = cells.values().flat_map(|cell| cell.points);
        sections.extend(points.flat_map(|point| point.to_le_bytes().into_iter().take(size)));
        sections.resize(sections.len().next_multiple_of(4), 0);
    }
    table.extend(sections);
    Ok(table)
}

/// Some volumes with some probes changed, by the encoder.
fn probes(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let last = decoder.last_frame().map(|(frame, _)| frame);
    let keyframe = last.is_none() || u.ratio(1, 2)?;
    let named = decoder.tracks().iter();
    let named: Vec<_> = named
        .filter(|live| live.track.volume().is_some() && ids.contains(&live.track.id))
        .collect();
    let mut contents = Vec::new();
    for live in &named {
        let volume = live.track.volume().expect("probes");
        let base = decoder.probes().probes_of(live);
        let mut probes = match keyframe {
            true => vec![Probe::ABSENT; base.len()],
            false => base.to_vec(),
        };
        for _ in 0..u.int_in_range(0..=8)? {
            let at = u.choose_index(probes.len())?;
            probes[at] = volumes::probe(u, volume)?;
        }
        let visibility = match volume.visibility.side > 0 && u.ratio(1, 3)? {
            true => Some(volumes::visibility(u, volume)?),
            false => None,
        };
        contents.push((live.track.id, base, probes, visibility));
    }
    if contents.is_empty() {
        let mut payload = Vec::new();
        let base = if keyframe { 0 } else { last.unwrap_or(0) };
        put(&mut payload, &[0, keyframe.into(), base, 0]);
        return Ok(payload);
    }
    // A stream of its own, whose last record is the one that is wanted.
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("preamble");
    let tracks: Vec<_> = named.iter().map(|live| live.track.clone()).collect();
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let start = GroupStart::Keyframes;
    encoder.group(&mut bytes, start).expect("group");
    // The frame that a delta builds on.
    let bases: Vec<_> = contents
        .iter()
        .map(|(track, base, ..)| Update {
            track: *track,
            base: &[],
            probes: base,
            visibility: None,
        })
        .collect();
    let written = encoder.probes(&mut bytes, Coverage::Keyframe, &bases, Compression::None);
    written.expect("base");
    encoder.commit(&mut bytes, 0, None).expect("commit");
    let updates: Vec<_> = contents
        .iter()
        .map(|(track, base, probes, visibility)| Update {
            track: *track,
            base,
            probes,
            visibility: visibility.as_deref(),
        })
        .collect();
    let coverage = match keyframe {
        true => Coverage::Keyframe,
        false => Coverage::Delta,
    };
    let at = bytes.len() + HEADER_BYTES;
    let written = encoder.probes(&mut bytes, coverage, &updates, Compression::None);
    written.expect("probes");
    let mut payload = bytes.split_off(at);
    if !keyframe {
        payload[8..12].copy_from_slice(&last.unwrap_or(0).to_le_bytes());
    }
    // Any bit of it, the coder's among them.
    if !payload.is_empty() && u.ratio(1, 8)? {
        let at = u.choose_index(payload.len())?;
        payload[at] ^= 1 << u.int_in_range(0..=7)?;
    }
    Ok(payload)
}

/// Buckets and cells by their indices.
pub type Content = (BTreeMap<u32, [u32; 8]>, BTreeMap<u32, Cell>);

/// Changes of a few cells, and of every bucket that they concern.
pub fn content(
    u: &mut Unstructured<'_>,
    grid: &Grid,
    old: impl Fn(u32) -> Cell,
    old_bucket: impl Fn(u32) -> Bucket,
) -> Result<Content> {
    let mut cells = BTreeMap::new();
    for _ in 0..u.int_in_range(0..=5)? {
        let index = u.int_in_range(0..=grid.cell_capacity - 1)?;
        cells.insert(index, cell(u, grid.volume() as u32, grid.widths)?);
    }
    let keys = cells
        .iter()
        .flat_map(|(&index, cell)| [cell.key, old(index).key]);
    let homes: BTreeSet<u32> = keys
        .filter(|&key| key != EMPTY)
        .map(|key| grid.bucket_of_key(key))
        .collect();
    let mut buckets = BTreeMap::new();
    for home in homes {
        let kept = old_bucket(home)
            .0
            .into_iter()
            .filter(|e| *e != EMPTY && !cells.contains_key(e));
        let new = cells
            .iter()
            .filter(|(_, cell)| cell.key != EMPTY && grid.bucket_of_key(cell.key) == home);
        let mut entries = [EMPTY; 8];
        for (entry, index) in entries
            .iter_mut()
            .zip(kept.chain(new.map(|(&index, _)| index)))
        {
            *entry = index;
        }
        buckets.insert(home, entries);
    }
    Ok((buckets, cells))
}

fn cell(u: &mut Unstructured<'_>, volume: u32, widths: PointWidths) -> Result<Cell> {
    if u.ratio(1, 5)? {
        return Ok(Cell::FREE);
    }
    let there = 1u32 << (widths.bits() - 1);
    let mut points = [0; CELL_POINTS];
    let used = u.int_in_range(0..=CELL_POINTS)?;
    for point in &mut points[..used] {
        *point = there | u.arbitrary::<u32>()? & (there - 1);
    }
    Ok(Cell {
        key: u.int_in_range(0..=volume - 1)?,
        points,
    })
}

/// Ascending indices as gaps.
fn gaps<'a>(out: &mut Vec<u8>, indices: impl Iterator<Item = &'a u32>) {
    let mut next = 0;
    for &index in indices {
        put(out, &[index - next]);
        next = index + 1;
    }
}
