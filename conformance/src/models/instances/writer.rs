//! Tables of `instances` and their records, byte by byte, from `spec/instances.md` alone.

use crate::models::Parameters;
use crate::models::entry::Entry;
use crate::models::range::{Bit, Coded, code};
use crate::stream_builder::{floats, words};

/// The parameters of a table as they will stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Signals of a value, and the kinds of both kernels.
    pub signals: u8,
    pub kinds: [u8; 2],
    pub signals_reserved: u8,
    /// Distances of both kernels, and the share of the second.
    pub distances: [f32; 2],
    pub share: f32,
    pub count: u32,
    pub exponent: u8,
    pub reserved: u8,
    pub step: u16,
    /// Not among the parameters: the coding of the track.
    pub is_packed: bool,
}

impl Table {
    /// Raw entries of one signal.
    pub fn raw(count: u32) -> Table {
        Table {
            signals: 1,
            kinds: [1, 0],
            signals_reserved: 0,
            distances: [2.0, 0.0],
            share: 0.0,
            count,
            exponent: 0,
            reserved: 0,
            step: 128,
            is_packed: false,
        }
    }

    /// Packed entries of one signal.
    pub fn packed(count: u32) -> Table {
        Table {
            is_packed: true,
            ..Table::raw(count)
        }
    }

    /// The same with two signals.
    pub fn of_two(self) -> Table {
        Table {
            signals: 2,
            kinds: [1, 1],
            distances: [2.0, 300.0],
            share: 0.75,
            ..self
        }
    }

    /// The 24 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let [a, b] = self.kinds;
        let mut bytes = vec![self.signals, a, b, self.signals_reserved];
        bytes.extend(floats(&self.distances));
        bytes.extend(floats(&[self.share]));
        bytes.extend(words(&[self.count]));
        bytes.extend([self.exponent, self.reserved]);
        bytes.extend(self.step.to_le_bytes());
        bytes
    }

    /// The largest code.
    pub fn most(&self) -> i32 {
        32767 / i32::from(self.step)
    }
}

impl Entry {
    /// An entry of a `track` record of `instances`.
    pub fn of_table(id: u32, table: Table) -> Entry {
        Entry {
            has_hash: 1,
            hash: 0x1000 + u64::from(id),
            path: Vec::new(),
            ..Entry::of(
                id,
                4,
                u16::from(table.is_packed),
                Parameters::Instances(table),
            )
        }
    }

    /// The parameters of an entry of `instances`; `None` for another model.
    pub fn table(&self) -> Option<&Table> {
        let Parameters::Instances(table) = &self.parameters else {
            return None;
        };
        Some(table)
    }
}

/// What a table has of an instance; codes may be beyond what a decoder takes, and keys in any order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instance {
    pub key: u64,
    pub linear: bool,
    /// Codes of both signals; those that its form or its table has not are 0.
    pub codes: [[i32; 4]; 2],
}

impl Instance {
    /// A scalar of one signal.
    pub fn scalar(key: u64, code: i32) -> Instance {
        Instance {
            key,
            linear: false,
            codes: [[code, 0, 0, 0], [0; 4]],
        }
    }

    /// A linear function of one signal.
    pub fn linear(key: u64, codes: [i32; 4]) -> Instance {
        Instance {
            key,
            linear: true,
            codes: [codes, [0; 4]],
        }
    }

    /// The codes that are written of each signal.
    fn written(&self, table: &Table) -> impl Iterator<Item = &[i32]> {
        let count = if self.linear { 4 } else { 1 };
        let signals = self.codes.iter().take(usize::from(table.signals));
        signals.map(move |codes| &codes[..count])
    }
}

/// A section in the coding `raw`.
pub fn raw(table: &Table, instances: &[Instance]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for instance in instances {
        bytes.extend(instance.key.to_le_bytes());
    }
    let forms = bytes.len();
    bytes.resize(forms + instances.len().div_ceil(8), 0);
    for (index, instance) in instances.iter().enumerate() {
        bytes[forms + index / 8] |= u8::from(instance.linear) << (index % 8);
        for &code in instance.written(table).flatten() {
            bytes.extend((code as i16).to_le_bytes());
        }
    }
    bytes
}

/// The numbers b of the contexts (§6.2).
pub const INITIAL: [u8; 47] = [
    140, 180, 40, 8, 11, 8, 11, 128, 128, 128, 128, 8, 16, 33, 63, 123, //
    196, 240, 240, 21, 43, 84, 142, 215, 248, 240, 240, 8, 16, 33, 63, 123, //
    196, 240, 240, 21, 43, 84, 142, 215, 248, 240, 240, 152, 152, 152, 152,
];

