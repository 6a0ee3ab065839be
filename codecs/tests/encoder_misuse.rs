//! Calls that an encoder refuses: with the error that a decoder would give, without a byte written,
//! and ready for the next call.

use crate::common::*;
use crate::volumes;
use dapple_codec::points::*;
use dapple_codec::probes::{self, Coding, Probe, Visibility, Volume};
use dapple_codec::*;

const NONE: Compression = Compression::None;
const KEY: Coverage = Coverage::Keyframe;
const DELTA: Coverage = Coverage::Delta;
const THERE: u32 = 1 << 31;

const LIMITS: Limits = Limits {
    stored_bytes: 1300,
    unpacked_bytes: 1300,
    frame_bytes: 1700,
    zstd_window_bytes: 2000,
    tracks: 5,
    path_bytes: 20,
    state_bytes: 20_000,
    work_per_byte: 400,
};

/// What has been written before a misuse.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Before {
    /// The `stream` record.
    Start,
    /// And tracks: 1 and 6 of `points`, 2 of `raw` and 3 of `packed` probes.
    Tracks,
    /// And a keyframe group.
    Group,
    /// And a committed frame of tick 5 with content of tracks 1, 2 and 3.
    Frame,
    /// And an end record.
    End,
}
use Before::*;

type Call = fn(&mut Encoder, &mut Vec<u8>) -> Result<()>;

fn points_track(id: u32) -> Track {
    let mut track = track(id, PointWidths::BITS_32, 7, 10);
    track.target.path = "path".into();
    track
}

fn raw() -> Volume {
    volumes::volume([2, 2, 1], 4, Coding::Raw)
}

fn packed_volume() -> Volume {
    volumes::volume([2, 1, 1], 0, Coding::Packed(volumes::STEPS))
}

fn grid() -> Grid {
    *points_track(1).grid().unwrap()
}

/// The first key that hashes to a bucket.
fn key_of(bucket: u32) -> u32 {
    (0..)
        .find(|&key| grid().bucket_of_key(key) == bucket)
        .unwrap()
}

fn bucket(entries: &[u32]) -> Bucket {
    let mut bucket = Bucket::EMPTY;
    bucket.0[..entries.len()].copy_from_slice(entries);
    bucket
}

fn cell(key: u32, points: &[u32]) -> Cell {
    let mut cell = Cell::FREE;
    cell.key = key;
    cell.points[..points.len()].copy_from_slice(points);
    cell
}

/// Content of a `points` track: a bucket and a cell.
fn content(
    (encoder, out): (&mut Encoder, &mut Vec<u8>),
    coverage: Coverage,
    track: u32,
    (bucket_index, bucket): (u32, Bucket),
    (cell_index, cell): (u32, Cell),
) -> Result<()> {
    let update = Update {
        track,
        bucket_indices: &[bucket_index],
        buckets: &[bucket],
        cell_indices: &[cell_index],
        cells: &[cell],
    };
    encoder.points(out, coverage, &[update], NONE)
}

/// Content of track 1 in a keyframe.
fn keyframe(to: (&mut Encoder, &mut Vec<u8>), bucket: Bucket, cell: Cell) -> Result<()> {
    content(to, KEY, 1, (2, bucket), (4, cell))
}

/// Content without a bucket or cell.
fn nothing(
    (encoder, out): (&mut Encoder, &mut Vec<u8>),
    coverage: Coverage,
    tracks: &[u32],
) -> Result<()> {
    let update = |&track: &u32| Update {
        track,
        bucket_indices: &[],
        buckets: &[],
        cell_indices: &[],
        cells: &[],
    };
    let updates: Vec<_> = tracks.iter().map(update).collect();
    encoder.points(out, coverage, &updates, NONE)
}

fn probes(
    (encoder, out): (&mut Encoder, &mut Vec<u8>),
    coverage: Coverage,
    (track, probes): (u32, &[Probe]),
    base: &[Probe],
    visibility: Option<&[u8]>,
) -> Result<()> {
    let update = probes::Update {
        track,
        base,
        probes,
        visibility,
    };
    encoder.probes(out, coverage, &[update], NONE)
}

fn probe(level: u8, first: i16) -> Probe {
    let mut probe = Probe {
        level,
        ..Probe::ABSENT
    };
    probe.codes[0] = first;
    probe
}

