//! What decoding allocates: within the limits, and nothing once it runs.

mod common;
#[path = "common/tables.rs"]
mod instance_tables;
#[path = "common/regions.rs"]
mod region_sets;
#[path = "common/volumes.rs"]
mod volumes;

use common::*;
use dapple_codec::points::*;
use dapple_codec::probes;
use dapple_codec::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static CALLS: AtomicUsize = AtomicUsize::new(0);
/// The allocation that is refused, counted down by each; none at 0.
static REFUSED: AtomicUsize = AtomicUsize::new(0);

// SAFETY: passes every call on to the system's allocator and only counts.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Relaxed);
        let left = REFUSED.load(Relaxed);
        if left > 0 {
            REFUSED.store(left - 1, Relaxed);
            if left == 1 {
                return std::ptr::null_mut();
            }
        }
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(now, Relaxed);
        // SAFETY: the caller's contract.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn peak_of(f: impl FnOnce()) -> usize {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    f();
    PEAK.load(Relaxed) - before
}

/// Tight, and enough for [`stream`].
const SMALL: Limits = Limits {
    stored_bytes: 16 << 10,
    unpacked_bytes: 16 << 10,
    frame_bytes: 32 << 10,
    zstd_window_bytes: 16 << 10,
    tracks: 8,
    path_bytes: 64,
    state_bytes: 16 << 10,
    work_per_byte: 400,
};
const PACKINGS: [u8; 3] = [0, 1, 2];
/// What the encoder of this build has.
const ZSTD: Compression = if cfg!(feature = "zstd-native") {
    Compression::PAPER
} else {
    Compression::Lz4
};

/// Runs `f` with a new decoder, which must take at least `least` bytes and at most what its limits
/// state. What C allocates is outside Rust's allocator: it is one context, counted by its size.
fn within(limits: Limits, least: usize, f: impl FnOnce(&mut Decoder)) {
    let mut context = 0;
    if cfg!(feature = "zstd-native") {
        context = zstd::zstd_safe::DCtx::create().sizeof();
    }
    let peak = peak_of(|| f(&mut Decoder::new(limits))) + context;
    let stated = limits.heap_bytes();
    assert!(peak as u64 <= stated, "{peak} bytes of {stated}");
    assert!(peak >= least, "{peak} bytes of at least {least}");
}

/// Pushes everything; the number of the first error.
fn push(decoder: &mut Decoder, bytes: &[u8]) -> std::result::Result<(), u16> {
    let pushed = decoder.push_all(bytes, |_, _| {});
    pushed.map_err(|error| error.id)
}

/// Pushes pieces, through errors.
fn push_all(decoder: &mut Decoder, bytes: &[u8], piece: usize) {
    let mut at = 0;
    while at < bytes.len() {
        let piece = &bytes[at..at.saturating_add(piece).min(bytes.len())];
        if push(decoder, piece).is_err() && !decoder.resume() {
            return;
        }
        at = (decoder.position() as usize).max(at + 1);
    }
}

/// Appends an unpacked record.
fn raw_record(out: &mut Vec<u8>, sequence: u64, record_type: u16, payload: &[u8]) {
    let header = container::RecordHeader {
        record_type,
        critical: true,
        version: 0,
        packing: 0,
        sequence,
        stored_bytes: payload.len() as u32,
        unpacked_bytes: payload.len() as u32,
        payload_crc: container::crc32c(payload),
    };
    out.extend(header.to_bytes());
    out.extend(payload);
}

/// A stream that declares tracks.
fn declared(tracks: &[Track]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.tracks(&mut out, tracks).unwrap();
    out
}

/// A stream that declares tracks one by one.
fn declared_apart(tracks: &[Track]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    for track in tracks {
        encoder
            .tracks(&mut out, std::slice::from_ref(track))
            .unwrap();
    }
    out
}

