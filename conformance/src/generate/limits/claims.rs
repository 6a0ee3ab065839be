//! Claims far beyond what is there, and packed payloads that hold more than they say.

use crate::generate::Draft;
use crate::generate::packing::{FIRST_PAYLOAD, Frame, block, first_stored};
use crate::generate::plan::{AREA, Plan, at, header, payload};
use crate::stream_builder::{HEADER, Header, Pack, set_word};

/// Lengths far beyond what is there.
pub fn claims(drafts: &mut Vec<Draft>) {
    let default = 256 << 20;
    let mut claim = |fault: (u16, &str),
                     clauses: &[&'static str],
                     limit,
                     comment: &str,
                     change: fn(&mut Header)| {
        drafts.push(header(fault, clauses, at::TRACK, comment, change).limit(limit, default));
    };
    claim(
        (1012, "four-gib-stored"),
        &["C-018"],
        "stored_bytes",
        "A record claims to store 4 GiB.",
        |h| (h.stored, h.unpacked) = (u32::MAX, u32::MAX),
    );
    claim(
        (1012, "four-gib-stored-lz4"),
        &["C-018"],
        "stored_bytes",
        "A packed record claims to store 4 GiB, for a few bytes.",
        |h| (h.packing, h.stored, h.unpacked) = (1, u32::MAX, 8),
    );
    claim(
        (1012, "stored-above-default"),
        &["C-018"],
        "stored_bytes",
        "A record claims to store a byte more than the default limit.",
        |h| h.stored = (256 << 20) + 1,
    );
    claim(
        (1013, "four-gib-unpacked"),
        &["C-019"],
        "unpacked_bytes",
        "A record claims to unpack to 4 GiB.",
        |h| h.unpacked = u32::MAX,
    );
    claim(
        (1013, "four-gib-unpacked-lz4"),
        &["C-019"],
        "unpacked_bytes",
        "A packed record claims to unpack to 4 GiB.",
        |h| (h.packing, h.unpacked) = (1, u32::MAX),
    );
    claim(
        (1013, "unpacked-above-default"),
        &["C-019"],
        "unpacked_bytes",
        "A packed record claims to unpack to a byte more than the default limit.",
        |h| (h.packing, h.unpacked) = (2, (256 << 20) + 1),
    );
    claim(
        (1014, "quarter-gib-lz4"),
        &["C-021"],
        "unpacked_bytes",
        "An lz4 block of 284 bytes claims the default limit, which it cannot hold.",
        |h| (h.packing, h.unpacked) = (1, 256 << 20),
    );
    claim(
        (1014, "quarter-gib-zstd"),
        &["C-021"],
        "unpacked_bytes",
        "A zstd frame of 284 bytes claims the default limit, which it cannot hold.",
        |h| (h.packing, h.unpacked) = (2, 256 << 20),
    );
    claim(
        (1012, "stored-before-unpacked"),
        &["C-018", "C-019", "C-112"],
        "stored_bytes",
        "Both lengths are beyond the limits: the stored one is checked first.",
        |h| (h.packing, h.stored, h.unpacked) = (2, u32::MAX, u32::MAX),
    );
    claim(
        (1013, "unpacked-before-packing"),
        &["C-019", "C-020", "C-112"],
        "unpacked_bytes",
        "4 GiB in an unknown packing: the length is checked first.",
        |h| (h.packing, h.unpacked) = (9, u32::MAX),
    );
    claim(
        (1021, "version-before-stored"),
        &["C-015", "C-018", "C-112"],
        "stored_bytes",
        "4 GiB of a newer version: the version is checked first.",
        |h| (h.version, h.stored) = (1, u32::MAX),
    );
    // Possible claims, of which nothing came.
    let mut cut = |name, clauses: &[&'static str], comment, change: fn(&mut Header)| {
        let (start, mut bytes) = Plan::usual().with_header(at::DELTA, change);
        bytes.truncate(start + HEADER + 4);
        drafts.push(
            Draft::invalid(AREA, (1019, name), bytes.len(), clauses, comment, bytes)
                .limit("stored_bytes", default),
        );
    };
    cut(
        "quarter-gib-missing",
        &["C-023", "C-103"],
        "A record as large as the limit, of which four bytes came: no memory may be reserved for it.",
        |h| (h.stored, h.unpacked) = (256 << 20, 256 << 20),
    );
    cut(
        "quarter-gib-missing-zstd",
        &["C-023", "C-103"],
        "A frame that may unpack to as much as the limit, of which four bytes came.",
        |h| (h.packing, h.stored, h.unpacked) = (2, 8192, 256 << 20),
    );
    cut(
        "skipped-four-gib-missing",
        &["C-017", "C-103"],
        "A record of 4 GiB is skipped, of which four bytes came.",
        |h| {
            h.critical = false;
            h.record_type = 0x7000;
            h.stored = u32::MAX;
        },
    );
}

/// Packed payloads that hold more than they say.
pub fn bombs(drafts: &mut Vec<Draft>) {
    let mut bomb = |fault, clauses: &[&'static str], comment, stored: &[u8], pack| {
        let bytes = first_stored(pack, 8, stored);
        drafts.push(
            Draft::invalid(AREA, fault, FIRST_PAYLOAD, clauses, comment, bytes)
                .limit("unpacked_bytes", 4096),
        );
    };
    // One literal and a match of 15 + 4 + 255 * 200 bytes.
    let mut lz4 = vec![0x1f, 7, 1, 0];
    lz4.extend([255; 200]);
    lz4.extend([0, 0]);
    bomb(
        (1015, "lz4-bomb"),
        &["C-030"],
        "A block of 200 bytes unpacks to 51 KB, and says 8.",
        &lz4,
        Pack::Lz4,
    );
    let blocks: Vec<u8> = (0..40)
        .flat_map(|i| block(i == 39, 1, 131_072, &[0]))
        .collect();
    bomb(
        (1016, "zstd-bomb"),
        &["C-033"],
        "A frame of 171 bytes decodes to 5 MB, and says 8.",
        &Frame::windowed(7 << 3, 8, blocks.clone()).bytes(),
        Pack::Zstd(0),
    );
    bomb(
        (1017, "zstd-bomb-in-frame-alone"),
        &["C-031"],
        "The frame says 5 MB where the record says 8.",
        &Frame::windowed(7 << 3, 40 * 131_072, blocks.clone()).bytes(),
        Pack::Zstd(0),
    );
    let frame = Frame::windowed(7 << 3, 40 * 131_072, blocks).bytes();
    let bytes = first_stored(Pack::Zstd(0), 40 * 131_072, &frame);
    drafts.push(
        Draft::invalid(
            AREA,
            (1013, "zstd-bomb-said"),
            FIRST_PAYLOAD - HEADER,
            &["C-019"],
            "A frame of 171 bytes says that it decodes to 5 MB, where 4096 are allowed.",
            bytes.clone(),
        )
        .limit("unpacked_bytes", 4096),
    );
    drafts.push(
        Draft::invalid(
            AREA,
            (2001, "zstd-bomb-allowed"),
            FIRST_PAYLOAD,
            &["C-040"],
            "A frame that decodes to 5 MB within the limit, in a record that has 8 bytes.",
            bytes,
        )
        .limit("unpacked_bytes", 40 * 131_072),
    );
}

/// Counts far beyond the payload: nothing may be reserved for them.
pub fn counts(drafts: &mut Vec<Draft>) {
    let most = |p: &mut Vec<u8>| set_word(p, 0, u32::MAX);
    drafts.extend([
        payload(
            (2001, "track-count-most"),
            &["C-040"],
            at::TRACK,
            "A track record counts 2^32 - 1 tracks.",
            most,
        ),
        payload(
            (2001, "remove-count-most"),
            &["C-040"],
            at::REMOVE,
            "A track remove record counts 2^32 - 1 ids.",
            most,
        ),
        payload(
            (2001, "transforms-count-most"),
            &["C-040"],
            at::TRANSFORMS,
            "A transforms record counts 2^32 - 1 transforms.",
            most,
        ),
        payload(
            (3001, "points-count-most"),
            &["P-010"],
            at::POINTS,
            "A points record counts 2^32 - 1 tracks.",
            most,
        ),
    ]);
}
