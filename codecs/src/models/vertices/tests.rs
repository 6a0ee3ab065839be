//! Sections, quantisers and the remap against oracles.

use alloc::vec;
use alloc::vec::Vec;

use super::*;
use crate::error::ErrorKind;

fn draw(state: &mut u64) -> u32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 32) as u32
}

fn vertices(count: u32, signals: u8, bits: u8, coding: Coding) -> Vertices {
    let (first, second) = (Kernel::exponential(2.0), Kernel::exponential(300.0));
    Vertices {
        signals: match signals {
            1 => Signals::one(first),
            _ => Signals::two(first, second, 0.97),
        },
        count,
        bits,
        order: Vertices::FILE_ORDER,
        coding,
    }
}

/// All shapes of small tracks.
fn shapes() -> impl Iterator<Item = Vertices> {
    let codings = [Coding::Raw, Coding::Packed].into_iter();
    codings.flat_map(|coding| {
        [5, 8].into_iter().flat_map(move |bits| {
            (1..20).flat_map(move |count| {
                (1..=2).map(move |signals| vertices(count, signals, bits, coding))
            })
        })
    })
}

#[test]
fn expanded_codes_are_the_nearest_bytes() {
    for code in 0..32u8 {
        let exact = f64::from(code) * 255.0 / 31.0;
        assert_eq!(f64::from(sections::expand(code)), exact.round());
    }
    assert_eq!((sections::expand(0), sections::expand(31)), (0, 255));
}

#[test]
fn sections_roundtrip() {
    let mut state = 1;
    for vertices in shapes() {
        let codes: Vec<u8> = (0..vertices.values())
            .map(|_| draw(&mut state) as u8 & vertices.most())
            .collect();
        let mut section = Vec::new();
        sections::write(&vertices, &codes, &mut section);
        assert_eq!(section.len() as u64, sections::bytes(&vertices));
        let mut values = vec![0; codes.len()];
        assert_eq!(sections::read(&vertices, &section, &mut values), Ok(()));
        let wanted: Vec<u8> = match vertices.bits {
            5 => codes.iter().map(|&code| sections::expand(code)).collect(),
            _ => codes,
        };
        assert_eq!(values, wanted, "{vertices:?}");
    }
}

/// Every section of the right size is values, or breaks the one rule that there is.
#[test]
fn sections_are_read_or_refused() {
    let mut state = 2;
    let mut refused = 0;
    for vertices in shapes() {
        for _ in 0..20 {
            let bytes = sections::bytes(&vertices) as usize;
            let section: Vec<u8> = (0..bytes).map(|_| draw(&mut state) as u8 & 0x3f).collect();
            let mut values = vec![0; vertices.values()];
            let read = sections::read(&vertices, &section, &mut values);
            let past = 5 * values.len() % 8;
            let wanted = match (vertices.coding, vertices.bits) {
                (Coding::Raw, 5) if past > 0 && section[bytes - 1] >> past != 0 => {
                    Err(ErrorKind::VerticesReserved)
                }
                (Coding::Packed, 5) if section.iter().any(|&byte| byte > 31) => {
                    Err(ErrorKind::VerticesCode)
                }
                _ => Ok(()),
            };
            assert_eq!(read, wanted, "{vertices:?}");
            refused += u32::from(read.is_err());
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn nearest_codes_err_by_half_a_step() {
    for bits in [5, 8] {
        let most = (1u32 << bits) - 1;
        for step in 0..=4096 {
            let value = step as f32 / 4096.0;
            let error = f32::from(nearest(value, bits)) - value * most as f32;
            assert!(error.abs() <= 0.5, "{value} in {bits} bits: {error}");
        }
        assert_eq!(nearest(f32::NAN, bits), 0);
        assert_eq!(u32::from(nearest(2.0, bits)), most);
    }
}

#[test]
fn dithered_codes_have_the_mean_of_the_value() {
    for bits in [5, 8] {
        let most = (1u32 << bits) - 1;
        for step in 0..=100 {
            let value = step as f32 / 100.0;
            let codes = (1000..2000).map(|vertex| dithered(value, bits, vertex));
            let exact = value * most as f32;
            let mut sum = 0;
            for code in codes {
                assert!((f32::from(code) - exact).abs() <= 1.0, "{value}: {code}");
                sum += u32::from(code);
            }
            let mean = sum as f32 / 1000.0;
            assert!((mean - exact).abs() < 0.01, "{value}: {mean}, not {exact}");
        }
        assert_eq!(u32::from(dithered(1.0, bits, 65535)), most);
        assert_eq!(dithered(f32::NAN, bits, 65535), 0);
    }
}

#[test]
fn remap_is_that_of_a_search_for_each_vertex() {
    let mut state = 3;
    // Few numbers, so that many vertices are equal; -0 is not +0.
    let number = |state: &mut u64| [0.0f32, -0.0, 1.0][draw(state) as usize % 3];
    let bits = |vector: [f32; 3]| vector.map(f32::to_bits);
    for count in [0, 1, 2, 50, 400] {
        let vector = |state: &mut u64| [number(state), number(state), number(state)];
        let positions: Vec<[f32; 3]> = (0..count).map(|_| vector(&mut state)).collect();
        let normals: Vec<[f32; 3]> = (0..count).map(|_| vector(&mut state)).collect();
        for normals in [&normals[..], &[]] {
            let key = |vertex: usize| {
                let normal = normals.get(vertex).copied();
                (bits(positions[vertex]), normal.map(bits))
            };
            let mut distinct = Vec::new();
            let wanted: Vec<u32> = (0..count)
                .map(|vertex| {
                    let known = distinct.iter().position(|&other| other == key(vertex));
                    let index = known.unwrap_or(distinct.len());
                    if known.is_none() {
                        distinct.push(key(vertex));
                    }
                    index as u32
                })
                .collect();
            assert_eq!(remap(&positions, normals), wanted);
        }
    }
}
