//! What stands and hangs in the hall: benches, a sculpture, banners, plants.

use super::shapes::{Shape, random};
use super::*;

pub(super) fn add(scene: &mut Scene) {
    let mut bench = Shape::default();
    bench.cuboid(Vec3::new(-0.9, 0.42, -0.2), Vec3::new(0.9, 0.48, 0.2), WOOD);
    for x in [-0.75, 0.65] {
        bench.cuboid(
            Vec3::new(x, 0.0, -0.16),
            Vec3::new(x + 0.1, 0.42, 0.16),
            STONE,
        );
    }
    let bench = add_mesh(scene, bench.finish("bench"));
    for (i, (x, side)) in [(-3.0, 1.0), (3.0, 1.0), (-3.0, -1.0), (3.0, -1.0f32)]
        .iter()
        .enumerate()
    {
        let at = Vec3::new(*x, 0.0, side * 5.65);
        let node = place(scene, &format!("bench_{i}"), at, 0.0, 1.0);
        add_instance(scene, bench, node);
    }

    let mut knot = Shape::default();
    let curve = |t: f32| {
        let (a, b) = (t * TAU * 2.0, t * TAU * 3.0);
        let r = 0.42 + 0.17 * b.cos();
        Vec3::new(r * a.cos(), 0.17 * b.sin(), r * a.sin())
    };
    knot.ring_tube(curve, 0.085, 160, 12, BRONZE);
    let knot = add_mesh(scene, knot.finish("knot"));
    let node = place(
        scene,
        "knot",
        Vec3::new(-8.65, DAIS_HEIGHT + 1.35, 0.0),
        0.4,
        1.0,
    );
    // Stood on edge.
    scene.nodes[node].rotation *= Quat::from_rotation_z(1.45);
    add_instance(scene, knot, node);

    for (i, (z, material)) in [(-2.2, CLOTH_BLUE), (0.0, CLOTH_RED), (2.2, CLOTH_OCHRE)]
        .into_iter()
        .enumerate()
    {
        let mesh = add_mesh(scene, banner(material));
        let at = Vec3::new(-HALF_X + 0.18, 1.9, z);
        let node = place(scene, &format!("banner_{i}"), at, 0.0, 1.0);
        add_instance(scene, mesh, node);
    }

    let mut pot = Shape::default();
    #[rustfmt::skip]
    let profile = [
        (0.0, 0.0), (0.17, 0.0), (0.17, 0.0), (0.25, 0.18), (0.28, 0.34), (0.25, 0.44),
        (0.25, 0.44), (0.29, 0.46), (0.29, 0.50), (0.29, 0.50), (0.24, 0.50), (0.24, 0.50),
        (0.23, 0.43), (0.23, 0.43), (0.0, 0.42),
    ];
    pot.lathe(Vec3::ZERO, &profile, 24, POT);
    let pot = add_mesh(scene, pot.finish("pot"));
    let plant = add_mesh(scene, plant());
    for (i, (x, z)) in [(9.1, -4.9), (9.1, 4.9), (-6.2, -2.3), (-6.2, 2.3)]
        .iter()
        .enumerate()
    {
        for (name, mesh) in [("pot", pot), ("plant", plant)] {
            let at = Vec3::new(*x, 0.0, *z);
            let turn = i as f32 * 1.3;
            let node = place(scene, &format!("{name}_{i}"), at, turn, 1.0);
            add_instance(scene, mesh, node);
        }
    }
}

/// A cloth of 1.3 x 3.2 m that hangs in folds along Z, in front of the wall at -X.
fn banner(material: u32) -> Mesh {
    let mut shape = Shape::default();
    let (columns, rows) = (24u32, 10u32);
    for j in 0..=rows {
        for i in 0..=columns {
            let (s, t) = (i as f32 / columns as f32, j as f32 / rows as f32);
            // Folds deepen towards the hem.
            let depth = 0.07 * (1.0 - t) + 0.015;
            let (sin, cos) = (s * TAU * 3.0).sin_cos();
            let slope = depth * cos * TAU * 3.0 / 1.3;
            // +Z runs to the left when one looks at the wall.
            let at = Vec3::new(depth * sin, 3.2 * t, 0.65 - 1.3 * s);
            let normal = Vec3::new(1.0, 0.0, slope).normalize();
            shape.vertex(at, normal, Vec2::new(s, 1.0 - t));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let (b, c) = (a + 1, a + columns + 1);
            shape.triangle([a, b, c + 1], material);
            shape.triangle([a, c + 1, c], material);
        }
    }
    shape.finish("banner")
}

/// Fronds that rise from the pot's earth and bend over.
fn plant() -> Mesh {
    const FRONDS: i32 = 13;
    const PIECES: i32 = 5;
    let mut shape = Shape::default();
    for k in 0..FRONDS {
        let (sin, cos) = ((k as f32 + 0.6 * random(k, 1, 1)) / FRONDS as f32 * TAU).sin_cos();
        let (out, side) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos));
        let length = 0.75 + 0.45 * random(k, 2, 1);
        let lean = 0.35 + 0.5 * random(k, 3, 1);
        let mut at = Vec3::new(0.0, 0.43, 0.0) + out * 0.05;
        let mut last: Option<(u32, u32)> = None;
        for i in 0..=PIECES {
            let t = i as f32 / PIECES as f32;
            let (s, c) = (lean * (0.4 + 1.9 * t)).sin_cos();
            let ahead = out * s + Vec3::Y * c;
            let normal = (side.cross(ahead) * -1.0).normalize_or(Vec3::Y);
            let left = shape.vertex(at - side * 0.17, normal, Vec2::new(0.0, 1.0 - t));
            let right = shape.vertex(at + side * 0.17, normal, Vec2::new(1.0, 1.0 - t));
            if let Some((l, r)) = last {
                shape.triangle([l, left, right], FROND);
                shape.triangle([l, right, r], FROND);
            }
            last = Some((left, right));
            at += ahead * (length / PIECES as f32);
        }
    }
    shape.finish("plant")
}
