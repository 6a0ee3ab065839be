//! The coding `raw`, clauses I-020 to I-025.

use super::{Draft, Place, Table, faults, invalid, ordered, some};
use crate::models::instances::writer::Instance;

pub fn add(drafts: &mut Vec<Draft>) {
    // 9 entries: two bytes of forms, seven bits of them spare. Keys end at 72, forms at 74.
    let table = Table::raw(9);
    faults(
        drafts,
        (3301, "I-021"),
        &table,
        &[
            ("raw-empty", "The section is empty", |s| s.bytes.clear()),
            ("raw-key-short", "The last key lacks a byte", |s| {
                s.bytes.truncate(71)
            }),
            ("raw-no-forms", "No forms follow the keys", |s| {
                s.bytes.truncate(72)
            }),
            ("raw-forms-short", "The forms lack a byte", |s| {
                s.bytes.truncate(73)
            }),
        ],
    );
    faults(
        drafts,
        (3301, "I-023"),
        &table,
        &[
            ("raw-no-codes", "No codes follow the forms", |s| {
                s.bytes.truncate(74)
            }),
            ("raw-code-half", "The last code lacks a byte", |s| {
                _ = s.bytes.pop()
            }),
            ("raw-code-short", "The last code is missing", |s| {
                s.bytes.truncate(s.bytes.len() - 2)
            }),
            ("raw-byte-over", "A byte follows the last code", |s| {
                s.bytes.push(0)
            }),
            ("raw-code-over", "A code follows the last one", |s| {
                s.bytes.extend([0; 2])
            }),
            (
                "raw-form-added",
                "A scalar is said to be linear, and its codes are missing",
                |s| {
                    let free = !s.bytes[72];
                    s.bytes[72] |= free & free.wrapping_neg();
                },
            ),
        ],
    );
    faults(
        drafts,
        (3302, "I-022"),
        &table,
        &[
            (
                "raw-form-past-end",
                "The form of entry 9 of 9 is set",
                |s| s.bytes[73] |= 2,
            ),
            (
                "raw-form-past-end-last",
                "The last bit of the forms is set",
                |s| s.bytes[73] |= 0x80,
            ),
        ],
    );
    let one = Table::raw(1).of_two();
    faults(
        drafts,
        (3302, "I-022"),
        &one,
        &[(
            "raw-of-1-form-past-end",
            "The form of entry 1 of 1 is set",
            |s| s.bytes[8] |= 2,
        )],
    );
    keys(drafts);
    codes(drafts);
    order(drafts);
}

fn keys(drafts: &mut Vec<Draft>) {
    let table = Table::raw(9);
    type Change = fn(&mut Vec<Instance>);
    let cases: [(&str, &str, Change); 6] = [
        ("keys-equal", "Keys 3 and 4 are equal", |i| {
            i[4].key = i[3].key
        }),
        ("keys-swapped", "Keys 3 and 4 are swapped", |i| i.swap(3, 4)),
        ("keys-first-equal", "The first two keys are equal", |i| {
            i[0].key = i[1].key
        }),
        (
            "keys-last-below",
            "The last key is one below that before",
            |i| i[8].key = i[7].key - 1,
        ),
        (
            "keys-signed",
            "Keys ascend as signed numbers, and not as unsigned ones",
            |i| {
                i[0].key = 1 << 63;
                (1..).zip(&mut i[1..]).for_each(|(key, i)| i.key = key);
            },
        ),
        (
            "keys-bytes",
            "Keys ascend with their bytes the other way round",
            |i| (1..).zip(i).for_each(|(at, i)| i.key = at << 56 | (9 - at)),
        ),
    ];
    for (name, comment, change) in &cases[..5] {
        for place in Place::ALL {
            let mut instances = some(&table, 1);
            change(&mut instances);
            let name = format!("raw-{name}-{}", place.name());
            let comment = format!("{comment}, in {}.", place.words());
            let refused = place.with(&table, instances, |_| {});
            drafts.push(invalid((3303, &name), &["I-024"], &comment, refused));
        }
    }
    let (name, comment, change) = cases[5];
    let mut instances = some(&table, 1);
    change(&mut instances);
    instances
        .iter_mut()
        .for_each(|i| i.key = i.key.swap_bytes());
    drafts.push(invalid(
        (3303, &format!("raw-{name}")),
        &["I-024"],
        &format!("{comment}."),
        Place::First.with(&table, instances, |_| {}),
    ));
}

fn codes(drafts: &mut Vec<Draft>) {
    for (step, code) in [
        (1, i32::from(i16::MIN)),
        (2, 16384),
        (2, -16384),
        (128, 256),
        (128, -256),
        (300, 110),
        (32767, 2),
        (32767, -2),
        (20000, i32::from(i16::MAX)),
    ] {
        for (table, at) in [
            (Table::raw(3), [0, 0, 0]),
            (Table::raw(9).of_two(), [8, 1, 3]),
        ] {
            let table = Table { step, ..table };
            let mut instances = some(&table, 2);
            let [entry, signal, coefficient] = at;
            instances[entry].linear = true;
            instances[entry].codes[signal][coefficient] = code;
            let words = if entry == 0 { "first" } else { "last" };
            let sign = if code < 0 { "minus-" } else { "" };
            let name = format!("raw-step-{step}-{sign}{}-{words}", code.abs());
            let comment = format!("The {words} code is {code} and the step {step}.");
            let refused = Place::First.with(&table, instances, |_| {});
            drafts.push(invalid((3305, &name), &["I-025"], &comment, refused));
        }
    }
}

fn order(drafts: &mut Vec<Draft>) {
    let table = Table::raw(9);
    let first = |instances: Vec<Instance>, change: fn(&mut super::Section)| {
        Place::First.with(&table, instances, change)
    };
    let mut swapped = some(&table, 1);
    swapped.swap(0, 1);
    drafts.push(ordered(
        (3302, "raw-forms-then-codes"),
        &["I-022", "I-023"],
        "The unused bits of the forms are checked before the size of the codes.",
        first(some(&table, 1), |s| {
            s.bytes[73] |= 2;
            s.bytes.push(0);
        }),
    ));
    drafts.push(ordered(
        (3301, "raw-codes-then-keys"),
        &["I-023", "I-024"],
        "The size of the codes is checked before the order of keys.",
        first(swapped.clone(), |s| s.bytes.push(0)),
    ));
    let mut both = swapped;
    both[1].codes[0][0] = 300;
    drafts.push(ordered(
        (3303, "raw-key-then-code"),
        &["I-024", "I-025"],
        "The key of an entry is checked before its codes.",
        first(both, |_| {}),
    ));
    let mut both = some(&table, 1);
    both[1].codes[0][0] = 300;
    both.swap(7, 8);
    drafts.push(ordered(
        (3305, "raw-code-then-later-key"),
        &["I-025", "I-024"],
        "The codes of an entry are checked before the keys of those after it.",
        first(both.clone(), |_| {}),
    ));
    drafts.push(ordered(
        (3305, "raw-code-then-bytes-left"),
        &["I-025", "I-013"],
        "A code out of range is found before bytes that no section has.",
        {
            let frames = super::streams(std::slice::from_ref(&table));
            let contents = [super::Content::new(1, both)];
            let mut payload = frames.instances_payload(&contents);
            payload.push(0);
            frames.refused_of(super::kind::INSTANCES, &payload)
        },
    ));
}
