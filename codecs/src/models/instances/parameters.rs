//! The parameters of an `instances` track, `spec/instances.md` §3: read, written, checked.

use alloc::vec::Vec;

use super::{Coding, Table, Value};
use crate::error::ErrorKind;
use crate::models::Parameters;
use crate::models::signals::Signals;
use crate::wire::{Reader, put_u16, put_u32};

/// Most entries of a table.
const MOST_ENTRIES: u32 = 1 << 24;
const MOST_EXPONENT: u8 = 3;
const MOST_STEP: u16 = i16::MAX as u16;

impl Table {
    /// Reads the parameters of a coding that there is.
    pub(super) fn read(coding: u16, r: &mut Reader<'_>) -> Result<Table, ErrorKind> {
        let signals = Signals::read(r)?;
        let count = r.u32()?;
        let exponent = r.u8()?;
        r.zero(1)?;
        let step = r.u16()?;
        let coding = match coding {
            0 => Coding::Raw,
            1 => Coding::Packed,
            _ => return Err(ErrorKind::Coding),
        };
        Ok(Table {
            signals,
            count,
            exponent,
            step,
            coding,
        })
    }
}

impl Parameters for Table {
    fn coding(&self) -> u16 {
        match self.coding {
            Coding::Raw => 0,
            Coding::Packed => 1,
        }
    }

    /// Keys and values, as committed and as the pending frame leaves them.
    fn state_bytes(&self) -> u64 {
        let entry = size_of::<u64>() + self.signals() * size_of::<Value>();
        u64::from(self.count) * 2 * entry as u64
    }

    fn write(&self, out: &mut Vec<u8>) {
        self.signals.write(out);
        put_u32(out, self.count);
        out.extend([self.exponent, 0]);
        put_u16(out, self.step);
    }

    fn check(&self) -> Result<(), ErrorKind> {
        self.signals.check()?;
        let fits = (1..=MOST_ENTRIES).contains(&self.count)
            && self.exponent <= MOST_EXPONENT
            && (1..=MOST_STEP).contains(&self.step);
        match fits {
            true => Ok(()),
            false => Err(ErrorKind::InstancesParameters),
        }
    }
}
