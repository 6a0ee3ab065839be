use super::*;
use crate::client::Client;
use crate::codec::vertices::remap;
use crate::codec::{Compression, Limits};
use crate::instances::client::InstancesView;
use crate::obscurance::shapes;
use crate::obscurance::{Blend, Remap};
use crate::points::client::PointsView;
use crate::scene::{Instance, Pose, Scene};
use crate::vertices::client::VerticesView;
use crate::vertices::server::Sampling;
use crate::world::World;
use glam::{Affine3A, Vec3};
use ladder::Rung;

fn settings() -> Settings {
    Settings {
        vertices: vertices::Settings {
            rays: 4,
            sampling: Sampling {
                density: 1.0,
                max_per_face: 2,
            },
            ..vertices::Settings::default()
        },
        ..Settings::default()
    }
}

/// A plan of the built-in scene, with everything traced.
fn with_hall(test: impl Fn(&Plan, &[Traced])) {
    let scene = Scene::hall();
    let world = World::new(&scene, 0.0);
    let plan = Plan::new(&scene, world.pose(), settings()).expect("a plan");
    let traced = plan.trace(0..plan.items().len(), &|_| ());
    test(&plan, &traced.expect("traced"));
}

#[test]
fn plan_agrees_with_the_bake_of_vertices() {
    with_hall(|plan, traced| {
        let world = World::new(plan.scene(), 0.0);
        let settings = &plan.settings().vertices;
        let (whole, _) =
            vertices::bake(plan.scene(), world.pose(), world.tracer(), settings).expect("a bake");
        let (baked, reports) = plan.fit(traced, &|| ()).expect("a fit");
        let tone = Tone::default();
        for ((instance, baked), report) in whole.instances.iter().zip(&baked.instances).zip(reports)
        {
            assert_eq!(instance.report, report);
            for (vertex, value) in baked.vertices[0].iter().enumerate() {
                let kernels: Vec<f32> = instance.values.iter().map(|v| v[vertex]).collect();
                assert_eq!(*value, signals::unorm8(tone.apply(&kernels)[0]));
            }
        }
    });
}

#[test]
fn shares_are_disjoint_complete_and_balanced() {
    with_hall(|plan, _| {
        let largest = plan.items().iter().map(|item| item.samples.len()).max();
        let largest = largest.expect("an item");
        for tasks in [1, 2, 3, 7, 64, 100_000] {
            let mut next = 0;
            for task in 0..tasks {
                let share = plan.share(task, tasks);
                assert_eq!(share.start, next.max(share.start).min(next));
                next = share.end;
                let samples: usize = plan.items()[share].iter().map(|i| i.samples.len()).sum();
                assert!(samples <= plan.samples() / tasks + 1 + largest);
            }
            assert_eq!(next, plan.items().len());
        }
    });
}

#[test]
fn merged_parts_equal_the_whole() {
    with_hall(|plan, traced| {
        for tasks in [1, 3, 8] {
            let mut merge = part::Merge::new(plan, 7);
            for task in (0..tasks).rev() {
                let share = plan.share(task, tasks);
                let part = part::write(plan, 7, share.clone(), &traced[share]);
                merge.add(&part).expect("a part");
                // Twice does no harm.
                merge.add(&part).expect("a part");
            }
            assert_eq!(merge.finish().expect("all parts"), traced);
        }
    });
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    with_hall(|plan, traced| {
        let share = plan.share(0, 2);
        let part = part::write(plan, 7, share.clone(), &traced[share.clone()]);
        let mut merge = part::Merge::new(plan, 7);
        for length in [0, 7, 8, 20, part.len() - 1] {
            assert!(merge.add(&part[..length]).is_err(), "{length}");
        }
        for at in (0..part.len()).step_by(97) {
            let mut damaged = part.clone();
            damaged[at] ^= 4;
            assert!(merge.add(&damaged).is_err(), "{at}");
        }
        let other = part::Merge::new(plan, 8).add(&part);
        assert!(other.expect_err("another bake").contains("another scene"));
        merge.add(&part).expect("a part");
        let mut changed = traced[share.clone()].to_vec();
        changed[0][0].values[0] += 0.25;
        let changed = merge.add(&part::write(plan, 7, share, &changed));
        assert!(changed.expect_err("another result").contains("differs"));
        assert!(merge.finish().expect_err("half of it").contains("missing"));
    });
}

#[test]
fn keys_differ_by_scene_and_settings() {
    let keys = [
        part::key(b"scene", "a"),
        part::key(b"scene", "b"),
        part::key(b"other", "a"),
        part::key(b"scenea", ""),
    ];
    for (i, key) in keys.iter().enumerate() {
        assert!(!keys[..i].contains(key));
    }
}

