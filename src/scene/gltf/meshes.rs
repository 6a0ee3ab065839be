//! Meshes: the primitives of each are put together into one triangle list.

use super::nodes::Order;
use super::{Document, Read, clean_name, finite, get};
use crate::scene::{Mesh, MorphTarget, Scene, normals};
use ::gltf::json;
use glam::{Vec2, Vec3, Vec4};
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

/// Fills `scene.meshes` with those meshes that shown nodes use and that have triangles; gives the
/// scene's index for each of the file's.
pub(super) fn read(
    document: &Document,
    order: &Order,
    scene: &mut Scene,
) -> Read<Vec<Option<usize>>> {
    let root = &document.root;
    let mut used = vec![false; root.meshes.len()];
    for (here, source) in order.sources.iter().enumerate() {
        if let Some(mesh) = root.nodes[*source].mesh
            && order.shown[here]
            && let Some(used) = used.get_mut(mesh.value())
        {
            *used = true;
        }
    }
    let mut indices = Vec::with_capacity(used.len());
    for (i, used) in used.into_iter().enumerate() {
        if !used {
            indices.push(None);
            continue;
        }
        let mesh = read_mesh(document, i, scene)?;
        scene.dropped_triangles += mesh.dropped_triangles;
        if mesh.triangles.is_empty() {
            indices.push(None);
        } else {
            indices.push(Some(scene.meshes.len()));
            scene.meshes.push(mesh);
        }
    }
    Ok(indices)
}

fn read_mesh(document: &Document, index: usize, scene: &mut Scene) -> Read<Mesh> {
    let source = &document.root.meshes[index];
    let mut mesh = Mesh {
        name: clean_name(source.name.as_ref(), "mesh", index),
        morph_weights: source.weights.clone().unwrap_or_default(),
        ..Mesh::default()
    };
    for weight in &mesh.morph_weights {
        finite(&[*weight], &format!("a morph weight of mesh {}", mesh.name))?;
    }
    let mut first_targets = None;
    for (p, primitive) in source.primitives.iter().enumerate() {
        let what = format!("primitive {p} of mesh {}", mesh.name);
        let targets = primitive.targets.as_ref().map_or(0, Vec::len);
        if *first_targets.get_or_insert(targets) != targets {
            return Err(format!(
                "{what} has {targets} morph targets where the first primitive has another number"
            ));
        }
        let is_material = |m: usize| m < document.root.materials.len();
        let material = primitive.material.map(|m| m.value());
        if material.is_some_and(|m| !is_material(m)) {
            return Err(format!("{what} names a material that is not there"));
        }
        let material = material.unwrap_or(document.root.materials.len());
        let Some(mut part) = read_primitive(document, primitive, material, &what, scene)? else {
            continue;
        };
        if let Some(texture) = scene.materials[material].normal_texture
            && part.tangents.is_empty()
        {
            normals::generate_tangents(&mut part, &texture);
        }
        part.materials = vec![material as u32; part.triangles.len()];
        append(&mut mesh, part, &what)?;
    }
    mesh.morph_weights.resize(first_targets.unwrap_or(0), 0.0);
    Ok(mesh)
}

