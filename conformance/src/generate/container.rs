//! Preamble, record headers, records that are skipped, the end of a stream.

mod ending;
mod headers;

use crate::generate::Draft;
use crate::generate::plan::{AREA, Plan, valid};
use crate::generate::{packing, tracks};
use crate::stream_builder::{StreamBuilder, commit, group, kind};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    whole(drafts);
    preamble(drafts);
    headers::headers(drafts);
    headers::types(drafts);
    headers::lengths(drafts);
    headers::skipped(drafts);
    ending::ends(drafts);
    ending::truncated(drafts);
    ending::live(drafts);
    packing::add(drafts);
    tracks::add(drafts);
}

/// A stream with one frame of nothing.
pub fn empty_frame() -> StreamBuilder {
    let mut builder = StreamBuilder::started();
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    builder
}

fn whole(drafts: &mut Vec<Draft>) {
    drafts.push(Draft::valid(
        AREA,
        "least",
        &["C-001", "C-002", "C-003", "C-004", "C-010", "C-101"],
        "The smallest stream that shows something: one empty frame.",
        empty_frame().ended(),
    ));
    drafts.push(Draft::valid(
        AREA,
        "no-frame",
        &["C-016", "C-101"],
        "Nothing but the stream record and the end.",
        StreamBuilder::started().ended(),
    ));
    drafts.push(valid(
        "usual",
        &["C-012", "C-044", "C-081", "C-088"],
        "Each defined record type at least once, over three frames.",
        &Plan::usual(),
    ));
}

fn preamble(drafts: &mut Vec<Draft>) {
    let mut bad = |fault: (u16, &str), clauses: &[&'static str], comment: &str, bytes: Vec<u8>| {
        drafts.push(Draft::invalid(AREA, fault, 0, clauses, comment, bytes));
    };
    let usual = Plan::usual().bytes();
    // The whole stream after another preamble.
    let after = |mut builder: StreamBuilder| {
        for (record_type, payload) in Plan::usual().records {
            builder.put(record_type, &payload);
        }
        builder.ended()
    };
    let magic = *b"\x89DPL\r\n\x1a\n";
    for (name, at, value, comment) in [
        (
            "magic-seven-bit",
            0,
            0x09,
            "The first byte of the magic has lost its highest bit.",
        ),
        (
            "magic-lower-case",
            1,
            b'd',
            "A letter of the magic is in lower case.",
        ),
        (
            "magic-last-byte",
            7,
            0x0d,
            "The last byte of the magic is another.",
        ),
    ] {
        let mut other = magic;
        other[at] = value;
        let bytes = after(StreamBuilder::with_magic(other, 1, 0));
        bad((1001, name), &["C-001"], comment, bytes);
    }
    bad(
        (1001, "magic-text-transfer"),
        &["C-001"],
        "A transfer as text has taken the carriage returns out.",
        usual.iter().copied().filter(|&b| b != b'\r').collect(),
    );
    bad(
        (1001, "magic-of-png"),
        &["C-001"],
        "Another format: the first bytes of a PNG file.",
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01".to_vec(),
    );
    let damaged = |at: usize, bit: u8| {
        let mut bytes = usual.clone();
        bytes[at] ^= bit;
        bytes
    };
    bad(
        (1002, "preamble-crc"),
        &["C-002"],
        "The lowest bit of the preamble's CRC is flipped.",
        damaged(12, 1),
    );
    bad(
        (1002, "preamble-profile-bit"),
        &["C-002"],
        "A bit of the profile is flipped and the CRC is not recomputed.",
        damaged(11, 0x80),
    );
    bad(
        (1001, "magic-before-checksum"),
        &["C-001", "C-112"],
        "The magic is another and the CRC does not match: the magic is checked first.",
        damaged(3, 1),
    );
    bad(
        (1002, "checksum-before-version"),
        &["C-002", "C-112"],
        "The version is unknown and the CRC does not match: the CRC is checked first.",
        damaged(8, 2),
    );
    for (name, version, comment) in [
        ("version-zero", 0, "Container version 0."),
        ("version-two", 2, "Container version 2."),
        (
            "version-high-byte",
            0x0101,
            "The version's high byte counts: 257.",
        ),
    ] {
        let bytes = after(StreamBuilder::with_preamble(version, 0));
        bad((1003, name), &["C-003"], comment, bytes);
    }
    for (name, profile, comment) in [
        ("profile-datagrams", 1, "The profile kept for datagrams."),
        (
            "profile-high-byte",
            0x0100,
            "The profile's high byte counts.",
        ),
    ] {
        let bytes = after(StreamBuilder::with_preamble(1, profile));
        bad((1004, name), &["C-004"], comment, bytes);
    }
    bad(
        (1003, "version-before-profile"),
        &["C-003", "C-112"],
        "Version and profile are unknown: the version is checked first.",
        after(StreamBuilder::with_preamble(2, 1)),
    );
}
