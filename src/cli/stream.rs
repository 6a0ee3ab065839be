//! Decodes a stream from a file, in pieces.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use serde::Serialize;

use super::records::RecordScan;
use crate::codec::points::{Bucket, Cell, EMPTY};
use crate::codec::{self, Decoder, Event, Kind, Layer, Limit, Limits, LiveTrack};
use crate::{Error, Result};

/// Bytes read at once.
const PIECE: usize = 64 << 10;

/// What a stream came to.
pub struct Outcome {
    /// Holds the state of the last commit.
    pub decoder: Decoder,
    /// Bytes read: all of the file, or up to the piece with the fault.
    pub bytes: u64,
    /// Records by type, up to the fault.
    pub records: RecordScan,
    /// Whether the stream ended with an `end` record.
    pub ended: bool,
    /// Why decoding stopped early.
    pub fault: Option<codec::Error>,
}

/// Decodes a file with the default [`Limits`] and calls `on_event` at every event but
/// [`Event::NeedInput`]. A live stream (`live`) may stop after any commit. Memory does not grow
/// with the file: pieces of 64 KB, and what the decoder holds.
///
/// # Errors
/// `Io` where the file cannot be read, and whatever `on_event` gives. A fault of the stream is part
/// of the outcome.
pub fn decode(
    path: &Path,
    live: bool,
    mut on_event: impl FnMut(&Decoder, Event) -> Result<()>,
) -> Result<Outcome> {
    let io = |source| Error::Io {
        path: path.to_path_buf(),
        source,
    };
    let mut file = File::open(path).map_err(io)?;
    let mut outcome = Outcome {
        decoder: Decoder::new(Limits::default()),
        bytes: 0,
        records: RecordScan::default(),
        ended: false,
        fault: None,
    };
    let mut piece = vec![0; PIECE];
    loop {
        let length = match file.read(&mut piece) {
            Ok(0) => break,
            Ok(length) => length,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(io(error)),
        };
        outcome.bytes += length as u64;
        outcome.records.push(&piece[..length]);
        let mut rest = &piece[..length];
        while !rest.is_empty() {
            match outcome.decoder.push(rest) {
                Ok((used, event)) => {
                    rest = &rest[used..];
                    match event {
                        Event::NeedInput => break,
                        Event::End => outcome.ended = true,
                        _ => {}
                    }
                    on_event(&outcome.decoder, event)?;
                }
                Err(fault) => {
                    outcome.fault = Some(fault);
                    return Ok(outcome);
                }
            }
        }
    }
    let decoder = &outcome.decoder;
    let end = if live {
        decoder.finish_live()
    } else {
        decoder.finish()
    };
    outcome.fault = end.err();
    Ok(outcome)
}

/// The committed buckets of a track.
pub fn buckets<'d>(decoder: &'d Decoder, live: &LiveTrack) -> &'d [Bucket] {
    let first = live.first_bucket as usize;
    let count = live.track.grid().bucket_count as usize;
    decoder
        .points()
        .buckets()
        .get(first..first + count)
        .unwrap_or(&[])
}

/// The cells that a bucket of a track names, in its order.
pub fn cells_of<'d>(
    decoder: &'d Decoder,
    live: &LiveTrack,
    bucket: &'d Bucket,
) -> impl Iterator<Item = &'d Cell> + use<'d> {
    let first = live.first_cell as usize;
    let used = bucket.0.iter().take_while(|&&entry| entry != EMPTY);
    used.filter_map(move |&entry| decoder.points().cells().get(first + entry as usize))
}

/// A fault of a stream as a sentence that names the file, and the limit where one is exceeded.
pub fn error(path: &Path, fault: &codec::Error) -> Error {
    let limit = match fault.kind {
        Kind::LimitExceeded { which, .. } => format!("; the limit is {}", limit_name(which)),
        _ => String::new(),
    };
    Error::Invalid(format!("{}: {fault}{limit}", path.display()))
}

/// A fault of a stream as JSON. `which`, `asked` and `allowed` are there for exceeded limits.
#[derive(Debug, Serialize)]
pub struct FaultReport {
    pub layer: &'static str,
    pub kind: &'static str,
    pub id: u16,
    pub name: &'static str,
    /// Byte offset in the stream.
    pub offset: u64,
    pub message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub which: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed: Option<u64>,
}

impl FaultReport {
    /// The report of a fault.
    pub fn new(fault: &codec::Error) -> FaultReport {
        let layer = match fault.layer {
            Layer::Framing => "framing",
            Layer::Record => "record",
            Layer::Codec => "codec",
            Layer::Session => "session",
            _ => "unknown",
        };
        let (mut which, mut asked, mut allowed) = (None, None, None);
        let kind = match fault.kind {
            Kind::Malformed => "Malformed",
            Kind::Truncated => "Truncated",
            Kind::Unsupported => "Unsupported",
            Kind::Checksum => "Checksum",
            Kind::MissingBase => "MissingBase",
            Kind::Usage => "Usage",
            Kind::LimitExceeded {
                which: limit,
                asked: claim,
                allowed: bound,
            } => {
                (which, asked, allowed) = (Some(limit_name(limit)), Some(claim), Some(bound));
                "LimitExceeded"
            }
            _ => "Unknown",
        };
        FaultReport {
            layer,
            kind,
            id: fault.id,
            name: fault.name(),
            offset: fault.offset,
            message: fault.to_string(),
            which,
            asked,
            allowed,
        }
    }
}

fn limit_name(limit: Limit) -> &'static str {
    match limit {
        Limit::StoredBytes => "stored_bytes",
        Limit::UnpackedBytes => "unpacked_bytes",
        Limit::FrameBytes => "frame_bytes",
        Limit::ZstdWindowBytes => "zstd_window_bytes",
        Limit::Tracks => "tracks",
        Limit::PathBytes => "path_bytes",
        Limit::StateBytes => "state_bytes",
        _ => "unknown",
    }
}