/// One primitive as a mesh of its own. `None` when it draws no triangles.
fn read_primitive(
    document: &Document,
    primitive: &Primitive,
    material: usize,
    what: &str,
    scene: &mut Scene,
) -> Read<Option<Mesh>> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mode = match &primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => *mode,
        Checked::Valid(_) => {
            scene.warnings.push(format!("{what} draws no triangles"));
            return Ok(None);
        }
        Checked::Invalid => return Err(format!("{what} has an unknown mode")),
    };
    let Some(positions) = attribute(Semantic::Positions) else {
        return Err(format!("{what} has no positions"));
    };
    let part = |name: &str| format!("{name} of {what}");
    let positions: Vec<Vec3> = vectors(document.floats::<3>(positions, &part("POSITION"))?);
    let count = positions.len();
    let same = |have: usize, name: &str| {
        if have == count {
            Ok(())
        } else {
            Err(format!(
                "{name} of {what} has {have} elements for {count} positions"
            ))
        }
    };

    let corners: Vec<u32> = match primitive.indices {
        Some(index) => {
            let indices = document.integers::<1>(index, &part("the indices"))?;
            indices.into_iter().map(|[i]| i).collect()
        }
        None => (0..count as u32).collect(),
    };
    if let Some(bad) = corners.iter().find(|c| **c as usize >= count) {
        return Err(format!("{what} names vertex {bad} but has {count}"));
    }
    let triangles = assemble(mode, &corners);
    document.spend(triangles.len(), what)?;

    let mut mesh = Mesh {
        positions,
        ..Mesh::default()
    };
    if let Some(index) = attribute(Semantic::Normals) {
        mesh.normals = vectors(document.floats::<3>(index, &part("NORMAL"))?);
        same(mesh.normals.len(), "NORMAL")?;
    }
    if let Some(index) = attribute(Semantic::Tangents) {
        let tangents = document.floats::<4>(index, &part("TANGENT"))?;
        mesh.tangents = tangents.into_iter().map(Vec4::from).collect();
        same(mesh.tangents.len(), "TANGENT")?;
    }
    for set in scene.materials[material].textures().map(|t| t.set) {
        let name = format!("TEXCOORD_{set}");
        let Some(index) = attribute(Semantic::TexCoords(set as u32)) else {
            let material = &scene.materials[material].name;
            let text = format!(
                "a mesh of material {material} has no {name}, so its textures that are read by it are left out there"
            );
            if !scene.warnings.contains(&text) {
                scene.warnings.push(text);
            }
            continue;
        };
        if mesh.uvs.get(set).is_some_and(|uvs| !uvs.is_empty()) {
            continue;
        }
        let uvs = document.floats::<2>(index, &part(&name))?;
        same(uvs.len(), &name)?;
        mesh.uvs.resize_with(mesh.uvs.len().max(set + 1), Vec::new);
        mesh.uvs[set] = uvs.into_iter().map(Vec2::from).collect();
    }
    if let Some(index) = attribute(Semantic::Colors(0)) {
        mesh.colors = read_colors(document, index, &part("COLOR_0"))?;
        same(mesh.colors.len(), "COLOR_0")?;
    }
    read_skinning(document, primitive, &mut mesh, count, what)?;
    for (t, target) in primitive.targets.iter().flatten().enumerate() {
        document.spend(count, what)?;
        let what = format!("morph target {t} of {what}");
        let mut out = MorphTarget {
            positions: match target.positions {
                Some(index) => vectors(document.floats::<3>(index, &what)?),
                None => vec![Vec3::ZERO; count],
            },
            normals: match target.normals {
                Some(index) => vectors(document.floats::<3>(index, &what)?),
                None => Vec::new(),
            },
        };
        if mesh.normals.is_empty() {
            // Displacements of normals that are not there mean nothing.
            out.normals.clear();
        }
        if out.positions.len() != count || !(out.normals.is_empty() || out.normals.len() == count) {
            return Err(format!(
                "{what} has another number of elements than its mesh"
            ));
        }
        mesh.morph_targets.push(out);
    }

    let all = triangles.len();
    mesh.triangles = triangles;
    normals::drop_degenerate(&mut mesh);
    mesh.dropped_triangles = all - mesh.triangles.len();
    document.spend(count.min(mesh.triangles.len() * 3), what)?;
    normals::compact(&mut mesh);
    if mesh.normals.is_empty() {
        document.spend(mesh.triangles.len() * 3, what)?;
        normals::make_flat(&mut mesh);
    } else {
        normals::mend(&mut mesh);
    }
    Ok(Some(mesh))
}

/// Vertex colours of three or four components as linear RGBA, kept in 0..=1.
fn read_colors(
    document: &Document,
    index: json::Index<json::Accessor>,
    what: &str,
) -> Read<Vec<Vec4>> {
    let accessor = get(&document.root.accessors, index, "accessor")?;
    let colors: Vec<Vec4> = match accessor.type_ {
        Checked::Valid(json::accessor::Type::Vec3) => vectors(document.floats::<3>(index, what)?)
            .into_iter()
            .map(|rgb| rgb.extend(1.0))
            .collect(),
        _ => {
            let rgba = document.floats::<4>(index, what)?;
            rgba.into_iter().map(Vec4::from).collect()
        }
    };
    Ok(colors
        .into_iter()
        .map(|c| c.clamp(Vec4::ZERO, Vec4::ONE))
        .collect())
}

fn vectors(values: Vec<[f32; 3]>) -> Vec<Vec3> {
    values.into_iter().map(Vec3::from).collect()
}

/// Triangles out of a list, strip or fan (glTF 2.0, section 3.7.2.1).
fn assemble(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                }
            })
            .collect(),
        Mode::TriangleFan => match corners.split_first() {
            Some((hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], *hub]).collect(),
            None => Vec::new(),
        },
        _ => corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect(),
    }
}

