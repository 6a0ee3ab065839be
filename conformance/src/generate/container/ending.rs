//! The end record, bytes after it, and input that stops before it.

use super::empty_frame;
use crate::generate::Draft;
use crate::generate::plan::{AREA, Plan, at, payload, refused};
use crate::stream_builder::{HEADER, Pack, kind};

/// The end record, and what follows it.
pub fn ends(drafts: &mut Vec<Draft>) {
    drafts.extend([
        payload(
            (1024, "end-count-above"),
            &["C-101"],
            at::END,
            "The end counts a record too many.",
            |p| p[0] += 1,
        ),
        payload(
            (1024, "end-count-below"),
            &["C-101"],
            at::END,
            "The end counts a record too few.",
            |p| p[0] -= 1,
        ),
        payload(
            (1024, "end-count-high-word"),
            &["C-101"],
            at::END,
            "The count has 64 bits.",
            |p| p[7] = 0x80,
        ),
        payload(
            (1025, "end-digest"),
            &["C-101"],
            at::END,
            "The digest of the stream is off by a bit.",
            |p| p[8] ^= 1,
        ),
        payload(
            (1025, "end-digest-high-word"),
            &["C-101"],
            at::END,
            "The digest of the stream is off by its highest bit.",
            |p| p[15] ^= 0x80,
        ),
        payload(
            (1024, "count-before-digest"),
            &["C-101", "C-112"],
            at::END,
            "Count and digest do not match: the count is checked first.",
            |p| {
                p[0] += 1;
                p[8] ^= 1;
            },
        ),
        payload(
            (2001, "end-short"),
            &["C-040"],
            at::END,
            "The payload of an end is a byte short.",
            |p| p.truncate(15),
        ),
        payload(
            (2001, "end-long"),
            &["C-040"],
            at::END,
            "The payload of an end is a byte long.",
            |p| p.push(0),
        ),
        payload(
            (2001, "end-empty"),
            &["C-040"],
            at::END,
            "The payload of an end has nothing in it.",
            |p| p.clear(),
        ),
        payload(
            (2001, "end-size-before-count"),
            &["C-040", "C-112"],
            at::END,
            "An end is too long and counts wrong: the size is checked first.",
            |p| {
                p[0] += 1;
                p.push(0);
            },
        ),
    ]);
    // The open frame begins with a group, with a transforms record, with a points record.
    let usual = Plan::usual;
    for (name, count, comment) in [
        (
            "end-after-group",
            at::POINTS,
            "The end comes after a group without a commit.",
        ),
        (
            "end-after-transforms",
            at::COMMIT,
            "The end comes after transforms without a commit.",
        ),
        (
            "end-after-points",
            at::SECOND_TRANSFORMS,
            "The end comes after points without a commit.",
        ),
    ] {
        drafts.push(refused(
            (4006, name),
            &["C-100", "C-044"],
            count,
            comment,
            usual().up_to(count),
        ));
    }
    let open = usual().up_to(at::POINTS);
    let (offset, bytes) = open.clone().with_payload(at::POINTS, |p| p[0] += 1);
    drafts.push(Draft::invalid(
        AREA,
        (4006, "open-before-count"),
        offset,
        &["C-100", "C-112"],
        "A frame is open at the end, and the count is wrong: the frame is checked first.",
        bytes,
    ));
    let (offset, bytes) = open.with_payload(at::POINTS, |p| p.push(0));
    drafts.push(Draft::invalid(
        AREA,
        (2001, "end-size-before-open"),
        offset,
        &["C-040", "C-112"],
        "A frame is open at the end, which is too long: the size is checked first.",
        bytes,
    ));
    // What a digest of other bytes would be: without skipped records it has to differ.
    let mut builder = usual().up_to(at::GROUP).start();
    let without = builder.end_payload();
    builder.put_with(0x7000, Pack::None, b"abc", |h| h.critical = false);
    let mut payload = 3u64.to_le_bytes().to_vec();
    payload.extend(&without[8..]);
    builder.put(kind::END, &payload);
    drafts.push(Draft::invalid(
        AREA,
        (1025, "end-digest-without-skipped"),
        builder.last() + HEADER,
        &["C-101", "C-017"],
        "The digest of the stream leaves a skipped record out.",
        builder.bytes,
    ));

    let whole = usual().bytes();
    for (name, more, comment) in [
        ("byte-after-end", vec![0], "One zero byte follows the end."),
        (
            "stream-after-end",
            empty_frame().ended(),
            "A second stream follows the end.",
        ),
    ] {
        drafts.push(Draft::invalid(
            AREA,
            (1020, name),
            whole.len(),
            &["C-102"],
            comment,
            [&whole[..], &more].concat(),
        ));
    }
}

