use super::*;

#[test]
fn it_is_small_sound_and_the_same_each_time() {
    let scene = Scene::hall();
    let triangles: usize = scene
        .instances
        .iter()
        .map(|i| scene.meshes[i.mesh].triangles.len())
        .sum();
    assert!(
        (20_000..60_000).contains(&triangles),
        "{triangles} triangles"
    );
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        assert_eq!(mesh.normals.len(), count, "{}", mesh.name);
        assert_eq!(mesh.uvs[0].len(), count, "{}", mesh.name);
        assert_eq!(mesh.materials.len(), mesh.triangles.len(), "{}", mesh.name);
        for normal in &mesh.normals {
            assert!((normal.length() - 1.0).abs() < 1e-4, "{}", mesh.name);
        }
        for (t, m) in mesh.triangles.iter().zip(&mesh.materials) {
            assert!((*m as usize) < scene.materials.len());
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            let face = (b - a).cross(c - a);
            assert!(face.length() > 0.0, "{}", mesh.name);
            // Shading normals agree with the winding.
            let mean: Vec3 = t.iter().map(|v| mesh.normals[*v as usize]).sum();
            assert!(face.dot(mean) > 0.0, "{} {t:?}", mesh.name);
        }
    }
    let pose = scene.pose(1.25);
    let mut area = 0.0;
    scene.for_each_triangle(&pose, |[a, b, c]| {
        area += (b - a).cross(c - a).length() * 0.5
    });
    assert!((600.0..1300.0).contains(&area), "{area} m2");
    let (min, max) = scene.bounds(&pose).expect("triangles");
    assert!(min.abs_diff_eq(Vec3::new(-10.0, 0.0, -6.4), 0.02), "{min}");
    assert!(max.abs_diff_eq(Vec3::new(10.0, 6.1, 6.4), 0.02), "{max}");

    let again = Scene::hall().pose(1.25);
    assert_eq!(pose.world_from_mesh, again.world_from_mesh);
    assert!(pose.deformed == again.deformed);
}

#[test]
fn the_loop_closes() {
    let scene = Scene::hall();
    let (start, end) = (scene.pose(0.0), scene.pose(f64::from(DURATION) - 1e-5));
    for (i, (a, b)) in start
        .world_from_mesh
        .iter()
        .zip(&end.world_from_mesh)
        .enumerate()
    {
        assert!(a.abs_diff_eq(*b, 2e-3), "{}", scene.instances[i].name);
    }
    for (a, b) in start.deformed.iter().zip(&end.deformed) {
        if let (Some(a), Some(b)) = (a, b) {
            let close = |(p, q): (&Vec3, &Vec3)| p.abs_diff_eq(*q, 2e-3);
            assert!(a.positions.iter().zip(&b.positions).all(close));
        }
    }
}

#[test]
fn boulders_roll_on_the_floor_without_slipping() {
    let scene = Scene::hall();
    let names: Vec<usize> = (0..scene.instances.len())
        .filter(|i| scene.instances[*i].name.starts_with("boulder"))
        .collect();
    assert_eq!(names.len(), 6);
    for i in names {
        assert!(scene.is_moving_instance(i) && !scene.is_deforming_instance(i));
        let mesh = &scene.meshes[scene.instances[i].mesh];
        for frame in [0, 100, 333] {
            let at = |frame: i32| scene.pose(f64::from(frame) / 60.0).world_from_mesh[i];
            let (a, b) = (at(frame), at(frame + 1));
            let lowest = |m: &Affine3A| {
                let heights = mesh.positions.iter().map(|p| m.transform_point3(*p).y);
                heights.fold(f32::INFINITY, f32::min)
            };
            assert!(lowest(&a).abs() < 1e-3, "{}", lowest(&a));
            // The angle turned times the radius is the way gone.
            let radius = Vec3::from(a.matrix3.x_axis).length();
            let way = Vec3::from(b.translation - a.translation) * Vec3::new(1.0, 0.0, 1.0);
            let turn = Quat::from_mat3a(&((b.matrix3 * a.matrix3.inverse()) * 1.0));
            let angle = 2.0 * turn.xyz().length().asin();
            assert!(
                (angle * radius - way.length()).abs() < 2e-3,
                "{angle} {}",
                way.length()
            );
        }
    }
}

#[test]
fn the_walker_walks_on_the_floor() {
    let scene = Scene::hall();
    let walker = scene
        .instances
        .iter()
        .position(|i| i.skin.is_some())
        .expect("a walker");
    assert!(scene.skins[0].joints.len() >= 10);
    assert!(scene.is_moving_instance(walker) && scene.is_deforming_instance(walker));
    let (mut lowest_ever, mut highest_ever) = (f32::INFINITY, 0.0f32);
    for frame in (0..480).step_by(7) {
        let pose = scene.pose(f64::from(frame) / 60.0);
        let deformed = pose.deformed[walker].as_ref().expect("skinned");
        let heights = deformed
            .positions
            .iter()
            .map(|p| pose.world_from_mesh[walker].transform_point3(*p).y);
        let (low, high) = heights.fold((f32::INFINITY, 0.0f32), |(l, h), y| (l.min(y), h.max(y)));
        assert!(low.abs() < 0.02, "sole at {low}");
        lowest_ever = lowest_ever.min(high);
        highest_ever = highest_ever.max(high);
    }
    assert!(
        lowest_ever > 1.6 && highest_ever < 1.9,
        "{lowest_ever} {highest_ever}"
    );
}
