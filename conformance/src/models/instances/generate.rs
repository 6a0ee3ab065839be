//! The model `instances`: its parameters, its records and what they leave.

mod coded;
mod layout;
mod parameters;
mod queries;
mod raw;
mod valid;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::baked;
use crate::models::entry::Entry;
use crate::models::instances::expected::Content;
use crate::models::instances::writer::{Instance, Section, Table, payload};
use crate::stream_builder::kind;

/// Folder of these vectors.
pub(crate) const AREA: &str = "instances";

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    parameters::add(drafts);
    baked::add::<Table>(drafts);
    layout::add(drafts);
    raw::add(drafts);
    coded::add(drafts);
    valid::add(drafts);
    queries::add(drafts)
}

/// A stream that is decoded to its end.
fn valid(name: &str, clauses: &[&'static str], comment: &str, frames: Frames) -> Draft {
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
    let clauses = &[clauses, &["C-112"]].concat();
    invalid((error.0, &name), clauses, comment, refused)
}

/// Instances for all entries of a table, others for each seed: hashed keys, both forms, codes as a
/// bake has them.
pub(crate) fn some(table: &Table, seed: u64) -> Vec<Instance> {
    let mut draw = Draw(seed);
    let mut keys: Vec<u64> = (0..table.count)
        .map(|_| (0..4).fold(0, |key, _| key << 16 | u64::from(draw.below(1 << 16))))
        .collect();
    keys.sort_unstable();
    keys.dedup();
    let most = table.most();
    let instance = |key| {
        let linear = draw.below(3) > 0;
        let mut codes = [[0; 4]; 2];
        for codes in &mut codes[..usize::from(table.signals)] {
            codes[0] = most / 2 + draw.below_i32(most / 2 + 1);
            for code in &mut codes[1..if linear { 4 } else { 1 }] {
                *code = draw.below_i32(most / 4 + 1) - most / 8;
            }
        }
        Instance { key, linear, codes }
    };
    keys.into_iter().map(instance).collect()
}

/// A stream of these tables, with ids from 1 up.
fn streams(tables: &[Table]) -> Frames {
    let numbered = (1..).zip(tables.iter().cloned());
    let entries: Vec<Entry> = numbered.map(|(id, t)| Entry::of_table(id, t)).collect();
    Frames::new(&entries)
}

/// Where in a stream a section with a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In the first frame.
    First,
    /// In a later frame.
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

    /// A stream with these entries, the section altered, and the offset of the fault.
    fn with(
        self,
        table: &Table,
        instances: Vec<Instance>,
        change: impl FnOnce(&mut Section),
    ) -> (usize, Vec<u8>) {
        let other = Table::raw(3);
        let (frames, mut contents, id) = match self {
            Place::First => (streams(std::slice::from_ref(table)), Vec::new(), 1),
            Place::Later => {
                let frames = streams(std::slice::from_ref(table));
                let content = Content::new(1, some(table, 9));
                (frames.instances(&[content]).commit(), Vec::new(), 1)
            }
            Place::SecondTrack => {
                let first = Content::new(1, some(&other, 5));
                (streams(&[other, table.clone()]), vec![first], 2)
            }
        };
        contents.push(Content::new(id, instances));
        let mut sections = frames.instance_sections(&contents);
        if let Some(section) = sections.last_mut() {
            change(section);
        }
        frames.refused_of(kind::INSTANCES, &payload(&sections))
    }
}

/// Faults of sections: name, sentence, change.
type Faults<'f> = &'f [(&'f str, &'f str, fn(&mut Section))];

/// Each of these faults at each place.
fn faults(
    drafts: &mut Vec<Draft>,
    (id, clause): (u16, &'static str),
    table: &Table,
    faults: Faults<'_>,
) {
    for &(name, comment, change) in faults {
        for place in Place::ALL {
            let name = format!("{name}-{}", place.name());
            let comment = format!("{comment}, in {}.", place.words());
            let refused = place.with(table, some(table, 1), change);
            drafts.push(invalid((id, &name), &[clause], &comment, refused));
        }
    }
}
