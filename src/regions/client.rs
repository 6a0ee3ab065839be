//! The client's view of the model `regions`: the obscurance of objects that move, by where they are.

use super::index::Index;
use super::sample::Regions;
use crate::client::Client;
use crate::codec::regions::{Pair, Region, RegionSet};
use crate::codec::{Decoder, TrackState};
use glam::{Affine3A, Mat3A, Vec3};

/// The regions of a client as of its last frame.
pub struct RegionsView<'c> {
    pub tracks: Vec<RegionsTrack<'c>>,
}

impl<'c> RegionsView<'c> {
    /// Makes an index of every track that has regions, once.
    pub fn new(client: &'c Client) -> RegionsView<'c> {
        let decoder = client.decoder();
        let tracks = decoder.tracks().iter();
        RegionsView {
            tracks: tracks
                .filter_map(|track| RegionsTrack::new(decoder, track))
                .filter(|track| !track.regions.is_empty())
                .collect(),
        }
    }

    /// AO at a place in the world with a unit normal: by the region whose box is nearest, of the first such
    /// track; 1 without regions.
    pub fn ao(&self, position: Vec3, normal: Vec3) -> f32 {
        self.find(position)
            .map_or(1.0, |place| self.sample(place, position, normal))
    }

    /// Track and region of a place in the world. An object keeps it for all its fragments, and hands it to
    /// the shader.
    pub fn find(&self, position: Vec3) -> Option<Place> {
        let mut best: Option<(f32, Place)> = None;
        for (track, regions) in self.tracks.iter().enumerate() {
            let Some((region, distance_squared)) = regions.find(position) else {
                continue;
            };
            if best.is_none_or(|(best, _)| distance_squared < best) {
                best = Some((distance_squared, Place { track, region }));
            }
        }
        best.map(|(_, place)| place)
    }

    /// Distance of a place in the world from the box of a region (m): 0 within it, infinite where that is no region.
    pub fn distance(&self, place: Place, position: Vec3) -> f32 {
        let track = self.tracks.get(place.track);
        let region = track.and_then(|track| Some((track, track.regions.get(place.region)?)));
        region.map_or(f32::INFINITY, |(track, region)| {
            let x = track.space_from_world.transform_point3(position);
            super::sample::distance_squared(region.min.into(), region.max.into(), x).sqrt()
        })
    }

    /// AO at a place in the world with a unit normal, by the region of an earlier [`RegionsView::find`]; 1
    /// where that is no region.
    pub fn sample(&self, place: Place, position: Vec3, normal: Vec3) -> f32 {
        let Some(track) = self.tracks.get(place.track) else {
            return 1.0;
        };
        let x = track.space_from_world.transform_point3(position);
        let n = track.space_from_world.transform_vector3(normal);
        track.regions().sample(place.region, x, n)
    }
}

/// A region of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index in [`RegionsView::tracks`].
    pub track: usize,
    /// Index in the track's array of regions.
    pub region: usize,
}

/// The regions of one track. The arrays are the decoder's own.
pub struct RegionsTrack<'a> {
    /// The track's parameters.
    pub set: RegionSet,
    /// Its arrays, which upload as they are.
    pub regions: &'a [Region],
    pub pairs: &'a [Pair],
    /// Rigid: a place in the world to the track's space.
    pub space_from_world: Affine3A,
    index: Index,
}

impl<'a> RegionsTrack<'a> {
    /// The regions of a track as of the last commit; `None` for a track of another model.
    pub fn new(decoder: &'a Decoder, track: &TrackState) -> Option<RegionsTrack<'a>> {
        let set = *track.track.region_set()?;
        let state = decoder.regions();
        let (regions, pairs) = (state.regions_of(track), state.pairs_of(track));
        let world_from_space = track.transform.map_or(Affine3A::IDENTITY, |transform| {
            let rows = transform.world_from_grid;
            let columns = rows.map(|[x, y, z, _]| [x, y, z]);
            Affine3A {
                matrix3: Mat3A::from_cols_array_2d(&columns).transpose(),
                translation: rows.map(|row| row[3]).into(),
            }
        });
        Some(RegionsTrack {
            set,
            regions,
            pairs,
            space_from_world: world_from_space.inverse(),
            index: Index::new(regions),
        })
    }

    /// What the sampler looks up in.
    pub fn regions(&self) -> Regions<'_> {
        Regions::new(&self.set, self.regions, self.pairs)
    }

    /// Region of a place in the world, and its squared distance from the region's box (m²).
    fn find(&self, position: Vec3) -> Option<(usize, f32)> {
        let x = self.space_from_world.transform_point3(position);
        let region = self.index.find(self.regions, x)?;
        let Region { min, max, .. } = self.regions[region];
        let distance = super::sample::distance_squared(min.into(), max.into(), x);
        Some((region, distance))
    }
}

/// AO of an object over time: exponential decay towards what is sampled, so that nothing pops where the
/// object goes from one region to the next (§2.3 of the paper; `spec/regions.md` §10.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemporalBlend {
    /// Seconds in which a difference falls to 1/e; 0 for none.
    pub time_constant: f32,
    value: Option<f32>,
}

impl TemporalBlend {
    /// An object that has not been seen yet.
    pub fn new(time_constant: f32) -> TemporalBlend {
        TemporalBlend {
            time_constant,
            value: None,
        }
    }

    /// What is shown of an object `seconds` after the last frame. One that appears starts with what is
    /// sampled. The result does not depend on how time is cut into frames.
    pub fn update(&mut self, sampled: f32, seconds: f32) -> f32 {
        let shown = match self.value {
            Some(value) if self.time_constant > 0.0 => {
                let left = (-seconds.max(0.0) / self.time_constant).exp();
                sampled + (value - sampled) * left
            }
            _ => sampled,
        };
        self.value = Some(shown);
        shown
    }

    /// The object appears anew, after a teleport for instance.
    pub fn reset(&mut self) {
        self.value = None;
    }
}
