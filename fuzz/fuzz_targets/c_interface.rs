//! The C interface under calls in any order with any arguments that its header allows: every status is one that is
//! documented, whatever a pointer leads to can be read, a decoder that failed keeps its state, and what the encoder
//! writes decodes to its digest.
#![no_main]

use std::ffi::c_char;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};
use std::slice;

use dapple_c::*;
use dapple_fuzz::LIMITS;
use dapple_fuzz::recompute::{Recompute, recompute};
use libfuzzer_sys::fuzz_target;

/// Takes numbers from the front of the input; 0 once it is used up.
struct Input<'a>(&'a [u8]);

impl Input<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        first
    }

    fn word(&mut self) -> u32 {
        // Small numbers are as likely as all others.
        let first = self.byte();
        match first {
            0..240 => u32::from(first),
            _ => u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()]),
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let Some((&[how, calls], rest)) = data.split_first_chunk() else {
        return;
    };
    let (calls, bytes) = rest.split_at(rest.len().min(usize::from(calls)));
    let mut bytes = bytes.to_vec();
    recompute(&mut bytes, Recompute::choose(how));
    // SAFETY: every pointer is null or of what lives here.
    unsafe {
        decode(Input(calls), &bytes);
        encode(Input(calls), &bytes);
    }
});

/// A documented status.
fn check(status: i32) -> i32 {
    let id = status.unsigned_abs();
    let known = (1001..5000).contains(&id) || (9001..=9004).contains(&id);
    assert!(
        status >= 0 || (known && id != ERROR_PANIC),
        "status {status}"
    );
    status
}

unsafe fn decode(mut calls: Input<'_>, bytes: &[u8]) {
    unsafe {
        let decoder = dapple_decoder_new(&LIMITS.into());
        let mut at = 0;
        let mut failed = false;
        while !calls.0.is_empty() || at < bytes.len() {
            // Once the calls are used up, what is left of the bytes is pushed.
            let call = if calls.0.is_empty() {
                15
            } else {
                calls.byte() % 16
            };
            match call {
                0 => {
                    check(dapple_decoder_reset(decoder));
                    failed = false;
                }
                1 => {
                    let resumed = check(dapple_decoder_resume(decoder));
                    failed &= resumed == 0;
                }
                2 => {
                    check(dapple_decoder_finish(decoder));
                    check(dapple_decoder_finish_live(decoder));
                }
                3 => {
                    check(dapple_decoder_clear_dirty(decoder));
                }
                4 => arrays(decoder, calls.word(), calls.word()),
                5 => tracks(decoder, calls.word() as usize, calls.word() as usize),
                6 => {
                    let mut text = [1 as c_char; 64];
                    let size = usize::from(calls.byte()) % 65;
                    dapple_decoder_error_message(decoder, text.as_mut_ptr(), size);
                    assert!(size == 0 || text[..size].contains(&0));
                    assert!(text[size..].iter().all(|&byte| byte == 1));
                    let mut error = ErrorInfo::default();
                    dapple_decoder_error(decoder, &raw mut error);
                }
                7 => {
                    let mut used = 0;
                    let none = null_mut();
                    assert_eq!(
                        dapple_decoder_push(decoder, null(), 1, &raw mut used, none),
                        -9001
                    );
                }
                _ => {
                    let piece = (1 + calls.word() as usize).min(bytes.len() - at);
                    let before = failed.then(|| state(decoder));
                    let (mut used, mut event) = (0, EventInfo::default());
                    let from = bytes[at..].as_ptr();
                    let status =
                        dapple_decoder_push(decoder, from, piece, &raw mut used, &raw mut event);
                    check(status);
                    assert!(used <= piece);
                    at += used;
                    assert!(status < 0 || event.kind == status as u32);
                    if let Some(before) = before {
                        assert!(status == -4011 && used == 0 && before == state(decoder));
                        at += piece;
                    }
                    failed = status < 0 && status != -9001;
                    if calls.0.is_empty() && failed {
                        break;
                    }
                }
            }
        }
        dapple_decoder_free(decoder);
    }
}

unsafe fn state(decoder: *mut Decoder) -> (u64, u64, usize) {
    unsafe {
        let mut digest = 0;
        check(dapple_decoder_state_digest(decoder, &raw mut digest));
        let position = dapple_decoder_position(decoder);
        (digest, position, dapple_decoder_track_count(decoder))
    }
}