#[test]
fn tone_blends_and_remaps() {
    let remap = Remap::new(&[[0.0, 0.5], [1.0, 1.0]]).expect("a curve");
    let blend = Blend { long: 0.25 };
    let mut tone = Tone {
        blend,
        separate: false,
        remap,
    };
    assert_eq!(tone.signals(2), 1);
    assert_eq!(tone.apply(&[0.0, 0.8]), [0.6]);
    tone.separate = true;
    assert_eq!(tone.signals(2), 2);
    assert_eq!(tone.apply(&[0.0, 0.8]), [0.5, 0.9]);
    assert_eq!(tone.signals(1), 1);
    assert_eq!(signals::shown(&[255, 0], blend), 0.75);
    assert_eq!(signals::shown(&[51], blend), 0.2);
}

/// Eight boxes of one mesh on a floor of another, and a wall beside three of them.
fn boxes() -> (Scene, Pose) {
    let floor = shapes::floor(Vec3::new(-6.0, 0.0, -6.0), 12.0, 12);
    let wall = shapes::cuboid(Vec3::new(3.2, 0.0, -6.0), Vec3::new(3.4, 5.0, 6.0));
    let small = shapes::cuboid(Vec3::new(-0.5, 0.01, -0.5), Vec3::new(0.5, 1.0, 0.5));
    let (mut scene, mut pose) = shapes::scene(vec![floor, wall, small]);
    scene.instances.pop();
    pose.world_from_mesh.pop();
    for i in 0..8 {
        let at = Vec3::new(if i < 3 { 2.6 } else { -3.0 }, 0.0, 1.5 * i as f32 - 5.0);
        scene.instances.push(Instance {
            name: format!("box {i}"),
            mesh: 2,
            ..Instance::default()
        });
        pose.world_from_mesh.push(Affine3A::from_translation(at));
    }
    pose.deformed = vec![None; scene.instances.len()];
    (scene, pose)
}

fn with_boxes(settings: Settings, test: impl Fn(&Plan, &Baked)) {
    let (scene, pose) = boxes();
    let plan = Plan::new(&scene, &pose, settings).expect("a plan");
    let traced = plan.trace(0..plan.items().len(), &|_| ());
    let (baked, _) = plan.fit(&traced.expect("traced"), &|| ()).expect("a fit");
    test(&plan, &baked);
}

fn fine() -> Settings {
    Settings {
        vertices: vertices::Settings {
            rays: 64,
            ..vertices::Settings::default()
        },
        ..Settings::default()
    }
}

#[test]
fn instances_of_a_mesh_share_local_values() {
    let settings = Settings {
        instances: true,
        ..fine()
    };
    with_boxes(settings, |_, baked| {
        assert_eq!(baked.locals.len(), 1);
        assert_eq!(baked.locals[0].mesh, 2);
        assert_eq!(baked.choices[0].rung, Rung::Vertices);
        let mean = |instance: usize| f32::from(baked.instances[instance].mean[0]);
        for (i, choice) in baked.choices.iter().enumerate().skip(2) {
            assert!(choice.rung.has_local(), "{i}: {choice:?}");
            // The values that a client shows are those of the instance.
            let shown = &baked.instances[i].vertices[0];
            let average = shown.iter().map(|v| f32::from(*v)).sum::<f32>() / shown.len() as f32;
            assert!(
                (average - mean(i)).abs() < 40.0,
                "{i}: {average} {}",
                mean(i)
            );
        }
        // Beside the wall it is darker.
        assert!(mean(2) < mean(8) - 10.0);
    });
}

/// Refined local values are kept where they lower the error over held-out samples, so that they never raise it by
/// more than rounding.
#[test]
fn refined_local_values_err_no_more() {
    let settings = Settings {
        instances: true,
        ..fine()
    };
    let (scene, pose) = boxes();
    let plan = Plan::new(&scene, &pose, settings).expect("a plan");
    let traced = plan.trace(0..plan.items().len(), &|_| ());
    let traced = traced.expect("obscurance");
    let mut gathers = vec![Vec::new(); scene.instances.len()];
    for (item, traced) in plan.items().iter().zip(&traced) {
        gathers[item.instance].extend_from_slice(traced);
    }
    for group in &plan.groups {
        let alone = plan.bake_alone(group).expect("kernels");
        let refined = plan.refine_local(group, alone.clone(), &gathers);
        assert_ne!(alone, refined);
        let error = |local: &signals::Local| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for &instance in &group.instances {
                let sites = &plan.surfaces[instance].sites;
                let (samples, numbers) = plan.ladder_samples(instance, sites, &gathers[instance]);
                let triangles = &scene.meshes[group.mesh].triangles;
                let at = |sample: usize| local.at(triangles, &sites[numbers[sample]]);
                let tone = &plan.settings().tone;
                let ladder = ladder::Ladder::functions(&samples, 1, tone, Some(&at));
                let linear = ladder.get(Rung::LocalLinear).expect("a rung").error;
                sum += ladder.weight * linear * linear;
                weight += ladder.weight;
            }
            f64::sqrt(sum / weight)
        };
        let [before, after] = [&alone, &refined].map(error);
        assert!(after < before + 1.0 / 255.0, "{before} {after}");
    }
}

