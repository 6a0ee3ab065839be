//! The small records that order a stream: `stream`, `group`, `commit`, `end`.

use alloc::vec::Vec;

use crate::error::{ErrorDetail, ErrorKind};
use crate::wire::{Reader, put_u32, put_u64};

/// Ticks a second as a fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickRate {
    /// Ticks...
    pub numerator: u32,
    /// ...in this many seconds.
    pub denominator: u32,
}

impl Default for TickRate {
    /// 60 Hz.
    fn default() -> Self {
        TickRate {
            numerator: 60,
            denominator: 1,
        }
    }
}

/// What a group builds on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroupStart {
    /// Nothing: the state is emptied at the group's first commit.
    Keyframes,
    /// The state whose digest this is, which the decoder must hold.
    State(u64),
}

/// A `commit` record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Commit {
    pub(crate) tick: u64,
    pub(crate) frame: u32,
    pub(crate) digest: Option<u64>,
}

/// An `end` record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct End {
    /// Records before this one.
    pub(crate) records: u64,
    /// XXH64, seed 0, of the preamble and of every record header before this one.
    pub(crate) digest: u64,
}

impl TickRate {
    /// Ticks a second.
    pub fn hz(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    pub(crate) fn read(payload: &[u8]) -> Result<TickRate, ErrorKind> {
        let mut r = Reader::new(payload, ErrorKind::PayloadSize);
        let rate = TickRate {
            numerator: r.u32()?,
            denominator: r.u32()?,
        };
        r.end()?;
        rate.check()?;
        Ok(rate)
    }

    pub(crate) fn write(self, out: &mut Vec<u8>) -> Result<(), ErrorKind> {
        self.check()?;
        put_u32(out, self.numerator);
        put_u32(out, self.denominator);
        Ok(())
    }

    fn check(self) -> Result<(), ErrorKind> {
        let zero = self.numerator == 0 || self.denominator == 0;
        if zero {
            Err(ErrorKind::TickRate)
        } else {
            Ok(())
        }
    }
}

impl GroupStart {
    pub(crate) fn read(payload: &[u8]) -> Result<(u32, GroupStart), ErrorDetail> {
        let mut r = Reader::new(payload, ErrorKind::PayloadSize);
        let id = r.u32()?;
        let start = r.u32()?;
        let digest = r.u64()?;
        r.end()?;
        match (start, digest) {
            (0, 0) => Ok((id, GroupStart::Keyframes)),
            (0, _) => Err(ErrorKind::PayloadReserved.into()),
            (1, digest) => Ok((id, GroupStart::State(digest))),
            _ => Err(ErrorDetail::found(ErrorKind::GroupStart, start)),
        }
    }

    pub(crate) fn write(self, id: u32, out: &mut Vec<u8>) {
        let (start, digest) = match self {
            GroupStart::Keyframes => (0, 0),
            GroupStart::State(digest) => (1, digest),
        };
        put_u32(out, id);
        put_u32(out, start);
        put_u64(out, digest);
    }
}

impl Commit {
    pub(crate) fn read(payload: &[u8]) -> Result<Commit, ErrorKind> {
        let mut r = Reader::new(payload, ErrorKind::PayloadSize);
        let tick = r.u64()?;
        let frame = r.u32()?;
        let digest = match r.u32()? {
            0 => None,
            1 => Some(r.u64()?),
            _ => return Err(ErrorKind::PayloadReserved),
        };
        r.end()?;
        Ok(Commit {
            tick,
            frame,
            digest,
        })
    }

    pub(crate) fn write(self, out: &mut Vec<u8>) {
        put_u64(out, self.tick);
        put_u32(out, self.frame);
        put_u32(out, u32::from(self.digest.is_some()));
        if let Some(digest) = self.digest {
            put_u64(out, digest);
        }
    }
}

impl End {
    pub(crate) fn read(payload: &[u8]) -> Result<End, ErrorKind> {
        let mut r = Reader::new(payload, ErrorKind::PayloadSize);
        let end = End {
            records: r.u64()?,
            digest: r.u64()?,
        };
        r.end()?;
        Ok(end)
    }

    pub(crate) fn write(self, out: &mut Vec<u8>) {
        put_u64(out, self.records);
        put_u64(out, self.digest);
    }
}
