//! Oracles of the fit: light that a look-up holds exactly, and light that it does not.

use super::*;
use crate::probes::lattice::Lattice;
use crate::probes::sample::{trilinear, visibility_weighted};
use crate::probes::server::{Draw, Hysteresis, Nearest, Options};
use crate::probes::sh;
use crate::probes::volume::Volume;
use crate::rng::Rng;
use crate::trace::Aabb;

const LOW: Vec3 = Vec3::new(-2.0, -1.5, -1.0);
const HIGH: Vec3 = Vec3::new(2.0, 1.5, 1.0);
/// The side of the curtain in [`two_rooms`] that is lit, up to this x.
const CURTAIN: f32 = 0.3;
const BRIGHT: f32 = 1.0;
const DIM: f32 = 0.05;

fn incoming(radiance: Vec3) -> IncomingRadiance {
    IncomingRadiance {
        radiance,
        distance: 1.0,
        back_face: false,
    }
}

/// The first wall of the box that a ray from inside meets, with a curtain if there is one.
fn wall(origin: Vec3, direction: Vec3, curtain: Option<f32>) -> Place {
    let mut nearest = (f32::INFINITY, Vec3::ZERO);
    for axis in 0..3 {
        let d = direction[axis];
        let mut planes = vec![if d > 0.0 { HIGH[axis] } else { LOW[axis] }];
        planes.extend(curtain.filter(|_| axis == 0));
        for plane in planes {
            let t = (plane - origin[axis]) / d;
            if t > 1e-4 && t < nearest.0 {
                let mut normal = Vec3::ZERO;
                normal[axis] = -d.signum();
                nearest = (t, normal);
            }
        }
    }
    let (t, normal) = nearest;
    let position = origin + direction * t;
    Place {
        position,
        origin: position + normal * 1e-3,
        geometric_normal: normal,
        normal,
    }
}

fn server(
    dims: [u16; 3],
    visibility: u32,
    curtain: Option<f32>,
    light: impl Fn(Vec3, Vec3) -> Vec3 + Sync,
) -> Server {
    let inset = 0.3 * Vec3::ONE;
    let bounds = Aabb {
        min: LOW + inset,
        max: HIGH - inset,
    };
    let volume = Volume::over(bounds, dims).expect("a volume");
    let options = Options {
        samples: 64,
        hysteresis: Hysteresis::Adaptive(0.99),
        visibility,
        ..Options::default()
    };
    let mut server = Server::new(volume, options).expect("a server");
    server.measure_geometry(|origin, direction| Nearest {
        distance: (wall(origin, direction, curtain).position - origin).length(),
        back_face: false,
    });
    for _ in 0..4 {
        server.update(|origin, direction, _: Draw| incoming(light(origin, direction)));
    }
    server
}

/// Each side of the curtain has its own light.
fn two_rooms(origin: Vec3, _: Vec3) -> Vec3 {
    Vec3::splat(if origin.x < CURTAIN { BRIGHT } else { DIM })
}

fn fitting(
    server: &Server,
    curtain: Option<f32>,
    light: impl Fn(Vec3, Vec3) -> Vec3 + Sync,
) -> Fitting {
    let mut fitting = Fitting::new(server, |o, d| Some(wall(o, d, curtain)));
    for _ in 0..4 {
        fitting.update(server, |o, d, _| incoming(light(o, d)));
    }
    fitting
}

fn with_strength(mut fitting: Fitting, strength: f32) -> Fitting {
    fitting.choice = Some(Choice {
        strength,
        ..Choice::default()
    });
    fitting
}

fn largest_difference(a: &[L2], b: &[L2]) -> f32 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs
        .map(|(a, b)| (*a - *b).abs().max_element())
        .fold(0.0, f32::max)
}

fn random_light(count: usize, seed: u64) -> Vec<L2> {
    let mut rng = Rng::new(seed);
    let mut value = || Vec3::from([0; 3].map(|_| rng.unit() - 0.5));
    (0..count)
        .map(|_| std::array::from_fn(|_| value()))
        .collect()
}

#[test]
fn uniform_light_is_left_as_traced() {
    for visibility in [0, 8] {
        let light = |_, _| Vec3::new(1.0, 2.0, 0.5);
        let server = server([4, 3, 3], visibility, None, light);
        let fitting = fitting(&server, None, light);
        assert!(fitting.len() > 400, "{}", fitting.len());
        let fitted = with_strength(fitting, 0.1).fit(&server);
        assert!(largest_difference(&fitted, &traced(&server)) < 1e-4);
    }
}

