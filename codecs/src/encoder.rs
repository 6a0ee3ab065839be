//! The encoder: appends records to a `Vec<u8>` that the caller owns.

use alloc::vec::Vec;
use core::hash::Hasher as _;

use crate::Limits;
use crate::container::pack::Packer;
use crate::container::unpack::Unpacker;
use crate::container::{
    CONTAINER_VERSION, Compression, HEADER_BYTES, Packing, Preamble, RecordHeader, crc32c, profile,
    record_type,
};
use crate::error::{ErrorDetail, ErrorKind, Result};
use crate::models::ModelKind;
use crate::models::payload_header::Coverage;
use crate::session::records::{Commit, End, GroupStart, TickRate};
use crate::session::track::{Track, write_removed, write_tracks};
use crate::session::transforms::{Transform, write_transforms};
use crate::session::{self, Session};

/// A call for content is split into records of about this many payload bytes, well below what the
/// default limits accept.
const RECORD_BYTES: usize = 16 << 20;

/// How a stream is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderConfig {
    /// Ticks a second.
    pub tick_rate: TickRate,
    /// Container version to write; 1 is the only one.
    pub container_version: u16,
    /// Limits of the decoders that shall read the stream: what exceeds them is refused.
    pub limits: Limits,
}

impl Default for EncoderConfig {
    fn default() -> Self {
        EncoderConfig {
            tick_rate: TickRate::default(),
            container_version: CONTAINER_VERSION,
            limits: Limits::default(),
        }
    }
}

/// Writes a stream, record by record.
///
/// Each call appends whole records to `out`, or appends nothing and returns an error, after which the
/// encoder can still be used. The caller may take bytes out of `out` between calls. A frame is what
/// stands between two commits.
///
/// An encoder keeps the state that its stream decodes to, and checks every record against it with
/// the code that a decoder has. So it refuses what a decoder with the same [`Limits`] refuses, with
/// the same error numbers, and needs as much memory for state as that decoder.
pub struct Encoder {
    limits: Limits,
    packer: Packer,
    payload: Vec<u8>,
    /// The state of a decoder that has read the stream so far.
    session: Session,
    headers: twox_hash::XxHash64,
    records: u64,
    written: u64,
    groups: u32,
    ended: bool,
}

/// A point in the stream that the encoder can roll back to.
struct Checkpoint {
    out_bytes: usize,
    headers: twox_hash::XxHash64,
    records: u64,
    written: u64,
    session: session::Checkpoint,
}

impl Encoder {
    /// Starts a stream: writes the preamble and the `stream` record.
    ///
    /// # Errors
    /// 1003 for another version, 2003 for a tick rate with a zero.
    pub fn new(config: EncoderConfig, out: &mut Vec<u8>) -> Result<Encoder> {
        if config.container_version != CONTAINER_VERSION {
            return Err(ErrorDetail::from(ErrorKind::ContainerVersion).at(0));
        }
        let start = out.len();
        let preamble = Preamble {
            version: config.container_version,
            profile: profile::STREAM,
        };
        preamble.write(out);
        let mut headers = twox_hash::XxHash64::with_seed(0);
        headers.write(&out[start..]);
        let mut encoder = Encoder {
            limits: config.limits,
            packer: Packer::default(),
            payload: Vec::new(),
            session: Session::default(),
            headers,
            records: 0,
            written: (out.len() - start) as u64,
            groups: 0,
            ended: false,
        };
        let written = encoder.record(
            out,
            (record_type::STREAM, Compression::None),
            |_, payload| Ok(config.tick_rate.write(payload)?),
            |session, payload, _| session.stream(payload),
        );
        written.inspect_err(|_| out.truncate(start))?;
        Ok(encoder)
    }

    /// Declares tracks; ids ascend, within the call and over the stream. A declared track may be
    /// declared again with the same content, so that a group can be joined.
    ///
    /// # Errors
    /// 2004 to 2018, 2020, 2022 to 2026.
    pub fn tracks(&mut self, out: &mut Vec<u8>, tracks: &[Track]) -> Result<()> {
        self.record(
            out,
            (record_type::TRACK, Compression::Lz4),
            |_, payload| write_tracks(tracks, payload),
            |session, payload, limits| session.declare(payload, limits),
        )?;
        Ok(())
    }

