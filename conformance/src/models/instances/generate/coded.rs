//! The coding `packed`: what is refused, clauses I-025 and I-032 to I-034.

use super::{Draft, Place, Table, faults, invalid, ordered, some};
use crate::models::instances::writer::{INITIAL, Instance, bits, packed};
use crate::models::range::{Bit, code};

pub fn add(drafts: &mut Vec<Draft>) {
    lengths(drafts);
    keys(drafts);
    codes(drafts);
}

fn lengths(drafts: &mut Vec<Draft>) {
    let table = Table::packed(6);
    faults(
        drafts,
        (3306, "I-033"),
        &table,
        &[
            ("packed-first-value", "The first four bytes are ff", |s| {
                s.bytes[..4].fill(0xff)
            }),
            (
                "packed-first-value-alone",
                "The section is four bytes ff",
                |s| s.bytes = vec![0xff; 4],
            ),
        ],
    );
    faults(
        drafts,
        (3306, "I-034"),
        &table,
        &[
            (
                "packed-five-zeros",
                "A zero follows the four that may stand at the end",
                |s| {
                    let table = Table::packed(6);
                    s.bytes = packed(&table, &some(&table, 1)).whole();
                    s.bytes.push(0);
                },
            ),
            (
                "packed-many-zeros",
                "A hundred zeros follow the section",
                |s| s.bytes.extend([0; 100]),
            ),
        ],
    );
    for place in Place::ALL {
        // Zeros in place of what is cut give entries that are fine, but the bytes are too few.
        let table = Table::packed(6);
        let ended = (0..).zip(some(&table, 1)).map(|(at, instance)| Instance {
            key: instance.key & if at == 5 { !0xffff_ffff_ffff } else { u64::MAX },
            ..Instance::scalar(instance.key, 190)
        });
        let coded = packed(&table, &ended.collect::<Vec<_>>());
        let short = coded.short();
        let cut = short[..short.len() - 2].to_vec();
        let refused = place.with(&table, some(&table, 1), |s| s.bytes = cut);
        let name = format!("packed-two-short-{}", place.name());
        let comment = format!("Two bytes are missing at the end, in {}.", place.words());
        drafts.push(invalid((3306, &name), &["I-034"], &comment, refused));
    }
    // 6 keys of 61 lower bits each: 45 bytes are enough to look at, and 44 are not.
    for (size, id, clause, comment) in [
        (0, 3306, "I-035", "The section of 6 entries is empty"),
        (8, 3306, "I-035", "The section of 6 entries has 8 bytes"),
        (44, 3306, "I-035", "The section of 6 entries has 44 bytes"),
        (45, 3303, "I-032", "The section of 6 entries has 45 bytes"),
    ] {
        let mut bytes = code(&INITIAL, &[Bit::In(0, true); 8]).short();
        bytes.resize(size, 0);
        let refused = Place::First.with(&table, some(&table, 1), |s| s.bytes = bytes);
        let name = format!("packed-size-{size}");
        let comment = format!("{comment}, and the quotient of the first is too large.");
        let clauses = &[clause, "C-112"];
        drafts.push(invalid((id, &name), clauses, &comment, refused));
    }
    let mut wrong = some(&table, 1);
    wrong[3].codes[0][0] = 300;
    let refused = Place::First.with(&table, wrong, |s| s.bytes.extend([0; 9]));
    drafts.push(ordered(
        (3305, "packed-code-then-length"),
        &["I-025", "I-034"],
        "A code out of range is found before bytes that are over.",
        refused,
    ));
}

/// Sections of these bits.
fn of_bits(drafts: &mut Vec<Draft>, name: &str, comment: &str, table: &Table, bits: &[Bit]) {
    for place in [Place::First, Place::SecondTrack] {
        let mut bytes = code(&INITIAL, bits).short();
        // As long as a section of so many entries has to be.
        bytes.resize(bytes.len().max(8 * table.count as usize), 0);
        let refused = place.with(table, some(table, 1), |s| s.bytes = bytes);
        let name = format!("packed-{name}-{}", place.name());
        let comment = format!("{comment}, in {}.", place.words());
        drafts.push(invalid((3303, &name), &["I-032"], &comment, refused));
    }
}