/// Light that trilinear interpolation of degree 2 holds exactly, everywhere.
#[test]
fn degree_2_and_linear_in_space_is_a_fixed_point() {
    let coefficients = random_light(4, 3);
    let at = |x: Vec3| -> L2 {
        let part = |i: usize| {
            coefficients[0][i]
                + coefficients[1][i] * x.x
                + coefficients[2][i] * x.y
                + coefficients[3][i] * x.z
        };
        std::array::from_fn(part)
    };
    // Walls closer than the outermost probes would be extrapolated: receivers stand between probes.
    let server = server([4, 3, 3], 0, None, |o, d| sh::evaluate_l2(&at(o), d));
    let mut fitting = Fitting::new(&server, |o, d| {
        let place = wall(o, d, None);
        let inset = 0.3 * Vec3::ONE;
        Some(Place {
            position: place.position.clamp(LOW + inset, HIGH - inset),
            ..place
        })
    });
    for receiver in &mut fitting.receivers {
        let world = receiver.x + server.volume.origin;
        receiver.irradiance = sh::irradiance(&at(world), receiver.normal);
    }
    let fitted = with_strength(fitting, 1e-3).fit(&server);
    let difference = largest_difference(&fitted, &traced(&server));
    assert!(difference < 1e-3, "{difference}");
}

/// Much better by trilinear interpolation, which knows nothing of the curtain; visibility leaves little
/// to gain.
#[test]
fn curtain_between_two_rooms_is_fitted_better_than_traced() {
    for (visibility, bound) in [(0, 0.7), (8, 1.0)] {
        let server = server([5, 3, 3], visibility, Some(CURTAIN), two_rooms);
        let mut fitting = fitting(&server, Some(CURTAIN), two_rooms);
        let choice = fitting.choose(&server);
        assert!(
            choice.fitted_error < bound * choice.traced_error,
            "{visibility}: {choice:?}"
        );
    }
}

#[test]
fn strong_ridge_leaves_light_as_traced() {
    let server = server([5, 3, 3], 0, Some(CURTAIN), two_rooms);
    let fitting = fitting(&server, Some(CURTAIN), two_rooms);
    let far = |strength| {
        let fitted = with_strength(fitting.clone(), strength).fit(&server);
        largest_difference(&fitted, &traced(&server))
    };
    let (weak, strong) = (far(1e-2), far(1e6));
    assert!(weak > 0.1 && strong < 1e-4 * weak, "{weak} {strong}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let rough = |o: Vec3, d: Vec3| (o * 3.0 + d).map(|v| v.sin().abs());
            let server = server([5, 3, 3], 8, Some(CURTAIN), rough);
            let mut fitting = fitting(&server, Some(CURTAIN), rough);
            (fitting.choose(&server), fitting.fit(&server))
        })
    };
    assert_eq!(run(1), run(3));
}

/// What the rows say is what the samplers say.
#[test]
fn rows_look_up_as_the_samplers_do() {
    for side in [0, 8] {
        let server = server([4, 3, 3], side, Some(CURTAIN), two_rooms);
        let fitting = fitting(&server, Some(CURTAIN), two_rooms);
        let light = random_light(server.probes.len(), 9);
        let present = vec![true; light.len()];
        let field = Field {
            lattice: server.volume.lattice,
            radiance: &light,
            present: &present,
            visibility: server.visibility().filter(|_| side > 0),
        };
        let rows = Rows::new(&field, &fitting.receivers);
        for (r, got) in fitting.receivers.iter().zip(rows.look_up(&light)) {
            let expansion = match side {
                0 => trilinear(&field, r.x),
                _ => visibility_weighted(&field, r.x, r.geometric_normal, r.view),
            };
            let right = sh::irradiance(&expansion, r.normal);
            assert!((got - right).length() < 1e-4, "{side}: {got} {right}");
        }
    }
}

