//! Ambient obscurance: how open a point is, where far blockers count less than near ones.
//!
//! Sloan, Tranchida, Chen and Kavan 2013, *Ambient Obscurance Baking on the GPU*, section 2, Eq. 1:
//!
//! ```text
//! AO(p) = 1/pi * integral over the hemisphere of rho(d(p, w)) cos(theta) dw
//! ```
//!
//! where `d(p, w)` is the distance to the closest blocker. One closest hit a ray serves any number
//! of [`Kernel`]s `rho`: the paper's two distances, and ambient occlusion with a cut-off, which other
//! bakers and the model `points` compute.
//!
//! - [`kernel`]: from distance to visibility.
//! - [`gather`]: the rays of a point on a surface and of a point in space, and which points are
//!   inside geometry.
//! - [`sphere`]: obscurance about a point in space, for any normal.
//! - [`foliage`]: shrubs and trees that attenuate rays, where asked for.
//! - [`artist`]: how two distances become the one value that a picture shows.
//!
//! What stops a ray is what stops it in [`crate::trace`]: MASK materials have holes, BLEND materials
//! and windows stop nothing.

pub mod artist;
pub mod foliage;
pub mod gather;
pub mod kernel;
pub mod sphere;

#[cfg(test)]
pub(crate) mod shapes;
#[cfg(test)]
mod tests;

pub use artist::{Blend, Remap};
pub use gather::{Gather, Obscurance};
pub use kernel::Kernel;

/// Most kernels that one trace serves.
pub const MAX_KERNELS: usize = 4;

/// Rays of a point on a surface (section 4).
pub const SURFACE_RAYS: u32 = 256;

/// Rays of a point in space (section 4).
pub const VOLUME_RAYS: u32 = 1024;

/// Half-distances in metres, short and long (section 2).
pub const HALF_DISTANCES: [f32; 2] = [2.0, 300.0];

/// Share of back-facing hits above which a point counts as inside geometry (section 2.1).
pub const MAX_BACK_SHARE: f32 = 0.25;
