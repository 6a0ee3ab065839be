//! The update loop against fields that are known.

use super::*;
use crate::probes::lattice::Lattice;
use crate::probes::sh::{Y0, basis, evaluate_l2, project};
use crate::trace::Aabb;

fn volume(dims: [u16; 3]) -> Volume {
    let spacing = Vec3::splat(0.5);
    Volume {
        lattice: Lattice { dims, spacing },
        origin: Vec3::new(-1.0, 2.0, 0.5),
    }
}

fn server(dims: [u16; 3], options: Options) -> Server {
    Server::new(volume(dims), options).expect("a server")
}

pub(super) fn plain() -> Options {
    Options {
        threshold: 0.0,
        visibility: 0,
        ..Options::default()
    }
}

fn light(radiance: Vec3) -> IncomingRadiance {
    IncomingRadiance {
        radiance,
        distance: 1.0,
        back_face: false,
    }
}

fn rng(draw: Draw) -> Rng {
    let Draw {
        probe,
        frame,
        sample,
    } = draw;
    Rng::new(u64::from(probe) << 40 ^ u64::from(frame) << 20 ^ u64::from(sample))
}

/// Uniform noise of mean 1 and standard deviation 0.58 about a value.
fn noisy(value: f32, draw: Draw) -> IncomingRadiance {
    light(Vec3::splat(value * 2.0 * rng(draw).unit()))
}

#[test]
fn a_white_room_is_its_expansion_to_the_last_bits() {
    for degree in 0..=4 {
        let options = Options { degree, ..plain() };
        let mut server = server([2, 2, 2], options);
        for _ in 0..3 {
            server.update(|_, _, _| light(Vec3::new(2.0, 1.0, 0.5)));
            for probe in 0..8 {
                let c = server.radiance(probe);
                assert_eq!(c.len(), (degree + 1) * (degree + 1));
                assert!((c[0] - Vec3::new(2.0, 1.0, 0.5) / Y0).length() < 2e-6);
                assert!(c[1..].iter().all(|c| c.length() < 2e-6));
            }
        }
    }
}

#[test]
fn light_that_the_expansion_holds_comes_back_from_few_samples() {
    let field = |d: Vec3| Vec3::new(2.0 + d.x, 1.0 - d.y * d.z, 3.0 * d.z * d.z);
    let options = Options {
        samples: 40,
        ..plain()
    };
    let mut server = server([3, 1, 1], options);
    server.update(|_, d, _| light(field(d)));
    for probe in 0..3 {
        for d in [Vec3::X, Vec3::Y, Vec3::new(0.6, 0.0, -0.8)] {
            assert!((evaluate_l2(&server.l2(probe), d) - field(d)).length() < 1e-4);
        }
    }
}

/// A small lamp, most of which no expansion of degree 2 holds: over many turns the rest cancels.
#[test]
fn light_that_it_does_not_hold_leaves_no_bias() {
    let axis = Vec3::new(0.36, 0.48, 0.8);
    let cut: f32 = 0.95;
    // The exact expansion of the cap: by Legendre's integrals over cosine 0.95 to 1.
    let p1 = 0.5 * (1.0 - cut * cut);
    let p2 = 0.5 * ((1.0 - cut.powi(3)) - (1.0 - cut));
    let band = [1.0 - cut, p1, p2].map(|p| p * std::f32::consts::TAU);
    let y = basis(axis);
    let options = Options {
        hysteresis: Hysteresis::Fixed(0.998),
        ..plain()
    };
    let probes = 16;
    let mut server = server([probes, 1, 1], options);
    let mut sums = [0.0f64; 9];
    let frames = 200;
    let share = 1.0 / f64::from(probes) / f64::from(frames);
    for _ in 0..frames {
        server.update(|_, d, _| {
            light(if d.dot(axis) > cut {
                Vec3::ONE
            } else {
                Vec3::ZERO
            })
        });
        for probe in &server.probes {
            let estimate = &probe.history;
            for (s, c) in sums.iter_mut().zip(estimate.recent()) {
                *s += f64::from(c.x) * share;
            }
        }
    }
    for (i, s) in sums.iter().enumerate() {
        let expected = f64::from(band[i.isqrt()] * y[i]);
        assert!((s - expected).abs() < 3e-3, "{i}: {s} {expected}");
    }
}

