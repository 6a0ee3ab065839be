//! The codec of instances against what was encoded, and what its specification prints.

use alloc::vec;
use alloc::vec::Vec;

use super::*;
use crate::models::signals::Kernel;
use crate::session::track::Target;
use crate::{Compression, Encoder, EncoderConfig, GroupStart, Limits, StateDigest, decode_all};

const ONE: Signals = Signals::one(Kernel::exponential(2.0));
const TWO: Signals = Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.97);

fn table(signals: Signals, count: u32, step: u16, coding: Coding) -> Table {
    Table {
        signals,
        count,
        exponent: 0,
        step,
        coding,
    }
}

fn track(table: Table) -> Track {
    Track {
        id: 1,
        target: Target::default(),
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Instances(table),
    }
}

fn draw(state: &mut u64) -> u32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 32) as u32
}

fn stream(table: Table, entries: &[Entry]) -> crate::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    encoder.group(&mut bytes, GroupStart::Keyframes)?;
    encoder.tracks(&mut bytes, &[track(table)])?;
    let update = Update { track: 1, entries };
    encoder.instances(&mut bytes, &[update], Compression::None)?;
    let digest = encoder_digest(&table, entries);
    encoder.commit(&mut bytes, 0, Some(digest))?;
    encoder.end(&mut bytes)?;
    Ok(bytes)
}

/// Values of entries, by the specification's words.
fn expected(table: &Table, entries: &[Entry]) -> Vec<Value> {
    let all = entries.iter().flat_map(|e| &e.codes[..table.signals()]);
    let value = |codes: &[i16; 4]| codes.map(|code| code * table.step as i16);
    all.map(value).collect()
}

fn encoder_digest(table: &Table, entries: &[Entry]) -> u64 {
    let keys: Vec<u64> = entries.iter().map(|entry| entry.key).collect();
    let mut digest = StateDigest::new();
    digest.instances(1, None, &keys, &expected(table, entries));
    digest.finish()
}

/// Entries of every sort: hashed keys or neighbours, codes at the ends of their range or in the middle.
fn draw_entries(table: &Table, state: &mut u64) -> Vec<Entry> {
    let dense = draw(state).is_multiple_of(4);
    let wide = draw(state).is_multiple_of(2);
    let mut keys: Vec<u64> = (0..table.count)
        .map(|at| match dense {
            true => u64::MAX - u64::from(at),
            false => u64::from(draw(state)) << 32 | u64::from(draw(state)),
        })
        .collect();
    keys.sort_unstable();
    let most = table.most();
    let entries = keys.into_iter().map(|key| {
        let form = match draw(state) % 3 {
            0 => Form::Scalar,
            _ => Form::Linear,
        };
        let mut codes = [[0; 4]; 2];
        for signal in &mut codes[..table.signals()] {
            for code in &mut signal[..form.coefficients()] {
                let free = (draw(state) % (2 * most as u32 + 1)) as i32 - most;
                *code = match draw(state) % 4 {
                    0 if wide => most as i16,
                    1 if wide => -most as i16,
                    2 if wide => free as i16,
                    _ => (free / 16) as i16,
                };
            }
        }
        Entry { key, form, codes }
    });
    entries.collect()
}

#[test]
fn entries_roundtrip() {
    let mut state = 1;
    for case in 0..400 {
        let signals = [ONE, TWO][case % 2];
        let step = [1, 3, 128, 700, 16384, 32767][draw(&mut state) as usize % 6];
        let count = [1, 2, 3, 7, 8, 9, 60, 257][draw(&mut state) as usize % 8];
        let mut raw = table(signals, count, step, Coding::Raw);
        raw.exponent = (case % 4) as u8;
        let entries = draw_entries(&raw, &mut state);
        for coding in [Coding::Raw, Coding::Packed] {
            let table = Table { coding, ..raw };
            let bytes = stream(table, &entries).unwrap();
            let decoder = decode_all(&bytes, Limits::default(), |_, _| {}).unwrap();
            let track = &decoder.tracks()[0];
            let keys = entries.iter().map(|entry| entry.key);
            assert!(decoder.instances().keys_of(track).iter().copied().eq(keys));
            let values = expected(&table, &entries);
            assert_eq!(decoder.instances().values_of(track), values);
            let per_entry = values.chunks(table.signals());
            for (entry, values) in entries.iter().zip(per_entry) {
                assert_eq!(decoder.instances().find(track, entry.key), Some(values));
            }
            let absent = entries[0].key.wrapping_sub(1);
            if !entries.iter().any(|entry| entry.key == absent) {
                assert_eq!(decoder.instances().find(track, absent), None);
            }
        }
    }
}

