//! lz4 blocks, put together by hand.

use super::{FIRST_PAYLOAD, LZ4, first_stored, rate, track_stored, with_path};
use crate::generate::Draft;
use crate::generate::plan::AREA;
use crate::stream_builder::{HEADER, StreamBuilder, kind};

/// An lz4 sequence: literals, then a match unless its length is 0 (LZ4 block format).
fn sequence(literals: &[u8], offset: u16, length: usize) -> Vec<u8> {
    let more = |value: usize, out: &mut Vec<u8>| {
        if value >= 15 {
            let mut left = value - 15;
            while left >= 255 {
                out.push(255);
                left -= 255;
            }
            out.push(left as u8);
        }
    };
    let extra = length.saturating_sub(4);
    let mut out = vec![(literals.len().min(15) << 4 | extra.min(15)) as u8];
    more(literals.len(), &mut out);
    out.extend(literals);
    if length > 0 {
        out.extend(offset.to_le_bytes());
        more(extra, &mut out);
    }
    out
}

pub fn lz4_blocks(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment: &str, bytes| {
        let clauses = &["C-030", "C-034"];
        drafts.push(Draft::valid(AREA, name, clauses, comment, bytes));
    };
    good(
        "lz4-literals",
        "An lz4 block of literals alone, larger than what it holds.",
        first_stored(LZ4, 8, &sequence(&rate(), 0, 0)),
    );
    let mut only = sequence(&rate(), 0, 0);
    only[0] |= 15;
    good(
        "lz4-low-bits-of-only-token",
        "The only token, of literals, has its low four bits set: they are ignored.",
        first_stored(LZ4, 8, &only),
    );
    // Paths of 400 bytes that repeat: head, match, last literals.
    for (name, period, comment) in [
        (
            "lz4-match-offset-1",
            1,
            "A match that overlaps itself with offset 1.",
        ),
        (
            "lz4-match-offset-3",
            3,
            "A match that overlaps itself with offset 3.",
        ),
        ("lz4-match-far", 100, "A match with an offset of 100."),
    ] {
        let path: Vec<u8> = (0..400).map(|i| b'a' + (i % period % 26) as u8).collect();
        let (payload, start) = with_path(&path);
        let (head, tail) = (start + period, payload.len() - 12);
        let mut block = sequence(&payload[..head], period as u16, tail - head);
        block.extend(sequence(&payload[tail..], 0, 0));
        good(name, comment, track_stored(LZ4, payload.len(), &block));
    }
    // Lengths at which the coding of lengths changes: 15 and 270 literals, matches of 18, 19, 274.
    for (name, literals, length, comment) in [
        (
            "lz4-match-18",
            150,
            18,
            "A match of 18 bytes: the largest without a further length byte.",
        ),
        (
            "lz4-match-19",
            150,
            19,
            "A match of 19 bytes: one further length byte, which is 0.",
        ),
        (
            "lz4-match-274",
            150,
            274,
            "A match of 274 bytes: further length bytes 255 and 0.",
        ),
        (
            "lz4-literals-269",
            269,
            20,
            "269 literals: one further length byte, of 254.",
        ),
        (
            "lz4-literals-270",
            270,
            20,
            "270 literals: further length bytes 255 and 0.",
        ),
    ] {
        let (payload, _) = with_path(&[b'z'; 400]);
        let last = literals + length;
        let mut block = sequence(&payload[..literals], 1, length);
        block.extend(sequence(&payload[last..], 0, 0));
        good(name, comment, track_stored(LZ4, payload.len(), &block));
    }
    let (payload, _) = with_path(&[b'z'; 48]);
    for (name, start, end, comment) in [
        (
            "lz4-match-starts-12-before-end",
            12,
            5,
            "A match starts 12 bytes before the end and ends 5 before it: as near as it may.",
        ),
        (
            "lz4-match-ends-5-before-end",
            40,
            5,
            "A match ends 5 bytes before the end.",
        ),
    ] {
        let (first, last) = (payload.len() - start, payload.len() - end);
        let mut block = sequence(&payload[..first], 1, last - first);
        block.extend(sequence(&payload[last..], 0, 0));
        good(name, comment, track_stored(LZ4, payload.len(), &block));
    }
    let (payload, _) = with_path(b"abcabcabcabcabcabcabcabcabcabc");
    let (first, second) = (payload.len() - 27, payload.len() - 13);
    let mut block = sequence(&payload[..first], 3, second - first);
    block.extend(sequence(&payload[second..], 0, 0));
    good(
        "lz4-two-sequences",
        "Literals, a match, literals.",
        track_stored(LZ4, payload.len(), &block),
    );
    let mut last = sequence(&payload[second..], 0, 0);
    last[0] |= 15;
    block.truncate(block.len() - last.len());
    block.extend(last);
    good(
        "lz4-low-bits-of-last-token",
        "The last token, after a match, has its low four bits set: they are ignored.",
        track_stored(LZ4, payload.len(), &block),
    );
}

