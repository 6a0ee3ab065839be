//! `instances`: tables, drawn from an input, and the rules that they keep.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::HEADER_BYTES;
use dapple_codec::instances::{Coding, Entry, Form, State, Table, Update, Value};
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::{Compression, Decoder, Encoder, EncoderConfig, GroupStart, Model, TrackState};

use super::{TrackContent, in_records};
use crate::records::{put, some};
use crate::server::compression;

/// Small enough that eight of them with all their content fit into a record.
pub fn table(u: &mut Unstructured<'_>) -> Result<Table> {
    let kernel = |u: &mut Unstructured<'_>| {
        let distance = f32::from(u.int_in_range(1u8..=40)?) / 4.0;
        Ok(match u.arbitrary()? {
            true => Kernel::exponential(distance),
            false => Kernel::cut_off(distance),
        })
    };
    let first = kernel(u)?;
    let signals = match u.int_in_range(0..=3)? {
        0 => Signals::one(first),
        1 => Signals::blended(first, kernel(u)?, 0.5),
        _ => Signals::two(first, kernel(u)?, 0.97),
    };
    Ok(Table {
        signals,
        count: match u.int_in_range(0..=7)? {
            0 => 64,
            _ => u.int_in_range(1..=9)?,
        },
        exponent: u.int_in_range(0..=3)?,
        step: match u.int_in_range(0..=3)? {
            0 => 1,
            1 => u.int_in_range(1..=32767)?,
            _ => u.int_in_range(1..=600)?,
        },
        coding: match u.ratio(1, 3)? {
            true => Coding::Raw,
            false => Coding::Packed,
        },
    })
}

/// Entries that a track may have.
pub fn entries(u: &mut Unstructured<'_>, table: &Table) -> Result<Vec<Entry>> {
    let most = 32767 / table.step as i16;
    let dense = u.ratio(1, 4)?;
    let mut key = u.arbitrary::<u64>()?;
    let mut entries = Vec::new();
    for _ in 0..table.count {
        let form = match u.arbitrary()? {
            true => Form::Linear,
            false => Form::Scalar,
        };
        let mut codes = [[0; 4]; 2];
        for signal in &mut codes[..usize::from(table.signals.count)] {
            for code in &mut signal[..form.coefficients()] {
                // Near 0 more often than not.
                *code = match u.ratio(3, 4)? {
                    true => i16::from(u.int_in_range(-9i8..=9)?).clamp(-most, most),
                    false => u.int_in_range(-most..=most)?,
                };
            }
        }
        entries.push(Entry { key, form, codes });
        let step = match dense {
            true => u.int_in_range(1..=3u64)?,
            false => u.arbitrary::<u64>()? | 1,
        };
        key = key.wrapping_add(step);
    }
    entries.sort_by_key(|entry| entry.key);
    // Keys that came twice move up.
    for at in 1..entries.len() {
        let before = entries[at - 1].key;
        entries[at].key = entries[at].key.max(before.saturating_add(1));
    }
    // Those that met the end of what there is move down.
    let mut above = u64::MAX;
    for entry in entries.iter_mut().rev() {
        entry.key = entry.key.min(above);
        above = entry.key.saturating_sub(1);
    }
    Ok(entries)
}

/// Number of the coding.
pub fn coding(table: &Table) -> u16 {
    match table.coding {
        Coding::Raw => 0,
        Coding::Packed => 1,
    }
}

/// Parameters as bytes, with `scale` times as many entries.
pub fn parameters(table: &Table, scale: u32) -> Vec<u8> {
    let [first, second] = table.signals.kernels;
    let mut bytes = vec![table.signals.count, first.kind, second.kind, 0];
    let numbers = [first.distance, second.distance, table.signals.share];
    put(&mut bytes, &numbers.map(f32::to_bits));
    put(&mut bytes, &[table.count.saturating_mul(scale)]);
    bytes.extend([table.exponent, 0]);
    bytes.extend(table.step.to_le_bytes());
    bytes
}

/// The entries of a track, as decoded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Keys.
    pub keys: Vec<u64>,
    /// One value or two for each.
    pub values: Vec<Value>,
}

