//! The node hierarchy and what hangs on it: mesh instances, cameras and lights.

use super::hierarchy::Order;
use super::{Document, Read, clean_name, finite, get, skins};
use crate::scene::{Camera, FileInstance, Instance, Light, LightKind, Node, Scene};
use ::gltf::json;
use glam::{Affine3A, Mat4, Quat, Vec3};
use json::extensions::scene::khr_lights_punctual::Type;
use json::validation::Checked;
use std::collections::HashSet;

/// Fills `scene.nodes`.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) {
    for (source, parent) in order.sources.iter().zip(&order.parents) {
        let node = &document.root.nodes[*source];
        // What of a transform cannot be used is the identity.
        let usable = |values: &[f32], part: &str| {
            let good = values.iter().all(|v| v.is_finite());
            if !good {
                let text = format!("the {part} of node {source} is not finite; it was left out");
                document.warn(text);
            }
            good
        };
        let translation = node.translation.filter(|t| usable(t, "translation"));
        let scale = node.scale.filter(|s| usable(s, "scale"));
        let rotation = node.rotation.filter(|r| usable(&r.0, "rotation"));
        let weights = node.weights.clone();
        let mut out = Node {
            name: clean_name(node.name.as_ref(), "node", *source),
            parent: *parent,
            translation: Vec3::from(translation.unwrap_or_default()),
            rotation: rotation.map_or(Quat::IDENTITY, |r| unit(r.0)),
            scale: Vec3::from(scale.unwrap_or([1.0; 3])),
            matrix: None,
            morph_weights: weights
                .filter(|w| usable(w, "list of morph weights"))
                .unwrap_or_default(),
        };
        if let Some(matrix) = node.matrix.as_ref().filter(|m| usable(&m[..], "matrix")) {
            let mut matrix = Mat4::from_cols_array(matrix);
            if matrix.row(3) != glam::Vec4::W {
                document.warn(format!(
                    "the matrix of node {source} is not affine; its last row was left out"
                ));
                for column in [
                    &mut matrix.x_axis,
                    &mut matrix.y_axis,
                    &mut matrix.z_axis,
                    &mut matrix.w_axis,
                ] {
                    column.w = 0.0;
                }
                matrix.w_axis.w = 1.0;
            }
            match decompose(&matrix) {
                Some((scale, rotation, translation)) => {
                    (out.scale, out.rotation, out.translation) = (scale, rotation, translation);
                }
                None => out.matrix = Some(matrix),
            }
        }
        scene.nodes.push(out);
    }
}

/// Unit length; a quaternion of no length is no rotation.
pub(super) fn unit(q: [f32; 4]) -> Quat {
    let q = Quat::from_array(q);
    let length = q.length();
    if length > 1e-6 && length.is_finite() {
        q / length
    } else {
        Quat::IDENTITY
    }
}

/// Scale, rotation and translation of a matrix that is made of them.
fn decompose(matrix: &Mat4) -> Option<(Vec3, Quat, Vec3)> {
    let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
    let again = Mat4::from_scale_rotation_translation(scale, rotation, translation);
    let tolerance = 1e-6 * (1.0 + scale.abs().max_element());
    again
        .abs_diff_eq(*matrix, tolerance)
        .then_some((scale, rotation, translation))
}

/// Fills `scene.instances`, `cameras` and `lights`. `meshes` gives the scene's mesh for each of the
/// file's, `None` for one without triangles.
pub(super) fn place(
    document: &Document,
    order: &Order,
    meshes: &[Option<usize>],
    scene: &mut Scene,
) {
    let root = &document.root;
    let mut names = HashSet::new();
    for here in 0..order.sources.len() {
        if !order.shown[here] {
            continue;
        }
        let source = order.sources[here];
        let node = &root.nodes[source];
        if let Some(mesh) = node.mesh {
            let known = get(&root.meshes, mesh, "mesh").map_err(|e| format!("node {source}: {e}"));
            document.geometry(known);
            if let Some(mesh) = meshes.get(mesh.value()).copied().flatten() {
                let mut name = path(scene, here);
                if !names.insert(name.clone()) {
                    name = format!("{name}@{source}");
                    names.insert(name.clone());
                }
                document.geometry(place_mesh(document, here, source, mesh, name, scene));
            }
        }
        if let Some(camera) = node.camera {
            let camera = read_camera(document, here, camera, scene);
            scene.cameras.extend(document.optional(camera));
        }
        if let Some(light) = node
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
        {
            let light = read_light(document, here, light.light);
            scene.lights.extend(document.optional(light));
        }
    }
}

/// Names from the root down, joined by slashes.
fn path(scene: &Scene, node: usize) -> String {
    let mut names = Vec::new();
    let mut at = Some(node);
    while let Some(n) = at {
        names.push(scene.nodes[n].name.as_str());
        at = scene.nodes[n].parent;
    }
    names.reverse();
    names.join("/")
}

