//! The track record: entries, paths, bounds, ids. The parameters of the model are among `points`;
//! here are those that the order of checks needs.

use super::Draft;
use super::plan::{Plan, at, cell, moved, payload, refused, two_tracks, valid};
use crate::forge::{
    Entry, commit, group, kind, points, removal, set_word, tracks, transforms, words,
};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    heads(drafts);
    sizes(drafts);
    fields(drafts);
    numbers(drafts);
    model(drafts);
    paths(drafts);
    order(drafts);
    ids(drafts);
    declared(drafts);
    texts(drafts);
    redeclared(drafts);
}

/// Offset of the first entry of a track record, and of fields in it.
const FIRST: usize = 8;
const PATH: usize = FIRST + 132;
/// Offset of the second entry of the usual stream's tracks.
const SECOND: usize = PATH + 4;

/// A fault in a field of one of the usual stream's tracks.
fn entry(
    name: (u16, &str),
    clauses: &[&'static str],
    which: usize,
    comment: &str,
    change: impl FnOnce(&mut Entry),
) -> Draft {
    let mut entries = two_tracks();
    change(&mut entries[which]);
    payload(name, clauses, at::TRACK, comment, |p| *p = tracks(&entries))
}

fn heads(drafts: &mut Vec<Draft>) {
    let at = at::TRACK;
    drafts.extend([
        payload(
            (2001, "track-head-cut"),
            &["C-040"],
            at,
            "A track record of seven bytes.",
            |p| p.truncate(7),
        ),
        payload(
            (2001, "track-empty"),
            &["C-040"],
            at,
            "A track record of no bytes.",
            |p| p.clear(),
        ),
        payload(
            (2002, "track-reserved"),
            &["C-041"],
            at,
            "The reserved field of a track record is not 0.",
            |p| p[7] = 0x80,
        ),
        payload(
            (2001, "track-count-above"),
            &["C-040"],
            at,
            "Three tracks are counted and two are there.",
            |p| set_word(p, 0, 3),
        ),
        payload(
            (2001, "track-count-below"),
            &["C-040"],
            at,
            "One track is counted and two are there.",
            |p| set_word(p, 0, 1),
        ),
        payload(
            (2001, "track-byte-over"),
            &["C-040"],
            at,
            "Four bytes follow the tracks.",
            |p| p.extend([0; 4]),
        ),
        payload(
            (2002, "track-reserved-before-count"),
            &["C-041", "C-040", "C-112"],
            at,
            "The reserved field is not 0 and a track is missing: the field is checked first.",
            |p| {
                set_word(p, 0, 3);
                p[4] = 1;
            },
        ),
    ]);
}

fn sizes(drafts: &mut Vec<Draft>) {
    let at = at::TRACK;
    let size = |name: &str, comment, value: u32| {
        payload((2001, name), &["C-070"], at, comment, |p| {
            set_word(p, FIRST, value)
        })
    };
    drafts.extend([
        size("track-size-zero", "The size of an entry is 0.", 0),
        size(
            "track-size-eight",
            "The size of an entry is 8, which has no room for its model.",
            8,
        ),
        size(
            "track-size-odd",
            "The size of an entry is no multiple of 4.",
            134,
        ),
        size(
            "track-size-most",
            "The size of an entry is 2^32 - 4.",
            u32::MAX - 3,
        ),
        size(
            "track-size-beyond",
            "An entry runs past the payload.",
            136 + 144 + 4,
        ),
        size(
            "track-size-of-two",
            "An entry is as large as both.",
            136 + 140,
        ),
        payload(
            (2001, "track-size-missing"),
            &["C-070"],
            at,
            "The second entry has two bytes.",
            |p| p.truncate(SECOND + 2),
        ),
        payload(
            (2001, "track-size-alone"),
            &["C-070"],
            at,
            "The second entry has its size and nothing else.",
            |p| p.truncate(SECOND + 4),
        ),
        entry(
            (2001, "track-padding-four"),
            &["C-070"],
            0,
            "Four bytes of padding.",
            |e| e.padding = Some(vec![0; 7]),
        ),
        entry(
            (2001, "track-padding-four-without-path"),
            &["C-070"],
            0,
            "Four bytes of padding after an empty path.",
            |e| {
                e.path.clear();
                e.padding = Some(vec![0; 4]);
            },
        ),
        entry(
            (2001, "track-path-beyond"),
            &["C-040", "C-072"],
            1,
            "A path of 200 bytes in an entry that has 8.",
            |e| e.path_length = Some(200),
        ),
        entry(
            (2001, "track-path-in-padding"),
            &["C-040", "C-072"],
            1,
            "A path one byte longer than its entry.",
            |e| e.path_length = Some(9),
        ),
    ]);
    // An entry that ends within its fields: each of these sizes is legal as such.
    for (name, size) in [
        ("track-cut-before-space", 12u32),
        ("track-cut-before-application", 16),
        ("track-cut-in-bounds", 36),
        ("track-cut-before-dims", 104),
        ("track-cut-before-path", 128),
        ("track-cut-in-path", 132),
    ] {
        let whole = Entry::new(1).bytes();
        drafts.push(payload(
            (2001, name),
            &["C-040", "C-070"],
            at,
            "An entry ends before its fields do.",
            |p| {
                let mut short = whole[..size as usize].to_vec();
                set_word(&mut short, 0, size);
                *p = [&words(&[1, 0])[..], &short].concat();
            },
        ));
    }
    drafts.push(payload(
        (2007, "track-cut-of-unknown-model"),
        &["C-071", "C-112"],
        at,
        "An entry of 12 bytes has an unknown model, which comes before what is missing.",
        |p| {
            *p = words(&[1, 0, 12, 1, 2]);
        },
    ));
    drafts.push(payload(
        (2008, "track-cut-of-unknown-coding"),
        &["C-071", "C-112"],
        at,
        "An entry of 12 bytes has an unknown coding, which comes before what is missing.",
        |p| {
            *p = words(&[1, 0, 12, 1, 1 | 1 << 16]);
        },
    ));
}

fn fields(drafts: &mut Vec<Draft>) {
    let second = 1;
    drafts.extend([
        entry((2007, "track-model-zero"), &["C-071"], 0, "Model 0.", |e| {
            e.model = 0
        }),
        entry(
            (2007, "track-model-two"),
            &["C-071"],
            second,
            "Model 2.",
            |e| e.model = 2,
        ),
        entry(
            (2007, "track-model-high-byte"),
            &["C-071"],
            0,
            "The model has 16 bits: 257.",
            |e| e.model = 257,
        ),
        entry(
            (2008, "track-coding-one"),
            &["C-071"],
            0,
            "Coding 1.",
            |e| e.coding = 1,
        ),
        entry(
            (2008, "track-coding-high-byte"),
            &["C-071"],
            second,
            "The coding has 16 bits: 256.",
            |e| e.coding = 256,
        ),
        entry(
            (2020, "track-space-two"),
            &["C-071"],
            0,
            "Lookup space 2.",
            |e| e.space = 2,
        ),
        entry(
            (2020, "track-space-most"),
            &["C-071"],
            second,
            "Lookup space 255.",
            |e| e.space = 255,
        ),
        entry(
            (2002, "track-hash-flag-two"),
            &["C-041"],
            second,
            "The flag of the content hash is 2.",
            |e| e.has_hash = 2,
        ),
        entry(
            (2002, "track-hash-not-due"),
            &["C-041"],
            0,
            "A content hash without its flag.",
            |e| e.hash = 1,
        ),
        entry(
            (2002, "track-hash-not-due-high"),
            &["C-041"],
            0,
            "The highest bit of a content hash without its flag.",
            |e| e.hash = 1 << 63,
        ),
        entry(
            (2002, "track-dims-reserved"),
            &["C-041"],
            0,
            "The reserved field after the dims is not 0.",
            |e| e.dims_reserved = 1,
        ),
        entry(
            (2002, "track-dims-reserved-high"),
            &["C-041"],
            second,
            "The high byte of the reserved field after the dims is not 0.",
            |e| e.dims_reserved = 0x8000,
        ),
        entry(
            (2002, "track-widths-reserved"),
            &["C-041"],
            0,
            "The reserved byte after the widths is not 0.",
            |e| e.widths_reserved = 1,
        ),
    ]);
    for (name, path, padding) in [
        (
            "track-padding-first-of-three",
            &b"a"[..],
            [1, 0, 0].to_vec(),
        ),
        ("track-padding-last-of-three", b"a", [0, 0, 0x80].to_vec()),
        ("track-padding-of-two", b"ab", [0, 1].to_vec()),
        ("track-padding-of-one", b"abc", [1].to_vec()),
    ] {
        drafts.push(entry(
            (2002, name),
            &["C-041"],
            0,
            "A byte of the padding is not 0.",
            |e| {
                e.path = path.to_vec();
                e.padding = Some(padding);
            },
        ));
    }
    for axis in 0..3 {
        let name = ["track-aabb-x", "track-aabb-y", "track-aabb-z"][axis];
        drafts.push(entry(
            (2010, name),
            &["C-073"],
            0,
            "The minimum of the bounds is one step above the maximum on an axis.",
            |e| {
                e.aabb[axis] = e.aabb[3 + axis].next_up();
            },
        ));
    }
}

fn numbers(drafts: &mut Vec<Draft>) {
    let mut bad = |name: &str, comment, change: fn(&mut Entry)| {
        drafts.push(entry((2009, name), &["C-042"], 1, comment, change));
    };
    bad(
        "track-aabb-minimum-nan",
        "The first number of the bounds is not a number.",
        |e| e.aabb[0] = f32::NAN,
    );
    bad(
        "track-aabb-minimum-infinite",
        "A minimum of the bounds is minus infinity.",
        |e| e.aabb[2] = f32::NEG_INFINITY,
    );
    bad(
        "track-aabb-maximum-infinite",
        "A maximum of the bounds is infinite.",
        |e| e.aabb[5] = f32::INFINITY,
    );
    bad(
        "track-grid-nan",
        "The first number of grid_from_mesh is not a number.",
        |e| e.grid_from_mesh[0] = f32::NAN,
    );
    bad(
        "track-grid-infinite",
        "The last number of grid_from_mesh is infinite.",
        |e| e.grid_from_mesh[11] = f32::INFINITY,
    );
    bad("track-edge-infinite", "The cell edge is infinite.", |e| {
        e.cell_edge = f32::INFINITY
    });
    bad("track-edge-nan", "The cell edge is not a number.", |e| {
        e.cell_edge = f32::NAN
    });
    bad("track-radius-nan", "The radius is a signalling NaN.", |e| {
        e.radius = f32::from_bits(0x7f80_0001)
    });
    bad(
        "track-radius-infinite",
        "The radius is minus infinity.",
        |e| e.radius = f32::NEG_INFINITY,
    );
}

/// One or two of each fault of the model's parameters.
fn model(drafts: &mut Vec<Draft>) {
    drafts.extend([
        entry(
            (2014, "track-dims-zero"),
            &["P-001"],
            0,
            "A dimension is 0.",
            |e| e.dims[1] = 0,
        ),
        entry(
            (2014, "track-dims-beyond"),
            &["P-001"],
            0,
            "The dims have 2^32 cubes, which wraps to 0 in 32 bits.",
            |e| e.dims = [32_768, 32_768, 4],
        ),
        entry(
            (2015, "track-radius-zero"),
            &["P-002"],
            0,
            "The radius is 0.",
            |e| e.radius = 0.0,
        ),
        entry(
            (2016, "track-widths-sum"),
            &["P-003"],
            0,
            "The widths of a point make 31 bits.",
            |e| e.widths = [5, 4, 7],
        ),
        entry(
            (2017, "track-no-bucket"),
            &["P-004"],
            0,
            "No bucket.",
            |e| e.buckets = 0,
        ),
        entry((2017, "track-no-cell"), &["P-004"], 0, "No cell.", |e| {
            e.capacity = 0
        }),
    ]);
}

/// Paths that are no text, with everything around them in order.
fn paths(drafts: &mut Vec<Draft>) {
    for (name, path, comment) in [
        (
            "path-continuation-first",
            &b"a\x80b"[..],
            "A continuation byte without a first one.",
        ),
        ("path-overlong-two", b"a\xc0\x80", "U+0000 in two bytes."),
        (
            "path-overlong-two-last",
            b"\xc1\xbf",
            "U+007F in two bytes.",
        ),
        (
            "path-overlong-three",
            b"\xe0\x9f\xbf",
            "U+07FF in three bytes.",
        ),
        (
            "path-overlong-four",
            b"\xf0\x8f\xbf\xbf",
            "U+FFFF in four bytes.",
        ),
        (
            "path-surrogate-first",
            b"\xed\xa0\x80",
            "The surrogate U+D800.",
        ),
        (
            "path-surrogate-last",
            b"\xed\xbf\xbf",
            "The surrogate U+DFFF.",
        ),
        (
            "path-surrogate-pair",
            b"\xed\xa0\xbd\xed\xb8\x80",
            "A pair of surrogates.",
        ),
        (
            "path-above-last",
            b"\xf4\x90\x80\x80",
            "A code point above U+10FFFF.",
        ),
        (
            "path-five-bytes",
            b"\xf8\x88\x80\x80\x80",
            "A code of five bytes.",
        ),
        (
            "path-latin-1",
            b"caf\xe9",
            "Text in Latin-1: the path ends within a code.",
        ),
        (
            "path-cut-two",
            b"ab\xc3",
            "The path ends after the first byte of two.",
        ),
        (
            "path-cut-three",
            b"a\xe2\x82",
            "The path ends after two bytes of three.",
        ),
        (
            "path-cut-four",
            b"\xf0\x9f\x8e",
            "The path ends after three bytes of four.",
        ),
        (
            "path-byte-order-mark-utf-16",
            b"\xff\xfea\0",
            "Text in UTF-16.",
        ),
    ] {
        drafts.push(entry((2011, name), &["C-072"], 1, comment, |e| {
            e.path = path.to_vec()
        }));
    }
    // The padding continues the code, but is not of the path.
    drafts.push(entry(
        (2011, "path-code-in-padding"),
        &["C-072", "C-112"],
        1,
        "The last code runs on into the padding: the text is checked first.",
        |e| {
            e.path = b"a\xc3".to_vec();
            e.padding = Some(vec![0xa9, 0]);
        },
    ));
}

/// Two faults in an entry, or in two entries.
fn order(drafts: &mut Vec<Draft>) {
    let mut two = |id, name: &str, comment, change: fn(&mut Entry)| {
        drafts.push(entry((id, name), &["C-112"], 0, comment, change));
    };
    two(
        2007,
        "model-before-coding",
        "Model and coding are unknown.",
        |e| (e.model, e.coding) = (2, 1),
    );
    two(
        2008,
        "coding-before-space",
        "Coding and lookup space are unknown.",
        |e| (e.coding, e.space) = (1, 2),
    );
    two(
        2020,
        "space-before-hash",
        "An unknown lookup space, and a flag of 2.",
        |e| (e.space, e.has_hash) = (2, 2),
    );
    two(
        2002,
        "hash-before-bounds",
        "A flag of 2, and bounds that are no numbers.",
        |e| (e.has_hash, e.aabb[0]) = (2, f32::NAN),
    );
    two(
        2009,
        "grid-before-dims-reserved",
        "A matrix of no numbers, and a reserved bit after it.",
        |e| (e.grid_from_mesh[11], e.dims_reserved) = (f32::NAN, 1),
    );
    two(
        2002,
        "dims-reserved-before-edge",
        "A reserved bit, and an edge that is no number after it.",
        |e| (e.dims_reserved, e.cell_edge) = (1, f32::NAN),
    );
    two(
        2009,
        "radius-before-widths-reserved",
        "A radius of no number, and a reserved bit after it.",
        |e| (e.radius, e.widths_reserved) = (f32::NAN, 1),
    );
    two(
        2002,
        "widths-reserved-before-path",
        "A reserved bit, and a path of no text.",
        |e| (e.widths_reserved, e.path[0]) = (1, 0xff),
    );
    two(
        2012,
        "path-limit-before-size",
        "A path of 1025 bytes that is not there.",
        |e| e.path_length = Some(1025),
    );
    two(
        2001,
        "path-size-before-text",
        "A path of no text that runs past its entry.",
        |e| (e.path[0], e.path_length) = (0xff, Some(9)),
    );
    two(
        2011,
        "path-text-before-padding",
        "A path of no text, and padding that is not 0.",
        |e| (e.path[0], e.padding) = (0xff, Some(vec![1, 0, 0])),
    );
    two(
        2001,
        "padding-size-before-zero",
        "Seven bytes of padding that are not 0.",
        |e| e.padding = Some(vec![1; 7]),
    );
    two(
        2002,
        "padding-before-bounds",
        "Padding that is not 0, and bounds the wrong way round.",
        |e| (e.padding, e.aabb[0]) = (Some(vec![1, 0, 0]), 9.0),
    );
    two(
        2011,
        "path-text-before-bounds",
        "A path of no text, and bounds the wrong way round.",
        |e| (e.path[0], e.aabb[0]) = (0xff, 9.0),
    );
    two(
        2010,
        "bounds-before-dims",
        "Bounds the wrong way round, and a dimension of 0.",
        |e| (e.aabb[0], e.dims[0]) = (9.0, 0),
    );
    two(
        2014,
        "dims-before-radius",
        "A dimension of 0, and a radius of 0.",
        |e| (e.dims[0], e.radius) = (0, 0.0),
    );
    two(
        2015,
        "radius-before-widths",
        "A radius of 0, and widths of 31 bits.",
        |e| (e.radius, e.widths[2]) = (0.0, 7),
    );
    two(
        2016,
        "widths-before-buckets",
        "Widths of 31 bits, and no bucket.",
        |e| (e.widths[2], e.buckets) = (7, 0),
    );
    let [first, second] = two_tracks();
    let mut pair = |id, name: &str, comment, change: &dyn Fn(&mut Entry, &mut Entry)| {
        let (mut a, mut b) = (first.clone(), second.clone());
        change(&mut a, &mut b);
        drafts.push(payload((id, name), &["C-112"], at::TRACK, comment, |p| {
            *p = tracks(&[a, b])
        }));
    };
    pair(
        2017,
        "capacity-before-order",
        "No cell, and an id that does not ascend.",
        &|_, b| (b.capacity, b.id) = (0, 1),
    );
    pair(
        2004,
        "order-before-changed",
        "An id that comes again in a record, with other content.",
        &|_, b| b.id = 1,
    );
    pair(
        2010,
        "first-entry-before-second",
        "Bounds the wrong way round, then an unknown model.",
        &|a, b| (a.aabb[0], b.model) = (9.0, 2),
    );
    pair(
        2017,
        "first-entry-before-size",
        "No bucket, then an entry of size 0.",
        &|a, b| (a.buckets, b.size) = (0, Some(0)),
    );
    // Order among entries, then what was there before.
    let again = Entry {
        radius: 0.125,
        ..first.clone()
    };
    drafts.push(refused(
        (2006, "changed-before-second-order"),
        &["C-075", "C-043", "C-112"],
        at::DELTA,
        "A live track with other content, then an id that does not ascend: entries go one by one.",
        Plan::usual().insert(at::DELTA, kind::TRACK, tracks(&[again.clone(), again])),
    ));
}

/// Ids: ascending in a record, above every earlier one.
fn ids(drafts: &mut Vec<Draft>) {
    let track = |ids: &[u32]| tracks(&ids.iter().map(|&id| Entry::new(id)).collect::<Vec<_>>());
    let with = |ids: &[u32]| Plan::usual().insert(at::DELTA, kind::TRACK, track(ids));
    drafts.extend([
        refused(
            (2004, "track-same-twice"),
            &["C-043"],
            at::DELTA,
            "A record declares a new track twice.",
            with(&[5, 5]),
        ),
        refused(
            (2004, "track-descending"),
            &["C-043"],
            at::DELTA,
            "A record declares its tracks in descending order.",
            with(&[6, 5]),
        ),
        refused(
            (2005, "track-id-below"),
            &["C-074"],
            at::DELTA,
            "A new track has an id below every earlier one.",
            with(&[0]),
        ),
        refused(
            (2005, "track-id-below-in-other-record"),
            &["C-074"],
            at::DELTA + 1,
            "A new track has an id below that of an earlier record.",
            with(&[9]).insert(at::DELTA + 1, kind::TRACK, track(&[8])),
        ),
        refused(
            (2005, "track-id-after-the-last"),
            &["C-074"],
            at::DELTA + 1,
            "After the largest id no track can come.",
            with(&[u32::MAX]).insert(at::DELTA + 1, kind::TRACK, track(&[7])),
        ),
    ]);
    // Every field of a live track, declared again with another value.
    let change: [(&str, fn(&mut Entry)); 18] = [
        ("space", |e| e.space = 0),
        ("hash-flag", |e| (e.has_hash, e.hash) = (0, 0)),
        ("hash", |e| e.hash ^= 1 << 63),
        ("application", |e| e.application ^= 1),
        ("aabb-minimum", |e| e.aabb[2] -= 0.5),
        ("aabb-maximum", |e| e.aabb[3] += 0.5),
        ("grid-first", |e| e.grid_from_mesh[0] = 2.0),
        ("grid-last", |e| e.grid_from_mesh[11] = 2.0),
        ("dims-x", |e| e.dims[0] = 5),
        ("dims-z", |e| e.dims[2] = 3),
        ("edge", |e| e.cell_edge = 0.75),
        ("radius", |e| e.radius = 0.125),
        ("widths", |e| e.widths = [4, 3, 5]),
        ("buckets", |e| e.buckets += 1),
        ("capacity", |e| e.capacity += 1),
        ("path-text", |e| e.path[7] = b'y'),
        ("path-longer", |e| e.path.push(b'e')),
        ("path-empty", |e| e.path.clear()),
    ];
    for (field, change) in change {
        let mut again = two_tracks()[1].clone();
        change(&mut again);
        drafts.push(refused(
            (2006, &format!("track-again-other-{field}")),
            &["C-075"],
            at::DELTA,
            "A live track is declared again with another value in one field.",
            Plan::usual().insert(at::DELTA, kind::TRACK, tracks(&[again])),
        ));
    }
    let other = Entry {
        radius: 0.125,
        ..Entry::new(9)
    };
    drafts.push(refused(
        (2006, "track-again-before-commit"),
        &["C-075", "C-079"],
        at::DELTA + 1,
        "A track is declared again with another radius before it was in any frame.",
        with(&[9]).insert(at::DELTA + 1, kind::TRACK, tracks(&[other])),
    ));
}

/// One frame with these tracks, each with a cell of content.
fn shown(entries: &[Entry]) -> Plan {
    let parts: Vec<_> = entries
        .iter()
        .filter(|entry| entry.capacity < 1000)
        .map(|entry| cell(entry, 0, 1, 1))
        .collect();
    Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::TRACK, tracks(entries)),
        (kind::GROUP, group(0, 0, 0)),
        (kind::POINTS, points(None, &parts)),
        (kind::COMMIT, commit(0, 0, None)),
    ])
}