pub fn lz4_faults(drafts: &mut Vec<Draft>) {
    let mut bad = |name: &str, comment: &str, unpacked: usize, block: &[u8]| {
        let bytes = first_stored(LZ4, unpacked, block);
        drafts.push(Draft::invalid(
            AREA,
            (1015, name),
            FIRST_PAYLOAD,
            &["C-030"],
            comment,
            bytes,
        ));
    };
    let literals = |bytes: &[u8]| sequence(bytes, 0, 0);
    bad(
        "lz4-unpacks-to-less",
        "A block of 7 bytes where 8 are expected.",
        8,
        &literals(&rate()[..7]),
    );
    bad(
        "lz4-unpacks-to-more",
        "A block of 9 bytes where 8 are expected.",
        8,
        &literals(&[&rate()[..], &[0]].concat()),
    );
    bad(
        "lz4-literals-cut",
        "The literals run past the end of the block.",
        8,
        &literals(&rate())[..8],
    );
    bad(
        "lz4-byte-after",
        "A byte follows the last literals.",
        8,
        &[&literals(&rate())[..], &[0xff]].concat(),
    );
    bad(
        "lz4-empty-block",
        "A block without a byte, of nothing.",
        0,
        &[],
    );
    bad(
        "lz4-token-cut",
        "Nothing follows a token that promises more length bytes.",
        8,
        &[0xf0],
    );
    bad(
        "lz4-offset-cut",
        "The block ends within the offset of a match.",
        8,
        &[0x10, 1, 1],
    );
    bad(
        "lz4-match-length-cut",
        "The block ends where a further length byte is expected.",
        24,
        &[0x1f, 1, 1, 0],
    );
    // Four literals, a match, and last literals as an encoder would leave them.
    let with_offset = |offset: u16| {
        let mut block = sequence(&[60, 0, 0, 0], offset, 8);
        block.extend(literals(&[0; 12]));
        block
    };
    bad(
        "lz4-offset-zero",
        "A match with offset 0.",
        24,
        &with_offset(0),
    );
    bad(
        "lz4-offset-before-start",
        "A match that starts before the output.",
        24,
        &with_offset(5),
    );
    bad(
        "lz4-offset-most",
        "A match with offset 65535.",
        24,
        &with_offset(65_535),
    );
    bad(
        "lz4-match-beyond",
        "A match that runs past the unpacked length.",
        8,
        &[&sequence(&rate()[..4], 4, 5)[..], &literals(&[])].concat(),
    );
    // The end-of-block conditions, one by one, in text that a careless decoder gets right.
    let (payload, _) = with_path(&[b'z'; 48]);
    for (name, start, end, comment) in [
        (
            "lz4-match-starts-11-before-end",
            11,
            5,
            "A match starts 11 bytes before the end.",
        ),
        (
            "lz4-match-ends-4-before-end",
            40,
            4,
            "A match ends 4 bytes before the end.",
        ),
        (
            "lz4-match-ends-at-end",
            40,
            0,
            "A match ends at the end, and no literals follow.",
        ),
    ] {
        let (first, last) = (payload.len() - start, payload.len() - end);
        let mut block = sequence(&payload[..first], 1, last - first);
        block.extend(sequence(&payload[last..], 0, 0));
        let bytes = track_stored(LZ4, payload.len(), &block);
        let offset = StreamBuilder::started().bytes.len() + HEADER;
        let draft = Draft::invalid(AREA, (1015, name), offset, &["C-035"], comment, bytes);
        drafts.push(draft);
    }
    let last = payload.len() - 20;
    let block = sequence(&payload[..last], 1, 20);
    let bytes = track_stored(LZ4, payload.len(), &block);
    let offset = StreamBuilder::started().bytes.len() + HEADER;
    drafts.push(Draft::invalid(
        AREA,
        (1015, "lz4-no-last-literals"),
        offset,
        &["C-030", "C-035"],
        "The last sequence is a match: the block ends without the token of its literals.",
        bytes,
    ));
    let mut damaged = StreamBuilder::new();
    damaged.put_stored(kind::STREAM, LZ4, 8, &[0x80], |h| h.payload_crc ^= 1);
    drafts.push(Draft::invalid(
        AREA,
        (1011, "checksum-before-lz4"),
        FIRST_PAYLOAD,
        &["C-022", "C-112"],
        "The payload CRC does not match and the block is cut: the CRC is checked first.",
        damaged.ended(),
    ));
    let bytes = first_stored(LZ4, 9, &literals(&[0; 9]));
    drafts.push(Draft::invalid(
        AREA,
        (2001, "unpacked-size"),
        FIRST_PAYLOAD,
        &["C-040", "C-113"],
        "A packed payload that unpacks to a byte too many for its record.",
        bytes,
    ));
}
