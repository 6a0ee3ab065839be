//! The push decoder: preamble, headers, payloads, and what an error leaves behind.

use alloc::vec::Vec;
use core::hash::Hasher as _;
use core::mem;

use crate::Limits;
use crate::container::compress::Unpacker;
use crate::container::{
    HEADER_BYTES, PREAMBLE_BYTES, Packing, Preamble, RecordHeader, crc32c, crc32c_copy, record_type,
};
use crate::error::{Failure, Fault, Limit, Result};
use crate::points::State;
use crate::records::{FrameInfo, Session};
use crate::session::{End, GroupStart, TickRate};
use crate::track::LiveTrack;

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
    session: Session,
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
    /// After [`Decoder::resume`]: pass over everything up to a group that can be decoded.
    searching: bool,
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
            searching: false,
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

    /// Ends the input. A stream that is whole has said so itself.
    ///
    /// # Errors
    /// 1019 without an `end` record, 4011 after an error.
    pub fn finish(&self) -> Result<()> {
        match self.phase {
            Phase::Ended => Ok(()),
            Phase::Failed(_) => Err(self.error(Fault::Failed)),
            _ => Err(self.error(Fault::Truncated)),
        }
    }

    /// Ends the input of a live stream, which may stop after any commit.
    ///
    /// # Errors
    /// 1019 inside a record, 4006 inside a frame, 4011 after an error.
    pub fn finish_live(&self) -> Result<()> {
        match self.phase {
            Phase::Header if self.head_bytes == 0 && self.session.is_open() => {
                Err(self.error(Fault::Uncommitted))
            }
            Phase::Header if self.head_bytes == 0 && self.session.rate.is_some() => Ok(()),
            _ => self.finish(),
        }
    }

    /// After an error: go on at the next group that can be decoded, passing over what comes before
    /// it (tracks that are declared on the way are taken in). Returns false where that is
    /// impossible, since the framing is lost; then only [`Decoder::reset`] helps. Push from
    /// [`Decoder::position`] on.
    pub fn resume(&mut self) -> bool {
        let Phase::Failed(recovery) = self.phase else {
            return true;
        };
        self.phase = match recovery {
            Recovery::Impossible => return false,
            Recovery::AtHeader => Phase::Header,
            Recovery::AtPayload => Phase::Payload,
        };
        self.searching = true;
        self.damaged = true;
        if recovery == Recovery::AtPayload {
            match self.check_header() {
                Ok(phase) => self.phase = phase,
                Err(_) => self.phase = Phase::Skip(self.header.stored_bytes),
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
        self.searching = false;
        self.damaged = false;
    }

    /// Bytes of the stream used so far.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Tick rate of the stream, once known.
    pub fn tick_rate(&self) -> Option<TickRate> {
        self.session.rate
    }

    /// Live tracks, ids ascending.
    pub fn tracks(&self) -> &[LiveTrack] {
        &self.session.tracks
    }

    /// State of the `points` tracks as of the last commit.
    pub fn points(&self) -> &State {
        &self.session.state
    }

    /// Frame number and tick of the last commit.
    pub fn last_frame(&self) -> Option<(u32, u64)> {
        self.session.last
    }

    /// Transforms changed since [`Decoder::clear_dirty`].
    pub fn transforms_dirty(&self) -> bool {
        self.session.transforms_dirty
    }

    /// The dirty ranges have been uploaded.
    pub fn clear_dirty(&mut self) {
        self.session.state.clear_dirty();
        self.session.transforms_dirty = false;
    }

    /// Digest of the committed state (`spec/points.md`, state digest).
    pub fn state_digest(&self) -> u64 {
        self.session.digest(false)
    }

    /// Takes in some of `input`: up to the end of a preamble, a header or a payload.
    fn step(&mut self, input: &[u8]) -> Result<Option<Event>> {
        match self.phase {
            Phase::Failed(_) => Err(self.error(Fault::Failed)),
            Phase::Ended if input.is_empty() => Ok(Some(Event::End)),
            Phase::Ended => self.fail(Fault::TrailingBytes, Recovery::Impossible, self.position),
            Phase::Preamble => {
                if !self.fill_head(input, PREAMBLE_BYTES) {
                    return Ok(Some(Event::NeedInput));
                }
                let mut bytes = [0; PREAMBLE_BYTES];
                bytes.copy_from_slice(&self.head[..PREAMBLE_BYTES]);
                if let Err(fault) = Preamble::parse(&bytes) {
                    return self.fail(fault, Recovery::Impossible, self.record_start);
                }
                self.digest.write(&bytes);
                self.next_record();
                Ok(None)
            }
            Phase::Header => {
                if !self.fill_head(input, HEADER_BYTES) {
                    return Ok(Some(Event::NeedInput));
                }
                self.header = match RecordHeader::parse(&self.head) {
                    Ok(header) => header,
                    Err(fault) => return self.fail(fault, Recovery::Impossible, self.record_start),
                };
                match self.check_header() {
                    Ok(phase) => self.phase = phase,
                    Err(failure) => {
                        return self.fail(failure, Recovery::AtPayload, self.record_start);
                    }
                }
                Ok(None)
            }
            Phase::Skip(left) => {
                let taken = input.len().min(left as usize);
                self.position += taken as u64;
                let left = left - taken as u32;
                if left > 0 {
                    self.phase = Phase::Skip(left);
                    return Ok(Some(Event::NeedInput));
                }
                self.next_record();
                Ok((!self.searching).then_some(Event::Skipped {
                    record_type: self.header.record_type,
                    stored_bytes: self.header.stored_bytes,
                }))
            }
            Phase::Payload => self.take_payload(input),
        }
    }

    /// Collects `want` bytes in `head`.
    fn fill_head(&mut self, input: &[u8], want: usize) -> bool {
        let taken = input.len().min(want - self.head_bytes);
        self.head[self.head_bytes..self.head_bytes + taken].copy_from_slice(&input[..taken]);
        self.head_bytes += taken;
        self.position += taken as u64;
        self.head_bytes == want
    }

    fn next_record(&mut self) {
        self.phase = Phase::Header;
        self.head_bytes = 0;
        self.record_start = self.position;
    }

    /// Everything a header can be rejected for before its payload comes, and where to go.
    fn check_header(&mut self) -> core::result::Result<Phase, Failure> {
        let header = self.header;
        let expected = self.records;
        match header.sequence {
            sequence if sequence == expected => {}
            sequence if sequence > expected && self.searching => {}
            sequence if sequence > expected => return Err(Fault::RecordGap.into()),
            sequence if sequence + 1 == expected => return Err(Fault::RecordDuplicate.into()),
            _ => return Err(Fault::RecordOrder.into()),
        }
        let defined = record_type::is_defined(header.record_type);
        if !defined && header.critical {
            return Err(Fault::UnknownCritical.into());
        }
        if defined && !header.critical {
            return Err(Fault::CriticalBit.into());
        }
        if defined && header.version != 0 {
            return Err(Fault::RecordVersion.into());
        }
        let is_stream = header.record_type == record_type::STREAM;
        if is_stream != self.session.rate.is_none() {
            return Err(Fault::NoStream.into());
        }
        let wanted = !self.searching
            || matches!(
                header.record_type,
                record_type::STREAM
                    | record_type::GROUP
                    | record_type::TRACK
                    | record_type::TRACK_REMOVE
                    | record_type::END
            );
        if !(defined && wanted) {
            self.count_record();
            return Ok(Phase::Skip(header.stored_bytes));
        }
        let limit = |fault, which, asked: u32, allowed: u32| match asked <= allowed {
            true => Ok(()),
            false => Err(Failure::limit(fault, which, asked.into(), allowed.into())),
        };
        let (stored, unpacked) = (header.stored_bytes, header.unpacked_bytes);
        limit(
            Fault::StoredLimit,
            Limit::StoredBytes,
            stored,
            self.limits.stored_bytes,
        )?;
        limit(
            Fault::UnpackedLimit,
            Limit::UnpackedBytes,
            unpacked,
            self.limits.unpacked_bytes,
        )?;
        Unpacker::check_lengths(header.packing, stored, unpacked)?;
        // An end record's digest covers what came before it.
        if header.record_type != record_type::END {
            self.count_record();
        }
        Ok(Phase::Payload)
    }

    fn count_record(&mut self) {
        self.records = self.header.sequence.saturating_add(1);
        self.digest.write(&self.head);
    }

    /// Collects the payload, or takes it straight from the input where that has all of it.
    fn take_payload(&mut self, input: &[u8]) -> Result<Option<Event>> {
        let want = self.header.stored_bytes as usize;
        if self.stored.is_empty() && input.len() >= want {
            self.position += want as u64;
            return self.finish_record(&input[..want]);
        }
        let missing = want - self.stored.len();
        let taken = input.len().min(missing);
        if self.stored.capacity() - self.stored.len() < taken {
            // Doubles with what has arrived, and never beyond the record.
            self.stored
                .reserve_exact(missing.min(taken.max(self.stored.len())));
        }
        self.stored.extend_from_slice(&input[..taken]);
        self.position += taken as u64;
        if taken < missing {
            return Ok(Some(Event::NeedInput));
        }
        let stored = mem::take(&mut self.stored);
        let result = self.finish_record(&stored);
        self.stored = stored;
        self.stored.clear();
        result
    }

    fn finish_record(&mut self, stored: &[u8]) -> Result<Option<Event>> {
        match self.record(stored) {
            Ok(event) => {
                if self.phase == Phase::Payload {
                    self.next_record();
                }
                Ok(event)
            }
            // A group that builds on a lost state, and others like it: the search goes on.
            Err(_) if self.searching => {
                self.session.revert();
                self.next_record();
                Ok(None)
            }
            Err(failure) => {
                let offset = self.record_start + HEADER_BYTES as u64;
                self.fail(failure, Recovery::AtHeader, offset)
            }
        }
    }

    /// A whole record: checks its CRC, unpacks it and hands it on.
    fn record(&mut self, stored: &[u8]) -> core::result::Result<Option<Event>, Failure> {
        let header = self.header;
        let packing =
            Unpacker::check_lengths(header.packing, header.stored_bytes, header.unpacked_bytes)?;
        let bytes = header.unpacked_bytes as usize;
        if header.record_type == record_type::POINTS && packing == Packing::None {
            // The copy is staged only once its CRC is known to match.
            let room = self.session.points_room(bytes, &self.limits);
            let (crc, room) = match room {
                Ok(room) => (crc32c_copy(stored, room), Ok(())),
                Err(failure) => (crc32c(stored), Err(failure)),
            };
            if crc != header.payload_crc {
                return Err(Fault::PayloadChecksum.into());
            }
            room?;
            self.session.points(bytes)?;
            return Ok(None);
        }
        if crc32c(stored) != header.payload_crc {
            return Err(Fault::PayloadChecksum.into());
        }
        let window = self.limits.zstd_window_bytes;
        if header.record_type == record_type::POINTS {
            let room = self.session.points_room(bytes, &self.limits)?;
            self.unpacker.unpack(packing, stored, room, window)?;
            self.session.points(bytes)?;
            return Ok(None);
        }
        if packing == Packing::None {
            return self.small_record(stored);
        }
        let mut payload = mem::take(&mut self.payload);
        payload.clear();
        payload.reserve_exact(bytes);
        payload.resize(bytes, 0);
        let result = match self.unpacker.unpack(packing, stored, &mut payload, window) {
            Ok(()) => self.small_record(&payload),
            Err(failure) => Err(failure),
        };
        self.payload = payload;
        result
    }

    fn small_record(&mut self, payload: &[u8]) -> core::result::Result<Option<Event>, Failure> {
        Ok(match self.header.record_type {
            record_type::STREAM => Some(Event::Stream(self.session.stream(payload)?)),
            record_type::GROUP => {
                let (id, start) = self.session.group(payload)?;
                self.searching = false;
                Some(Event::Group { id, start })
            }
            record_type::TRACK => Some(Event::Tracks {
                added: self.session.declare(payload, &self.limits)?,
            }),
            record_type::TRACK_REMOVE => {
                self.session.remove(payload)?;
                None
            }
            record_type::TRANSFORMS => {
                self.session.transforms(payload)?;
                None
            }
            record_type::COMMIT => Some(Event::Frame(self.session.commit(payload)?)),
            _ => {
                self.end(End::read(payload)?)?;
                Some(Event::End)
            }
        })
    }

    fn end(&mut self, end: End) -> core::result::Result<(), Failure> {
        if self.session.is_open() && !self.searching {
            return Err(Fault::Uncommitted.into());
        }
        if !self.damaged && end.records != self.records {
            return Err(Fault::EndCount.into());
        }
        if !self.damaged && end.digest != self.digest.finish() {
            return Err(Fault::EndDigest.into());
        }
        self.phase = Phase::Ended;
        Ok(())
    }

    /// Stops: drops the frame in the making and remembers how to go on.
    fn fail<T>(
        &mut self,
        failure: impl Into<Failure>,
        recovery: Recovery,
        offset: u64,
    ) -> Result<T> {
        self.session.revert();
        self.stored.clear();
        self.head_bytes = 0;
        if recovery == Recovery::AtHeader {
            self.record_start = self.position;
        }
        self.phase = Phase::Failed(recovery);
        Err(failure.into().at(offset))
    }

    fn error(&self, fault: Fault) -> crate::Error {
        Failure::from(fault).at(self.position)
    }
}
