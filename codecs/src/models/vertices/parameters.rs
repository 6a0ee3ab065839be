//! The parameters of a `vertices` track, `spec/vertices.md` §3: read, written, checked.

use alloc::vec::Vec;

use super::state::region_bytes;
use super::{Coding, MOST_VERTICES, Signals, Vertices};
use crate::error::ErrorKind;
use crate::models::Parameters;
use crate::wire::{Reader, put_u16, put_u32};

impl Vertices {
    /// Reads the parameters of a coding that there is.
    pub(super) fn read(coding: u16, r: &mut Reader<'_>) -> Result<Vertices, ErrorKind> {
        let coding = match coding {
            0 => Coding::Raw,
            1 => Coding::Packed,
            _ => return Err(ErrorKind::Coding),
        };
        let vertices = Vertices {
            signals: Signals::read(r)?,
            count: r.u32()?,
            bits: r.u8()?,
            order: r.u8()?,
            coding,
        };
        r.zero(2)?;
        Ok(vertices)
    }
}

impl Parameters for Vertices {
    fn coding(&self) -> u16 {
        match self.coding {
            Coding::Raw => 0,
            Coding::Packed => 1,
        }
    }

    fn state_bytes(&self) -> u64 {
        2 * u64::from(region_bytes(self))
    }

    fn write(&self, out: &mut Vec<u8>) {
        self.signals.write(out);
        put_u32(out, self.count);
        out.extend([self.bits, self.order]);
        put_u16(out, 0);
    }

    fn check(&self) -> Result<(), ErrorKind> {
        self.signals.check()?;
        let fits = (1..=MOST_VERTICES).contains(&self.count)
            && matches!(self.bits, 5 | 8)
            && matches!(self.order, Vertices::FILE_ORDER | Vertices::DISTINCT_ORDER);
        match fits {
            true => Ok(()),
            false => Err(ErrorKind::VerticesParameters),
        }
    }
}
