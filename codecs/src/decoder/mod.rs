//! The push decoder: what a caller sees of it, and how it goes on after an error.

mod steps;
mod whole;

pub use whole::decode_all;

use alloc::vec::Vec;

use bytemuck::cast_slice;

use crate::Limits;
use crate::container::unpack::Unpacker;
use crate::container::{HEADER_BYTES, RecordHeader};
use crate::dirty::{Buffer, Dirty};
use crate::error::{ErrorKind, Result};
use crate::session::Session;
use crate::session::pending::FrameInfo;
use crate::session::records::{GroupStart, TickRate};
use crate::session::track::{self, TrackState};

/// What a call of [`Decoder::push`] came to. Each event says who acts next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// All input was used; push more.
    NeedInput,
    /// The stream's tick rate is known.
    Stream(TickRate),
    /// A group starts.
    Group {
        /// Number of the group.
        id: u32,
        /// What it builds on.
        start: GroupStart,
    },
    /// Tracks were declared: [`Decoder::tracks`] and the arrays have grown by empty regions.
    Tracks {
        /// How many are new.
        added: u32,
    },
    /// A frame was committed: upload the dirty ranges.
    Frame(FrameInfo),
    /// A record of an unknown type was skipped; it said that it may be.
    Skipped {
        /// Its type number.
        record_type: u16,
        /// Its payload bytes.
        stored_bytes: u32,
    },
    /// The stream is complete.
    End,
}

impl Event {
    /// Its stable number, for interfaces of other languages.
    pub fn number(&self) -> u32 {
        match self {
            Event::NeedInput => 0,
            Event::Stream(_) => 1,
            Event::Group { .. } => 2,
            Event::Tracks { .. } => 3,
            Event::Frame(_) => 4,
            Event::Skipped { .. } => 5,
            Event::End => 6,
        }
    }
}

/// Where the decoder stands between two bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Preamble,
    Header,
    /// Payload of `header`.
    Payload,
    /// Payload of `header` that nobody wants: bytes left.
    Skip(u32),
    Ended,
    /// After an error: whether the next byte to come is known to be of a payload or header.
    Failed(Recovery),
}

/// How [`Decoder::resume`] can go on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Recovery {
    /// Not at all: the framing is lost.
    Impossible,
    /// Look at `header` again; its payload has not come yet.
    AtPayload,
    /// The next byte starts a record header.
    AtHeader,
}

/// Decodes a stream that is pushed into it.
///
/// ```
/// # use dapple_codec::{Decoder, Event, Limits};
/// # fn socket() -> Vec<u8> { Vec::new() }
/// let mut decoder = Decoder::new(Limits::default());
/// let received = socket();
/// let mut rest = &received[..];
/// while !rest.is_empty() {
///     match decoder.push(rest) {
///         Ok((consumed, event)) => {
///             rest = &rest[consumed..];
///             if let Event::Frame(_) = event { /* upload the dirty ranges */ }
///         }
///         Err(error) => {
///             eprintln!("{error}");
///             break; // or decoder.resume()
///         }
///     }
/// }
/// ```
pub struct Decoder {
    limits: Limits,
    unpacker: Unpacker,
    pub(crate) session: Session,
    phase: Phase,
    /// Bytes consumed of the stream.
    position: u64,
    /// Position of the record (or preamble) in progress.
    record_start: u64,
    /// Preamble or header that is still arriving.
    head: [u8; HEADER_BYTES],
    head_bytes: usize,
    header: RecordHeader,
    /// Payload that is still arriving.
    stored: Vec<u8>,
    /// Unpacked payload of a small record.
    payload: Vec<u8>,
    /// Preamble and headers so far.
    digest: twox_hash::XxHash64,
    /// Records so far, which is also the next sequence number.
    records: u64,
    /// After [`Decoder::resume`]: skip everything up to a group that can be decoded.
    resynchronising: bool,
    /// Records were lost, so the totals of the end record cannot match.
    damaged: bool,
}