/// The bound that the quantiser states, which codes reach; and what lies beyond it is refused.
#[test]
fn quantised_coefficients_are_within_half_a_step() {
    let mut state = 5;
    for exponent in 0..4 {
        for step in [1, 2, 100, 129, 16384, 32767] {
            let mut table = table(ONE, 1, step, Coding::Packed);
            table.exponent = exponent;
            let unit = f64::from(1 << exponent) / 32767.0;
            let bound = f64::from(step) / 2.0 * unit;
            assert!((f64::from(table.worst_coefficient_error()) - bound).abs() < 1e-7 * bound);
            let worst = f64::from(table.worst_error(Form::Linear));
            assert!((worst - 4.0 * bound).abs() < 1e-6 * bound);
            let reach = f64::from(table.most()) * f64::from(step) * unit + bound;
            let mut largest = 0.0f64;
            for _ in 0..4000 {
                let x = f64::from(draw(&mut state)) / f64::from(u32::MAX) * 2.0 - 1.0;
                let x = (x * reach * 1.1) as f32;
                let entry = table.quantize(9, Form::Scalar, &[[x, 0.0, 0.0, 0.0]]);
                if f64::from(x).abs() > reach {
                    assert_eq!(entry.unwrap_err().id, 3305);
                    continue;
                }
                let code = f64::from(entry.unwrap().codes[0][0]);
                largest = largest.max((code * f64::from(step) * unit - f64::from(x)).abs());
            }
            assert!(largest <= bound * 1.0000001, "{largest} {bound}");
            assert!(step < 100 || largest > 0.95 * bound, "{largest} {bound}");
        }
    }
}

#[test]
fn quantiser_refuses_what_is_no_number_or_of_another_shape() {
    let two = table(TWO, 1, 1, Coding::Raw);
    let id = |form, sets: &[[f32; 4]]| two.quantize(0, form, sets).map_err(|e| e.id);
    let fine = [0.5, 0.0, 0.0, 0.0];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e30] {
        assert_eq!(id(Form::Scalar, &[fine, [bad, 0.0, 0.0, 0.0]]), Err(3305));
        assert_eq!(id(Form::Linear, &[[0.0, 0.0, 0.0, bad], fine]), Err(3305));
        // Coefficients that a scalar has not.
        assert!(id(Form::Scalar, &[[0.0, bad, bad, bad], fine]).is_ok());
    }
    assert_eq!(id(Form::Scalar, &[fine]), Err(4012));
    assert_eq!(id(Form::Scalar, &[fine; 3]), Err(4012));
}

#[test]
fn coefficients_of_values_are_snorm() {
    let mut table = table(ONE, 1, 1, Coding::Raw);
    for exponent in 0..4 {
        table.exponent = exponent;
        let scale = (1 << exponent) as f32;
        let got = table.coefficients([32767, -32767, 0, 16384]);
        assert_eq!(got[..3], [scale, -scale, 0.0]);
        assert!((got[3] - scale * 16384.0 / 32767.0).abs() < 1e-6);
    }
}

#[test]
fn encoder_refuses_entries_that_do_not_fit() {
    let table = table(ONE, 2, 100, Coding::Packed);
    let entry = |key, form, codes| Entry {
        key,
        form,
        codes: [codes, [0; 4]],
    };
    let fine = [
        entry(1, Form::Scalar, [327, 0, 0, 0]),
        entry(2, Form::Linear, [-327, 1, 2, 3]),
    ];
    assert!(stream(table, &fine).is_ok());
    let mut second = fine;
    second[0].codes[1][0] = 1;
    for (entries, id) in [
        (&fine[..1], 4012),
        (&[fine[1], fine[0]], 3303),
        (&[fine[0], fine[0]], 3303),
        (&[fine[0], entry(2, Form::Scalar, [0, 0, 0, 1])], 4012),
        (&second, 4012),
        (&[fine[0], entry(2, Form::Linear, [0, 0, 0, 328])], 3305),
        (
            &[fine[0], entry(2, Form::Linear, [i16::MIN, 0, 0, 0])],
            3305,
        ),
    ] {
        assert_eq!(stream(table, entries).unwrap_err().id, id);
    }
}

#[test]
fn parameters_are_checked() {
    let fine = table(TWO, 1, 1, Coding::Raw);
    let bytes = |table| {
        stream(
            table,
            &[Entry {
                key: 0,
                form: Form::Scalar,
                codes: [[0; 4]; 2],
            }],
        )
    };
    assert!(bytes(fine).is_ok());
    for bad in [
        Table { count: 0, ..fine },
        Table {
            count: (1 << 24) + 1,
            ..fine
        },
        Table {
            exponent: 4,
            ..fine
        },
        Table { step: 0, ..fine },
        Table {
            step: 32768,
            ..fine
        },
    ] {
        assert_eq!(bytes(bad).unwrap_err().id, 2030);
    }
}

