//! Tests over the scene files, held against the table in their README.
//!
//! The folder is `DAPPLE_SCENES`, or `../shared/scenes` beside the repository; without it these
//! tests say that they skip.

use super::{Pose, Scene};
use glam::{DMat4, DVec3, Mat4, Vec3};
use std::path::PathBuf;

pub(super) fn folder() -> Option<PathBuf> {
    let path = match std::env::var_os("DAPPLE_SCENES") {
        Some(path) => PathBuf::from(path),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"),
    };
    if path.join("README.md").is_file() {
        return Some(path);
    }
    println!("skipped: no scenes at {}", path.display());
    None
}

fn load(name: &str) -> Option<Scene> {
    Some(Scene::load(&folder()?.join(name)).expect(name))
}

/// One row of the README's table.
struct Row {
    file: String,
    triangles: f64,
    size: Option<Vec3>,
    area: Option<f64>,
    instances: usize,
}

fn number(cell: &str) -> Option<f64> {
    let first = cell.split_whitespace().next()?;
    first.replace(',', "").parse().ok()
}

fn rows(text: &str) -> Vec<Row> {
    let lines = text
        .lines()
        .filter(|l| l.starts_with("| ") && l.contains(".glb |"));
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let sides: Vec<f32> = cells[6]
                .split(" x ")
                .filter_map(|s| s.parse().ok())
                .collect();
            Row {
                file: cells[1].to_owned(),
                triangles: number(cells[5]).expect("a triangle count"),
                size: (sides.len() == 3).then(|| Vec3::new(sides[0], sides[1], sides[2])),
                area: number(cells[7]),
                instances: number(cells[8]).expect("an instance count") as usize,
            }
        })
        .collect()
}

fn area(scene: &Scene, pose: &Pose) -> f64 {
    let mut area = 0.0;
    scene.for_each_triangle(pose, |[a, b, c]| {
        area += f64::from((b - a).cross(c - a).length()) * 0.5;
    });
    area
}