fn place_mesh(
    document: &Document,
    here: usize,
    source: usize,
    mesh: usize,
    name: String,
    scene: &mut Scene,
) -> Read<()> {
    let node = &document.root.nodes[source];
    let skin = node.skin.and_then(|skin| {
        let known = get(&document.root.skins, skin, "skin");
        let known = known.map_err(|e| format!("the skin of node {source}: {e}"));
        if scene
            .skins
            .get(skin.value())
            .is_some_and(|s| s.joints.is_empty())
        {
            // Its own warning was given.
            return None;
        }
        document.optional(known.and_then(|_| {
            skins::check(scene, mesh, skin.value(), source)?;
            Ok(skin.value())
        }))
    });
    if let Some(skin) = skin {
        document.spend(
            scene.meshes[mesh].positions.len(),
            &format!("node {source}"),
        )?;
        scene.instances.push(Instance {
            name,
            mesh,
            node: skins::frame(scene, skin),
            skin: Some(skin),
            morph_node: Some(here),
            file: Some(FileInstance {
                node: source,
                number: None,
            }),
            ..Instance::default()
        });
        return Ok(());
    }
    let instance = |name, offset, number| Instance {
        name,
        mesh,
        node: Some(here),
        offset,
        file: Some(FileInstance {
            node: source,
            number,
        }),
        ..Instance::default()
    };
    match document.optional(gpu_instances(document, source)).flatten() {
        None => scene
            .instances
            .push(instance(name, Affine3A::IDENTITY, None)),
        Some(offsets) => {
            let numbered = offsets.into_iter().enumerate();
            let named =
                numbered.map(|(k, offset)| instance(format!("{name}#{k}"), offset, Some(k)));
            scene.instances.extend(named);
        }
    }
    Ok(())
}

/// The offsets of `EXT_mesh_gpu_instancing`, if the node has it.
fn gpu_instances(document: &Document, source: usize) -> Read<Option<Vec<Affine3A>>> {
    let Some(extension) = document.root.nodes[source]
        .extensions
        .as_ref()
        .and_then(|e| e.others.get("EXT_mesh_gpu_instancing"))
    else {
        return Ok(None);
    };
    let accessor = |name: &str| -> Read<Option<json::Index<json::Accessor>>> {
        match extension.get("attributes").and_then(|a| a.get(name)) {
            None => Ok(None),
            Some(value) => match value.as_u64().and_then(|v| u32::try_from(v).ok()) {
                Some(index) => Ok(Some(json::Index::new(index))),
                None => Err(format!(
                    "{name} of the GPU instances of node {source} is no index"
                )),
            },
        }
    };
    let what = format!("the GPU instances of node {source}");
    let (t, r, s) = (
        accessor("TRANSLATION")?,
        accessor("ROTATION")?,
        accessor("SCALE")?,
    );
    let Some(first) = t.or(r).or(s) else {
        return Err(format!(
            "{what} have neither translation, rotation nor scale"
        ));
    };
    let count = document.count(first, &what)?;
    document.spend(count, &what)?;
    let translations = match t {
        Some(index) => document.floats::<3>(index, &what)?,
        None => vec![[0.0; 3]; count],
    };
    let rotations = match r {
        Some(index) => document.floats::<4>(index, &what)?,
        None => vec![[0.0, 0.0, 0.0, 1.0]; count],
    };
    let scales = match s {
        Some(index) => document.floats::<3>(index, &what)?,
        None => vec![[1.0; 3]; count],
    };
    if [translations.len(), rotations.len(), scales.len()] != [count; 3] {
        return Err(format!("{what} have attributes of different counts"));
    }
    let offsets = (0..count).map(|k| {
        Affine3A::from_scale_rotation_translation(
            scales[k].into(),
            unit(rotations[k]),
            translations[k].into(),
        )
    });
    Ok(Some(offsets.collect()))
}

fn read_camera(
    document: &Document,
    here: usize,
    index: json::Index<json::Camera>,
    scene: &Scene,
) -> Read<Camera> {
    let camera = get(&document.root.cameras, index, "camera")?;
    let name = match &camera.name {
        Some(name) if !name.is_empty() => clean_name(Some(name), "", 0),
        _ => scene.nodes[here].name.clone(),
    };
    let Some(lens) = &camera.perspective else {
        return Err(format!("camera {name} is not a perspective one"));
    };
    if !(lens.yfov > 0.0 && lens.yfov < std::f32::consts::PI) {
        return Err(format!(
            "the field of view of camera {name} is out of range"
        ));
    }
    if !(lens.znear > 0.0 && lens.znear.is_finite()) {
        return Err(format!("the near plane of camera {name} is out of range"));
    }
    Ok(Camera {
        name,
        node: Some(here),
        yfov: lens.yfov,
        znear: lens.znear,
        world_from_camera: Affine3A::IDENTITY,
    })
}

fn read_light(
    document: &Document,
    here: usize,
    index: json::Index<json::extensions::scene::khr_lights_punctual::Light>,
) -> Read<Light> {
    let lights = document
        .root
        .extensions
        .as_ref()
        .and_then(|e| e.khr_lights_punctual.as_ref())
        .map_or(&[][..], |l| &l.lights[..]);
    let light = get(lights, index, "light")?;
    let name = clean_name(light.name.as_ref(), "light", index.value());
    let spot = light.spot.clone().unwrap_or_default();
    let kind = match &light.type_ {
        Checked::Valid(Type::Directional) => LightKind::Directional,
        Checked::Valid(Type::Point) => LightKind::Point,
        Checked::Valid(Type::Spot) => LightKind::Spot {
            inner: spot.inner_cone_angle,
            outer: match light.spot {
                Some(_) => spot.outer_cone_angle,
                None => std::f32::consts::FRAC_PI_4,
            },
        },
        Checked::Invalid => return Err(format!("light {name} is of an unknown type")),
    };
    let intensity = Vec3::from(light.color) * light.intensity;
    let what = format!("a number of light {name}");
    finite(&intensity.to_array(), &what)?;
    finite(&[spot.inner_cone_angle, spot.outer_cone_angle], &what)?;
    if intensity.min_element() < 0.0 {
        return Err(format!("light {name} has a negative intensity"));
    }
    Ok(Light {
        name,
        node: Some(here),
        kind,
        intensity,
        range: match light.range {
            Some(range) if range > 0.0 => range,
            _ => f32::INFINITY,
        },
    })
}
