//! What decoding allocates: within the limits, and nothing once it runs.

mod common;
use common::*;
use dapple_codec::points::*;
use dapple_codec::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static CALLS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: passes every call on to the system's allocator and only counts.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Relaxed);
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

/// One test, since the counters are the process's.
#[test]
fn allocations() {
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

    // Small limits: every damaged stream stays within them.
    let limits = Limits {
        stored_bytes: 16 << 10,
        unpacked_bytes: 16 << 10,
        frame_bytes: 32 << 10,
        zstd_window_bytes: 16 << 10,
        tracks: 8,
        path_bytes: 64,
        state_bytes: 16 << 10,
    };
    let bound = (16 + 16 + 32 + 16 + 16) << 10;
    for compression in [Compression::None, Compression::Lz4, Compression::PAPER] {
        let (bytes, _) = stream(compression, false);
        let mut random = Random(3);
        for _ in 0..300 {
            let mut damaged = bytes.clone();
            for _ in 0..random.below(3) {
                // Header fields and payloads with checksums mended, so that the claims are read.
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
            let peak = peak_of(|| {
                let mut decoder = Decoder::new(limits);
                let mut rest = &damaged[..];
                while let Ok((consumed, event)) = decoder.push(rest) {
                    rest = &rest[consumed..];
                    if matches!(event, Event::NeedInput | Event::End) {
                        break;
                    }
                }
            });
            // The C decoder's context lies outside Rust's allocator.
            assert!(peak < bound + (64 << 10), "{peak} bytes");
        }
    }

    // A bomb: sixteen megabytes of zeros in a track record.
    for compression in [Compression::Lz4, Compression::PAPER] {
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
            .points(&mut out, Coverage::Keyframe, &[update], compression)
            .unwrap();
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
        let compression =
            [Compression::None, Compression::Lz4, Compression::PAPER][frame as usize % 3];
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
}
