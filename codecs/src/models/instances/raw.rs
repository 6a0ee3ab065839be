//! The syntax of `raw` entries, `spec/instances.md` §5: keys, a bitmap of forms, codes.

use alloc::vec::Vec;

use super::state::Entries;
use super::{Entry, Form, Table};
use crate::error::ErrorKind;
use crate::wire::put_u64;

/// Reads all entries of a table.
pub(super) fn read(bytes: &[u8], table: &Table, entries: &mut Entries) -> Result<(), ErrorKind> {
    let count = table.count as usize;
    let too_short = ErrorKind::InstancesSize;
    let (keys, rest) = bytes.split_at_checked(8 * count).ok_or(too_short)?;
    let (forms, codes) = rest.split_at_checked(count.div_ceil(8)).ok_or(too_short)?;
    let past = count % 8;
    if past > 0 && forms.last().is_some_and(|last| last >> past != 0) {
        return Err(ErrorKind::InstancesReserved);
    }
    let linear: u32 = forms.iter().map(|byte| byte.count_ones()).sum();
    let numbers = (count + 3 * linear as usize) * table.signals();
    if codes.len() != 2 * numbers {
        return Err(ErrorKind::InstancesSize);
    }
    let mut codes = codes.as_chunks::<2>().0.iter();
    for (index, key) in keys.as_chunks::<8>().0.iter().enumerate() {
        let form = match forms[index / 8] >> (index % 8) & 1 {
            0 => Form::Scalar,
            _ => Form::Linear,
        };
        entries.start(u64::from_le_bytes(*key))?;
        for _ in 0..table.signals() {
            let mut signal = [0; 4];
            // Their number was checked.
            for (code, bytes) in signal
                .iter_mut()
                .zip(codes.by_ref().take(form.coefficients()))
            {
                *code = i16::from_le_bytes(*bytes);
            }
            entries.signal(table, signal.map(i32::from))?;
        }
    }
    Ok(())
}

/// Appends all entries.
pub(super) fn write(table: &Table, entries: &[Entry], out: &mut Vec<u8>) {
    entries.iter().for_each(|entry| put_u64(out, entry.key));
    for eight in entries.chunks(8) {
        let bits = eight.iter().enumerate();
        let bits = bits.map(|(at, entry)| u8::from(entry.form == Form::Linear) << at);
        out.push(bits.sum());
    }
    for entry in entries {
        for signal in &entry.codes[..table.signals()] {
            let codes = signal[..entry.form.coefficients()].iter();
            codes.for_each(|code| out.extend_from_slice(&code.to_le_bytes()));
        }
    }
}
