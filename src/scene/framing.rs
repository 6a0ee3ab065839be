//! A camera for a scene that has none: outside an object, inside a room, in front of an open box.
//!
//! Looking at a box from a corner shows nothing of a room, and comparing how much area faces the
//! middle fails for walls that have two sides. So the nearest surface along the six axes is found
//! for a grid of points: a point with front faces in at least five of them is inside a room, one
//! side of which may be open; a point inside a solid has back faces, and one in the open has nothing
//! in most directions. A scene that is mostly open and has no hollow part of a room's size is an object.

use super::camera::{DEFAULT_YFOV, look_at};
use super::{CameraPose, Pose, Scene};
use glam::Vec3;

/// Points of the grid along X, Y and Z.
const GRID: [usize; 3] = [7, 3, 7];
/// Axes of six that must end at a front face.
const ENCLOSED: usize = 5;
/// Axes of six without a surface from which a point is in the open.
const OPEN: usize = 3;
/// Metres of free view that a hollow part has at least to be a room, in a scene that is mostly open.
const ROOM: f32 = 1.5;
/// Share of the points inside rooms that have the same side open from which the view goes through it.
const OPEN_SIDE: f32 = 0.5;
/// A view is worth no more than this many times the width of the place.
const LONGEST_VIEW: f32 = 4.0;
/// In a scene of [`Scene::length_scale`] 1.
const EYE_HEIGHT: f32 = 1.6;
/// Factor on the distance from which all of an object is just seen.
const MARGIN: f32 = 1.05;
/// Width over height that a picture is taken to have at least.
const WIDE: f32 = 1.5;

/// The nearest surface along one direction: distance, and whether its front is seen.
#[derive(Clone, Copy)]
struct FirstHit {
    distance: f32,
    front: bool,
}

const NOTHING: FirstHit = FirstHit {
    distance: f32::INFINITY,
    front: false,
};

/// A point and the nearest surfaces along -X, +X, -Y, +Y, -Z, +Z.
struct Sample {
    at: Vec3,
    hits: [FirstHit; 6],
}

impl Scene {
    /// A camera for a scene that has none: from within the widest room; through the open side of a
    /// box that has one; else from above a corner of the scene's bounds, far enough to see it whole.
    pub fn framing_camera(&self, pose: &Pose) -> CameraPose {
        let Some((min, max)) = self.bounds(pose) else {
            return look_at(Vec3::Z, Vec3::ZERO, DEFAULT_YFOV);
        };
        let samples = self.samples(pose, min, max);
        let rooms: Vec<&Sample> = samples.iter().filter(|s| s.is_inside()).collect();
        let in_the_open = samples.iter().filter(|s| s.is_in_the_open()).count();
        let middle = (min + max) * 0.5;
        let half = (max - min) * 0.5;
        let object = rooms.len() < in_the_open;
        let (direction, distance) = if let Some(side) = open_side(&rooms).filter(|_| !object) {
            // The open side fills the height of the picture, or its width where it is wide.
            let across = side.abs().cross(Vec3::Y);
            let size = half.y.max(half.dot(across.abs()) / WIDE);
            let tangent = (DEFAULT_YFOV * 0.5).tan();
            (side, half.dot(side.abs()) + size / tangent)
        } else if let Some((eye, target)) = room_view(&rooms, self.length_scale())
            .filter(|(eye, target)| !object || eye.distance(*target) >= ROOM)
        {
            let mut camera = look_at(eye, target, DEFAULT_YFOV * 1.25);
            camera.znear = (eye.distance(target) * 1e-2).min(self.near_plane());
            return camera;
        } else {
            let direction = Vec3::new(0.6, 0.45, 0.75).normalize();
            (direction, whole_view(half, direction))
        };
        let mut camera = look_at(middle + direction * distance, middle, DEFAULT_YFOV);
        camera.znear = (distance * 1e-3).min(self.near_plane());
        camera
    }

