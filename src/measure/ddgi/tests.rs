//! The baseline against analytic rooms: first it has to be right.

use super::*;
use std::f32::consts::PI;

/// A room of 4 m edges about the origin, all of whose walls are one diffuse material and shine.
fn room(albedo: f32, emission: f32) -> impl Fn(Vec3, Vec3) -> End + Sync {
    move |origin, direction| {
        let mut distance = f32::INFINITY;
        let mut normal = Vec3::ZERO;
        for axis in 0..3 {
            let wall = 2f32.copysign(direction[axis]);
            let t = (wall - origin[axis]) / direction[axis];
            if direction[axis] != 0.0 && t < distance {
                distance = t;
                normal = Vec3::ZERO;
                normal[axis] = -1f32.copysign(direction[axis]);
            }
        }
        End {
            distance,
            back_face: false,
            position: origin + direction * distance,
            normal,
            radiance: Vec3::splat(emission),
            diffuse: Vec3::splat(albedo),
            glossy: Vec3::ZERO,
        }
    }
}

fn options() -> Options {
    Options {
        origin: Vec3::splat(-1.5),
        spacing: Vec3::ONE,
        dims: UVec3::splat(4),
        rays: 256,
        hysteresis: 0.9,
        seed: 7,
    }
}

/// In a closed room of one shining diffuse material, radiance is L = Le + rho L everywhere.
#[test]
fn a_closed_room_has_the_analytic_light() {
    for albedo in [0.0, 0.5, 0.8] {
        let mut ddgi = Ddgi::new(Options {
            hysteresis: 0.5,
            ..options()
        });
        for _ in 0..50 {
            ddgi.update(room(albedo, 1.0));
        }
        let exact = PI / (1.0 - albedo);
        for position in [
            Vec3::ZERO,
            Vec3::new(1.2, -1.99, 0.3),
            Vec3::new(-1.99, 1.9, -1.7),
        ] {
            for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z] {
                let found = ddgi.irradiance(position, axis, axis);
                let error = (found - exact).abs().max_element() / exact;
                assert!(
                    error < 0.05,
                    "albedo {albedo} at {position}: {found} for {exact}"
                );
            }
        }
    }
}

/// One wall shines: irradiance at the centre, facing it, is its form factor times pi.
#[test]
fn one_bright_wall_gives_its_form_factor() {
    let lit = |origin: Vec3, direction: Vec3| {
        let mut end = room(0.0, 1.0)(origin, direction);
        if end.normal != Vec3::NEG_X {
            end.radiance = Vec3::ZERO;
        }
        end
    };
    let mut ddgi = Ddgi::new(Options {
        origin: Vec3::splat(-1.0),
        dims: UVec3::splat(3),
        ..options()
    });
    for _ in 0..100 {
        ddgi.update(lit);
    }
    // A square of half edge 2 at distance 2, seen head on: 4 times that of a quarter (Howell B-4).
    let (a, b) = (1f32, 1f32);
    let (x, y) = (a / (1.0 + a * a).sqrt(), b / (1.0 + b * b).sqrt());
    let quarter = (x * (b / (1.0 + a * a).sqrt()).atan() + y * (a / (1.0 + b * b).sqrt()).atan())
        / (2.0 * PI);
    let exact = 4.0 * quarter * PI;
    // The biased place is the probe at the centre.
    let place = Vec3::X * -0.225;
    let found = ddgi.irradiance(place, Vec3::X, Vec3::X).x;
    assert!((found / exact - 1.0).abs() < 0.05, "{found} for {exact}");
}

/// An open world whose light in all directions is `(1 + step * i)²` at probe i along `axis`.
fn ramp(axis: usize, step: f32) -> impl Fn(Vec3, Vec3) -> End + Sync {
    move |origin, direction| End {
        distance: f32::INFINITY,
        back_face: false,
        position: origin,
        normal: -direction,
        radiance: Vec3::splat((1.0 + step * origin[axis]).powi(2)),
        diffuse: Vec3::ZERO,
        glossy: Vec3::ZERO,
    }
}