/// Input that stops too early.
pub fn truncated(drafts: &mut Vec<Draft>) {
    let builder = Plan::usual().builder(at::END, |_| {});
    let (starts, bytes) = (&builder.starts, &builder.bytes);
    let cut = |name: &str, clauses: &[&'static str], comment: &str, length: usize| {
        Draft::invalid(
            AREA,
            (1019, name),
            length,
            clauses,
            comment,
            bytes[..length].to_vec(),
        )
    };
    drafts.extend([
        cut("empty", &["C-103"], "No byte at all.", 0),
        cut("one-byte", &["C-103"], "One byte of the preamble.", 1),
        cut(
            "preamble-cut",
            &["C-103"],
            "The preamble lacks its last byte.",
            15,
        ),
        cut(
            "preamble-alone",
            &["C-103"],
            "Nothing follows the preamble.",
            16,
        ),
        cut(
            "header-cut",
            &["C-103"],
            "A header lacks its last byte.",
            starts[at::COMMIT] + 31,
        ),
        cut(
            "header-alone",
            &["C-103"],
            "A payload is missing.",
            starts[at::COMMIT] + 32,
        ),
        cut(
            "payload-cut",
            &["C-103"],
            "A payload lacks its last byte.",
            starts[at::DELTA] - 1,
        ),
        cut("no-end", &["C-103"], "The end is missing.", starts[at::END]),
        cut(
            "end-header-alone",
            &["C-103"],
            "The payload of the end is missing.",
            starts[at::END] + 32,
        ),
        cut(
            "end-cut",
            &["C-103"],
            "The end lacks its last byte.",
            bytes.len() - 1,
        ),
        cut(
            "frame-open",
            &["C-103"],
            "The input ends within a frame.",
            starts[at::COMMIT],
        ),
    ]);
    let mut wrong = bytes[..15].to_vec();
    wrong[0] = 0;
    drafts.push(Draft::invalid(
        AREA,
        (1019, "preamble-cut-before-magic"),
        15,
        &["C-103", "C-112"],
        "A preamble with another magic is a byte short: it is checked when all is there.",
        wrong,
    ));
    let (header, faulty) = Plan::usual().with_header(at::GROUP, |h| h.header_crc = 1);
    drafts.push(Draft::invalid(
        AREA,
        (1019, "header-cut-before-checksum"),
        header + 31,
        &["C-103", "C-112"],
        "A damaged header is a byte short: it is checked when all is there.",
        faulty[..header + 31].to_vec(),
    ));
    drafts.push(Draft::invalid(
        AREA,
        (1005, "header-before-payload"),
        header,
        &["C-010", "C-112"],
        "A header is damaged and its payload is missing: the header is checked before.",
        faulty[..header + 32].to_vec(),
    ));
    let (payload, faulty) = Plan::usual().with_payload(at::STREAM, |p| p[0] = 0);
    drafts.push(Draft::invalid(
        AREA,
        (1019, "payload-cut-before-fields"),
        payload + 7,
        &["C-103", "C-112"],
        "A payload with a fault is a byte short: it is checked when all is there.",
        faulty[..payload + 7].to_vec(),
    ));
    // Claims that a product of 32 bits would get wrong.
    for (name, packing, stored, unpacked, comment) in [
        (
            "lz4-ratio-in-64-bits",
            1,
            16_843_010,
            1 << 20,
            "255 times the stored length is beyond 32 bits; the claim is possible, the payload missing.",
        ),
        (
            "zstd-ratio-in-64-bits",
            2,
            131_072,
            100,
            "The most that the stored length can hold is 2^32; the claim is possible, the payload missing.",
        ),
    ] {
        let (header, claim) = Plan::usual().with_header(at::DELTA, |h| {
            (h.packing, h.stored, h.unpacked) = (packing, stored, unpacked);
        });
        drafts.push(Draft::invalid(
            AREA,
            (1019, name),
            header + HEADER,
            &["C-021", "C-103"],
            comment,
            claim[..header + HEADER].to_vec(),
        ));
    }
}

