//! Little-endian fields in byte slices.

use alloc::vec::Vec;

use crate::error::ErrorKind;

/// Reads fields from the front of a payload. Every read past the end is the same fault.
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
    short: ErrorKind,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8], short: ErrorKind) -> Self {
        Reader { rest: bytes, short }
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Result<&'a [u8], ErrorKind> {
        let (head, rest) = self.rest.split_at_checked(count).ok_or(self.short)?;
        self.rest = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ErrorKind> {
        let (head, rest) = self.rest.split_first_chunk::<N>().ok_or(self.short)?;
        self.rest = rest;
        Ok(*head)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, ErrorKind> {
        Ok(self.array::<1>()?[0])
    }

    pub(crate) fn u16(&mut self) -> Result<u16, ErrorKind> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(crate) fn u32(&mut self) -> Result<u32, ErrorKind> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(crate) fn u64(&mut self) -> Result<u64, ErrorKind> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// Reserved bytes, which are 0.
    pub(crate) fn zero(&mut self, count: usize) -> Result<(), ErrorKind> {
        if self.bytes(count)?.iter().any(|&b| b != 0) {
            return Err(ErrorKind::PayloadReserved);
        }
        Ok(())
    }

    /// A finite float.
    pub(crate) fn f32(&mut self) -> Result<f32, ErrorKind> {
        let value = f32::from_le_bytes(self.array()?);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(ErrorKind::NotFinite)
        }
    }

    /// `N` finite floats.
    pub(crate) fn floats<const N: usize>(&mut self) -> Result<[f32; N], ErrorKind> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f32()?;
        }
        Ok(values)
    }

    pub(crate) fn len(&self) -> usize {
        self.rest.len()
    }

    /// Everything was read.
    pub(crate) fn end(self) -> Result<(), ErrorKind> {
        if self.rest.is_empty() {
            Ok(())
        } else {
            Err(self.short)
        }
    }
}

/// Rows of a 3x4 matrix from twelve floats.
pub(crate) fn rows(values: [f32; 12]) -> [[f32; 4]; 3] {
    let v = values;
    [
        [v[0], v[1], v[2], v[3]],
        [v[4], v[5], v[6], v[7]],
        [v[8], v[9], v[10], v[11]],
    ]
}

pub(crate) fn put_u16(out: &mut Vec<u8>, value: u16) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_u64(out: &mut Vec<u8>, value: u64) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_f32(out: &mut Vec<u8>, value: f32) {
    out.extend_from_slice(&value.to_le_bytes());
}

/// Zeros up to a multiple of four bytes since `start`.
pub(crate) fn pad4(out: &mut Vec<u8>, start: usize) {
    while !(out.len() - start).is_multiple_of(4) {
        out.push(0);
    }
}