/// One test, since the counters are the process's.
#[test]
fn allocations() {
    refused_memory_is_an_error();
    reset_and_free_gives_memory_back();
    // A claim of the largest record that the limits allow, of which nothing comes.
    let (bytes, _) = stream(Compression::None, false);
    let starts = records(&bytes);
    let claim = with_header(&bytes[..starts[1] + 32], starts[1], |h| {
        h.stored_bytes = 256 << 20;
        h.unpacked_bytes = 256 << 20;
    });
    let peak = peak_of(|| {
        let mut decoder = Decoder::new(Limits::default());
        assert_eq!(decode(&mut decoder, &claim).1.unwrap_err().id, 1019);
        assert!(decoder.push(&[0; 1000]).is_ok());
    });
    assert!(peak < 64 << 10, "{peak} bytes for a claim");

    // Small limits: every damaged stream stays within what they state.
    for packing in PACKINGS {
        let bytes = packed(&stream(Compression::None, false).0, packing);
        let mut random = Random(3);
        for _ in 0..300 {
            let mut damaged = bytes.clone();
            for _ in 0..random.below(3) {
                // Header fields and payloads with checksums recomputed, so that the claims are read.
                let starts = records(&damaged);
                let at = starts[random.below(starts.len() as u32) as usize];
                let value = random.next() >> random.below(32);
                damaged = match random.below(3) {
                    0 => with_header(&damaged, at, |h| h.unpacked_bytes = value),
                    1 => with_header(&damaged, at, |h| h.packing = (value % 3) as u8),
                    _ => {
                        let h = header(&damaged, at);
                        let end = at + 32 + h.stored_bytes as usize;
                        let byte = at + 32 + value as usize % (end - at - 32).max(1);
                        let mut b = damaged.clone();
                        if byte < end {
                            b[byte] = random.next() as u8;
                        }
                        let crc = container::crc32c(&b[at + 32..end]);
                        with_header(&b, at, |h| h.payload_crc = crc)
                    }
                };
            }
            within(SMALL, 0, |decoder| {
                push_all(decoder, &damaged, 700);
                decoder.reset();
                push_all(decoder, &bytes, usize::MAX);
            });
        }
    }

    // Streams that fill one part each, and come so close to it that the bound means something.
    // A payload that arrives in two pieces, the second of one byte: the first buffer is copied.
    let mut claim = Vec::new();
    Encoder::new(EncoderConfig::default(), &mut claim).unwrap();
    let at = claim.len();
    raw_record(&mut claim, 1, container::record_type::TRACK, &[0; 1 << 20]);
    let limits = Limits {
        stored_bytes: 1 << 20,
        unpacked_bytes: 1 << 20,
        ..SMALL
    };
    within(limits, (2 << 20) - 1, |decoder| {
        assert_eq!(push(decoder, &claim[..at + 32]), Ok(()));
        assert_eq!(push(decoder, &claim[at + 32..claim.len() - 1]), Ok(()));
        assert!(push(decoder, &claim[claim.len() - 1..]).is_err());
    });

    // A small record that unpacks to the limit.
    for packing in [1, 2] {
        let bytes = packed(&claim, packing);
        let limits = Limits {
            unpacked_bytes: 1 << 20,
            zstd_window_bytes: 1 << 20,
            ..SMALL
        };
        within(limits, 1 << 20, |decoder| {
            assert!(push(decoder, &bytes).is_err());
        });
    }

    // A frame of many records that grows up to its limit, record by record.
    let limits = Limits {
        frame_bytes: 1 << 20,
        ..SMALL
    };
    let mut frame = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut frame).unwrap();
    encoder.group(&mut frame, GroupStart::Keyframes).unwrap();
    encoder
        .transforms(&mut frame, &[], Compression::None)
        .unwrap();
    let mut empty = [0; 16];
    empty[4] = 1;
    for i in 0..(1 << 20) / 16 {
        raw_record(&mut frame, 3 + i, container::record_type::POINTS, &empty);
    }
    within(limits, 1 << 20, |decoder| {
        assert_eq!(push(decoder, &frame), Ok(()))
    });

    // As many tracks as the limit allows, each with the longest path, declared one by one, moved, filled
    // and removed; every second one first, so that the places left free do not touch.
    let limits = Limits {
        tracks: 1000,
        state_bytes: 1 << 20,
        ..SMALL
    };
    let mut many = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut many).unwrap();
    encoder.group(&mut many, GroupStart::Keyframes).unwrap();
    let mut tracks: Vec<Track> = (0..1000)
        .map(|id| track(id, PointWidths::BITS_16, 2, 3))
        .collect();
    for track in &mut tracks {
        track.target.path = "p".repeat(64);
        encoder
            .tracks(&mut many, std::slice::from_ref(track))
            .unwrap();
    }
    for one in 0..1000 {
        let update = Update {
            track: one,
            bucket_indices: &[],
            buckets: &[],
            cell_indices: &[],
            cells: &[],
        };
        encoder
            .points(&mut many, Coverage::Keyframe, &[update], Compression::None)
            .unwrap();
    }
    for part in [0..500, 500..1000] {
        let moved: Vec<_> = part.map(|id| (id, transform(1.0))).collect();
        encoder
            .transforms(&mut many, &moved, Compression::None)
            .unwrap();
        encoder.commit(&mut many, 0, None).unwrap();
    }
    for odd in [0, 1] {
        let ids: Vec<u32> = (0..500).map(|i| 2 * i + odd).collect();
        encoder.remove_tracks(&mut many, &ids).unwrap();
        encoder.commit(&mut many, 0, None).unwrap();
    }
    let limits = Limits {
        stored_bytes: 64 << 10,
        unpacked_bytes: 64 << 10,
        ..limits
    };
    within(limits, 500 << 10, |decoder| {
        assert_eq!(push(decoder, &many), Ok(()))
    });

    // State up to the limit, at first most of it buckets and after a reset most of it cells: what
    // the first stream left must not stay beside the second.
    let limits = Limits {
        state_bytes: 8 << 20,
        ..SMALL
    };
    let wide = declared(&[track(1, PointWidths::BITS_32, (8 << 20) / 32 - 2, 1)]);
    let twice = declared_apart(&[
        track(1, PointWidths::BITS_32, (4 << 20) / 32 - 4, 1),
        track(2, PointWidths::BITS_32, (4 << 20) / 32 - 4, 1),
    ]);
    let deep = declared(&[track(1, PointWidths::BITS_32, 1, (8 << 20) / 36 - 1)]);
    let both = declared(&[
        track(1, PointWidths::BITS_32, (4 << 20) / 32, 1),
        track(2, PointWidths::BITS_32, 1, (4 << 20) / 36 - 4),
    ]);
    for order in [[&wide, &deep, &both, &wide], [&deep, &twice, &wide, &deep]] {
        within(limits, 8 << 20, |decoder| {
            for bytes in order {
                assert_eq!(push(decoder, bytes), Ok(()));
                decoder.reset();
            }
        });
    }

    // A zstd frame that states more sequences than its block can hold, and one with the largest
    // window.
    let mut frame = b"\x28\xb5\x2f\xfd\xa0\x00\x00\x01\x00".to_vec();
    let block = [&[0x00][..], &[0xff, 0xff, 0xff, 0x00], &[0x55; 4000]].concat();
    frame.extend(&((block.len() as u32) << 3 | 4 | 1).to_le_bytes()[..3]);
    frame.extend(&block);
    let mut hostile = Vec::new();
    Encoder::new(EncoderConfig::default(), &mut hostile).unwrap();
    let at = hostile.len();
    raw_record(&mut hostile, 1, container::record_type::TRACK, &frame);
    let hostile = with_header(&hostile, at, |h| {
        h.packing = 2;
        h.unpacked_bytes = 1 << 16;
    });
    let limits = Limits {
        unpacked_bytes: 1 << 20,
        zstd_window_bytes: 1 << 20,
        ..SMALL
    };
    let largest = packed(&claim, 2);
    within(limits, 1 << 20, |decoder| {
        for bytes in [&hostile, &largest, &hostile] {
            assert!(push(decoder, bytes).is_err());
            decoder.reset();
        }
    });

    // A bomb: sixteen megabytes of zeros in a points record.
    for packing in [1, 2] {
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        encoder
            .tracks(&mut out, &[track(1, PointWidths::BITS_32, 1 << 19, 4)])
            .unwrap();
        let indices: Vec<u32> = (0..1 << 19).collect();
        let buckets = vec![Bucket::EMPTY; 1 << 19];
        let update = Update {
            track: 1,
            bucket_indices: &indices,
            buckets: &buckets,
            cell_indices: &[],
            cells: &[],
        };
        encoder
            .points(&mut out, Coverage::Keyframe, &[update], Compression::None)
            .unwrap();
        let out = packed(&out, packing);
        assert!(out.len() < 100 << 10);
        let limits = Limits {
            unpacked_bytes: 1 << 20,
            ..Limits::default()
        };
        let peak = peak_of(|| {
            let mut decoder = Decoder::new(limits);
            assert_eq!(decode(&mut decoder, &out).1.unwrap_err().id, 1013);
        });
        assert!(
            peak < (16 << 20) + (64 << 10),
            "{peak} bytes: more than the track's buckets"
        );
    }

    // Steady state: the second run of the same stream allocates only what is declared anew.
    let mut table = Table::new(track(1, PointWidths::BITS_32, 31, 60));
    let mut random = Random(8);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut ends = Vec::new();
    for frame in 0..40 {
        if frame % 10 == 0 {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        }
        if frame == 0 {
            encoder
                .tracks(&mut out, std::slice::from_ref(&table.track))
                .unwrap();
        }
        table.change(&mut random, 12);
        let change = if frame % 10 == 0 {
            table.keyframe()
        } else {
            table.delta()
        };
        let coverage = if frame % 10 == 0 {
            Coverage::Keyframe
        } else {
            Coverage::Delta
        };
        let compression = [Compression::None, Compression::Lz4, ZSTD][frame as usize % 3];
        encoder
            .points(&mut out, coverage, &[change.update()], compression)
            .unwrap();
        encoder
            .transforms(&mut out, &[(1, transform(frame as f32))], compression)
            .unwrap();
        encoder.commit(&mut out, frame, None).unwrap();
        ends.push(out.len());
    }
    let mut decoder = Decoder::new(Limits::default());
    for round in 0..2 {
        decoder.reset();
        let mut at = 0;
        for (frame, &end) in ends.iter().enumerate() {
            let calls = CALLS.load(Relaxed);
            while at < end {
                // In pieces, so that payloads are collected too.
                let until = end.min(at + 1000);
                at += decoder.push(&out[at..until]).unwrap().0;
            }
            decoder.clear_dirty();
            // The first round grows the buffers, and a declared track has a path.
            if round == 1 && frame > 0 {
                assert_eq!(CALLS.load(Relaxed), calls, "frame {frame} allocated");
            }
        }
    }

    // Volumes up to the limit of state, beside points, and again after a reset; then as many small
    // ones as the limit allows, that come and go.
    let limits = Limits {
        state_bytes: 8 << 20,
        ..SMALL
    };
    let coding = probes::Coding::Raw;
    let all = volumes::volume([32, 32, 19], 8, coding);
    assert!(all.count() as u64 * (184 + 128) > 5 << 20);
    let volumes_alone = declared(&[volumes::volume_track(3, all)]);
    let beside = declared(&[
        track(1, PointWidths::BITS_32, 1000, 2000),
        volumes::volume_track(3, all),
    ]);
    let points_alone = declared(&[track(1, PointWidths::BITS_32, (8 << 20) / 32 - 2, 1)]);
    within(limits, 8 << 20, |decoder| {
        for bytes in [
            &points_alone,
            &volumes_alone,
            &beside,
            &points_alone,
            &beside,
        ] {
            assert_eq!(push(decoder, bytes), Ok(()));
            decoder.reset();
        }
    });
    let limits = Limits {
        tracks: 1000,
        state_bytes: 1 << 20,
        stored_bytes: 256 << 10,
        unpacked_bytes: 256 << 10,
        frame_bytes: 256 << 10,
        ..SMALL
    };
    let mut many = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut many).unwrap();
    encoder.group(&mut many, GroupStart::Keyframes).unwrap();
    let one = volumes::volume([1, 1, 2], 0, coding);
    let mut random = Random(3);
    let mut fixtures: Vec<_> = (0..1000)
        .map(|id| volumes::VolumeFixture::new(id, one))
        .collect();
    for fixture in &mut fixtures {
        fixture.track.target.path = "p".repeat(64);
        fixture.change(&mut random, 1);
    }
    for part in fixtures.chunks(100) {
        let tracks: Vec<_> = part.iter().map(|fixture| fixture.track.clone()).collect();
        encoder.tracks(&mut many, &tracks).unwrap();
        let updates: Vec<_> = part.iter().map(|fixture| fixture.update()).collect();
        encoder
            .probes(&mut many, Coverage::Keyframe, &updates, Compression::None)
            .unwrap();
    }
    encoder.commit(&mut many, 0, None).unwrap();
    for odd in [0, 1] {
        let ids: Vec<u32> = (0..500).map(|i| 2 * i + odd).collect();
        encoder.remove_tracks(&mut many, &ids).unwrap();
        encoder.commit(&mut many, 0, None).unwrap();
    }
    within(limits, 700 << 10, |decoder| {
        assert_eq!(push(decoder, &many), Ok(()))
    });

    // Steady state of volumes: nothing is allocated, fill and visibility included.
    for coding in [coding, probes::Coding::Packed(volumes::STEPS)] {
        let mut fixture = volumes::VolumeFixture::new(1, volumes::volume([5, 4, 3], 4, coding));
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        let mut ends = Vec::new();
        for frame in 0..40 {
            let coverage = match frame % 10 {
                0 => Coverage::Keyframe,
                _ => Coverage::Delta,
            };
            if frame % 10 == 0 {
                encoder.group(&mut out, GroupStart::Keyframes).unwrap();
            }
            if frame == 0 {
                let track = std::slice::from_ref(&fixture.track);
                encoder.tracks(&mut out, track).unwrap();
            }
            fixture.change(&mut random, 1 + frame as u32 % 7);
            let compression = [Compression::None, Compression::Lz4, ZSTD][frame as usize % 3];
            encoder
                .probes(&mut out, coverage, &[fixture.update()], compression)
                .unwrap();
            encoder.commit(&mut out, frame, None).unwrap();
            ends.push(out.len());
        }
        let mut decoder = Decoder::new(Limits::default());
        for round in 0..2 {
            decoder.reset();
            let mut at = 0;
            for (frame, &end) in ends.iter().enumerate() {
                let calls = CALLS.load(Relaxed);
                while at < end {
                    let until = end.min(at + 1000);
                    at += decoder.push(&out[at..until]).unwrap().0;
                }
                decoder.clear_dirty();
                if round == 1 && frame > 0 {
                    assert_eq!(CALLS.load(Relaxed), calls, "frame {frame} allocated");
                }
            }
        }
    }
    vertices_within_limits();
    instances_within_limits();
    regions_within_limits();
}

