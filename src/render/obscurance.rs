//! Baked obscurance for every pixel of a G-buffer: what `vertices`, `instances` and `regions` tracks say of it
//! together (`spec/obscurance.md` §5). An instance with a `points` track in the same stream is lit by that.

use super::gbuffer::{Fragment, GBuffer, NONE};
use super::vertices::{Query, State};
use crate::client::Client;
use crate::codec::vertices::remap;
use crate::instances::client::InstancesView;
use crate::points::client::{PointsState, PointsView};
use crate::regions::client::{Place, RegionsView};
use crate::scene::{Pose, Scene};
use crate::trace::Aabb;
use crate::vertices::client::VerticesView;
use crate::vertices::sample::MeshValues;
use crate::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Where the AO of the pixels that see geometry comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Values at the vertices of the instance.
    pub vertices: u64,
    /// What the instance has, times the local values of its mesh if there are any.
    pub instances: u64,
    /// The region that the instance is in.
    pub regions: u64,
    /// Points on the instance.
    pub points: u64,
    /// Nothing: AO = 1.
    pub none: u64,
}

/// AO per pixel and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedAo {
    /// One value a pixel, row by row from the top; 1 in the sky.
    pub ao: Vec<f32>,
    pub counts: Counts,
}

/// What a client has of each mesh instance of a scene at a pose.
pub struct Baked<'c> {
    points: PointsView<'c>,
    vertices: VerticesView<'c>,
    meshes: Vec<MeshValues>,
    instances: InstancesView,
    regions: RegionsView<'c>,
    sources: Vec<Source>,
    /// By mesh: the numbers of its distinct vertices, where a track counts those.
    remaps: BTreeMap<usize, Vec<u32>>,
}

/// What an instance is lit by.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    /// Its own values, by their index in `meshes`.
    Own(u32),
    /// Its entry, times the values of its mesh.
    Product(Option<u32>),
    /// The region that its middle is in.
    Region(Place),
    /// Points of its own.
    Points,
    None,
}

impl<'c> Baked<'c> {
    /// Finds what each instance has, once.
    ///
    /// # Errors
    /// `Invalid` for a track with another number of vertices than its mesh.
    pub fn new(client: &'c Client, scene: &Scene, pose: &Pose) -> Result<Baked<'c>> {
        let mut baked = Baked {
            points: PointsView::new(client),
            vertices: VerticesView::new(client),
            meshes: Vec::new(),
            instances: InstancesView::new(client),
            regions: RegionsView::new(client),
            sources: Vec::new(),
            remaps: BTreeMap::new(),
        };
        for instance in 0..scene.instances.len() {
            let source = baked.source(scene, pose, instance)?;
            baked.sources.push(source);
        }
        Ok(baked)
    }

    fn source(&mut self, scene: &Scene, pose: &Pose, instance: usize) -> Result<Source> {
        // Points that follow a deforming mesh are looked up by its pose, which the G-buffer does not have.
        let has_points = self.points.has(instance);
        if has_points
            && (self.points.looks_up_rest_pose() || !scene.is_deforming_instance(instance))
        {
            return Ok(Source::Points);
        }
        let mesh = scene.instances[instance].mesh;
        let found = self.vertices.of_instance(instance).copied();
        if let Some(found) = found {
            let expected = match found.is_remapped {
                false => scene.meshes[mesh].positions.len(),
                true => {
                    let remap = self.remaps.entry(mesh).or_insert_with(|| {
                        let mesh = &scene.meshes[mesh];
                        remap(
                            bytemuck::cast_slice(&mesh.positions),
                            bytemuck::cast_slice(&mesh.normals),
                        )
                    });
                    remap.iter().max().map_or(0, |last| *last as usize + 1)
                }
            };
            if found.count as usize != expected {
                return Err(Error::Invalid(format!(
                    "the stream has {} vertices for '{}', whose mesh has {expected}",
                    found.count, scene.instances[instance].name
                )));
            }
        }
        let values = found.map(|found| {
            self.meshes.push(found.values);
            self.meshes.len() as u32 - 1
        });
        let has_entry = self.instances.entry(instance).is_some();
        let moves = scene.can_move(instance);
        let region = || {
            let place = self.regions.find(middle(scene, pose, instance));
            place.map(Source::Region)
        };
        Ok(match (found, values) {
            (Some(found), Some(values)) if found.is_own => Source::Own(values),
            _ if has_entry => Source::Product(values),
            // What moves is where its region says, and not in the midst of nothing as its mesh was baked.
            (Some(_), _) if moves => region().unwrap_or(Source::Product(values)),
            (Some(_), _) => Source::Product(values),
            (None, _) => region().unwrap_or(Source::None),
        })
    }

    /// The questions to the `vertices` pass: for each pixel whose instance has values.
    pub(super) fn queries(&self, scene: &Scene, gbuffer: &GBuffer) -> Vec<(usize, Query)> {
        let pixels = gbuffer.fragments.par_iter().enumerate();
        pixels
            .filter_map(|(pixel, fragment)| {
                let (Source::Own(mesh) | Source::Product(Some(mesh))) = self.source_of(fragment)?
                else {
                    return None;
                };
                let own = scene.instances[fragment.instance as usize].mesh;
                let mut vertices = scene.meshes[own].triangles[fragment.triangle as usize];
                let is_remapped = self.vertices.of_instance(fragment.instance as usize);
                if is_remapped.is_some_and(|found| found.is_remapped) {
                    vertices = vertices.map(|v| self.remaps[&own][v as usize]);
                }
                let [v, w] = fragment.weights;
                let query = Query {
                    vertices,
                    mesh: *mesh,
                    weights: [1.0 - v - w, v, w],
                    pad: 0,
                };
                Some((pixel, query))
            })
            .collect()
    }

    /// What the `vertices` pass looks up in.
    pub(super) fn state(&self) -> State<'_> {
        State {
            values: self.vertices.values,
            meshes: &self.meshes,
        }
    }

