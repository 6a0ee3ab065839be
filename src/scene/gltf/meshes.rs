//! Meshes: the primitives of each are put together into one triangle list.

use super::hierarchy::Order;
use super::{DRACO, Document, Read, clean_name, conversion, get};
use crate::scene::{FileMesh, FilePrimitive, FoliageWord, Mesh, MorphTarget, Scene, normals};
use ::gltf::json;
use glam::{Vec2, Vec3, Vec4};
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

/// Fills `scene.meshes` with those meshes that shown nodes use and that have triangles; gives the
/// scene's index for each of the file's.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) -> Vec<Option<usize>> {
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
        let mesh = read_mesh(document, i, scene);
        scene.dropped_triangles += mesh.dropped_triangles;
        if mesh.triangles.is_empty() {
            indices.push(None);
        } else {
            indices.push(Some(scene.meshes.len()));
            scene.meshes.push(mesh);
        }
    }
    indices
}

fn read_mesh(document: &Document, index: usize, scene: &mut Scene) -> Mesh {
    let source = &document.root.meshes[index];
    let mut mesh = Mesh {
        name: clean_name(source.name.as_ref(), "mesh", index),
        morph_weights: source.weights.clone().unwrap_or_default(),
        file: Some(FileMesh {
            mesh: index,
            primitives: Vec::new(),
        }),
        ..Mesh::default()
    };
    mesh.foliage = foliage(document, &source.extras, &mesh.name);
    if mesh.morph_weights.iter().any(|w| !w.is_finite()) {
        document.warn(format!(
            "the morph weights of mesh {} are not finite; they were left out",
            mesh.name
        ));
        mesh.morph_weights.clear();
    }
    for (p, primitive) in source.primitives.iter().enumerate() {
        let what = format!("primitive {p} of mesh {}", mesh.name);
        let material = primitive.material.and_then(|material| {
            let known = get(&document.root.materials, material, "material");
            let known = known.map_err(|e| format!("the material of {what}: {e}"));
            document.optional(known).map(|_| material.value())
        });
        let material = material.unwrap_or(document.root.materials.len());
        let part = read_primitive(document, primitive, material, &what, scene);
        let Some(mut part) = document.geometry(part) else {
            continue;
        };
        if let Some(texture) = scene.materials[material].normal_texture
            && part.tangents.is_empty()
        {
            normals::generate_tangents(&mut part, &texture);
        }
        part.materials = vec![material as u32; part.triangles.len()];
        document.geometry(append(document, &mut mesh, part, p, &what));
    }
    mesh.morph_weights.resize(mesh.morph_targets.len(), 0.0);
    mesh
}

/// What the extras of a mesh say of foliage.
fn foliage(document: &Document, extras: &json::Extras, name: &str) -> Option<FoliageWord> {
    let value: json::Value = json::deserialize::from_str(extras.as_ref()?.get()).ok()?;
    match value.get("foliage")?.as_str() {
        Some("shrub") => Some(FoliageWord::Shrub),
        Some("tree") => Some(FoliageWord::Tree),
        Some("none") => Some(FoliageWord::None),
        None if value["foliage"].is_null() => None,
        _ => {
            document.warn(format!(
                "extras.foliage of mesh {name} is none of shrub, tree and none; it was left out"
            ));
            None
        }
    }
}

