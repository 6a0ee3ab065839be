//! Small meshes for the tests of bakes.

use crate::scene::{Instance, Material, Mesh, Pose, Scene};
use glam::{Affine3A, Vec3};

/// A mesh of material 0 with the normals of its faces, each face with vertices of its own.
pub fn faceted(faces: &[[Vec3; 3]]) -> Mesh {
    let positions: Vec<Vec3> = faces.iter().flatten().copied().collect();
    let normals = faces
        .iter()
        .flat_map(|[a, b, c]| [(b - a).cross(c - a).normalize_or(Vec3::Y); 3])
        .collect();
    let triangles = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Mesh {
        triangles: triangles.collect(),
        materials: vec![0; faces.len()],
        positions,
        normals,
        ..Mesh::default()
    }
}

/// A mesh of material 0 with shared vertices and one normal for all of them.
pub fn flat(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, normal: Vec3) -> Mesh {
    Mesh {
        normals: vec![normal; positions.len()],
        materials: vec![0; triangles.len()],
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// A square of `cells` x `cells` cells in the XZ plane, its corner at `corner`, facing +Y.
pub fn floor(corner: Vec3, size: f32, cells: u32) -> Mesh {
    let n = cells + 1;
    let at = |i: u32| i as f32 / cells as f32 * size;
    let positions = (0..n * n)
        .map(|i| corner + Vec3::new(at(i % n), 0.0, at(i / n)))
        .collect();
    let triangles = (0..cells * cells)
        .flat_map(|i| {
            let a = i / cells * n + i % cells;
            [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]
        })
        .collect();
    flat(positions, triangles, Vec3::Y)
}

/// The six faces of a box, facing outwards.
pub fn cuboid(min: Vec3, max: Vec3) -> Mesh {
    let corner = |i: usize| {
        Vec3::new(
            [min.x, max.x][i & 1],
            [min.y, max.y][i >> 1 & 1],
            [min.z, max.z][i >> 2],
        )
    };
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    faceted(&faces.map(|f| f.map(corner)))
}

/// The same mesh seen from the other side.
pub fn inside_out(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    mesh
}

/// A scene of these meshes where they are, each an instance.
pub fn scene(meshes: Vec<Mesh>) -> (Scene, Pose) {
    let count = meshes.len();
    let instances = (0..count)
        .map(|mesh| Instance {
            name: format!("{mesh}"),
            mesh,
            ..Instance::default()
        })
        .collect();
    let scene = Scene {
        meshes,
        materials: vec![Material::default()],
        instances,
        ..Scene::default()
    };
    let pose = Pose {
        world_from_mesh: vec![Affine3A::IDENTITY; count],
        deformed: vec![None; count],
        ..Pose::default()
    };
    (scene, pose)
}
