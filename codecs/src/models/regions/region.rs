//! A region as a client reads it.

use bytemuck::{Pod, Zeroable};

use crate::error::ErrorKind;

/// Two coefficients, in units of [`super::RegionSet::scale`]: WGSL `u32` for `unpack2x16snorm`.
pub type Pair = [i16; 2];

/// A region: 48 bytes, WGSL `struct { min: vec3f, first: u32, max: vec3f, form: u32, centre: vec3f,
/// reserved: u32 }`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Region {
    /// Smallest corner of its box, in the track's space, metres.
    pub min: [f32; 3],
    /// Index of its first pair among those of the track.
    pub first: u32,
    /// Largest corner.
    pub max: [f32; 3],
    /// Bits of its [`Form`].
    pub form: u32,
    /// What offsets count from: a place in the box, its middle in a centred region.
    pub centre: [f32; 3],
    /// 0.
    pub reserved: u32,
}

/// Which coefficients a region has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Form {
    /// How it changes with the position.
    pub derivatives: Derivatives,
    /// How it changes with the normal: degree 0, 1 or 2, of 1, 4 or 9 polynomials.
    pub degree: u8,
    /// 1, or 2 where the track has two.
    pub signals: u8,
    /// The centre is the middle of the box.
    pub centred: bool,
}

/// How the coefficients of a region change with the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Derivatives {
    /// Not at all.
    Constant,
    /// A gradient: along x, y, z.
    Gradient,
    /// Sided: along +x, -x, +y, -y, +z, -z (Eq. 4 of the paper).
    Sided,
}

impl Derivatives {
    /// All, by their numbers.
    pub const ALL: [Derivatives; 3] = [
        Derivatives::Constant,
        Derivatives::Gradient,
        Derivatives::Sided,
    ];

    /// How many there are.
    pub fn count(self) -> usize {
        [0, 3, 6][self as usize]
    }
}

impl Form {
    /// Polynomials of the normal: 1, 4 or 9.
    pub fn polynomials(self) -> usize {
        let side = usize::from(self.degree.min(2)) + 1;
        side * side
    }

    /// Coefficients: for the mean, then each derivative, for each polynomial, for each signal one.
    pub fn coefficients(self) -> usize {
        (1 + self.derivatives.count()) * self.polynomials() * usize::from(self.signals.min(2))
    }

    /// Pairs that the coefficients take.
    pub fn pairs(self) -> usize {
        self.coefficients().div_ceil(2)
    }

    /// Its bits: derivatives 0 and 1, degree 2 and 3, signals less one 4, centred 5.
    pub fn bits(self) -> u32 {
        self.derivatives as u32
            | u32::from(self.degree) << 2
            | u32::from(self.signals.saturating_sub(1)) << 4
            | u32::from(self.centred) << 5
    }

    /// The form of these bits; an error where there is none.
    pub(super) fn read(bits: u32) -> Result<Form, ErrorKind> {
        if bits >> 6 != 0 {
            return Err(ErrorKind::RegionsReserved);
        }
        let derivatives = Derivatives::ALL.get(bits as usize & 3);
        let degree = (bits >> 2 & 3) as u8;
        match derivatives {
            Some(&derivatives) if degree < 3 => Ok(Form {
                derivatives,
                degree,
                signals: 1 + (bits >> 4 & 1) as u8,
                centred: bits >> 5 & 1 == 1,
            }),
            _ => Err(ErrorKind::RegionForm),
        }
    }
}

/// Coordinates are less than this in magnitude, so that volumes are finite: 2^40.
const COORDINATE_BITS: u32 = 0x5380_0000;

impl Region {
    /// Its form; none of a region that no decoder gives.
    pub fn form(&self) -> Option<Form> {
        Form::read(self.form).ok()
    }

    /// The middle of its box.
    pub(super) fn middle(&self) -> [f32; 3] {
        core::array::from_fn(|axis| 0.5 * self.min[axis] + 0.5 * self.max[axis])
    }

    /// The box is one.
    pub(super) fn check_box(&self) -> Result<(), ErrorKind> {
        let mut corners = self.min.iter().chain(&self.max);
        let near = corners.all(|value| value.to_bits() & 0x7fff_ffff < COORDINATE_BITS);
        match near && (0..3).all(|axis| self.min[axis] <= self.max[axis]) {
            true => Ok(()),
            false => Err(ErrorKind::RegionBox),
        }
    }

    /// The centre lies in the box.
    pub(super) fn check_centre(&self) -> Result<(), ErrorKind> {
        let within = |axis: usize| {
            let centre = self.centre[axis];
            self.min[axis] <= centre && centre <= self.max[axis]
        };
        match (0..3).all(within) {
            true => Ok(()),
            false => Err(ErrorKind::RegionBox),
        }
    }

    /// Its 40 bytes in `raw` and in digests.
    pub(super) fn bytes(&self) -> [u8; 40] {
        let centred = self.form >> 5 & 1 == 1;
        let centre = if centred { [0.0; 3] } else { self.centre };
        let mut bytes = [0; 40];
        let values = self.min.iter().chain(&self.max).chain(&centre);
        let words = values.map(|value| value.to_bits()).chain([self.form]);
        for (to, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *to = word.to_le_bytes();
        }
        bytes
    }
}
