//! Tracks of `regions` and their records, byte by byte, from `spec/regions.md` alone.

use crate::models::Parameters;
use crate::models::entry::Entry;
use crate::models::range::{Bit, Coded, code};
use crate::stream_builder::{floats, words};

/// The parameters of a track as they will stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    pub signals: u8,
    pub kinds: [u8; 2],
    pub signals_reserved: u8,
    /// Distances of both kernels, and the share of the second.
    pub distances: [f32; 2],
    pub share: f32,
    pub count: u32,
    pub capacity: u32,
    pub exponent: u8,
    pub reserved: u8,
    pub step: u16,
    /// Not among the parameters: the coding of the track.
    pub is_packed: bool,
}

impl Set {
    /// Raw regions of two signals, with as much capacity as they may need.
    pub fn raw(count: u32) -> Set {
        Set {
            signals: 2,
            kinds: [1, 1],
            signals_reserved: 0,
            distances: [2.0, 300.0],
            share: 0.75,
            count,
            capacity: 63 * count,
            exponent: 1,
            reserved: 0,
            step: 32,
            is_packed: false,
        }
    }

    /// Packed regions of two signals.
    pub fn packed(count: u32) -> Set {
        Set {
            is_packed: true,
            ..Set::raw(count)
        }
    }

    /// The same with one signal of one kernel.
    pub fn of_one(self) -> Set {
        Set {
            signals: 1,
            kinds: [1, 0],
            distances: [2.0, 0.0],
            share: 0.0,
            ..self
        }
    }

    /// The 28 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let [a, b] = self.kinds;
        let mut bytes = vec![self.signals, a, b, self.signals_reserved];
        bytes.extend(floats(&self.distances));
        bytes.extend(floats(&[self.share]));
        bytes.extend(words(&[self.count, self.capacity]));
        bytes.extend([self.exponent, self.reserved]);
        bytes.extend(self.step.to_le_bytes());
        bytes
    }

    /// The largest code.
    pub fn most(&self) -> i32 {
        32767 / i32::from(self.step)
    }
}

impl Entry {
    /// An entry of a `track` record of `regions`.
    pub fn of_set(id: u32, set: Set) -> Entry {
        Entry {
            path: Vec::new(),
            ..Entry::of(id, 5, u16::from(set.is_packed), Parameters::Regions(set))
        }
    }

    /// The parameters of an entry of `regions`; `None` for another model.
    pub fn set(&self) -> Option<&Set> {
        let Parameters::Regions(set) = &self.parameters else {
            return None;
        };
        Some(set)
    }
}

/// A region; its fields may be beyond what a decoder takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Minimum, maximum.
    pub bounds: [f32; 6],
    /// None of a centred region.
    pub centre: Option<[f32; 3]>,
    /// 0 none, 1 a gradient, 2 sided.
    pub derivatives: u8,
    pub degree: u8,
    pub signals: u8,
    /// In the order of its coefficients.
    pub codes: Vec<i32>,
}

impl Region {
    /// A centred region of a form, all of whose codes are 0.
    pub fn new(bounds: [f32; 6], [derivatives, degree, signals]: [u8; 3]) -> Region {
        let mut region = Region {
            bounds,
            centre: None,
            derivatives,
            degree,
            signals,
            codes: Vec::new(),
        };
        region.codes = vec![0; region.coefficients()];
        region
    }

    /// How many coefficients its form has (§2.1).
    pub fn coefficients(&self) -> usize {
        let rows = [1, 4, 7][usize::from(self.derivatives.min(2))];
        rows * [1, 4, 9][usize::from(self.degree.min(2))] * usize::from(self.signals)
    }

    /// The bits of its form (§6).
    pub fn form(&self) -> u32 {
        u32::from(self.derivatives)
            | u32::from(self.degree) << 2
            | (u32::from(self.signals) - 1) << 4
            | u32::from(self.centre.is_none()) << 5
    }

    /// The 40 bytes of §6.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = floats(&self.bounds);
        bytes.extend(floats(&self.centre.unwrap_or_default()));
        bytes.extend(words(&[self.form()]));
        bytes
    }

    /// Row, polynomial and signal of each coefficient (§2.1).
    pub fn places(&self) -> Vec<[usize; 3]> {
        let rows: &[usize] = match self.derivatives {
            0 => &[0],
            1 => &[0, 1, 2, 3],
            _ => &[0, 4, 5, 6, 7, 8, 9],
        };
        let mut places = Vec::new();
        for &row in rows {
            for k in 0..[1, 4, 9][usize::from(self.degree.min(2))] {
                for s in 0..usize::from(self.signals) {
                    places.push([row, k, s]);
                }
            }
        }
        places
    }
}

/// Bytes of codes.
pub fn codes(codes: &[i32]) -> Vec<u8> {
    let codes = codes.iter();
    codes
        .flat_map(|&code| (code as i16).to_le_bytes())
        .collect()
}

/// A `raw` section.
pub fn raw(regions: &[Region]) -> Vec<u8> {
    let mut bytes: Vec<u8> = regions.iter().flat_map(Region::bytes).collect();
    bytes.extend(regions.iter().flat_map(|region| codes(&region.codes)));
    bytes
}

