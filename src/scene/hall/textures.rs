//! Procedural textures of the built-in scene.

use super::shapes::random;
use crate::scene::Texture;
use glam::Vec3;

const FLOOR_SIZE: u32 = 256;
/// Tiles along each side of the floor texture.
const TILES: u32 = 4;

fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    Texture {
        width,
        height,
        texels: texels.map(|(x, y)| texel(x, y)).collect(),
        ..Texture::default()
    }
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Which tile a floor texel is on, and how far from the tile's edge it is, 0..0.5 of a tile.
fn tile(x: u32, y: u32) -> (i32, i32, f32) {
    let side = FLOOR_SIZE / TILES;
    let inside = |v: u32| {
        let f = ((v % side) as f32 + 0.5) / side as f32;
        f.min(1.0 - f)
    };
    (
        (x / side) as i32,
        (y / side) as i32,
        inside(x).min(inside(y)),
    )
}

/// Floor tiles: sRGB colour.
pub(super) fn floor_color() -> Texture {
    texture(FLOOR_SIZE, FLOOR_SIZE, |x, y| {
        let (i, j, edge) = tile(x, y);
        let tint = random(i, j, 7);
        let grain = random(x as i32, y as i32, 3) * 0.05;
        let base = if (i + j) % 2 == 0 {
            Vec3::new(0.72, 0.62, 0.52)
        } else {
            Vec3::new(0.60, 0.46, 0.38)
        };
        let shade = if edge < 0.03 {
            0.62
        } else {
            0.9 + 0.12 * tint + grain
        };
        let c = base * shade;
        [byte(c.x), byte(c.y), byte(c.z), 255]
    })
}

/// Floor tiles: bevelled, each slightly tilted and slightly rough.
pub(super) fn floor_normals() -> Texture {
    let side = (FLOOR_SIZE / TILES) as f32;
    let height = |x: u32, y: u32| {
        let (x, y) = (x % FLOOR_SIZE, y % FLOOR_SIZE);
        let (i, j, edge) = tile(x, y);
        let bevel = (edge / 0.07).min(1.0);
        let tilt = |axis: i32, v: u32| {
            (random(i, j, 11 + axis) - 0.5) * 0.05 * ((v as f32 % side) - side * 0.5)
        };
        let rough = (random(x as i32, y as i32, 5) - 0.5) * 0.12;
        1.6 * (bevel * (2.0 - bevel)) + tilt(0, x) + tilt(1, y) + rough
    };
    texture(FLOOR_SIZE, FLOOR_SIZE, |x, y| {
        let last = FLOOR_SIZE - 1;
        let dx = height(x + 1, y) - height(x + last, y);
        let dy = height(x, y + 1) - height(x, y + last);
        // +Y is up in the map, against the rows.
        let n = Vec3::new(-dx * 0.5, dy * 0.5, 1.0).normalize();
        [
            byte(n.x * 0.5 + 0.5),
            byte(n.y * 0.5 + 0.5),
            byte(n.z * 0.5 + 0.5),
            255,
        ]
    })
}

/// A lattice of bars with holes between.
pub(super) fn grating() -> Texture {
    texture(32, 32, |x, y| {
        let bar = x < 6 || y < 6;
        [64, 58, 52, if bar { 255 } else { 0 }]
    })
}

/// A fern frond; the stem runs up the middle.
pub(super) fn frond() -> Texture {
    texture(128, 128, |x, y| {
        let across = ((x as f32 + 0.5) / 64.0 - 1.0).abs();
        let up = 1.0 - (y as f32 + 0.5) / 128.0;
        let reach = (std::f32::consts::PI * up.powf(0.7)).sin().max(0.0) * 0.95;
        let leaflet = (up * 13.0 - across * 2.2).rem_euclid(1.0) < 0.62;
        let opaque = (across < reach && leaflet) || (across < 0.05 && up < 0.97);
        let green = 0.42 + 0.22 * up + 0.08 * random(x as i32 / 4, y as i32 / 4, 9);
        [
            byte(green * 0.55),
            byte(green),
            byte(green * 0.3),
            if opaque { 255 } else { 0 },
        ]
    })
}
