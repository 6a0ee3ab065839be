//! The system and its solution against dense arithmetic and energies reckoned another way.

use super::bounded;
use super::cholesky::Factor;
use super::dissect::Tree;
use super::energy::{Energy, PULL, Sample};
use super::hinge::hinges;
use super::place::Site;
use super::shape::Shape;
use super::sparse::{Builder, Symmetric};
use crate::obscurance::shapes::{flat, scene};
use crate::rng::Rng;
use crate::scene::Mesh;
use glam::{DVec2, DVec3, Vec3};

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 += 1;
        Rng::new(self.0).unit_f64()
    }
    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }
}

fn shape(mesh: Mesh) -> Shape {
    let (scene, pose) = scene(vec![mesh]);
    Shape::new(&scene, &pose, 0)
}

/// A grid of triangles in the XZ plane, corners moved about, lifted by `height`.
fn uneven(cells: u32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut r = Random(9);
    let n = cells + 1;
    let positions = (0..n * n).map(|i| {
        let mut at = |i: u32| i as f32 + 0.3 * r.signed() as f32;
        let (x, z) = (at(i % n), at(i / n));
        Vec3::new(x, height(x, z), z)
    });
    let positions = positions.collect();
    let triangles = (0..cells * cells).flat_map(|i| {
        let a = i / cells * n + i % cells;
        [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]
    });
    flat(positions, triangles.collect(), Vec3::Y)
}

/// Samples of a shape at random places; the values are kept apart from them.
fn samples(
    shape: &Shape,
    each: u32,
    f: impl Fn(DVec3, &mut Random) -> f32,
) -> Vec<(Site, [f32; 1])> {
    let mut r = Random(3);
    let mut all = Vec::new();
    for triangle in (0..shape.triangles.len()).filter(|&t| shape.receives[t]) {
        for _ in 0..each {
            let (mut u, mut v) = (r.unit() as f32, r.unit() as f32);
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let site = Site {
                triangle: triangle as u32,
                u,
                v,
                area: shape.areas[triangle] / f64::from(each),
                seed: 0,
            };
            let corners = shape.corners(triangle);
            let at = (0..3).map(|k| corners[k] * site.weights()[k]).sum();
            all.push((site, [f(at, &mut r)]));
        }
    }
    all
}

fn energy(shape: &Shape, samples: &[(Site, [f32; 1])], alpha: f64) -> Energy {
    let samples = samples.iter().map(|(site, values)| Sample { site, values });
    Energy::new(shape, samples, 1, alpha)
}

/// Gaussian elimination with pivots.
fn solve_dense(matrix: &Symmetric, b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row = vec![0.0; n + 1];
            matrix.row(i).for_each(|(j, value)| row[j] = value);
            row[n] = b[i];
            row
        })
        .collect();
    for i in 0..n {
        let pivot = (i..n).max_by(|&a, &b| rows[a][i].abs().total_cmp(&rows[b][i].abs()));
        rows.swap(i, pivot.unwrap_or(i));
        let pivot = rows[i].clone();
        for row in &mut rows[i + 1..] {
            let f = row[i] / pivot[i];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= f * p);
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * x[j]).sum();
        x[i] = (rows[i][n] - known) / rows[i][i];
    }
    x
}

#[test]
fn entries_at_one_place_add_up() {
    let mut builder = Builder::new(4);
    builder.add_square([0, 2], [1.0, -1.0], 2.0);
    builder.add_square([2, 3], [0.5, 1.0], 4.0);
    let matrix = builder.build(4);
    let row = |i| matrix.row(i).collect::<Vec<_>>();
    assert_eq!(row(0), [(0, 2.0), (2, -2.0)]);
    assert_eq!(row(1), [(1, 0.0)]);
    assert_eq!(row(2), [(0, -2.0), (2, 3.0), (3, 2.0)]);
    assert_eq!(row(3), [(2, 2.0), (3, 4.0)]);
    assert_eq!(matrix.components(), [vec![0, 2, 3], vec![1]]);
    let part = matrix.restrict(&[3, 0, 2], &[1, 9, 2, 0]);
    assert_eq!(part.row(0).collect::<Vec<_>>(), [(0, 4.0), (2, 2.0)]);
    assert_eq!(part.row_times(2, &[1.0, 1.0, 1.0]), 3.0);
}

