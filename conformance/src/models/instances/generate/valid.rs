//! Entries that are decoded, clauses I-020, I-026, I-030, I-031 and I-050.

use super::{Content, Draft, Frames, Table, some, streams, valid};
use crate::models::entry::Entry;
use crate::models::instances::writer::Instance;

pub fn add(drafts: &mut Vec<Draft>) {
    counts(drafts);
    keys(drafts);
    codes(drafts);
    predictions(drafts);
}

/// A stream of one table in both codings, the packed one with all zeros at its end, too.
fn both(
    drafts: &mut Vec<Draft>,
    name: &str,
    clauses: [&'static str; 2],
    comment: &str,
    table: &Table,
    instances: &[Instance],
) {
    for (coding, clause) in ["raw", "packed"].into_iter().zip(clauses) {
        let table = Table {
            is_packed: coding == "packed",
            ..table.clone()
        };
        let mut content = Content::new(1, instances.to_vec());
        content.whole = instances.len().is_multiple_of(2);
        let frames = streams(&[table]).instances(&[content]).commit();
        let name = format!("{name}-{coding}");
        drafts.push(valid(&name, &[clause, "I-026", "I-050"], comment, frames));
    }
}

const SYNTAX: [&str; 2] = ["I-020", "I-030"];

fn counts(drafts: &mut Vec<Draft>) {
    for count in [1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 100, 300] {
        for two in [false, true] {
            let table = Table::raw(count);
            let table = if two { table.of_two() } else { table };
            let signals = if two { 2 } else { 1 };
            let name = format!("entries-{count}-of-{signals}");
            let comment = format!("A table of {count} entries of {signals} signals.");
            let instances = some(&table, u64::from(count));
            both(drafts, &name, SYNTAX, &comment, &table, &instances);
        }
    }
    // Two tables of one mesh and path are two tables.
    let tables = [Table::packed(3), Table::packed(3)];
    let entries: Vec<Entry> = (1..)
        .zip(&tables)
        .map(|(id, table)| Entry {
            hash: 5,
            path: b"a path".to_vec(),
            ..Entry::of_table(id, table.clone())
        })
        .collect();
    let contents = [1, 2].map(|id| Content::new(id, some(&tables[0], id.into())));
    drafts.push(valid(
        "same-mesh-twice",
        &["I-030", "I-010"],
        "Two tracks have one mesh, and a path each: a decoder keeps both.",
        Frames::new(&entries).instances(&contents).commit(),
    ));
}

fn keys(drafts: &mut Vec<Draft>) {
    let of = |keys: &[u64]| -> Vec<Instance> {
        let keys = keys.iter().zip(100..);
        keys.map(|(&key, code)| Instance::scalar(key, code))
            .collect()
    };
    let sets: [(&str, &str, &[u64]); 8] = [
        ("key-0", "The key of the only entry is 0.", &[0]),
        (
            "key-most",
            "The key of the only entry is 2^64 - 1.",
            &[u64::MAX],
        ),
        ("keys-from-0", "The keys are 0 to 4.", &[0, 1, 2, 3, 4]),
        (
            "keys-to-most",
            "The keys are the last three that there are.",
            &[u64::MAX - 2, u64::MAX - 1, u64::MAX],
        ),
        (
            "keys-at-both-ends",
            "The keys are the first and the last that there are.",
            &[0, u64::MAX],
        ),
        (
            "keys-about-the-sign",
            "The keys lie about 2^63.",
            &[(1 << 63) - 1, 1 << 63, (1 << 63) + 1],
        ),
        (
            "keys-at-quotients",
            "Differences of the keys lie about multiples of 2^62.",
            &[(1 << 62) - 1, 1 << 63, (3 << 62) + 1],
        ),
        (
            "keys-about-2-32",
            "The keys lie about 2^32.",
            &[u32::MAX as u64 - 1, u32::MAX as u64, 1 << 32, (1 << 32) + 7],
        ),
    ];
    for (name, comment, keys) in sets {
        let table = Table::raw(keys.len() as u32);
        both(drafts, name, SYNTAX, comment, &table, &of(keys));
    }
}

fn codes(drafts: &mut Vec<Draft>) {
    for step in [1, 2, 127, 128, 16383, 16384, 32767] {
        let table = Table {
            step,
            exponent: (step % 4) as u8,
            ..Table::raw(5).of_two()
        };
        let most = table.most();
        let mut instances = some(&table, 3);
        instances[0].linear = true;
        instances[0].codes = [[most; 4], [-most; 4]];
        instances[1].linear = true;
        instances[1].codes = [[-most, most, -most, most], [most, -most, most, -most]];
        instances[2].linear = false;
        instances[2].codes = [[0; 4]; 2];
        instances[3].linear = true;
        instances[3].codes = [[0; 4]; 2];
        let name = format!("codes-of-step-{step}");
        let comment = format!("Codes at both ends of their range and 0, with the step {step}.");
        both(drafts, &name, SYNTAX, &comment, &table, &instances);
    }
    for (name, linear, comment) in [
        ("all-scalar", false, "All entries are scalars."),
        ("all-linear", true, "All entries are linear."),
    ] {
        let table = Table::raw(40);
        let mut instances = some(&table, 6);
        for instance in &mut instances {
            instance.linear = linear;
            instance.codes[0][1..].fill(if linear { 7 } else { 0 });
        }
        both(drafts, name, SYNTAX, comment, &table, &instances);
    }
    let table = Table::raw(20);
    let mut instances = some(&table, 6);
    for instance in &mut instances {
        instance.codes = [[200, 0, 0, 0], [0; 4]];
    }
    let comment =
        "Linear entries whose last codes are 0 are as scalars, of which they stand beside.";
    both(drafts, "linear-of-0", SYNTAX, comment, &table, &instances);
}

/// Means that are negative, and that are rounded.
fn predictions(drafts: &mut Vec<Draft>) {
    let of = |codes: &[[i32; 4]]| -> Vec<Instance> {
        let numbered = (1..).map(|at| at << 58).zip(codes);
        numbered.map(|(key, &c)| Instance::linear(key, c)).collect()
    };
    let cases: [(&str, &str, Vec<Instance>); 3] = [
        (
            "mean-rounds-down",
            "Sums of negative codes that their count does not divide.",
            of(&[[-1; 4], [-2; 4], [-2; 4], [3; 4], [-7; 4], [-7; 4]]),
        ),
        (
            "mean-alternates",
            "Codes at the ends of their range, by turns.",
            of(&[[255, -255, 255, -255], [-255, 255, -255, 255]].repeat(4)),
        ),
        (
            "mean-of-a-form",
            "Coefficients are predicted by those entries that have them.",
            of(&[[200, 50, -50, 9]; 9])
                .into_iter()
                .enumerate()
                .map(|(at, instance)| match at % 3 {
                    2 => instance,
                    _ => Instance::scalar(instance.key, 10 * at as i32),
                })
                .collect(),
        ),
    ];
    for (name, comment, instances) in cases {
        for exponent in [0, 3] {
            let table = Table {
                exponent,
                ..Table::raw(instances.len() as u32)
            };
            let name = format!("{name}-exponent-{exponent}");
            both(
                drafts,
                &name,
                ["I-020", "I-031"],
                comment,
                &table,
                &instances,
            );
        }
    }
}