/// Roots are blended, so that between probes the root is linear: in the biased place, which lies 0.8
/// of the bias towards the viewer. On a line of probes with the normal across, no other weight differs.
#[test]
fn linear_field_is_met_between_probes_at_the_biased_place() {
    let mut ddgi = Ddgi::new(Options {
        origin: Vec3::ZERO,
        dims: UVec3::new(4, 1, 1),
        ..options()
    });
    ddgi.update(ramp(0, 0.5));
    for x in [0.1f32, 0.5, 1.25, 2.7] {
        for view in [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.6, 0.8, 0.0)] {
            let biased = x + view.x * 0.8 * 0.225;
            let exact = PI * (1.0 + 0.5 * biased.clamp(0.0, 3.0)).powi(2);
            let found = ddgi.irradiance(Vec3::X * x, Vec3::Y, view).x;
            assert!(
                (found / exact - 1.0).abs() < 2e-3,
                "{x} {view}: {found} for {exact}"
            );
        }
    }
}

/// Halfway between probes along each axis, all eight count alike.
#[test]
fn middle_of_a_cell_has_the_mean() {
    let mut ddgi = Ddgi::new(options());
    ddgi.update(ramp(2, 0.25));
    let biased = 0.225;
    let exact = PI * (1.0 + 0.25 * 0.0f32).powi(2);
    let found = ddgi.irradiance(Vec3::Y * -biased, Vec3::Y, Vec3::Y).x;
    assert!((found / exact - 1.0).abs() < 2e-3, "{found} for {exact}");
}

#[test]
fn disabled_probes_light_nothing() {
    let mut ddgi = Ddgi::new(Options {
        origin: Vec3::ZERO,
        dims: UVec3::new(2, 1, 1),
        ..options()
    });
    ddgi.update(ramp(0, 1.0));
    let whole = ddgi.textures().map(|t| t.len());
    ddgi.disable(vec![false, true]);
    let found = ddgi.irradiance(Vec3::X * 0.7, Vec3::Y, Vec3::Y).x;
    assert!((found / PI - 1.0).abs() < 2e-3, "{found}");
    assert_eq!(ddgi.textures().map(|t| 2 * t.len()), whole);
    ddgi.disable(vec![true, true]);
    assert_eq!(ddgi.irradiance(Vec3::X, Vec3::Y, Vec3::Y), Vec3::ZERO);
}

#[test]
fn hysteresis_answers_a_step_as_it_should() {
    let mut ddgi = Ddgi::new(options());
    ddgi.update(room(0.0, 0.0));
    for n in 1..=20 {
        ddgi.update(room(0.0, 1.0));
        let found = ddgi.irradiance(Vec3::ZERO, Vec3::Y, Vec3::Y).x / PI;
        let exact = 1.0 - 0.9f32.powi(n);
        assert!(
            (found - exact).abs() < 0.01,
            "after {n}: {found} for {exact}"
        );
    }
}

/// Two rooms of 4 m beside each other, a wall between them; only the left one shines.
#[test]
fn visibility_keeps_light_out_of_a_sealed_room() {
    let rooms = |origin: Vec3, direction: Vec3| {
        let centre = Vec3::new(if origin.x < 0.0 { -2.1 } else { 2.1 }, 0.0, 0.0);
        let mut end = room(0.0, 1.0)(origin - centre, direction);
        end.position += centre;
        if origin.x > 0.0 {
            end.radiance = Vec3::ZERO;
        }
        end
    };
    let mut ddgi = Ddgi::new(Options {
        origin: Vec3::new(-3.5, -1.5, -1.5),
        dims: UVec3::new(8, 4, 4),
        ..options()
    });
    for _ in 0..100 {
        ddgi.update(rooms);
    }
    let dark = ddgi
        .irradiance(Vec3::new(0.11, 0.2, 0.1), Vec3::X, Vec3::X)
        .x;
    let bright = ddgi
        .irradiance(Vec3::new(-0.11, 0.2, 0.1), Vec3::NEG_X, Vec3::NEG_X)
        .x;
    assert!(dark < 0.05 * bright, "{dark} leaks beside {bright}");
}

#[test]
fn one_thread_gives_what_many_give() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool").install(|| {
            let mut ddgi = Ddgi::new(options());
            for _ in 0..3 {
                ddgi.update(room(0.5, 1.0));
            }
            ddgi.irradiance
        })
    };
    assert!(run(1) == run(2));
}
