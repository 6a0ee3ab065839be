//! The syntax of `raw` probes, `spec/probes.md` §5: two bitmaps, and 56 bytes a probe.

use alloc::vec::Vec;

use super::{CODES, Probe};
use crate::error::ErrorKind;
use crate::memory::index_set::IndexSet;

/// Bytes of a probe: 27 values and two zeros.
const PROBE_BYTES: usize = 56;

/// Reads the probes of a volume: at first what they change from, afterwards what they come to. Adds
/// those that change to `changed`, and returns how many they are.
pub(super) fn read(
    bytes: &[u8],
    probes: &mut [Probe],
    changed_probes: &mut IndexSet,
) -> Result<u32, ErrorKind> {
    let map_bytes = probes.len().div_ceil(8);
    let maps = bytes.split_at_checked(2 * map_bytes);
    let (maps, values) = maps.ok_or(ErrorKind::ProbesSize)?;
    let (changed, present) = maps.split_at(map_bytes);
    let past = 0xffu8.checked_shl(probes.len() as u32 % 8).unwrap_or(0);
    let past = if probes.len().is_multiple_of(8) {
        0
    } else {
        past
    };
    let set = |map: &[u8]| map.iter().map(|byte| byte.count_ones()).sum::<u32>();
    let padding = |map: &[u8]| map.last().is_some_and(|last| last & past != 0);
    let stray = changed.iter().zip(present).any(|(c, p)| p & !c != 0);
    if padding(changed) || padding(present) || stray {
        return Err(ErrorKind::ProbesReserved);
    }
    if values.len() as u64 != u64::from(set(present)) * PROBE_BYTES as u64 {
        return Err(ErrorKind::ProbesSize);
    }
    let mut values = values.as_chunks::<PROBE_BYTES>().0.iter();
    for (at, (&changed, &present)) in changed.iter().zip(present).enumerate() {
        let mut left = changed;
        while left != 0 {
            let bit = left.trailing_zeros() as usize;
            left &= left - 1;
            let index = 8 * at + bit;
            changed_probes.insert(index);
            let values = (present >> bit & 1 == 1).then(|| values.next());
            probes[index] = match values.flatten() {
                Some(bytes) => read_probe(bytes)?,
                None => Probe::ABSENT,
            };
        }
    }
    Ok(set(changed))
}

fn read_probe(bytes: &[u8; PROBE_BYTES]) -> Result<Probe, ErrorKind> {
    let mut probe = Probe {
        level: 3,
        codes: [0; CODES],
    };
    let words = bytes.as_chunks::<2>().0;
    for (code, word) in probe.codes.iter_mut().zip(words) {
        *code = i16::from_le_bytes(*word);
    }
    check_values(&probe)?;
    if words[CODES] != [0; 2] {
        return Err(ErrorKind::ProbesReserved);
    }
    Ok(probe)
}

/// Values are finite, and those of degree 0 not negative.
fn check_values(probe: &Probe) -> Result<(), ErrorKind> {
    let finite = |&code: &i16| code as u16 & 0x7c00 != 0x7c00;
    if probe.codes.iter().all(finite) && probe.codes[..3].iter().all(|&code| code >= 0) {
        Ok(())
    } else {
        Err(ErrorKind::ProbeValue)
    }
}

/// A probe that an encoder may write.
pub(super) fn check_probe(probe: &Probe) -> Result<(), ErrorKind> {
    let shaped = match probe.level {
        0 => *probe == Probe::ABSENT,
        level => level == 3,
    };
    if shaped {
        check_values(probe)
    } else {
        Err(ErrorKind::EncoderUse)
    }
}

/// Appends the probes that differ from `base`, all present ones in a keyframe.
pub(super) fn write(base: Option<&[Probe]>, probes: &[Probe], out: &mut Vec<u8>) {
    let start = out.len();
    let map_bytes = probes.len().div_ceil(8);
    out.resize(start + 2 * map_bytes, 0);
    for (index, probe) in probes.iter().enumerate() {
        if *probe == base.map_or(Probe::ABSENT, |base| base[index]) {
            continue;
        }
        let (byte, bit) = (start + index / 8, 1 << (index % 8));
        out[byte] |= bit;
        if probe.level > 0 {
            out[byte + map_bytes] |= bit;
            let codes = probe.codes.iter();
            codes.for_each(|code| out.extend_from_slice(&code.to_le_bytes()));
            out.extend_from_slice(&[0; 2]);
        }
    }
}