impl Decoder {
    /// A decoder for one stream after another.
    pub fn new(limits: Limits) -> Decoder {
        let no_header = RecordHeader {
            record_type: 0,
            critical: false,
            version: 0,
            packing: 0,
            sequence: 0,
            stored_bytes: 0,
            unpacked_bytes: 0,
            payload_crc: 0,
        };
        Decoder {
            limits,
            unpacker: Unpacker::default(),
            session: Session::default(),
            phase: Phase::Preamble,
            position: 0,
            record_start: 0,
            head: [0; HEADER_BYTES],
            head_bytes: 0,
            header: no_header,
            stored: Vec::new(),
            payload: Vec::new(),
            digest: twox_hash::XxHash64::with_seed(0),
            records: 0,
            resynchronising: false,
            damaged: false,
        }
    }

    /// Feeds bytes. Returns how many were used and what they came to; push the rest again, until
    /// [`Event::NeedInput`].
    ///
    /// # Errors
    /// Any fault of the stream. The committed state stays as it was, the bytes up to
    /// [`Decoder::position`] count as used, and the decoder waits for [`Decoder::resume`] or
    /// [`Decoder::reset`]; until then every call gives error 4011.
    pub fn push(&mut self, input: &[u8]) -> Result<(usize, Event)> {
        let before = self.position;
        loop {
            let rest = &input[(self.position - before) as usize..];
            if let Some(event) = self.step(rest)? {
                return Ok(((self.position - before) as usize, event));
            }
        }
    }

    /// Ends the input. A stream that is whole has said so itself. Only asks: an error here does not
    /// stop the decoder, and more input may come.
    ///
    /// # Errors
    /// 1019 without an `end` record, 4011 after an error.
    pub fn finish(&self) -> Result<()> {
        match self.phase {
            Phase::Ended => Ok(()),
            Phase::Failed(_) => Err(self.error(ErrorKind::Failed)),
            _ => Err(self.error(ErrorKind::Truncated)),
        }
    }

    /// Ends the input of a live stream, which may stop after any commit.
    ///
    /// # Errors
    /// 1019 inside a record, 4006 inside a frame, 4011 after an error.
    pub fn finish_live(&self) -> Result<()> {
        match self.phase {
            Phase::Header if self.head_bytes == 0 && self.session.is_open() => {
                Err(self.error(ErrorKind::Uncommitted))
            }
            Phase::Header if self.head_bytes == 0 && self.session.rate.is_some() => Ok(()),
            _ => self.finish(),
        }
    }

    /// After an error: go on at the next group that can be decoded, skipping what comes before
    /// it (tracks that are declared on the way are taken in). Returns false where that is
    /// impossible, since the framing is lost; then only [`Decoder::reset`] helps. Push from
    /// [`Decoder::position`] on. Without an error it is without effect.
    pub fn resume(&mut self) -> bool {
        let Phase::Failed(recovery) = self.phase else {
            return true;
        };
        self.phase = match recovery {
            Recovery::Impossible => return false,
            Recovery::AtHeader => Phase::Header,
            Recovery::AtPayload => Phase::Payload,
        };
        self.resynchronising = true;
        self.damaged = true;
        if recovery == Recovery::AtPayload {
            match self.check_header() {
                Ok(phase) => self.phase = phase,
                Err(_) => self.phase = Phase::Skip(self.header.stored_bytes),
            }
            if self.header.stored_bytes == 0 {
                // Such a payload is there already. Nothing is told of it: it is skipped, or
                // too short for any record, and errors are not told during resynchronisation.
                let _ = self.step(&[]);
            }
        }
        true
    }

    /// Forgets the stream and its state; keeps limits and memory. The next byte starts a preamble.
    pub fn reset(&mut self) {
        self.session.reset();
        self.phase = Phase::Preamble;
        self.position = 0;
        self.record_start = 0;
        self.head_bytes = 0;
        self.stored.clear();
        self.digest = twox_hash::XxHash64::with_seed(0);
        self.records = 0;
        self.resynchronising = false;
        self.damaged = false;
    }