/// Tracks with fields at their edges.
fn declared(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, clauses: &[&'static str], comment, entries: &[Entry]| {
        drafts.push(valid(name, clauses, comment, &shown(entries)));
    };
    let new = Entry::new;
    good(
        "track-ids-edges",
        &["C-043", "C-074"],
        "Tracks 0, 1, 2147483648 and 4294967295.",
        &[new(0), new(1), new(1 << 31), new(u32::MAX)],
    );
    good(
        "track-many",
        &["C-076", "C-079"],
        "Eight tracks in a record.",
        &(0..8).map(|id| new(3 * id)).collect::<Vec<_>>(),
    );
    good(
        "track-spaces",
        &["C-071"],
        "A track looked up as drawn, and one in its rest pose.",
        &[new(1), Entry { space: 1, ..new(2) }],
    );
    good(
        "track-hashes",
        &["C-041"],
        "No content hash, one of 0, one of 1 and the largest: all differ in the dump.",
        &[
            new(1),
            Entry {
                has_hash: 1,
                ..new(2)
            },
            Entry {
                has_hash: 1,
                hash: 1,
                ..new(3)
            },
            Entry {
                has_hash: 1,
                hash: u64::MAX,
                ..new(4)
            },
        ],
    );
    good(
        "track-application-ids",
        &["C-070"],
        "The largest application id, and one of eight bytes.",
        &[
            Entry {
                application: u64::MAX,
                ..new(1)
            },
            Entry {
                application: 0x0123_4567_89ab_cdef,
                ..new(2)
            },
        ],
    );
    good(
        "track-bounds-flat",
        &["C-073"],
        "Bounds whose minimum is their maximum, and of -0 and 0.",
        &[
            Entry {
                aabb: [1.5; 6],
                ..new(1)
            },
            Entry {
                aabb: [0.0, -0.0, 0.0, -0.0, 0.0, 0.0],
                ..new(2)
            },
        ],
    );
    good(
        "track-numbers-extreme",
        &["C-042"],
        "Minus zero, denormal and the largest numbers are kept as the bits that came.",
        &[Entry {
            aabb: [
                f32::MIN,
                -f32::from_bits(1),
                -0.0,
                f32::MAX,
                f32::from_bits(1),
                f32::MIN_POSITIVE,
            ],
            grid_from_mesh: [
                -0.0,
                f32::MAX,
                f32::MIN,
                f32::from_bits(1),
                -f32::from_bits(0x007f_ffff),
                1.0,
                0.1,
                -0.1,
                f32::EPSILON,
                1e30,
                -1e-30,
                3.5,
            ],
            ..new(1)
        }],
    );
    good(
        "track-radius-edges",
        &["P-002"],
        "Twice the radius is the edge, and one step above it; a denormal radius.",
        &[
            Entry {
                cell_edge: 0.5,
                radius: 0.25,
                ..new(1)
            },
            Entry {
                cell_edge: 0.6f32.next_down(),
                radius: 0.3,
                ..new(2)
            },
            Entry {
                cell_edge: f32::from_bits(1),
                radius: f32::from_bits(1),
                ..new(3)
            },
            Entry {
                cell_edge: f32::MAX,
                radius: f32::MAX / 2.0,
                ..new(4)
            },
        ],
    );
    good(
        "track-least",
        &["P-001", "P-004"],
        "A grid of two cubes with one bucket and one cell.",
        &[Entry {
            dims: [2, 1, 1],
            buckets: 1,
            capacity: 1,
            ..new(1)
        }],
    );
    good(
        "track-dims-most",
        &["P-001"],
        "The largest dims that sixteen bits give, in one layer.",
        &[Entry {
            dims: [65_535, 65_535, 1],
            ..new(1)
        }],
    );
    good(
        "track-capacity-large",
        &["P-004", "C-076"],
        "20000 buckets and 30000 cells, most unused.",
        &[
            new(1),
            Entry {
                buckets: 20_000,
                capacity: 30_000,
                ..new(2)
            },
        ],
    );
}