/// An absent probe is the mean of what is one step nearer to a present one.
#[test]
fn absent_probes_are_looked_up_as_the_format_fills_them() {
    let lattice = Lattice {
        dims: [4, 2, 1],
        spacing: Vec3::ONE,
    };
    // Probe 2 lies beside 1 alone; 6 beside 2 and 5, which is itself beside 1 and 4.
    let present = [true, true, false, false, true, false, false, false];
    let receiver = |probe: usize| Receiver {
        x: lattice.position(probe),
        origin: Vec3::ZERO,
        geometric_normal: Vec3::Z,
        normal: Vec3::Z,
        view: Vec3::Z,
        irradiance: Vec3::ZERO,
        age: 1,
        covered: false,
    };
    let field = Field {
        lattice,
        radiance: &[],
        present: &present,
        visibility: None,
    };
    let receivers: Vec<Receiver> = (0..8).map(receiver).collect();
    let rows = Rows::new(&field, &receivers);
    let mut light = vec![[Vec3::ZERO; 9]; 8];
    for (probe, value) in [(0, 1.0), (1, 2.0), (4, 6.0)] {
        light[probe][0] = Vec3::splat(value);
    }
    let unit = sh::COSINE[0] * sh::Y0;
    let got: Vec<f32> = rows.look_up(&light).iter().map(|v| v.x / unit).collect();
    for (got, right) in got.iter().zip([1.0, 2.0, 2.0, 2.0, 6.0, 4.0, 3.0, 2.5]) {
        assert!((got - right).abs() < 1e-5, "{got} {right}");
    }
}

#[test]
fn spread_is_the_transpose_of_look_up() {
    let server = server([4, 3, 3], 8, Some(CURTAIN), two_rooms);
    let fitting = fitting(&server, Some(CURTAIN), two_rooms);
    let rows = fitting.rows.expect("rows");
    let x = random_light(server.probes.len(), 5);
    let y: Vec<Vec3> = random_light(rows.len(), 6).iter().map(|l| l[0]).collect();
    let there: f32 = rows
        .look_up(&x)
        .iter()
        .zip(&y)
        .map(|(a, b)| a.dot(*b))
        .sum();
    let back = rows.spread(&y);
    let pairs = x.as_flattened().iter().zip(back.as_flattened());
    let back: f32 = pairs.map(|(a, b)| a.dot(*b)).sum();
    assert!((there - back).abs() < 1e-2, "{there} {back}");
}

/// At the solution the gradient vanishes.
#[test]
fn solution_meets_the_normal_equations() {
    let server = server([4, 3, 3], 0, Some(CURTAIN), two_rooms);
    let fitting = fitting(&server, Some(CURTAIN), two_rooms);
    let (weights, rows) = (
        fitting.weights(&server),
        fitting.rows.as_ref().expect("rows"),
    );
    let wanted = fitting.wanted();
    let zero = vec![[Vec3::ZERO; 9]; server.probes.len()];
    let ridge = 0.1;
    let x = solve::solve(rows, &weights, &wanted, ridge, zero.clone());
    let gradient = |x: &[L2]| {
        let left = rows.look_up(x).into_iter().zip(&wanted).zip(&weights);
        let left: Vec<Vec3> = left.map(|((got, e), w)| (*e - got) * *w).collect();
        let mut sums = rows.spread(&left);
        for (sum, x) in sums.iter_mut().zip(x) {
            for (i, s) in sum.iter_mut().enumerate() {
                *s -= x[i] * ridge;
            }
        }
        let squares = sums.as_flattened().iter().map(|s| s.length_squared());
        squares.sum::<f32>().sqrt()
    };
    let (before, after) = (gradient(&zero), gradient(&x));
    assert!(after < 5e-3 * before, "{before} {after}");
}

/// When light changes, receivers forget as the probes around them do.
#[test]
fn receivers_follow_a_change_of_light() {
    let before = |_, _| Vec3::splat(1.0);
    let after = |_, _| Vec3::splat(3.0);
    let mut server = server([4, 3, 3], 0, None, before);
    let mut fitting = fitting(&server, None, before);
    for _ in 0..3 {
        server.update(|o, d, _: Draw| incoming(after(o, d)));
        fitting.update(&server, |o, d, _| incoming(after(o, d)));
    }
    let least = fitting.receivers.iter().map(|r| r.irradiance.x);
    let least = least.fold(f32::INFINITY, f32::min);
    assert!((least - 3.0 * PI).abs() < 1e-3, "{least}");
    let fitted = with_strength(fitting, 0.1).fit(&server);
    assert!(largest_difference(&fitted, &traced(&server)) < 1e-3);
}

/// What stands within a mover is no longer seen, and counts again when the mover has left.
#[test]
fn covered_receivers_have_no_weight() {
    let light = |_, _| Vec3::ONE;
    let server = server([4, 3, 3], 0, None, light);
    let mut fitting = fitting(&server, None, light);
    for inside in [true, false] {
        fitting.update(&server, |o, d, _| IncomingRadiance {
            radiance: Vec3::ONE,
            distance: 0.1,
            back_face: inside && (o + d).x.is_finite(),
        });
        let total: f32 = fitting.weights(&server).iter().sum();
        assert_eq!(total > 0.0, !inside, "{inside}: {total}");
    }
}