/// Vertices up to the limit of state, beside points and after them; then frames that allocate nothing.
fn vertices_within_limits() {
    use dapple_codec::vertices::*;
    let of = |id: u32, count: u32| Track {
        id,
        target: Target::default(),
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Vertices(Vertices {
            signals: Signals::one(Kernel::cut_off(1.0)),
            count,
            bits: 8,
            order: Vertices::FILE_ORDER,
            coding: Coding::Packed,
        }),
    };
    let limits = Limits {
        state_bytes: 8 << 20,
        ..SMALL
    };
    let alone = declared(&[of(3, 4 << 20)]);
    let apart = declared_apart(&[of(1, 1 << 20), of(2, 1 << 20), of(3, 2 << 20)]);
    let beside = declared(&[track(1, PointWidths::BITS_32, 1000, 2000), of(3, 3 << 20)]);
    let points_alone = declared(&[track(1, PointWidths::BITS_32, (8 << 20) / 32 - 2, 1)]);
    within(limits, 8 << 20, |decoder| {
        for bytes in [&points_alone, &alone, &beside, &apart, &points_alone] {
            assert_eq!(push(decoder, bytes), Ok(()));
            decoder.reset();
        }
    });
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[of(1, 900), of(2, 50)]).unwrap();
    let mut ends = Vec::new();
    for frame in 0..12u8 {
        let (first, second) = ([frame; 900], [frame; 50]);
        let updates = [
            Update {
                track: 1,
                codes: &first,
            },
            Update {
                track: 2,
                codes: &second,
            },
        ];
        let updates = &updates[usize::from(frame) % 2..];
        let compression = [Compression::None, Compression::Lz4, ZSTD][usize::from(frame) % 3];
        encoder.vertices(&mut out, updates, compression).unwrap();
        encoder.commit(&mut out, frame.into(), None).unwrap();
        ends.push(out.len());
    }
    let mut decoder = Decoder::new(Limits::default());
    let mut at = 0;
    for (frame, &end) in ends.iter().enumerate() {
        let calls = CALLS.load(Relaxed);
        while at < end {
            at += decoder.push(&out[at..end]).unwrap().0;
        }
        decoder.clear_dirty();
        // The first of each packing makes room for it.
        if frame > 3 {
            assert_eq!(CALLS.load(Relaxed), calls, "frame {frame} allocated");
        }
    }
}

