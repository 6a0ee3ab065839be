//! Decodes a stream from a file or standard input, in pieces.

use std::fs::File;
use std::io::{Cursor, ErrorKind, Read, Seek};
use std::path::Path;

use serde::Serialize;

use super::limits;
use super::records::RecordScan;
use crate::codec::container::{CONTAINER_VERSION, MAGIC, PREAMBLE_BYTES};
use crate::codec::{self, Decoder, ErrorClass, Event, Limits};
use crate::scene::{GltfFile, LoadOptions, Scene};
use crate::{Error, Result};

/// Bytes read at once.
const PIECE: usize = 64 << 10;
/// Error numbers that the command line treats on their own.
const CONTAINER_VERSION_ERROR: u16 = 1003;
const RECORD_GAP: u16 = 1008;

/// How a stream is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadOptions {
    pub limits: Limits,
    /// It may stop after any commit.
    pub live: bool,
    /// After a fault, go on at the next group that can be decoded.
    pub resume: bool,
    /// Records may be missing between the `stream` record and the first group that can be decoded.
    pub join: bool,
}

/// What a stream came to.
pub struct Outcome {
    /// Holds the state of the last commit.
    pub decoder: Decoder,
    /// Bytes of the file, or of standard input as far as it was read.
    pub bytes: u64,
    /// Whole records by type, up to the fault.
    pub records: RecordScan,
    /// Whether the stream ended with an `end` record.
    pub ended: bool,
    /// Why decoding stopped early.
    pub fault: Option<codec::Error>,
}

/// A stream that is open for reading.
pub struct Source {
    reader: Box<dyn Read>,
    name: String,
    /// Bytes of a file; none where that is not known.
    length: Option<u64>,
}

impl Source {
    /// Opens a file, or standard input for `-`.
    ///
    /// # Errors
    /// `Io` where that is impossible.
    pub fn open(path: &Path) -> Result<Source> {
        let name = name(path);
        if path.as_os_str() == "-" {
            return Ok(Source {
                reader: Box::new(std::io::stdin()),
                name,
                length: None,
            });
        }
        let io = |source| Error::Io {
            path: path.to_path_buf(),
            source,
        };
        let mut file = File::open(path).map_err(io)?;
        let metadata = file.metadata().map_err(io)?;
        if metadata.is_file() && is_gltf(path, &mut file).map_err(io)? {
            return Source::attached(path)?.ok_or_else(|| Error::Scene {
                name,
                message: "the file is a scene without a stream".into(),
            });
        }
        Ok(Source {
            reader: Box::new(file),
            name,
            length: metadata.is_file().then_some(metadata.len()),
        })
    }

    /// The stream in a glTF file (`spec/gltf.md`); `None` where it has none.
    ///
    /// # Errors
    /// `Io` and `Scene` where the file cannot be read.
    pub fn attached(path: &Path) -> Result<Option<Source>> {
        let bytes = Scene::read_file(path)?;
        let options = LoadOptions {
            colors: false,
            ..LoadOptions::default()
        };
        let failed = |message| Error::Scene {
            name: name(path),
            message,
        };
        let file = GltfFile::open(&bytes, path.parent(), &options).map_err(failed)?;
        let stream = file.stream().map_err(failed)?;
        Ok(stream.map(|stream| Source {
            length: Some(stream.len() as u64),
            reader: Box::new(Cursor::new(stream.into_owned())),
            name: name(path),
        }))
    }

    /// All bytes.
    ///
    /// # Errors
    /// `Io` where they cannot be read.
    pub fn read_all(mut self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        match self.reader.read_to_end(&mut bytes) {
            Ok(_) => Ok(bytes),
            Err(source) => Err(Error::Io {
                path: self.name.into(),
                source,
            }),
        }
    }

    /// Fills some of `piece` with what comes next, as soon as there is some. 0 at the end.
    ///
    /// # Errors
    /// `Io` where it cannot be read.
    pub fn read(&mut self, piece: &mut [u8]) -> Result<usize> {
        loop {
            match self.reader.read(piece) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                result => {
                    return result.map_err(|source| Error::Io {
                        path: self.name.clone().into(),
                        source,
                    });
                }
            }
        }
    }
}

/// Whether a file is a glTF file, by its first bytes or by its name.
fn is_gltf(path: &Path, file: &mut File) -> std::io::Result<bool> {
    let mut magic = Vec::new();
    file.take(4).read_to_end(&mut magic)?;
    file.rewind()?;
    let is_text = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("gltf"));
    Ok(magic == b"glTF" || is_text && !MAGIC.starts_with(&magic))
}

