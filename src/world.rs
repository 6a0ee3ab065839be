//! A scene at one moment, lent to all models of a stream: it is posed once a tick, and its
//! acceleration structures are built when something first asks for them and refitted when something
//! moves.

use crate::scene::{CameraPose, LightPose, Pose, Scene};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A scene, its pose, and the acceleration structures at that pose.
pub struct World<'s> {
    scene: &'s Scene,
    pose: Pose,
    other: Pose,
    movers: Vec<usize>,
    tracer: OnceLock<Tracer<'s>>,
    /// What the client looks through; `None` where any part of the scene may be seen.
    pub camera: Option<CameraPose>,
    pose_time: Duration,
    update_time: Duration,
}

impl<'s> World<'s> {
    /// The scene at `time` seconds.
    pub fn new(scene: &'s Scene, time: f64) -> World<'s> {
        World {
            scene,
            pose: scene.pose(time),
            other: Pose::default(),
            movers: Vec::new(),
            tracer: OnceLock::new(),
            camera: None,
            pose_time: Duration::ZERO,
            update_time: Duration::ZERO,
        }
    }

    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The pose before the last [`World::advance`]; while that calls `leaving`, the pose after it.
    pub fn other_pose(&self) -> &Pose {
        &self.other
    }

    /// Instances whose transform or shape differ between [`World::pose`] and [`World::other_pose`],
    /// ascending.
    pub fn movers(&self) -> &[usize] {
        &self.movers
    }

    /// The acceleration structures at [`World::pose`].
    pub fn tracer(&self) -> &Tracer<'s> {
        self.tracer
            .get_or_init(|| Tracer::new(self.scene, &self.pose))
    }

    pub fn paths(&self, sky: Sky) -> PathTracer<'_> {
        PathTracer::new(self.scene, &self.pose, self.tracer(), sky)
    }

    /// Moves the scene to `time` seconds. `leaving` sees the world just before it moves, with what
    /// will move and where to: what depends on geometry that is about to leave can look at it last.
    pub fn advance(&mut self, time: f64, leaving: impl FnOnce(&World)) {
        let clock = Instant::now();
        let scene = self.scene;
        scene.pose_into(time, &mut self.other);
        let (now, next) = (&self.pose, &self.other);
        let can_move = |i: usize| scene.can_move(i);
        let moves = |i: &usize| {
            can_move(*i)
                && (now.world_from_mesh[*i] != next.world_from_mesh[*i]
                    || now.deformed[*i] != next.deformed[*i])
        };
        self.movers = (0..scene.instances.len()).filter(moves).collect();
        self.pose_time = clock.elapsed();
        leaving(self);
        std::mem::swap(&mut self.pose, &mut self.other);
        let clock = Instant::now();
        if let Some(tracer) = self.tracer.get_mut()
            && !self.movers.is_empty()
        {
            tracer.update(&self.pose);
        }
        self.update_time = clock.elapsed();
    }

    /// The lights of the pose, to be changed until the next [`World::advance`].
    pub fn lights_mut(&mut self) -> &mut [LightPose] {
        &mut self.pose.lights
    }

    /// How long the last [`World::advance`] took for animation and skinning.
    pub fn pose_time(&self) -> Duration {
        self.pose_time
    }

    /// How long the last [`World::advance`] took for acceleration structures.
    pub fn update_time(&self) -> Duration {
        self.update_time
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::Ray;
    use glam::Vec3;

    /// A world that has moved traces as one that was made there does.
    #[test]
    fn advanced_world_equals_new_world() {
        let scene = Scene::hall();
        let mut moved = World::new(&scene, 0.0);
        moved.tracer();
        let before = moved.pose().clone();
        let mut leaving = Vec::new();
        moved.advance(1.5, |world| {
            assert_eq!(world.pose().world_from_mesh, before.world_from_mesh);
            leaving = world.movers().to_vec();
        });
        assert!(!leaving.is_empty());
        assert_eq!(leaving, moved.movers());
        let there = World::new(&scene, 1.5);
        assert_eq!(moved.pose().world_from_mesh, there.pose().world_from_mesh);
        assert_eq!(moved.other_pose().world_from_mesh, before.world_from_mesh);
        let ray = |k: usize| Ray {
            origin: Vec3::new(0.0, 1.5, 0.0),
            direction: Vec3::new(
                (k as f32).sin(),
                (k as f32 * 0.7).cos(),
                (k as f32 * 1.3).sin(),
            )
            .normalize(),
            t_max: f32::INFINITY,
        };
        for k in 0..500 {
            let hits = [&moved, &there].map(|world| world.tracer().closest(&ray(k)));
            assert_eq!(hits[0].map(|h| h.t), hits[1].map(|h| h.t));
        }
    }

    #[test]
    fn nothing_moves_between_equal_times() {
        let scene = Scene::hall();
        let mut world = World::new(&scene, 2.0);
        world.advance(2.0, |_| {});
        assert!(world.movers().is_empty());
    }
}
