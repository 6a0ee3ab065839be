//! The node hierarchy and what hangs on it: mesh instances, cameras and lights.

use super::{Document, Read, clean_name, finite, get, skins};
use crate::scene::{Camera, Instance, Light, LightKind, Node, Scene};
use ::gltf::json;
use glam::{Affine3A, Mat4, Quat, Vec3};
use json::extensions::scene::khr_lights_punctual::Type;
use json::validation::Checked;
use std::collections::HashSet;

/// Deeper hierarchies are refused: paths and chains of joints grow with the depth.
const MAX_DEPTH: usize = 1024;

/// The file's nodes in an order that has parents before children, depth first.
pub(super) struct Order {
    /// File index of each node of the scene.
    pub sources: Vec<usize>,
    /// Scene index of each node of the file.
    pub of_source: Vec<usize>,
    pub parents: Vec<Option<usize>>,
    /// Whether the node belongs to the scene that is shown.
    pub shown: Vec<bool>,
}

pub(super) fn order(document: &Document) -> Read<Order> {
    let root = &document.root;
    let count = root.nodes.len();
    let mut parent = vec![None; count];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            get(&root.nodes, *child, "child node")?;
            if parent[child.value()].replace(i).is_some() {
                return Err(format!("node {} has two parents", child.value()));
            }
        }
    }
    let shown_roots: Vec<usize> = match (root.scene, root.scenes.first()) {
        (Some(scene), _) => roots_of(document, get(&root.scenes, scene, "scene")?)?,
        (None, Some(scene)) => roots_of(document, scene)?,
        (None, None) => (0..count).filter(|i| parent[*i].is_none()).collect(),
    };
    let mut is_shown_root = vec![false; count];
    for node in &shown_roots {
        is_shown_root[*node] = true;
    }
    let mut order = Order {
        sources: Vec::with_capacity(count),
        of_source: vec![usize::MAX; count],
        parents: Vec::with_capacity(count),
        shown: Vec::with_capacity(count),
    };
    for start in (0..count).filter(|i| parent[*i].is_none()) {
        let mut stack = vec![(start, None, 0)];
        while let Some((source, above, depth)) = stack.pop() {
            if depth > MAX_DEPTH {
                return Err(format!("its nodes are nested deeper than {MAX_DEPTH}"));
            }
            let here = order.sources.len();
            order.sources.push(source);
            order.of_source[source] = here;
            order.parents.push(above);
            let shown = is_shown_root[source] || above.is_some_and(|a: usize| order.shown[a]);
            order.shown.push(shown);
            let children = root.nodes[source].children.iter().flatten().rev();
            stack.extend(children.map(|c| (c.value(), Some(here), depth + 1)));
        }
    }
    // Every node has at most one parent, so what no root reaches goes round in a circle.
    match order.of_source.iter().position(|i| *i == usize::MAX) {
        Some(node) => Err(format!("node {node} is its own ancestor")),
        None => Ok(order),
    }
}

fn roots_of(document: &Document, scene: &json::Scene) -> Read<Vec<usize>> {
    let nodes = &document.root.nodes;
    scene
        .nodes
        .iter()
        .map(|n| get(nodes, *n, "scene node").map(|_| n.value()))
        .collect()
}

/// Fills `scene.nodes`.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) -> Read<()> {
    for (source, parent) in order.sources.iter().zip(&order.parents) {
        let node = &document.root.nodes[*source];
        let what = format!("the transform of node {source}");
        let mut out = Node {
            name: clean_name(node.name.as_ref(), "node", *source),
            parent: *parent,
            translation: Vec3::from(node.translation.unwrap_or_default()),
            rotation: Quat::IDENTITY,
            scale: Vec3::from(node.scale.unwrap_or([1.0; 3])),
            matrix: None,
            morph_weights: node.weights.clone().unwrap_or_default(),
        };
        finite(&out.translation.to_array(), &what)?;
        finite(&out.scale.to_array(), &what)?;
        for weight in &out.morph_weights {
            finite(&[*weight], &format!("a morph weight of node {source}"))?;
        }
        if let Some(rotation) = node.rotation {
            finite(&rotation.0, &what)?;
            out.rotation = unit(rotation.0);
        }
        if let Some(matrix) = &node.matrix {
            finite(matrix, &what)?;
            let matrix = Mat4::from_cols_array(matrix);
            if matrix.row(3) != glam::Vec4::W {
                return Err(format!("{what} is not affine"));
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
    Ok(())
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
) -> Read<()> {
    let root = &document.root;
    let mut names = HashSet::new();
    for here in 0..order.sources.len() {
        if !order.shown[here] {
            continue;
        }
        let source = order.sources[here];
        let node = &root.nodes[source];
        if let Some(mesh) = node.mesh {
            get(&root.meshes, mesh, "mesh")?;
            if let Some(mesh) = meshes.get(mesh.value()).copied().flatten() {
                let mut name = path(scene, here);
                if !names.insert(name.clone()) {
                    name = format!("{name}@{source}");
                    names.insert(name.clone());
                }
                place_mesh(document, here, source, mesh, name, scene)?;
            }
        }
        if let Some(camera) = node.camera {
            place_camera(document, here, camera, scene)?;
        }
        if let Some(light) = node
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
        {
            place_light(document, here, light.light, scene)?;
        }
    }
    Ok(())
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
    if let Some(skin) = node.skin {
        get(&document.root.skins, skin, "skin")?;
        let skin = skin.value();
        skins::check(scene, mesh, skin, source)?;
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
            ..Instance::default()
        });
        return Ok(());
    }
    let instance = |name, offset| Instance {
        name,
        mesh,
        node: Some(here),
        offset,
        ..Instance::default()
    };
    match gpu_instances(document, source)? {
        None => scene.instances.push(instance(name, Affine3A::IDENTITY)),
        Some(offsets) => {
            let numbered = offsets.into_iter().enumerate();
            let named = numbered.map(|(k, offset)| instance(format!("{name}#{k}"), offset));
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

fn place_camera(
    document: &Document,
    here: usize,
    index: json::Index<json::Camera>,
    scene: &mut Scene,
) -> Read<()> {
    let camera = get(&document.root.cameras, index, "camera")?;
    let name = match &camera.name {
        Some(name) if !name.is_empty() => clean_name(Some(name), "", 0),
        _ => scene.nodes[here].name.clone(),
    };
    let Some(lens) = &camera.perspective else {
        let text = format!("camera {name} is orthographic and was left out");
        scene.warnings.push(text);
        return Ok(());
    };
    if !(lens.yfov > 0.0 && lens.yfov < std::f32::consts::PI) {
        return Err(format!(
            "the field of view of camera {name} is out of range"
        ));
    }
    if !(lens.znear > 0.0 && lens.znear.is_finite()) {
        return Err(format!("the near plane of camera {name} is out of range"));
    }
    scene.cameras.push(Camera {
        name,
        node: Some(here),
        yfov: lens.yfov,
        znear: lens.znear,
        world_from_camera: Affine3A::IDENTITY,
    });
    Ok(())
}

fn place_light(
    document: &Document,
    here: usize,
    index: json::Index<json::extensions::scene::khr_lights_punctual::Light>,
    scene: &mut Scene,
) -> Read<()> {
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
    scene.lights.push(Light {
        name,
        node: Some(here),
        kind,
        intensity,
        range: match light.range {
            Some(range) if range > 0.0 => range,
            _ => f32::INFINITY,
        },
    });
    Ok(())
}