#[test]
fn sparse_solution_is_the_dense_one() {
    for cells in [1, 2, 7, 17] {
        let shape = shape(uneven(cells, |x, z| 0.3 * (x * 0.7).sin() + 0.1 * z));
        let samples = samples(&shape, 2, |_, r| r.unit() as f32);
        let energy = energy(&shape, &samples, 1.0);
        let tree = Tree::new(&energy.matrix, &shape.positions);
        let mut order = tree.order.clone();
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..shape.variables() as u32));
        let factor = Factor::new(&energy.matrix, &tree, &|_| false).expect("positive definite");
        let mut x = energy.rights[0].clone();
        factor.solve(&tree, &mut x);
        let dense = solve_dense(&energy.matrix, &energy.rights[0]);
        for (x, d) in x.iter().zip(dense) {
            assert!((x - d).abs() < 1e-9, "{x} {d}");
        }
    }
}

#[test]
fn fixed_variables_are_left_out() {
    let shape = shape(uneven(9, |_, _| 0.0));
    let samples = samples(&shape, 2, |_, r| r.unit() as f32);
    let energy = energy(&shape, &samples, 1.0);
    let tree = Tree::new(&energy.matrix, &shape.positions);
    let fixed = |i: usize| i.is_multiple_of(3);
    let factor = Factor::new(&energy.matrix, &tree, &fixed).expect("positive definite");
    let b: Vec<f64> = (0..shape.variables()).map(|i| i as f64).collect();
    let mut x = b.clone();
    factor.solve(&tree, &mut x);
    for i in 0..b.len() {
        let row = energy.matrix.row(i).filter(|&(j, _)| !fixed(j));
        let product: f64 = row.map(|(j, value)| value * x[j]).sum();
        let got = if fixed(i) { x[i] } else { product };
        assert!((got - b[i]).abs() < 1e-8, "{i}");
    }
}

#[test]
fn matrices_that_are_not_positive_definite_are_refused() {
    let mut builder = Builder::new(2);
    builder.add_square([0, 1], [1.0, -1.0], 1.0);
    let matrix = builder.build(2);
    let tree = Tree::new(&matrix, &[DVec3::ZERO, DVec3::X]);
    assert!(Factor::new(&matrix, &tree, &|_| false).is_none());
}

#[test]
fn separators_keep_the_factor_of_a_plane_sparse() {
    let shape = shape(uneven(64, |_, _| 0.0));
    let samples = samples(&shape, 1, |_, r| r.unit() as f32);
    let energy = energy(&shape, &samples, 1.0);
    let tree = Tree::new(&energy.matrix, &shape.positions);
    // n log n of George 1973 with a constant for this stencil; a band would hold 2 * 65 a column.
    let n = shape.variables() as f64;
    assert!((tree.factor_len() as f64) < 8.0 * n * n.log2());
}

#[test]
fn bounded_minimum_is_the_least_of_all_active_sets() {
    let mut r = Random(17);
    for case in 0..40 {
        let n = 5;
        let mut builder = Builder::new(n);
        for i in 0..n as u32 {
            builder.add_square([i], [1.0], 0.05 + r.unit());
            for j in 0..i {
                builder.add_square([i, j], [r.signed(), r.signed()], 1.0);
            }
        }
        let matrix = builder.build(n);
        let b: Vec<f64> = (0..n).map(|_| 3.0 * r.signed()).collect();
        let positions: Vec<DVec3> = (0..n).map(|i| DVec3::X * i as f64).collect();
        let tree = Tree::new(&matrix, &positions);
        let factor = Factor::new(&matrix, &tree, &|_| false).expect("positive definite");
        let got = bounded::solve(&matrix, &tree, &factor, &b);
        let value = |x: &[f64]| -> f64 {
            (0..n)
                .map(|i| x[i] * (0.5 * matrix.row_times(i, x) - b[i]))
                .sum()
        };
        let mut least = f64::INFINITY;
        for set in 0..3usize.pow(n as u32) {
            let state = |i: usize| set / 3usize.pow(i as u32) % 3;
            let mut builder = Builder::new(n);
            let mut right = b.clone();
            for (i, right) in right.iter_mut().enumerate() {
                for (j, a) in matrix.row(i) {
                    match (state(i), state(j)) {
                        (0, 0) if i < j => {
                            // a x_i x_j as a difference of squares.
                            builder.add_square([i as u32, j as u32], [1.0, 1.0], 0.5 * a);
                            builder.add_square([i as u32, j as u32], [1.0, -1.0], -0.5 * a);
                        }
                        (0, 0) if i == j => builder.add_square([i as u32], [1.0], a),
                        (0, 2) => *right -= a,
                        _ => {}
                    }
                }
            }
            for i in (0..n).filter(|&i| state(i) != 0) {
                builder.add_square([i as u32], [1.0], 1.0);
                right[i] = f64::from(u8::from(state(i) == 2));
            }
            let x = solve_dense(&builder.build(n), &right);
            if x.iter().all(|x| (-1e-9..=1.0 + 1e-9).contains(x)) {
                least = least.min(value(&x));
            }
        }
        assert!(got.is_exact(), "{case}");
        assert!(got.x.iter().all(|x| (0.0..=1.0).contains(x)));
        assert!((value(&got.x) - least).abs() < 1e-8, "{case}");
    }
}

