//! The octahedral map of a probe: directions of texels, and bilinear look-ups that wrap.

use crate::probes::visibility::{octahedral, texel_direction};
use glam::Vec3;

/// A square octahedral map (Cigolle et al. 2014) of `side` texels along each side.
pub struct Octahedron {
    side: usize,
    /// Of the texels' centres, row by row.
    pub directions: Vec<Vec3>,
}

impl Octahedron {
    pub fn new(side: usize) -> Octahedron {
        let texels = 0..side * side;
        let directions = texels.map(|i| texel_direction(i, side as u32)).collect();
        Octahedron { side, directions }
    }

    pub fn texels(&self) -> usize {
        self.side * self.side
    }

    /// The four texels around a direction and their weights, which sum to 1.
    pub fn around(&self, direction: Vec3) -> [(usize, f32); 4] {
        let side = self.side as f32;
        let at = (octahedral(direction) * 0.5 + 0.5) * side - 0.5;
        let corner = at.floor();
        let f = at - corner;
        let (x, y) = (corner.x as i32, corner.y as i32);
        [
            (self.wrap(x, y), (1.0 - f.x) * (1.0 - f.y)),
            (self.wrap(x + 1, y), f.x * (1.0 - f.y)),
            (self.wrap(x, y + 1), (1.0 - f.x) * f.y),
            (self.wrap(x + 1, y + 1), f.x * f.y),
        ]
    }

    /// The texel at a place one beyond the map's edge, or inside: an edge continues at its own
    /// mirror image.
    fn wrap(&self, x: i32, y: i32) -> usize {
        let last = self.side as i32 - 1;
        let (mut x, mut y) = (x, y);
        if x < 0 || x > last {
            x = x.clamp(0, last);
            y = last - y;
        }
        if y < 0 || y > last {
            y = y.clamp(0, last);
            x = last - x;
        }
        y as usize * self.side + x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_finds_itself() {
        for side in [8, 16] {
            let map = Octahedron::new(side);
            for (i, &direction) in map.directions.iter().enumerate() {
                let weight: f32 = map
                    .around(direction)
                    .iter()
                    .filter(|(texel, _)| *texel == i)
                    .map(|(_, weight)| weight)
                    .sum();
                assert!(weight > 0.999, "texel {i} of {side}: {weight}");
            }
        }
    }

    /// A wrong wrap at an edge or corner takes texels from elsewhere.
    #[test]
    fn a_look_up_takes_texels_near_its_direction() {
        let side = 16;
        let map = Octahedron::new(side);
        // The farthest apart that two of four neighbours are.
        let farthest = (0..side - 1)
            .flat_map(|y| (0..side - 1).map(move |x| y * side + x))
            .flat_map(|at| [(at, at + side + 1), (at + 1, at + side)])
            .map(|(a, b)| map.directions[a].dot(map.directions[b]))
            .fold(1.0, f32::min);
        for step in 0..=100_000 {
            let (phi, theta) = (step as f32 * 0.01, step as f32 * 3.14159e-5);
            let d = Vec3::new(
                theta.sin() * phi.cos(),
                theta.sin() * phi.sin(),
                theta.cos(),
            );
            let texels = map.around(d);
            let sum: f32 = texels.iter().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-5, "weights at {d} add up to {sum}");
            for (texel, weight) in texels {
                let cosine = map.directions[texel].dot(d);
                assert!(
                    weight < 1e-4 || cosine > farthest - 0.01,
                    "{texel} at {d}: {cosine}"
                );
            }
        }
    }
}