/// Live streams, which may end after any commit.
pub fn live(drafts: &mut Vec<Draft>) {
    let builder = Plan::usual().builder(at::END, |_| {});
    let (starts, bytes) = (&builder.starts, &builder.bytes);
    for (name, length, comment) in [
        (
            "live-after-stream",
            starts[at::TRACK],
            "A live stream ends after its stream record.",
        ),
        (
            "live-after-track",
            starts[at::GROUP],
            "A live stream ends before its first group.",
        ),
        (
            "live-after-commit",
            starts[at::DELTA],
            "A live stream ends after a commit.",
        ),
        (
            "live-after-remove",
            starts[at::THIRD_COMMIT],
            "A live stream ends while a removal waits.",
        ),
        (
            "live-after-last-commit",
            starts[at::END],
            "A live stream ends where its end would stand.",
        ),
        ("live-with-end", bytes.len(), "A live stream with an end."),
    ] {
        drafts.push(Draft::valid(AREA, name, &["C-104"], comment, bytes[..length].to_vec()).live());
    }
    let mut builder = Plan::usual().up_to(at::DELTA).start();
    builder.put_with(0x7000, Pack::None, &[1], |h| h.critical = false);
    drafts.push(
        Draft::valid(
            AREA,
            "live-after-skipped",
            &["C-104", "C-017"],
            "A live stream ends after a skipped record.",
            builder.bytes,
        )
        .live(),
    );
    let mut bad = |fault, clauses: &[&'static str], comment, length: usize| {
        let bytes = bytes[..length].to_vec();
        drafts.push(Draft::invalid(AREA, fault, length, clauses, comment, bytes).live());
    };
    let live = &["C-103", "C-104"];
    bad(
        (1019, "live-empty"),
        live,
        "A live stream without a byte.",
        0,
    );
    bad(
        (1019, "live-preamble"),
        live,
        "A live stream ends after its preamble.",
        16,
    );
    bad(
        (1019, "live-stream-cut"),
        live,
        "A live stream ends within its stream record.",
        starts[at::TRACK] - 1,
    );
    bad(
        (1019, "live-header-cut"),
        live,
        "A live stream ends within a header.",
        starts[at::DELTA] + 1,
    );
    bad(
        (1019, "live-header-alone"),
        live,
        "A live stream ends between a header and its payload.",
        starts[at::DELTA] + 32,
    );
    bad(
        (1019, "live-header-cut-in-frame"),
        live,
        "A live stream ends within a header and a frame: within a record it is truncated.",
        starts[at::SECOND_COMMIT] + 1,
    );
    bad(
        (4006, "live-after-group"),
        &["C-104", "C-044"],
        "A live stream ends after a group.",
        starts[at::POINTS],
    );
    bad(
        (4006, "live-after-points"),
        &["C-104", "C-044"],
        "A live stream ends after a points record.",
        starts[at::SECOND_TRANSFORMS],
    );
    bad(
        (4006, "live-before-commit"),
        &["C-104", "C-044"],
        "A live stream ends right before a commit.",
        starts[at::SECOND_COMMIT],
    );
}
