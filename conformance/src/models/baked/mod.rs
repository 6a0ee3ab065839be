//! Vectors of what the baked models share: records that are keyframes alone, with a head, a table and
//! sections, which replace the content of their tracks.

mod changes;
mod layout;

use crate::generate::Draft;
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::stream_builder::kind;

/// A baked model, as the shared vectors need it.
pub trait Baked {
    /// Name of the model, and folder of its vectors.
    const NAME: &'static str;
    /// Type of its record.
    const RECORD: u16;
    /// Error and clause of a size that does not fit.
    const SIZE: (u16, &'static str);
    /// Error and clause of a field that must be 0, or of the keyframe's flag.
    const RESERVED: (u16, &'static str);
    /// Clause of the ids of a record.
    const IDS: &'static str;
    /// Clause of the bytes of a frame.
    const FRAME_BYTES: &'static str;
    /// Clause that a record replaces the content of its tracks, and leaves the others.
    const REPLACES: &'static str;
    /// Clause that a frame may have several records.
    const SEVERAL: &'static str;
    /// Clause of a track without content.
    const EMPTY: &'static str;

    /// A track. Those with ids 1 and 2 have both codings and other numbers.
    fn entry(id: u32) -> Entry;

    /// A record with content of these tracks, other content for each seed.
    fn put(frames: Frames, ids: &[u32], seed: u64) -> Frames;

    /// The payload that [`Baked::put`] would put.
    fn payload(frames: &Frames, ids: &[u32], seed: u64) -> Vec<u8>;

    /// Payloads of tracks 1 and 2 with a fault in a section.
    fn faults(frames: &Frames) -> Vec<Fault>;
}

/// A record that is refused in its content.
pub struct Fault {
    pub name: &'static str,
    /// Layer and number of the error.
    pub error: &'static str,
    pub comment: &'static str,
    pub payload: Vec<u8>,
    /// A whole record of track 1 comes before it, in the same frame.
    pub after_a_record: bool,
}

/// Adds the shared vectors of a model.
pub fn add<M: Baked>(drafts: &mut Vec<Draft>) {
    layout::add::<M>(drafts);
    changes::add::<M>(drafts);
}

/// A stream of tracks 1 to `count`, without content.
pub fn streams<M: Baked>(count: u32) -> Frames {
    let entries: Vec<Entry> = (1..=count).map(M::entry).collect();
    Frames::new(&entries)
}

/// Draws drafts into the folder of a model.
struct Drafts<'d, M> {
    drafts: &'d mut Vec<Draft>,
    model: std::marker::PhantomData<M>,
}

impl<M: Baked> Drafts<'_, M> {
    fn of(drafts: &mut Vec<Draft>) -> Drafts<'_, M> {
        Drafts {
            drafts,
            model: std::marker::PhantomData,
        }
    }

    /// A stream that is decoded to its end.
    fn valid(&mut self, name: &str, clauses: &[&'static str], comment: &str, frames: Frames) {
        let draft = Draft::valid(M::NAME, name, clauses, comment, frames.ended());
        self.drafts.push(draft);
    }

    /// A record of the model that is refused.
    fn refused(
        &mut self,
        error: (u16, &str),
        clauses: &[&'static str],
        comment: &str,
        frames: Frames,
        payload: &[u8],
    ) {
        let stream = frames.refused_of(M::RECORD, payload);
        self.invalid(error, clauses, comment, stream);
    }

    /// A stream that is refused, where and with what.
    fn invalid(
        &mut self,
        error: (u16, &str),
        clauses: &[&'static str],
        comment: &str,
        (offset, bytes): (usize, Vec<u8>),
    ) {
        let draft = Draft::invalid(M::NAME, error, offset, clauses, comment, bytes);
        self.drafts.push(draft);
    }

    /// A limit of the last vector.
    fn limit(&mut self, name: &str, value: u64) {
        if let Some(draft) = self.drafts.pop() {
            self.drafts.push(draft.limit(name, value));
        }
    }
}

/// Record types of a removal and of a frame's end, for the faults around a record.
const REMOVAL: u16 = kind::TRACK_REMOVE;
