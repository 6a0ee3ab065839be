//! The sections of a `vertices` record, `spec/vertices.md` §5 and §6.

use alloc::vec::Vec;

use super::{Coding, Vertices};
use crate::error::ErrorKind;

/// Values of a group that fills whole bytes at 5 bits each, and those bytes.
const GROUP: usize = 8;
const GROUP_BYTES: usize = 5;

/// Bytes of a section.
pub(super) fn bytes(vertices: &Vertices) -> u64 {
    let values = vertices.values() as u64;
    match (vertices.coding, vertices.bits) {
        (Coding::Raw, 5) => (5 * values).div_ceil(8),
        _ => values,
    }
}

/// The value of a 5-bit code: 0 to 255.
pub(super) fn expand(code: u8) -> u8 {
    ((u32::from(code) * 255 + 15) / 31) as u8
}

/// Reads the values of a track from a section of the right size.
pub(super) fn read(
    vertices: &Vertices,
    section: &[u8],
    values: &mut [u8],
) -> Result<(), ErrorKind> {
    match (vertices.coding, vertices.bits) {
        (Coding::Raw, 5) => read_five_bits(section, values),
        (Coding::Raw, _) => {
            values.copy_from_slice(section);
            Ok(())
        }
        (Coding::Packed, bits) => {
            let count = vertices.count as usize;
            if vertices.signals.count == 1 {
                return read_plane(section, bits, values.iter_mut());
            }
            let (first, second) = section.split_at(count);
            let pairs = values.as_chunks_mut::<2>().0;
            read_plane(first, bits, pairs.iter_mut().map(|[a, _]| a))?;
            read_plane(second, bits, pairs.iter_mut().map(|[_, b]| b))
        }
    }
}

fn read_five_bits(section: &[u8], values: &mut [u8]) -> Result<(), ErrorKind> {
    let groups = section.chunks(GROUP_BYTES).zip(values.chunks_mut(GROUP));
    for (bytes, values) in groups {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        let mut word = u64::from_le_bytes(word);
        for value in values {
            *value = expand((word & 31) as u8);
            word >>= 5;
        }
        if word != 0 {
            return Err(ErrorKind::VerticesReserved);
        }
    }
    Ok(())
}

/// Reads the values of a signal from its differences.
fn read_plane<'v>(
    plane: &[u8],
    bits: u8,
    values: impl Iterator<Item = &'v mut u8>,
) -> Result<(), ErrorKind> {
    if bits != 5 {
        let mut code = 255u8;
        for (value, difference) in values.zip(plane) {
            code = code.wrapping_add(*difference);
            *value = code;
        }
        return Ok(());
    }
    let mut code = 31u8;
    let mut all = 0;
    for (value, difference) in values.zip(plane) {
        all |= difference;
        code = code.wrapping_add(*difference) & 31;
        *value = expand(code);
    }
    match all < 32 {
        true => Ok(()),
        false => Err(ErrorKind::VerticesCode),
    }
}

/// Appends the section of a track with these codes, each of which fits the bits.
pub(super) fn write(vertices: &Vertices, codes: &[u8], out: &mut Vec<u8>) {
    match (vertices.coding, vertices.bits) {
        (Coding::Raw, 5) => {
            for codes in codes.chunks(GROUP) {
                let ascending = codes.iter().rev();
                let word = ascending.fold(0u64, |word, &code| word << 5 | u64::from(code));
                let bytes = (5 * codes.len()).div_ceil(8);
                out.extend_from_slice(&word.to_le_bytes()[..bytes]);
            }
        }
        (Coding::Raw, _) => out.extend_from_slice(codes),
        (Coding::Packed, _) => {
            let signals = usize::from(vertices.signals.count);
            let most = vertices.most();
            for signal in 0..signals {
                let mut before = most;
                for &code in codes[signal..].iter().step_by(signals) {
                    out.push(code.wrapping_sub(before) & most);
                    before = code;
                }
            }
        }
    }
}