/// Boxes, bitmap and centres of a `packed` section.
pub fn packed_head(regions: &[Region]) -> Vec<u8> {
    let mut bytes: Vec<u8> = regions.iter().flat_map(|r| floats(&r.bounds)).collect();
    for part in regions.chunks(8) {
        let bits = part.iter().enumerate();
        bytes.push(bits.fold(0, |byte, (at, region)| {
            byte | u8::from(region.centre.is_some()) << at
        }));
    }
    for region in regions {
        bytes.extend(region.centre.iter().flat_map(|centre| floats(centre)));
    }
    bytes
}

/// Numbers of the contexts (§7).
pub mod context {
    pub const OTHER: usize = 0;
    pub const DERIVATIVES: usize = 1;
    pub const DEGREE: usize = 3;
    pub const SIGNALS: usize = 5;
    pub fn significant(group: usize, digits: usize) -> usize {
        6 + 4 * group + digits
    }
    pub fn sign(row: usize, k: usize) -> usize {
        78 + 9 * row + k
    }
    pub fn prefix(group: usize, length: usize) -> usize {
        168 + 15 * group + length
    }
    pub fn suffix(group: usize) -> usize {
        438 + group
    }
    pub const ALL: usize = 456;
}

/// Classes of rows.
const CLASSES: [usize; 10] = [0, 1, 1, 1, 2, 2, 2, 2, 2, 2];
/// Degrees of polynomials.
const DEGREES: [usize; 9] = [0, 1, 1, 1, 2, 2, 2, 2, 2];

/// The program of §7, as it is written.
pub fn bits(set: &Set, follow: [bool; 3], regions: &[Region]) -> Vec<Bit> {
    let mut bits: Vec<Bit> = follow.iter().map(|&one| Bit::Even(one)).collect();
    let mut form = [0, 0, 1];
    let mut last = [[[0i32; 2]; 9]; 10];
    let mut size = [[[0i32; 2]; 9]; 10];
    for region in regions {
        let own = [region.derivatives, region.degree, region.signals];
        bits.push(Bit::In(context::OTHER, own != form));
        if own != form {
            three(&mut bits, context::DERIVATIVES, own[0]);
            three(&mut bits, context::DEGREE, own[1]);
            if set.signals == 2 {
                bits.push(Bit::In(context::SIGNALS, own[2] == 2));
            }
            form = own;
        }
        for ([row, k, s], &code) in region.places().into_iter().zip(&region.codes) {
            let class = CLASSES[row];
            let group = (3 * s + class) * 3 + DEGREES[k];
            let before = if follow[class] { last[row][k][s] } else { 0 };
            let digits = digits(size[row][k][s]).min(3);
            let residual = code - before;
            let significant = context::significant(group, digits);
            bits.push(Bit::In(significant, residual != 0));
            if residual != 0 {
                bits.push(Bit::In(context::sign(row, k), residual < 0));
                magnitude(&mut bits, group, residual.unsigned_abs());
            }
            last[row][k][s] = code;
            size[row][k][s] = residual.abs();
        }
    }
    bits
}

fn three(bits: &mut Vec<Bit>, context: usize, number: u8) {
    bits.push(Bit::In(context, number > 0));
    if number > 0 {
        bits.push(Bit::In(context + 1, number == 2));
    }
}

/// Binary digits of a number, 0 for 0.
fn digits(number: i32) -> usize {
    (32 - number.leading_zeros()) as usize
}

fn magnitude(bits: &mut Vec<Bit>, group: usize, magnitude: u32) {
    let length = magnitude.ilog2() as usize;
    for at in 0..length.min(15) {
        bits.push(Bit::In(context::prefix(group, at), true));
    }
    if length < 15 {
        bits.push(Bit::In(context::prefix(group, length), false));
    }
    for below in (0..length).rev() {
        let one = magnitude >> below & 1 == 1;
        bits.push(match below + 1 == length {
            true => Bit::In(context::suffix(group), one),
            false => Bit::Even(one),
        });
    }
}

/// Those bits as bytes.
pub fn coded(set: &Set, follow: [bool; 3], regions: &[Region]) -> Coded {
    code(&[128; context::ALL], &bits(set, follow, regions))
}

/// A track's part of a `regions` payload.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Section {
    pub id: u32,
    /// What the table says of its size; `None` for the one that fits.
    pub size: Option<u32>,
    /// The last word of its entry in the table.
    pub reserved: u32,
    /// What comes before the codes of `raw`, or the entropy-coded part.
    pub head: Vec<u8>,
    pub codes: Vec<u8>,
}

/// Payload of a `regions` record.
pub fn payload(sections: &[Section]) -> Vec<u8> {
    let mut payload = words(&[sections.len() as u32, 1, 0, 0]);
    for section in sections {
        let size = (section.head.len() + section.codes.len()) as u32;
        let size = section.size.unwrap_or(size);
        payload.extend(words(&[section.id, size, section.reserved]));
    }
    for section in sections {
        payload.extend(&section.head);
        payload.extend(&section.codes);
    }
    payload
}
