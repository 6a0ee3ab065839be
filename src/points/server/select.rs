//! Which points a tick has to trace: those that a mover can reach, once they are in view.

use super::{Server, Tick};
use crate::points::frustum::Frustum;
use crate::trace::Aabb;
use crate::trace::offset::OFFSET_PER_METRE;
use crate::world::World;
use glam::Affine3A;

/// Whether two transforms stretch alike, up to rounding: their columns have the same products.
fn same_scale(a: &Affine3A, b: &Affine3A) -> bool {
    let [a, b] = [a, b].map(|m| m.matrix3.transpose() * m.matrix3);
    let size = a.x_axis.x + a.y_axis.y + a.z_axis.z;
    a.abs_diff_eq(b, 1e-5 * size)
}

impl Server {
    /// Marks as stale what the world's movers can reach at its present pose.
    pub(super) fn mark_reached(&mut self, world: &World) {
        let movers = world.movers();
        if movers.is_empty() {
            return;
        }
        let (pose, other) = (world.pose(), world.other_pose());
        let instances = world.scene().instances.len();
        let (tracer, distance) = (world.tracer(), self.options.distance);
        // How far from a point's surface its rays may end at a mover: they start off the surface,
        // and the end is rounded no worse than what that offset makes up for.
        let reach_to = |mover: &Aabb| {
            let size = (mover.reach() + distance).max(tracer.reach());
            distance * (1.0 + 1e-5) + 2.0 * OFFSET_PER_METRE * size
        };
        let bounds: Vec<Aabb> = (0..instances).map(|i| tracer.bounds(i)).collect();
        for &mover in movers {
            let near = bounds[mover];
            let reach = reach_to(&near);
            let still = &self.still_chunks;
            let tracks = &mut self.tracks;
            self.still_tree.near(&near, reach, |item| {
                let (t, chunk) = still[item as usize];
                let track = &mut tracks[t as usize];
                let world = pose.world_from_mesh[track.instance];
                let sphere = track.template.chunks.bounds[chunk as usize].transformed(&world);
                if tracer.within(mover, sphere.centre(), sphere.radius() + reach) {
                    track.mark_chunk(chunk, |p| {
                        near.distance_squared(world.transform_point3(p)) <= reach * reach
                    });
                }
            });
        }
        // Points that move themselves: what matters is who is near and moves against them.
        let is_mover = {
            let mut flags = vec![false; instances];
            movers.iter().for_each(|&m| flags[m] = true);
            flags
        };
        for track in self.tracks.iter_mut().filter(|t| t.movable) {
            let own = track.instance;
            // Self-occlusion changes with the scale.
            let rescaled = || !same_scale(&other.world_from_mesh[own], &pose.world_from_mesh[own]);
            if is_mover[own] && (track.deforms || rescaled()) {
                track.mark_all();
                continue;
            }
            let world = pose.world_from_mesh[own];
            let others = (0..bounds.len()).filter(|&i| {
                let reach = reach_to(&bounds[i]);
                i != own
                    && (is_mover[own] || is_mover[i])
                    && bounds[i].gap_squared(&bounds[own]) <= reach * reach
            });
            for other in others {
                if track.deforms {
                    // Its chunks are bounded in the rest pose only.
                    track.mark_all();
                    break;
                }
                let near = bounds[other];
                let reach = reach_to(&near);
                for chunk in 0..track.template.chunks.bounds.len() as u32 {
                    let sphere = track.template.chunks.bounds[chunk as usize].transformed(&world);
                    if sphere.gap_squared(&near) <= reach * reach
                        && tracer.within(other, sphere.centre(), sphere.radius() + reach)
                    {
                        track.mark_chunk(chunk, |p| {
                            near.distance_squared(world.transform_point3(p)) <= reach * reach
                        });
                    }
                }
            }
        }
    }

    /// Takes the stale points in view off the list, at most `budget`, round-robin.
    pub(super) fn choose(
        &mut self,
        world: &World,
        frustum: Option<&Frustum>,
        budget: Option<usize>,
        tick: &mut Tick,
    ) -> Vec<(usize, u32)> {
        let (scene, pose) = (world.scene(), world.pose());
        let mut chosen = Vec::new();
        let mut waiting = 0;
        for (t, track) in self.tracks.iter_mut().enumerate() {
            if track.stale_chunks.is_empty() {
                continue;
            }
            track.stale_chunks.sort_unstable();
            let world = pose.world_from_mesh[track.instance];
            let deformed = pose.deformed[track.instance].as_ref();
            for &chunk in &track.stale_chunks {
                let bounds = track.template.chunks.bounds[chunk as usize].transformed(&world);
                // Chunks are bounded in the rest pose; deformed ones are tested point by point.
                let chunk_seen = deformed.is_some() || frustum.is_none_or(|f| f.touches(&bounds));
                for &p in track.template.chunks.points(chunk) {
                    if !track.stale[p as usize] {
                        continue;
                    }
                    let seen = chunk_seen
                        && frustum.is_none_or(|f| {
                            let at = match deformed {
                                None => track.template.positions[p as usize],
                                Some(d) => {
                                    let on_mesh = &track.template.placement.points[p as usize];
                                    let mesh = &scene.meshes[track.template.mesh];
                                    on_mesh.on(&mesh.triangles, &d.positions)
                                }
                            };
                            f.contains(world.transform_point3(at))
                        });
                    if seen {
                        chosen.push((t, p));
                    } else {
                        waiting += 1;
                    }
                }
            }
        }
        if let Some(budget) = budget.filter(|&b| b < chosen.len()) {
            chosen.sort_unstable();
            let from = chosen.partition_point(|c| *c < self.cursor);
            chosen.rotate_left(from);
            waiting += chosen.len() - budget;
            self.cursor = chosen[budget];
            chosen.truncate(budget);
        }
        for &(t, p) in &chosen {
            self.tracks[t].stale[p as usize] = false;
        }
        for track in self
            .tracks
            .iter_mut()
            .filter(|t| !t.stale_chunks.is_empty())
        {
            let (chunks, stale) = (&track.template.chunks, &track.stale);
            let flags = &mut track.chunk_is_stale;
            track.stale_chunks.retain(|&c| {
                let keep = chunks.points(c).iter().any(|&p| stale[p as usize]);
                flags[c as usize] = keep;
                keep
            });
        }
        tick.waiting_points = waiting;
        chosen
    }
}
