//! The hierarchy of one mesh.

use super::aabb::Aabb;
use super::build::{self, Effort};
use super::instructions::Instructions;
use super::packet::{LANES, Packet, TriangleHit};
use super::slab::SlabRay;
use super::wide::{NONE, SortedStack, WideBvh};
use crate::scene::{Alpha, Material, Mesh};
use glam::Vec3;

/// A refitted hierarchy is built anew when its cost ([`WideBvh::cost`]) has grown by this factor since
/// it was built.
const REBUILD_GROWTH: f64 = 2.0;

/// Triangles of a mesh that can stop a ray, in packets, under a hierarchy.
#[derive(Clone, Debug)]
pub struct Blas {
    tree: WideBvh,
    packets: Vec<Packet>,
    /// [`WideBvh::cost`] when the tree was built.
    built_cost: f64,
}

impl Blas {
    /// Of no triangles.
    pub fn empty() -> Blas {
        Blas {
            tree: WideBvh::from_children(&[]),
            packets: Vec::new(),
            built_cost: 0.0,
        }
    }

    /// Builds over `positions`, which may be those of the mesh or deformed ones. Triangles of BLEND
    /// materials are left out, and so are those with corners that do not exist or are not finite.
    pub fn build(mesh: &Mesh, materials: &[Material], positions: &[Vec3]) -> Blas {
        let mut solid: Vec<(u32, bool)> = Vec::with_capacity(mesh.triangles.len());
        let mut boxes = Vec::with_capacity(mesh.triangles.len());
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let material = mesh.materials.get(index);
            let material = material.and_then(|&m| materials.get(m as usize));
            let Some(corners) = corners(triangle, positions) else {
                continue;
            };
            let blended = material.is_some_and(|m| m.alpha == Alpha::Blend);
            if blended || !corners.iter().all(|c| c.is_finite()) {
                continue;
            }
            solid.push((index as u32, material.is_some_and(Material::has_holes)));
            boxes.push(Aabb {
                min: corners[0].min(corners[1]).min(corners[2]),
                max: corners[0].max(corners[1]).max(corners[2]),
            });
        }
        let topology = build::build(&boxes, LANES, Effort::Thorough);
        let packets = topology
            .leaves
            .iter()
            .map(|leaf| {
                let mut packet = Packet::EMPTY;
                for (lane, &primitive) in leaf.iter().enumerate().filter(|&(_, &p)| p != NONE) {
                    let (index, masked) = solid[primitive as usize];
                    if let Some(corners) = corners(&mesh.triangles[index as usize], positions) {
                        packet.set(lane, index, masked, corners);
                    }
                }
                packet
            })
            .collect();
        let mut blas = Blas {
            tree: WideBvh::from_children(&topology.nodes),
            packets,
            built_cost: 0.0,
        };
        blas.refit_boxes();
        blas.built_cost = blas.tree.cost();
        blas
    }

    /// Follows the mesh to other positions, with the same tree over new boxes; builds anew when
    /// that would be a bad tree, [`REBUILD_GROWTH`]. Returns whether it built.
    pub fn refit(&mut self, mesh: &Mesh, materials: &[Material], positions: &[Vec3]) -> bool {
        for packet in &mut self.packets {
            for lane in 0..LANES {
                let Some((index, masked)) = packet.triangle(lane) else {
                    continue;
                };
                if let Some(corners) = corners(&mesh.triangles[index as usize], positions) {
                    packet.set(lane, index, masked, corners);
                }
            }
        }
        self.refit_boxes();
        let bad = self.tree.cost() > REBUILD_GROWTH * self.built_cost;
        if bad {
            *self = Blas::build(mesh, materials, positions);
        }
        bad
    }

    fn refit_boxes(&mut self) {
        let packets = &self.packets;
        self.tree.refit(|leaf| packets[leaf as usize].bounds());
    }

    /// Mesh space.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// Boxes that together cover the mesh, closer than its one box.
    pub fn coarse_boxes(&self) -> impl Iterator<Item = Aabb> + '_ {
        self.tree.root_boxes()
    }

    /// Whether any triangle is hit at `0 < t <= t_max` for which `opaque` says so. `opaque` is
    /// asked about masked triangles only.
    #[inline(always)]
    pub fn occluded(
        &self,
        with: impl Instructions,
        ray: &SlabRay,
        t_max: f32,
        opaque: impl Fn(&TriangleHit) -> bool,
    ) -> bool {
        let mut walk = self.tree.walk();
        while let Some(leaf) = walk.next(with, ray, t_max) {
            let packet = &self.packets[leaf as usize];
            let mut candidates = packet.candidates(ray);
            while let Some(hit) = packet.next_hit(&mut candidates, ray, t_max) {
                if !hit.masked || opaque(&hit) {
                    return true;
                }
            }
        }
        false
    }

    /// The opaque hit with the least `t <= t_max`, of several the one of the lowest triangle.
    /// `opaque` is asked about every triangle that is hit nearer than those before.
    #[inline(always)]
    pub fn closest(
        &self,
        with: impl Instructions,
        ray: &SlabRay,
        mut t_max: f32,
        opaque: impl Fn(&TriangleHit) -> bool,
        stack: &mut SortedStack,
    ) -> Option<TriangleHit> {
        let mut best: Option<TriangleHit> = None;
        let mut walk = self.tree.walk_sorted(stack);
        while let Some(leaf) = walk.next(with, ray, t_max) {
            let packet = &self.packets[leaf as usize];
            let mut candidates = packet.candidates(ray);
            while let Some(hit) = packet.next_hit(&mut candidates, ray, t_max) {
                if !opaque(&hit) {
                    continue;
                }
                if best.is_none_or(|b| (hit.t, hit.triangle) < (b.t, b.triangle)) {
                    best = Some(hit);
                    t_max = hit.t;
                }
            }
        }
        best
    }

    /// Whether the box of any few triangles comes within `distance` of `point`.
    pub fn within(&self, point: Vec3, distance: f32) -> bool {
        self.tree.near(point, distance, |_| true)
    }

    /// The triangle test alone, on every packet: what any traversal must agree with.
    #[cfg(test)]
    pub fn brute_force(&self, ray: &SlabRay, t_max: f32, mut found: impl FnMut(TriangleHit)) {
        for packet in &self.packets {
            let mut candidates = packet.candidates(ray);
            while let Some(hit) = packet.next_hit(&mut candidates, ray, t_max) {
                found(hit);
            }
        }
    }
}

fn corners(triangle: &[u32; 3], positions: &[Vec3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = triangle.map(|i| positions.get(i as usize).copied());
    Some([a?, b?, c?])
}