    /// As [`Decoder::reset`], and gives all memory back.
    pub fn reset_and_free(&mut self) {
        *self = Decoder::new(self.limits);
    }

    /// Bytes of the stream used so far.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Tick rate of the stream, once known.
    pub fn tick_rate(&self) -> Option<TickRate> {
        self.session.rate
    }

    /// Declared tracks that were not removed, ids ascending.
    pub fn tracks(&self) -> &[TrackState] {
        &self.session.tracks
    }

    /// Frame number and tick of the last commit.
    pub fn last_frame(&self) -> Option<(u32, u64)> {
        self.session.last
    }

    /// What changed since [`Decoder::clear_dirty`], in every array of every model and in the transforms of
    /// tracks. The ranges of an array ascend and do not touch.
    ///
    /// ```
    /// # use dapple_codec::{Buffer, Decoder, Limits};
    /// # let mut decoder = Decoder::new(Limits::default());
    /// # fn write(buffer: Buffer, track: Option<u32>, offset: usize, bytes: &[u8]) {}
    /// // After Event::Frame: an array for each buffer and track, resized to the length of its array here.
    /// for dirty in decoder.dirty() {
    ///     let array = decoder.array(dirty.buffer, dirty.track);
    ///     let range = dirty.bytes();
    ///     write(dirty.buffer, dirty.track, range.start, &array[range]);
    /// }
    /// decoder.clear_dirty();
    /// ```
    pub fn dirty(&self) -> impl Iterator<Item = Dirty> {
        self.session.dirty()
    }

    /// An array as the bytes that a GPU reads, in the machine's order: the whole of it, dirty or not. Empty
    /// where there is no such track, or the track is of another model.
    pub fn array(&self, buffer: Buffer, track: Option<u32>) -> &[u8] {
        let of_all = track.is_none();
        let of_track = track.and_then(|id| track::find(&self.session.tracks, id));
        let of_track = of_track.map(|at| &self.session.tracks[at]);
        match (buffer, of_track) {
            (Buffer::PointsBuckets, None) if of_all => cast_slice(self.points().buckets()),
            (Buffer::PointsCells, None) if of_all => cast_slice(self.points().cells()),
            (Buffer::ProbesTexels, Some(track)) => cast_slice(self.probes().texels_of(track)),
            (Buffer::ProbesVisibility, Some(track)) => {
                self.probes().visibility_of(track).unwrap_or(&[])
            }
            (Buffer::VerticesValues, None) if of_all => self.vertices().values(),
            (Buffer::InstancesKeys, Some(track)) => cast_slice(self.instances().keys_of(track)),
            (Buffer::InstancesValues, Some(track)) => cast_slice(self.instances().values_of(track)),
            (Buffer::Regions, Some(track)) => cast_slice(self.regions().regions_of(track)),
            (Buffer::RegionsPairs, Some(track)) => cast_slice(self.regions().pairs_of(track)),
            (Buffer::Transforms, Some(track)) => match &track.transform {
                Some(transform) => cast_slice(&transform.world_from_grid),
                None => &[],
            },
            (_, _) => &[],
        }
    }

    /// The dirty ranges have been uploaded.
    pub fn clear_dirty(&mut self) {
        self.session.clear_dirty();
    }

    /// Steps of work for this stream so far. A step is what takes some 10 ns: 64 bytes of state that
    /// are emptied or hashed, 16 bytes of a payload. A probe that is shown anew takes 8 steps, one
    /// that a record changes 32 more; an entry of `instances` 32.
    pub fn work(&self) -> u64 {
        self.session.work()
    }

    /// Digest of the committed state (`spec/points.md`, state digest).
    pub fn state_digest(&self) -> u64 {
        self.session.state_digest()
    }
}
