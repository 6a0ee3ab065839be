//! The payload of an `instances` record, written.

use alloc::vec::Vec;

use super::state::Entries;
use super::{Coding, Entry, Form, Table, packed, raw};
use crate::container::Compression;
use crate::encoder::Encoder;
use crate::entropy;
use crate::error::{ErrorKind, Result};
use crate::models::ModelKind;
use crate::models::payload_header::{Coverage, write_header};
use crate::wire::put_u32;

/// Content of one track.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// Id of the track.
    pub track: u32,
    /// All its entries, keys ascending.
    pub entries: &'a [Entry],
}

impl Encoder {
    /// Content of the frame for `instances` tracks, which replaces what they had.
    ///
    /// # Errors
    /// 2004, 2019, 2027, 3303 for keys that do not ascend, 3305 for a code out of its range, 4008 before the
    /// first group, 4009, 4010, 4012 for another number of entries than the track has, or codes that
    /// the form or the track has no place for.
    pub fn instances(
        &mut self,
        out: &mut Vec<u8>,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        self.content(
            out,
            (ModelKind::Instances, compression),
            Coverage::Keyframe,
            updates,
            |update| 24 * update.entries.len(),
            |session, _, now, payload| {
                let table_of = |id| {
                    let track = &session.track(id)?.track;
                    track.instance_table().ok_or(ErrorKind::TrackModel)
                };
                write_payload(now, table_of, payload)
            },
        )
    }
}

/// Appends the payload. `table_of` finds a declared track of the model.
fn write_payload<'t>(
    updates: &[Update<'_>],
    table_of: impl Fn(u32) -> core::result::Result<&'t Table, ErrorKind>,
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
        write_track(table_of(update.track)?, update.entries, out)?;
        let size = count(out.len() - start)?;
        out[entry + 4..entry + 8].copy_from_slice(&size.to_le_bytes());
        entry += 12;
    }
    Ok(())
}

fn write_track(
    table: &Table,
    entries: &[Entry],
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    if entries.len() != table.count as usize {
        return Err(ErrorKind::EncoderUse);
    }
    if !entries.is_sorted_by(|a, b| a.key < b.key) {
        return Err(ErrorKind::InstanceKey);
    }
    entries.iter().try_for_each(|entry| check(table, entry))?;
    match table.coding {
        Coding::Raw => raw::write(table, entries, out),
        Coding::Packed => {
            let mut written = Entries::new(table)?;
            let mut contexts = packed::contexts();
            let mut writer = entropy::Writer::new(out, &mut contexts);
            packed::code(&mut writer, table, Some(entries), &mut written)?;
            writer.end();
        }
    }
    Ok(())
}

/// An entry that an encoder may write.
fn check(table: &Table, entry: &Entry) -> core::result::Result<(), ErrorKind> {
    let (used, unused) = entry.codes.split_at(table.signals());
    let cut = match entry.form {
        Form::Scalar => used.iter().any(|codes| codes[1..] != [0; 3]),
        Form::Linear => false,
    };
    if cut || unused.as_flattened().iter().any(|&code| code != 0) {
        return Err(ErrorKind::EncoderUse);
    }
    let mut codes = used.as_flattened().iter();
    codes.try_for_each(|&code| table.check_code(code.into()))
}
