//! Errors: a layer, a class, a stable number and a byte offset.

mod kinds;

use core::fmt;

use crate::container::record_type;
pub(crate) use kinds::ErrorKind;
use kinds::TABLE;

/// The result of everything in this crate that can fail.
pub type Result<T> = core::result::Result<T, Error>;

/// What went wrong, and where. `Display` gives one sentence.
///
/// `id` is stable: it means the same error in every version of the library, and the table in
/// `spec/README.md` lists it. [`Error::name`] is its short name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// The layer of the format that the error belongs to.
    pub layer: Layer,
    /// The class of the error, which a program may branch on.
    pub class: ErrorClass,
    /// The stable number, such as 3005.
    pub id: u16,
    /// Byte offset in the stream: of the preamble, the record header or the record payload at
    /// fault. For an encoder, the number of bytes written so far.
    pub offset: u64,
    /// The number that the stream has in the place of one that is known: of a version, a profile, a
    /// record type, a packing, a model, a coding, a lookup space or a group start.
    pub found: Option<u64>,
    /// The track whose declaration is at fault.
    pub track: Option<u32>,
}

/// The layer of the format that an error belongs to; the first digit of its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Layer {
    /// Preamble, record headers, checksums, compression (1xxx).
    Framing,
    /// The fields of a record (2xxx).
    Record,
    /// The contents of a model's payload (3xxx).
    Codec,
    /// The order of records and the state they build (4xxx).
    Session,
}

impl Layer {
    /// Its name in reports, such as `framing`.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Framing => "framing",
            Layer::Record => "record",
            Layer::Codec => "codec",
            Layer::Session => "session",
        }
    }

    /// Its stable number: the thousands of its errors' ids.
    pub fn number(self) -> u32 {
        match self {
            Layer::Framing => 1,
            Layer::Record => 2,
            Layer::Codec => 3,
            Layer::Session => 4,
        }
    }
}

/// The class of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorClass {
    /// The bytes break a rule of the format.
    Malformed,
    /// The input ends too early.
    Truncated,
    /// The bytes may be right, but need a newer or larger decoder.
    Unsupported,
    /// A checksum or digest does not match.
    Checksum,
    /// The stream asks for more than [`crate::Limits`] allows.
    LimitExceeded {
        /// Which limit.
        which: Limit,
        /// What the stream asks for.
        asked: u64,
        /// What the limit allows.
        allowed: u64,
    },
    /// A delta or a group builds on a state that this decoder does not hold.
    MissingBase,
    /// The caller used the library out of order; no fault of the bytes.
    Usage,
    /// The machine does not have memory that the limits allow; no fault of the bytes.
    OutOfMemory,
}

impl ErrorClass {
    /// Its name in reports and in the table of `spec/README.md`, such as `LimitExceeded`.
    pub fn name(self) -> &'static str {
        match self {
            ErrorClass::Malformed => "Malformed",
            ErrorClass::Truncated => "Truncated",
            ErrorClass::Unsupported => "Unsupported",
            ErrorClass::Checksum => "Checksum",
            ErrorClass::LimitExceeded { .. } => "LimitExceeded",
            ErrorClass::MissingBase => "MissingBase",
            ErrorClass::Usage => "Usage",
            ErrorClass::OutOfMemory => "OutOfMemory",
        }
    }

    /// Its stable number, for interfaces of other languages.
    pub fn number(&self) -> u32 {
        match self {
            ErrorClass::Malformed => 1,
            ErrorClass::Truncated => 2,
            ErrorClass::Unsupported => 3,
            ErrorClass::Checksum => 4,
            ErrorClass::LimitExceeded { .. } => 5,
            ErrorClass::MissingBase => 6,
            ErrorClass::Usage => 7,
            ErrorClass::OutOfMemory => 8,
        }
    }
}

/// A limit of [`crate::Limits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// [`crate::Limits::stored_bytes`].
    StoredBytes,
    /// [`crate::Limits::unpacked_bytes`].
    UnpackedBytes,
    /// [`crate::Limits::frame_bytes`].
    FrameBytes,
    /// [`crate::Limits::zstd_window_bytes`].
    ZstdWindowBytes,
    /// [`crate::Limits::tracks`].
    Tracks,
    /// [`crate::Limits::path_bytes`].
    PathBytes,
    /// [`crate::Limits::state_bytes`].
    StateBytes,
    /// [`crate::Limits::work_per_byte`].
    WorkPerByte,
}

impl Limit {
    /// All of them, in the order of [`crate::Limits`].
    pub const ALL: &'static [Limit] = &[
        Limit::StoredBytes,
        Limit::UnpackedBytes,
        Limit::FrameBytes,
        Limit::ZstdWindowBytes,
        Limit::Tracks,
        Limit::PathBytes,
        Limit::StateBytes,
        Limit::WorkPerByte,
    ];

    /// The name of its field in [`crate::Limits`], such as `stored_bytes`.
    pub fn name(self) -> &'static str {
        match self {
            Limit::StoredBytes => "stored_bytes",
            Limit::UnpackedBytes => "unpacked_bytes",
            Limit::FrameBytes => "frame_bytes",
            Limit::ZstdWindowBytes => "zstd_window_bytes",
            Limit::Tracks => "tracks",
            Limit::PathBytes => "path_bytes",
            Limit::StateBytes => "state_bytes",
            Limit::WorkPerByte => "work_per_byte",
        }
    }

    /// Its stable number, for interfaces of other languages.
    pub fn number(self) -> u32 {
        match self {
            Limit::StoredBytes => 1,
            Limit::UnpackedBytes => 2,
            Limit::FrameBytes => 3,
            Limit::ZstdWindowBytes => 4,
            Limit::Tracks => 5,
            Limit::PathBytes => 6,
            Limit::StateBytes => 7,
            Limit::WorkPerByte => 8,
        }
    }
}

