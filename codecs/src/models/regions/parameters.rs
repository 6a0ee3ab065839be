//! The parameters of a `regions` track, `spec/regions.md` §3: read, written, checked.

use alloc::vec::Vec;

use super::state::{PAIR_BYTES, REGION_BYTES};
use super::{Coding, MOST_REGIONS, RegionSet};
use crate::error::ErrorKind;
use crate::models::Parameters;
use crate::models::signals::Signals;
use crate::wire::{Reader, put_u16, put_u32};

/// Most pairs of a region.
const MOST_PAIRS: u64 = 63;

impl RegionSet {
    /// Reads the parameters of a coding that there is.
    pub(super) fn read(coding: u16, r: &mut Reader<'_>) -> Result<RegionSet, ErrorKind> {
        let signals = Signals::read(r)?;
        let (count, capacity) = (r.u32()?, r.u32()?);
        let exponent = r.u8()?;
        r.zero(1)?;
        let step = r.u16()?;
        let coding = match coding {
            0 => Coding::Raw,
            1 => Coding::Packed,
            _ => return Err(ErrorKind::Coding),
        };
        Ok(RegionSet {
            signals,
            count,
            capacity,
            exponent,
            step,
            coding,
        })
    }
}

impl Parameters for RegionSet {
    fn coding(&self) -> u16 {
        self.coding as u16
    }

    fn state_bytes(&self) -> u64 {
        u64::from(self.count) * REGION_BYTES + u64::from(self.capacity) * PAIR_BYTES
    }

    fn write(&self, out: &mut Vec<u8>) {
        self.signals.write(out);
        put_u32(out, self.count);
        put_u32(out, self.capacity);
        out.extend([self.exponent, 0]);
        put_u16(out, self.step);
    }

    fn check(&self) -> Result<(), ErrorKind> {
        self.signals.check()?;
        let (least, most) = (u64::from(self.count), MOST_PAIRS * u64::from(self.count));
        let fits = (1..=MOST_REGIONS).contains(&self.count)
            && (least..=most).contains(&u64::from(self.capacity))
            && self.exponent <= 3
            && (1..=32767).contains(&self.step);
        match fits {
            true => Ok(()),
            false => Err(ErrorKind::RegionsParameters),
        }
    }
}
