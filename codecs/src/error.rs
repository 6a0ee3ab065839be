//! Errors: a layer, a kind, a stable number and a byte offset.

use core::fmt;

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
}

/// Every fault, with its stable number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(crate) enum Fault {
    Magic = 1001,
    PreambleChecksum = 1002,
    ContainerVersion = 1003,
    Profile = 1004,
    HeaderChecksum = 1005,
    HeaderReserved = 1006,
    RecordDuplicate = 1007,
    RecordGap = 1008,
    RecordOrder = 1009,
    Compression = 1010,
    PayloadChecksum = 1011,
    StoredLimit = 1012,
    UnpackedLimit = 1013,
    Length = 1014,
    Lz4 = 1015,
    Zstd = 1016,
    ZstdFrame = 1017,
    ZstdWindow = 1018,
    Truncated = 1019,
    TrailingBytes = 1020,
    RecordVersion = 1021,
    UnknownCritical = 1022,
    CriticalBit = 1023,
    EndCount = 1024,
    EndDigest = 1025,

    PayloadSize = 2001,
    PayloadReserved = 2002,
    TickRate = 2003,
    EntryOrder = 2004,
    TrackReused = 2005,
    TrackChanged = 2006,
    Model = 2007,
    Coding = 2008,
    NotFinite = 2009,
    Aabb = 2010,
    PathText = 2011,
    PathLimit = 2012,
    TracksLimit = 2013,
    GridDims = 2014,
    GridRadius = 2015,
    PointWidths = 2016,
    GridCapacity = 2017,
    StateLimit = 2018,
    UnknownTrack = 2019,
    Space = 2020,
    GroupStart = 2021,

    PointsSize = 3001,
    PointsReserved = 3002,
    BucketIndex = 3003,
    CellIndex = 3004,
    BucketEntry = 3005,
    BucketCompact = 3006,
    BucketTwice = 3007,
    CellKey = 3008,
    PointCompact = 3009,
    PointBits = 3010,
    FreeCell = 3011,
    EntryHash = 3012,
    CellMoved = 3013,

    MissingBase = 4001,
    MissingGroupBase = 4002,
    FrameNumber = 4003,
    Tick = 4004,
    StateDigest = 4005,
    Uncommitted = 4006,
    NoStream = 4007,
    NoGroup = 4008,
    FrameLimit = 4009,
    TrackTwice = 4010,
    Failed = 4011,
    EncoderUse = 4012,
}