/// The name of a stream in messages.
pub fn name(path: &Path) -> String {
    match path.as_os_str() == "-" {
        true => "standard input".to_owned(),
        false => path.display().to_string(),
    }
}

/// Decodes a stream and calls `on_event` at every event but [`Event::NeedInput`], and at every fault
/// after which the decoder goes on. Memory does not grow with the stream: pieces of 64 KB, and what
/// the decoder holds.
///
/// # Errors
/// `Io` where the stream cannot be read, and whatever `on_event` gives. The fault that ends a stream
/// is part of the outcome.
pub fn decode(
    path: &Path,
    options: &ReadOptions,
    mut on_event: impl FnMut(&Decoder, std::result::Result<Event, codec::Error>) -> Result<()>,
) -> Result<Outcome> {
    let mut source = Source::open(path)?;
    let mut outcome = Outcome {
        decoder: Decoder::new(options.limits),
        bytes: 0,
        records: RecordScan::default(),
        ended: false,
        fault: None,
    };
    let mut piece = vec![0; PIECE];
    loop {
        let length = source.read(&mut piece)?;
        outcome.bytes += length as u64;
        let going_on = outcome.take(&piece[..length], options, &mut on_event)?;
        if length == 0 || !going_on {
            break;
        }
    }
    if let Some(length) = source.length {
        outcome.bytes = length;
    }
    if outcome.fault.is_none() {
        let decoder = &outcome.decoder;
        let end = match options.live {
            true => decoder.finish_live(),
            false => decoder.finish(),
        };
        outcome.fault = end.err();
    }
    Ok(outcome)
}

impl Outcome {
    /// Takes the next piece of the stream. Whether the stream goes on.
    fn take(
        &mut self,
        mut rest: &[u8],
        options: &ReadOptions,
        on_event: &mut impl FnMut(&Decoder, std::result::Result<Event, codec::Error>) -> Result<()>,
    ) -> Result<bool> {
        while !rest.is_empty() {
            let start = self.decoder.position();
            let result = self.decoder.push(rest);
            let used = (self.decoder.position() - start) as usize;
            match result {
                Ok((_, event)) => {
                    self.records.push(&rest[..used]);
                    match event {
                        Event::NeedInput => return Ok(true),
                        Event::End => self.ended = true,
                        _ => {}
                    }
                    on_event(&self.decoder, Ok(event))?;
                }
                Err(fault) => {
                    let joins = options.join
                        && fault.id == RECORD_GAP
                        && self.decoder.last_frame().is_none();
                    if !((joins || options.resume) && self.decoder.resume()) {
                        let sound = fault.offset.max(PREAMBLE_BYTES as u64);
                        let sound = sound.saturating_sub(start) as usize;
                        self.records.push(&rest[..sound.min(used)]);
                        self.fault = Some(fault);
                        return Ok(false);
                    }
                    // Looking at a header again uses no bytes, or those of an empty record.
                    self.records.push(&rest[..used]);
                    if !joins {
                        on_event(&self.decoder, Err(fault))?;
                    }
                }
            }
            rest = &rest[used..];
        }
        Ok(true)
    }
}

/// A fault of a stream as a sentence that names the file, and the option for a limit.
pub fn error(path: &Path, fault: &codec::Error) -> Error {
    let name = name(path);
    let text = match (fault.class, fault.found) {
        (_, Some(version))
            if fault.id == CONTAINER_VERSION_ERROR && version > u64::from(CONTAINER_VERSION) =>
        {
            format!(
                "E{} {}: container version {version} is newer than this program, which reads version \
                 {CONTAINER_VERSION}",
                fault.id,
                fault.name()
            )
        }
        (ErrorClass::LimitExceeded { which, .. }, _) => {
            let (limit, option) = (which.name(), limits::option(which.name()));
            format!("{fault}; the limit is {limit}, which {option} sets")
        }
        _ => fault.to_string(),
    };
    Error::Invalid(format!("{name}: {text}"))
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
    /// The number that the stream has in the place of one that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<u64>,
    /// The track that is at fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<u32>,
}

impl FaultReport {
    /// The report of a fault.
    pub fn new(fault: &codec::Error) -> FaultReport {
        let (which, asked, allowed) = match fault.class {
            ErrorClass::LimitExceeded {
                which,
                asked,
                allowed,
            } => (Some(which.name()), Some(asked), Some(allowed)),
            _ => (None, None, None),
        };
        FaultReport {
            layer: fault.layer.name(),
            kind: fault.class.name(),
            id: fault.id,
            name: fault.name(),
            offset: fault.offset,
            message: fault.to_string(),
            which,
            asked,
            allowed,
            found: fault.found,
            track: fault.track,
        }
    }
}