/// One primitive as a mesh of its own. Optional attributes that cannot be used are left out, and so
/// are triangles whose corners are not there.
fn read_primitive(
    document: &Document,
    primitive: &Primitive,
    material: usize,
    what: &str,
    scene: &mut Scene,
) -> Read<Mesh> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mode = match &primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => *mode,
        Checked::Valid(_) => return Err(format!("{what} draws points or lines, not triangles")),
        Checked::Invalid => return Err(format!("{what} has an unknown mode")),
    };
    let Some(positions) = attribute(Semantic::Positions) else {
        return Err(format!("{what} has no positions"));
    };
    refuse_draco(document, primitive, positions, what)?;
    let part = |name: &str| format!("{name} of {what}");
    let mut positions = vectors(document.numbers::<3>(positions, &part("POSITION"))?);
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
    let mut triangles = assemble(mode, &corners);
    document.spend(triangles.len(), what)?;
    keep_whole(document, &mut triangles, &mut positions, what)?;

    let mut mesh = Mesh {
        positions,
        file_vertices: (0..count as u32).collect(),
        ..Mesh::default()
    };
    if let Some(index) = attribute(Semantic::Normals) {
        // Normals of no length are made from the faces below.
        let normals = document
            .floats_or::<3>(index, &part("NORMAL"), [0.0; 3])
            .and_then(|normals| same(normals.len(), "NORMAL").map(|()| vectors(normals)));
        mesh.normals = document.optional(normals).unwrap_or_default();
    }
    if let Some(index) = attribute(Semantic::Tangents) {
        let tangents = document
            .floats::<4>(index, &part("TANGENT"))
            .and_then(|tangents| same(tangents.len(), "TANGENT").map(|()| tangents));
        let tangents = document.optional(tangents).unwrap_or_default();
        mesh.tangents = tangents.into_iter().map(Vec4::from).collect();
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
        let uvs = document
            .floats_or::<2>(index, &part(&name), [0.0; 2])
            .and_then(|uvs| same(uvs.len(), &name).map(|()| uvs));
        let Some(uvs) = document.optional(uvs) else {
            continue;
        };
        mesh.uvs.resize_with(mesh.uvs.len().max(set + 1), Vec::new);
        mesh.uvs[set] = uvs.into_iter().map(Vec2::from).collect();
    }
    for (semantic, index) in &primitive.attributes {
        // Read by no texture, but what is wrong with them is said all the same.
        if let Checked::Valid(Semantic::TexCoords(set)) = semantic
            && mesh.uvs.get(*set as usize).is_none_or(Vec::is_empty)
        {
            let name = format!("TEXCOORD_{set}");
            let uvs = document.floats_or::<2>(*index, &part(&name), [0.0; 2]);
            document.optional(uvs.and_then(|uvs| same(uvs.len(), &name)));
        }
    }
    if let Some(index) = attribute(Semantic::Colors(0)) {
        let colors = read_colors(document, index, &part("COLOR_0"))
            .and_then(|colors| same(colors.len(), "COLOR_0").map(|()| colors));
        mesh.colors = document.optional(colors).unwrap_or_default();
    }
    if let Some((joints, weights)) =
        document.optional(read_skinning(document, primitive, count, what))
    {
        (mesh.joints, mesh.weights) = (joints, weights);
    }
    for (t, target) in primitive.targets.iter().flatten().enumerate() {
        document.spend(count, what)?;
        let what = format!("morph target {t} of {what}");
        let displacements = |index| -> Option<Vec<Vec3>> {
            let values = document.floats_or::<3>(index?, &what, [0.0; 3]);
            let values = values.map(vectors).and_then(|values| match values.len() {
                n if n == count => Ok(values),
                n => Err(format!("{what} has {n} elements for {count} positions")),
            });
            document.optional(values)
        };
        let positions = displacements(target.positions);
        mesh.morph_targets.push(MorphTarget {
            positions: positions.unwrap_or_else(|| vec![Vec3::ZERO; count]),
            // Displacements of normals that are not there mean nothing.
            normals: match mesh.normals.is_empty() {
                true => Vec::new(),
                false => displacements(target.normals).unwrap_or_default(),
            },
        });
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
        normals::repair(&mut mesh);
    }
    Ok(mesh)
}

/// Draco replaces the data of the accessors, which then have none of their own.
fn refuse_draco(
    document: &Document,
    primitive: &Primitive,
    positions: json::Index<json::Accessor>,
    what: &str,
) -> Read<()> {
    let extensions = primitive.extensions.as_ref();
    let is_draco = extensions.is_some_and(|e| e.others.contains_key(DRACO));
    let accessor = get(&document.root.accessors, positions, "accessor")?;
    if is_draco && accessor.buffer_view.is_none() && accessor.sparse.is_none() {
        return Err(format!(
            "{what} is compressed with {DRACO}, which is not supported{}",
            conversion(DRACO)
        ));
    }
    Ok(())
}

/// Drops triangles that name vertices which are not there or have no finite position.
fn keep_whole(
    document: &Document,
    triangles: &mut Vec<[u32; 3]>,
    positions: &mut [Vec3],
    what: &str,
) -> Read<()> {
    let all = triangles.len();
    let is_whole = |corner: &u32| {
        let position = positions.get(*corner as usize);
        position.is_some_and(|p| p.is_finite())
    };
    let first_bad = triangles.iter().flatten().find(|c| !is_whole(c)).copied();
    if let Some(corner) = first_bad {
        triangles.retain(|t| t.iter().all(is_whole));
        let reason = match positions.get(corner as usize) {
            Some(_) => format!("vertex {corner}, whose position is not finite"),
            None => format!("vertex {corner} of {}", positions.len()),
        };
        let text = format!(
            "{} of {all} triangles of {what} name vertices that are not there (the first {reason})",
            all - triangles.len()
        );
        if triangles.is_empty() {
            return Err(text);
        }
        document.geometry(Err::<(), _>(text));
    }
    for position in positions.iter_mut().filter(|p| !p.is_finite()) {
        *position = Vec3::ZERO;
    }
    Ok(())
}

