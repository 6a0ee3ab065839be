//! The options of the server.

use super::hidden;
use crate::codec::points::PointWidths;
use crate::points::place::Density;
use crate::points::store::Overflow;
use crate::scene::Scene;

/// In which shape of a deforming mesh its points live.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Space {
    /// The shape of the last frame: points move through the grid, as in PSAO.
    #[default]
    Posed,
    /// The rest pose: points never move, and the client looks fragments up by their rest position.
    Rest,
}

/// The options of the server.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub density: Density,
    /// Give small instances more points than that, and large ones fewer where a scene would have too
    /// many ([`super::layout`]).
    pub fitted: bool,
    /// Seconds of the animation that are encoded: points are placed where an instance is largest.
    pub span: f64,
    /// Rays a point.
    pub rays: u32,
    /// Length of an occlusion ray in metres (PSAO §4).
    pub distance: f32,
    /// A point is sent when its AO differs from the last value sent by at least this much, in 0..1.
    pub threshold: f32,
    pub widths: PointWidths,
    pub overflow: Overflow,
    pub space: Space,
    /// Points with an AO below so many steps of 1/255 are left out, and so are those that close
    /// surfaces hide ([`super::hidden`]); 0 keeps all points, as in PSAO.
    pub min_ao: u8,
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

impl Options {
    /// The default options of a scene: density and distance follow its size.
    pub fn for_scene(scene: &Scene) -> Options {
        let scale = scene.length_scale();
        let paper = Options::default();
        Options {
            density: Density {
                candidates: paper.density.candidates / (scale * scale),
                ..paper.density
            },
            distance: paper.distance * scale,
            fitted: true,
            ..paper
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options {
            density: Density {
                candidates: 1024.0,
                thinning: 2.0,
            },
            fitted: false,
            span: f64::INFINITY,
            rays: 128,
            distance: 0.6,
            threshold: 4.0 / 255.0,
            widths: PointWidths::BITS_32,
            overflow: Overflow::Chain,
            space: Space::Posed,
            min_ao: hidden::MIN_AO,
            seed: 0,
            visibility: true,
            margin: 10f32.to_radians(),
            aspect: 16.0 / 9.0,
            budget: None,
        }
    }
}
