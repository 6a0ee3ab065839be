//! Which meshes are foliage.

use crate::scene::{Alpha, Pose, Scene};
use crate::trace::Aabb;

/// Height of the median instance, in metres, from which foliage by its material is a tree.
const TREE_HEIGHT: f32 = 2.0;

/// Instances from which a mesh may be foliage by its material: decorators stand about in numbers, while
/// the one chain or curtain with holes in its texture is an object like others.
const SEVERAL: usize = 2;

/// How foliage attenuates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// As a box of a density.
    Shrub,
    /// By half at each triangle.
    Tree,
}

/// Why a mesh is of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The file says so.
    Extras,
    /// Its name matches a pattern.
    Name,
    /// Most of it is MASK or BLEND.
    Material,
}

/// What a mesh was taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdict {
    pub kind: Kind,
    pub reason: Reason,
}

/// How foliage is told from other meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// Patterns of names of meshes, or of paths of instances, that are shrubs. `*` stands for any text; case does not
    /// count.
    pub shrubs: Vec<String>,
    /// The same for trees.
    pub trees: Vec<String>,
    /// Whether materials tell, where extras and names do not.
    pub by_material: bool,
}

impl Default for Rules {
    /// No names; materials tell.
    fn default() -> Self {
        Rules {
            shrubs: Vec::new(),
            trees: Vec::new(),
            by_material: true,
        }
    }
}

/// What each mesh is taken for; `None` for what stops rays. The first of these that says something decides:
///
/// 1. The mesh's `extras.foliage` in the file: "shrub", "tree" or "none".
/// 2. The name of the mesh, or the path of any of its instances: shrubs before trees.
/// 3. Its material: at least half of its area is MASK or BLEND, and there are at least two instances. It
///    is a tree where its median instance is 2 m high or more, else a shrub.
///
/// Meshes without an instance that may be placed are nothing; neither are deformed ones.
pub fn classify(scene: &Scene, pose: &Pose, rules: &Rules) -> Vec<Option<Verdict>> {
    let mut instances = vec![Vec::new(); scene.meshes.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        if !scene.is_deformed_instance(index) && pose.world_from_mesh[index].is_finite() {
            instances[instance.mesh].push(index);
        }
    }
    let numbered = instances.iter().enumerate();
    numbered
        .map(|(mesh, instances)| {
            if instances.is_empty() {
                return None;
            }
            if let Some(word) = scene.meshes[mesh].foliage {
                let reason = Reason::Extras;
                return kind_of(word).map(|kind| Verdict { kind, reason });
            }
            let named = |patterns: &[String]| {
                let matches = |name: &str| patterns.iter().any(|p| matches(p, name));
                let mut paths = instances.iter().map(|i| &scene.instances[*i].name);
                matches(&scene.meshes[mesh].name) || paths.any(|path| matches(path))
            };
            let by_name = [(Kind::Shrub, &rules.shrubs), (Kind::Tree, &rules.trees)];
            let found = by_name.into_iter().find(|(_, patterns)| named(patterns));
            if let Some((kind, _)) = found {
                let reason = Reason::Name;
                return Some(Verdict { kind, reason });
            }
            let leafy = rules.by_material && instances.len() >= SEVERAL && is_leafy(scene, mesh);
            leafy.then(|| Verdict {
                kind: match median_height(scene, pose, instances) >= TREE_HEIGHT {
                    true => Kind::Tree,
                    false => Kind::Shrub,
                },
                reason: Reason::Material,
            })
        })
        .collect()
}

/// What a file's word stands for.
fn kind_of(word: crate::scene::FoliageWord) -> Option<Kind> {
    use crate::scene::FoliageWord;
    match word {
        FoliageWord::Shrub => Some(Kind::Shrub),
        FoliageWord::Tree => Some(Kind::Tree),
        FoliageWord::None => None,
    }
}

/// Whether at least half of a mesh's area has materials with holes or blending. Windows are glass.
fn is_leafy(scene: &Scene, mesh: usize) -> bool {
    let mesh = &scene.meshes[mesh];
    let (mut leafy, mut total) = (0.0, 0.0);
    for (triangle, material) in mesh.triangles.iter().zip(&mesh.materials) {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        let area = (b - a).cross(c - a).length();
        let Some(material) = scene.materials.get(*material as usize) else {
            continue;
        };
        total += area;
        if material.alpha != Alpha::Opaque && !material.window {
            leafy += area;
        }
    }
    leafy > 0.0 && leafy >= 0.5 * total
}

