//! Stress scenes of the models that are baked. All figures are of values between 0 and 1, before they are quantised,
//! with the exponential kernel of 2 m.
//!
//! - [`vertices`]: vertices inside geometry, and large faces beside small ones
//! - [`instances`]: objects whose samples lie in a plane, on a line or in a point
//! - [`regions`]: the boundary between two rooms

pub mod instances;
pub mod regions;
pub mod vertices;

use crate::Result;
use crate::obscurance::{HALF_DISTANCES, Kernel, Obscurance};
use crate::world::World;

/// Traces obscurance by the kernel of these scenes with so many rays a point.
fn obscurance<'w>(world: &'w World, rays: u32) -> Result<Obscurance<'w, 'w>> {
    let kernel = Kernel::Exponential {
        half_distance: HALF_DISTANCES[0],
    };
    Obscurance::new(world.scene(), world.tracer(), &[kernel], rays)
}