#[test]
fn bounded_solution_leaves_no_scar() {
    let shape = shape(uneven(20, |_, _| 0.0));
    // A step overshoots on both of its sides.
    let samples = samples(&shape, 3, |at, _| f32::from(u8::from(at.x > 9.7)));
    let energy = energy(&shape, &samples, 1.0);
    let (matrix, b) = (&energy.matrix, &energy.rights[0]);
    let tree = Tree::new(matrix, &shape.positions);
    let factor = Factor::new(matrix, &tree, &|_| false).expect("positive definite");
    let mut free = b.clone();
    factor.solve(&tree, &mut free);
    assert!(free.iter().any(|x| *x < -0.01) && free.iter().any(|x| *x > 1.01));
    let got = bounded::solve(matrix, &tree, &factor, b);
    assert!(got.is_exact() && got.at_bounds > 0);
    for (i, (x, b)) in got.x.iter().zip(b).enumerate() {
        let gradient = matrix.row_times(i, &got.x) - b;
        match *x {
            0.0 => assert!(gradient >= -1e-8, "{i}"),
            1.0 => assert!(gradient <= 1e-8, "{i}"),
            _ => assert!(gradient.abs() < 1e-8, "{i}: {gradient}"),
        }
    }
    let value = |x: &[f64]| -> f64 {
        (0..b.len())
            .map(|i| x[i] * (0.5 * matrix.row_times(i, x) - b[i]))
            .sum()
    };
    let clamped: Vec<f64> = free.iter().map(|x| x.clamp(0.0, 1.0)).collect();
    assert!(value(&got.x) < value(&clamped));
}

fn bend(shape: &Shape, f: impl Fn(usize) -> f64) -> f64 {
    hinges(shape)
        .iter()
        .map(|hinge| {
            let form = (0..4).map(|k| hinge.coefficients[k] * f(hinge.variables[k] as usize));
            hinge.weight * form.sum::<f64>().powi(2)
        })
        .sum()
}

#[test]
fn linear_functions_over_a_plane_do_not_bend() {
    let shape = shape(uneven(8, |x, z| 0.4 * x - 0.2 * z));
    assert!(bend(&shape, |i| i as f64) > 1.0);
    for direction in [DVec3::X, DVec3::Y, DVec3::new(0.3, -2.0, 5.0)] {
        let energy = bend(&shape, |i| 7.0 + direction.dot(shape.positions[i]));
        assert!(energy < 1e-9, "{energy}");
    }
}

/// A strip folded along parallel lines, by less than a right angle each: linear along the unrolled
/// length is linear across each fold.
#[test]
fn linear_functions_over_a_fold_do_not_bend() {
    let turns: [f32; 6] = [0.0, 0.7, -0.5, 0.9, 0.2, -0.9];
    let mut spine = vec![(Vec3::ZERO, 0.0f64)];
    for (i, turn) in turns.iter().enumerate() {
        let length = 1.0 + 0.5 * i as f32;
        let (at, along) = spine[i];
        let step = Vec3::new(turn.cos(), turn.sin(), 0.0) * length;
        spine.push((at + step, along + f64::from(length)));
    }
    let positions = spine.iter().flat_map(|(at, _)| [*at, *at + Vec3::Z * 2.0]);
    let positions = positions.collect();
    let quads = (0..turns.len() as u32).flat_map(|i| {
        let a = 2 * i;
        [[a, a + 1, a + 2], [a + 2, a + 1, a + 3]]
    });
    let shape = shape(flat(positions, quads.collect(), Vec3::Y));
    assert_eq!(hinges(&shape).len(), 2 * turns.len() - 1);
    let unrolled = |i: usize| 3.0 * spine[i / 2].1 - 1.5 * (i % 2) as f64;
    assert!(bend(&shape, unrolled) < 1e-9);
    assert!(bend(&shape, |i| shape.positions[i].y) > 0.01);
}