impl Content {
    /// What entries come to.
    pub fn of(table: &Table, entries: &[Entry]) -> Content {
        let signals = usize::from(table.signals.count);
        let all = entries.iter().flat_map(|entry| &entry.codes[..signals]);
        let value = |codes: &[i16; 4]| codes.map(|code| code * table.step as i16);
        Content {
            keys: entries.iter().map(|entry| entry.key).collect(),
            values: all.map(value).collect(),
        }
    }

    /// What a decoder shows.
    pub fn shown(state: &State, track: &TrackState) -> Content {
        Content {
            keys: state.keys_of(track).to_vec(),
            values: state.values_of(track).to_vec(),
        }
    }
}

/// Changes tracks and writes them ([`super::write`]).
pub fn write(
    u: &mut Unstructured<'_>,
    tracks: Vec<TrackContent<'_>>,
    encoder: &mut Encoder,
    out: &mut Vec<u8>,
) -> Result<()> {
    let mut contents = Vec::new();
    for track in tracks {
        if let (Model::Instances(table), super::Content::Instances(kept)) =
            (track.model, track.content)
        {
            let entries = entries(u, &table)?;
            *kept = Content::of(&table, &entries);
            contents.push((track.id, entries));
        }
    }
    in_records(u, &contents, |u, contents| {
        let updates = updates(contents);
        let written = encoder.instances(out, &updates, compression(u)?);
        written.expect("instances");
        Ok(())
    })
}

fn updates(contents: &[(u32, Vec<Entry>)]) -> Vec<Update<'_>> {
    let contents = contents.iter().map(|(track, entries)| Update {
        track: *track,
        entries,
    });
    contents.collect()
}

/// New content of some tracks, by the encoder.
pub fn payload(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let named = decoder.tracks().iter();
    let named: Vec<_> = named
        .filter(|track| track.track.instance_table().is_some() && ids.contains(&track.track.id))
        .collect();
    let mut payload = Vec::new();
    if named.is_empty() {
        put(&mut payload, &[0, 1, 0, 0]);
        return Ok(payload);
    }
    // A stream of its own, whose last record is the one that is wanted.
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("preamble");
    let tracks: Vec<_> = named.iter().map(|track| track.track.clone()).collect();
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let start = GroupStart::Keyframes;
    encoder.group(&mut bytes, start).expect("group");
    let mut contents = Vec::new();
    for track in &tracks {
        let table = track.instance_table().expect("instances");
        contents.push((track.id, entries(u, table)?));
    }
    let at = bytes.len() + HEADER_BYTES;
    let written = encoder.instances(&mut bytes, &updates(&contents), Compression::None);
    written.expect("instances");
    payload = bytes.split_off(at);
    // Any bit of it, the coder's among them.
    if u.ratio(1, 8)? {
        let at = u.choose_index(payload.len())?;
        payload[at] ^= 1 << u.int_in_range(0..=7)?;
    }
    Ok(payload)
}

/// What holds of the committed state (`spec/instances.md` §4). Returns what it counts (I-002).
pub fn check(decoder: &Decoder) -> u64 {
    let mut bytes = 0;
    for track in decoder.tracks() {
        if let Some(table) = track.track.instance_table() {
            check_track(decoder.instances(), track, table);
            bytes += u64::from(table.count) * (16 + 16 * u64::from(table.signals.count));
        }
    }
    bytes
}

fn check_track(state: &State, track: &TrackState, table: &Table) {
    let Content { keys, values } = Content::shown(state, track);
    assert!(keys.is_empty() || keys.len() == table.count as usize);
    assert_eq!(values.len(), keys.len() * usize::from(table.signals.count));
    assert!(keys.is_sorted_by(|a, b| a < b));
    for &value in values.as_flattened() {
        let value = i32::from(value);
        assert!(value.abs() <= 32767 && value % i32::from(table.step) == 0);
    }
    for (key, values) in keys
        .iter()
        .zip(values.chunks(usize::from(table.signals.count)))
    {
        assert_eq!(state.find(track, *key), Some(values));
    }
}
