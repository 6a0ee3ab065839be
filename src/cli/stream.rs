//! Decodes a stream from a file, in pieces.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use serde::Serialize;

use super::records::RecordScan;
use crate::codec::{self, Decoder, Event, Kind, Limits};
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

/// A fault of a stream as a sentence that names the file, and the limit where one is exceeded.
pub fn error(path: &Path, fault: &codec::Error) -> Error {
    let limit = match fault.kind {
        Kind::LimitExceeded { which, .. } => format!("; the limit is {}", which.name()),
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
        let (which, asked, allowed) = match fault.kind {
            Kind::LimitExceeded {
                which,
                asked,
                allowed,
            } => (Some(which.name()), Some(asked), Some(allowed)),
            _ => (None, None, None),
        };
        FaultReport {
            layer: fault.layer.name(),
            kind: fault.kind.name(),
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
