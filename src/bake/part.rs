//! Parts of a bake: files with the results of some items.
//!
//! ```text
//! magic    8 bytes
//! key      u64     what was baked: scene, settings, program
//! items    u32     of the whole bake
//! here     u32     items in this part
//! per item: number u32, samples u32, and per sample its numbers as f32
//! checksum u64     XXH64 of all bytes before
//! ```
//!
//! All little-endian. A part is read on machines that trust the tasks of their own farm: the checksum
//! finds damage, not malice. Still, no part makes the reader take more memory than the part has bytes.

use super::plan::{Plan, Traced};
use crate::obscurance::Gather;
use std::ops::Range;
use twox_hash::XxHash64;

const MAGIC: &[u8; 8] = b"DAPLPART";

/// Most numbers of a sample ([`Plan::numbers`]).
const MAX_NUMBERS: usize = crate::obscurance::MAX_KERNELS + 1;

/// What tells bakes apart: XXH64 of the program's version, of the bytes of the scene and of whatever
/// else decides the result.
pub fn key(scene: &[u8], settings: &str) -> u64 {
    let text = format!("{} {settings}", env!("CARGO_PKG_VERSION"));
    let seed = XxHash64::oneshot(0, text.as_bytes());
    XxHash64::oneshot(seed, scene)
}

/// The bytes of a part.
pub fn write(plan: &Plan, key: u64, items: Range<usize>, traced: &[Traced]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.extend(key.to_le_bytes());
    for count in [plan.items().len(), items.len()] {
        out.extend((count as u32).to_le_bytes());
    }
    let kernels = plan.numbers() - 1;
    for (number, traced) in items.zip(traced) {
        out.extend((number as u32).to_le_bytes());
        out.extend((traced.len() as u32).to_le_bytes());
        for gather in traced {
            let values = gather.values[..kernels].iter().chain([&gather.back_share]);
            out.extend(values.flat_map(|value| value.to_le_bytes()));
        }
    }
    let checksum = XxHash64::oneshot(0, &out);
    out.extend(checksum.to_le_bytes());
    out
}

/// Collects parts until all items are there.
pub struct Merge<'p, 's> {
    plan: &'p Plan<'s>,
    key: u64,
    items: Vec<Option<Traced>>,
}

impl<'p, 's> Merge<'p, 's> {
    pub fn new(plan: &'p Plan<'s>, key: u64) -> Merge<'p, 's> {
        Merge {
            plan,
            key,
            items: vec![None; plan.items().len()],
        }
    }

    /// Takes a part in. An item that is there already must be the same.
    ///
    /// # Errors
    /// What is wrong with the part, as the end of a sentence that begins with its name.
    pub fn add(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut rest = check(bytes, self.key)?;
        let damaged = || "it is damaged".to_owned();
        let total = take_u32(&mut rest).ok_or_else(damaged)?;
        if total != self.items.len() {
            return Err(format!(
                "it is part of a bake of {total} items, not {}",
                self.items.len()
            ));
        }
        let here = take_u32(&mut rest).ok_or_else(damaged)?;
        let numbers = self.plan.numbers();
        for _ in 0..here {
            let number = take_u32(&mut rest).ok_or_else(damaged)?;
            let count = take_u32(&mut rest).ok_or_else(damaged)?;
            let item = self.plan.items().get(number).ok_or_else(damaged)?;
            let size = count.saturating_mul(4 * numbers);
            if count != item.samples.len() || rest.len() < size {
                return Err(damaged());
            }
            let (samples, after) = rest.split_at(size);
            rest = after;
            let traced: Traced = samples.chunks_exact(4 * numbers).map(gather).collect();
            match &self.items[number] {
                Some(known) if !same(known, &traced) => {
                    return Err(format!(
                        "its item {number} differs from that of another part"
                    ));
                }
                _ => self.items[number] = Some(traced),
            }
        }
        match rest.is_empty() {
            true => Ok(()),
            false => Err(damaged()),
        }
    }

    /// Items that no part had.
    pub fn missing(&self) -> usize {
        self.items.iter().filter(|item| item.is_none()).count()
    }

    /// The results of all items.
    ///
    /// # Errors
    /// A sentence where some are missing.
    pub fn finish(self) -> Result<Vec<Traced>, String> {
        match self.missing() {
            0 => Ok(self.items.into_iter().flatten().collect()),
            missing => Err(format!(
                "parts are missing: {missing} of {} items of work are in none of those that were named",
                self.items.len()
            )),
        }
    }
}

/// The content of a part after its key.
///
/// # Errors
/// As [`Merge::add`].
pub fn check(bytes: &[u8], key: u64) -> Result<&[u8], String> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err("this is not a part of a bake".into());
    };
    let Some((content, checksum)) = bytes.split_last_chunk::<8>() else {
        return Err("it is cut short".into());
    };
    if rest.len() < 16 || XxHash64::oneshot(0, content) != u64::from_le_bytes(*checksum) {
        return Err("it is damaged or cut short; run its task again".into());
    }
    let rest = &content[MAGIC.len()..];
    match rest.split_first_chunk::<8>() {
        Some((found, rest)) if u64::from_le_bytes(*found) == key => Ok(rest),
        _ => Err(
            "it is part of a bake of another scene, with other settings, or by another version"
                .into(),
        ),
    }
}

fn take_u32(rest: &mut &[u8]) -> Option<usize> {
    let (word, after) = rest.split_first_chunk::<4>()?;
    *rest = after;
    Some(u32::from_le_bytes(*word) as usize)
}

fn gather(bytes: &[u8]) -> Gather {
    let mut numbers = [0.0; MAX_NUMBERS];
    for (number, bytes) in numbers.iter_mut().zip(bytes.as_chunks::<4>().0) {
        *number = f32::from_le_bytes(*bytes);
    }
    let kernels = bytes.len() / 4 - 1;
    let mut gather = Gather {
        back_share: numbers[kernels],
        ..Gather::default()
    };
    gather.values[..kernels].copy_from_slice(&numbers[..kernels]);
    gather
}

fn same(a: &[Gather], b: &[Gather]) -> bool {
    let bits = |g: &Gather| (g.values.map(f32::to_bits), g.back_share.to_bits());
    a.iter().map(bits).eq(b.iter().map(bits))
}
