//! Bytes to light and back: the codec of Dapple, a binary format for precomputed and streamed
//! low-frequency light. The format is specified in `spec/`.
//!
//! The crate has no I/O, no threads, no GPU and no scene. A [`Decoder`] is fed bytes as they come
//! and keeps arrays that upload to a GPU as they are; an [`Encoder`] appends records to a `Vec`.
//!
//! ```
//! use dapple_codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
//! use dapple_codec::*;
//!
//! # fn main() -> Result<()> {
//! let grid = Grid {
//!     grid_from_mesh: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
//!     dims: [4, 4, 4],
//!     cell_edge: 0.5,
//!     radius: 0.25,
//!     widths: PointWidths::BITS_32,
//!     bucket_count: 7,
//!     cell_capacity: 8,
//!     coding: Coding::Cells,
//! };
//! let track = Track {
//!     id: 1,
//!     target: Target { path: "hall/floor".into(), ..Target::default() },
//!     aabb_min: [0.0; 3],
//!     aabb_max: [2.0; 3],
//!     space: LookupSpace::Mesh,
//!     model: Model::Points(grid),
//! };
//!
//! // One point in grid cell (1, 2, 3).
//! let point = grid.widths.pack([0.5, 0.5, 0.5], [0.0, 1.0, 0.0], 0.75);
//! let cell = Cell { key: grid.key([1, 2, 3]), points: [point, 0, 0, 0, 0, 0, 0] };
//! let bucket = Bucket([0, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY]);
//!
//! let mut bytes = Vec::new();
//! let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
//! encoder.group(&mut bytes, GroupStart::Keyframes)?;
//! encoder.tracks(&mut bytes, &[track])?;
//! let update = Update {
//!     track: 1,
//!     bucket_indices: &[grid.bucket([1, 2, 3])],
//!     buckets: &[bucket],
//!     cell_indices: &[0],
//!     cells: &[cell],
//! };
//! encoder.points(&mut bytes, Coverage::Keyframe, &[update], Compression::Lz4)?;
//! encoder.commit(&mut bytes, 0, None)?;
//! encoder.end(&mut bytes)?;
//!
//! let decoder = decode_all(&bytes, Limits::default(), |_, event| {
//!     if let Event::Frame(frame) = event {
//!         assert_eq!(frame.count(ModelKind::Points), 1);
//!     }
//! })?;
//! let track = &decoder.tracks()[0];
//! assert_eq!(decoder.points().cells_of(track)[0], cell);
//! # Ok(())
//! # }
//! ```
//!
//! # How it is built, and why
//!
//! - **Push, plain data.** [`Decoder::push`] takes a slice and returns how much it used and one
//!   event. Needing more input is an event, not an error. No callbacks, no generics, so that a C
//!   interface can have the same shape. The result does not depend on how the input was cut.
//!   [`Decoder::push_all`] and [`decode_all`] are loops around it.
//! - **A frame appears whole.** Records are checked and kept when they come; a commit writes them.
//!   An error on the way leaves the last committed state as it was, bit for bit.
//!   [`Decoder::resume`] goes on at the next group, [`Decoder::reset`] at the next stream.
//! - **Nothing is reserved on a claim alone.** [`Limits`] bounds every length before memory is
//!   taken. In steady state nothing is allocated.
//! - **One way to see what changed.** [`Decoder::dirty`] yields ranges of arrays of every model, and
//!   of transforms. A client that loops over it misses nothing.
//! - **Threads are the caller's.** Decode on a worker, copy the dirty ranges into the renderer's
//!   buffers after [`Event::Frame`].
//! - **Models stand behind one registry** (`models/mod.rs`). Container, session, encoder and decoder
//!   name none of them; dispatch is per record and per track, never per point or probe.
//! - **Missing light is the client's policy**: hold the last value, fade, or take AO = 1.
//!
//! # Embedding
//!
//! Four programs that run as they stand, `cargo run -p dapple-codec --example file` and so on. `file` takes
//! a path. Each
//! checks its own result. They decode a small stream that `examples/sender` writes.
//!
//! ## From a file
//!
//! ```
#![doc = include_str!("../examples/file.rs")]
//! ```
//!
//! ## From a socket
//!
//! ```
#![doc = include_str!("../examples/socket.rs")]
//! ```
//!
//! ## On a worker thread
//!
//! ```
#![doc = include_str!("../examples/worker.rs")]
//! ```
//!
//! ## Upload of what changed
//!
//! ```
#![doc = include_str!("../examples/upload.rs")]
//! ```

#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

pub mod container;
mod decoder;
mod dirty;
mod encoder;
mod entropy;
mod error;
mod limits;
mod memory;
mod models;
mod session;
mod wire;

/// Entries for the fuzz targets, which no program has.
#[cfg(all(fuzzing, feature = "zstd-native"))]
#[doc(hidden)]
pub mod fuzzing {
    pub use crate::container::zstd::unpack_zstd_twice;
}

pub use container::Compression;
pub use decoder::{Decoder, Event, decode_all};
pub use dirty::{Buffer, Dirty, DirtyRange};
pub use encoder::{Encoder, EncoderConfig};
pub use error::{Error, ErrorClass, Layer, Limit, Result};
pub use limits::Limits;
pub use models::payload_header::Coverage;
pub use models::{
    LookupSpace, Model, ModelKind, instances, points, probes, regions, signals, vertices,
};
pub use session::digest::StateDigest;
pub use session::pending::FrameInfo;
pub use session::records::{GroupStart, TickRate};
pub use session::track::{Target, Track, TrackState};
pub use session::transforms::Transform;