    /// Ends tracks at the next commit; ids ascend.
    ///
    /// # Errors
    /// 2004, 2019, 4010 for a track with content in this frame.
    pub fn remove_tracks(&mut self, out: &mut Vec<u8>, ids: &[u32]) -> Result<()> {
        self.record(
            out,
            (record_type::TRACK_REMOVE, Compression::None),
            |_, payload| Ok(write_removed(ids, payload)?),
            |session, payload, _| session.remove(payload),
        )
    }

    /// Starts a group. After [`GroupStart::Keyframes`] the first frame must have a keyframe of
    /// every track that is not to be empty, and the transform of every track that has one.
    ///
    /// # Errors
    /// 4002 for a digest that is not that of the state, 4006 inside a frame.
    pub fn group(&mut self, out: &mut Vec<u8>, start: GroupStart) -> Result<()> {
        let id = self.groups;
        self.record(
            out,
            (record_type::GROUP, Compression::None),
            |_, payload| {
                start.write(id, payload);
                Ok(())
            },
            |session, payload, _| session.group(payload),
        )?;
        self.groups = id.wrapping_add(1);
        Ok(())
    }

    /// Transforms of the frame, ids ascending; at most one call a frame. A track that is not named
    /// keeps its last transform.
    ///
    /// # Errors
    /// 2004, 2009, 2019, 4008 before the first group, 4010 for a second call.
    pub fn transforms(
        &mut self,
        out: &mut Vec<u8>,
        transforms: &[(u32, Transform)],
        compression: Compression,
    ) -> Result<()> {
        self.record(
            out,
            (record_type::TRANSFORMS, compression),
            |_, payload| Ok(write_transforms(transforms, payload)?),
            |session, payload, _| session.transforms(payload),
        )
    }

    /// Model records with all updates, each with as many as fit. `bytes` is about what an update
    /// takes; `write` appends the payload of some, given the base.
    pub(crate) fn content<U>(
        &mut self,
        out: &mut Vec<u8>,
        (kind, compression): (ModelKind, Compression),
        coverage: Coverage,
        updates: &[U],
        bytes: impl Fn(&U) -> usize,
        write: impl Fn(&Session, Option<u32>, &[U], &mut Vec<u8>) -> core::result::Result<(), ErrorKind>,
    ) -> Result<()> {
        let base = match (coverage, self.last_frame()) {
            (Coverage::Keyframe, _) => None,
            (Coverage::Delta, Some(frame)) => Some(frame),
            (Coverage::Delta, None) => {
                return Err(ErrorDetail::from(ErrorKind::MissingBase).at(self.written));
            }
        };
        let most = RECORD_BYTES.min(self.limits.unpacked_bytes as usize / 2);
        let before = Checkpoint {
            out_bytes: out.len(),
            headers: self.headers.clone(),
            records: self.records,
            written: self.written,
            session: self.session.checkpoint(),
        };
        let mut rest = updates;
        while !rest.is_empty() {
            let mut sum = 0;
            let count = rest.iter().take_while(|update| {
                sum += bytes(update);
                sum <= most
            });
            let (now, later) = rest.split_at(count.count().max(1));
            rest = later;
            let result = self.record(
                out,
                (kind.descriptor().record_type, compression),
                |session, payload| Ok(write(session, base, now, payload)?),
                |session, payload, limits| {
                    let bytes = payload.len();
                    let memory = session.reserve_content(bytes, limits)?;
                    memory.copy_from_slice(payload);
                    session.content(kind, bytes)
                },
            );
            if let Err(error) = result {
                self.rollback_to(before, out);
                return Err(crate::Error {
                    offset: self.written,
                    ..error
                });
            }
        }
        Ok(())
    }

    /// Drops the content that was written since a checkpoint in the same frame.
    fn rollback_to(&mut self, checkpoint: Checkpoint, out: &mut Vec<u8>) {
        out.truncate(checkpoint.out_bytes);
        self.headers = checkpoint.headers;
        self.records = checkpoint.records;
        self.written = checkpoint.written;
        self.session.rollback_to(checkpoint.session);
    }

