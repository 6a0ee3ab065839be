//! `regions`: sets of regions, drawn from an input, and the rules that they keep.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::HEADER_BYTES;
use dapple_codec::regions::{
    Coding, Content as Arrays, Derivatives, Form, RegionSet, State, Update,
};
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::{Compression, Decoder, Encoder, EncoderConfig, GroupStart, Model, TrackState};

use super::{TrackContent, in_records};
use crate::records::{put, some};
use crate::server::compression;

/// Small enough that eight of them with all their content fit into a record.
pub fn set(u: &mut Unstructured<'_>) -> Result<RegionSet> {
    let count = u.int_in_range(1..=12)?;
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
    Ok(RegionSet {
        signals,
        count,
        capacity: u.int_in_range(count..=63 * count)?,
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

/// Content that a track may have.
pub fn content(u: &mut Unstructured<'_>, set: &RegionSet) -> Result<Arrays> {
    let mut arrays = Arrays::default();
    for left in (0..set.count).rev() {
        let wanted = Form {
            derivatives: *u.choose(&Derivatives::ALL)?,
            degree: u.int_in_range(0..=2)?,
            signals: u.int_in_range(1..=set.signals.count)?,
            centred: u.arbitrary()?,
        };
        let smallest = Form {
            derivatives: Derivatives::Constant,
            degree: 0,
            signals: 1,
            centred: wanted.centred,
        };
        // The regions to come need a pair each.
        let room = set.capacity as usize - arrays.pairs.len() - left as usize;
        let form = if wanted.pairs() <= room {
            wanted
        } else {
            smallest
        };
        let mut corner = [[0.0; 3]; 2];
        for axis in 0..3 {
            let low = f32::from(u.arbitrary::<i8>()?) / 8.0;
            corner[0][axis] = low;
            corner[1][axis] = low + f32::from(u.arbitrary::<u8>()?) / 16.0;
        }
        let centre = match form.centred {
            true => None,
            false => Some(corner[u.choose_index(2)?]),
        };
        let mut coefficients = vec![0.0; form.coefficients()];
        for coefficient in &mut coefficients {
            // Near 0 more often than not.
            let share = match u.ratio(3, 4)? {
                true => f32::from(u.int_in_range(-9i8..=9)?) / 2000.0,
                false => f32::from(u.arbitrary::<i16>()?) / 32768.0,
            };
            *coefficient = share * set.most();
        }
        let pushed = set.push(&mut arrays, corner, centre, form, &coefficients);
        pushed.expect("a region");
    }
    Ok(arrays)
}

/// Number of the coding.
pub fn coding(set: &RegionSet) -> u16 {
    match set.coding {
        Coding::Raw => 0,
        Coding::Packed => 1,
    }
}

/// Parameters as bytes, with `scale` times as many regions and pairs.
pub fn parameters(set: &RegionSet, scale: u32) -> Vec<u8> {
    let [first, second] = set.signals.kernels;
    let mut bytes = vec![set.signals.count, first.kind, second.kind, 0];
    let numbers = [first.distance, second.distance, set.signals.share];
    put(&mut bytes, &numbers.map(f32::to_bits));
    let scaled = [set.count, set.capacity].map(|n| n.saturating_mul(scale));
    put(&mut bytes, &scaled);
    bytes.extend([set.exponent, 0]);
    bytes.extend(set.step.to_le_bytes());
    bytes
}

/// The regions of a track.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Regions and their pairs.
    pub arrays: Arrays,
}

impl Content {
    /// What a decoder shows.
    pub fn shown(state: &State, track: &TrackState) -> Content {
        let arrays = Arrays {
            regions: state.regions_of(track).to_vec(),
            pairs: state.pairs_of(track).to_vec(),
        };
        Content { arrays }
    }
}

fn update(track: u32, arrays: &Arrays) -> Update<'_> {
    Update {
        track,
        regions: &arrays.regions,
        pairs: &arrays.pairs,
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
        if let (Model::Regions(set), super::Content::Regions(kept)) = (track.model, track.content) {
            kept.arrays = content(u, &set)?;
            contents.push((track.id, &kept.arrays));
        }
    }
    in_records(u, &contents, |u, contents| {
        let updates: Vec<_> = contents
            .iter()
            .map(|(id, arrays)| update(*id, arrays))
            .collect();
        let written = encoder.regions(out, &updates, compression(u)?);
        written.expect("regions");
        Ok(())
    })
}

/// New content of some tracks, by the encoder.
pub fn payload(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let named = decoder.tracks().iter();
    let named: Vec<_> = named
        .filter(|track| track.track.region_set().is_some() && ids.contains(&track.track.id))
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
        let set = track.region_set().expect("regions");
        contents.push((track.id, content(u, set)?));
    }
    let updates: Vec<_> = contents
        .iter()
        .map(|(id, arrays)| update(*id, arrays))
        .collect();
    let at = bytes.len() + HEADER_BYTES;
    let written = encoder.regions(&mut bytes, &updates, Compression::None);
    written.expect("regions");
    payload = bytes.split_off(at);
    // Any bit of it, the coder's among them.
    if u.ratio(1, 8)? {
        let at = u.choose_index(payload.len())?;
        payload[at] ^= 1 << u.int_in_range(0..=7)?;
    }
    Ok(payload)
}

/// What holds of the committed state (`spec/regions.md` §5). Returns what it counts.
pub fn check(decoder: &Decoder) -> u64 {
    let mut bytes = 0;
    for track in decoder.tracks() {
        if let Some(set) = track.track.region_set() {
            check_track(decoder.regions(), track, set);
            bytes += 96 * u64::from(set.count) + 8 * u64::from(set.capacity);
        }
    }
    bytes
}

fn check_track(state: &State, track: &TrackState, set: &RegionSet) {
    let (regions, pairs) = (state.regions_of(track), state.pairs_of(track));
    assert!(regions.is_empty() || regions.len() == set.count as usize);
    assert!(pairs.len() <= set.capacity as usize);
    let mut first = 0;
    for region in regions {
        let form = region.form().expect("a form");
        assert_eq!((region.first as usize, region.reserved), (first, 0));
        assert!(form.signals <= set.signals.count);
        let values = pairs[first..first + form.pairs()].as_flattened();
        let (values, rest) = values.split_at(form.coefficients());
        assert!(rest.iter().all(|&value| value == 0));
        for &value in values {
            let value = i32::from(value);
            assert!(value.abs() <= 32767 && value % i32::from(set.step) == 0);
        }
        first += form.pairs();
        for axis in 0..3 {
            let (min, max) = (region.min[axis], region.max[axis]);
            assert!(min <= region.centre[axis] && region.centre[axis] <= max);
            assert!(min.abs() < 2f32.powi(40) && max.abs() < 2f32.powi(40));
        }
    }
    assert_eq!(first, pairs.len());
}