/// Quotients and keys that are too large.
fn keys(drafts: &mut Vec<Draft>) {
    let goes_on = Bit::In(0, true);
    let one = Table::packed(1);
    of_bits(
        drafts,
        "quotient-1-of-1",
        "A table of one entry has a quotient of 1",
        &one,
        &[goes_on],
    );
    let six = Table::packed(6);
    of_bits(
        drafts,
        "quotient-8-of-6",
        "The quotient of the first key is 8, of 2^61, in a table of 6",
        &six,
        &[goes_on; 8],
    );
    of_bits(
        drafts,
        "quotients-all",
        "The quotient goes on for 3000 bits",
        &six,
        &[goes_on; 3000],
    );
    let eight = Table::packed(8);
    of_bits(
        drafts,
        "quotient-8-of-8",
        "The quotient of the first key is 8, of 2^61, in a table of 8",
        &eight,
        &[goes_on; 8],
    );
    // Keys that do not ascend have a difference beyond 2^64.
    for (name, comment, change) in [
        (
            "keys-equal",
            "The difference leads to the key before, modulo 2^64",
            (|i| i[3].key = i[2].key) as fn(&mut [Instance]),
        ),
        (
            "keys-wrap",
            "The difference leads to a lower key, modulo 2^64",
            |i| i[5].key = i[4].key - 5,
        ),
        ("after-the-last-key", "A key follows 2^64 - 1", |i| {
            i[4].key = u64::MAX;
            i[5].key = 0;
        }),
        ("key-2-64", "The last key is 2^64", |i| i[5].key = 0),
    ] {
        let mut instances = some(&six, 1);
        change(&mut instances);
        of_bits(drafts, name, comment, &six, &bits(&six, &instances));
    }
    let mut wrong = some(&six, 1);
    wrong[2].codes[0][0] = -256;
    wrong[3].key = wrong[2].key;
    drafts.push(ordered(
        (3305, "packed-code-then-key"),
        &["I-025", "I-032"],
        "The codes of an entry are checked before the key of the next.",
        Place::First.with(&six, wrong, |_| {}),
    ));
    let mut wrong = some(&six, 1);
    wrong[3].key = wrong[2].key;
    wrong[3].codes[0][0] = 256;
    drafts.push(ordered(
        (3303, "packed-key-then-code"),
        &["I-032", "I-025"],
        "The key of an entry is checked before its codes.",
        Place::First.with(&six, wrong, |_| {}),
    ));
}

fn codes(drafts: &mut Vec<Draft>) {
    for (step, code) in [
        (1, 32768),
        (1, -32768),
        (2, 16384),
        (128, 256),
        (128, -256),
        (300, 110),
        (32767, 2),
        (32767, -2),
    ] {
        for (table, at) in [
            (Table::packed(3), [0, 0, 0]),
            (Table::packed(9).of_two(), [8, 1, 3]),
        ] {
            let table = Table { step, ..table };
            let mut instances = some(&table, 2);
            let [entry, signal, coefficient] = at;
            instances[entry].linear = true;
            instances[entry].codes[signal][coefficient] = code;
            let words = if entry == 0 { "first" } else { "last" };
            let sign = if code < 0 { "minus-" } else { "" };
            let name = format!("packed-step-{step}-{sign}{}-{words}", code.abs());
            let comment = format!("The {words} code is {code} and the step {step}.");
            let refused = Place::First.with(&table, instances, |_| {});
            drafts.push(invalid((3305, &name), &["I-025"], &comment, refused));
        }
    }
    // The longest residual, from a prediction at the other end.
    let table = Table {
        step: 1,
        ..Table::packed(2)
    };
    let wrong = vec![
        Instance::linear(1, [32767, -32767, 32767, -32767]),
        Instance::linear(2, [28671 - 65535, 0, 0, 0]),
    ];
    drafts.push(invalid(
        (3305, "packed-longest-residual"),
        &["I-025"],
        "A residual has the largest magnitude that there is, 65535.",
        Place::First.with(&table, wrong, |_| {}),
    ));
}