/// Reads an array, and all that the list of dirty ranges leads to.
unsafe fn arrays(decoder: *mut Decoder, buffer: u32, track: u32) {
    unsafe {
        let mut array = MaybeUninit::<Array>::uninit();
        check(dapple_decoder_array(
            decoder,
            buffer,
            track,
            array.as_mut_ptr(),
        ));
        let (mut ranges, mut count) = (null(), 0);
        check(dapple_decoder_dirty(
            decoder,
            &raw mut ranges,
            &raw mut count,
        ));
        let ranges = slice::from_raw_parts(ranges, count).to_vec();
        for range in ranges {
            let status =
                dapple_decoder_array(decoder, range.buffer, range.track, array.as_mut_ptr());
            assert_eq!(status, 0);
            let array = array.assume_init();
            let bytes = slice::from_raw_parts(array.data.cast::<u8>(), array.size);
            let (start, end) = (range.start as usize, range.end as usize);
            let changed = &bytes[array.element_size * start..array.element_size * end];
            std::hint::black_box(changed.iter().map(|&byte| u64::from(byte)).sum::<u64>());
            let own = slice::from_raw_parts(array.dirty, array.dirty_count);
            assert!(own.contains(&range) && own.is_sorted_by(|a, b| a.end < b.start));
        }
    }
}

unsafe fn tracks(decoder: *mut Decoder, first: usize, count: usize) {
    unsafe {
        for index in 0..=dapple_decoder_track_count(decoder) {
            let mut track = MaybeUninit::<Track>::uninit();
            let status = check(dapple_decoder_track(decoder, index, track.as_mut_ptr()));
            if status < 0 {
                assert_eq!(index, dapple_decoder_track_count(decoder));
                return;
            }
            let track = track.assume_init();
            let path = slice::from_raw_parts(track.path.cast::<u8>(), track.path_size);
            assert!(str::from_utf8(path).is_ok());
            let mut found = MaybeUninit::<Track>::uninit();
            assert_eq!(
                dapple_decoder_find_track(decoder, track.id, found.as_mut_ptr()),
                0
            );
            let absent = Probe {
                level: 9,
                codes: [0; 27],
            };
            let mut probes = vec![absent; count.min(1000)];
            let (out, count) = (probes.as_mut_ptr(), probes.len());
            if check(dapple_decoder_probes(decoder, track.id, first, count, out)) == 0 {
                assert!(probes.iter().all(|probe| probe.level < 4));
            }
            let mut bits = vec![0; first.min(1000)];
            check(dapple_decoder_presence(
                decoder,
                track.id,
                bits.as_mut_ptr(),
                bits.len(),
            ));
        }
    }
}

/// Numbers of any value, also as floats.
unsafe fn fill<T>(calls: &mut Input<'_>, value: &mut T) {
    let words = size_of::<T>() / 4;
    // SAFETY: the structs have no padding and are all numbers.
    unsafe {
        for at in 0..words {
            let word = calls.word();
            let word = match word & 1 {
                0 => word >> 1,
                _ => (word as f32 / 8.0).to_bits(),
            };
            (&raw mut *value)
                .cast::<u32>()
                .add(at)
                .write_unaligned(word);
        }
    }
}