/// Random bytes decode to entries that the rules allow, or to an error.
#[test]
fn hostile_sections_give_entries_in_range_or_an_error() {
    let mut state = 3;
    let mut fine = 0;
    for case in 0..3000 {
        let count = [1, 2, 5, 100, 1 << 16][case % 5];
        let table = table(
            [ONE, TWO][case % 2],
            count,
            1 + (draw(&mut state) >> 17) as u16,
            Coding::Packed,
        );
        let length = draw(&mut state) as usize % 64;
        let bytes: Vec<u8> = (0..length)
            .map(|_| draw(&mut state) as u8 & !(case as u8 & 1))
            .collect();
        let mut entries = state::Entries::new(&table).unwrap();
        let mut contexts = packed::contexts();
        let reader = crate::entropy::Reader::new(
            &bytes,
            &mut contexts,
            crate::error::ErrorKind::InstancesEntropy,
        );
        let Ok(mut reader) = reader else { continue };
        let result = packed::code(&mut reader, &table, None, &mut entries);
        fine += u32::from(result.is_ok());
        assert!(entries.keys.is_sorted_by(|a, b| a < b));
        assert!(entries.keys.len() <= count as usize);
        let numbers = entries.values.as_flattened();
        assert!(
            numbers
                .iter()
                .all(|&number| number % table.step as i16 == 0 && number != i16::MIN)
        );
    }
    assert!((1..3000).contains(&fine), "{fine}");
}

/// What `packed` saves on entries as a bake has them.
#[test]
fn packed_is_smaller_than_raw() {
    let mut state = 8;
    let mut normal = |mean: f32, deviation: f32| {
        let sum: u32 = (0..12).map(|_| draw(&mut state) >> 16).sum();
        mean + deviation * (sum as f32 / 65535.0 - 6.0)
    };
    let packed = table(ONE, 500, 128, Coding::Packed);
    let mut keys: Vec<u64> = (0..500)
        .map(|at| key(&std::format!("forest/tree {at}")))
        .collect();
    keys.sort_unstable();
    let entries = keys.into_iter().map(|key| {
        let c = [
            normal(0.6, 0.1),
            normal(0.0, 0.04),
            normal(0.05, 0.04),
            normal(0.0, 0.04),
        ];
        packed.quantize(key, Form::Linear, &[c]).unwrap()
    });
    let entries: Vec<Entry> = entries.collect();
    let size = |coding| stream(Table { coding, ..packed }, &entries).unwrap().len();
    let (raw, packed) = (size(Coding::Raw), size(Coding::Packed));
    std::println!("{raw} bytes raw, {packed} packed");
    assert!(packed * 10 < raw * 7);
}

#[test]
fn contexts_are_those_of_the_specification() {
    let chapter = include_str!("../../../../spec/instances.md");
    let table = packed::initial_table();
    let digest = twox_hash::XxHash64::oneshot(0, table);
    assert!(
        chapter.contains(&std::format!("{digest:016x}")),
        "{digest:016x}"
    );
    let block = chapter
        .split("```text\n")
        .find(|block| block.starts_with("140 180"));
    let numbers = block
        .unwrap()
        .split("```")
        .next()
        .unwrap()
        .split_whitespace();
    let numbers: Vec<u8> = numbers.map(|n| n.parse().unwrap()).collect();
    assert_eq!(numbers, table);
    assert_eq!(vec![0u8; 47].len(), table.len());
}

/// Section 11 of the specification: the bytes of its table in both codings, and the digest.
#[test]
fn example_of_the_specification_is_what_is_written() {
    let chapter = include_str!("../../../../spec/instances.md");
    let (_, example) = chapter.split_once("## 11.").unwrap();
    let squeezed: Vec<&str> = example.split_whitespace().collect();
    let squeezed = squeezed.join(" ");
    let entry = |path, form, codes| Entry {
        key: key(path),
        form,
        codes: [codes, [0; 4]],
    };
    let entries = [
        entry("b", Form::Scalar, [20, 0, 0, 0]),
        entry("c", Form::Linear, [24, 0, 2, -1]),
        entry("a", Form::Scalar, [31, 0, 0, 0]),
    ];
    for coding in [Coding::Raw, Coding::Packed] {
        let table = table(ONE, 3, 1024, coding);
        let bytes = stream(table, &entries).unwrap();
        // The head and the table of one track come before the section.
        let record = bytes.windows(3).position(|w| w == [0x23, 0x80, 0]).unwrap() + 32;
        let size = u32::from_le_bytes(bytes[record + 20..record + 24].try_into().unwrap());
        let section = &bytes[record + 28..][..size as usize];
        let hex: Vec<_> = section.iter().map(|b| std::format!("{b:02x}")).collect();
        let hex = hex.join(" ");
        let digest = std::format!("{:016x}", encoder_digest(&table, &entries));
        std::println!("{size} bytes: {hex}, {digest}");
        assert!(squeezed.contains(&hex) && example.contains(&digest));
        assert!(example.contains(&std::format!("{size} bytes")));
    }
}