const RAW: [Probe; 4] = [Probe::ABSENT; 4];
const PACKED: [Probe; 2] = [Probe::ABSENT; 2];

/// Writes what comes before a misuse.
fn start(before: Before, out: &mut Vec<u8>) -> Encoder {
    let config = EncoderConfig {
        limits: LIMITS,
        ..EncoderConfig::default()
    };
    let mut encoder = Encoder::new(config, out).unwrap();
    let e = &mut encoder;
    if before != Start {
        let tracks = [
            points_track(1),
            volumes::volume_track(2, raw()),
            volumes::volume_track(3, packed_volume()),
            points_track(6),
        ];
        e.tracks(out, &tracks).unwrap();
    }
    if !matches!(before, Start | Tracks) {
        e.group(out, GroupStart::Keyframes).unwrap();
    }
    if matches!(before, Frame | End) {
        keyframe((e, out), bucket(&[4]), cell(key_of(2), &[THERE])).unwrap();
        probes((e, out), KEY, (2, &[probe(3, 7); 4]), &[], None).unwrap();
        probes((e, out), KEY, (3, &[probe(1, 7); 2]), &[], None).unwrap();
        e.transforms(out, &[(1, transform(1.0))], NONE).unwrap();
        e.commit(out, 5, None).unwrap();
    }
    if before == End {
        e.end(out).unwrap();
    }
    encoder
}

fn declare(e: &mut Encoder, out: &mut Vec<u8>, change: impl FnOnce(&mut Track)) -> Result<()> {
    let mut track = points_track(7);
    change(&mut track);
    e.tracks(out, &[track])
}

fn declare_grid(e: &mut Encoder, out: &mut Vec<u8>, change: impl FnOnce(&mut Grid)) -> Result<()> {
    let mut grid = grid();
    change(&mut grid);
    declare(e, out, |track| track.model = Model::Points(grid))
}

fn declare_volume(
    e: &mut Encoder,
    out: &mut Vec<u8>,
    change: impl FnOnce(&mut Volume),
) -> Result<()> {
    let mut volume = packed_volume();
    change(&mut volume);
    e.tracks(out, &[volumes::volume_track(7, volume)])
}

const ORDER: &[(u16, Before, Call)] = &[
    (4008, Tracks, |e, o| e.commit(o, 0, None).map(|_| ())),
    (4008, Tracks, |e, o| {
        e.transforms(o, &[(1, transform(0.0))], NONE)
    }),
    (4008, Tracks, |e, o| nothing((e, o), KEY, &[1])),
    (4008, Tracks, |e, o| {
        probes((e, o), KEY, (2, &RAW), &[], None)
    }),
    (4002, Start, |e, o| e.group(o, GroupStart::State(0))),
    (4002, Frame, |e, o| e.group(o, GroupStart::State(1))),
    (4006, Group, |e, o| e.group(o, GroupStart::Keyframes)),
    (4006, Group, |e, o| e.end(o)),
    (4004, Frame, |e, o| e.commit(o, 4, None).map(|_| ())),
    (4005, Group, |e, o| e.commit(o, 0, Some(1)).map(|_| ())),
    (4005, Frame, |e, o| e.commit(o, 9, Some(1)).map(|_| ())),
    (1020, End, |e, o| e.tracks(o, &[points_track(9)])),
    (1020, End, |e, o| e.remove_tracks(o, &[1])),
    (1020, End, |e, o| e.group(o, GroupStart::Keyframes)),
    (1020, End, |e, o| {
        e.transforms(o, &[(1, transform(0.0))], NONE)
    }),
    (1020, End, |e, o| nothing((e, o), DELTA, &[1])),
    (1020, End, |e, o| e.commit(o, 9, None).map(|_| ())),
    (1020, End, |e, o| e.end(o)),
];

