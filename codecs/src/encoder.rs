//! The encoder: appends records to a `Vec<u8>` that the caller owns.

use alloc::vec::Vec;
use core::hash::Hasher as _;

use crate::container::pack::Packer;
use crate::container::{
    CONTAINER_VERSION, Compression, Preamble, RecordHeader, crc32c, profile, record_type,
};
use crate::content::Coverage;
use crate::error::{Failure, Fault, Result};
use crate::model::Model;
use crate::points::{self, Update};
use crate::probes;
use crate::session::{Commit, End, GroupStart, TickRate};
use crate::track::{Track, write_removed, write_tracks};
use crate::transforms::{Transform, write_transforms};

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
}

impl Default for EncoderConfig {
    fn default() -> Self {
        EncoderConfig {
            tick_rate: TickRate::default(),
            container_version: CONTAINER_VERSION,
        }
    }
}

/// Writes a stream, record by record.
///
/// Each call appends whole records to `out`, or appends nothing and returns an error. The caller
/// may take bytes out of `out` between calls. A frame is what stands between two commits.
///
/// The encoder checks what it can without a copy of the state: ranges, order, widths. That a
/// bucket names the right cells is the caller's duty, and a decoder's check.
pub struct Encoder {
    packer: Packer,
    payload: Vec<u8>,
    headers: twox_hash::XxHash64,
    records: u64,
    written: u64,
    groups: u32,
    /// Declared tracks, ids ascending.
    tracks: Vec<(u32, Model)>,
    /// Last committed frame.
    frame: Option<u32>,
}

impl Encoder {
    /// Starts a stream: writes the preamble and the `stream` record.
    ///
    /// # Errors
    /// 1003 for another version, 2003 for a tick rate with a zero.
    pub fn new(config: EncoderConfig, out: &mut Vec<u8>) -> Result<Encoder> {
        if config.container_version != CONTAINER_VERSION {
            return Err(Failure::from(Fault::ContainerVersion).at(0));
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
            packer: Packer::default(),
            payload: Vec::new(),
            headers,
            records: 0,
            written: (out.len() - start) as u64,
            groups: 0,
            tracks: Vec::new(),
            frame: None,
        };
        let written = encoder.record(out, record_type::STREAM, Compression::None, |payload| {
            Ok(config.tick_rate.write(payload)?)
        });
        written.inspect_err(|_| out.truncate(start))?;
        Ok(encoder)
    }

    /// Declares tracks; ids ascend, within the call and over the stream. A live track may be
    /// declared again with the same content, so that a group can be joined.
    ///
    /// # Errors
    /// 2004 to 2020: what a decoder would say.
    pub fn tracks(&mut self, out: &mut Vec<u8>, tracks: &[Track]) -> Result<()> {
        self.record(out, record_type::TRACK, Compression::Lz4, |payload| {
            write_tracks(tracks, payload)
        })?;
        for track in tracks {
            let model = track.model;
            match self.tracks.binary_search_by_key(&track.id, |&(id, _)| id) {
                Ok(at) => self.tracks[at].1 = model,
                Err(at) => self.tracks.insert(at, (track.id, model)),
            }
        }
        Ok(())
    }

    /// Ends tracks at the next commit; ids ascend.
    ///
    /// # Errors
    /// 2004 if they do not.
    pub fn remove_tracks(&mut self, out: &mut Vec<u8>, ids: &[u32]) -> Result<()> {
        self.record(
            out,
            record_type::TRACK_REMOVE,
            Compression::None,
            |payload| Ok(write_removed(ids, payload)?),
        )?;
        self.tracks.retain(|(id, _)| ids.binary_search(id).is_err());
        Ok(())
    }

    /// Starts a group. After [`GroupStart::Keyframes`] the first frame must have a keyframe of
    /// every track that is not to be empty, and the transform of every track that has one.
    ///
    /// # Errors
    /// None that depend on the arguments.
    pub fn group(&mut self, out: &mut Vec<u8>, start: GroupStart) -> Result<()> {
        let id = self.groups;
        self.record(out, record_type::GROUP, Compression::None, |payload| {
            start.write(id, payload);
            Ok(())
        })?;
        self.groups = id.wrapping_add(1);
        Ok(())
    }

    /// Transforms of the frame, ids ascending; at most one call a frame. A track that is not named
    /// keeps its last transform.
    ///
    /// # Errors
    /// 2004, 2009.
    pub fn transforms(
        &mut self,
        out: &mut Vec<u8>,
        transforms: &[(u32, Transform)],
        compression: Compression,
    ) -> Result<()> {
        self.record(out, record_type::TRANSFORMS, compression, |payload| {
            Ok(write_transforms(transforms, payload)?)
        })
    }

    /// Content of the frame, ids ascending over all calls of one frame; each track at most once a
    /// frame. A delta builds on the last committed frame. No record is written for no updates.
    ///
    /// # Errors
    /// 4001 for a delta before the first commit, 2004, 2019, 2027, 3003, 3004, 3008, 3010, 4012.
    pub fn points(
        &mut self,
        out: &mut Vec<u8>,
        coverage: Coverage,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        let bytes = |update: &Update<'_>| 36 * (update.buckets.len() + update.cells.len());
        self.content(
            out,
            (record_type::POINTS, compression),
            coverage,
            updates,
            bytes,
            |base, now, tracks, payload| {
                let grid_of = |id| match model_of(tracks, id)? {
                    Model::Points(grid) => Ok(grid),
                    _ => Err(Fault::TrackModel),
                };
                points::write_payload(base, now, grid_of, payload)
            },
        )
    }

