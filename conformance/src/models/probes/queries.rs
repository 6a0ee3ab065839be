//! Queries of `probes`: the light that a surface receives.

use dapple_codec::{Decoder, TrackState};
use serde::{Deserialize, Serialize};

use crate::models::{ModelQuery, NoAnswer, POSITION_UNIT, integers, unit};

/// Irradiance and filtered radiance, RGB each, of a surface in a track.
pub type Sampler = fn(&Decoder, &TrackState, &Surface) -> [[f32; 3]; 2];

/// A surface, in grid space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Metres.
    pub position: [f32; 3],
    /// Unit.
    pub normal: [f32; 3],
    /// Unit, to the viewer.
    pub view: [f32; 3],
    /// 0 to 1.
    pub roughness: f32,
    /// How probes are weighed.
    pub interpolation: Interpolation,
}

/// How the probes about a place are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// By distance along the axes alone.
    Trilinear,
    /// By visibility as well (Chebyshev).
    VisibilityWeighted,
}

impl Interpolation {
    /// All.
    pub const ALL: [Interpolation; 2] =
        [Interpolation::Trilinear, Interpolation::VisibilityWeighted];

    /// Its name in the specification.
    pub fn name(self) -> &'static str {
        match self {
            Interpolation::Trilinear => "trilinear",
            Interpolation::VisibilityWeighted => "visibility-weighted",
        }
    }
}

/// A look-up of light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbesQuery {
    /// Track id.
    pub track: u32,
    /// Grid-space position in 1/65536 m.
    pub position: [i32; 3],
    /// Direction of the normal, to be normalised.
    pub normal: [i32; 3],
    /// Direction to the viewer, to be normalised.
    pub view: [i32; 3],
    /// 0 to 65536, in 1/65536.
    pub roughness: u32,
    /// How probes are weighed.
    pub interpolation: Interpolation,
    /// Smallest and largest irradiance, red, green and blue, in 1/65536.
    pub irradiance: [[u64; 2]; 3],
    /// Smallest and largest filtered radiance, likewise.
    pub radiance: [[u64; 2]; 3],
}

impl ModelQuery for ProbesQuery {
    fn line(&self) -> String {
        let words = |v: [i32; 3]| v.map(|c| c.to_string()).join(" ");
        format!(
            "{} {} {} {} {} {}",
            self.track,
            words(self.position),
            words(self.normal),
            words(self.view),
            self.roughness,
            self.interpolation.name()
        )
    }

    fn intervals(&self) -> Vec<[f64; 2]> {
        let numbers = self.irradiance.into_iter().chain(self.radiance);
        let units = |ends: [u64; 2]| ends.map(|end| end as f64 / 65536.0);
        numbers.map(units).collect()
    }
}

/// The light that a query line looks up: irradiance, then filtered radiance.
pub fn answer(
    sampler: Option<Sampler>,
    decoder: &Decoder,
    live: &TrackState,
    words: &str,
) -> Result<Vec<f32>, NoAnswer> {
    let surface = surface(words).ok_or(NoAnswer::NoQuery)?;
    let sampler = sampler.ok_or(NoAnswer::NotImplemented)?;
    Ok(sampler(decoder, live, &surface).concat())
}

fn surface(words: &str) -> Option<Surface> {
    let (numbers, name) = words.rsplit_once(' ')?;
    let numbers = integers(numbers).ok()?;
    let &[x, y, z, nx, ny, nz, vx, vy, vz, roughness @ 0..=65536] = numbers.as_slice() else {
        return None;
    };
    let mut interpolations = Interpolation::ALL.into_iter();
    Some(Surface {
        position: [x, y, z].map(|v| v as f32 * POSITION_UNIT),
        normal: unit([nx, ny, nz])?,
        view: unit([vx, vy, vz])?,
        roughness: roughness as f32 / 65536.0,
        interpolation: interpolations.find(|i| i.name() == name)?,
    })
}
