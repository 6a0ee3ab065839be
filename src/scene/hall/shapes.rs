//! Triangle shapes of the built-in scene.

use crate::scene::{Mesh, normals};
use glam::{Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};

/// Collects triangles of one mesh. Texture coordinates are in metres.
#[derive(Default)]
pub(super) struct Shape {
    pub mesh: Mesh,
}

impl Shape {
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal);
        self.mesh.uvs.resize_with(1, Vec::new);
        self.mesh.uvs[0].push(uv);
        self.mesh.positions.len() as u32 - 1
    }

    pub fn triangle(&mut self, corners: [u32; 3], material: u32) {
        self.mesh.triangles.push(corners);
        self.mesh.materials.push(material);
    }

    /// A parallelogram seen from `u` x `v`.
    pub fn quad(&mut self, corner: Vec3, u: Vec3, v: Vec3, material: u32) {
        let normal = u.cross(v).normalize_or(Vec3::Y);
        let (lu, lv) = (u.length(), v.length());
        let at = [
            (corner, Vec2::new(0.0, lv)),
            (corner + u, Vec2::new(lu, lv)),
            (corner + u + v, Vec2::new(lu, 0.0)),
            (corner + v, Vec2::ZERO),
        ];
        let [a, b, c, d] = at.map(|(p, uv)| self.vertex(p, normal, uv));
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }

    /// A box between two corners.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, material: u32) {
        let d = max - min;
        let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
        self.quad(min + z, x, y, material);
        self.quad(min + x, -x, y, material);
        self.quad(min + x + z, -z, y, material);
        self.quad(min, z, y, material);
        self.quad(min + y + z, x, -z, material);
        self.quad(min, x, z, material);
    }

    /// A surface of revolution about +Y. `profile` is (radius, height) from the bottom up; a point
    /// that stands twice makes a crease.
    pub fn lathe(&mut self, centre: Vec3, profile: &[(f32, f32)], sides: u32, material: u32) {
        let slope = |a: (f32, f32), b: (f32, f32)| Vec2::new(b.1 - a.1, a.0 - b.0);
        for (i, pair) in profile.windows(2).enumerate() {
            if pair[0] == pair[1] {
                continue;
            }
            let here = slope(pair[0], pair[1]).normalize_or(Vec2::X);
            let smooth = |at: Option<&[(f32, f32)]>| match at {
                Some([a, b]) if a != b => {
                    (slope(*a, *b).normalize_or(Vec2::X) + here).normalize_or(here)
                }
                _ => here,
            };
            let before = smooth(i.checked_sub(1).and_then(|i| profile.get(i..i + 2)));
            let after = smooth(profile.get(i + 1..i + 3));
            let mut rings = [Vec::new(), Vec::new()];
            for (ring, ((radius, height), normal)) in
                rings.iter_mut().zip([(pair[0], before), (pair[1], after)])
            {
                for s in 0..=sides {
                    let (sin, cos) = (s as f32 / sides as f32 * TAU).sin_cos();
                    ring.push(self.vertex(
                        centre + Vec3::new(cos * radius, height, sin * radius),
                        Vec3::new(cos * normal.x, normal.y, sin * normal.x),
                        Vec2::new(s as f32 / sides as f32, height),
                    ));
                }
            }
            for s in 0..sides as usize {
                let (a, b) = (rings[0][s], rings[0][s + 1]);
                let (c, d) = (rings[1][s], rings[1][s + 1]);
                if pair[0].0 > 0.0 {
                    self.triangle([a, d, b], material);
                }
                if pair[1].0 > 0.0 {
                    self.triangle([a, c, d], material);
                }
            }
        }
    }

    /// A closed tube of round section along a closed curve.
    pub fn ring_tube(
        &mut self,
        curve: impl Fn(f32) -> Vec3,
        radius: f32,
        steps: u32,
        sides: u32,
        material: u32,
    ) {
        let mut rings: Vec<Vec<u32>> = Vec::new();
        for i in 0..=steps {
            let t = i as f32 / steps as f32;
            let ahead = (curve(t + 1e-3) - curve(t - 1e-3)).normalize_or(Vec3::X);
            // The curve is wound about +Y, so this never degenerates.
            let side = ahead.cross(Vec3::Y).normalize_or(Vec3::X);
            let up = side.cross(ahead);
            let ring = (0..=sides).map(|s| {
                let (sin, cos) = (s as f32 / sides as f32 * TAU).sin_cos();
                let normal = side * cos + up * sin;
                let uv = Vec2::new(t, s as f32 / sides as f32);
                self.vertex(curve(t) + normal * radius, normal, uv)
            });
            rings.push(ring.collect());
        }
        for pair in rings.windows(2) {
            for s in 0..sides as usize {
                let [a, b, c, d] = [pair[0][s], pair[0][s + 1], pair[1][s], pair[1][s + 1]];
                self.triangle([a, c, d], material);
                self.triangle([a, d, b], material);
            }
        }
    }

    /// A capsule from `a` to `b`. Gives for each new vertex its distance along the axis from `a`.
    pub fn capsule(&mut self, a: Vec3, b: Vec3, ra: f32, rb: f32, material: u32) -> Vec<f32> {
        const SIDES: usize = 12;
        const CAP: usize = 4;
        const SHAFT: usize = 5;
        let length = (b - a).length();
        let axis = (b - a).normalize_or(Vec3::Y);
        let x = axis.any_orthonormal_vector();
        let z = x.cross(axis);
        // (distance along the axis, radius, normal's slope along the axis)
        let mut rings: Vec<(f32, f32, f32)> = Vec::new();
        for i in 0..CAP {
            let (sin, cos) = (PI * 0.5 * i as f32 / CAP as f32).sin_cos();
            rings.push((-ra * cos, ra * sin, -cos));
        }
        for i in 0..=SHAFT {
            let t = i as f32 / SHAFT as f32;
            rings.push((length * t, ra + (rb - ra) * t, 0.0));
        }
        for i in (0..CAP).rev() {
            let (sin, cos) = (PI * 0.5 * i as f32 / CAP as f32).sin_cos();
            rings.push((length + rb * cos, rb * sin, cos));
        }
        let mut along = Vec::new();
        let mut last: Vec<u32> = Vec::new();
        for (distance, radius, slope) in rings {
            let ring: Vec<u32> = (0..=SIDES)
                .map(|s| {
                    let (sin, cos) = (s as f32 / SIDES as f32 * TAU).sin_cos();
                    let out = x * cos + z * sin;
                    let normal =
                        (out * (1.0 - slope * slope).sqrt() + axis * slope).normalize_or(axis);
                    along.push(distance);
                    let uv = Vec2::new(s as f32 / SIDES as f32, distance);
                    self.vertex(a + axis * distance + out * radius, normal, uv)
                })
                .collect();
            for s in 0..SIDES {
                if let (Some(p), Some(q)) = (last.get(s), last.get(s + 1)) {
                    let (r, t) = (ring[s], ring[s + 1]);
                    self.triangle([*p, t, *q], material);
                    self.triangle([*p, r, t], material);
                }
            }
            last = ring;
        }
        along
    }

    /// Closes the mesh: poles of capsules leave triangles without area.
    pub fn finish(mut self, name: &str) -> Mesh {
        self.mesh.name = name.to_owned();
        let mesh = &mut self.mesh;
        let (triangles, materials) = (
            std::mem::take(&mut mesh.triangles),
            std::mem::take(&mut mesh.materials),
        );
        for (t, m) in triangles.into_iter().zip(materials) {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            if (b - a).cross(c - a).length() > 1e-6 * (b - a).length_squared() {
                mesh.triangles.push(t);
                mesh.materials.push(m);
            }
        }
        normals::compact(mesh);
        self.mesh
    }
}