/// Paths.
fn texts(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment, paths: &[&str]| {
        let entries: Vec<_> = paths
            .iter()
            .zip(1..)
            .map(|(path, id)| Entry {
                path: path.as_bytes().to_vec(),
                ..Entry::new(id)
            })
            .collect();
        drafts.push(valid(name, &["C-070", "C-072"], comment, &shown(&entries)));
    };
    good(
        "path-padding",
        "Paths of 0 to 4 bytes: no padding, and one to three bytes of it.",
        &["", "a", "ab", "abc", "abcd"],
    );
    good(
        "path-code-lengths",
        "The first and last code points of 1, 2, 3 and 4 bytes.",
        &[
            "\u{1}\u{7e}",
            "\u{80}\u{7ff}",
            "\u{800}\u{ffff}",
            "\u{10000}\u{10ffff}",
        ],
    );
    good(
        "path-around-surrogates",
        "The code points on either side of the surrogates.",
        &["\u{d7ff}\u{e000}"],
    );
    good(
        "path-controls",
        "Control characters, which the dump escapes.",
        &["a\0b", "\n\r\t", "\u{1f}\u{7f}\u{80}\u{9f}"],
    );
    good(
        "path-quotes",
        "Quotes and backslashes, which the dump escapes.",
        &["\"", "\\", "a \"b\" \\n c"],
    );
    good(
        "path-scripts",
        "Paths in several scripts, and with an emoji.",
        &[
            "cathédrale/nef",
            "寺院/柱",
            "храм",
            "🏛/col",
            "e\u{301}\u{feff}",
        ],
    );
    good(
        "path-spaces",
        "Spaces at both ends, which are part of the path.",
        &[" a  b "],
    );
    let long = "x".repeat(1024);
    good(
        "path-most",
        "A path of 1024 bytes, the default limit.",
        &[&long],
    );
}