#[test]
fn tolerance_takes_cheaper_rungs_the_larger_it_is() {
    let rungs = |tolerance: f64| {
        let settings = Settings {
            instances: true,
            tolerance: Some(tolerance),
            ..fine()
        };
        let rungs = std::cell::RefCell::new(Vec::new());
        with_boxes(settings, |_, baked| {
            for choice in &baked.choices {
                let chosen = choice.ladder.get(choice.rung).expect("it was tried");
                let least = choice.ladder.rungs.iter().map(|m| m.error);
                let least = least.fold(f64::INFINITY, f64::min);
                let has_local = choice.rung.has_local();
                let same = choice
                    .ladder
                    .rungs
                    .iter()
                    .filter(|m| m.rung.has_local() == has_local);
                let least_of_same = same.map(|m| m.error).fold(f64::INFINITY, f64::min);
                assert!(chosen.error <= tolerance || chosen.error <= least_of_same + 1e-12);
                assert!(least <= chosen.error);
            }
            let all = baked.choices.iter().map(|choice| choice.rung);
            *rungs.borrow_mut() = all.collect();
        });
        rungs.into_inner()
    };
    assert!(rungs(1.0).iter().all(|rung| *rung == Rung::Scalar));
    let strict = rungs(0.0);
    assert!(
        strict[2..].iter().all(|rung| *rung > Rung::Scalar),
        "{strict:?}"
    );
}
/// Points err less than the rungs that they stand in for, and a client finds them in the stream.
#[test]
fn points_take_over_where_no_rung_holds() {
    let scene = Scene::hall();
    let world = World::new(&scene, 0.0);
    let mut settings = Settings {
        instances: true,
        ..fine()
    };
    let plan = Plan::new(&scene, world.pose(), settings.clone()).expect("a plan");
    let traced = plan.trace(0..plan.items().len(), &|_| ()).expect("traced");
    let (mut baked, _) = plan.fit(&traced, &|| ()).expect("a fit");
    let before = baked.clone();
    let escalated = plan.escalate(&world, &traced, &mut baked);
    escalated.expect("nothing to do");
    assert_eq!(baked, before, "without a tolerance");

    settings.tolerance = Some(0.06);
    let plan = Plan::new(&scene, world.pose(), settings).expect("a plan");
    let (mut baked, _) = plan.fit(&traced, &|| ()).expect("a fit");
    let before = baked.clone();
    plan.escalate(&world, &traced, &mut baked).expect("points");
    assert!(!baked.points.is_empty());
    for points in &baked.points {
        let (was, is) = (
            &before.choices[points.instance],
            &baked.choices[points.instance],
        );
        assert!(was.error().expect("an error") > 0.06);
        assert_eq!(is.rung, Rung::Points);
        assert_eq!(is.error(), Some(points.error));
        assert!(points.error < was.error().expect("an error"));
    }
    for (was, is) in before.choices.iter().zip(&baked.choices) {
        assert!(was == is || was.error() > Some(0.06));
    }
    let options = stream::Options {
        bits: 8,
        compression: Compression::PAPER,
        limits: Limits::default(),
    };
    // The decoder holds the state against the digest.
    let (bytes, _) = stream::write(&plan, &baked, None, options).expect("a stream");
    let mut client = Client::of_scene(&scene, Limits::default());
    client.push(&bytes).expect("a sound stream");
    let (points, vertices) = (PointsView::new(&client), VerticesView::new(&client));
    for (instance, choice) in baked.choices.iter().enumerate() {
        assert_eq!(points.has(instance), choice.rung == Rung::Points);
        let own = vertices
            .of_instance(instance)
            .is_some_and(|found| found.is_own);
        assert_eq!(own, choice.rung == Rung::Vertices);
    }
}