/// Vertex colours of three or four components as linear RGBA, kept in 0..=1.
fn read_colors(
    document: &Document,
    index: json::Index<json::Accessor>,
    what: &str,
) -> Read<Vec<Vec4>> {
    let accessor = get(&document.root.accessors, index, "accessor")?;
    let colors: Vec<Vec4> = match accessor.type_ {
        Checked::Valid(json::accessor::Type::Vec3) => {
            vectors(document.floats_or::<3>(index, what, [1.0; 3])?)
                .into_iter()
                .map(|rgb| rgb.extend(1.0))
                .collect()
        }
        _ => {
            let rgba = document.floats_or::<4>(index, what, [1.0; 4])?;
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

/// Weights below this are more than the rounding of exporters.
const NEGATIVE_WEIGHT: f32 = -1e-3;

/// Reads joints and weights; both are empty where the primitive has none. Of up to eight influences
/// the four strongest stay; negative weights count as 0, and weights are brought to a sum of 1.
fn read_skinning(
    document: &Document,
    primitive: &Primitive,
    count: usize,
    what: &str,
) -> Read<(Vec<[u16; 4]>, Vec<Vec4>)> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mut influences: Vec<Vec<(f32, u16)>> = Vec::new();
    let mut lowest = 0.0f32;
    for set in 0..2 {
        let (Some(joints), Some(weights)) = (
            attribute(Semantic::Joints(set)),
            attribute(Semantic::Weights(set)),
        ) else {
            break;
        };
        let joints = document.integers::<4>(joints, &format!("JOINTS_{set} of {what}"))?;
        let weights =
            document.floats_or::<4>(weights, &format!("WEIGHTS_{set} of {what}"), [0.0; 4])?;
        if joints.len() != count || weights.len() != count {
            return Err(format!(
                "JOINTS_{set} or WEIGHTS_{set} of {what} has another count than its positions"
            ));
        }
        influences.resize(count, Vec::new());
        for (out, (joints, weights)) in influences.iter_mut().zip(joints.iter().zip(&weights)) {
            for (joint, weight) in joints.iter().zip(weights) {
                lowest = lowest.min(*weight);
                if *weight > 0.0 {
                    let Ok(joint) = u16::try_from(*joint) else {
                        return Err(format!("{what} names joint {joint}"));
                    };
                    out.push((*weight, joint));
                }
            }
        }
    }
    if lowest < NEGATIVE_WEIGHT {
        document.warn(format!(
            "{what} has negative weights (down to {lowest}); they count as 0"
        ));
    }
    let (mut all_joints, mut all_weights) = (Vec::new(), Vec::new());
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
            (joints, weights) = ([0; 4], Vec4::X.to_array());
        }
        all_joints.push(joints);
        all_weights.push(Vec4::from(weights));
    }
    Ok((all_joints, all_weights))
}

/// Appends primitive `index`. An attribute that only some primitives have is filled in for the others.
fn append(
    document: &Document,
    mesh: &mut Mesh,
    mut part: Mesh,
    index: usize,
    what: &str,
) -> Read<()> {
    let (before, added) = (mesh.positions.len(), part.positions.len());
    let after = before + added;
    let Ok(base) = u32::try_from(before) else {
        return Err(format!("{what} makes its mesh too large"));
    };
    if u32::try_from(after).is_err() {
        return Err(format!("{what} makes its mesh too large"));
    }
    if before > 0 && added > 0 && mesh.joints.is_empty() != part.joints.is_empty() {
        document.warn(format!(
            "{what} differs from the primitives before it in having joints or not; those without \
             follow the first joint of a skin"
        ));
    }
    if before > 0 && added > 0 && mesh.morph_targets.len() != part.morph_targets.len() {
        document.warn(format!(
            "{what} has {} morph targets, the primitives before it {}; those it lacks do not move it",
            part.morph_targets.len(),
            mesh.morph_targets.len()
        ));
    }
    fn join<T: Clone>(to: &mut Vec<T>, from: Vec<T>, before: usize, after: usize, fill: T) {
        if !(to.is_empty() && from.is_empty()) {
            to.resize(before, fill.clone());
            to.extend(from);
            to.resize(after, fill);
        }
    }
    if let Some(file) = mesh.file.as_mut().filter(|_| added > 0) {
        file.primitives.push(FilePrimitive {
            primitive: index,
            vertices: before..after,
        });
    }
    mesh.file_vertices.extend(part.file_vertices);
    mesh.positions.extend(part.positions);
    mesh.normals.extend(part.normals);
    let sets = mesh.uvs.len().max(part.uvs.len());
    mesh.uvs.resize_with(sets, Vec::new);
    part.uvs.resize_with(sets, Vec::new);
    for (set, from) in mesh.uvs.iter_mut().zip(part.uvs) {
        join(set, from, before, after, Vec2::ZERO);
    }
    join(&mut mesh.colors, part.colors, before, after, Vec4::ONE);
    join(&mut mesh.tangents, part.tangents, before, after, Vec4::ZERO);
    join(&mut mesh.joints, part.joints, before, after, [0; 4]);
    join(&mut mesh.weights, part.weights, before, after, Vec4::X);
    let targets = mesh.morph_targets.len().max(part.morph_targets.len());
    mesh.morph_targets
        .resize_with(targets, MorphTarget::default);
    part.morph_targets
        .resize_with(targets, MorphTarget::default);
    let targets = mesh.morph_targets.iter_mut().zip(part.morph_targets);
    for (target, from) in targets {
        let positions = &mut target.positions;
        positions.resize(before, Vec3::ZERO);
        join(positions, from.positions, before, after, Vec3::ZERO);
        positions.resize(after, Vec3::ZERO);
        join(&mut target.normals, from.normals, before, after, Vec3::ZERO);
    }
    mesh.triangles
        .extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
    mesh.materials.extend(part.materials);
    mesh.dropped_triangles += part.dropped_triangles;
    Ok(())
}
