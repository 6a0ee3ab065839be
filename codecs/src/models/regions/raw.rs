//! `raw` regions, `spec/regions.md` §6: 40 bytes each, then all codes.

use alloc::vec::Vec;

use super::packed::check_code;
use super::state::Arrays;
use super::{Form, Region, RegionSet};
use crate::error::ErrorKind;

/// Bytes of a region.
const REGION_BYTES: usize = 40;

/// Reads a section into `next`, which is empty.
pub(super) fn read(bytes: &[u8], set: &RegionSet, next: &mut Arrays) -> Result<(), ErrorKind> {
    let split = bytes.split_at_checked(set.count as usize * REGION_BYTES);
    let (regions, codes) = split.ok_or(ErrorKind::RegionsSize)?;
    let mut coefficients = 0;
    for bytes in regions.as_chunks::<REGION_BYTES>().0 {
        let (region, form) = read_region(bytes, set)?;
        next.push(set, region, form)?;
        coefficients += form.coefficients();
    }
    if codes.len() != 2 * coefficients {
        return Err(ErrorKind::RegionsSize);
    }
    let mut codes = codes.as_chunks::<2>().0.iter();
    for region in &next.regions {
        let form = Form::read(region.form)?;
        let start = region.first as usize;
        let pairs = &mut next.pairs[start..start + form.pairs()];
        let values = pairs.as_flattened_mut()[..form.coefficients()].iter_mut();
        for (value, &code) in values.zip(codes.by_ref()) {
            let code = check_code(i16::from_le_bytes(code).into(), set.step.into())?;
            *value = code * set.step as i16;
        }
    }
    Ok(())
}

fn read_region(bytes: &[u8; REGION_BYTES], set: &RegionSet) -> Result<(Region, Form), ErrorKind> {
    let words = bytes.as_chunks::<4>().0;
    let float = |at: usize| f32::from_le_bytes(words[at]);
    let floats = |at: usize| [float(at), float(at + 1), float(at + 2)];
    let mut region = Region {
        min: floats(0),
        first: 0,
        max: floats(3),
        form: u32::from_le_bytes(words[9]),
        centre: floats(6),
        reserved: 0,
    };
    region.check_box()?;
    let form = Form::read(region.form)?;
    if form.signals > set.signals.count {
        return Err(ErrorKind::RegionForm);
    }
    if !form.centred {
        region.check_centre()?;
    } else if region.centre.iter().any(|value| value.to_bits() != 0) {
        return Err(ErrorKind::RegionsReserved);
    } else {
        region.centre = region.middle();
    }
    Ok((region, form))
}

/// Appends a section. `codes` are those of all regions.
pub(super) fn write(regions: &[Region], codes: &[i16], out: &mut Vec<u8>) {
    regions
        .iter()
        .for_each(|region| out.extend_from_slice(&region.bytes()));
    codes
        .iter()
        .for_each(|code| out.extend_from_slice(&code.to_le_bytes()));
}