const DECLARATIONS: &[(u16, Before, Call)] = &[
    (2004, Start, |e, o| {
        e.tracks(o, &[points_track(2), points_track(1)])
    }),
    (2004, Start, |e, o| {
        e.tracks(o, &[points_track(1), points_track(1)])
    }),
    (2005, Tracks, |e, o| e.tracks(o, &[points_track(5)])),
    (2006, Tracks, |e, o| e.tracks(o, &[points_track(2)])),
    (2009, Tracks, |e, o| {
        declare(e, o, |t| t.aabb_min[1] = f32::NAN)
    }),
    (2010, Tracks, |e, o| declare(e, o, |t| t.aabb_min[1] = 3.0)),
    (2012, Tracks, |e, o| {
        declare(e, o, |t| t.target.path = "p".repeat(21))
    }),
    (2012, Tracks, |e, o| {
        declare(e, o, |t| t.target.path = "p".repeat(70_000))
    }),
    (2013, Tracks, |e, o| {
        e.tracks(o, &[points_track(7), points_track(8)])
    }),
    (2014, Tracks, |e, o| declare_grid(e, o, |g| g.dims[0] = 0)),
    (2015, Tracks, |e, o| declare_grid(e, o, |g| g.radius = 0.0)),
    (2016, Tracks, |e, o| declare_grid(e, o, |g| g.widths.ao = 9)),
    (2017, Tracks, |e, o| {
        declare_grid(e, o, |g| g.bucket_count = 0)
    }),
    (2018, Tracks, |e, o| {
        declare_grid(e, o, |g| g.cell_capacity = 1000)
    }),
    (2020, Tracks, |e, o| {
        let mut track = volumes::volume_track(7, raw());
        track.space = LookupSpace::Rest;
        e.tracks(o, &[track])
    }),
    (2022, Tracks, |e, o| declare_volume(e, o, |v| v.dims[2] = 0)),
    (2023, Tracks, |e, o| {
        declare_volume(e, o, |v| v.spacing[0] = -1.0)
    }),
    (2024, Tracks, |e, o| {
        declare_volume(e, o, |v| v.exponent = 65)
    }),
    (2025, Tracks, |e, o| {
        declare_volume(e, o, |v| {
            v.visibility = Visibility {
                side: 5,
                range: 1.0,
                ..Visibility::default()
            }
        })
    }),
    (2026, Tracks, |e, o| {
        let mut steps = volumes::STEPS;
        steps.luma[1] = 0;
        declare_volume(e, o, |v| v.coding = Coding::Packed(steps))
    }),
    (2018, Tracks, |e, o| {
        declare_volume(e, o, |v| v.dims = [100; 3])
    }),
    (2004, Tracks, |e, o| e.remove_tracks(o, &[2, 1])),
    (2019, Tracks, |e, o| e.remove_tracks(o, &[1, 4])),
    (2004, Group, |e, o| {
        e.transforms(o, &[(2, transform(0.0)), (1, transform(0.0))], NONE)
    }),
    (2009, Group, |e, o| {
        e.transforms(o, &[(1, transform(f32::NAN))], NONE)
    }),
    (2019, Group, |e, o| {
        e.transforms(o, &[(1, transform(0.0)), (4, transform(0.0))], NONE)
    }),
];