/// GD by its definition: both triangles laid out in a plane, the gradients solved for there.
#[test]
fn hinges_are_the_difference_of_unfolded_gradients() {
    let mut r = Random(5);
    for _ in 0..100 {
        let mut point = || Vec3::new(r.signed() as f32, 0.2 * r.signed() as f32, r.unit() as f32);
        let (i, j, k) = (point(), point() + Vec3::X * 2.5, point() + Vec3::Z);
        let l = point() - Vec3::Z * 2.0;
        let shape = shape(flat(vec![i, j, k, l], vec![[0, 2, 1], [0, 1, 3]], Vec3::Y));
        let [hinge] = hinges(&shape)[..] else {
            panic!("two triangles share one edge");
        };
        let f: Vec<f64> = (0..4).map(|_| r.signed()).collect();
        let [i, j, k, l] = [0, 1, 2, 3].map(|v| shape.positions[v]);
        let axis = (j - i).normalize();
        let laid = |p: DVec3, side: f64| {
            let along = (p - i).dot(axis);
            DVec2::new(along, side * ((p - i) - axis * along).length())
        };
        let gradient = |p: DVec3, side: f64, value: f64| {
            let (a, b) = (laid(j, 1.0), laid(p, side));
            let columns = glam::DMat2::from_cols(a, b).transpose();
            columns.inverse() * DVec2::new(f[1] - f[0], value - f[0])
        };
        let jump = gradient(k, 1.0, f[2]) - gradient(l, -1.0, f[3]);
        let (a, b) = (shape.areas[0], shape.areas[1]);
        let area = (a + b).min(4.0 * a.min(b));
        let form: f64 = (0..4)
            .map(|n| hinge.coefficients[n] * f[hinge.variables[n] as usize])
            .sum();
        let expected = area * jump.length();
        assert!(
            (form.abs() - expected).abs() < 1e-6 * (1.0 + expected),
            "{form} {expected}"
        );
        let fold = shape.facings[0].dot(shape.facings[1]).max(0.0);
        let height = laid(k, 1.0).y.min(laid(l, 1.0).y);
        let weight = fold * fold * (2.0 * height / i.distance(j)).min(1.0);
        assert!((hinge.weight - weight).abs() < 1e-9);
    }
}

/// The energy as it is written, from samples and hinges, has its least value at the solution.
#[test]
fn gradient_of_the_energy_is_zero_at_the_solution() {
    let shape = shape(uneven(6, |x, z| 0.2 * (x + z).sin()));
    let samples = samples(&shape, 2, |at, r| {
        (0.5 + 0.3 * at.x.sin() + 0.05 * r.signed()) as f32
    });
    let energy = energy(&shape, &samples, 1.0);
    let tree = Tree::new(&energy.matrix, &shape.positions);
    let factor = Factor::new(&energy.matrix, &tree, &|_| false).expect("positive definite");
    let mut x = energy.rights[0].clone();
    factor.solve(&tree, &mut x);
    let value = |x: &[f64]| {
        let mut sum = bend(&shape, |i| x[i]);
        for (site, [f]) in &samples {
            let t = shape.triangles[site.triangle as usize].map(|v| x[v as usize]);
            let g: f64 = (0..3).map(|k| t[k] * site.weights()[k]).sum();
            sum += site.area * (f64::from(*f) - g).powi(2);
        }
        for (triangle, area) in shape.triangles.iter().zip(&shape.areas) {
            let [a, b, c] = triangle.map(|v| x[v as usize]);
            sum += PULL * area * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2));
        }
        sum
    };
    for i in 0..x.len() {
        let (mut up, mut down) = (x.clone(), x.clone());
        up[i] += 1e-3;
        down[i] -= 1e-3;
        let slope = (value(&up) - value(&down)) / 2e-3;
        assert!(slope.abs() < 1e-8, "{i}: {slope}");
        assert!(value(&up) > value(&x) && value(&down) > value(&x));
    }
}