/// A stream of frames of instances, packed in every way, and where each frame ends.
fn frames_of_instances(coding: instances::Coding) -> (Vec<u8>, Vec<usize>) {
    let mut random = Random(8);
    let table = instance_tables::table(40, coding);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let track = instance_tables::table_track(7, table);
    encoder.tracks(&mut out, &[track]).unwrap();
    let mut ends = Vec::new();
    for frame in 0..12 {
        let entries = instance_tables::entries(&table, &mut random);
        let update = instance_tables::update(7, &entries);
        let compression = [Compression::None, Compression::Lz4, ZSTD][frame % 3];
        encoder.instances(&mut out, &[update], compression).unwrap();
        encoder.commit(&mut out, frame as u64, None).unwrap();
        ends.push(out.len());
    }
    encoder.end(&mut out).unwrap();
    (out, ends)
}

/// Entries up to the limit of state, beside points and after them; then frames that allocate nothing.
fn instances_within_limits() {
    use instances::Coding;
    let of = |id, count| {
        let table = instance_tables::table(count, Coding::Packed);
        instance_tables::table_track(id, table)
    };
    let limits = Limits {
        state_bytes: 8 << 20,
        ..SMALL
    };
    let count = (8 << 20) / 48;
    let alone = declared(&[of(3, count)]);
    let apart = declared_apart(&[of(1, count / 2), of(2, count / 2)]);
    let beside = declared(&[track(1, PointWidths::BITS_32, 1000, 2000), of(3, 170_000)]);
    let points_alone = declared(&[track(1, PointWidths::BITS_32, (8 << 20) / 32 - 2, 1)]);
    within(limits, 8 << 20, |decoder| {
        for bytes in [&points_alone, &alone, &beside, &apart, &points_alone] {
            assert_eq!(push(decoder, bytes), Ok(()));
            decoder.reset();
        }
    });
    for coding in [Coding::Raw, Coding::Packed] {
        let (out, ends) = frames_of_instances(coding);
        let mut decoder = Decoder::new(Limits::default());
        for round in 0..2 {
            decoder.reset();
            let mut at = 0;
            for (frame, &end) in ends.iter().enumerate() {
                let calls = CALLS.load(Relaxed);
                while at < end {
                    at += decoder.push(&out[at..end]).unwrap().0;
                }
                decoder.clear_dirty();
                // The first round grows the buffers.
                if round == 1 && frame > 0 {
                    assert_eq!(CALLS.load(Relaxed), calls, "frame {frame} allocated");
                }
            }
        }
    }
}