/// Numbers of the contexts (§6.2).
mod context {
    pub const KEY: usize = 0;
    pub fn form(before: bool) -> usize {
        1 + usize::from(before)
    }
    pub fn significant(g: usize) -> usize {
        3 + g
    }
    pub fn sign(g: usize) -> usize {
        7 + g
    }
    pub fn prefix(g: usize, e: usize) -> usize {
        11 + 8 * g + e.min(7)
    }
    pub fn suffix(g: usize) -> usize {
        43 + g
    }
}

/// The bits of a section in the coding `packed`. Keys that do not ascend wrap around 2^64, which a
/// decoder refuses.
pub fn bits(table: &Table, instances: &[Instance]) -> Vec<Bit> {
    let mut bits = Vec::new();
    let quotient_bits = (0..)
        .find(|&b| 1u64 << b >= u64::from(table.count))
        .unwrap_or(0);
    let low_bits = 64 - quotient_bits;
    let mut next = 0u64;
    let mut before = false;
    // All codes of a signal and coefficient so far, the expected one first.
    let mut so_far = [const { [const { Vec::new() }; 4] }; 2];
    for of_signal in &mut so_far {
        for (i, codes) in of_signal.iter_mut().enumerate() {
            let scale = i64::from(table.step) << table.exponent;
            codes.push(if i == 0 { 24575 / scale } else { 0 });
        }
    }
    for instance in instances {
        let difference = instance.key.wrapping_sub(next);
        let quotient = u128::from(difference) >> low_bits;
        (0..quotient).for_each(|_| bits.push(Bit::In(context::KEY, true)));
        bits.push(Bit::In(context::KEY, false));
        for at in (0..low_bits).rev() {
            bits.push(Bit::Even(difference >> at & 1 == 1));
        }
        next = instance.key.wrapping_add(1);
        bits.push(Bit::In(context::form(before), instance.linear));
        before = instance.linear;
        for (s, codes) in instance.written(table).enumerate() {
            for (i, &code) in codes.iter().enumerate() {
                let so_far = &mut so_far[s][i];
                let mean = so_far.iter().sum::<i64>().div_euclid(so_far.len() as i64);
                residual(
                    2 * s + usize::from(i > 0),
                    i64::from(code) - mean,
                    &mut bits,
                );
                so_far.push(code.into());
            }
        }
    }
    bits
}

fn residual(g: usize, residual: i64, bits: &mut Vec<Bit>) {
    bits.push(Bit::In(context::significant(g), residual != 0));
    if residual == 0 {
        return;
    }
    bits.push(Bit::In(context::sign(g), residual < 0));
    let m = residual.unsigned_abs();
    let e = m.ilog2() as usize;
    (0..e).for_each(|k| bits.push(Bit::In(context::prefix(g, k), true)));
    if e < 15 {
        bits.push(Bit::In(context::prefix(g, e), false));
    }
    for k in 0..e {
        let one = m >> (e - 1 - k) & 1 == 1;
        bits.push(match k {
            0 => Bit::In(context::suffix(g), one),
            _ => Bit::Even(one),
        });
    }
}

/// Those bits as bytes.
pub fn packed(table: &Table, instances: &[Instance]) -> Coded {
    code(&INITIAL, &bits(table, instances))
}

/// A track's part of a record, with numbers that may be wrong.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub id: u32,
    /// Its size; `None` for the one that fits.
    pub size: Option<u32>,
    pub reserved: u32,
    pub bytes: Vec<u8>,
}

/// Payload of an `instances` record.
pub fn payload(sections: &[Section]) -> Vec<u8> {
    let mut payload = words(&[sections.len() as u32, 1, 0, 0]);
    for section in sections {
        let size = section.size.unwrap_or(section.bytes.len() as u32);
        payload.extend(words(&[section.id, size, section.reserved]));
    }
    payload.extend(sections.iter().flat_map(|section| &section.bytes));
    payload
}

#[cfg(test)]
mod tests {
    use super::*;
    use twox_hash::XxHash64;

    #[test]
    fn contexts_start_as_the_specification_says() {
        let chapter = include_str!("../../../../spec/instances.md");
        let digest = format!("{:016x}", XxHash64::oneshot(0, &INITIAL));
        assert!(chapter.contains(&digest));
    }
}