const POINTS: &[(u16, Before, Call)] = &[
    (2004, Group, |e, o| nothing((e, o), KEY, &[6, 1])),
    (2004, Group, |e, o| nothing((e, o), KEY, &[1, 1])),
    (2019, Group, |e, o| nothing((e, o), KEY, &[1, 4])),
    (2027, Group, |e, o| nothing((e, o), KEY, &[1, 2])),
    (4001, Group, |e, o| nothing((e, o), DELTA, &[1])),
    (3003, Group, |e, o| {
        content((e, o), KEY, 1, (7, bucket(&[])), (4, cell(0, &[])))
    }),
    (3004, Group, |e, o| {
        content((e, o), KEY, 1, (2, bucket(&[])), (10, cell(0, &[])))
    }),
    (3005, Group, |e, o| {
        keyframe((e, o), bucket(&[4, 10]), cell(key_of(2), &[]))
    }),
    (3006, Group, |e, o| {
        keyframe((e, o), bucket(&[EMPTY, 4]), cell(key_of(2), &[]))
    }),
    (3007, Group, |e, o| {
        keyframe((e, o), bucket(&[4, 4]), cell(key_of(2), &[]))
    }),
    (3008, Group, |e, o| {
        keyframe((e, o), bucket(&[]), cell(9 * 8 * 7, &[]))
    }),
    (3009, Group, |e, o| {
        keyframe((e, o), bucket(&[]), cell(0, &[0, THERE]))
    }),
    (3010, Group, |e, o| {
        keyframe((e, o), bucket(&[]), cell(0, &[1]))
    }),
    (3011, Group, |e, o| {
        keyframe((e, o), bucket(&[]), cell(EMPTY, &[THERE]))
    }),
    (3012, Group, |e, o| {
        keyframe((e, o), bucket(&[4]), cell(key_of(3), &[]))
    }),
    // A bucket that names a free cell.
    (3012, Group, |e, o| {
        keyframe((e, o), bucket(&[4, 5]), cell(key_of(2), &[]))
    }),
    // A cell that its old bucket still names.
    (3013, Frame, |e, o| {
        content(
            (e, o),
            DELTA,
            1,
            (3, bucket(&[])),
            (4, cell(key_of(3), &[])),
        )
    }),
    // A second track that is at fault.
    (3003, Group, |e, o| {
        let update = |track, indices| Update {
            track,
            bucket_indices: indices,
            buckets: &[Bucket::EMPTY; 2],
            cell_indices: &[],
            cells: &[],
        };
        e.points(o, KEY, &[update(1, &[1, 2]), update(6, &[2, 1])], NONE)
    }),
    (4012, Group, |e, o| {
        let update = Update {
            track: 1,
            bucket_indices: &[1],
            buckets: &[],
            cell_indices: &[],
            cells: &[],
        };
        e.points(o, KEY, &[update], NONE)
    }),
];

const PROBES: &[(u16, Before, Call)] = &[
    (2019, Group, |e, o| {
        probes((e, o), KEY, (4, &RAW), &[], None)
    }),
    (2027, Group, |e, o| {
        probes((e, o), KEY, (1, &RAW), &[], None)
    }),
    (4001, Group, |e, o| {
        probes((e, o), DELTA, (2, &RAW), &RAW, None)
    }),
    (4001, Frame, |e, o| {
        probes((e, o), DELTA, (2, &RAW), &RAW, None)
    }),
    (4001, Frame, |e, o| {
        probes((e, o), DELTA, (3, &PACKED), &PACKED, None)
    }),
    (3103, Group, |e, o| {
        probes((e, o), KEY, (2, &[probe(3, 0x7c00); 4]), &[], None)
    }),
    (3104, Group, |e, o| {
        probes((e, o), KEY, (3, &[probe(1, -1); 2]), &[], None)
    }),
    (4012, Group, |e, o| {
        probes((e, o), KEY, (3, &[probe(0, 1); 2]), &[], None)
    }),
    (4012, Group, |e, o| {
        probes((e, o), KEY, (2, &RAW[1..]), &[], None)
    }),
    (4012, Group, |e, o| {
        probes((e, o), KEY, (2, &RAW), &[], Some(&[1]))
    }),
    (4012, Group, |e, o| {
        probes((e, o), KEY, (3, &PACKED), &[], Some(&[]))
    }),
    (4012, Frame, |e, o| {
        probes((e, o), DELTA, (2, &RAW), &[], None)
    }),
];

