//! Draws triangles into a texture and finds out whether they overlap.

/// A square texture of one number a texel.
pub struct Canvas {
    side: usize,
    values: Vec<f32>,
    is_drawn: Vec<bool>,
}

/// A place in texture space.
type Point = [f64; 2];

/// Rings of texels around what was drawn that take its values: filters read beyond the edges.
const RINGS: usize = 8;

impl Canvas {
    pub fn new(side: u32) -> Canvas {
        let side = side as usize;
        Canvas {
            side,
            values: vec![1.0; side * side],
            is_drawn: vec![false; side * side],
        }
    }

    /// Whether any texel was drawn.
    pub fn is_empty(&self) -> bool {
        !self.is_drawn.contains(&true)
    }

    /// Draws a triangle with a value at each corner, interpolated linearly, over the texels whose centres
    /// it covers. Triangles that share an edge never cover a texel both. Returns whether all those texels
    /// were free.
    pub fn draw(&mut self, corners: [[f32; 2]; 3], values: [f32; 3]) -> bool {
        let side = self.side as f64;
        let mut corners = corners.map(|c| c.map(|x| f64::from(x) * side));
        let mut values = values;
        let area = cross(corners[0], corners[1], corners[2]);
        if area == 0.0 {
            return true;
        }
        if area < 0.0 {
            corners.swap(1, 2);
            values.swap(1, 2);
        }
        let [a, b, c] = corners;
        let range = |axis: usize| {
            let (low, high) = corners
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |r, p| {
                    (r.0.min(p[axis]), r.1.max(p[axis]))
                });
            // Centres lie at halves.
            let first = (low - 0.5).ceil().max(0.0) as usize;
            let end = ((high - 0.5).floor() + 1.0).clamp(0.0, side) as usize;
            first..end
        };
        let mut free = true;
        for y in range(1) {
            for x in range(0) {
                let centre = [x as f64 + 0.5, y as f64 + 0.5];
                let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| (cross(p, q, centre), p, q));
                if !weights
                    .iter()
                    .all(|&(w, p, q)| w > 0.0 || (w == 0.0 && owns(p, q)))
                {
                    continue;
                }
                let sum: f64 = weights.iter().map(|(w, ..)| w).sum();
                let value = weights.iter().zip(&values);
                let value: f64 = value.map(|((w, ..), v)| w / sum * f64::from(*v)).sum();
                let texel = y * self.side + x;
                free &= !self.is_drawn[texel];
                self.is_drawn[texel] = true;
                self.values[texel] = value as f32;
            }
        }
        free
    }

    /// The texels as UNORM8, row by row. Those beside what was drawn have the mean of their neighbours.
    pub fn into_texels(mut self) -> Vec<u8> {
        for _ in 0..RINGS {
            self.grow();
        }
        self.values
            .into_iter()
            .map(crate::bake::signals::unorm8)
            .collect()
    }

    fn grow(&mut self) {
        let side = self.side;
        let mut grown = Vec::new();
        for (texel, _) in self
            .is_drawn
            .iter()
            .enumerate()
            .filter(|(_, drawn)| !**drawn)
        {
            let (x, y) = (texel % side, texel / side);
            let (mut sum, mut count) = (0.0, 0.0);
            for ny in y.saturating_sub(1)..(y + 2).min(side) {
                for nx in x.saturating_sub(1)..(x + 2).min(side) {
                    if self.is_drawn[ny * side + nx] {
                        sum += self.values[ny * side + nx];
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                grown.push((texel, sum / count));
            }
        }
        for (texel, value) in grown {
            self.values[texel] = value;
            self.is_drawn[texel] = true;
        }
    }
}

/// Twice the area of `p`, `q`, `at`, positive where `at` is left of the way from p to q (+v being up). To
/// the bit the negative of that of the way back, so that neighbours agree on which side a texel is.
fn cross(p: Point, q: Point, at: Point) -> f64 {
    let turned =
        |p: Point, q: Point| (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]);
    match p <= q {
        true => turned(p, q),
        false => -turned(q, p),
    }
}

/// Whether the triangle on the left of an edge has the centres on it; the one on its right has not.
fn owns(p: Point, q: Point) -> bool {
    p < q
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    /// Every texel of a square that is cut into triangles at random is drawn exactly once.
    #[test]
    fn tilings_cover_each_texel_once() {
        let mut rng = Rng::new(5);
        for _ in 0..200 {
            let centre = match rng.draw() % 3 {
                // On a texel's centre, too.
                0 => [0.5 + 0.5 / 16.0, 0.5 + 0.5 / 16.0],
                1 => [0.5, 0.25],
                _ => [rng.unit(), rng.unit()],
            };
            let rim = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            let mut canvas = Canvas::new(16);
            for i in 0..4 {
                let mut corners = [centre, rim[i], rim[(i + 1) % 4]];
                corners.rotate_left((rng.draw() % 3) as usize);
                if rng.draw().is_multiple_of(2) {
                    corners.swap(0, 1);
                }
                assert!(canvas.draw(corners, [0.5; 3]), "{centre:?}");
            }
            assert!(canvas.is_drawn.iter().all(|drawn| *drawn), "{centre:?}");
        }
    }

    #[test]
    fn overlaps_are_found() {
        let triangle = [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]];
        let mut canvas = Canvas::new(32);
        assert!(canvas.draw(triangle, [0.0; 3]));
        assert!(!canvas.draw([[0.3, 0.3], [0.9, 0.9], [0.3, 0.8]], [0.0; 3]));
        let mut canvas = Canvas::new(32);
        assert!(canvas.draw(triangle, [0.0; 3]));
        assert!(canvas.draw([[0.9, 0.2], [0.9, 0.9], [0.2, 0.9]], [0.0; 3]));
    }

    #[test]
    fn values_are_linear_and_grow_over_the_edges() {
        let mut canvas = Canvas::new(64);
        let corners = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75]];
        canvas.draw(corners, corners.map(|[u, v]| u + 0.5 * v));
        let texels = canvas.into_texels();
        let at = |x: usize, y: usize| f32::from(texels[y * 64 + x]) / 255.0;
        assert!((at(20, 24) - (20.5 + 0.5 * 24.5) / 64.0).abs() < 0.003);
        assert!((at(12, 20) - at(16, 20)).abs() < 0.05);
        assert_eq!(at(0, 0), 1.0);
    }
}
