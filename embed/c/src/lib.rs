//! C interface of [`dapple_codec`]. The header is `include/dapple.h`; `docs/embedding.md` is the guide.
//!
//! Every function is a thin cover of one of the codec: it checks its arguments, calls it, and turns the
//! result into plain numbers and structs. Functions that can fail return 0 or more, or minus the id of an
//! error. No panic leaves a function: it becomes [`ERROR_PANIC`], and the handle answers nothing else until it is
//! reset or freed.
//!
//! This crate has unsafe code, which the codec has not: pointers that come from C are what the comments of
//! each function say, or the behaviour is undefined. A pointer that is null where it must not be, or not
//! aligned, is [`ERROR_ARGUMENT`].
//!
//! A handle is used by one thread at a time; different handles are independent.

#![cfg_attr(not(feature = "std"), no_std)]
#![deny(missing_docs)]
// What callers promise is said once, above and in the header.
#![allow(clippy::missing_safety_doc)]
extern crate alloc;

#[cfg(feature = "allocator")]
mod allocator;
mod array;
mod call;
mod decoder;
#[cfg(feature = "encode")]
mod encoder;
mod error;
mod layout;
mod limits;
pub mod numbers;
mod parameters;
mod track;
#[cfg(all(target_arch = "wasm32", not(feature = "std")))]
mod wasm;

#[cfg(feature = "allocator")]
pub use allocator::*;
pub use array::*;
pub use decoder::*;
#[cfg(feature = "encode")]
pub use encoder::*;
pub use error::*;
pub use limits::*;
pub use parameters::*;
pub use track::*;

/// Version of this interface: `DAPPLE_ABI_VERSION` of the header that a program was compiled with must be
/// equal to [`dapple_abi_version`] of the library that it runs with.
pub const ABI_VERSION: u32 = 1;

/// [`ABI_VERSION`] of this library.
#[unsafe(no_mangle)]
pub extern "C" fn dapple_abi_version() -> u32 {
    ABI_VERSION
}