    /// The grid of points over the bounds, with the nearest surfaces along the axes.
    fn samples(&self, pose: &Pose, min: Vec3, max: Vec3) -> Vec<Sample> {
        let place = |axis: usize, i: usize| {
            // Off the regular fractions, where scenes like to have their walls.
            let f = (i as f32 + 0.47) / GRID[axis] as f32;
            min[axis] + (max[axis] - min[axis]) * f
        };
        let index = |i: [usize; 3]| (i[0] * GRID[1] + i[1]) * GRID[2] + i[2];
        let mut samples = Vec::with_capacity(GRID[0] * GRID[1] * GRID[2]);
        for i in 0..GRID[0] {
            for j in 0..GRID[1] {
                for k in 0..GRID[2] {
                    samples.push(Sample {
                        at: Vec3::new(place(0, i), place(1, j), place(2, k)),
                        hits: [NOTHING; 6],
                    });
                }
            }
        }
        self.for_each_triangle(pose, |[a, b, c]| {
            let normal = (b - a).cross(c - a);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            for axis in 0..3 {
                let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                if normal[axis] == 0.0 {
                    continue;
                }
                for i in 0..GRID[p] {
                    let x = place(p, i);
                    if x < low[p] || x > high[p] {
                        continue;
                    }
                    for j in 0..GRID[q] {
                        let y = place(q, j);
                        if y < low[q] || y > high[q] {
                            continue;
                        }
                        // Twice the signed areas, seen along the axis.
                        let side = |s: Vec3, t: Vec3| {
                            (t[p] - s[p]) * (y - s[q]) - (t[q] - s[q]) * (x - s[p])
                        };
                        let (u, v, w) = (side(b, c), side(c, a), side(a, b));
                        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0)
                            || (u <= 0.0 && v <= 0.0 && w <= 0.0);
                        let sum = u + v + w;
                        if !inside || sum == 0.0 {
                            continue;
                        }
                        let hit = (a[axis] * u + b[axis] * v + c[axis] * w) / sum;
                        for k in 0..GRID[axis] {
                            let mut at = [0; 3];
                            (at[axis], at[p], at[q]) = (k, i, j);
                            let sample = &mut samples[index(at)];
                            let ahead = hit - sample.at[axis];
                            let slot = &mut sample.hits[axis * 2 + usize::from(ahead > 0.0)];
                            if ahead.abs() < slot.distance {
                                *slot = FirstHit {
                                    distance: ahead.abs(),
                                    front: normal[axis] * ahead < 0.0,
                                };
                            }
                        }
                    }
                }
            }
        });
        samples
    }
}

/// The distance from the middle of a box, of half the size `half`, from which a camera that looks at
/// the middle against `direction` sees all of it.
fn whole_view(half: Vec3, direction: Vec3) -> f32 {
    let right = Vec3::Y.cross(direction).normalize();
    let up = direction.cross(right);
    let tangent = (DEFAULT_YFOV * 0.5).tan();
    let corners = (0..8).map(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        half * Vec3::new(sign(0), sign(1), sign(2))
    });
    let needed = corners.map(|corner| {
        let across = corner.dot(up).abs().max(corner.dot(right).abs() / WIDE);
        corner.dot(direction) + across / tangent
    });
    MARGIN * needed.fold(f32::MIN_POSITIVE, f32::max)
}

impl Sample {
    /// Whether the point is inside a room: above a floor, with one open side at most.
    fn is_inside(&self) -> bool {
        self.hits.iter().filter(|hit| hit.front).count() >= ENCLOSED && self.hits[2].front
    }

    fn is_in_the_open(&self) -> bool {
        self.hits
            .iter()
            .filter(|hit| hit.distance.is_infinite())
            .count()
            >= OPEN
    }
}

/// The horizontal direction in which most of the points inside rooms have no surface.
fn open_side(rooms: &[&Sample]) -> Option<Vec3> {
    let sides = [
        (0, Vec3::NEG_X),
        (1, Vec3::X),
        (4, Vec3::NEG_Z),
        (5, Vec3::Z),
    ];
    let most = (rooms.len() as f32 * OPEN_SIDE) as usize;
    let is_open = |axis: usize| {
        let open = rooms.iter().filter(|s| s.hits[axis].distance.is_infinite());
        open.count() > most
    };
    let open = sides.iter().find(|(axis, _)| is_open(*axis));
    open.map(|(_, side)| *side)
}