/// The estimate's own noise, too, falls with the samples, and says about as much as there is.
#[test]
fn variance_falls_with_samples() {
    let spread = |samples| {
        let options = Options { samples, ..plain() };
        let mut server = server([8, 8, 8], options);
        server.update(|_, _, draw| noisy(1.0, draw));
        let count = server.probes.len() as f32;
        let truth = Vec3::splat(1.0 / Y0);
        let variance = |p: usize| {
            let c = server.radiance(p);
            (c[0] - truth).length_squared() + c[1..].iter().map(|c| c.length_squared()).sum::<f32>()
        };
        let measured = (0..512).map(variance).sum::<f32>() / count;
        let stated = server.probes.iter().map(|p| p.history.noise()).sum::<f32>() / count;
        (measured, stated)
    };
    let (few, many) = (spread(64), spread(1024));
    let ratio = few.0 / many.0;
    assert!((12.0..21.0).contains(&ratio), "{ratio}");
    for (measured, stated) in [few, many] {
        let ratio = stated / measured;
        assert!((0.85..1.2).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_step_is_answered_by_the_power_of_the_hysteresis() {
    for a in [0.8, 0.95, 0.99, 0.998] {
        let options = Options {
            hysteresis: Hysteresis::Fixed(a),
            ..plain()
        };
        let mut server = server([1, 1, 1], options);
        server.update(|_, _, _| light(Vec3::ZERO));
        for n in 1..=60 {
            server.update(|_, _, _| light(Vec3::ONE));
            let got = server.radiance(0)[0].x * Y0;
            let expected = 1.0 - a.powi(n);
            assert!((got - expected).abs() < 1e-4, "{a}, {n}: {got} {expected}");
        }
    }
}

#[test]
fn adaptive_hysteresis_is_quick_where_light_changes_and_calm_where_not() {
    let options = Options {
        samples: 64,
        hysteresis: Hysteresis::Adaptive(0.99),
        ..plain()
    };
    let mut server = server([8, 4, 2], options);
    // Half of the probes see a light go out at frame 150.
    let value = |draw: Draw| {
        if draw.probe < 32 && draw.frame >= 150 {
            0.3
        } else {
            1.0
        }
    };
    let mut drops = 0;
    let mut spread = 0.0f32;
    for frame in 0..300u32 {
        let tick = server.update(|_, _, draw| noisy(value(draw), draw));
        let light = |p: usize| server.radiance(p)[0].x * Y0;
        if frame < 150 {
            assert_eq!(tick.dropped, 0, "noise is no change: {frame}");
        } else {
            drops += tick.dropped;
        }
        if frame == 154 {
            for p in 0..32 {
                assert!((light(p) - 0.3).abs() < 0.08, "{p}: {}", light(p));
            }
        }
        if frame >= 150 {
            for p in 32..64 {
                spread = spread.max((light(p) - 1.0).abs());
            }
        }
    }
    // One drop a probe, two where the first came half way.
    assert!((32..64).contains(&drops), "{drops}");
    // 64 samples of 0.58 over about 200 frames: 0.005.
    assert!(spread < 0.03, "{spread}");
}

#[test]
fn one_lucky_path_is_no_change() {
    let options = Options {
        samples: 64,
        hysteresis: Hysteresis::Adaptive(0.99),
        ..plain()
    };
    let mut server = server([4, 4, 4], options);
    for frame in 0..200 {
        let tick = server.update(|_, _, draw| {
            // One path in 40 frames finds a lamp and brings forty times what all others do.
            let lucky = draw.sample == 7 && (draw.frame + 3 * draw.probe) % 40 == 39;
            let mut arrived = noisy(1.0, draw);
            if lucky {
                arrived.radiance += 40.0 * 64.0 * 0.1;
            }
            arrived
        });
        assert_eq!(tick.dropped, 0, "{frame}");
    }
}

#[test]
fn what_does_not_change_is_not_sent() {
    let options = Options {
        threshold: 0.01,
        ..plain()
    };
    let mut server = server([4, 1, 1], options);
    let first = server.update(|_, _, draw| light(Vec3::splat(draw.probe as f32)));
    assert_eq!((first.changed, first.present, first.rays), (4, 4, 1024));
    for frame in 1..20 {
        let tick = server.update(|_, _, draw| {
            let grows = if draw.probe == 2 {
                1.0 + 0.2 * frame as f32
            } else {
                1.0
            };
            light(Vec3::splat(draw.probe as f32 * grows))
        });
        assert!(tick.changed <= 1);
        assert_eq!(tick.changed == 1, server.is_changed(2));
    }
    // What was given out is never farther from the truth than the threshold.
    let (out, mean) = (server.radiance(2)[0], server.probes[2].history.mean[0]);
    assert!((out - mean).length() < 0.02 * mean.length() && out.x > 2.0 / Y0);
}

#[test]
fn threads_change_nothing() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let options = Options {
                hysteresis: Hysteresis::Adaptive(0.95),
                visibility: 4,
                ..Options::default()
            };
            let mut server = server([5, 4, 3], options);
            server.measure_geometry(|o, d| Nearest {
                distance: (o + 7.0 * d).length(),
                back_face: d.x > 0.9,
            });
            for _ in 0..12 {
                server.update(|o, d, draw| IncomingRadiance {
                    radiance: (d + o) * rng(draw).unit(),
                    distance: rng(draw).unit() * 2.0,
                    back_face: draw.probe % 7 == 0,
                });
            }
            let light: Vec<Vec3> = (0..60).flat_map(|p| server.radiance(p).to_vec()).collect();
            let present: Vec<bool> = (0..60).map(|p| server.is_present(p)).collect();
            (light, present, server.codes.clone())
        })
    };
    assert_eq!(run(1), run(2));
    assert!(run(1).1.contains(&false) && run(1).1.contains(&true));
}

