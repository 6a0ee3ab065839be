//! The hall itself: floor, walls with windows, roof, columns, dais, stair and railings.

use super::shapes::Shape;
use super::*;

pub(super) fn add(scene: &mut Scene) {
    let mut floor = Shape::default();
    floor.quad(
        Vec3::new(-HALF_X, 0.0, HALF_Z),
        Vec3::X * HALF_X * 2.0,
        Vec3::NEG_Z * HALF_Z * 2.0,
        FLOOR,
    );
    // The texture covers two metres.
    floor.mesh.uvs[0].iter_mut().for_each(|uv| *uv *= 0.5);
    normals::generate_tangents(&mut floor.mesh, &1.into());
    add_fixed(scene, floor, "floor");

    let mut walls = Shape::default();
    let mut gratings = Shape::default();
    for side in [-1.0, 1.0] {
        window_wall(&mut walls, &mut gratings, side);
        let corner = Vec3::new(side * HALF_X, 0.0, -side * HALF_Z);
        walls.quad(
            corner,
            Vec3::Z * (2.0 * side * HALF_Z),
            Vec3::Y * HEIGHT,
            PLASTER,
        );
    }
    add_fixed(scene, walls, "walls");
    add_fixed(scene, gratings, "gratings");

    let mut roof = Shape::default();
    for side in [-1.0f32, 1.0] {
        let (near, far) = (side * COLUMN_Z, side * HALF_Z);
        roof.quad(
            Vec3::new(-HALF_X, HEIGHT, near.min(far)),
            Vec3::X * HALF_X * 2.0,
            Vec3::Z * COLUMN_Z,
            WOOD,
        );
        roof.cuboid(
            Vec3::new(-HALF_X, HEIGHT - 0.45, near - 0.25),
            Vec3::new(HALF_X, HEIGHT + 0.1, near + 0.25),
            STONE,
        );
        for i in 0..10 {
            let x = -9.0 + 2.0 * i as f32;
            let (inner, outer) = (near + 0.25 * side, far);
            roof.cuboid(
                Vec3::new(x - 0.07, HEIGHT - 0.2, inner.min(outer)),
                Vec3::new(x + 0.07, HEIGHT, inner.max(outer)),
                WOOD,
            );
        }
    }
    for x in COLUMN_X {
        roof.cuboid(
            Vec3::new(x - 0.12, HEIGHT - 0.3, -COLUMN_Z + 0.25),
            Vec3::new(x + 0.12, HEIGHT, COLUMN_Z - 0.25),
            WOOD,
        );
    }
    add_fixed(scene, roof, "roof");

    let mut column = Shape::default();
    column.cuboid(
        Vec3::new(-0.45, 0.0, -0.45),
        Vec3::new(0.45, 0.18, 0.45),
        STONE,
    );
    #[rustfmt::skip]
    let profile = [
        (0.42, 0.18), (0.44, 0.22), (0.44, 0.26), (0.40, 0.31), (0.36, 0.33), (0.36, 0.33),
        (0.34, 0.40), (0.33, 1.60), (0.315, 3.0), (0.29, 4.6), (0.28, 4.95), (0.28, 4.95),
        (0.33, 4.98), (0.33, 5.03), (0.29, 5.06), (0.29, 5.06), (0.31, 5.15), (0.42, 5.31),
    ];
    column.lathe(Vec3::ZERO, &profile, 28, STONE);
    column.cuboid(
        Vec3::new(-0.45, 5.31, -0.45),
        Vec3::new(0.45, 5.55, 0.45),
        STONE,
    );
    let column = add_mesh(scene, column.finish("column"));
    for side in ["left", "right"] {
        let z = if side == "left" { COLUMN_Z } else { -COLUMN_Z };
        for (i, x) in COLUMN_X.iter().enumerate() {
            let node = place(
                scene,
                &format!("column_{side}_{i}"),
                Vec3::new(*x, 0.0, z),
                0.0,
                1.0,
            );
            add_instance(scene, column, node);
        }
    }
    dais(scene);
}

