//! What the numbers of a baked track are: its signals, their kernels, and how they blend
//! (`spec/obscurance.md`). The models `vertices`, `instances` and `regions` share it.

use alloc::vec::Vec;

use crate::error::ErrorKind;
use crate::wire::{Reader, put_f32};

/// The first 16 bytes of the parameters of a baked track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Signals of a value: 1, or 2 where those of both kernels are kept apart.
    pub count: u8,
    /// The kernel of the first signal, usually of the shorter distance, and that of the second.
    /// With one signal the second may be there as well: the value is then the blend of both.
    pub kernels: [Kernel; 2],
    /// Share of the second kernel, 0 to 1; 0 without a second kernel.
    pub share: f32,
}

/// How far away an occluder counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// 0 none, 1 exponential, 2 cut-off.
    pub kind: u8,
    /// Metres, above 0: the distance at which an occluder counts half, or beyond which it does not
    /// count. 0 without a kernel.
    pub distance: f32,
}

impl Kernel {
    /// No kernel.
    pub const NONE: Kernel = Kernel {
        kind: 0,
        distance: 0.0,
    };

    /// An occluder at x metres lets `1 - exp(ln(0.5) / half_distance * x)` of the light pass.
    pub const fn exponential(half_distance: f32) -> Kernel {
        Kernel {
            kind: 1,
            distance: half_distance,
        }
    }

    /// An occluder nearer than `distance` metres lets no light pass, others all of it.
    pub const fn cut_off(distance: f32) -> Kernel {
        Kernel { kind: 2, distance }
    }

    /// There is a kernel.
    pub fn is_some(&self) -> bool {
        self.kind != 0
    }

    fn fits(&self) -> bool {
        match self.kind {
            0 => self.distance.to_bits() == 0,
            1 | 2 => self.distance > 0.0,
            _ => false,
        }
    }
}

impl Signals {
    /// One signal of one kernel.
    pub const fn one(kernel: Kernel) -> Signals {
        Signals {
            count: 1,
            kernels: [kernel, Kernel::NONE],
            share: 0.0,
        }
    }

    /// Two signals apart.
    pub const fn two(first: Kernel, second: Kernel, share: f32) -> Signals {
        Signals {
            count: 2,
            kernels: [first, second],
            share,
        }
    }

    /// One signal that is the blend of two.
    pub const fn blended(first: Kernel, second: Kernel, share: f32) -> Signals {
        Signals {
            count: 1,
            kernels: [first, second],
            share,
        }
    }

    /// Reads the block. [`Signals::check`] comes after the path of the track.
    pub(crate) fn read(r: &mut Reader<'_>) -> Result<Signals, ErrorKind> {
        let [count, first, second] = [r.u8()?, r.u8()?, r.u8()?];
        r.zero(1)?;
        let [first_distance, second_distance, share] = r.floats()?;
        let kernel = |kind, distance| Kernel { kind, distance };
        Ok(Signals {
            count,
            kernels: [
                kernel(first, first_distance),
                kernel(second, second_distance),
            ],
            share,
        })
    }

    /// Appends the block.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let [first, second] = self.kernels;
        out.extend([self.count, first.kind, second.kind, 0]);
        put_f32(out, first.distance);
        put_f32(out, second.distance);
        put_f32(out, self.share);
    }

    /// The rules that hold for the block by itself, in the order of the specification.
    pub(crate) fn check(&self) -> Result<(), ErrorKind> {
        let [first, second] = self.kernels;
        if ![first.distance, second.distance, self.share]
            .iter()
            .all(|f| f.is_finite())
        {
            return Err(ErrorKind::NotFinite);
        }
        let counted = match self.count {
            1 => true,
            2 => second.is_some(),
            _ => false,
        };
        let shared = match second.is_some() {
            true => (0.0..=1.0).contains(&self.share),
            false => self.share.to_bits() == 0,
        };
        if counted && first.is_some() && first.fits() && second.fits() && shared {
            Ok(())
        } else {
            Err(ErrorKind::Signals)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Kernel = Kernel::exponential(2.0);
    const LONG: Kernel = Kernel::exponential(300.0);

    #[test]
    fn signals_roundtrip() {
        for signals in [
            Signals::one(Kernel::cut_off(1.0)),
            Signals::two(SHORT, LONG, 0.97),
            Signals::blended(SHORT, LONG, 1.0),
            Signals::two(SHORT, LONG, -0.0),
        ] {
            assert_eq!(signals.check(), Ok(()));
            let mut bytes = Vec::new();
            signals.write(&mut bytes);
            assert_eq!(bytes.len(), 16);
            let mut reader = Reader::new(&bytes, ErrorKind::PayloadSize);
            assert_eq!(Signals::read(&mut reader), Ok(signals));
            assert_eq!(reader.end(), Ok(()));
        }
    }

    #[test]
    fn signals_that_contradict_themselves_are_refused() {
        let both = Signals::two(SHORT, LONG, 0.97);
        let kernel = |kind, distance| Kernel { kind, distance };
        for count in [0, 3, 255] {
            assert_eq!(Signals { count, ..both }.check(), Err(ErrorKind::Signals));
        }
        let one = Signals::one(SHORT);
        assert_eq!(Signals { count: 2, ..one }.check(), Err(ErrorKind::Signals));
        for share in [-f32::MIN_POSITIVE, 1.0f32.next_up()] {
            assert_eq!(Signals { share, ..both }.check(), Err(ErrorKind::Signals));
        }
        for share in [-0.0, 0.5] {
            assert_eq!(Signals { share, ..one }.check(), Err(ErrorKind::Signals));
        }
        let infinite = Signals {
            share: f32::NAN,
            ..both
        };
        assert_eq!(infinite.check(), Err(ErrorKind::NotFinite));
        for bad in [
            kernel(0, -0.0),
            kernel(0, 1.0),
            kernel(1, 0.0),
            kernel(2, -1.0),
            kernel(3, 1.0),
        ] {
            for at in 0..2 {
                let mut signals = both;
                signals.kernels[at] = bad;
                assert_eq!(signals.check(), Err(ErrorKind::Signals), "{bad:?} at {at}");
            }
        }
        assert_eq!(Signals::one(Kernel::NONE).check(), Err(ErrorKind::Signals));
    }
}