#[test]
fn light_that_is_no_number_is_none() {
    let mut server = server([1, 1, 1], plain());
    server.update(|_, _, draw| {
        light(Vec3::splat(match draw.sample {
            3 => f32::NAN,
            5 => f32::INFINITY,
            _ => 1.0,
        }))
    });
    assert!(server.radiance(0).iter().all(|c| c.is_finite()));
    assert!((server.radiance(0)[0].x * Y0 - 1.0).abs() < 0.05);
}

#[test]
fn options_out_of_range_are_refused() {
    let refused = |options| {
        Server::new(volume([1, 1, 1]), options)
            .err()
            .map(|e| e.to_string())
    };
    let base = Options::default();
    let cases = [
        (Options { samples: 0, ..base }, "sample"),
        (Options { degree: 5, ..base }, "degrees"),
        (
            Options {
                visibility: 5,
                ..base
            },
            "texels",
        ),
        (
            Options {
                hysteresis: Hysteresis::Fixed(0.5),
                ..base
            },
            "hysteresis",
        ),
        (
            Options {
                hysteresis: Hysteresis::Adaptive(f32::NAN),
                ..base
            },
            "hysteresis",
        ),
    ];
    for (options, word) in cases {
        let message = refused(options).expect("refused");
        assert!(message.contains(word), "{message}");
    }
    let bounds = Aabb {
        min: Vec3::ZERO,
        max: Vec3::ONE,
    };
    assert!(Volume::over(bounds, [0, 1, 1]).is_err());
    assert!(Volume::over(bounds, [4096, 4096, 2]).is_err());
    assert!(Volume::over(Aabb::EMPTY, [1, 1, 1]).is_err());
}

/// A probe at the edge of the decision keeps it.
#[test]
fn presence_does_not_flicker() {
    let mut server = server(
        [4, 4, 4],
        Options {
            samples: 256,
            ..plain()
        },
    );
    let mut turns = 0;
    let mut last = Vec::new();
    for _ in 0..200 {
        server.update(|_, _, draw| IncomingRadiance {
            radiance: Vec3::ONE,
            distance: 100.0,
            back_face: rng(draw).unit() < 0.25,
        });
        let now: Vec<bool> = (0..64).map(|p| server.is_present(p)).collect();
        turns += now.iter().zip(&last).filter(|(a, b)| a != b).count();
        last = now;
    }
    assert!(turns < 10, "{turns} of 12,800");
    // But what is plainly inside is found, and what comes out again, too.
    for (share, expected) in [(0.5, false), (0.1, true)] {
        for _ in 0..40 {
            server.update(|_, _, draw| IncomingRadiance {
                radiance: Vec3::ONE,
                distance: 100.0,
                back_face: rng(draw).unit() < share,
            });
        }
        assert!((0..64).all(|p| server.is_present(p) == expected));
    }
}

#[test]
fn projecting_by_hand_agrees() {
    let mut by_hand = [Vec3::ZERO; 9];
    let mut directions = Vec::new();
    let mut samples = Vec::new();
    for i in 0..4000 {
        let d = spiral(i, 4000);
        let value = Vec3::splat((3.0 * d.x).exp());
        project(&mut by_hand, d, value, 4.0 * std::f32::consts::PI / 4000.0);
        directions.push(d);
        samples.push(value);
    }
    let estimate = projection::fit(2, &directions, &samples);
    for (a, b) in by_hand.iter().zip(&estimate.radiance) {
        assert!((*a - *b).length() < 0.02, "{a} {b}");
    }
}