/// An error before its offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ErrorDetail {
    pub(crate) kind: ErrorKind,
    class: ErrorClass,
    found: Option<u64>,
    track: Option<u32>,
}

impl From<ErrorKind> for ErrorDetail {
    fn from(kind: ErrorKind) -> Self {
        let class = match kind {
            ErrorKind::PreambleChecksum
            | ErrorKind::HeaderChecksum
            | ErrorKind::PayloadChecksum
            | ErrorKind::EndDigest
            | ErrorKind::StateDigest => ErrorClass::Checksum,
            ErrorKind::ContainerVersion
            | ErrorKind::Profile
            | ErrorKind::Compression
            | ErrorKind::RecordVersion
            | ErrorKind::UnknownCritical
            | ErrorKind::Model
            | ErrorKind::Coding
            | ErrorKind::Space
            | ErrorKind::GroupStart => ErrorClass::Unsupported,
            ErrorKind::Truncated | ErrorKind::Uncommitted => ErrorClass::Truncated,
            ErrorKind::MissingBase | ErrorKind::MissingGroupBase => ErrorClass::MissingBase,
            ErrorKind::Failed | ErrorKind::EncoderUse => ErrorClass::Usage,
            ErrorKind::Memory => ErrorClass::OutOfMemory,
            _ => ErrorClass::Malformed,
        };
        ErrorDetail {
            kind,
            class,
            found: None,
            track: None,
        }
    }
}

impl ErrorDetail {
    /// A claim beyond a limit.
    pub(crate) fn limit(kind: ErrorKind, which: Limit, asked: u64, allowed: u64) -> ErrorDetail {
        let class = ErrorClass::LimitExceeded {
            which,
            asked,
            allowed,
        };
        ErrorDetail {
            class,
            ..ErrorDetail::from(kind)
        }
    }

    /// A number that is none of those that are known.
    pub(crate) fn found(kind: ErrorKind, number: impl Into<u64>) -> ErrorDetail {
        ErrorDetail {
            found: Some(number.into()),
            ..ErrorDetail::from(kind)
        }
    }

    /// The same, of the declaration of a track.
    pub(crate) fn of_track(self, id: u32) -> ErrorDetail {
        ErrorDetail {
            track: Some(id),
            ..self
        }
    }

    /// The public error, at a byte offset.
    pub(crate) fn at(self, offset: u64) -> Error {
        let id = self.kind as u16;
        let layer = match id / 1000 {
            1 => Layer::Framing,
            2 => Layer::Record,
            3 => Layer::Codec,
            _ => Layer::Session,
        };
        Error {
            layer,
            class: self.class,
            id,
            offset,
            found: self.found,
            track: self.track,
        }
    }
}

impl Error {
    /// The short, stable name of the error, such as `header-checksum`.
    pub fn name(&self) -> &'static str {
        entry(self.id).1
    }
}

fn entry(id: u16) -> (ErrorKind, &'static str, &'static str) {
    TABLE
        .iter()
        .find(|(kind, _, _)| *kind as u16 == id)
        .copied()
        .unwrap_or((
            ErrorKind::Failed,
            "unknown",
            "an error of an unknown number",
        ))
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, name, sentence) = entry(self.id);
        write!(
            f,
            "E{} {name}, at byte {}: {sentence}",
            self.id, self.offset
        )?;
        if let ErrorClass::LimitExceeded { asked, allowed, .. } = self.class {
            write!(f, " ({asked} asked for, {allowed} allowed)")?;
        }
        if let Some(found) = self.found {
            match name {
                "unknown-critical" | "critical-bit" => {
                    write!(f, " (type {found}, {})", record_type::name(found as u16))?;
                }
                _ => write!(f, " ({} {found})", name.rsplit('-').next().unwrap_or(name))?,
            }
        }
        if let Some(track) = self.track {
            write!(f, " (track {track})")?;
        }
        Ok(())
    }
}

impl core::error::Error for Error {}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use alloc::format;

    #[test]
    fn the_specification_lists_every_error() {
        let readme = include_str!("../../../spec/README.md");
        for (kind, name, sentence) in TABLE {
            let class = match ErrorDetail::from(*kind).class {
                _ if name.ends_with("-limit") || *name == "zstd-window" => "LimitExceeded",
                class => class.name(),
            };
            let row = format!("| {} | {name} | {class} | {sentence} |\n", *kind as u16);
            assert!(readme.contains(&row), "spec/README.md lacks: {row}");
        }
        let rows = readme.lines().filter(|line| {
            line.strip_prefix("| ")
                .is_some_and(|l| l.as_bytes()[..4].iter().all(u8::is_ascii_digit))
        });
        assert_eq!(rows.count(), TABLE.len());
    }

    #[test]
    fn class_names_are_variant_names() {
        for (kind, _, _) in TABLE {
            let class = ErrorDetail::from(*kind).class;
            assert_eq!(class.name(), format!("{class:?}"));
        }
    }

    #[test]
    fn errors_are_one_sentence() {
        for (kind, name, _) in TABLE {
            let error = ErrorDetail::from(*kind).at(99);
            assert_eq!(error.name(), *name);
            let text = format!("{error}");
            assert!(
                text.starts_with(&format!("E{} {name}, at byte 99: ", error.id)),
                "{text}"
            );
        }
    }
}
