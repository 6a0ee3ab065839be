//! The model `probes`: its parameters, its records and what they leave.

mod changes;
mod codes;
mod layout;
mod limits;
mod maps;
mod models;
mod packed;
mod parameters;
mod queries;
mod raw;
mod values;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::probes::expected::Content;
use crate::models::probes::maps::{byte_of, code_of};
use crate::models::probes::writer::{GROUPS, Probe, Section, Volume, payload};
use crate::stream_builder::kind;

/// Folder of these vectors.
pub(crate) const AREA: &str = "probes";

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    parameters::add(drafts);
    layout::add(drafts);
    models::add(drafts);
    raw::add(drafts);
    packed::add(drafts);
    codes::add(drafts);
    values::add(drafts);
    changes::add(drafts);
    maps::add(drafts);
    limits::add(drafts);
    queries::add(drafts)
}

/// A stream that is decoded to its end, with the values that clients must see.
fn valid(name: &str, clauses: &[&'static str], comment: &str, frames: Frames) -> Draft {
    Draft::valid(AREA, name, clauses, comment, frames.ended()).shows(&frames.shown)
}

/// A stream that is refused, where and with what.
fn invalid(
    error: (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    (offset, bytes): (usize, Vec<u8>),
) -> Draft {
    Draft::invalid(AREA, error, offset, clauses, comment, bytes)
}

/// Probes of a volume, of all levels that its coding has, other ones for each seed.
pub(crate) fn some(volume: &Volume, seed: u64) -> Vec<Probe> {
    let mut draw = Draw(seed);
    (0..volume.count())
        .map(|_| one(volume, &mut draw))
        .collect()
}

fn one(volume: &Volume, draw: &mut Draw) -> Probe {
    let level = match volume.is_packed() {
        true => draw.below_i32(8).min(3),
        false => 3 * draw.below_i32(4).min(1),
    };
    let mut probe = Probe::new(level as u8, &[]);
    for group in 0..2 * level as usize {
        let step = i32::from(volume.steps[group]);
        for code in GROUPS[group]..GROUPS[group + 1] {
            probe.codes[code] = match (volume.is_packed(), group) {
                (true, 0) => draw.below_i32(10240) / step,
                (true, _) => (draw.below_i32(16384) - 8192) / step,
                // Finite f16, those of degree 0 above 0.
                (false, _) => draw.below_i32(0x7c00),
            };
            if !volume.is_packed() && code > 2 && draw.below_i32(2) == 1 {
                probe.codes[code] -= 0x8000;
            }
        }
    }
    probe
}

/// Probes that differ from these here and there: in a few codes, in level, or by being there.
pub(crate) fn later(volume: &Volume, probes: &[Probe], seed: u64) -> Vec<Probe> {
    let mut draw = Draw(seed);
    let mut later = probes.to_vec();
    for (index, probe) in later.iter_mut().enumerate() {
        match draw.below_i32(4) {
            0 => *probe = one(volume, &mut draw),
            1 if volume.is_packed() && probe.level > 0 => {
                let used = [0, 3, 12, 27][usize::from(probe.level)];
                let code = draw.below_i32(used) as usize;
                // Towards 0, so that it stays in range.
                probe.codes[code] -= probe.codes[code].signum();
                probe.codes[used as usize - 1] = probes[index].codes[code].signum();
            }
            2 if draw.below_i32(3) == 0 => *probe = Probe::ABSENT,
            _ => {}
        }
    }
    later
}

/// A visibility block, other bytes for each seed: in a packed volume, those of map codes.
pub(crate) fn seen(volume: &Volume, seed: u64) -> Vec<u8> {
    let mut draw = Draw(seed);
    let byte = |at: usize| {
        let byte = draw.below_i32(256) as u8;
        match volume.map_steps[at % 2] {
            0 => byte,
            step => byte_of(code_of(byte, step), step),
        }
    };
    (0..volume.visibility_bytes()).map(byte).collect()
}

/// A stream of these volumes, with ids from 1 up.
fn streams(volumes: &[Volume]) -> Frames {
    Frames::new(&entries(volumes))
}

fn entries(volumes: &[Volume]) -> Vec<Entry> {
    let numbered = (1..).zip(volumes.iter().cloned());
    numbered.map(|(id, v)| Entry::of_volume(id, v)).collect()
}

/// Where in a stream a section with a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In the first frame.
    Keyframe,
    /// In a delta.
    Delta,
    /// In the second track of the first frame's record.
    SecondTrack,
}

impl Place {
    const ALL: [Place; 3] = [Place::Keyframe, Place::Delta, Place::SecondTrack];

    fn name(self) -> &'static str {
        match self {
            Place::Keyframe => "keyframe",
            Place::Delta => "delta",
            Place::SecondTrack => "second-track",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Place::Keyframe => "a keyframe",
            Place::Delta => "a delta",
            Place::SecondTrack => "the second track of a keyframe",
        }
    }

    /// The stream up to the record with the fault, the contents before the one with it, and its id.
    fn stream(self, volume: &Volume) -> (Frames, Vec<Content>, u32) {
        let other = Volume::raw([2, 1, 1]);
        match self {
            Place::Keyframe => (streams(std::slice::from_ref(volume)), Vec::new(), 1),
            Place::Delta => {
                let frames = streams(std::slice::from_ref(volume));
                let content = Content::new(1, some(volume, 1));
                (frames.probes(true, &[content]).commit(), Vec::new(), 1)
            }
            Place::SecondTrack => {
                let first = Content::new(1, some(&other, 5));
                (streams(&[other, volume.clone()]), vec![first], 2)
            }
        }
    }

    /// A stream with these probes, and the offset of their fault.
    fn with_probes(self, volume: &Volume, probes: Vec<Probe>) -> (usize, Vec<u8>) {
        let (frames, mut contents, id) = self.stream(volume);
        contents.push(Content::new(id, probes));
        let payload = frames.probes_payload(self != Place::Delta, &contents);
        frames.refused_of(kind::PROBES, &payload)
    }

    /// A stream with the section of sound probes altered, and the offset of its fault.
    fn with_section(self, volume: &Volume, change: impl FnOnce(&mut Section)) -> (usize, Vec<u8>) {
        let (frames, mut contents, id) = self.stream(volume);
        let probes = match self {
            Place::Delta => later(volume, &some(volume, 1), 2),
            _ => some(volume, 1),
        };
        contents.push(Content::new(id, probes));
        let mut sections = frames.sections(self != Place::Delta, &contents);
        if let Some(section) = sections.last_mut() {
            change(section);
        }
        let base = (self == Place::Delta).then_some(0);
        frames.refused_of(kind::PROBES, &payload(base, &sections))
    }
}

/// Faults of sections: name, sentence, change.
type Faults<'f> = &'f [(&'f str, &'f str, fn(&mut Section))];

/// Each of these faults at each place.
fn faults(
    drafts: &mut Vec<Draft>,
    (id, clause): (u16, &'static str),
    volume: &Volume,
    faults: Faults<'_>,
) {
    for &(name, comment, change) in faults {
        for place in Place::ALL {
            let name = format!("{name}-{}", place.name());
            let comment = format!("{comment}, in {}.", place.words());
            let refused = place.with_section(volume, change);
            drafts.push(invalid((id, &name), &[clause], &comment, refused));
        }
    }
}

/// A check of one before another, by name and sentence.
fn ordered(
    error: (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    refused: (usize, Vec<u8>),
) -> Draft {
    let name = format!("order-{}", error.1);
    let clauses = &[clauses, &["C-112"]].concat();
    invalid((error.0, &name), clauses, comment, refused)
}
