//! Errors: a layer, a kind, a stable number and a byte offset.

use core::fmt;

use crate::container::record_type;
pub(crate) use crate::faults::Fault;
use crate::faults::TABLE;

/// The result of everything in this crate that can fail.
pub type Result<T> = core::result::Result<T, Error>;

/// What went wrong, and where. `Display` gives one sentence.
///
/// `id` is stable: it means the same fault in every version of the library, and the table in
/// `spec/README.md` lists it. [`Error::name`] is its short name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// The layer that found the fault.
    pub layer: Layer,
    /// What sort of fault it is: what a program may branch on.
    pub kind: Kind,
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

/// The layer of the format that a fault belongs to; the first digit of its number.
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
}

/// The sort of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
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

impl Kind {
    /// Its name in reports and in the table of `spec/README.md`, such as `LimitExceeded`.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Malformed => "Malformed",
            Kind::Truncated => "Truncated",
            Kind::Unsupported => "Unsupported",
            Kind::Checksum => "Checksum",
            Kind::LimitExceeded { .. } => "LimitExceeded",
            Kind::MissingBase => "MissingBase",
            Kind::Usage => "Usage",
            Kind::OutOfMemory => "OutOfMemory",
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
}

/// A fault before its offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) fault: Fault,
    kind: Kind,
    found: Option<u64>,
    track: Option<u32>,
}

impl From<Fault> for Failure {
    fn from(fault: Fault) -> Self {
        let kind = match fault {
            Fault::PreambleChecksum
            | Fault::HeaderChecksum
            | Fault::PayloadChecksum
            | Fault::EndDigest
            | Fault::StateDigest => Kind::Checksum,
            Fault::ContainerVersion
            | Fault::Profile
            | Fault::Compression
            | Fault::RecordVersion
            | Fault::UnknownCritical
            | Fault::Model
            | Fault::Coding
            | Fault::Space
            | Fault::GroupStart => Kind::Unsupported,
            Fault::Truncated | Fault::Uncommitted => Kind::Truncated,
            Fault::MissingBase | Fault::MissingGroupBase => Kind::MissingBase,
            Fault::Failed | Fault::EncoderUse => Kind::Usage,
            Fault::Memory => Kind::OutOfMemory,
            _ => Kind::Malformed,
        };
        Failure {
            fault,
            kind,
            found: None,
            track: None,
        }
    }
}

impl Failure {
    /// A claim beyond a limit.
    pub(crate) fn limit(fault: Fault, which: Limit, asked: u64, allowed: u64) -> Failure {
        let kind = Kind::LimitExceeded {
            which,
            asked,
            allowed,
        };
        Failure {
            kind,
            ..Failure::from(fault)
        }
    }

    /// A number that is none of those that are known.
    pub(crate) fn found(fault: Fault, number: impl Into<u64>) -> Failure {
        Failure {
            found: Some(number.into()),
            ..Failure::from(fault)
        }
    }

    /// The same, of the declaration of a track.
    pub(crate) fn of_track(self, id: u32) -> Failure {
        Failure {
            track: Some(id),
            ..self
        }
    }

    /// The public error, at a byte offset.
    pub(crate) fn at(self, offset: u64) -> Error {
        let id = self.fault as u16;
        let layer = match id / 1000 {
            1 => Layer::Framing,
            2 => Layer::Record,
            3 => Layer::Codec,
            _ => Layer::Session,
        };
        Error {
            layer,
            kind: self.kind,
            id,
            offset,
            found: self.found,
            track: self.track,
        }
    }
}

impl Error {
    /// The short, stable name of the fault, such as `header-checksum`.
    pub fn name(&self) -> &'static str {
        entry(self.id).1
    }
}

fn entry(id: u16) -> (Fault, &'static str, &'static str) {
    TABLE
        .iter()
        .find(|(fault, _, _)| *fault as u16 == id)
        .copied()
        .unwrap_or((Fault::Failed, "unknown", "an error of an unknown number"))
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, name, sentence) = entry(self.id);
        write!(
            f,
            "E{} {name}, at byte {}: {sentence}",
            self.id, self.offset
        )?;
        if let Kind::LimitExceeded { asked, allowed, .. } = self.kind {
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
        let readme = include_str!("../../spec/README.md");
        for (fault, name, sentence) in TABLE {
            let kind = match Failure::from(*fault).kind {
                _ if name.ends_with("-limit") || *name == "zstd-window" => "LimitExceeded",
                kind => kind.name(),
            };
            let row = format!("| {} | {name} | {kind} | {sentence} |\n", *fault as u16);
            assert!(readme.contains(&row), "spec/README.md lacks: {row}");
        }
        let rows = readme.lines().filter(|line| {
            line.strip_prefix("| ")
                .is_some_and(|l| l.as_bytes()[..4].iter().all(u8::is_ascii_digit))
        });
        assert_eq!(rows.count(), TABLE.len());
    }

    #[test]
    fn kinds_are_named_as_they_are() {
        for (fault, _, _) in TABLE {
            let kind = Failure::from(*fault).kind;
            assert_eq!(kind.name(), format!("{kind:?}"));
        }
    }

    #[test]
    fn errors_are_one_sentence() {
        for (fault, name, _) in TABLE {
            let error = Failure::from(*fault).at(99);
            assert_eq!(error.name(), *name);
            let text = format!("{error}");
            assert!(
                text.starts_with(&format!("E{} {name}, at byte 99: ", error.id)),
                "{text}"
            );
        }
    }
}