/// A hash of integers to 0..1.
pub(super) fn random(x: i32, y: i32, z: i32) -> f32 {
    let mut h = (x as u32)
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add((y as u32).wrapping_mul(0x85EB_CA77))
        .wrapping_add((z as u32).wrapping_mul(0xC2B2_AE3D));
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^= h >> 15;
    (h >> 8) as f32 / (1u32 << 24) as f32
}

/// Smooth noise in -1..1 with features of unit size.
fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec3::splat(3.0) - f * 2.0);
    let (x, y, z) = (cell.x as i32, cell.y as i32, cell.z as i32);
    let mut sum = 0.0;
    for corner in 0..8 {
        let (i, j, k) = (corner & 1, corner >> 1 & 1, corner >> 2);
        let weight = |bit: i32, f: f32| if bit == 1 { f } else { 1.0 - f };
        sum += random(x + i, y + j, z + k) * weight(i, f.x) * weight(j, f.y) * weight(k, f.z);
    }
    sum * 2.0 - 1.0
}

/// A rough ball of mean radius 1: an icosphere of 20 * 4^`levels` triangles.
pub(super) fn boulder(levels: u32, seed: f32, material: u32) -> Mesh {
    let golden = (1.0 + 5.0f32.sqrt()) * 0.5;
    let mut points: Vec<Vec3> = Vec::new();
    for (a, b) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.push(Vec3::new(a, b, 0.0));
    }
    for i in 0..4 {
        let p = points[i];
        points.push(Vec3::new(0.0, p.x, p.y));
    }
    for i in 0..4 {
        let p = points[i];
        points.push(Vec3::new(p.y, 0.0, p.x));
    }
    // Faces of an icosahedron: all triples at edge length 2, wound outwards.
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let near = |a: Vec3, b: Vec3| ((a - b).length() - 2.0).abs() < 1e-3;
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| points[i as usize]);
                if near(p, q) && near(q, r) && near(r, p) {
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push(
                        (points[i as usize].normalize() + points[j as usize].normalize()) * 0.5,
                    );
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let positions: Vec<Vec3> = points
        .iter()
        .map(|p| {
            let p = p.normalize();
            let at = p * 1.7 + Vec3::splat(seed);
            p * (1.0 + 0.16 * noise(at) + 0.06 * noise(at * 3.1))
        })
        .collect();
    Mesh {
        name: "boulder".to_owned(),
        normals: normals::face_normals(&positions, &triangles),
        uvs: vec![positions.iter().map(|p| Vec2::new(p.x, p.y)).collect()],
        positions,
        materials: vec![material; triangles.len()],
        triangles,
        ..Mesh::default()
    }
}

/// Four joints and their weights for a vertex of one or two joints.
pub(super) fn two_joints(joint: u16, other: u16, other_weight: f32) -> ([u16; 4], Vec4) {
    (
        [joint, other, 0, 0],
        Vec4::new(1.0 - other_weight, other_weight, 0.0, 0.0),
    )
}
