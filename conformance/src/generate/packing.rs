//! Packed payloads: lz4 blocks and zstd frames, most of them put together by hand.

use super::Draft;
use super::plan::{AREA, Plan, at, cell};
use crate::forge::{Entry, Forge, HEADER, Pack, Part, commit, group, kind, points, tracks, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    whole_streams(drafts);
    lz4_blocks(drafts);
    lz4_faults(drafts);
    zstd_frames(drafts);
    zstd_content(drafts);
    zstd_frame_faults(drafts);
    zstd_content_faults(drafts);
}

/// What the record under test holds: a tick rate, which the dump shows.
pub fn rate() -> Vec<u8> {
    words(&[0x0a0b_0c0d, 0x0102_0304])
}

const LZ4: Pack = Pack::Lz4;
const ZSTD: Pack = Pack::Zstd(0);

/// A stream whose first record is stored as `stored`.
pub fn first_stored(pack: Pack, unpacked: usize, stored: &[u8]) -> Vec<u8> {
    let mut forge = Forge::new();
    forge
        .put_stored(kind::STREAM, pack, unpacked, stored, |_| {})
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    forge.ended()
}

/// Offset of the first payload.
pub const FIRST_PAYLOAD: usize = 16 + HEADER;

/// A zstd frame with its parts as they will stand there (RFC 8878, section 3.1.1).
#[derive(Clone, Debug)]
pub struct Frame {
    pub magic: u32,
    pub descriptor: u8,
    /// Window descriptor, where there is one.
    pub window: Option<u8>,
    pub content_size: Vec<u8>,
    pub blocks: Vec<u8>,
}

impl Frame {
    /// A single segment of fewer than 256 bytes, and its blocks.
    pub fn new(content: u8, blocks: Vec<u8>) -> Frame {
        Frame {
            magic: 0xfd2f_b528,
            descriptor: 0x20,
            window: None,
            content_size: vec![content],
            blocks,
        }
    }

    /// Not a single segment, with a content size of four bytes.
    pub fn windowed(window: u8, content: u32, blocks: Vec<u8>) -> Frame {
        Frame {
            descriptor: 0x80,
            window: Some(window),
            content_size: content.to_le_bytes().to_vec(),
            ..Frame::new(0, blocks)
        }
    }

    /// The bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.magic.to_le_bytes().to_vec();
        bytes.push(self.descriptor);
        bytes.extend(self.window);
        bytes.extend(&self.content_size);
        bytes.extend(&self.blocks);
        bytes
    }
}

/// A block header: type 0 raw, 1 RLE, 2 compressed, 3 reserved.
pub fn block(last: bool, block_type: u32, size: usize, content: &[u8]) -> Vec<u8> {
    let header = u32::from(last) | block_type << 1 | (size as u32) << 3;
    [&header.to_le_bytes()[..3], content].concat()
}

/// A raw block.
pub fn raw(last: bool, content: &[u8]) -> Vec<u8> {
    block(last, 0, content.len(), content)
}

/// A compressed block.
fn compressed(last: bool, content: &[u8]) -> Vec<u8> {
    block(last, 2, content.len(), content)
}