/// Metres.
fn median_height(scene: &Scene, pose: &Pose, instances: &[usize]) -> f32 {
    let height = |i: &usize| {
        let bounds = Aabb::of(
            scene.meshes[scene.instances[*i].mesh]
                .positions
                .iter()
                .copied(),
        );
        let bounds = bounds.transformed(&pose.world_from_mesh[*i]);
        bounds.max.y - bounds.min.y
    };
    let mut heights: Vec<f32> = instances.iter().map(height).collect();
    heights.sort_by(f32::total_cmp);
    heights[heights.len() / 2]
}

/// Whether a pattern, in which `*` stands for any text, is all of a name. Case does not count.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name) = (pattern.to_lowercase(), name.to_lowercase());
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else {
        return false;
    };
    let mut parts = parts.peekable();
    if parts.peek().is_none() {
        return rest.is_empty();
    }
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            return rest.ends_with(part);
        }
        // The earliest place leaves the most for what follows.
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obscurance::shapes::{cuboid, floor, scene};
    use crate::scene::{FoliageWord, Instance, Material};
    use glam::{Affine3A, Vec3};

    #[test]
    fn patterns_match_whole_names() {
        for (pattern, name, expected) in [
            ("bush", "Bush", true),
            ("bush", "bush_1", false),
            ("bush*", "bush_1", true),
            ("*bush", "a/Bush", true),
            ("*bush*leaf*", "a/bush_1/leaf_2", true),
            ("*leaf*bush*", "a/bush_1/leaf_2", false),
            ("*", "", true),
            ("a*a", "a", false),
            ("", "", true),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }

    /// Two instances of each of: low leaves, high leaves, stone; and one curtain of leaves.
    fn garden() -> (Scene, Pose) {
        let leaves = |height: f32| {
            let mut mesh = cuboid(Vec3::ZERO, Vec3::new(1.0, height, 1.0));
            mesh.materials.fill(1);
            mesh.name = format!("leaves {height}");
            mesh
        };
        let meshes = vec![
            leaves(0.5),
            leaves(5.0),
            floor(Vec3::ZERO, 1.0, 1),
            leaves(3.0),
        ];
        let (mut scene, mut pose) = scene(meshes);
        scene.materials.push(Material {
            alpha: Alpha::Mask { cutoff: 0.5 },
            ..Material::default()
        });
        for mesh in 0..3 {
            scene.instances.push(Instance {
                name: format!("again/{mesh}"),
                mesh,
                ..Instance::default()
            });
            pose.world_from_mesh
                .push(Affine3A::from_translation(Vec3::X));
            pose.deformed.push(None);
        }
        (scene, pose)
    }

    fn verdict(kind: Kind, reason: Reason) -> Option<Verdict> {
        Some(Verdict { kind, reason })
    }

    #[test]
    fn materials_tell_foliage_that_stands_about() {
        let (scene, pose) = garden();
        let found = classify(&scene, &pose, &Rules::default());
        let by = Reason::Material;
        assert_eq!(
            found,
            [
                verdict(Kind::Shrub, by),
                verdict(Kind::Tree, by),
                None,
                None
            ]
        );
        let off = Rules {
            by_material: false,
            ..Rules::default()
        };
        assert_eq!(classify(&scene, &pose, &off), [None; 4]);
    }

    #[test]
    fn extras_come_before_names_and_names_before_materials() {
        let (mut scene, pose) = garden();
        let rules = Rules {
            shrubs: vec!["*again/1".into()],
            trees: vec!["leaves 3".into(), "*2".into()],
            by_material: true,
        };
        scene.meshes[0].foliage = Some(FoliageWord::None);
        scene.meshes[2].foliage = Some(FoliageWord::Shrub);
        assert_eq!(
            classify(&scene, &pose, &rules),
            [
                None,
                verdict(Kind::Shrub, Reason::Name),
                verdict(Kind::Shrub, Reason::Extras),
                verdict(Kind::Tree, Reason::Name)
            ]
        );
    }
}
