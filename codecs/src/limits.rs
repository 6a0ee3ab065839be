//! What a stream may ask of the machine that decodes it.

/// Upper bounds that every claim of a stream is held against before memory is reserved for it.
///
/// A decoder's memory stays below `state_bytes` for the state (buckets, cells and four bytes of
/// bookkeeping a cell), plus `stored_bytes` for a record that is still arriving, plus `frame_bytes`
/// for the frame that waits for its commit, plus one zstd window where the pure-Rust decoder
/// serves, plus a few hundred bytes and the path of each live track. Each buffer grows to what was
/// needed and is kept.
///
/// The time of a record is bounded by its unpacked bytes and `state_bytes` together, since a
/// keyframe of one cell may empty a large track and a digest reads every bucket: lower
/// `state_bytes` for streams from strangers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one record's payload as stored. Default 256 MiB.
    pub stored_bytes: u32,
    /// Bytes of one record's payload unpacked. Default 256 MiB: a keyframe of one
    /// track is one record, and a mesh of a few million points needs that much.
    pub unpacked_bytes: u32,
    /// Unpacked bytes of all model records of one frame. Default 512 MiB.
    pub frame_bytes: u32,
    /// Window of a zstd frame. Default 8 MiB, which RFC 8878 asks every decoder to support.
    pub zstd_window_bytes: u32,
    /// Live tracks. Default 65 536.
    pub tracks: u32,
    /// UTF-8 bytes of a track's path. Default 1024.
    pub path_bytes: u32,
    /// Bytes of decoded state of all live tracks: 32 a bucket and 36 a cell. Default 512 MiB.
    pub state_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            stored_bytes: 256 << 20,
            unpacked_bytes: 256 << 20,
            frame_bytes: 512 << 20,
            zstd_window_bytes: 8 << 20,
            tracks: 65_536,
            path_bytes: 1024,
            state_bytes: 512 << 20,
        }
    }
}

impl Limits {
    /// Provisional.
    pub fn heap_bytes(&self) -> u64 {
        u64::MAX / 2
    }
}
