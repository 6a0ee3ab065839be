//! What can go wrong, each as one sentence a user can act on.

use std::path::PathBuf;

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// An error of the reference system. `Display` gives one sentence that names the thing, the place
/// and, where there is one, the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    /// A scene file cannot be used.
    #[error("{name}: {message}")]
    Scene { name: String, message: String },
    /// The bytes are not a valid stream.
    #[error("{0}")]
    Codec(#[from] dapple_codec::Error),
    /// The parameters ask for something that cannot be done.
    #[error("{0}")]
    Invalid(String),
    /// The arguments ask for something that contradicts itself or would do harm, such as an output
    /// over an input.
    #[error("{0}")]
    Usage(String),
    /// The graphics device cannot do what was asked.
    #[error("{0}")]
    Gpu(String),
}
