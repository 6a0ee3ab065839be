use super::*;
use crate::obscurance::{Blend, Obscurance, Remap};
use crate::scene::Scene;
use crate::vertices::Sampling;
use crate::world::World;

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
        tone: Tone::default(),
    }
}

/// A plan of the built-in scene, with everything traced.
fn with_hall(test: impl Fn(&Plan, &[Traced])) {
    let scene = Scene::hall();
    let world = World::new(&scene, 0.0);
    let plan = Plan::new(&scene, world.pose(), settings()).expect("a plan");
    let settings = &plan.settings().vertices;
    let obscurance = Obscurance::new(&scene, world.tracer(), &settings.kernels, settings.rays);
    let obscurance = obscurance.expect("obscurance");
    let traced = plan.trace(&obscurance, 0..plan.items().len(), &|_| ());
    test(&plan, &traced);
}

#[test]
fn plan_agrees_with_the_bake_of_vertices() {
    with_hall(|plan, traced| {
        let world = World::new(plan.scene(), 0.0);
        let settings = &plan.settings().vertices;
        let (whole, _) =
            vertices::bake(plan.scene(), world.pose(), world.tracer(), settings).expect("a bake");
        let (baked, reports) = plan.fit(traced, &|| ());
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
