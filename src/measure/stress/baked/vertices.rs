//! Least squares at the vertices, where vertices lie inside geometry and where faces differ in size.

use super::super::scene_builder::SceneBuilder;
use super::super::{Bound, Case, Effort, Finding};
use super::obscurance;
use crate::obscurance::Gather;
use crate::scene::Mesh;
use crate::vertices::server::cholesky::Factor;
use crate::vertices::server::dissect::Tree;
use crate::vertices::server::energy::Energy;
use crate::vertices::server::{
    Sampling, Shape, Site, baseline, fit, mean, place, trace, valid_samples,
};
use crate::world::World;
use crate::{Error, Result};
use glam::Vec3;

pub const INSIDE_GEOMETRY: Case = Case {
    name: "vertices-inside-geometry",
    about: "A floor of 8 m in cells of 0.5 m, pierced by four boxes that grow until little of it is left. The \
            share of its vertices inside the boxes; rms error, over samples of the open floor that no fit used, of \
            least squares with and without its regulariser, of obscurance traced at the vertices, and of the fit's \
            samples splatted to them; and least squares over obscurance at the vertices.",
    parameter: "width of the boxes (m)",
    beyond: "Beside a box obscurance changes within a cell, and the regulariser smooths that away: without it the \
             error is a quarter to a half. Where the open floor is much narrower than a cell, few samples fall on it, and with \
             the regulariser the fit is worse than obscurance at the vertices.",
    run: inside_geometry,
};

pub const HUGE: Case = Case {
    name: "huge-triangle",
    about: "A floor of 2 m in cells of 0.25 m, and beside it a row of faces that are as wide and get longer; a \
            canopy 0.4 m above covers the cells and the next 0.5 m. How far the values of least squares lie outside of \
            0 to 1 without and with its bounds; rms error on the small faces, on those that touch the long ones, and \
            on the long ones, and that of obscurance traced at the vertices.",
    parameter: "length of the long faces (m)",
    beyond: "The error counts by area, and a long face cannot follow the edge of the canopy: it decides the vertices \
             that it shares with small faces, and these become far too bright. Obscurance at the vertices is right there \
             and wrong on the long faces. No values at these vertices suit both; long faces have to be divided.",
    run: huge,
};

/// Samples to measure errors at: not those of the fits, and with other rays.
const TESTS: Sampling = Sampling {
    density: 512.0,
    max_per_face: 37,
};
const OTHER_RAYS: u32 = 7919;

/// A sheet of cells that faces +Y, its lines at these places.
fn sheet(xs: &[f32], zs: &[f32]) -> Mesh {
    let row = xs.len() as u32;
    let cells = (0..zs.len() as u32 - 1).flat_map(|z| (0..row - 1).map(move |x| z * row + x));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|a| [[a, a + row, a + 1], [a + 1, a + row, a + row + 1]])
        .collect();
    let positions = zs
        .iter()
        .flat_map(|z| xs.iter().map(|x| Vec3::new(*x, 0.0, *z)));
    let positions: Vec<Vec3> = positions.collect();
    Mesh {
        normals: vec![Vec3::Y; positions.len()],
        materials: vec![0; triangles.len()],
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// `count + 1` lines, `step` apart.
fn lines(from: f32, step: f32, count: usize) -> Vec<f32> {
    (0..=count).map(|i| from + step * i as f32).collect()
}

/// Values of a mesh by several methods, and samples to measure them at. The mesh is instance 0.
struct Solved {
    shape: Shape,
    fit: Vec<f64>,
    /// Without the regulariser.
    plain: Vec<f64>,
    /// Without the bounds of 0 and 1.
    free: Vec<f64>,
    at_vertices: Vec<f64>,
    splat: Vec<f64>,
    sites: Vec<Site>,
    gathers: Vec<Gather>,
}

fn solve(world: &World, effort: Effort) -> Result<Solved> {
    let (scene, pose) = (world.scene(), world.pose());
    let traced = obscurance(world, effort.of(64, 256))?;
    let shape = Shape::new(scene, pose, 0);
    let sites = place::place(scene, 0, &shape, Sampling::default());
    let gathers = trace(&traced, pose, 0, &sites);
    let samples = valid_samples(&sites, &gathers, 1);
    let default = mean(samples.clone(), 1);
    let fitted = |alpha| fit(&shape, samples.clone(), 1, alpha, &default).values;
    let (with, without) = (fitted(1.0), fitted(0.0));

    let energy = Energy::new(&shape, samples.clone(), 1, 1.0);
    let known: Vec<u32> = (0..shape.variables() as u32)
        .filter(|v| energy.is_sampled[*v as usize])
        .collect();
    let mut places = vec![0; shape.variables()];
    for (place, variable) in known.iter().enumerate() {
        places[*variable as usize] = place as u32;
    }
    let matrix = energy.matrix.restrict(&known, &places);
    let of = |v: &u32| *v as usize;
    let positions: Vec<_> = known.iter().map(|v| shape.positions[of(v)]).collect();
    let mut free: Vec<f64> = known.iter().map(|v| energy.rights[0][of(v)]).collect();
    let tree = Tree::new(&matrix, &positions);
    let factor = Factor::new(&matrix, &tree, &|_| false);
    factor
        .ok_or_else(|| Error::Invalid("the system of a floor has no factor".into()))?
        .solve(&tree, &mut free);

    let mut tests = place::place(scene, 0, &shape, TESTS);
    for site in &mut tests {
        site.seed = site.seed.wrapping_add(OTHER_RAYS);
    }
    let gold = trace(&obscurance(world, effort.of(128, 512))?, pose, 0, &tests);
    let first = |mut signals: Vec<Vec<f64>>| signals.swap_remove(0);
    Ok(Solved {
        fit: first(with),
        plain: first(without),
        free,
        at_vertices: first(baseline::at_vertices(&traced, pose, 0, &shape)),
        splat: first(baseline::splat(&shape, samples, 1)),
        shape,
        sites: tests,
        gathers: gold,
    })
}

impl Solved {
    /// Root mean square error by area over the valid samples of the triangles that `keep` wants, by their middles.
    fn error(&self, values: &[f64], keep: impl Fn(f64) -> bool) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for (site, gather) in self.sites.iter().zip(&self.gathers) {
            let triangle = site.triangle as usize;
            let middle = self.shape.corners(triangle).iter().map(|c| c.x / 3.0).sum();
            if !gather.is_valid() || !keep(middle) {
                continue;
            }
            let corners = self.shape.triangles[triangle].map(|v| values[v as usize]);
            let shown: f64 = corners.iter().zip(site.weights()).map(|(v, w)| v * w).sum();
            sum += site.area * (shown - f64::from(gather.values[0])).powi(2);
            area += site.area;
        }
        (sum / area).sqrt()
    }
}

