//! What of BLEND and of transmitting materials is opaque, once meshes and their colours are known.

use crate::scene::{Alpha, Material, Mesh, Scene};

/// Alpha from which what is blended is opaque: 1 but for rounding.
const OPAQUE: f32 = 0.99;
/// Mean transmission from which a triangle is a window.
const WINDOW: f32 = 0.5;
/// Places along an edge of a triangle that its mean transmission is taken over.
const PLACES: usize = 4;

/// Decides for each material of the scene, by all meshes that use it.
pub(super) fn resolve(scene: &mut Scene) {
    blended(scene);
    windows(scene);
}

/// BLEND of alpha 1 everywhere (factor, texture and vertex colours) becomes OPAQUE. Where only some
/// is, texels of alpha 1 stay and the others are holes, as in a mask; where none is, it stays BLEND.
fn blended(scene: &mut Scene) {
    let mut ranges: Vec<Option<(f32, f32)>> = vec![None; scene.materials.len()];
    let of_textures: Vec<_> = scene
        .materials
        .iter()
        .map(|m| texture_range(scene, m))
        .collect();
    for mesh in &scene.meshes {
        for (triangle, m) in mesh.triangles.iter().zip(&mesh.materials) {
            let m = *m as usize;
            let material = &scene.materials[m];
            if material.alpha != Alpha::Blend {
                continue;
            }
            let (low, high) = match material.base_color_texture {
                Some(texture) if has_set(mesh, texture.set) => of_textures[m],
                _ => (1.0, 1.0),
            };
            let range = ranges[m].get_or_insert((f32::INFINITY, 0.0));
            for v in triangle {
                let vertex = mesh.colors.get(*v as usize).map_or(1.0, |c| c.w);
                let alpha = vertex * material.base_color.w;
                range.0 = range.0.min(low * alpha);
                range.1 = range.1.max(high * alpha);
            }
        }
    }
    for (material, range) in scene.materials.iter_mut().zip(ranges) {
        match range {
            Some((low, _)) if low >= OPAQUE => material.alpha = Alpha::Opaque,
            Some((_, high)) if high >= OPAQUE => material.alpha = Alpha::Mask { cutoff: OPAQUE },
            _ => {}
        }
    }
}

fn has_set(mesh: &Mesh, set: usize) -> bool {
    mesh.uvs.get(set).is_some_and(|uvs| !uvs.is_empty())
}

/// Least and greatest alpha of the base colour texture of a BLEND material.
fn texture_range(scene: &Scene, material: &Material) -> (f32, f32) {
    let texture = material.base_color_texture;
    let Some(texture) = texture.filter(|_| material.alpha == Alpha::Blend) else {
        return (1.0, 1.0);
    };
    let alphas = scene.textures[texture.texture].texels.iter().map(|t| t[3]);
    let (low, high) = alphas.fold((255, 0), |(l, h), a| (l.min(a), h.max(a)));
    (f32::from(low.min(high)) / 255.0, f32::from(high) / 255.0)
}

/// Marks materials that transmit at least [`WINDOW`]. Where a texture says how much, its triangles are
/// told apart by their means, and those that are windows get a material of their own.
fn windows(scene: &mut Scene) {
    let mut panes: Vec<Option<u32>> = vec![None; scene.materials.len()];
    for (m, pane_of) in panes.iter_mut().enumerate() {
        let material = &mut scene.materials[m];
        if material.transmission_texture.is_none() {
            material.window = material.transmission * (1.0 - material.metallic) >= WINDOW;
        } else if material.transmission >= WINDOW {
            let name = format!("{} (window)", material.name);
            let pane = Material {
                name,
                window: true,
                ..material.clone()
            };
            *pane_of = Some(scene.materials.len() as u32);
            scene.materials.push(pane);
        }
    }
    for i in 0..scene.meshes.len() {
        for t in 0..scene.meshes[i].triangles.len() {
            let m = scene.meshes[i].materials[t] as usize;
            if let Some(pane) = panes[m]
                && mean_transmission(scene, i, t) >= WINDOW
            {
                scene.meshes[i].materials[t] = pane;
            }
        }
    }
}

fn mean_transmission(scene: &Scene, mesh: usize, triangle: usize) -> f32 {
    let places = (0..PLACES).flat_map(|i| (0..PLACES - i).map(move |j| (i, j)));
    let at = |i: usize| (i as f32 + 1.0 / 3.0) / PLACES as f32;
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, j) in places {
        sum += scene.transmission(mesh, triangle, at(i), at(j));
        count += 1.0;
    }
    sum / count
}
