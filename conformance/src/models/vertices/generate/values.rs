//! Codes and values, clauses V-020, V-021, V-030, V-031 and V-040.

use super::{Draft, Vertices, invalid, section, some, streams, valid};
use crate::stream_builder::Pack;

/// All shapes of a track but its number of vertices.
fn shapes(count: u32) -> Vec<(&'static str, Vertices)> {
    vec![
        ("raw", Vertices::raw(count)),
        ("raw-two", Vertices::raw(count).two()),
        ("raw-five-bits", Vertices::raw(count).five()),
        ("raw-five-bits-two", Vertices::raw(count).five().two()),
        ("packed", Vertices::packed(count)),
        ("packed-two", Vertices::packed(count).two()),
        ("packed-five-bits", Vertices::packed(count).five()),
        ("packed-five-bits-two", Vertices::packed(count).five().two()),
    ]
}

/// The clause of a shape.
fn clause(vertices: &Vertices) -> &'static str {
    if vertices.packed { "V-030" } else { "V-020" }
}

pub fn add(drafts: &mut Vec<Draft>) {
    // Every length of the last group of raw 5-bit codes, and every place of a track in the array.
    for count in 1..=9 {
        for (name, vertices) in shapes(count) {
            let contents = [(1, some(&vertices, count.into())), (2, some(&vertices, 99))];
            let frames = streams(&[vertices.clone(), vertices.clone()])
                .vertices(&contents)
                .commit();
            let comment = format!("Two tracks of {count} vertices.");
            let clauses = [clause(&vertices), "V-040"];
            let name = format!("{name}-{count}");
            drafts.push(valid(&name, &clauses, &comment, &frames));
        }
    }
    // Every code, at least once from every other one that is a step or half of all away.
    for (name, vertices) in [
        ("codes-all-raw", Vertices::raw(256)),
        ("codes-all-packed", Vertices::packed(256)),
    ] {
        let codes: Vec<u8> = (0..=255u8).map(|code| code.wrapping_mul(129)).collect();
        let frames = streams(std::slice::from_ref(&vertices))
            .vertices(&[(1, codes)])
            .commit();
        let comment = "Every code of 8 bits.";
        drafts.push(valid(name, &[clause(&vertices)], comment, &frames));
    }
    for (name, vertices) in [
        ("codes-all-raw-five-bits", Vertices::raw(32).five()),
        ("codes-all-packed-five-bits", Vertices::packed(32).five()),
    ] {
        let codes: Vec<u8> = (0..32u8).map(|code| code.wrapping_mul(17) % 32).collect();
        let frames = streams(std::slice::from_ref(&vertices))
            .vertices(&[(1, codes)])
            .commit();
        let comment = "Every code of 5 bits, and so every value.";
        let clauses: &[&str] = match vertices.packed {
            true => &["V-030", "V-020"],
            false => &["V-020"],
        };
        drafts.push(valid(name, clauses, comment, &frames));
    }
    differences(drafts);
    packings(drafts);
    unused(drafts);
}

/// Differences at both ends of their range, and their sums around the modulus.
fn differences(drafts: &mut Vec<Draft>) {
    for (name, vertices) in [
        ("differences-wrap", Vertices::packed(8)),
        ("differences-wrap-five-bits", Vertices::packed(8).five()),
    ] {
        let most = vertices.most();
        let codes = vec![0, most, 0, most, most / 2, most / 2 + 1, 0, 1];
        let frames = streams(&[vertices]).vertices(&[(1, codes)]).commit();
        let comment = "Codes go from one end to the other and back.";
        drafts.push(valid(name, &["V-030"], comment, &frames));
    }
    for (name, vertices) in [
        ("open-packed", Vertices::packed(7).two()),
        ("open-packed-five-bits", Vertices::packed(7).five()),
        ("open-raw-five-bits", Vertices::raw(7).five().two()),
    ] {
        let codes = vec![vertices.most(); vertices.values()];
        let frames = streams(&[vertices]).vertices(&[(1, codes)]).commit();
        let comment = "All vertices are open, as they were: packed differences are all 0.";
        drafts.push(valid(name, &["V-030", "V-020", "V-040"], comment, &frames));
    }
    for (name, at, bits) in [("first", 0, 32), ("middle", 5, 0x80), ("last", 11, 255)] {
        let vertices = Vertices::packed(6).five().two();
        let refused = section(&vertices, |section| section.bytes[at] = bits);
        let comment = format!("The {name} difference of 5-bit codes is {bits}.");
        let name = format!("difference-{name}");
        drafts.push(invalid((3205, &name), &["V-031"], &comment, refused));
    }
}

/// Records that are packed, as they are meant to be.
fn packings(drafts: &mut Vec<Draft>) {
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(19))] {
        let tracks = [Vertices::packed(300).two(), Vertices::packed(200).five()];
        let smooth = |vertices: &Vertices| -> Vec<u8> {
            let most = u32::from(vertices.most());
            let code = |k: u32| (k / 3 % (most + 1)) as u8;
            (0..vertices.values() as u32).map(code).collect()
        };
        let contents = [(1, smooth(&tracks[0])), (2, smooth(&tracks[1]))];
        let frames = streams(&tracks).packed(pack).vertices(&contents).commit();
        let name = format!("packed-in-{name}");
        let comment = format!("Two packed tracks in a record in {name}.");
        drafts.push(valid(&name, &["V-030", "C-034"], &comment, &frames));
    }
}

/// Bits after the last raw 5-bit code.
fn unused(drafts: &mut Vec<Draft>) {
    for count in 1..8u32 {
        let vertices = Vertices::raw(count).five();
        let used = 5 * count % 8;
        for (name, bit) in [("lowest", used), ("highest", 7)] {
            let refused = section(&vertices, |section| {
                if let Some(last) = section.bytes.last_mut() {
                    *last |= 1 << bit;
                }
            });
            let comment = format!("The {name} bit after {count} codes of 5 bits is set.");
            let name = format!("unused-{name}-of-{count}");
            drafts.push(invalid((3202, &name), &["V-021"], &comment, refused));
        }
    }
}