/// How far the furthest value is outside of 0..=1.
fn outside(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |far, v| (v - 1.0).max(-v).max(far))
}

fn inside_geometry(effort: Effort) -> Result<Finding> {
    let widths = [
        (0.2f32, false),
        (1.2, true),
        (2.2, true),
        (3.2, true),
        (3.6, false),
        (3.9, false),
    ];
    let mut finding = Finding::default();
    for width in effort.settings(&widths) {
        let grid = lines(-4.0, 0.5, 16);
        let mut builder = SceneBuilder::new("vertices-inside-geometry", 0.5);
        builder.mesh(sheet(&grid, &grid));
        let half = Vec3::new(0.5 * width, 0.0, 0.5 * width);
        let middles =
            [[-2.0, -2.0], [-2.0, 2.0], [2.0, -2.0], [2.0, 2.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        for middle in middles {
            builder.solid(middle - half - 0.5 * Vec3::Y, middle + half + Vec3::Y);
        }
        let scene = builder.build();
        let world = World::new(&scene, 0.0);
        let solved = solve(&world, effort)?;
        let is_inside = |p: &&glam::DVec3| {
            let near = |m: &Vec3| (p.as_vec3() - *m).abs().max_element() < 0.5 * width;
            middles.iter().any(near)
        };
        let inside = solved.shape.positions.iter().filter(is_inside).count();
        let at = width.to_string();
        let error = |values: &[f64]| solved.error(values, |_| true);
        let (fit, plain) = (error(&solved.fit), error(&solved.plain));
        let at_vertices = error(&solved.at_vertices);
        finding.add(
            &at,
            "vertices inside (share)",
            inside as f64 / solved.shape.variables() as f64,
        );
        finding.add(&at, "error, least squares", fit);
        finding.add(&at, "error, without regulariser", plain);
        finding.add(&at, "error, at vertices", at_vertices);
        finding.add(&at, "error, splatted", error(&solved.splat));
        for (figure, error) in [
            ("least squares over at vertices", fit),
            ("without regulariser over at vertices", plain),
        ] {
            finding.bounded(&at, figure, error / at_vertices, Bound::AtMost(1.0));
        }
    }
    Ok(finding)
}

fn huge(effort: Effort) -> Result<Finding> {
    let lengths = [
        (0.25f32, true),
        (1.0, false),
        (4.0, true),
        (16.0, false),
        (64.0, true),
    ];
    let mut finding = Finding::default();
    for length in effort.settings(&lengths) {
        let grid = lines(0.0, 0.25, 8);
        let mut columns = grid.clone();
        columns.push(2.0 + length);
        let mut builder = SceneBuilder::new("huge-triangle", 0.5);
        builder.mesh(sheet(&columns, &grid));
        builder.solid(Vec3::new(-0.5, 0.4, -1.0), Vec3::new(2.5, 0.5, 3.0));
        let scene = builder.build();
        let world = World::new(&scene, 0.0);
        let solved = solve(&world, effort)?;
        let at = length.to_string();
        finding.add(
            &at,
            "outside of 0 to 1, without bounds",
            outside(&solved.free),
        );
        finding.bounded(
            &at,
            "outside of 0 to 1, with bounds",
            outside(&solved.fit),
            Bound::AtMost(0.0),
        );
        finding.add(
            &at,
            "error, small faces",
            solved.error(&solved.fit, |x| x < 2.0),
        );
        finding.add(
            &at,
            "error, small faces at the long ones",
            solved.error(&solved.fit, |x| x > 1.75 && x < 2.0),
        );
        finding.add(
            &at,
            "error, long faces",
            solved.error(&solved.fit, |x| x > 2.0),
        );
        finding.add(
            &at,
            "error, small faces, at vertices",
            solved.error(&solved.at_vertices, |x| x < 2.0),
        );
        let error = solved.error(&solved.at_vertices, |x| x > 2.0);
        finding.add(&at, "error, long faces, at vertices", error);
    }
    Ok(finding)
}
