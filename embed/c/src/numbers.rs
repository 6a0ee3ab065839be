//! Numbers of the interface. They keep their meaning in every version of it.

/// What a call of `dapple_decoder_push` came to.
#[repr(C)]
pub enum Event {
    /// All input was used; push more.
    NeedInput = 0,
    /// The stream's tick rate is known.
    Stream = 1,
    /// A group starts.
    Group = 2,
    /// Tracks were declared: tracks and arrays have grown.
    Tracks = 3,
    /// A frame was committed: upload the dirty ranges.
    Frame = 4,
    /// A record of an unknown type was skipped; it said that it may be.
    Skipped = 5,
    /// The stream is complete.
    End = 6,
}

/// An array of decoded state.
#[repr(C)]
pub enum Buffer {
    /// Hash buckets of all tracks of `points`: 8 `uint32_t` each.
    PointsBuckets = 0,
    /// Cells of all tracks of `points`: key and 7 points, `uint32_t` each.
    PointsCells = 1,
    /// Texels of a track of `probes`: 4 half floats each, seven planes of one texel a probe.
    ProbesTexels = 2,
    /// Visibility of a track of `probes`: bytes.
    ProbesVisibility = 3,
    /// Values of all tracks of `vertices`: a byte each.
    VerticesValues = 4,
    /// Keys of a track of `instances`: `uint64_t` each.
    InstancesKeys = 5,
    /// Values of a track of `instances`: 4 `int16_t` each.
    InstancesValues = 6,
    /// Regions of a track of `regions`: `dapple_region` each.
    Regions = 7,
    /// Coefficients of a track of `regions`: 2 `int16_t` each.
    RegionsPairs = 8,
    /// Transform of a track of any model: 12 `float`, or nothing.
    Transforms = 9,
}

/// A model.
#[repr(C)]
pub enum Model {
    /// Ambient occlusion at surface points.
    Points = 1,
    /// Indirect light at the probes of a volume.
    Probes = 2,
    /// Ambient obscurance at the vertices of a mesh.
    Vertices = 3,
    /// Ambient obscurance of whole mesh instances.
    Instances = 4,
    /// Ambient obscurance in boxes of the world.
    Regions = 5,
}

/// A field of `dapple_limits`, in errors of the class `LimitExceeded`.
#[repr(C)]
pub enum Limit {
    /// No limit.
    None = 0,
    /// `stored_bytes`.
    StoredBytes = 1,
    /// `unpacked_bytes`.
    UnpackedBytes = 2,
    /// `frame_bytes`.
    FrameBytes = 3,
    /// `zstd_window_bytes`.
    ZstdWindowBytes = 4,
    /// `tracks`.
    Tracks = 5,
    /// `path_bytes`.
    PathBytes = 6,
    /// `state_bytes`.
    StateBytes = 7,
    /// `work_per_byte`.
    WorkPerByte = 8,
}

/// The layer that an error belongs to: the thousands of its id.
#[repr(C)]
pub enum Layer {
    /// There is no error.
    None = 0,
    /// Preamble, record headers, checksums, compression.
    Framing = 1,
    /// The fields of a record.
    Record = 2,
    /// The contents of a model's payload.
    Codec = 3,
    /// The order of records and the state they build.
    Session = 4,
    /// The use of this interface; no fault of the bytes.
    Interface = 9,
}

/// The class of an error, which a program may branch on.
#[repr(C)]
pub enum Class {
    /// There is no error.
    None = 0,
    /// The bytes break a rule of the format.
    Malformed = 1,
    /// The input ends too early.
    Truncated = 2,
    /// The bytes may be right, but need a newer or larger decoder.
    Unsupported = 3,
    /// A checksum or digest does not match.
    Checksum = 4,
    /// The stream asks for more than a limit allows.
    LimitExceeded = 5,
    /// A delta or a group builds on a state that this decoder does not hold.
    MissingBase = 6,
    /// The caller used the library out of order; no fault of the bytes.
    Usage = 7,
    /// The machine does not have memory that the limits allow; no fault of the bytes.
    OutOfMemory = 8,
}

/// How the payloads of an encoder's call are packed.
#[repr(C)]
pub enum Compression {
    /// Not at all.
    None = 0,
    /// lz4: the fastest to unpack.
    Lz4 = 1,
    /// zstd at level 15. Needs a library that was built with `zstd-native`.
    Zstd = 2,
}

/// What an encoder's call says about the tracks that it names.
#[repr(C)]
pub enum Coverage {
    /// Everything: what is not sent is empty.
    Keyframe = 0,
    /// What changed since the last committed frame.
    Delta = 1,
}
