//! zstd frames, put together by hand.

use super::{
    FIRST_PAYLOAD, Frame, ZSTD, block, first_stored, rate, raw, runs, track_stored, with_path,
};
use crate::generate::Draft;
use crate::generate::plan::AREA;

/// Frame headers in all forms.
pub fn zstd_frames(drafts: &mut Vec<Draft>) {
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
        "zstd-content-size-longer-than-expected",
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
    let (payload, _) = with_path(&[b'q'; 1024]);
    let blocks = [
        block(false, 0, 140, &payload[..140]),
        block(true, 1, 1024, b"q"),
    ]
    .concat();
    good(
        "zstd-block-as-large-as-window",
        "An RLE block of exactly the window's 1024 bytes.",
        payload.len(),
        &Frame::windowed(0, payload.len() as u32, blocks),
    );
}

/// Blocks in all forms.
pub fn zstd_content(drafts: &mut Vec<Draft>) {
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
    // The C library refused the first of these up to 1.5.5, the second up to 1.5.2.
    good(
        "zstd-no-sequences-in-two-bytes",
        "A compressed block of raw literals, whose number of sequences is 0 in two bytes.",
        compressed(true, &[&[8 << 3][..], &rate, &[0x80, 0]].concat()),
    );
    good(
        "zstd-compressed-without-content",
        "A compressed block without literals and sequences, before a raw one.",
        [compressed(false, &[0, 0]), raw(true, &rate)].concat(),
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

pub fn zstd_frame_faults(drafts: &mut Vec<Draft>) {
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
    // A single segment of 8 bytes has a window of 8.
    bad(
        "zstd-compressed-block-above-window",
        "A compressed block of 10 bytes, which decodes to 8, where the window is 8.",
        8,
        &Frame::new(
            8,
            compressed(true, &[&[8 << 3][..], &rate(), &[0]].concat()),
        )
        .bytes(),
    );
    bad(
        "zstd-raw-block-above-window",
        "A raw block of 1025 bytes, where the window is 1024.",
        1025,
        &Frame::windowed(0, 1025, raw(true, &[7; 1025])).bytes(),
    );
    bad(
        "zstd-rle-block-above-window",
        "An RLE block of 1025 bytes, where the window is 1024.",
        1025,
        &Frame::windowed(0, 1025, block(true, 1, 1025, &[7])).bytes(),
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

pub fn zstd_content_faults(drafts: &mut Vec<Draft>) {
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
        "zstd-byte-after-no-sequences",
        "A byte follows the number of sequences of a compressed block, which is 0.",
        compressed(true, &[&[8 << 3][..], &rate, &[0, 0]].concat()),
    );
    bad(
        "zstd-byte-after-no-sequences-in-two-bytes",
        "A byte follows the number of sequences, which is 0 in two bytes.",
        compressed(true, &[&[8 << 3][..], &rate, &[0x80, 0, 0]].concat()),
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

/// A compressed block.
fn compressed(last: bool, content: &[u8]) -> Vec<u8> {
    block(last, 2, content.len(), content)
}
