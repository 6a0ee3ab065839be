//! The parameters of a `points` track, `spec/points.md` §2: read, written, checked.

use alloc::vec::Vec;

use super::state::state_bytes;
use super::{Coding, EMPTY, Grid, PointWidths};
use crate::error::ErrorKind;
use crate::models::Parameters;
use crate::wire::{Reader, put_f32, put_u16, put_u32, rows};

impl Grid {
    /// Reads the parameters of a coding that there is.
    pub(super) fn read(coding: u16, r: &mut Reader<'_>) -> Result<Grid, ErrorKind> {
        let coding = match coding {
            0 => Coding::Cells,
            _ => return Err(ErrorKind::Coding),
        };
        let grid_from_mesh = rows(r.floats()?);
        let dims = [r.u16()?, r.u16()?, r.u16()?];
        r.zero(2)?;
        let cell_edge = r.f32()?;
        let radius = r.f32()?;
        let widths = PointWidths {
            position: r.u8()?,
            normal: r.u8()?,
            ao: r.u8()?,
        };
        r.zero(1)?;
        Ok(Grid {
            grid_from_mesh,
            dims,
            cell_edge,
            radius,
            widths,
            bucket_count: r.u32()?,
            cell_capacity: r.u32()?,
            coding,
        })
    }
}

impl Parameters for Grid {
    fn coding(&self) -> u16 {
        match self.coding {
            Coding::Cells => 0,
        }
    }

    fn state_bytes(&self) -> u64 {
        state_bytes(self.bucket_count.into(), self.cell_capacity.into())
    }

    fn write(&self, out: &mut Vec<u8>) {
        let floats = self.grid_from_mesh.as_flattened();
        floats.iter().for_each(|&value| put_f32(out, value));
        self.dims.iter().for_each(|&dim| put_u16(out, dim));
        put_u16(out, 0);
        put_f32(out, self.cell_edge);
        put_f32(out, self.radius);
        out.extend([self.widths.position, self.widths.normal, self.widths.ao, 0]);
        put_u32(out, self.bucket_count);
        put_u32(out, self.cell_capacity);
    }

    fn check(&self) -> Result<(), ErrorKind> {
        let floats = self.grid_from_mesh.as_flattened().iter();
        if !floats
            .chain([&self.cell_edge, &self.radius])
            .all(|f| f.is_finite())
        {
            return Err(ErrorKind::NotFinite);
        }
        if self.dims.contains(&0) || self.volume() > u64::from(u32::MAX) {
            return Err(ErrorKind::GridDims);
        }
        // An encoder that computes the edge as 2 r in another order may be one step of f32 short.
        let wide_enough = 2.0 * self.radius <= self.cell_edge.next_up();
        if self.radius <= 0.0 || self.cell_edge <= 0.0 || !wide_enough {
            return Err(ErrorKind::GridRadius);
        }
        self.widths.check()?;
        if self.bucket_count == 0 || self.cell_capacity == 0 || self.cell_capacity == EMPTY {
            return Err(ErrorKind::GridCapacity);
        }
        Ok(())
    }
}

impl PointWidths {
    pub(crate) fn check(&self) -> Result<(), ErrorKind> {
        let right = (1..=8).contains(&self.position)
            && (2..=8).contains(&self.normal)
            && (1..=8).contains(&self.ao)
            && matches!(self.bits(), 16 | 24 | 32);
        if right {
            Ok(())
        } else {
            Err(ErrorKind::PointWidths)
        }
    }
}