/// Tracks declared again.
fn redeclared(drafts: &mut Vec<Draft>) {
    let [first, second] = two_tracks();
    let one = || Plan::usual().up_to(at::DELTA);
    let next = |plan: Plan| plan.then(kind::COMMIT, commit(4, 2, None));
    drafts.extend([
        valid(
            "again-keeps-content",
            &["C-075", "C-078"],
            "Live tracks are declared again: content and transforms stay.",
            &next(one().then(kind::TRACK, tracks(&[first.clone(), second.clone()]))),
        ),
        valid(
            "again-one-of-two",
            &["C-075", "C-078"],
            "One of two live tracks is declared again.",
            &next(one().then(kind::TRACK, tracks(std::slice::from_ref(&first)))),
        ),
        valid(
            "again-with-new",
            &["C-074", "C-075", "C-078"],
            "A record declares live tracks again, and a new one.",
            &next(one().then(
                kind::TRACK,
                tracks(&[first.clone(), second.clone(), Entry::new(3)]),
            )),
        ),
        valid(
            "again-in-frame",
            &["C-045", "C-078"],
            "A live track is declared again inside a frame that has content of it.",
            &next(
                one()
                    .then(kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)]))
                    .then(kind::TRANSFORMS, transforms(&[(1, moved(5.0))]))
                    .then(kind::TRACK, tracks(std::slice::from_ref(&first))),
            ),
        ),
        valid(
            "again-in-same-frame-as-first",
            &["C-078"],
            "A track is declared twice before its first frame, in two records.",
            &Plan::usual().insert(
                at::GROUP,
                kind::TRACK,
                tracks(&[first.clone(), second.clone()]),
            ),
        ),
        valid(
            "again-with-other-zero",
            &["C-075"],
            "A live track is declared again with -0 for 0, which is the same number.",
            &next(one().then(
                kind::TRACK,
                tracks(&[Entry {
                    aabb: [-0.0, -0.0, 0.0, 2.0, 1.5, 1.0],
                    ..first.clone()
                }]),
            )),
        ),
        valid(
            "again-below-others",
            &["C-074", "C-075"],
            "A live track is declared again after one with a higher id.",
            &next(
                one()
                    .then(kind::TRACK, tracks(&[Entry::new(9)]))
                    .then(kind::TRACK, tracks(&[second.clone()])),
            ),
        ),
        valid(
            "again-beside-removed",
            &["C-078", "C-082"],
            "One track is declared again while the removal of another waits.",
            &next(
                one()
                    .then(kind::TRACK_REMOVE, removal(&[1]))
                    .then(kind::TRACK, tracks(&[second])),
            ),
        ),
    ]);
}