    /// Content of the frame for volumes of probes, with the same rules as [`Encoder::points`].
    ///
    /// # Errors
    /// 4001 for a delta before the first commit, 2004, 2019, 2027, 3103, 3104, 4012.
    pub fn probes(
        &mut self,
        out: &mut Vec<u8>,
        coverage: Coverage,
        updates: &[probes::Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        let bytes = |update: &probes::Update<'_>| {
            56 * update.probes.len() + update.visibility.map_or(0, <[u8]>::len)
        };
        self.content(
            out,
            (record_type::PROBES, compression),
            coverage,
            updates,
            bytes,
            |base, now, tracks, payload| {
                let volume_of = |id| match model_of(tracks, id)? {
                    Model::Probes(volume) => Ok(volume),
                    _ => Err(Fault::TrackModel),
                };
                probes::write_payload(base, now, volume_of, payload)
            },
        )
    }

    /// Model records with all updates, each with as many as fit. `bytes` is about what an update
    /// takes; `write` appends the payload of some, given the base and the tracks.
    fn content<U>(
        &mut self,
        out: &mut Vec<u8>,
        (kind, compression): (u16, Compression),
        coverage: Coverage,
        updates: &[U],
        bytes: impl Fn(&U) -> usize,
        write: impl Fn(
            Option<u32>,
            &[U],
            &[(u32, Model)],
            &mut Vec<u8>,
        ) -> core::result::Result<(), Fault>,
    ) -> Result<()> {
        let base = match (coverage, self.frame) {
            (Coverage::Keyframe, _) => None,
            (Coverage::Delta, Some(frame)) => Some(frame),
            (Coverage::Delta, None) => return Err(self.error(Fault::MissingBase)),
        };
        let start = out.len();
        let tracks = core::mem::take(&mut self.tracks);
        let mut rest = updates;
        let mut result = Ok(());
        while !rest.is_empty() && result.is_ok() {
            let mut sum = 0;
            let count = rest.iter().take_while(|update| {
                sum += bytes(update);
                sum <= RECORD_BYTES
            });
            let (now, later) = rest.split_at(count.count().max(1));
            rest = later;
            result = self.record(out, kind, compression, |payload| {
                Ok(write(base, now, &tracks, payload)?)
            });
        }
        self.tracks = tracks;
        if result.is_err() && out.len() > start {
            // Records of this call went out already: taking them back would break the sequence.
            return Err(self.error(Fault::EncoderUse));
        }
        result
    }

    /// Makes the frame visible. Returns its number: 0, 1, 2...
    ///
    /// `digest` is that of the state after the frame ([`StateDigest`](crate::StateDigest)).
    ///
    /// # Errors
    /// 4003 after 2^32 - 1 frames.
    pub fn commit(&mut self, out: &mut Vec<u8>, tick: u64, digest: Option<u64>) -> Result<u32> {
        let frame = match self.frame {
            None => 0,
            Some(last) => last
                .checked_add(1)
                .ok_or_else(|| self.error(Fault::FrameNumber))?,
        };
        self.record(out, record_type::COMMIT, Compression::None, |payload| {
            Commit {
                tick,
                frame,
                digest,
            }
            .write(payload);
            Ok(())
        })?;
        self.frame = Some(frame);
        Ok(frame)
    }

    /// Ends the stream.
    ///
    /// # Errors
    /// None that depend on the arguments.
    pub fn end(mut self, out: &mut Vec<u8>) -> Result<()> {
        let end = End {
            records: self.records,
            digest: self.headers.finish(),
        };
        self.record(out, record_type::END, Compression::None, |payload| {
            end.write(payload);
            Ok(())
        })
    }

    /// Bytes written so far, the preamble included.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// The last committed frame.
    pub fn last_frame(&self) -> Option<u32> {
        self.frame
    }

    fn error(&self, fault: Fault) -> crate::Error {
        Failure::from(fault).at(self.written)
    }

    fn record(
        &mut self,
        out: &mut Vec<u8>,
        kind: u16,
        compression: Compression,
        write: impl FnOnce(&mut Vec<u8>) -> core::result::Result<(), Failure>,
    ) -> Result<()> {
        self.payload.clear();
        let start = out.len();
        let packed = write(&mut self.payload).and_then(|()| {
            u32::try_from(self.payload.len()).map_err(|_| Fault::EncoderUse)?;
            out.extend_from_slice(&[0; crate::container::HEADER_BYTES]);
            Ok(self.packer.pack(compression, &self.payload, out)?)
        });
        let packing = packed.map_err(|failure| {
            out.truncate(start);
            failure.at(self.written)
        })?;
        let payload_start = start + crate::container::HEADER_BYTES;
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
        Ok(())
    }
}

/// The model of a declared track.
fn model_of(tracks: &[(u32, Model)], id: u32) -> core::result::Result<&Model, Fault> {
    let at = tracks.binary_search_by_key(&id, |&(id, _)| id);
    Ok(&tracks[at.map_err(|_| Fault::UnknownTrack)?].1)
}