fn whole_streams(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual();
    let all = |pack: &dyn Fn(usize) -> Pack| {
        let mut forge = Forge::new();
        for (index, (record_type, payload)) in usual.records.iter().enumerate() {
            forge.put_packed(*record_type, pack(index), payload);
        }
        let end = forge.end_payload();
        forge.put_packed(kind::END, pack(at::END), &end);
        forge.bytes
    };
    let mut good = |name: &str, comment: &str, bytes| {
        let clauses = &["C-020", "C-030", "C-034", "C-101"];
        drafts.push(Draft::valid(AREA, name, clauses, comment, bytes));
    };
    good(
        "all-lz4",
        "Each record type packed with lz4, the end too.",
        all(&|_| LZ4),
    );
    good(
        "all-zstd",
        "Each record type packed with zstd, the end too.",
        all(&|_| ZSTD),
    );
    good(
        "all-packings",
        "The three packings in turn.",
        all(&|index| [Pack::None, LZ4, ZSTD][index % 3]),
    );
    // Text that repeats in part, so that literals and sequences are coded.
    let path = |index: u32| {
        let words = ["hall", "roof", "column", "stair", "arch", "lamp"];
        let word = |k: u32| words[(index * k % 6) as usize];
        format!(
            "scene/{}{index}/{}/{}.{:03}",
            word(1),
            word(5),
            word(7),
            index * 37 % 101
        )
    };
    let entries: Vec<Entry> = (0..12)
        .map(|index| Entry {
            path: path(index).into_bytes(),
            application: u64::from(index * index),
            aabb: [0.0, -(index as f32), 0.25, 3.0, 0.5 * index as f32, 7.5],
            ..Entry::new(10 + index)
        })
        .collect();
    let payload = tracks(&entries);
    for (name, pack) in [
        ("tracks-lz4", LZ4),
        ("tracks-zstd-fastest", Pack::Zstd(-5)),
        ("tracks-zstd-1", Pack::Zstd(1)),
        ("tracks-zstd-3", Pack::Zstd(3)),
        ("tracks-zstd-9", Pack::Zstd(9)),
        ("tracks-zstd-15", Pack::Zstd(15)),
        ("tracks-zstd-19", Pack::Zstd(19)),
        ("tracks-zstd-22", Pack::Zstd(22)),
    ] {
        let mut forge = Forge::started();
        forge
            .put_packed(kind::TRACK, pack, &payload)
            .put(kind::GROUP, &group(0, 0, 0))
            .put(kind::COMMIT, &commit(0, 0, None));
        good(
            name,
            "Twelve tracks with paths, packed by a common library.",
            forge.ended(),
        );
    }
    // Content across blocks of the largest size, by hand: a keyframe of many free cells.
    let many = Entry {
        capacity: 8_000,
        ..Entry::new(1)
    };
    let cells: Vec<_> = (0..8_000)
        .map(|index| (index, u32::MAX, Vec::new()))
        .collect();
    let mut part = Part {
        cells,
        ..cell(&many, 0, 5, 200)
    };
    part.cells[0] = cell(&many, 0, 5, 200).cells[0].clone();
    let keyframe = points(None, &[part]);
    let blocks = runs(&keyframe);
    let content = keyframe.len() as u32;
    let frame = Frame::windowed(7 << 3, content, blocks).bytes();
    let mut forge = Forge::started();
    forge
        .put(kind::TRACK, &tracks(&[many]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put_stored(kind::POINTS, ZSTD, content as usize, &frame, |_| {})
        .put(kind::COMMIT, &commit(0, 0, None));
    good(
        "zstd-largest-blocks",
        "A frame of raw and RLE blocks, one of 131072 bytes.",
        forge.ended(),
    );
}

/// Raw and RLE blocks of some content: long runs of a byte become RLE blocks.
fn runs(content: &[u8]) -> Vec<u8> {
    let mut blocks = Vec::new();
    let mut rest = content;
    while let Some(&first) = rest.first() {
        let run = |bytes: &[u8]| bytes.iter().take_while(|&&b| b == bytes[0]).count();
        let length = run(rest).min(131_072);
        let (kind, length) = if length > 64 {
            (1, length)
        } else {
            let plain = (0..rest.len()).find(|&i| run(&rest[i..]) > 64);
            (0, plain.unwrap_or(rest.len()))
        };
        let (head, tail) = rest.split_at(length);
        let stored = if kind == 1 { &[first][..] } else { head };
        blocks.extend(block(tail.is_empty(), kind, length, stored));
        rest = tail;
    }
    blocks
}

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

/// A track record whose path is `path`, and where the path starts in it.
fn with_path(path: &[u8]) -> (Vec<u8>, usize) {
    let entry = Entry {
        path: path.to_vec(),
        ..Entry::new(1)
    };
    (tracks(&[entry]), 8 + 132)
}

/// A stream with one track record, stored as `stored`.
fn track_stored(pack: Pack, unpacked: usize, stored: &[u8]) -> Vec<u8> {
    let mut forge = Forge::started();
    forge
        .put_stored(kind::TRACK, pack, unpacked, stored, |_| {})
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    forge.ended()
}

fn lz4_blocks(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment: &str, bytes| {
        let clauses = &["C-030", "C-034"];
        drafts.push(Draft::valid(AREA, name, clauses, comment, bytes));
    };
    good(
        "lz4-literals",
        "An lz4 block of literals alone, larger than what it holds.",
        first_stored(LZ4, 8, &sequence(&rate(), 0, 0)),
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
    let (payload, _) = with_path(b"abcabcabcabcabcabcabcabcabcabc");
    let (first, second) = (payload.len() - 27, payload.len() - 13);
    let mut block = sequence(&payload[..first], 3, second - first);
    block.extend(sequence(&payload[second..], 0, 0));
    good(
        "lz4-two-sequences",
        "Literals, a match, literals.",
        track_stored(LZ4, payload.len(), &block),
    );
}

fn lz4_faults(drafts: &mut Vec<Draft>) {
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
        "A block of 7 bytes where 8 are due.",
        8,
        &literals(&rate()[..7]),
    );
    bad(
        "lz4-unpacks-to-more",
        "A block of 9 bytes where 8 are due.",
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
        "The block ends where a further length byte is due.",
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
    let mut damaged = Forge::new();
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

/// Frame headers in all forms.
fn zstd_frames(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment: &str, unpacked: usize, frame: &Frame| {
        let bytes = match unpacked {
            8 => first_stored(ZSTD, 8, &frame.bytes()),
            _ => track_stored(ZSTD, unpacked, &frame.bytes()),
        };
        drafts.push(Draft::valid(
            AREA,
            name,
            &["C-031", "C-034"],
            comment,
            bytes,
        ));
    };
    let small = Frame::new(8, raw(true, &rate()));
    good(
        "zstd-single-segment-1",
        "A single segment with a content size of one byte.",
        8,
        &small,
    );
    let (payload, _) = with_path(&[b'q'; 200]);
    let size = payload.len();
    let blocks = runs(&payload);
    let minus = (size as u16 - 256).to_le_bytes().to_vec();
    for (single, window) in [(true, None), (false, Some(0))] {
        let bit = if single { 0x20 } else { 0 };
        let name = if single { "single-segment" } else { "window" };
        for (bytes, flag, content_size) in [
            (2, 0x40, minus.clone()),
            (4, 0x80, (size as u32).to_le_bytes().to_vec()),
            (8, 0xc0, (size as u64).to_le_bytes().to_vec()),
        ] {
            let frame = Frame {
                descriptor: flag | bit,
                window,
                content_size,
                ..Frame::new(0, blocks.clone())
            };
            let what = if single {
                "A single segment"
            } else {
                "A frame with a window descriptor"
            };
            good(
                &format!("zstd-{name}-{bytes}"),
                &format!("{what} and a content size of {bytes} bytes."),
                size,
                &frame,
            );
        }
    }
    let long = Frame {
        descriptor: 0xe0,
        content_size: 8u64.to_le_bytes().to_vec(),
        ..small.clone()
    };
    good(
        "zstd-content-size-longer-than-due",
        "A small content size in eight bytes.",
        8,
        &long,
    );
    let (exact, _) = with_path(&[b'q'; 256 - 8 - 132]);
    let frame = Frame {
        descriptor: 0x60,
        content_size: vec![0, 0],
        ..Frame::new(0, runs(&exact))
    };
    good(
        "zstd-content-size-256",
        "A content size of 256 is 0 in two bytes.",
        exact.len(),
        &frame,
    );
    good(
        "zstd-window-most",
        "A window descriptor of exactly 8 MiB.",
        8,
        &Frame::windowed(13 << 3, 8, raw(true, &rate())),
    );
    good(
        "zstd-window-mantissa",
        "A window descriptor with a mantissa, of 1920 bytes.",
        8,
        &Frame::windowed(7, 8, raw(true, &rate())),
    );
}

/// Blocks in all forms.
fn zstd_content(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment: &str, blocks: Vec<u8>| {
        // A window of 1 KiB, as no block may be larger than its window.
        let bytes = first_stored(ZSTD, 8, &Frame::windowed(0, 8, blocks).bytes());
        drafts.push(Draft::valid(
            AREA,
            name,
            &["C-033", "C-034"],
            comment,
            bytes,
        ));
    };
    let rate = rate();
    good(
        "zstd-two-raw-blocks",
        "Two raw blocks.",
        [raw(false, &rate[..3]), raw(true, &rate[3..])].concat(),
    );
    good(
        "zstd-rle-block",
        "An RLE block of 8 bytes.",
        block(true, 1, 8, &[7]),
    );
    good(
        "zstd-last-block-empty",
        "The last block has no content.",
        [raw(false, &rate), raw(true, &[])].concat(),
    );
    good(
        "zstd-first-block-empty",
        "The first block has no content.",
        [raw(false, &[]), raw(true, &rate)].concat(),
    );
    good(
        "zstd-rle-of-nothing",
        "An RLE block of 0 bytes, which still stores one.",
        [block(false, 1, 0, &[9]), raw(true, &rate)].concat(),
    );
    // Literals section, then the number of sequences: 0.
    good(
        "zstd-raw-literals",
        "A compressed block of raw literals.",
        compressed(true, &[&[8 << 3][..], &rate, &[0]].concat()),
    );
    good(
        "zstd-rle-literals",
        "A compressed block of RLE literals.",
        compressed(true, &[8 << 3 | 1, 5, 0]),
    );
    good(
        "zstd-raw-literals-long-header",
        "Raw literals whose size is coded in 12 bits.",
        compressed(true, &[&[(8 << 4 | 4) as u8, 0][..], &rate, &[0]].concat()),
    );
    // Five literals, one sequence in RLE modes: 5 literals, a match of 3 with offset 1.
    // Codes: literals 5, offset 2 (value 4 to 7, so offset value - 3), match 0 (length 3).
    let rle_modes = |literals: &[u8], offset_value: u8| {
        let count = literals.len() as u8;
        [
            &[count << 3][..],
            literals,
            &[1, 0x54, count, 2, 0, 4 | (offset_value - 4)],
        ]
        .concat()
    };
    good(
        "zstd-sequence-rle-modes",
        "One sequence, each code in RLE mode: a match with offset 1.",
        compressed(true, &rle_modes(&[1, 2, 3, 4, 5], 4)),
    );
    // An offset code of 0 names the first repeat offset, which starts as 1.
    good(
        "zstd-repeat-offset",
        "One sequence with the first repeat offset, 1.",
        compressed(true, &[5 << 3, 1, 2, 3, 4, 5, 1, 0x54, 5, 0, 0, 1]),
    );
    good(
        "zstd-all-block-types",
        "A raw, an RLE and a compressed block.",
        [
            raw(false, &rate[..2]),
            block(false, 1, 2, &[3]),
            compressed(true, &[&[4 << 3][..], &rate[4..], &[0]].concat()),
        ]
        .concat(),
    );
    // A match into the block before, with offset 4.
    good(
        "zstd-match-across-blocks",
        "A match reaches into the block before.",
        [
            raw(false, &rate[..4]),
            compressed(true, &rle_modes(&[9], 7)),
        ]
        .concat(),
    );
}

fn zstd_frame_faults(drafts: &mut Vec<Draft>) {
    let mut bad = |name: &str, comment: &str, unpacked: usize, stored: &[u8]| {
        let bytes = first_stored(ZSTD, unpacked, stored);
        drafts.push(Draft::invalid(
            AREA,
            (1017, name),
            FIRST_PAYLOAD,
            &["C-031"],
            comment,
            bytes,
        ));
    };
    let good = Frame::new(8, raw(true, &rate()));
    let whole = good.bytes();
    let skippable = [
        &0x184d_2a50u32.to_le_bytes()[..],
        &4u32.to_le_bytes(),
        &[1, 2, 3, 4],
    ]
    .concat();
    bad(
        "zstd-magic",
        "Another magic.",
        8,
        &Frame {
            magic: 0xfd2f_b527,
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-skippable-alone",
        "A skippable frame and nothing else.",
        8,
        &skippable,
    );
    bad(
        "zstd-skippable-before",
        "A skippable frame before the frame.",
        8,
        &[&skippable[..], &whole].concat(),
    );
    bad(
        "zstd-skippable-after",
        "A skippable frame after the frame.",
        8,
        &[&whole[..], &skippable].concat(),
    );
    bad(
        "zstd-two-frames",
        "Two frames, whose content is of the right length together.",
        8,
        &[
            Frame::new(4, raw(true, &rate()[..4])).bytes(),
            Frame::new(4, raw(true, &rate()[4..])).bytes(),
        ]
        .concat(),
    );
    bad(
        "zstd-byte-after",
        "A byte follows the last block.",
        8,
        &[&whole[..], &[0]].concat(),
    );
    // XXH64 of the content would follow; four bytes stand for it.
    bad(
        "zstd-content-checksum",
        "The frame has a content checksum.",
        8,
        &[
            &Frame {
                descriptor: 0x24,
                ..good.clone()
            }
            .bytes()[..],
            &[0; 4],
        ]
        .concat(),
    );
    for (name, descriptor, id) in [
        ("zstd-dictionary-1", 0x21, vec![0]),
        ("zstd-dictionary-2", 0x22, vec![0; 2]),
        ("zstd-dictionary-4", 0x23, vec![0; 4]),
    ] {
        let content_size = [&id[..], &[8]].concat();
        let frame = Frame {
            descriptor,
            content_size,
            ..good.clone()
        };
        bad(
            name,
            "The frame has a field for a dictionary id, which is 0.",
            8,
            &frame.bytes(),
        );
    }
    bad(
        "zstd-reserved-bit",
        "The reserved bit of the descriptor is set.",
        8,
        &Frame {
            descriptor: 0x28,
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-unused-bit",
        "The unused bit of the descriptor is set.",
        8,
        &Frame {
            descriptor: 0x30,
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-no-content-size",
        "The frame does not state its content size.",
        8,
        &Frame {
            descriptor: 0,
            window: Some(0),
            content_size: Vec::new(),
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-content-size-above",
        "The content size is a byte more than the unpacked length.",
        8,
        &Frame::new(9, raw(true, &rate())).bytes(),
    );
    bad(
        "zstd-content-size-below",
        "The content size is a byte less than the unpacked length.",
        8,
        &Frame::new(7, raw(true, &rate())).bytes(),
    );
    bad(
        "zstd-content-size-without-256",
        "A content size of 8 in two bytes, which is 264.",
        8,
        &Frame {
            descriptor: 0x60,
            content_size: vec![8, 0],
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-content-size-high-word",
        "The content size has 64 bits.",
        8,
        &Frame {
            descriptor: 0xe0,
            content_size: (8u64 | 1 << 32).to_le_bytes().to_vec(),
            ..good.clone()
        }
        .bytes(),
    );
    bad(
        "zstd-block-type-3",
        "A block of the reserved type.",
        8,
        &Frame::new(8, block(true, 3, 8, &rate())).bytes(),
    );
    bad(
        "zstd-no-last-block",
        "No block says that it is the last.",
        8,
        &Frame::new(8, raw(false, &rate())).bytes(),
    );
    bad(
        "zstd-block-cut",
        "The last block is a byte short.",
        8,
        &whole[..whole.len() - 1],
    );
    bad(
        "zstd-header-cut",
        "The frame ends within its header.",
        8,
        &whole[..5],
    );
    bad(
        "zstd-blocks-missing",
        "The frame ends after its header.",
        8,
        &whole[..6],
    );
    let over = |bytes: u32| Frame::windowed(10 << 3, bytes, block(true, 1, bytes as usize, &[0]));
    bad(
        "zstd-block-too-large",
        "An RLE block of 131073 bytes.",
        131_073,
        &over(131_073).bytes(),
    );
    let mut ordered =
        |id: u16, name: &str, clauses: &[&'static str], comment: &str, stored: &[u8]| {
            let bytes = first_stored(ZSTD, 8, stored);
            drafts.push(Draft::invalid(
                AREA,
                (id, name),
                FIRST_PAYLOAD,
                clauses,
                comment,
                bytes,
            ));
        };
    let wide = Frame::windowed(14 << 3, 8, raw(true, &rate()));
    ordered(
        1017,
        "zstd-descriptor-before-window",
        &["C-031", "C-032", "C-112"],
        "A reserved bit is set and the window is of 16 MiB: the frame header is checked first.",
        &Frame {
            descriptor: 0x88,
            ..wide.clone()
        }
        .bytes(),
    );
    ordered(
        1017,
        "zstd-content-size-before-window",
        &["C-031", "C-032", "C-112"],
        "The content size is wrong and the window is of 16 MiB: the size is checked first.",
        &Frame {
            content_size: vec![9, 0, 0, 0],
            ..wide.clone()
        }
        .bytes(),
    );
    ordered(
        1018,
        "zstd-window-before-blocks",
        &["C-031", "C-032", "C-112"],
        "The window is of 16 MiB and a block of the reserved type: the window is checked first.",
        &Frame {
            blocks: block(true, 3, 8, &rate()),
            ..wide
        }
        .bytes(),
    );
}

fn zstd_content_faults(drafts: &mut Vec<Draft>) {
    let mut bad = |name: &str, comment: &str, blocks: Vec<u8>| {
        let bytes = first_stored(ZSTD, 8, &Frame::windowed(0, 8, blocks).bytes());
        drafts.push(Draft::invalid(
            AREA,
            (1016, name),
            FIRST_PAYLOAD,
            &["C-033"],
            comment,
            bytes,
        ));
    };
    let rate = rate();
    bad(
        "zstd-decodes-to-less",
        "The blocks hold a byte less than the content size.",
        raw(true, &rate[..7]),
    );
    bad(
        "zstd-decodes-to-more",
        "The blocks hold a byte more than the content size.",
        raw(true, &[&rate[..], &[0]].concat()),
    );
    bad(
        "zstd-decodes-to-nothing",
        "The only block has no content.",
        raw(true, &[]),
    );
    bad(
        "zstd-rle-too-long",
        "An RLE block runs past the content size.",
        block(true, 1, 9, &[7]),
    );
    bad(
        "zstd-compressed-empty",
        "A compressed block without a byte.",
        compressed(true, &[]),
    );
    bad(
        "zstd-literals-cut",
        "The literals run past the end of their block.",
        compressed(true, &[&[9 << 3][..], &rate, &[0]].concat()),
    );
    bad(
        "zstd-sequences-missing",
        "A compressed block lacks its number of sequences.",
        compressed(true, &[&[8 << 3][..], &rate].concat()),
    );
    bad(
        "zstd-offset-before-start",
        "A match starts before the content.",
        compressed(true, &[5 << 3, 1, 2, 3, 4, 5, 1, 0x54, 5, 3, 0, 8 | 7]),
    );
    bad(
        "zstd-treeless-first",
        "Literals refer to a Huffman table that never came.",
        compressed(true, &[&[0x83, 0x00, 0x02][..], &rate, &[0]].concat()),
    );
    bad(
        "zstd-repeat-mode-first",
        "A sequence refers to tables that never came.",
        compressed(true, &[5 << 3, 1, 2, 3, 4, 5, 1, 0xfc, 1]),
    );
    bad(
        "zstd-reserved-modes",
        "The reserved bits of the compression modes are set.",
        compressed(true, &[5 << 3, 1, 2, 3, 4, 5, 1, 0x57, 5, 2, 0, 4]),
    );
    bad(
        "zstd-bitstream-without-end",
        "The bitstream of the sequences ends in a zero byte.",
        compressed(true, &[5 << 3, 1, 2, 3, 4, 5, 1, 0x54, 5, 2, 0, 0]),
    );
}
