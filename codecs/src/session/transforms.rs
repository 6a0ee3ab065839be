//! The `transforms` record: the instance transforms that a frame's AO was computed with
//! (PSAO §3.5, "last received server transformation data").

use alloc::vec::Vec;

use crate::error::ErrorKind;
use crate::wire::{Reader, put_f32, put_u32, rows};

/// Bytes of an entry: id and twelve floats.
const ENTRY_BYTES: usize = 52;

/// Where a track's grid stands in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Rows of a 3x4 matrix, world space from grid space, in metres: a rotation and a translation,
    /// since the grid has the mesh's scale already.
    pub world_from_grid: [[f32; 4]; 3],
}

impl Transform {
    /// No rotation and no translation.
    pub const IDENTITY: Transform = Transform {
        world_from_grid: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
    };
    pub(crate) const ZERO: Transform = Transform {
        world_from_grid: [[0.0; 4]; 3],
    };
}

/// Calls `each` with every entry: ids ascending, floats finite.
pub(crate) fn read_transforms(
    payload: &[u8],
    mut each: impl FnMut(u32, Transform) -> Result<(), ErrorKind>,
) -> Result<(), ErrorKind> {
    let mut reader = Reader::new(payload, ErrorKind::PayloadSize);
    let count = reader.u32()?;
    if reader.u32()? != 0 {
        return Err(ErrorKind::PayloadReserved);
    }
    if reader.len() as u64 != u64::from(count) * ENTRY_BYTES as u64 {
        return Err(ErrorKind::PayloadSize);
    }
    let mut above = 0u64;
    for _ in 0..count {
        let id = reader.u32()?;
        if u64::from(id) < above {
            return Err(ErrorKind::EntryOrder);
        }
        above = u64::from(id) + 1;
        each(
            id,
            Transform {
                world_from_grid: rows(reader.floats()?),
            },
        )?;
    }
    reader.end()
}

/// Appends the payload.
pub(crate) fn write_transforms(
    transforms: &[(u32, Transform)],
    out: &mut Vec<u8>,
) -> Result<(), ErrorKind> {
    put_u32(
        out,
        u32::try_from(transforms.len()).map_err(|_| ErrorKind::EncoderUse)?,
    );
    put_u32(out, 0);
    for (id, transform) in transforms {
        put_u32(out, *id);
        transform
            .world_from_grid
            .as_flattened()
            .iter()
            .for_each(|&value| put_f32(out, value));
    }
    // What an encoder writes must be readable: the reader's checks are the rules.
    let start = out.len() - 8 - transforms.len() * ENTRY_BYTES;
    read_transforms(&out[start..], |_, _| Ok(()))
}
