//! The linear function of an instance, where its samples do not fill its box.

use super::super::scene_builder::SceneBuilder;
use super::super::{Bound, Case, Effort, Finding};
use super::obscurance;
use crate::Result;
use crate::instances::server::{Context, SAMPLES, solve};
use crate::scene::{Mesh, Scene};
use crate::world::World;
use glam::{Quat, Vec3};

pub const FLAT: Case = Case {
    name: "flat-object",
    about: "Four convex objects near the walls of a room, each turned in a box of 1 m: a slab, a rod or a \
            cube, which gets thinner until its samples lie in a plane, on a line or in a point. The least number of \
            axes along which the samples of an object spread; rms error over the samples that were held out, of no \
            function (1), of the scalar and of the linear function; and the error of the linear function less that \
            of the scalar, at the object where it is worst.",
    parameter: "shape, thickness (m), samples",
    beyond: "The two sides of a thin object look at different walls. While it has some thickness the linear function \
             can tell them apart; where it has none, it is hardly better than the scalar, and in a point it is the \
             scalar. With few samples it follows them and not the object.",
    run: flat,
};

/// Error that the linear function may add to that of the scalar at any object.
const WORSE: f64 = 0.01;

/// A box of these half extents, turned, and two triangles without area that keep the bounds of the mesh at 1 m.
fn turned(centre: Vec3, half: Vec3) -> Mesh {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -2.0) / 3.0, 0.9);
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let along = |axis: usize| turn * (Vec3::AXES[axis % 3] * half[axis % 3]);
            let (x, y) = (along(axis + 1), along(axis + 2));
            let (x, y) = if side > 0.0 { (x, y) } else { (y, x) };
            SceneBuilder::quad(&mut mesh, centre + along(axis) * side, x, y, 0);
        }
    }
    for corner in [centre - 0.5, centre + 0.5] {
        let vertex = mesh.positions.len() as u32;
        mesh.positions.push(corner);
        mesh.normals.push(Vec3::Y);
        mesh.triangles.push([vertex; 3]);
        mesh.materials.push(0);
    }
    mesh
}

fn room(half: Vec3) -> Scene {
    let mut builder = SceneBuilder::new("flat-object", 0.5);
    for centre in [
        Vec3::new(-1.4, -0.9, -1.4),
        Vec3::new(1.4, -0.9, 0.0),
        Vec3::new(0.0, 0.9, -1.3),
        Vec3::new(-1.3, 0.2, 1.3),
    ] {
        builder.mesh(turned(centre, half));
    }
    builder.room(Vec3::new(-2.0, -1.5, -2.0), Vec3::new(2.0, 1.5, 2.0));
    builder.build()
}

fn flat(effort: Effort) -> Result<Finding> {
    let settings = [
        (("plane", 0.3, SAMPLES), true),
        (("plane", 0.1, SAMPLES), false),
        (("plane", 0.01, SAMPLES), true),
        (("plane", 0.0001, SAMPLES), true),
        (("line", 0.1, SAMPLES), false),
        (("line", 0.01, SAMPLES), true),
        (("line", 0.0001, SAMPLES), false),
        (("point", 0.1, SAMPLES), false),
        (("point", 0.01, SAMPLES), true),
        (("point", 0.0001, SAMPLES), true),
        (("plane", 0.01, 64), false),
        (("plane", 0.01, 16), false),
        (("plane", 0.01, 8), false),
        (("plane", 0.01, 4), true),
    ];
    let rays = effort.of(64, 512);
    let mut finding = Finding::default();
    for (shape, thickness, samples) in effort.settings(&settings) {
        let thin = 0.5 * thickness;
        let half = match shape {
            "plane" => Vec3::new(0.45, 0.45, thin),
            "line" => Vec3::new(0.45, thin, thin),
            _ => Vec3::splat(thin),
        };
        let scene = room(half);
        let world = World::new(&scene, 0.0);
        let traced = obscurance(&world, rays)?;
        let context = Context {
            scene: &scene,
            pose: world.pose(),
            obscurance: &traced,
            samples,
            signals: &|values| values.to_vec(),
        };
        // Alone in the world a convex object is open.
        let local = [vec![1.0; scene.meshes[0].positions.len()]];
        let objects = scene.instances.len() - 1;
        let solved: Vec<_> = (0..objects).map(|i| solve(&context, i, &local)).collect();
        let at = format!("{shape}, {thickness}, {samples}");
        let spread = solved.iter().flat_map(|s| &s.fits).map(|fit| fit.spread);
        finding.add(&at, "axes", f64::from(spread.min().unwrap_or(0)));
        let errors: Vec<[f64; 3]> = solved.iter().map(|s| s.errors()).collect();
        for (rung, figure) in ["error, 1", "error, scalar", "error, linear"]
            .into_iter()
            .enumerate()
        {
            let sum: f64 = errors.iter().map(|e| e[rung].powi(2)).sum();
            finding.add(&at, figure, (sum / objects as f64).sqrt());
        }
        let worst = errors.iter().map(|e| e[2] - e[1]).fold(f64::MIN, f64::max);
        let figure = "linear less scalar, worst";
        match samples {
            SAMPLES => finding.bounded(&at, figure, worst, Bound::AtMost(WORSE)),
            _ => finding.add(&at, figure, worst),
        }
    }
    Ok(finding)
}
