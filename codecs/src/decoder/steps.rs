//! The decoder's steps from byte to byte: preamble, header, payload, record.

use core::hash::Hasher as _;
use core::mem;

use super::{Decoder, Event, Phase, Recovery};
use crate::container::unpack::Unpacker;
use crate::container::{
    HEADER_BYTES, PREAMBLE_BYTES, Packing, Preamble, RecordHeader, crc32c, crc32c_copy, record_type,
};
use crate::error::{ErrorDetail, ErrorKind, Result};
use crate::memory::reserve::reserve_exact;
use crate::models::ModelKind;
use crate::session::records::End;

impl Decoder {
    /// Takes in some of `input`: up to the end of a preamble, a header or a payload.
    pub(super) fn step(&mut self, input: &[u8]) -> Result<Option<Event>> {
        match self.phase {
            Phase::Failed(_) => Err(self.error(ErrorKind::Failed)),
            Phase::Ended if input.is_empty() => Ok(Some(Event::End)),
            Phase::Ended => self.fail(
                ErrorKind::TrailingBytes,
                Recovery::Impossible,
                self.position,
            ),
            Phase::Preamble => {
                if !self.fill_head(input, PREAMBLE_BYTES) {
                    return Ok(Some(Event::NeedInput));
                }
                let mut bytes = [0; PREAMBLE_BYTES];
                bytes.copy_from_slice(&self.head[..PREAMBLE_BYTES]);
                if let Err(fault) = Preamble::read_known(&bytes) {
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
                Ok((!self.resynchronising).then_some(Event::Skipped {
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
    pub(super) fn check_header(&mut self) -> core::result::Result<Phase, ErrorDetail> {
        let header = self.header;
        let expected = self.records;
        match header.sequence {
            sequence if sequence == expected => {}
            sequence if sequence > expected && self.resynchronising => {}
            sequence if sequence > expected => return Err(ErrorKind::RecordGap.into()),
            sequence if sequence + 1 == expected => return Err(ErrorKind::RecordDuplicate.into()),
            _ => return Err(ErrorKind::RecordOrder.into()),
        }
        let defined = record_type::is_of_container(header.record_type)
            || ModelKind::of_record(header.record_type).is_some();
        if !defined && header.critical {
            return Err(ErrorDetail::found(
                ErrorKind::UnknownCritical,
                header.record_type,
            ));
        }
        if defined && !header.critical {
            return Err(ErrorDetail::found(
                ErrorKind::CriticalBit,
                header.record_type,
            ));
        }
        if defined && header.version != 0 {
            return Err(ErrorDetail::found(ErrorKind::RecordVersion, header.version));
        }
        let is_stream = header.record_type == record_type::STREAM;
        if is_stream != self.session.rate.is_none() {
            return Err(ErrorKind::NoStream.into());
        }
        let wanted = !self.resynchronising
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
        let (stored, unpacked) = (header.stored_bytes, header.unpacked_bytes);
        self.limits.check_record(stored.into(), unpacked.into())?;
        self.limits.check_work(self.session.work(), self.position)?;
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
            let more = missing.min(taken.max(self.stored.len()));
            if let Err(fault) = reserve_exact(&mut self.stored, more) {
                return self.fail(fault, Recovery::Impossible, self.record_start);
            }
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
            // A group that builds on a lost state, and others like it: it goes on to the next record.
            Err(failure) if self.resynchronising && failure.kind != ErrorKind::Memory => {
                self.session.rollback();
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
    fn record(&mut self, stored: &[u8]) -> core::result::Result<Option<Event>, ErrorDetail> {
        let header = self.header;
        let packing =
            Unpacker::check_lengths(header.packing, header.stored_bytes, header.unpacked_bytes)?;
        let bytes = header.unpacked_bytes as usize;
        let model = ModelKind::of_record(header.record_type);
        if let Some(kind) = model
            && packing == Packing::None
        {
            // The copy is staged only once its CRC is known to match.
            let memory = self.session.reserve_content(bytes, &self.limits);
            let (crc, memory) = match memory {
                Ok(memory) => (crc32c_copy(stored, memory), Ok(())),
                Err(failure) => (crc32c(stored), Err(failure)),
            };
            if crc != header.payload_crc {
                return Err(ErrorKind::PayloadChecksum.into());
            }
            memory?;
            self.session.content(kind, bytes)?;
            return Ok(None);
        }
        if crc32c(stored) != header.payload_crc {
            return Err(ErrorKind::PayloadChecksum.into());
        }
        let window = self.limits.zstd_window_bytes;
        if let Some(kind) = model {
            let memory = self.session.reserve_content(bytes, &self.limits)?;
            self.unpacker.unpack(packing, stored, memory, window)?;
            self.session.content(kind, bytes)?;
            return Ok(None);
        }
        if packing == Packing::None {
            return self.small_record(stored);
        }
        let mut payload = mem::take(&mut self.payload);
        payload.clear();
        reserve_exact(&mut payload, bytes)?;
        payload.resize(bytes, 0);
        let result = match self.unpacker.unpack(packing, stored, &mut payload, window) {
            Ok(()) => self.small_record(&payload),
            Err(failure) => Err(failure),
        };
        self.payload = payload;
        result
    }

    fn small_record(&mut self, payload: &[u8]) -> core::result::Result<Option<Event>, ErrorDetail> {
        Ok(match self.header.record_type {
            record_type::STREAM => Some(Event::Stream(self.session.stream(payload)?)),
            record_type::GROUP => {
                let (id, start) = self.session.group(payload)?;
                self.resynchronising = false;
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

    fn end(&mut self, end: End) -> core::result::Result<(), ErrorDetail> {
        if self.session.is_open() && !self.resynchronising {
            return Err(ErrorKind::Uncommitted.into());
        }
        if !self.damaged && end.records != self.records {
            return Err(ErrorKind::EndCount.into());
        }
        if !self.damaged && end.digest != self.digest.finish() {
            return Err(ErrorKind::EndDigest.into());
        }
        self.phase = Phase::Ended;
        Ok(())
    }

    /// Stops: drops the pending frame and remembers how to go on.
    fn fail<T>(
        &mut self,
        failure: impl Into<ErrorDetail>,
        recovery: Recovery,
        offset: u64,
    ) -> Result<T> {
        self.session.rollback();
        self.stored.clear();
        self.head_bytes = 0;
        if recovery == Recovery::AtHeader {
            self.record_start = self.position;
        }
        self.phase = Phase::Failed(recovery);
        Err(failure.into().at(offset))
    }

    pub(super) fn error(&self, fault: ErrorKind) -> crate::Error {
        ErrorDetail::from(fault).at(self.position)
    }
}