/// Reads joints and weights. Of up to eight influences the four strongest stay; weights are
/// brought to a sum of 1.
fn read_skinning(
    document: &Document,
    primitive: &Primitive,
    mesh: &mut Mesh,
    count: usize,
    what: &str,
) -> Read<()> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mut influences: Vec<Vec<(f32, u16)>> = Vec::new();
    for set in 0..2 {
        let (Some(joints), Some(weights)) = (
            attribute(Semantic::Joints(set)),
            attribute(Semantic::Weights(set)),
        ) else {
            break;
        };
        let joints = document.integers::<4>(joints, &format!("JOINTS_{set} of {what}"))?;
        let weights = document.floats::<4>(weights, &format!("WEIGHTS_{set} of {what}"))?;
        if joints.len() != count || weights.len() != count {
            return Err(format!(
                "JOINTS_{set} or WEIGHTS_{set} of {what} has another count than its positions"
            ));
        }
        influences.resize(count, Vec::new());
        for (out, (joints, weights)) in influences.iter_mut().zip(joints.iter().zip(&weights)) {
            for (joint, weight) in joints.iter().zip(weights) {
                let Ok(joint) = u16::try_from(*joint) else {
                    return Err(format!("{what} names joint {joint}"));
                };
                if *weight < 0.0 {
                    return Err(format!("{what} has a negative weight"));
                }
                if *weight > 0.0 {
                    out.push((*weight, joint));
                }
            }
        }
    }
    for mut list in influences {
        // Stable, so that equal weights keep the file's order.
        list.sort_by(|a, b| b.0.total_cmp(&a.0));
        list.truncate(4);
        let sum: f32 = list.iter().map(|(w, _)| w).sum();
        let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
        for (i, (weight, joint)) in list.iter().enumerate() {
            joints[i] = *joint;
            weights[i] = weight / sum;
        }
        if list.is_empty() || !sum.is_finite() {
            (joints, weights) = ([0; 4], [1.0, 0.0, 0.0, 0.0]);
        }
        mesh.joints.push(joints);
        mesh.weights.push(Vec4::from(weights));
    }
    Ok(())
}

/// Appends a primitive. An attribute that only some primitives have is filled in for the others.
fn append(mesh: &mut Mesh, part: Mesh, what: &str) -> Read<()> {
    let (before, added) = (mesh.positions.len(), part.positions.len());
    let after = before + added;
    let Ok(base) = u32::try_from(before) else {
        return Err(format!("{what} makes its mesh too large"));
    };
    if u32::try_from(after).is_err() {
        return Err(format!("{what} makes its mesh too large"));
    }
    if before > 0 && mesh.joints.is_empty() != part.joints.is_empty() && added > 0 {
        return Err(format!(
            "{what} differs from the first primitive in having joints or not"
        ));
    }
    fn join<T: Clone>(to: &mut Vec<T>, from: Vec<T>, before: usize, after: usize, fill: T) {
        if !(to.is_empty() && from.is_empty()) {
            to.resize(before, fill.clone());
            to.extend(from);
            to.resize(after, fill);
        }
    }
    mesh.positions.extend(part.positions);
    mesh.normals.extend(part.normals);
    let sets = mesh.uvs.len().max(part.uvs.len());
    mesh.uvs.resize_with(sets, Vec::new);
    for (set, from) in mesh.uvs.iter_mut().zip(part.uvs) {
        join(set, from, before, after, Vec2::ZERO);
    }
    join(&mut mesh.colors, part.colors, before, after, Vec4::ONE);
    join(&mut mesh.tangents, part.tangents, before, after, Vec4::ZERO);
    mesh.joints.extend(part.joints);
    mesh.weights.extend(part.weights);
    mesh.morph_targets.resize_with(
        mesh.morph_targets.len().max(part.morph_targets.len()),
        MorphTarget::default,
    );
    let targets = mesh.morph_targets.iter_mut().zip(part.morph_targets);
    for (target, from) in targets {
        join(
            &mut target.positions,
            from.positions,
            before,
            after,
            Vec3::ZERO,
        );
        join(&mut target.normals, from.normals, before, after, Vec3::ZERO);
    }
    mesh.triangles
        .extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
    mesh.materials.extend(part.materials);
    mesh.dropped_triangles += part.dropped_triangles;
    Ok(())
}