    /// Makes the frame visible. Returns its number: 0, 1, 2...
    ///
    /// `digest` is that of the state after the frame ([`StateDigest`](crate::StateDigest)).
    ///
    /// # Errors
    /// 4003 after 2^32 - 1 frames, 4004 for a tick before the last one, 4005 for a digest that is not
    /// that of the state, 4008 before the first group.
    pub fn commit(&mut self, out: &mut Vec<u8>, tick: u64, digest: Option<u64>) -> Result<u32> {
        let frame = match self.last_frame() {
            None => Some(0),
            Some(last) => last.checked_add(1),
        };
        let info = self.record(
            out,
            (record_type::COMMIT, Compression::None),
            |_, payload| {
                let frame = frame.ok_or(ErrorKind::FrameNumber)?;
                Commit {
                    tick,
                    frame,
                    digest,
                }
                .write(payload);
                Ok(())
            },
            |session, payload, _| session.commit(payload),
        )?;
        self.session.clear_dirty();
        Ok(info.number)
    }

    /// Ends the stream; every call after it is refused.
    ///
    /// # Errors
    /// 4006 inside a frame.
    pub fn end(&mut self, out: &mut Vec<u8>) -> Result<()> {
        let end = End {
            records: self.records,
            digest: self.headers.finish(),
        };
        self.record(
            out,
            (record_type::END, Compression::None),
            |session, payload| {
                if session.is_open() {
                    return Err(ErrorKind::Uncommitted.into());
                }
                end.write(payload);
                Ok(())
            },
            |_, _, _| Ok(()),
        )?;
        self.ended = true;
        Ok(())
    }

    /// Bytes written so far, the preamble included.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// The last committed frame.
    pub fn last_frame(&self) -> Option<u32> {
        self.session.last.map(|(frame, _)| frame)
    }

    /// Digest of the state of the last commit: what [`GroupStart::State`] names.
    pub fn state_digest(&self) -> u64 {
        self.session.state_digest()
    }

    /// Appends a record, or nothing. `write` appends its payload; `read` is what a decoder does with
    /// it, which has the last word.
    fn record<T>(
        &mut self,
        out: &mut Vec<u8>,
        (kind, compression): (u16, Compression),
        write: impl FnOnce(&Session, &mut Vec<u8>) -> core::result::Result<(), ErrorDetail>,
        read: impl FnOnce(&mut Session, &[u8], &Limits) -> core::result::Result<T, ErrorDetail>,
    ) -> Result<T> {
        let start = out.len();
        let result = self.pack(out, compression, write).and_then(|packing| {
            let work = self.session.work();
            self.limits
                .check_work(work, self.written + HEADER_BYTES as u64)?;
            let value = read(&mut self.session, &self.payload, &self.limits)?;
            Ok((packing, value))
        });
        let (packing, value) = result.map_err(|failure| {
            out.truncate(start);
            failure.at(self.written)
        })?;
        let payload_start = start + HEADER_BYTES;
        let header = RecordHeader {
            record_type: kind,
            critical: true,
            version: 0,
            packing: packing as u8,
            sequence: self.records,
            stored_bytes: (out.len() - payload_start) as u32,
            unpacked_bytes: self.payload.len() as u32,
            payload_crc: crc32c(&out[payload_start..]),
        };
        let bytes = header.to_bytes();
        out[start..payload_start].copy_from_slice(&bytes);
        self.headers.write(&bytes);
        self.records += 1;
        self.written += (out.len() - start) as u64;
        Ok(value)
    }

    /// Appends an empty header and a packed payload within the limits, and leaves the payload as it
    /// was before packing in `self.payload`.
    fn pack(
        &mut self,
        out: &mut Vec<u8>,
        compression: Compression,
        write: impl FnOnce(&Session, &mut Vec<u8>) -> core::result::Result<(), ErrorDetail>,
    ) -> core::result::Result<Packing, ErrorDetail> {
        if self.ended {
            return Err(ErrorKind::TrailingBytes.into());
        }
        self.payload.clear();
        write(&self.session, &mut self.payload)?;
        out.extend_from_slice(&[0; HEADER_BYTES]);
        let start = out.len();
        let window = self.limits.zstd_window_bytes;
        let packing = self.packer.pack(compression, &self.payload, window, out)?;
        let stored = &out[start..];
        self.limits
            .check_record(stored.len() as u64, self.payload.len() as u64)?;
        Unpacker::check(packing, stored, self.payload.len(), window)?;
        Ok(packing)
    }
}