    /// What the `points` pass looks up in; `None` where no instance has points.
    pub(super) fn points(&self) -> Option<PointsState<'_>> {
        let has_points = self.sources.contains(&Source::Points);
        has_points.then(|| self.points.state())
    }

    /// AO of all pixels, from what the `vertices` pass found for those that have values, and what the `points` pass
    /// found for all.
    pub(super) fn combine(
        &self,
        gbuffer: &GBuffer,
        local: &[(usize, f32)],
        points: Option<Vec<f32>>,
    ) -> BakedAo {
        let mut ao = vec![1.0; gbuffer.fragments.len()];
        let of_points = points.iter().flatten().zip(&gbuffer.fragments);
        for (ao, (points, fragment)) in ao.iter_mut().zip(of_points) {
            if self.source_of(fragment) == Some(&Source::Points) {
                *ao = *points;
            }
        }
        for (pixel, local) in local {
            ao[*pixel] = *local;
        }
        let counts = ao
            .par_iter_mut()
            .zip(&gbuffer.fragments)
            .map(|(ao, fragment)| self.finish(fragment, ao))
            .reduce(Counts::default, |a, b| Counts {
                vertices: a.vertices + b.vertices,
                instances: a.instances + b.instances,
                regions: a.regions + b.regions,
                points: a.points + b.points,
                none: a.none + b.none,
            });
        BakedAo { ao, counts }
    }

    /// Turns the local AO of a pixel, or that of points, into what is shown.
    fn finish(&self, fragment: &Fragment, ao: &mut f32) -> Counts {
        let mut counts = Counts::default();
        match self.source_of(fragment) {
            None => {}
            Some(Source::Own(_)) => counts.vertices = 1,
            Some(Source::Product(_)) => {
                let position = fragment.lookup_position.to_array();
                *ao = self.instances.ao(fragment.instance as usize, position, *ao);
                counts.instances = 1;
            }
            Some(Source::Region(place)) => {
                *ao = self
                    .regions
                    .sample(*place, fragment.position, fragment.normal);
                counts.regions = 1;
            }
            Some(Source::Points) => counts.points = 1,
            Some(Source::None) => counts.none = 1,
        }
        counts
    }

    fn source_of(&self, fragment: &Fragment) -> Option<&Source> {
        match fragment.instance {
            NONE => None,
            instance => self.sources.get(instance as usize),
        }
    }
}

/// The middle of an instance's box in world space.
fn middle(scene: &Scene, pose: &Pose, instance: usize) -> Vec3 {
    let positions = pose.shape(scene, instance).iter().copied();
    let centre = Aabb::of(positions).centre();
    pose.world_from_mesh[instance].transform_point3(centre)
}
