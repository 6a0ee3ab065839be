//! Ambient obscurance of meshes that stand in a scene many times: what a mesh does to itself, shared
//! by its instances, times what the scene does to each instance (Sloan, Tranchida, Chen and Kavan 2013,
//! *Ambient Obscurance Baking on the GPU*, section 2.2).
//!
//! `AO(p) = clamp(G(p) * L(p), 0, 1)`, where L is *local* obscurance, baked with the object alone in the
//! world, and G is the *global* function of an instance: 1, a scalar, or a linear function over the box
//! of the mesh.
//!
//! - [`group`]: meshes with several instances, and a scene of each object alone. Whoever bakes gives it to
//!   a bake of vertices, which makes L of it.
//! - [`place`]: samples on an instance, a quarter of which is held out of the fit.
//! - [`solve()`]: one instance: traces its samples and fits G by each rung of the ladder ([`fit`], Eq. 3).
//! - [`volume`]: obscurance around instances as spherical harmonics, as the paper's source of values where
//!   normals are poor.
//! - [`decorator`]: one scalar for small objects, from the surfaces about them (section 2.2.1).
//! - [`mod@refine`]: local values that suit the instances of a mesh better than those of the object alone (the
//!   paper's future work).
//! - [`mod@table`]: the quantised table of a track.
//!
//! Solvers are pure functions of one instance or mesh, given what is shared and only read. Nothing depends on
//! the number of threads. What was measured is in `docs/instances.md`.

pub mod decorator;
pub mod fit;
pub mod group;
pub mod place;
pub mod refine;
pub mod solve;
pub mod table;
pub mod volume;

#[cfg(test)]
mod tests;

pub use decorator::Decorator;
pub use fit::{Fit, Linear};
pub use group::{Group, groups};
pub use place::Site;
pub use refine::{Refined, refine};
pub use solve::{Context, Solved, solve};
pub use table::{Function, table};
pub use volume::{Layout, Volume};

/// Samples on an instance, before those in the holes of masks are left out.
pub const SAMPLES: u32 = 192;