/// Number, name and sentence of every fault. `spec/README.md` lists the same numbers and names.
pub(crate) const TABLE: &[(Fault, &str, &str)] = &[
    (
        Fault::Magic,
        "magic",
        "this is not a Dapple stream, or a text-mode transfer damaged it",
    ),
    (
        Fault::PreambleChecksum,
        "preamble-checksum",
        "the preamble is damaged",
    ),
    (
        Fault::ContainerVersion,
        "container-version",
        "the container is of another version; a newer decoder may read it",
    ),
    (
        Fault::Profile,
        "profile",
        "the stream is of a profile that this decoder does not know",
    ),
    (
        Fault::HeaderChecksum,
        "header-checksum",
        "a record header is damaged",
    ),
    (
        Fault::HeaderReserved,
        "header-reserved",
        "reserved bits of a record header are not zero",
    ),
    (
        Fault::RecordDuplicate,
        "record-duplicate",
        "a record came twice",
    ),
    (Fault::RecordGap, "record-gap", "records are missing"),
    (
        Fault::RecordOrder,
        "record-order",
        "a record is out of order",
    ),
    (
        Fault::Compression,
        "compression",
        "a record is packed in an unknown way",
    ),
    (
        Fault::PayloadChecksum,
        "payload-checksum",
        "a record payload is damaged",
    ),
    (
        Fault::StoredLimit,
        "stored-limit",
        "a record is larger than the limit",
    ),
    (
        Fault::UnpackedLimit,
        "unpacked-limit",
        "a record unpacks to more than the limit",
    ),
    (
        Fault::Length,
        "length",
        "the lengths in a record header contradict each other",
    ),
    (
        Fault::Lz4,
        "lz4",
        "an lz4 block does not unpack to its length",
    ),
    (
        Fault::Zstd,
        "zstd",
        "a zstd frame does not unpack to its length",
    ),
    (
        Fault::ZstdFrame,
        "zstd-frame",
        "a zstd payload is not one plain frame with its content size",
    ),
    (
        Fault::ZstdWindow,
        "zstd-window",
        "a zstd frame needs a larger window than the limit",
    ),
    (
        Fault::Truncated,
        "truncated",
        "the stream ends before its end record",
    ),
    (
        Fault::TrailingBytes,
        "trailing-bytes",
        "bytes follow the end record",
    ),
    (
        Fault::RecordVersion,
        "record-version",
        "a record is of a newer version; a newer decoder may read it",
    ),
    (
        Fault::UnknownCritical,
        "unknown-critical",
        "a record of an unknown type must be understood; a newer decoder may read it",
    ),
    (
        Fault::CriticalBit,
        "critical-bit",
        "the critical bit of a record contradicts its type",
    ),
    (
        Fault::EndCount,
        "end-count",
        "the end record counts other records than came",
    ),
    (
        Fault::EndDigest,
        "end-digest",
        "the digest of the stream does not match",
    ),
    (
        Fault::PayloadSize,
        "payload-size",
        "a record payload is shorter or longer than its fields",
    ),
    (
        Fault::PayloadReserved,
        "payload-reserved",
        "reserved bits or padding of a record are not zero",
    ),
    (Fault::TickRate, "tick-rate", "the tick rate has a zero"),
    (
        Fault::EntryOrder,
        "entry-order",
        "the entries of a record are not in ascending order of track",
    ),
    (
        Fault::TrackReused,
        "track-reused",
        "a track takes an id that is not above every earlier one",
    ),
    (
        Fault::TrackChanged,
        "track-changed",
        "a track is declared again with other content",
    ),
    (
        Fault::Model,
        "model",
        "a track is of an unknown model; a newer decoder may read it",
    ),
    (
        Fault::Coding,
        "coding",
        "a track has an unknown coding; a newer decoder may read it",
    ),
    (
        Fault::NotFinite,
        "not-finite",
        "a number is infinite or not a number",
    ),
    (
        Fault::Aabb,
        "aabb",
        "a bounding box has a minimum above its maximum",
    ),
    (
        Fault::PathText,
        "path-text",
        "the path of a track is not UTF-8",
    ),
    (
        Fault::PathLimit,
        "path-limit",
        "the path of a track is longer than the limit",
    ),
    (
        Fault::TracksLimit,
        "tracks-limit",
        "there are more tracks than the limit",
    ),
    (
        Fault::GridDims,
        "grid-dims",
        "a grid has a zero dimension or more cells than 32 bits count",
    ),
    (
        Fault::GridRadius,
        "grid-radius",
        "a grid needs a radius above zero and cells at least twice as wide",
    ),
    (
        Fault::PointWidths,
        "point-widths",
        "the widths of a point do not add up to 16, 24 or 32 bits",
    ),
    (
        Fault::GridCapacity,
        "grid-capacity",
        "a track needs at least one bucket and one cell",
    ),
    (
        Fault::StateLimit,
        "state-limit",
        "the tracks need more memory than the limit",
    ),
    (
        Fault::UnknownTrack,
        "unknown-track",
        "a record names a track that is not declared",
    ),
    (
        Fault::Space,
        "space",
        "a track has an unknown lookup space; a newer decoder may read it",
    ),
    (
        Fault::GroupStart,
        "group-start",
        "a group starts in an unknown way; a newer decoder may read it",
    ),
    (
        Fault::PointsSize,
        "points-size",
        "a points payload is shorter or longer than its counts say",
    ),
    (
        Fault::PointsReserved,
        "points-reserved",
        "reserved bits or padding of a points payload are not zero",
    ),
    (
        Fault::BucketIndex,
        "bucket-index",
        "a bucket index is beyond the track's buckets",
    ),
    (
        Fault::CellIndex,
        "cell-index",
        "a cell index is beyond the track's cells",
    ),
    (
        Fault::BucketEntry,
        "bucket-entry",
        "a bucket names a cell beyond the track's cells",
    ),
    (
        Fault::BucketCompact,
        "bucket-compact",
        "a bucket has an empty entry before a used one",
    ),
    (
        Fault::BucketTwice,
        "bucket-twice",
        "a bucket names a cell twice",
    ),
    (
        Fault::CellKey,
        "cell-key",
        "the key of a cell is outside the grid",
    ),
    (
        Fault::PointCompact,
        "point-compact",
        "a cell has an empty point before a used one",
    ),
    (
        Fault::PointBits,
        "point-bits",
        "a point has bits beyond its width, or is unused and not zero",
    ),
    (Fault::FreeCell, "free-cell", "a free cell holds a point"),
    (
        Fault::EntryHash,
        "entry-hash",
        "a bucket names a cell whose key hashes elsewhere",
    ),
    (
        Fault::CellMoved,
        "cell-moved",
        "a cell changed its key while its old bucket still names it",
    ),
    (
        Fault::MissingBase,
        "missing-base",
        "a delta builds on a frame that is not the last one",
    ),
    (
        Fault::MissingGroupBase,
        "missing-group-base",
        "a group builds on a state that this decoder does not hold",
    ),
    (
        Fault::FrameNumber,
        "frame-number",
        "a frame number is not above the last one",
    ),
    (
        Fault::Tick,
        "tick",
        "the tick of a frame is before the last one",
    ),
    (
        Fault::StateDigest,
        "state-digest",
        "the digest of the decoded state does not match",
    ),
    (
        Fault::Uncommitted,
        "uncommitted",
        "a frame was begun and not committed",
    ),
    (
        Fault::NoStream,
        "no-stream",
        "the first record must be the only stream record",
    ),
    (
        Fault::NoGroup,
        "no-group",
        "a frame stands outside any group",
    ),
    (
        Fault::FrameLimit,
        "frame-limit",
        "the records of a frame need more memory than the limit",
    ),
    (
        Fault::TrackTwice,
        "track-twice",
        "a track is updated twice in a frame",
    ),
    (
        Fault::Failed,
        "failed",
        "the decoder stopped at an earlier error; call resume or reset",
    ),
    (
        Fault::EncoderUse,
        "encoder-use",
        "the encoder was given contradicting data",
    ),
];

/// A fault before its offset is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) fault: Fault,
    kind: Kind,
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
            _ => Kind::Malformed,
        };
        Failure { fault, kind }
    }
}

impl Failure {
    /// A claim beyond a limit.
    pub(crate) fn limit(fault: Fault, which: Limit, asked: u64, allowed: u64) -> Failure {
        Failure {
            fault,
            kind: Kind::LimitExceeded {
                which,
                asked,
                allowed,
            },
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
                _ if name.ends_with("-limit") || *name == "zstd-window" => "LimitExceeded".into(),
                kind => format!("{kind:?}"),
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
