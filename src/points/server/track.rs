//! The points of one instance: where they are, what was sent of them, and which are out of date.

use super::hidden::Openness;
use super::options::Options;
use crate::points::chunks::Chunks;
use crate::points::grid;
use crate::points::place::{Density, Placement};
use crate::points::sample::GridTransform;
use crate::points::store::Store;
use crate::scene::{Pose, Scene, Surface};
use crate::trace::Aabb;
use glam::{Affine3A, Mat3, Vec3};
use std::sync::Arc;

/// A deforming point is sent again when it moved farther than this share of the interpolation
/// radius: two steps of a 32-bit point's position.
const MOVED: f32 = 1.0 / 8.0;
/// ... or when its normal turned by more than this cosine (8 degrees, about the mean error of a
/// 4+4 bit octahedral normal).
const TURNED: f32 = 0.990;

/// What all instances of one mesh at one scale share.
#[derive(Debug)]
pub(super) struct Template {
    pub(super) mesh: usize,
    pub(super) scale: Mat3,
    pub(super) density: Density,
    pub(super) placement: Placement,
    /// Mesh-space position of each point in the rest pose.
    pub(super) positions: Vec<Vec3>,
    pub(super) chunks: Chunks,
}

/// The points of one instance.
#[derive(Clone, Debug)]
pub struct Track {
    pub instance: usize,
    pub(super) template: Arc<Template>,
    pub(super) to_grid: GridTransform,
    /// Its linear part.
    pub(super) grid_scale: Mat3,
    /// Follows the posed vertices rather than the rest pose.
    pub(super) posed: bool,
    pub(super) deforms: bool,
    pub(super) movable: bool,
    pub store: Store,
    /// AO last sent, in steps of 1/255.
    pub(super) sent_ao: Vec<u8>,
    /// Left out when it was last traced ([`super::hidden`]).
    pub(super) hidden: Vec<bool>,
    /// Where a posed point was when it was last sent: grid position and normal.
    pub(super) sent_at: Vec<(Vec3, Vec3)>,
    pub(super) stale: Vec<bool>,
    pub(super) stale_chunks: Vec<u32>,
    pub(super) chunk_is_stale: Vec<bool>,
}

impl Track {
    pub fn points(&self) -> usize {
        self.template.placement.points.len()
    }

    pub fn candidates(&self) -> usize {
        self.template.placement.candidates
    }

    /// How densely the points were placed.
    pub fn density(&self) -> Density {
        self.template.density
    }

    /// Interpolation radius in metres.
    pub fn radius(&self) -> f32 {
        self.store.grid().radius
    }

    /// Bounds of the points in the rest pose, in mesh space.
    pub fn mesh_bounds(&self) -> Aabb {
        self.template
            .chunks
            .bounds
            .iter()
            .fold(Aabb::EMPTY, |a, b| a.union(b))
    }

    /// Where the scale flattens, the direction across the plane goes to the mesh's own.
    pub fn mesh_from_grid(&self) -> Affine3A {
        let scale = grid::invertible(self.grid_scale);
        let origin = self.to_grid.position(Vec3::ZERO);
        Affine3A::from_mat3(scale.inverse()) * Affine3A::from_translation(-origin)
    }

    pub fn looks_up_rest_pose(&self) -> bool {
        self.deforms && !self.posed
    }

    pub(super) fn mark_chunk(&mut self, chunk: u32, mut reached: impl FnMut(Vec3) -> bool) {
        let mut any = false;
        for &p in self.template.chunks.points(chunk) {
            if !self.stale[p as usize] && reached(self.template.positions[p as usize]) {
                self.stale[p as usize] = true;
                any = true;
            }
        }
        if any && !std::mem::replace(&mut self.chunk_is_stale[chunk as usize], true) {
            self.stale_chunks.push(chunk);
        }
    }

    pub(super) fn mark_all(&mut self) {
        for chunk in 0..self.template.chunks.bounds.len() as u32 {
            self.mark_chunk(chunk, |_| true);
        }
    }
}
/// A point as the tracing stage sees it.
pub(super) struct TracedPoint {
    pub(super) track: usize,
    pub(super) point: u32,
    pub(super) openness: Openness,
    pub(super) rays: u32,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
}

impl Track {
    /// The surface that a point lies on, from the point's side.
    pub(super) fn surface(&self, scene: &Scene, pose: &Pose, point: u32) -> Surface {
        let on_mesh = &self.template.placement.points[point as usize];
        let triangle = on_mesh.triangle as usize;
        let at = scene.surface(pose, self.instance, triangle, on_mesh.u, on_mesh.v);
        if on_mesh.back { at.flipped() } else { at }
    }

    /// A point on a surface with what its rays say. `track` is the index of this track.
    pub(super) fn traced(
        &self,
        track: usize,
        point: u32,
        at: &Surface,
        openness: Openness,
        rays: u32,
    ) -> TracedPoint {
        let (position, normal) = if self.looks_up_rest_pose() {
            (at.rest_position, at.rest_normal)
        } else {
            (at.mesh_position, at.mesh_normal)
        };
        TracedPoint {
            track,
            point,
            openness,
            rays,
            position: self.to_grid.position(position),
            normal: self.to_grid.normal(normal),
        }
    }

    /// Stores a traced point if it differs enough from what was last sent (PSAO §3.3).
    pub(super) fn apply(&mut self, p: &TracedPoint, options: &Options) -> bool {
        let i = p.point as usize;
        let ao = (p.openness.ao * 255.0).round() as u8;
        let had = self.store.has(p.point);
        self.hidden[i] = p.openness.is_hidden(options, self.hidden[i]);
        if self.hidden[i] {
            self.store.unset(p.point);
            self.sent_ao[i] = 0;
            return had;
        }
        if had {
            let change = (ao as f32 - self.sent_ao[i] as f32).abs() / 255.0;
            let moved = self.posed && {
                let (position, normal) = self.sent_at[i];
                position.distance(p.position) > MOVED * self.store.grid().radius
                    || normal.dot(p.normal) < TURNED
            };
            if !moved && (change < options.threshold || change == 0.0) {
                return false;
            }
        }
        self.sent_ao[i] = ao;
        if self.posed {
            self.sent_at[i] = (p.position, p.normal);
        }
        let grid = *self.store.grid();
        let cell = grid::cell_at(&grid, p.position);
        let corner = cell.unwrap_or_default().map(|c| c as f32);
        let inside = p.position / grid.cell_edge - Vec3::from(corner);
        let word = grid
            .widths
            .pack(inside.to_array(), p.normal.to_array(), p.openness.ao);
        self.store.set(p.point, cell, word);
        true
    }
}
