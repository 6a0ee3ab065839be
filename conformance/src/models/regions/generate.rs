//! The model `regions`: its parameters, its records and what they leave.

mod limits;
mod packed;
mod parameters;
mod queries;
mod raw;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::baked;
use crate::models::entry::Entry;
use crate::models::regions::expected::Content;
use crate::models::regions::writer::{Region, Section, Set, payload};
use crate::stream_builder::kind;

/// Folder of these vectors.
pub(crate) const AREA: &str = "regions";

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query that rounding could decide.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    parameters::add(drafts);
    baked::add::<Set>(drafts);
    raw::add(drafts);
    packed::add(drafts);
    limits::add(drafts);
    queries::add(drafts)
}

/// A stream that is decoded to its end.
fn valid(name: &str, clauses: &[&'static str], comment: &str, frames: &Frames) -> Draft {
    Draft::valid(AREA, name, clauses, comment, frames.ended())
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

/// A check of one before another, by name and sentence.
fn ordered(
    error: (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    refused: (usize, Vec<u8>),
) -> Draft {
    let name = format!("order-{}", error.1);
    let mut clauses = [clauses, &["C-112"]].concat();
    clauses.dedup();
    invalid((error.0, &name), &clauses, comment, refused)
}

/// Regions of all forms that a track has, other ones for each seed.
pub(crate) fn some(set: &Set, seed: u64) -> Vec<Region> {
    let mut draw = Draw(seed);
    (0..set.count).map(|_| one(set, &mut draw)).collect()
}

fn one(set: &Set, draw: &mut Draw) -> Region {
    let form = [
        draw.below(3) as u8,
        draw.below(3) as u8,
        1 + draw.below(set.signals.into()) as u8,
    ];
    let mut bounds = [0.0; 6];
    for axis in 0..3 {
        bounds[axis] = (8.0 * draw.signed()) as f32;
        bounds[3 + axis] = bounds[axis] + draw.below(64) as f32 / 8.0;
    }
    let mut region = Region::new(bounds, form);
    if draw.below(2) == 0 {
        region.centre = Some([0, 1, 2].map(|axis| bounds[axis + 3 * (draw.below(2) as usize)]));
    }
    let most = set.most();
    for code in &mut region.codes {
        *code = match draw.below(4) {
            0 => draw.below_i32(2 * most + 1) - most,
            1 => 0,
            _ => (draw.below_i32(9) - 4).clamp(-most, most),
        };
    }
    region
}

/// A stream of these tracks, with ids from 1 up.
fn streams(sets: &[Set]) -> Frames {
    Frames::new(&entries(sets))
}

fn entries(sets: &[Set]) -> Vec<Entry> {
    let numbered = (1..).zip(sets.iter().cloned());
    numbered.map(|(id, set)| Entry::of_set(id, set)).collect()
}

/// Where in a stream a section with a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In the first frame.
    First,
    /// In the second frame.
    Later,
    /// In the second track of the first frame's record.
    SecondTrack,
}

impl Place {
    const ALL: [Place; 3] = [Place::First, Place::Later, Place::SecondTrack];

    fn name(self) -> &'static str {
        match self {
            Place::First => "first",
            Place::Later => "later",
            Place::SecondTrack => "second-track",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Place::First => "the first frame",
            Place::Later => "a later frame",
            Place::SecondTrack => "the second track of a record",
        }
    }

    /// A stream whose last section is the one of these regions, altered, and the offset of its fault.
    fn with_section(
        self,
        set: &Set,
        regions: Vec<Region>,
        change: impl FnOnce(&mut Section),
    ) -> (usize, Vec<u8>) {
        let other = Set::raw(2);
        let (frames, mut contents, id) = match self {
            Place::First => (streams(std::slice::from_ref(set)), Vec::new(), 1),
            Place::Later => {
                let frames = streams(std::slice::from_ref(set));
                let content = Content::new(1, some(set, 7));
                (frames.regions(&[content]).commit(), Vec::new(), 1)
            }
            Place::SecondTrack => {
                let first = Content::new(1, some(&other, 5));
                (streams(&[other, set.clone()]), vec![first], 2)
            }
        };
        contents.push(Content::new(id, regions));
        let mut sections = frames.region_sections(&contents);
        if let Some(section) = sections.last_mut() {
            change(section);
        }
        frames.refused_of(kind::REGIONS, &payload(&sections))
    }
}

/// A fault of regions at each place: name, sentence, change.
fn wrong_regions(
    drafts: &mut Vec<Draft>,
    (id, clause): (u16, &'static str),
    set: &Set,
    (name, comment): (&str, &str),
    change: impl Fn(&mut Vec<Region>),
) {
    for place in Place::ALL {
        let mut regions = some(set, 1);
        change(&mut regions);
        let name = format!("{name}-{}", place.name());
        let comment = format!("{comment}, in {}.", place.words());
        let refused = place.with_section(set, regions, |_| {});
        drafts.push(invalid((id, &name), &[clause], &comment, refused));
    }
}

/// A fault of a section of sound regions at each place.
fn wrong_section(
    drafts: &mut Vec<Draft>,
    (id, clause): (u16, &'static str),
    set: &Set,
    (name, comment): (&str, &str),
    change: impl Fn(&mut Section),
) {
    for place in Place::ALL {
        let name = format!("{name}-{}", place.name());
        let comment = format!("{comment}, in {}.", place.words());
        let refused = place.with_section(set, some(set, 1), &change);
        drafts.push(invalid((id, &name), &[clause], &comment, refused));
    }
}

/// Names of the codings, and a track of each.
fn both(count: u32) -> [(&'static str, Set); 2] {
    [("raw", Set::raw(count)), ("packed", Set::packed(count))]
}