/// A long wall with five windows, their reveals, and a grating in each.
fn window_wall(walls: &mut Shape, gratings: &mut Shape, side: f32) {
    const DEPTH: f32 = 0.4;
    let (low, high) = (1.3, 4.4);
    let z = side * HALF_Z;
    // Faces of the wall look inwards: u x v must point to the middle.
    let mut panel = |x0: f32, x1: f32, y0: f32, y1: f32| {
        let (start, u) = if side < 0.0 {
            (x0, x1 - x0)
        } else {
            (x1, x0 - x1)
        };
        walls.quad(
            Vec3::new(start, y0, z),
            Vec3::X * u,
            Vec3::Y * (y1 - y0),
            PLASTER,
        );
    };
    panel(-HALF_X, HALF_X, 0.0, low);
    panel(-HALF_X, HALF_X, high, HEIGHT);
    let mut from = -HALF_X;
    let centres = [-6.0, -3.0, 0.0, 3.0, 6.0f32];
    for x in centres {
        panel(from, x - 0.75, low, high);
        from = x + 0.75;
    }
    panel(from, HALF_X, low, high);
    let out = Vec3::Z * (side * DEPTH);
    for x in centres {
        let (left, right) = (x - 0.75, x + 0.75);
        let (a, b) = (Vec3::new(left, low, z), Vec3::new(right, low, z));
        let (wide, tall) = (Vec3::X * 1.5, Vec3::Y * (high - low));
        let mut reveal = |corner: Vec3, u: Vec3, v: Vec3, towards: Vec3| {
            if u.cross(v).dot(towards) > 0.0 {
                walls.quad(corner, u, v, STONE);
            } else {
                walls.quad(corner, v, u, STONE);
            }
        };
        reveal(a, wide, out, Vec3::Y);
        reveal(a + tall, wide, out, Vec3::NEG_Y);
        reveal(a, tall, out, Vec3::X);
        reveal(b, tall, out, Vec3::NEG_X);
        let first = gratings.mesh.positions.len();
        gratings.quad(a + out * 0.6, wide, tall, GRATING);
        // A hole every quarter metre.
        for uv in &mut gratings.mesh.uvs[0][first..] {
            *uv *= 4.0;
        }
    }
}

fn dais(scene: &mut Scene) {
    let mut stone = Shape::default();
    let top = Vec3::Y * DAIS_HEIGHT;
    stone.quad(
        Vec3::new(-HALF_X, 0.0, HALF_Z) + top,
        Vec3::X * (HALF_X + DAIS_X),
        Vec3::NEG_Z * HALF_Z * 2.0,
        STONE,
    );
    stone.quad(
        Vec3::new(DAIS_X, 0.0, HALF_Z),
        Vec3::NEG_Z * HALF_Z * 2.0,
        top,
        STONE,
    );
    let tread = 0.3;
    for step in 0..STEPS - 1 {
        let rise = DAIS_HEIGHT / STEPS as f32;
        let x = DAIS_X + tread * (STEPS - 1 - step) as f32;
        stone.cuboid(
            Vec3::new(x - tread, 0.0, -STAIR_HALF_WIDTH),
            Vec3::new(x, rise * (step + 1) as f32, STAIR_HALF_WIDTH),
            STONE,
        );
    }
    stone.cuboid(
        Vec3::new(-9.1, DAIS_HEIGHT, -0.45),
        Vec3::new(-8.2, DAIS_HEIGHT + 0.7, 0.45),
        STONE,
    );
    add_fixed(scene, stone, "dais");

    let mut railings = Shape::default();
    for side in [-1.0, 1.0] {
        let z0 = side * (STAIR_HALF_WIDTH + 0.03);
        let edge = Vec3::new(DAIS_X - 0.06, DAIS_HEIGHT, z0);
        railing(&mut railings, edge, Vec3::Z * (side * HALF_Z * 0.995 - z0));
        // Down the stair.
        let foot = Vec3::new(DAIS_X + tread * (STEPS - 1) as f32, 0.0, z0);
        railing(&mut railings, foot, edge - foot);
        for (a, b) in [(-4.5, -1.5), (1.5, 4.5)] {
            let start = Vec3::new(a + 0.45, 0.0, side * COLUMN_Z);
            railing(&mut railings, start, Vec3::X * (b - a - 0.9));
        }
    }
    add_fixed(scene, railings, "railings");
}

/// Bars of 2.4 cm every 12 cm under a handrail of 5 cm, 0.95 m high.
fn railing(shape: &mut Shape, from: Vec3, along: Vec3) {
    const TALL: f32 = 0.95;
    const BAR: f32 = 0.012;
    let count = (along.length() / 0.12).round().max(1.0) as usize;
    for i in 0..=count {
        let foot = from + along * (i as f32 / count as f32);
        let half = if i == 0 || i == count { 0.02 } else { BAR };
        let half = Vec3::new(half, 0.0, half);
        shape.cuboid(foot - half, foot + half + Vec3::Y * TALL, IRON);
    }
    let across = along.cross(Vec3::Y).normalize_or(Vec3::X);
    let ends = along.normalize_or(Vec3::X) * 0.03;
    for (height, wide, thick) in [(TALL, 0.05, 0.04), (0.09, 0.024, 0.024)] {
        let base = from - ends + Vec3::Y * height - across * (wide / 2.0);
        let (u, v, w) = (along + ends * 2.0, across * wide, Vec3::Y * thick);
        shape.quad(base + w, v, u, IRON);
        shape.quad(base, u, v, IRON);
        shape.quad(base, w, u, IRON);
        shape.quad(base + v, u, w, IRON);
        shape.quad(base, v, w, IRON);
        shape.quad(base + u, w, v, IRON);
    }
}
