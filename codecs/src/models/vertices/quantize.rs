//! Values from numbers (`spec/vertices.md` §8).

/// The nearest code of a number in 0..=1, which has `bits` bits, 8 or 5. Numbers beyond become 0 or the
/// largest code, and so does what is no number: 0.
pub fn nearest(value: f32, bits: u8) -> u8 {
    let most = (1u32 << bits.min(8)) - 1;
    // Positive: the conversion rounds down.
    (value.clamp(0.0, 1.0) * most as f32 + 0.5) as u8
}

/// The code of a number in 0..=1 that dithers it, for a vertex with this index: the mean of many codes is
/// the number. For few bits, where steps would show as bands.
///
/// Vertices that must look the same pass the same index: that of their distinct vertex
/// ([`super::remap`]).
pub fn dithered(value: f32, bits: u8, vertex: u32) -> u8 {
    let most = (1u32 << bits.min(8)) - 1;
    let value = (value.clamp(0.0, 1.0) * 65536.0) as u32;
    // The fractions of multiples of the golden ratio fill 0 to 1 evenly.
    let threshold = vertex.wrapping_mul(40503) & 0xffff;
    ((value * most + threshold) >> 16) as u8
}
