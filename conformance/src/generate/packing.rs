//! Packed payloads: lz4 blocks and zstd frames, most of them put together by hand.

mod lz4;
mod zstd;

use crate::generate::Draft;
use crate::generate::plan::{AREA, Plan, at, cell};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Grid, Part, points};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    whole_streams(drafts);
    lz4::lz4_blocks(drafts);
    lz4::lz4_faults(drafts);
    zstd::zstd_frames(drafts);
    zstd::zstd_content(drafts);
    zstd::zstd_frame_faults(drafts);
    zstd::zstd_content_faults(drafts);
}

/// What the record under test holds: a tick rate, which the dump shows.
pub fn rate() -> Vec<u8> {
    words(&[0x0a0b_0c0d, 0x0102_0304])
}

const LZ4: Pack = Pack::Lz4;
const ZSTD: Pack = Pack::Zstd(0);

/// A stream whose first record is stored as `stored`.
pub fn first_stored(pack: Pack, unpacked: usize, stored: &[u8]) -> Vec<u8> {
    let mut builder = StreamBuilder::new();
    builder
        .put_stored(kind::STREAM, pack, unpacked, stored, |_| {})
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    builder.ended()
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

fn whole_streams(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual();
    let all = |pack: &dyn Fn(usize) -> Pack| {
        let mut builder = StreamBuilder::new();
        for (index, (record_type, payload)) in usual.records.iter().enumerate() {
            builder.put_packed(*record_type, pack(index), payload);
        }
        let end = builder.end_payload();
        builder.put_packed(kind::END, pack(at::END), &end);
        builder.bytes
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
        let mut builder = StreamBuilder::started();
        builder
            .put_packed(kind::TRACK, pack, &payload)
            .put(kind::GROUP, &group(0, 0, 0))
            .put(kind::COMMIT, &commit(0, 0, None));
        good(
            name,
            "Twelve tracks with paths, packed by a common library.",
            builder.ended(),
        );
    }
    // Content across blocks of the largest size, by hand: a keyframe of many free cells.
    let many = Entry::of_grid(
        1,
        Grid {
            capacity: 8_000,
            ..Grid::default()
        },
    );
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
    let mut builder = StreamBuilder::started();
    builder
        .put(kind::TRACK, &tracks(&[many]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put_stored(kind::POINTS, ZSTD, content as usize, &frame, |_| {})
        .put(kind::COMMIT, &commit(0, 0, None));
    good(
        "zstd-largest-blocks",
        "A frame of raw and RLE blocks, one of 131072 bytes.",
        builder.ended(),
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
    let mut builder = StreamBuilder::started();
    builder
        .put_stored(kind::TRACK, pack, unpacked, stored, |_| {})
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    builder.ended()
}