/// What a client finds in the stream is what was baked, for every vertex.
#[test]
fn streams_hold_the_values_of_every_vertex() {
    with_hall(|plan, traced| {
        let (baked, _) = plan.fit(traced, &|| ()).expect("a fit");
        let scene = plan.scene();
        for bits in [8, 5] {
            let options = stream::Options {
                bits,
                compression: Compression::PAPER,
                limits: Limits::default(),
            };
            let (bytes, _) = stream::write(plan, &baked, None, options).expect("a stream");
            let mut client = Client::of_scene(scene, Limits::default());
            client.push(&bytes).expect("a sound stream");
            assert!(client.ended());
            let decoder = client.decoder();
            assert_eq!(decoder.tracks().len(), scene.instances.len());
            for track in decoder.tracks() {
                let instance = client.instance_of(&track.track).expect("an instance");
                let mesh = &scene.meshes[scene.instances[instance].mesh];
                let arrays =
                    |v: &[Vec3]| -> Vec<[f32; 3]> { v.iter().map(|v| v.to_array()).collect() };
                let remap = remap(&arrays(&mesh.positions), &arrays(&mesh.normals));
                let values = decoder.vertices().values_of(track);
                let step = if bits == 8 { 0 } else { 255 / 31 + 1 };
                for (vertex, expected) in baked.instances[instance].vertices[0].iter().enumerate() {
                    let got = values[remap[vertex] as usize];
                    assert!(got.abs_diff(*expected) <= step, "{got} {expected}");
                }
            }
        }
    });
}

#[test]
fn local_times_global_is_what_is_shown() {
    let settings = Settings {
        instances: true,
        ..fine()
    };
    with_boxes(settings, |plan, baked| {
        let [local, global] = plan.local_and_global(baked).expect("boxes have both");
        for (instance, choice) in baked.choices.iter().enumerate() {
            let values = |baked: &Baked| -> Vec<f32> {
                let values = baked.instances[instance].vertices[0].iter();
                values.map(|v| f32::from(*v) / 255.0).collect()
            };
            let pairs = values(&local).into_iter().zip(values(&global));
            for ((local, global), shown) in pairs.zip(values(baked)) {
                // A function above 1 is cut off where it stands alone.
                if global < 1.0 {
                    assert!((local * global - shown).abs() < 2.5 / 255.0, "{instance}");
                }
                assert!(local == 1.0 || choice.rung.has_local());
            }
        }
    });
    with_boxes(fine(), |plan, baked| {
        assert!(plan.local_and_global(baked).is_none());
    });
}

/// What a client shows of instances that share local values is what the bake says.
#[test]
fn streams_hold_functions_of_instances() {
    for tolerance in [None, Some(0.0), Some(0.05), Some(1.0)] {
        let settings = Settings {
            instances: true,
            tolerance,
            ..fine()
        };
        with_boxes(settings, |plan, baked| {
            let options = stream::Options {
                bits: 8,
                compression: Compression::None,
                limits: Limits::default(),
            };
            let (bytes, _) = stream::write(plan, baked, None, options).expect("a stream");
            for other in [baked.cheapest(), baked.richest()] {
                let (other, _) = stream::write(plan, &other, None, options).expect("a stream");
                let mut client = Client::of_scene(plan.scene(), Limits::default());
                client.push(&other).expect("a sound stream");
            }
            let mut client = Client::of_scene(plan.scene(), Limits::default());
            client.push(&bytes).expect("a sound stream");
            let values = VerticesView::new(&client);
            let functions = InstancesView::new(&client);
            for (i, expected) in baked.instances.iter().enumerate() {
                let mesh = &plan.scene().meshes[plan.scene().instances[i].mesh];
                let arrays =
                    |v: &[Vec3]| -> Vec<[f32; 3]> { v.iter().map(|v| v.to_array()).collect() };
                let remap = remap(&arrays(&mesh.positions), &arrays(&mesh.normals));
                for (vertex, position) in mesh.positions.iter().enumerate() {
                    let corner = [remap[vertex]; 3];
                    let at_vertex = values.of_instance(i);
                    let local = at_vertex
                        .map_or(1.0, |v| v.values.ao(values.values, corner, [1.0, 0.0, 0.0]));
                    let shown = match at_vertex {
                        Some(own) if own.is_own => local,
                        _ => functions.ao(i, position.to_array(), local),
                    };
                    let expected = f32::from(expected.vertices[0][vertex]) / 255.0;
                    assert!((shown - expected).abs() < 1.0 / 255.0, "{shown} {expected}");
                }
            }
        });
    }
}
