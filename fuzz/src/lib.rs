//! What the fuzz targets share. Each target states one property; `README.md` lists them.

pub mod models;
pub mod payloads;
pub mod recompute;
pub mod records;
pub mod server;
pub mod stream_builder;
pub mod structured;
pub mod viewer;

use dapple_codec::Limits;

/// Small, so that an input is quick and its claims run into them; large enough for every stream
/// that [`server`] writes.
pub const LIMITS: Limits = Limits {
    stored_bytes: 64 << 10,
    unpacked_bytes: 256 << 10,
    frame_bytes: 512 << 10,
    zstd_window_bytes: 128 << 10,
    tracks: 16,
    path_bytes: 64,
    state_bytes: 256 << 10,
    work_per_byte: 400,
};