/// Calls that are refused since another call of the same frame came before.
const TWICE: &[(u16, Before, Call, Call)] = &[
    (
        4010,
        Group,
        |e, o| nothing((e, o), KEY, &[1]),
        |e, o| nothing((e, o), KEY, &[1]),
    ),
    (
        4010,
        Group,
        |e, o| probes((e, o), KEY, (2, &RAW), &[], None),
        |e, o| probes((e, o), KEY, (2, &RAW), &[], None),
    ),
    (
        4010,
        Group,
        |e, o| e.transforms(o, &[(1, transform(0.0))], NONE),
        |e, o| e.transforms(o, &[(6, transform(0.0))], NONE),
    ),
    (
        4010,
        Group,
        |e, o| nothing((e, o), KEY, &[1]),
        |e, o| e.remove_tracks(o, &[1]),
    ),
    (
        2019,
        Group,
        |e, o| e.remove_tracks(o, &[1]),
        |e, o| e.remove_tracks(o, &[1]),
    ),
    (
        2019,
        Group,
        |e, o| e.remove_tracks(o, &[1]),
        |e, o| nothing((e, o), KEY, &[1]),
    ),
    (
        2019,
        Group,
        |e, o| e.remove_tracks(o, &[1]),
        |e, o| e.transforms(o, &[(1, transform(0.0))], NONE),
    ),
    (
        2005,
        Group,
        |e, o| e.remove_tracks(o, &[1]),
        |e, o| e.tracks(o, &[points_track(1)]),
    ),
    (
        4006,
        Frame,
        |e, o| nothing((e, o), DELTA, &[1]),
        |e, o| e.end(o),
    ),
    (
        4006,
        Frame,
        |e, o| nothing((e, o), DELTA, &[1]),
        |e, o| e.group(o, GroupStart::Keyframes),
    ),
    // More than a record.
    (
        1012,
        Group,
        |e, o| declare_wide(e, o, 11),
        |e, o| visibility(e, o, 11),
    ),
    // More than a frame: the first of two records still fits.
    (
        4009,
        Group,
        |e, o| declare_wide(e, o, 9).and_then(|()| visibility(e, o, 9)),
        |e, o| {
            let indices: Vec<u32> = (0..10).collect();
            let cells = [cell(0, &[THERE]); 10];
            let update = |track| Update {
                track,
                bucket_indices: &[],
                buckets: &[],
                cell_indices: &indices,
                cells: &cells,
            };
            e.points(o, KEY, &[update(1), update(6)], NONE)
        },
    ),
];

/// Declares a volume whose visibility block has 128 bytes a probe.
fn declare_wide(e: &mut Encoder, o: &mut Vec<u8>, count: u16) -> Result<()> {
    let volume = volumes::volume([count, 1, 1], 8, Coding::Raw);
    e.tracks(o, &[volumes::volume_track(9, volume)])
}

/// Sends the visibility block of that volume.
fn visibility(e: &mut Encoder, o: &mut Vec<u8>, count: usize) -> Result<()> {
    let (texels, absent) = (vec![5; 128 * count], vec![Probe::ABSENT; count]);
    probes((e, o), KEY, (9, &absent), &[], Some(&texels))
}

fn check(id: u16, before: Before, first: Option<Call>, misuse: Call) {
    let mut out = Vec::new();
    let mut encoder = start(before, &mut out);
    if let Some(first) = first {
        first(&mut encoder, &mut out).unwrap();
    }
    let (bytes, written) = (out.clone(), encoder.written());
    let result = misuse(&mut encoder, &mut out);
    let error = result.expect_err(&format!("{id} after {before:?}"));
    assert_eq!((error.id, error.offset), (id, written), "{error}");
    assert!(
        out == bytes && encoder.written() == written,
        "{error}: wrote bytes"
    );
    // What is left is a stream.
    if before != End {
        if matches!(before, Start | Tracks) {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        }
        if before == Group && first.is_none() {
            keyframe(
                (&mut encoder, &mut out),
                bucket(&[4]),
                cell(key_of(2), &[THERE]),
            )
            .unwrap();
            encoder
                .transforms(&mut out, &[(6, transform(2.0))], NONE)
                .unwrap();
        }
        encoder.commit(&mut out, 10, None).unwrap();
        encoder.end(&mut out).unwrap();
    }
    let mut decoder = Decoder::new(LIMITS);
    decode(&mut decoder, &out).1.unwrap();
}

#[test]
fn misuses_are_refused_with_the_errors_of_a_decoder() {
    for &(id, before, misuse) in [ORDER, DECLARATIONS, POINTS, PROBES]
        .iter()
        .copied()
        .flatten()
    {
        check(id, before, None, misuse);
    }
    for &(id, before, first, misuse) in TWICE {
        check(id, before, Some(first), misuse);
    }
}

#[test]
fn streams_that_cannot_start_are_refused() {
    let mut out = vec![1];
    let mut refused = |change: fn(&mut EncoderConfig)| {
        let mut config = EncoderConfig::default();
        change(&mut config);
        let error = Encoder::new(config, &mut out).err().unwrap();
        assert_eq!(out, [1]);
        error.id
    };
    assert_eq!(refused(|c| c.container_version = 2), 1003);
    assert_eq!(refused(|c| c.tick_rate.denominator = 0), 2003);
    assert_eq!(refused(|c| c.limits.stored_bytes = 7), 1012);
    assert_eq!(refused(|c| c.limits.unpacked_bytes = 7), 1013);
}