/// A stream of frames of regions, packed in every way, and where each frame ends.
fn frames_of_regions(coding: regions::Coding) -> (Vec<u8>, Vec<usize>) {
    let mut random = Random(8);
    let set = region_sets::set(6, coding);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let track = region_sets::region_track(7, set);
    encoder.tracks(&mut out, &[track]).unwrap();
    let mut ends = Vec::new();
    for frame in 0..12 {
        let content = region_sets::content(&set, &mut random);
        let update = region_sets::update(7, &content);
        let compression = [Compression::None, Compression::Lz4, ZSTD][frame % 3];
        encoder.regions(&mut out, &[update], compression).unwrap();
        encoder.commit(&mut out, frame as u64, None).unwrap();
        ends.push(out.len());
    }
    encoder.end(&mut out).unwrap();
    (out, ends)
}

/// Regions up to the limit of state, beside points and after them; then frames that allocate nothing.
fn regions_within_limits() {
    use regions::{Coding, RegionSet};
    let of = |id, count, capacity| {
        let set = region_sets::set(count, Coding::Packed);
        region_sets::region_track(id, RegionSet { capacity, ..set })
    };
    let limits = Limits {
        state_bytes: 8 << 20,
        ..SMALL
    };
    let count = (8 << 20) / (96 + 8 * 20);
    let alone = declared(&[of(3, count, 20 * count)]);
    let apart = declared_apart(&[of(1, 9000, 180_000), of(2, 9000, 180_000)]);
    let beside = declared(&[
        track(1, PointWidths::BITS_32, 1000, 2000),
        of(3, 20_000, 400_000),
    ]);
    let points_alone = declared(&[track(1, PointWidths::BITS_32, (8 << 20) / 32 - 2, 1)]);
    within(limits, 8 << 20, |decoder| {
        for bytes in [&points_alone, &alone, &beside, &apart, &points_alone] {
            assert_eq!(push(decoder, bytes), Ok(()));
            decoder.reset();
        }
    });
    for coding in [Coding::Raw, Coding::Packed] {
        let (out, ends) = frames_of_regions(coding);
        let mut decoder = Decoder::new(Limits::default());
        for round in 0..2 {
            decoder.reset();
            let mut at = 0;
            for (frame, &end) in ends.iter().enumerate() {
                let calls = CALLS.load(Relaxed);
                while at < end {
                    at += decoder.push(&out[at..end]).unwrap().0;
                }
                decoder.clear_dirty();
                // The first round grows the buffers.
                if round == 1 && frame > 0 {
                    assert_eq!(CALLS.load(Relaxed), calls, "frame {frame} allocated");
                }
            }
        }
    }
}

