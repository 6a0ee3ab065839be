//! A point in 16, 24 or 32 bits (PSAO §3.2). Packing and sampling use floats; decoding never does.

use super::PointWidths;

impl PointWidths {
    /// Packs a point.
    ///
    /// `position_in_cell` is in units of the cell edge, 0 to 1; `normal` is of unit length; `ao` is
    /// 0 (closed) to 1 (open). What lies outside is clamped. The normal takes the best of the four
    /// codes around it.
    pub fn pack(&self, position_in_cell: [f32; 3], normal: [f32; 3], ao: f32) -> u32 {
        let mut word = 1u32;
        for axis in [2, 1, 0] {
            let steps = 1u32 << self.position;
            // A float-to-integer cast saturates, and truncation is the floor from zero up.
            let code = ((position_in_cell[axis] * steps as f32) as u32).min(steps - 1);
            word = word << self.position | code;
        }
        let [u, v] = self.pack_normal(normal);
        word = (word << self.normal | v) << self.normal | u;
        word << self.ao | self.pack_ao(ao)
    }

    /// The code of an AO value: the nearest.
    pub fn pack_ao(&self, ao: f32) -> u32 {
        let top = (1u32 << self.ao) - 1;
        ((ao.clamp(0.0, 1.0) * top as f32 + 0.5) as u32).min(top)
    }

    /// The allocation bit is set.
    #[inline]
    pub fn is_used(&self, point: u32) -> bool {
        point >> (self.bits() - 1) & 1 == 1
    }

    /// AO, 0 (closed) to 1 (open): `q / (2^b - 1)`.
    #[inline]
    pub fn unpack_ao(&self, point: u32) -> f32 {
        let top = (1u32 << self.ao) - 1;
        (point & top) as f32 / top as f32
    }

    /// Position in units of the cell edge, at the centre of its quantisation step:
    /// `(q + 0.5) / 2^b` for each axis.
    #[inline]
    pub fn unpack_position(&self, point: u32) -> [f32; 3] {
        let bits = u32::from(self.position);
        let start = u32::from(self.ao) + 2 * u32::from(self.normal);
        let step = 1.0 / (1u32 << bits) as f32;
        let mask = (1 << bits) - 1;
        [0, 1, 2].map(|axis| ((point >> (start + axis * bits) & mask) as f32 + 0.5) * step)
    }

    /// Unit normal.
    pub fn unpack_normal(&self, point: u32) -> [f32; 3] {
        self.normal_of_code(self.normal_code(point))
    }

    /// The normal's bits, `u + v * 2^b`: an index into a table of [`PointWidths::normal_of_code`],
    /// which has `4^b` entries.
    #[inline]
    pub fn normal_code(&self, point: u32) -> u32 {
        point >> self.ao & ((1 << (2 * u32::from(self.normal))) - 1)
    }

    /// Unit normal of a code.
    pub fn normal_of_code(&self, code: u32) -> [f32; 3] {
        let mask = (1u32 << self.normal) - 1;
        octahedron_decode([
            self.octahedral(code & mask),
            self.octahedral(code >> self.normal & mask),
        ])
    }

    /// One octahedral coordinate, -1 to 1: two's complement over `2^(b-1) - 1`, the lowest code
    /// being -1 too. So 0 and +-1 are exact, and with them the six axis directions, which walls
    /// and floors have.
    fn octahedral(&self, code: u32) -> f32 {
        let top = (1i32 << (self.normal - 1)) - 1;
        let shift = 32 - u32::from(self.normal);
        let signed = ((code << shift) as i32) >> shift;
        (signed as f32 / top as f32).max(-1.0)
    }

    /// The octahedral codes of a unit normal: of the four around its exact coordinates the one
    /// with the smallest angle (4+4 bits err by 5.7 degrees on average and 11.4 at most).
    fn pack_normal(&self, normal: [f32; 3]) -> [u32; 2] {
        let top = (1i32 << (self.normal - 1)) - 1;
        let [u, v] = octahedron_encode(normal).map(|c| c * top as f32);
        let mask = (1u32 << self.normal) - 1;
        let mut best = ([0, 0], f32::NEG_INFINITY);
        for du in 0..2 {
            for dv in 0..2 {
                let code = [
                    (floor(u) + du).clamp(-top, top),
                    (floor(v) + dv).clamp(-top, top),
                ];
                let n = octahedron_decode(code.map(|c| c as f32 / top as f32));
                let cosine = n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2];
                if cosine > best.1 {
                    best = (code.map(|c| c as u32 & mask), cosine);
                }
            }
        }
        best.0
    }
}

/// Unit vector of octahedral coordinates in -1..1: the upper half (z >= 0) inside the diamond
/// |u| + |v| <= 1, the lower half folded over its edges.
fn octahedron_decode([u, v]: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - u.abs() - v.abs();
    let [x, y] = if z < 0.0 {
        [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)]
    } else {
        [u, v]
    };
    let length = sqrt(x * x + y * y + z * z);
    [x / length, y / length, z / length]
}

/// Octahedral coordinates of a vector; a zero vector or one that is not finite counts as +z.
fn octahedron_encode([x, y, z]: [f32; 3]) -> [f32; 2] {
    let sum = x.abs() + y.abs() + z.abs();
    if !(sum > 0.0 && sum.is_finite()) {
        return [0.0, 0.0];
    }
    let [u, v] = [x / sum, y / sum];
    if z < 0.0 {
        [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)]
    } else {
        [u, v]
    }
}

/// -1 below zero, +1 at zero and above.
fn sign(value: f32) -> f32 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

fn floor(value: f32) -> i32 {
    let truncated = value as i32;
    if (truncated as f32) > value {
        truncated - 1
    } else {
        truncated
    }
}

#[cfg(feature = "std")]
fn sqrt(value: f32) -> f32 {
    value.sqrt()
}

/// Newton's iteration in double precision: `core` has no square root.
#[cfg(not(feature = "std"))]
fn sqrt(value: f32) -> f32 {
    if value <= 0.0 {
        return 0.0;
    }
    let value = f64::from(value);
    let mut root = f64::from_bits((value.to_bits() >> 1) + 0x1ff8_0000_0000_0000);
    for _ in 0..4 {
        root = 0.5 * (root + value / root);
    }
    root as f32
}