unsafe fn encode(mut calls: Input<'_>, bytes: &[u8]) {
    unsafe {
        let mut config = MaybeUninit::<EncoderConfig>::uninit();
        dapple_encoder_config_default(config.as_mut_ptr());
        let mut config = config.assume_init();
        config.limits = LIMITS.into();
        let encoder = dapple_encoder_new(&raw const config, null_mut());
        let mut words = [0u32; 96];
        for (word, from) in words.iter_mut().zip(bytes.chunks_exact(4)) {
            *word = u32::from_le_bytes([from[0], from[1], from[2], from[3]]);
        }
        let mut ended = false;
        while !calls.0.is_empty() && !ended {
            match calls.byte() % 10 {
                0 => {
                    let mut track = MaybeUninit::<Track>::zeroed().assume_init();
                    fill(&mut calls, &mut track.parameters);
                    track.id = calls.word();
                    track.model = calls.word();
                    track.coding = calls.word();
                    track.path = bytes.as_ptr().cast();
                    track.path_size = bytes.len().min(usize::from(calls.byte()));
                    check(dapple_encoder_tracks(encoder, &raw const track, 1));
                }
                1 => {
                    let digest = u64::from(calls.word());
                    let digest = match calls.byte() % 2 {
                        0 => null(),
                        _ => &raw const digest,
                    };
                    check(dapple_encoder_group(encoder, digest));
                }
                2 => {
                    let ids = [calls.word(), calls.word()];
                    check(dapple_encoder_remove_tracks(encoder, ids.as_ptr(), 2));
                }
                3 => {
                    let mut transform = MaybeUninit::<Transform>::zeroed().assume_init();
                    fill(&mut calls, &mut transform);
                    check(dapple_encoder_transforms(encoder, &raw const transform, 1));
                }
                4 => {
                    let indices = [calls.word(), calls.word()];
                    let update = PointsUpdate {
                        track: calls.word(),
                        reserved: 0,
                        bucket_indices: indices.as_ptr(),
                        buckets: words.as_ptr(),
                        bucket_count: usize::from(calls.byte() % 3),
                        cell_indices: indices.as_ptr(),
                        cells: words[16..].as_ptr(),
                        cell_count: usize::from(calls.byte() % 3),
                    };
                    let (coverage, packing) = (calls.word(), calls.word());
                    check(dapple_encoder_points(
                        encoder,
                        coverage,
                        &raw const update,
                        1,
                        packing,
                    ));
                }
                5 => {
                    let mut probes = [Probe {
                        level: 0,
                        codes: [0; 27],
                    }; 4];
                    probes.iter_mut().for_each(|probe| {
                        probe.level = u16::from(calls.byte() % 4);
                        probe.codes = std::array::from_fn(|_| calls.byte().into());
                    });
                    let update = ProbesUpdate {
                        track: calls.word(),
                        reserved: 0,
                        base: probes.as_ptr(),
                        probes: probes.as_ptr(),
                        count: usize::from(calls.byte() % 5),
                        visibility: bytes.as_ptr(),
                        visibility_size: bytes.len(),
                    };
                    let (coverage, packing) = (calls.word(), calls.word());
                    check(dapple_encoder_probes(
                        encoder,
                        coverage,
                        &raw const update,
                        1,
                        packing,
                    ));
                }
                6 => {
                    let update = VerticesUpdate {
                        track: calls.word(),
                        reserved: 0,
                        codes: bytes.as_ptr(),
                        count: bytes.len().min(usize::from(calls.byte())),
                    };
                    check(dapple_encoder_vertices(
                        encoder,
                        &raw const update,
                        1,
                        calls.word(),
                    ));
                }
                7 => {
                    let mut entry = MaybeUninit::<InstanceEntry>::zeroed().assume_init();
                    fill(&mut calls, &mut entry);
                    let update = InstancesUpdate {
                        track: calls.word(),
                        reserved: 0,
                        entries: &raw const entry,
                        count: 1,
                    };
                    check(dapple_encoder_instances(
                        encoder,
                        &raw const update,
                        1,
                        calls.word(),
                    ));
                    let mut region = MaybeUninit::<Region>::zeroed().assume_init();
                    fill(&mut calls, &mut region);
                    let update = RegionsUpdate {
                        track: calls.word(),
                        reserved: 0,
                        regions: &raw const region,
                        region_count: 1,
                        pairs: words.as_ptr().cast(),
                        pair_count: usize::from(calls.byte()) % 190,
                    };
                    check(dapple_encoder_regions(
                        encoder,
                        &raw const update,
                        1,
                        calls.word(),
                    ));
                    let mut grid = Grid::default();
                    fill(&mut calls, &mut grid);
                    let vector = [0.5f32, 2.0, -1.0];
                    let (position, normal) = (vector.as_ptr(), vector.as_ptr());
                    dapple_points_pack(&raw const grid, position, normal, 0.5);
                    dapple_points_bucket(&raw const grid, calls.word());
                    dapple_points_key(&raw const grid, 1, 2, calls.word());
                }
                8 => {
                    check(dapple_encoder_commit(encoder, calls.word().into()));
                }
                _ => ended = check(dapple_encoder_end(encoder)) == 0,
            }
        }
        let (mut written, mut size) = (null(), 0);
        assert_eq!(
            dapple_encoder_bytes(encoder, &raw mut written, &raw mut size),
            0
        );
        // Whatever was written decodes, to the encoder's state.
        let decoder = dapple_decoder_new(&LIMITS.into());
        let mut at = 0;
        while at < size {
            let mut used = 0;
            let from = written.add(at);
            let status = dapple_decoder_push(decoder, from, size - at, &raw mut used, null_mut());
            assert!(status >= 0, "status {status}");
            at += used;
        }
        let mut digest = 0;
        assert_eq!(dapple_encoder_state_digest(encoder, &raw mut digest), 0);
        assert_eq!(state(decoder).0, digest);
        dapple_decoder_free(decoder);
        dapple_encoder_free(encoder);
    }
}
