//! What a server can be asked for.

use crate::codec::points::PointWidths;
use crate::points::place::Density;
use crate::points::store::Overflow;

/// In which shape of a deforming mesh its points live.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// The shape of the last frame: points move through the grid, as in the paper.
    #[default]
    Posed,
    /// The rest pose: points never move, and the client looks fragments up by their rest position.
    Rest,
}

/// What the server is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub density: Density,
    /// Rays a point.
    pub rays: u32,
    /// Length of an occlusion ray in metres (PSAO §4).
    pub distance: f32,
    /// A point is sent when its AO differs from the last value sent by at least this much, in 0..1.
    pub threshold: f32,
    pub widths: PointWidths,
    pub overflow: Overflow,
    pub space: Space,
    /// Points with an AO below so many steps of 1/255 are buried, under a box or where meshes
    /// interpenetrate, and left out for as long as they are: what can be seen is not closed to all
    /// sides, so they only leak darkness onto their visible neighbours. 1 leaves out those that no
    /// ray leaves; 0 keeps all, as in the paper.
    pub bury_below: u8,
    pub seed: u64,
    /// Skip points outside the client's extended field of view.
    pub visibility: bool,
    /// Radians by which each half angle of the field of view is widened.
    pub margin: f32,
    /// Width over height of the client's picture.
    pub aspect: f32,
    /// At most this many points are traced in a tick, round-robin (PSAO §5); the rest wait.
    pub budget: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            density: Density {
                candidates: 1024.0,
                thinning: 2.0,
            },
            rays: 128,
            distance: 0.6,
            threshold: 4.0 / 255.0,
            widths: PointWidths::BITS_32,
            overflow: Overflow::Chain,
            space: Space::Posed,
            bury_below: 1,
            seed: 0,
            visibility: true,
            margin: 10f32.to_radians(),
            aspect: 16.0 / 9.0,
            budget: None,
        }
    }
}
