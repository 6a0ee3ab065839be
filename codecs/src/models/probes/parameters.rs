//! The parameters of a `probes` track, `spec/probes.md` §3: read, written, checked.

use alloc::vec::Vec;

use super::state::PROBE_BYTES;
use super::{Coding, Steps, Visibility, Volume};
use crate::error::ErrorKind;
use crate::models::Parameters;
use crate::wire::{Reader, put_f32, put_u16, rows};

/// Most probes of a volume.
const MOST_PROBES: u64 = 1 << 24;
/// The largest step of the logarithmic code and of all others.
const MOST_LOG_STEP: u16 = 2560;
const MOST_STEP: u16 = 32768;

impl Volume {
    /// Reads the parameters of a coding that there is.
    pub(super) fn read(coding: u16, r: &mut Reader<'_>) -> Result<Volume, ErrorKind> {
        let grid_from_mesh = rows(r.floats()?);
        let dims = [r.u16()?, r.u16()?, r.u16()?];
        r.zero(2)?;
        let spacing = r.floats()?;
        let exponent = r.u8()? as i8;
        let side = r.u8()?;
        let map_steps = [r.u8()?, r.u8()?];
        let range = r.f32()?;
        let mut steps = [0; 6];
        for step in &mut steps {
            *step = r.u16()?;
        }
        let [y0, c0, y1, c1, y2, c2] = steps;
        let coding = match coding {
            0 if steps != [0; 6] => return Err(ErrorKind::PayloadReserved),
            0 => Coding::Raw,
            1 => Coding::Packed(Steps {
                luma: [y0, y1, y2],
                chroma: [c0, c1, c2],
            }),
            _ => return Err(ErrorKind::Coding),
        };
        Ok(Volume {
            grid_from_mesh,
            dims,
            spacing,
            exponent,
            visibility: Visibility {
                side,
                range,
                steps: map_steps,
            },
            coding,
        })
    }
}

impl Parameters for Volume {
    fn coding(&self) -> u16 {
        match self.coding {
            Coding::Raw => 0,
            Coding::Packed(_) => 1,
        }
    }

    fn state_bytes(&self) -> u64 {
        let maps = match self.coding {
            Coding::Raw => 1,
            Coding::Packed(_) => 2,
        };
        self.count() as u64 * PROBE_BYTES + maps * self.visibility_bytes()
    }

    fn write(&self, out: &mut Vec<u8>) {
        let floats = self.grid_from_mesh.as_flattened();
        floats.iter().for_each(|&value| put_f32(out, value));
        self.dims.iter().for_each(|&dim| put_u16(out, dim));
        put_u16(out, 0);
        self.spacing.iter().for_each(|&value| put_f32(out, value));
        out.extend([self.exponent as u8, self.visibility.side]);
        out.extend(self.visibility.steps);
        put_f32(out, self.visibility.range);
        let steps = match self.coding {
            Coding::Raw => [0; 6],
            Coding::Packed(steps) => steps.flat(),
        };
        steps.iter().for_each(|&step| put_u16(out, step));
    }

    fn check(&self) -> Result<(), ErrorKind> {
        let floats = self.grid_from_mesh.as_flattened().iter();
        let floats = floats.chain(&self.spacing);
        if !floats
            .chain([&self.visibility.range])
            .all(|f| f.is_finite())
        {
            return Err(ErrorKind::NotFinite);
        }
        if self.dims.contains(&0) || self.probes() > MOST_PROBES {
            return Err(ErrorKind::VolumeDims);
        }
        if self.spacing.iter().any(|&metres| metres <= 0.0) {
            return Err(ErrorKind::VolumeSpacing);
        }
        if !(-64..=64).contains(&self.exponent) {
            return Err(ErrorKind::VolumeExponent);
        }
        let Visibility { side, range, steps } = self.visibility;
        let fits = match side {
            0 => range.to_bits() == 0,
            4 | 8 | 16 => range > 0.0,
            _ => false,
        };
        let steps_fit = match (side, self.coding) {
            (0, _) | (_, Coding::Raw) => steps == [0; 2],
            (_, Coding::Packed(_)) => !steps.contains(&0),
        };
        if !fits || !steps_fit {
            return Err(ErrorKind::VolumeVisibility);
        }
        if let Coding::Packed(steps) = self.coding {
            let [first, rest @ ..] = steps.flat();
            let fits = (1..=MOST_LOG_STEP).contains(&first)
                && rest.iter().all(|step| (1..=MOST_STEP).contains(step));
            if !fits {
                return Err(ErrorKind::VolumeSteps);
            }
        }
        Ok(())
    }
}

impl Steps {
    /// Steps of the groups of codes, in the order of coding.
    pub(super) fn flat(&self) -> [u16; 6] {
        let ([y0, y1, y2], [c0, c1, c2]) = (self.luma, self.chroma);
        [y0, c0, y1, c1, y2, c2]
    }
}