fn reset_and_free_gives_memory_back() {
    let bytes = stream(Compression::Lz4, false).0;
    let before = NOW.load(Relaxed);
    let mut decoder = Decoder::new(Limits::default());
    let new = NOW.load(Relaxed) - before;
    for _ in 0..2 {
        assert_eq!(decode(&mut decoder, &bytes).1, Ok(()));
        decoder.reset();
        assert!(NOW.load(Relaxed) - before > new);
        decoder.reset_and_free();
        assert_eq!(NOW.load(Relaxed) - before, new);
    }
}

/// Whichever allocation of a decoder is refused, the call gives an error, the committed state stays,
/// and the decoder can be used again.
fn refused_memory_is_an_error() {
    let points = stream(Compression::Lz4, false).0;
    let mut fixture =
        volumes::VolumeFixture::new(7, volumes::volume([5, 4, 3], 4, probes::Coding::Raw));
    fixture.change(&mut Random(4), 1);
    let mut probes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut probes).unwrap();
    encoder.group(&mut probes, GroupStart::Keyframes).unwrap();
    encoder
        .tracks(&mut probes, std::slice::from_ref(&fixture.track))
        .unwrap();
    encoder
        .probes(
            &mut probes,
            Coverage::Keyframe,
            &[fixture.update()],
            Compression::Lz4,
        )
        .unwrap();
    encoder.commit(&mut probes, 0, None).unwrap();
    encoder.end(&mut probes).unwrap();
    let regions = frames_of_regions(regions::Coding::Packed).0;
    let instances = frames_of_instances(instances::Coding::Packed).0;
    for bytes in [&points, &probes, &instances, &regions] {
        let mut refused = 0;
        for which in 1.. {
            let mut decoder = Decoder::new(Limits::default());
            REFUSED.store(which, Relaxed);
            let mut rest = &bytes[..];
            let mut result = Ok(());
            // In pieces, so that payloads are collected too.
            while !rest.is_empty() && result.is_ok() {
                let piece = rest.len().min(50);
                match decoder.push(&rest[..piece]) {
                    Ok((used, _)) => rest = &rest[used..],
                    Err(error) => result = Err(error),
                }
            }
            let spared = REFUSED.swap(0, Relaxed) > 0;
            if spared {
                assert_eq!(result, Ok(()));
                break;
            }
            let error = result.unwrap_err();
            assert_eq!(
                (error.id, error.class),
                (4013, ErrorClass::OutOfMemory),
                "{which}"
            );
            refused += 1;
            decoder.reset();
            assert_eq!(decode(&mut decoder, bytes).1, Ok(()));
        }
        assert!(refused > 10, "{refused}");
    }
}
