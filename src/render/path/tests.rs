//! Pictures by paths: their parts, their noise, their files.

use super::state::{PictureId, load, save};
use super::*;
use crate::scene::{Scene, camera::look_at};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};

const SKY: Sky = Sky {
    up: Vec3::new(0.5, 0.7, 1.0),
    down: Vec3::splat(0.2),
};

fn camera() -> CameraPose {
    look_at(Vec3::new(2.0, 2.2, 5.0), Vec3::new(-1.0, 1.0, 0.0), 1.0)
}

fn with_hall(test: impl FnOnce(&Scene, &PathTracer) + Send) {
    let scene = Scene::hall();
    let pose = scene.pose(0.0);
    let tracer = Tracer::new(&scene, &pose);
    test(&scene, &PathTracer::new(&scene, &pose, &tracer, SKY));
}

#[test]
fn passes_and_threads_do_not_change_the_picture() {
    with_hall(|_, tracer| {
        let options = Options::default();
        let drawn = |threads: usize, passes: &[u32]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| {
                let mut picture = PathPicture::new(24, 13);
                for samples in passes {
                    picture.add(tracer, &camera(), &options, *samples, &|_| ());
                }
                picture
            })
        };
        let one = drawn(1, &[4]);
        assert_eq!(one, drawn(2, &[4]));
        assert_eq!(one, drawn(2, &[1, 3]));
        assert_eq!(one.samples(), 8);
        let parts = [Part::Direct, Part::Indirect].map(|p| one.light(p));
        for (i, all) in one.light(Part::All).iter().enumerate() {
            assert!(all.abs_diff_eq(parts[0][i] + parts[1][i], 1e-5));
        }
        assert!(one.light(Part::Indirect).iter().any(|l| l.x > 0.0));
    });
}

#[test]
fn direct_light_has_no_noise_and_halves_share_nothing() {
    with_hall(|_, tracer| {
        let mut picture = PathPicture::new(24, 13);
        let options = Options::default();
        picture.add(tracer, &camera(), &options, 2, &|_| ());
        assert_eq!(picture.noise(Part::Direct, 1.0), 0.0);
        let alone = direct(tracer, &camera(), (24, 13), &options, 1);
        assert_eq!(picture.light(Part::Direct), alone);
        let first = picture.noise(Part::Indirect, 1.0);
        assert!(first > 0.0);
        picture.add(tracer, &camera(), &options, 30, &|_| ());
        let later = picture.noise(Part::Indirect, 1.0);
        // A quarter for 16 times the samples, or less where they are spread evenly.
        assert!(later < 0.4 * first, "{first} {later}");
    });
}

/// The stated noise is the distance to a picture of very many samples.
#[test]
fn the_stated_noise_is_the_error() {
    with_hall(|_, tracer| {
        let drawn = |seed: u32, samples: u32| {
            let mut picture = PathPicture::new(24, 13);
            let options = Options {
                seed,
                ..Options::default()
            };
            picture.add(tracer, &camera(), &options, samples, &|_| ());
            picture
        };
        let shown = |picture: &PathPicture| -> Vec<f64> {
            develop(&picture.light(Part::All), 1.0)
                .iter()
                .flat_map(|c| c.to_array().map(|v| f64::from(srgb_from_linear(v))))
                .collect()
        };
        let truth = shown(&drawn(9, 512));
        let picture = drawn(0, 16);
        let differences = shown(&picture)
            .into_iter()
            .zip(&truth)
            .map(|(a, b)| (a - b).powi(2));
        let error = (differences.sum::<f64>() / truth.len() as f64).sqrt();
        let stated = picture.noise(Part::All, 1.0);
        assert!((0.7..1.4).contains(&(stated / error)), "{stated} {error}");
    });
}

#[test]
fn supersampling_is_another_picture_of_the_same_light() {
    with_hall(|_, tracer| {
        let options = Options {
            supersample: true,
            ..Options::default()
        };
        let mut fine = PathPicture::new(24, 13);
        fine.add(tracer, &camera(), &options, 16, &|_| ());
        assert!(fine.noise(Part::Direct, 1.0) > 0.0);
        let mean = |p: &[Vec3]| p.iter().sum::<Vec3>().element_sum() / p.len() as f32;
        let centres = direct(tracer, &camera(), (24, 13), &Options::default(), 1);
        let (a, b) = (mean(&fine.light(Part::Direct)), mean(&centres));
        assert!((a / b - 1.0).abs() < 0.1, "{a} {b}");
    });
}

#[test]
fn a_state_goes_on_where_it_was() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("state");
    with_hall(|scene, tracer| {
        let options = Options::default();
        let id = PictureId::new(scene, 0.0, &camera(), &options, &SKY, true);
        let mut picture = load(&path, 12, 7, &id).expect("nothing yet");
        assert_eq!(picture, PathPicture::new(12, 7));
        picture.add(tracer, &camera(), &options, 2, &|_| ());
        save(&path, &picture, &id).expect("saved");
        let mut again = load(&path, 12, 7, &id).expect("loaded");
        assert_eq!(again, picture);
        for p in [&mut picture, &mut again] {
            p.add(tracer, &camera(), &options, 2, &|_| ());
        }
        assert_eq!(again, picture);

        let refused = |width, id: &PictureId| {
            let error = load(&path, width, 7, id).expect_err("refused");
            error.to_string()
        };
        assert!(refused(13, &id).contains("12x7 pixels, not 13x7"));
        let moved = look_at(Vec3::ONE, Vec3::ZERO, 1.0);
        let other = PictureId::new(scene, 0.0, &moved, &options, &SKY, true);
        assert!(refused(12, &other).contains("another camera"));
        let other = PictureId::new(scene, 0.0, &camera(), &options, &Sky::default(), true);
        assert!(refused(12, &other).contains("other options"));
        let other = Scene {
            name: "other".into(),
            ..scene.clone()
        };
        let other = PictureId::new(&other, 0.0, &camera(), &options, &SKY, true);
        assert!(refused(12, &other).contains("another scene"));

        let bytes = std::fs::read(&path).expect("read");
        for damage in [0, 9, 30, bytes.len() / 2, bytes.len() - 1] {
            let mut bytes = bytes.clone();
            bytes[damage] ^= 4;
            std::fs::write(&path, &bytes).expect("written");
            assert!(load(&path, 12, 7, &id).is_err(), "byte {damage}");
        }
        for length in [0, 3, 40, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..length]).expect("written");
            assert!(load(&path, 12, 7, &id).is_err(), "{length} bytes");
        }
    });
}