#[test]
fn every_scene_loads_as_its_table_says() {
    let Some(folder) = folder() else { return };
    let text = std::fs::read_to_string(folder.join("README.md")).expect("README");
    let rows = rows(&text);
    assert!(rows.len() >= 20, "{} rows", rows.len());
    let mut wrong = Vec::new();
    for row in rows {
        let scene = match Scene::load(&folder.join(&row.file)) {
            Ok(scene) => scene,
            Err(e) => {
                wrong.push(e.to_string());
                continue;
            }
        };
        let file = &row.file;
        // Two files have several animations.
        let is_wrong = |w: &&String| !w.ends_with("chosen by its name");
        for warning in scene.warnings.iter().filter(is_wrong) {
            wrong.push(format!("{file}: {warning}"));
        }
        let mut pose = scene.rest_pose();
        // The table counts the node of GPU instances once, unplaced.
        let mut scene = scene;
        if let Some(first) = scene.instances.iter().position(|i| i.name.ends_with("#0")) {
            scene
                .instances
                .retain(|i| !i.name.contains('#') || i.name.ends_with("#0"));
            scene.instances[first].offset = glam::Affine3A::IDENTITY;
            scene = scene.clone();
            pose = scene.rest_pose();
        }
        if scene.instances.len() != row.instances {
            wrong.push(format!(
                "{file}: {} instances, not {}",
                scene.instances.len(),
                row.instances
            ));
        }
        let triangles: usize = scene
            .instances
            .iter()
            .map(|i| scene.meshes[i.mesh].triangles.len() + scene.meshes[i.mesh].dropped_triangles)
            .sum();
        if triangles as f64 != row.triangles {
            wrong.push(format!(
                "{file}: {triangles} triangles, not {}",
                row.triangles
            ));
        }
        let (min, max) = scene.bounds(&pose).expect("triangles");
        if let Some(size) = row.size
            && !(max - min).abs_diff_eq(size, 0.02)
        {
            wrong.push(format!("{file}: {} large, not {size}", max - min));
        }
        let area = area(&scene, &pose);
        if let Some(expected) = row.area
            // Rows with few digits are rounded to the last.
            && (area - expected).abs() > (expected * 1e-3).max(0.051)
        {
            wrong.push(format!("{file}: area {area}, not {expected}"));
        }
        for mesh in &scene.meshes {
            let all_unit = mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4);
            if !all_unit || mesh.normals.len() != mesh.positions.len() {
                wrong.push(format!("{file}: normals of mesh {}", mesh.name));
            }
        }
        if scene.duration > 0.0 && scene.pose(1.0).time != 1.0 {
            wrong.push(format!("{file}: time"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn skinned_vertices_match_double_precision() {
    for (file, time) in [
        ("cesium_man.glb", 0.7),
        ("robot_lab.glb", 3.21),
        ("skinned_tentacles.glb", 0.9),
    ] {
        let Some(scene) = load(file) else { return };
        let pose = scene.pose(time);
        let local = |n: usize| {
            // The animated local transforms come from the channels themselves.
            let node = &scene.nodes[n];
            let (mut t, mut r, mut s) = (node.translation, node.rotation, node.scale);
            for channel in scene.channels.iter().filter(|c| c.node == n) {
                match channel.sample(time, &mut Vec::new()) {
                    Some(super::animation::Sample::Translation(v)) => t = v,
                    Some(super::animation::Sample::Rotation(v)) => r = v,
                    Some(super::animation::Sample::Scale(v)) => s = v,
                    _ => {}
                }
            }
            match node.matrix {
                Some(m) => m.as_dmat4(),
                None => DMat4::from_scale_rotation_translation(
                    s.as_dvec3(),
                    r.as_dquat().normalize(),
                    t.as_dvec3(),
                ),
            }
        };
        let mut world: Vec<DMat4> = Vec::new();
        for (n, node) in scene.nodes.iter().enumerate() {
            let here = local(n);
            world.push(node.parent.map_or(here, |p| world[p] * here));
        }
        let mut checked = 0;
        for (i, instance) in scene.instances.iter().enumerate() {
            let Some(skin) = instance.skin else {
                assert!(pose.deformed[i].is_none());
                continue;
            };
            let (mesh, skin) = (&scene.meshes[instance.mesh], &scene.skins[skin]);
            let deformed = pose.deformed[i].as_ref().expect("skinned");
            for v in (0..mesh.positions.len()).step_by(37) {
                let mut expected = DVec3::ZERO;
                for (j, w) in mesh.joints[v].iter().zip(mesh.weights[v].to_array()) {
                    let j = usize::from(*j);
                    let bind: Mat4 = skin.inverse_bind[j];
                    let m = world[skin.joints[j]] * bind.as_dmat4();
                    expected += m.transform_point3(mesh.positions[v].as_dvec3()) * f64::from(w);
                }
                let got = pose.world_from_mesh[i].transform_point3(deformed.positions[v]);
                let error = (got.as_dvec3() - expected).length();
                assert!(error < 2e-5, "{file} {} vertex {v}: {error}", instance.name);
                checked += 1;
            }
        }
        assert!(checked > 80, "{file}: {checked}");
    }
}

#[test]
fn a_carried_figure_keeps_its_frame() {
    let Some(scene) = load("robot_lab.glb") else {
        return;
    };
    let (a, b) = (scene.pose(1.0), scene.pose(2.0));
    let mut carried = 0;
    for (i, instance) in scene.instances.iter().enumerate() {
        if instance.skin.is_none() {
            if !scene.is_moving_instance(i) {
                assert_eq!(a.world_from_mesh[i], b.world_from_mesh[i]);
            }
            continue;
        }
        assert!(scene.is_deforming_instance(i), "{}", instance.name);
        let moved = a.world_from_mesh[i].translation - b.world_from_mesh[i].translation;
        if moved.length() > 0.5 {
            assert!(scene.is_moving_instance(i), "{}", instance.name);
            carried += 1;
        }
        // The figure stays about its frame's origin.
        let deformed = b.deformed[i].as_ref().expect("skinned");
        assert!(deformed.positions.iter().all(|p| p.length() < 3.0));
    }
    assert!(carried >= 9, "{carried}");
}

#[test]
fn poses_are_the_same_in_any_order_and_buffer() {
    let Some(scene) = load("robot_lab.glb") else {
        return;
    };
    let fresh = scene.pose(2.5);
    let mut reused = scene.pose(0.25);
    scene.pose_into(2.5, &mut reused);
    let mut looped = scene.pose(0.0);
    scene.pose_into(2.5 + f64::from(scene.duration), &mut looped);
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let single = one_thread.install(|| scene.pose(2.5));
    for other in [&reused, &single] {
        assert_eq!(fresh.world_from_mesh, other.world_from_mesh);
        assert!(fresh.deformed == other.deformed);
        for (a, b) in fresh.cameras.iter().zip(&other.cameras) {
            assert_eq!(a.world_from_camera, b.world_from_camera);
        }
    }
    for (a, b) in fresh.world_from_mesh.iter().zip(&looped.world_from_mesh) {
        assert!(a.abs_diff_eq(*b, 1e-4));
    }
}

#[test]
fn spoilt_files_are_errors_not_panics() {
    let Some(folder) = folder() else { return };
    for file in [
        "animated_morph_cube.glb",
        "interpolation_test.glb",
        "cesium_man.glb",
    ] {
        let bytes = std::fs::read(folder.join(file)).expect(file);
        for cut in (0..bytes.len()).step_by(bytes.len() / 40 + 1) {
            assert!(
                Scene::from_bytes(file, &bytes[..cut], None).is_err(),
                "{file} cut at {cut}"
            );
        }
        // The JSON chunk comes first, so steps of its length / 100 change names, numbers, brackets.
        let json = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize + 20;
        let rounds = if file == "cesium_man.glb" { 20 } else { 300 };
        for k in 0..rounds {
            let mut spoilt = bytes.clone();
            let at = k * json / rounds;
            spoilt[at] ^= 1 << (k % 7);
            if let Ok(scene) = Scene::from_bytes(file, &spoilt, None) {
                scene.pose(0.4);
            }
        }
    }
}
