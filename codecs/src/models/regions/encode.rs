//! The payload of a `regions` record, written.

use alloc::vec::Vec;

use super::packed::{Walk, follow};
use super::{Coding, Form, MOST_COEFFICIENTS, Pair, Region, RegionSet, contexts, raw};
use crate::container::Compression;
use crate::encoder::Encoder;
use crate::entropy;
use crate::error::{ErrorKind, Result};
use crate::models::ModelKind;
use crate::models::payload_header::{Coverage, write_header};
use crate::wire::put_u32;

/// Content of one track for one frame, all of it.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// Id of the track.
    pub track: u32,
    /// Its regions, as many as it declares; the pairs of each follow those of the one before.
    pub regions: &'a [Region],
    /// Their coefficients ([`RegionSet::push`] makes both).
    pub pairs: &'a [Pair],
}

impl Encoder {
    /// Content of the frame for `regions` tracks, which replaces all that each had; with the same rules
    /// as [`Encoder::points`].
    ///
    /// # Errors
    /// 2004, 2019, 2027, 3403, 3404, 3407, 4008 before the first group, 4009, 4010, 4012 for regions
    /// that contradict the track or each other.
    pub fn regions(
        &mut self,
        out: &mut Vec<u8>,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        let bytes = |update: &Update<'_>| 40 * update.regions.len() + 4 * update.pairs.len();
        self.content(
            out,
            (ModelKind::Regions, compression),
            Coverage::Keyframe,
            updates,
            bytes,
            |session, _, now, payload| {
                let set_of = |id| {
                    let set = session.track(id)?.track.region_set();
                    set.ok_or(ErrorKind::TrackModel)
                };
                write_payload(now, set_of, payload)
            },
        )
    }
}

/// Appends the payload. `set_of` finds a declared track of the model.
fn write_payload<'v>(
    updates: &[Update<'_>],
    set_of: impl Fn(u32) -> core::result::Result<&'v RegionSet, ErrorKind>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let count = |n: usize| u32::try_from(n).map_err(|_| ErrorKind::EncoderUse);
    if !updates.is_sorted_by(|a, b| a.track < b.track) {
        return Err(ErrorKind::EntryOrder);
    }
    write_header(None, count(updates.len())?, out);
    let mut entry = out.len();
    for update in updates {
        put_u32(out, update.track);
        put_u32(out, 0);
        put_u32(out, 0);
    }
    for update in updates {
        let start = out.len();
        write_track(set_of(update.track)?, update, out)?;
        let size = count(out.len() - start)?;
        out[entry + 4..entry + 8].copy_from_slice(&size.to_le_bytes());
        entry += 12;
    }
    Ok(())
}

fn write_track(
    set: &RegionSet,
    update: &Update<'_>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    if update.regions.len() != set.count as usize {
        return Err(ErrorKind::EncoderUse);
    }
    let mut forms = Vec::with_capacity(update.regions.len());
    let mut codes = Vec::with_capacity(2 * update.pairs.len());
    let mut first = 0;
    for region in update.regions {
        let form = set.check_region(region, first, update.pairs)?;
        let values = update.pairs[first..].as_flattened()[..form.coefficients()].iter();
        codes.extend(values.map(|value| value / set.step as i16));
        first += form.pairs();
        forms.push(form);
    }
    if first != update.pairs.len() {
        return Err(ErrorKind::EncoderUse);
    }
    match set.coding {
        Coding::Raw => {
            raw::write(update.regions, &codes, out);
            Ok(())
        }
        Coding::Packed => write_packed(set, update.regions, &forms, &codes, out),
    }
}

fn write_packed(
    set: &RegionSet,
    regions: &[Region],
    forms: &[Form],
    codes: &[i16],
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    for region in regions {
        out.extend_from_slice(&region.bytes()[..24]);
    }
    let bitmap = out.len();
    out.resize(bitmap + regions.len().div_ceil(8), 0);
    for (at, (region, form)) in regions.iter().zip(forms).enumerate() {
        if !form.centred {
            out[bitmap + at / 8] |= 1 << (at % 8);
            out.extend_from_slice(&region.bytes()[24..36]);
        }
    }
    let of_regions = || {
        let mut rest = codes;
        forms.iter().map(move |&form| {
            let (codes, later) = rest.split_at(form.coefficients());
            rest = later;
            (form, codes)
        })
    };
    let mut contexts = contexts::initial();
    let mut writer = entropy::Writer::new(out, &mut contexts);
    let (signals, follow) = (set.signals.count, follow(of_regions()));
    let mut walk = Walk::start(&mut writer, signals, set.step, follow);
    for (form, wanted) in of_regions() {
        walk.form(&mut writer, form);
        let mut codes = [0; MOST_COEFFICIENTS];
        codes[..wanted.len()].copy_from_slice(wanted);
        walk.codes(&mut writer, &mut codes)?;
    }
    writer.end();
    Ok(())
}
