//! The track record: entries, paths, bounds, ids. The parameters of the model are among `points`;
//! here are those that the order of checks needs.

mod declared;
mod order;
mod paths;

use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, payload, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::points;
use crate::stream_builder::{commit, group, kind, set_word, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    heads(drafts);
    sizes(drafts);
    fields(drafts);
    numbers(drafts);
    model(drafts);
    paths::paths(drafts);
    order::order(drafts);
    order::ids(drafts);
    declared::declared(drafts);
    paths::texts(drafts);
    declared::redeclared(drafts);
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
            (2001, "track-size-odd-without-padding"),
            &["C-070"],
            1,
            "The last entry ends right after its path, at no multiple of four.",
            |e| {
                e.path.truncate(6);
                e.padding = Some(Vec::new());
            },
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
            *p = words(&[1, 0, 12, 1, 6]);
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
            (2007, "track-model-six"),
            &["C-071"],
            second,
            "Model 6.",
            |e| e.model = 6,
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
            (2002, "track-hash-without-flag"),
            &["C-041"],
            0,
            "A content hash without its flag.",
            |e| e.hash = 1,
        ),
        entry(
            (2002, "track-hash-without-flag-high"),
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
            |e| e.grid_mut().dims_reserved = 1,
        ),
        entry(
            (2002, "track-dims-reserved-high"),
            &["C-041"],
            second,
            "The high byte of the reserved field after the dims is not 0.",
            |e| e.grid_mut().dims_reserved = 0x8000,
        ),
        entry(
            (2002, "track-widths-reserved"),
            &["C-041"],
            0,
            "The reserved byte after the widths is not 0.",
            |e| e.grid_mut().widths_reserved = 1,
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
        |e| e.grid_mut().grid_from_mesh[0] = f32::NAN,
    );
    bad(
        "track-grid-infinite",
        "The last number of grid_from_mesh is infinite.",
        |e| e.grid_mut().grid_from_mesh[11] = f32::INFINITY,
    );
    bad("track-edge-infinite", "The cell edge is infinite.", |e| {
        e.grid_mut().cell_edge = f32::INFINITY
    });
    bad("track-edge-nan", "The cell edge is not a number.", |e| {
        e.grid_mut().cell_edge = f32::NAN
    });
    bad("track-radius-nan", "The radius is a signalling NaN.", |e| {
        e.grid_mut().radius = f32::from_bits(0x7f80_0001)
    });
    bad(
        "track-radius-infinite",
        "The radius is minus infinity.",
        |e| e.grid_mut().radius = f32::NEG_INFINITY,
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
            |e| e.grid_mut().dims[1] = 0,
        ),
        entry(
            (2014, "track-dims-beyond"),
            &["P-001"],
            0,
            "The dims have 2^32 cubes, which wraps to 0 in 32 bits.",
            |e| e.grid_mut().dims = [32_768, 32_768, 4],
        ),
        entry(
            (2015, "track-radius-zero"),
            &["P-002"],
            0,
            "The radius is 0.",
            |e| e.grid_mut().radius = 0.0,
        ),
        entry(
            (2016, "track-widths-sum"),
            &["P-003"],
            0,
            "The widths of a point make 31 bits.",
            |e| e.grid_mut().widths = [5, 4, 7],
        ),
        entry(
            (2017, "track-no-bucket"),
            &["P-004"],
            0,
            "No bucket.",
            |e| e.grid_mut().buckets = 0,
        ),
        entry((2017, "track-no-cell"), &["P-004"], 0, "No cell.", |e| {
            e.grid_mut().capacity = 0
        }),
    ]);
}

/// One frame with these tracks, each with a cell of content.
fn shown(entries: &[Entry]) -> Plan {
    let parts: Vec<_> = entries
        .iter()
        .filter(|entry| entry.grid().capacity < 1000)
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