/// Eye and target of the best view from inside, if any point is. `length_scale` is the scene's.
fn room_view(rooms: &[&Sample], length_scale: f32) -> Option<(Vec3, Vec3)> {
    let mut best: Option<(f32, Vec3, Vec3)> = None;
    for sample in rooms {
        let hits = &sample.hits;
        for (direction, across) in [(0, [4, 5]), (1, [4, 5]), (4, [0, 1]), (5, [0, 1])] {
            let free = hits[direction].distance;
            let nearest = hits[across[0]].distance.min(hits[across[1]].distance);
            if !free.is_finite() || !nearest.is_finite() {
                continue;
            }
            let score = free.min(LONGEST_VIEW * nearest);
            if best.as_ref().is_none_or(|(s, _, _)| score > *s) {
                let (down, up) = (hits[2].distance, hits[3].distance);
                let tall = if up.is_finite() {
                    down + up
                } else {
                    2.0 * down
                };
                let height = (EYE_HEIGHT * length_scale)
                    .min(tall * 0.55)
                    .min(down.max(tall * 0.3));
                let eye = Vec3::new(sample.at.x, sample.at.y - down + height, sample.at.z);
                let sign = if direction % 2 == 0 { -1.0 } else { 1.0 };
                let mut target = eye;
                target[direction / 2] += sign * free;
                best = Some((score, eye, target));
            }
        }
    }
    best.map(|(_, eye, target)| (eye, target))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Mesh};

    /// A box of 4 x 3 x 8 m that is seen from outside or from inside.
    fn container(inside: bool) -> Scene {
        walls(inside, 6)
    }

    /// The first `count` walls of the box; the last is that at the largest z.
    fn walls(inside: bool, count: usize) -> Scene {
        let corner = |i: usize| {
            let bit = |b: usize| (i >> b & 1) as f32;
            Vec3::new(4.0 * bit(0), 3.0 * bit(1), 8.0 * bit(2))
        };
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let mut mesh = Mesh {
            positions: (0..8).map(corner).collect(),
            normals: vec![Vec3::Y; 8],
            ..Mesh::default()
        };
        for &[a, b, c, d] in &quads[..count] {
            for t in [[a, b, c], [a, c, d]] {
                mesh.triangles
                    .push(if inside { [t[0], t[2], t[1]] } else { t });
                mesh.materials.push(0);
            }
        }
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn a_room_is_seen_from_inside_and_an_object_from_outside() {
        for inside in [true, false] {
            let scene = container(inside);
            let camera = scene.framing_camera(&scene.rest_pose());
            let eye = camera.eye();
            let within = eye.cmpgt(Vec3::ZERO).all() && eye.cmplt(Vec3::new(4.0, 3.0, 8.0)).all();
            assert_eq!(within, inside, "{eye}");
            if inside {
                // Along the room, from its far end.
                let ahead = camera.ray(0.5, 0.5, 1, 1);
                assert!(
                    ahead.z.abs() > 0.9 && ahead.z * (4.0 - eye.z) > 0.0,
                    "{eye} {ahead}"
                );
            }
        }
    }

    #[test]
    fn open_box_is_seen_through_its_open_side() {
        let scene = walls(true, 5);
        let camera = scene.framing_camera(&scene.rest_pose());
        let (eye, ahead) = (camera.eye(), camera.ray(0.5, 0.5, 1, 1));
        assert!(eye.z > 8.0 && ahead.z < -0.99, "{eye} {ahead}");
    }

    #[test]
    fn object_with_a_hollow_stand_is_seen_from_outside() {
        // The stand is hollow, with walls to its inside, a tenth of the object's height; a pole stands
        // on it.
        let mut scene = container(true);
        let mesh = &mut scene.meshes[0];
        let base = mesh.positions.len() as u32;
        mesh.positions.extend([
            Vec3::new(2.0, 3.0, 4.0),
            Vec3::new(2.1, 3.0, 4.0),
            Vec3::new(2.0, 30.0, 4.0),
        ]);
        mesh.normals.extend([Vec3::Z; 3]);
        mesh.triangles.push([base, base + 1, base + 2]);
        mesh.materials.push(0);
        // Of a size of 0.6 m.
        mesh.positions.iter_mut().for_each(|p| *p *= 0.02);
        let eye = scene.framing_camera(&scene.rest_pose()).eye();
        assert!(eye.x > 0.08 && eye.z > 0.16, "{eye}");
    }
}
