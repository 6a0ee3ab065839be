//! The functions as a caller has them: misuse is an error, and results are those of the codec.

use std::ffi::c_char;
use std::ptr::{null, null_mut};

use dapple_c::*;
use dapple_codec as codec;

const POINTS: &[u8] = include_bytes!("../../../spec/examples/points.dapple");
const PROBES: &[u8] = include_bytes!("../../../spec/examples/probes.dapple");
const REGIONS: &[u8] = include_bytes!("../../../spec/examples/regions.dapple");
const VERTICES: &[u8] = include_bytes!("../../../spec/examples/vertices.dapple");

fn empty_array() -> Array {
    Array {
        data: null(),
        size: 0,
        element_size: 0,
        dirty: null(),
        dirty_count: 0,
    }
}

/// Pushes all, and returns the events and the last status.
unsafe fn push(decoder: *mut Decoder, mut input: &[u8]) -> (Vec<u32>, i32) {
    let mut events = Vec::new();
    loop {
        let (mut used, mut event) = (0, EventInfo::default());
        let status = unsafe {
            dapple_decoder_push(
                decoder,
                input.as_ptr(),
                input.len(),
                &raw mut used,
                &raw mut event,
            )
        };
        input = &input[used..];
        if status <= 0 {
            return (events, status);
        }
        assert_eq!(status as u32, event.kind);
        events.push(event.kind);
        if event.kind == 6 && input.is_empty() {
            return (events, 0);
        }
    }
}

fn message(decoder: *const Decoder) -> String {
    let mut text = [0u8; 200];
    let out = text.as_mut_ptr().cast::<c_char>();
    let length = unsafe { dapple_decoder_error_message(decoder, out, text.len()) };
    String::from_utf8(text[..length].to_vec()).expect("UTF-8")
}

#[test]
fn arrays_and_dirty_ranges_are_those_of_the_codec() {
    for stream in [POINTS, PROBES, REGIONS, VERTICES] {
        let oracle = codec::decode_all(stream, codec::Limits::default(), |_, _| {}).expect("valid");
        unsafe {
            let decoder = dapple_decoder_new(null());
            assert_eq!(push(decoder, stream).1, 0);
            let (mut ranges, mut count) = (null(), 0);
            assert_eq!(
                dapple_decoder_dirty(decoder, &raw mut ranges, &raw mut count),
                0
            );
            let ranges = std::slice::from_raw_parts(ranges, count);
            let expected: Vec<DirtyRange> = oracle
                .dirty()
                .map(|dirty| DirtyRange {
                    buffer: dirty.buffer.number(),
                    track: dirty.track.unwrap_or(0),
                    start: dirty.range.start,
                    end: dirty.range.end,
                })
                .collect();
            assert!(ranges == expected && !expected.is_empty());
            let mut found = 0;
            for buffer in codec::Buffer::ALL {
                for state in oracle.tracks() {
                    let id = state.track.id;
                    let mut array = empty_array();
                    let status = dapple_decoder_array(decoder, buffer.number(), id, &raw mut array);
                    assert_eq!(status, 0);
                    let own = oracle.array(buffer, Some(id));
                    let bytes = match own.is_empty() {
                        true => oracle.array(buffer, None),
                        false => own,
                    };
                    let data = array.data.cast::<u8>();
                    assert_eq!(std::slice::from_raw_parts(data, array.size), bytes);
                    assert_eq!(array.element_size, buffer.element_bytes());
                    let dirty = std::slice::from_raw_parts(array.dirty, array.dirty_count);
                    let all = ranges.iter().filter(|range| {
                        let shared = [0, 1, 4].contains(&range.buffer);
                        range.buffer == buffer.number() && (shared || range.track == id)
                    });
                    assert!(all.eq(dirty), "{buffer:?}");
                    found += dirty.len();
                }
            }
            assert!(found >= count);
            let mut digest = 0;
            assert_eq!(dapple_decoder_state_digest(decoder, &raw mut digest), 0);
            assert_eq!(digest, oracle.state_digest());
            assert_eq!(dapple_decoder_work(decoder), oracle.work());
            assert_eq!(dapple_decoder_clear_dirty(decoder), 0);
            let mut none = null();
            assert_eq!(
                dapple_decoder_dirty(decoder, &raw mut none, &raw mut count),
                0
            );
            assert_eq!(count, 0);
            dapple_decoder_free(decoder);
        }
    }
}

#[test]
fn misuse_is_an_error() {
    unsafe {
        let mut used = 0;
        let none = null_mut();
        assert_eq!(
            dapple_decoder_push(null_mut(), null(), 0, &raw mut used, none),
            -9001
        );
        assert_eq!(dapple_decoder_reset(null_mut()), -9001);
        assert_eq!(dapple_decoder_track_count(null()), 0);
        dapple_decoder_free(null_mut());
        let decoder = dapple_decoder_new(null());
        assert_eq!(
            dapple_decoder_push(decoder, null(), 1, &raw mut used, none),
            -9001
        );
        assert_eq!(
            dapple_decoder_push(decoder, null(), 0, null_mut(), none),
            -9001
        );
        assert_eq!(
            dapple_decoder_push(decoder, null(), 0, &raw mut used, none),
            0
        );
        let mut array = empty_array();
        assert_eq!(dapple_decoder_array(decoder, 10, 0, &raw mut array), -9001);
        assert_eq!(dapple_decoder_array(decoder, 2, 0, &raw mut array), -9003);
        assert_eq!(dapple_decoder_array(decoder, 0, 0, null_mut()), -9001);
        assert_eq!(dapple_decoder_array(decoder, 0, 0, &raw mut array), 0);
        assert_eq!(dapple_decoder_probes(decoder, 1, 0, 0, null_mut()), -9003);
        let mut error = ErrorInfo::default();
        dapple_decoder_error(decoder, &raw mut error);
        assert_eq!((error.id, error.layer, error.class_), (9003, 9, 7));
        assert_eq!(message(decoder), "E9003 no-track");
        dapple_decoder_free(decoder);
    }
}

#[test]
fn errors_have_details_and_state_stays() {
    unsafe {
        let decoder = dapple_decoder_new(null());
        let mut bad = POINTS.to_vec();
        let last = bad.len() - 1;
        bad[last] ^= 1;
        let (events, status) = push(decoder, &bad);
        assert_eq!(status, -1011);
        let mut error = ErrorInfo::default();
        dapple_decoder_error(decoder, &raw mut error);
        let oracle = codec::decode_all(&bad, codec::Limits::default(), |_, _| {});
        let expected = oracle.map(|_| ()).expect_err("a wrong checksum");
        assert_eq!(error, expected.into());
        assert_eq!((error.layer, error.class_), (1, 4));
        assert_eq!(message(decoder), expected.to_string());
        // What was committed is there, and a reset starts over.
        assert!(events.contains(&4) && dapple_decoder_track_count(decoder) > 0);
        assert_eq!(push(decoder, &[0]).1, -4011);
        assert_eq!(dapple_decoder_reset(decoder), 0);
        assert_eq!(push(decoder, POINTS).1, 0);
        assert_eq!(dapple_decoder_finish(decoder), 0);
        dapple_decoder_free(decoder);

        let limits = codec::Limits {
            tracks: 0,
            ..codec::Limits::default()
        };
        let decoder = dapple_decoder_new(&limits.into());
        assert_eq!(push(decoder, POINTS).1, -2013);
        dapple_decoder_error(decoder, &raw mut error);
        assert_eq!((error.class_, error.limit), (5, 5));
        assert_eq!((error.asked, error.allowed), (1, 0));
        dapple_decoder_free(decoder);
    }
}

#[test]
fn names_are_cut_to_the_memory_there_is() {
    let mut text = [7u8; 8];
    unsafe {
        let out = text.as_mut_ptr().cast::<c_char>();
        assert_eq!(dapple_error_name(1001, out, 4), 5);
        assert_eq!(&text[..5], b"mag\0\x07");
        assert_eq!(dapple_error_name(9002, null_mut(), 0), 5);
        assert_eq!(dapple_error_name(77_777, null_mut(), 0), 7);
    }
}

/// Tracks that are decoded are declared again, with their content, and give the same state.
#[test]
fn streams_of_every_model_roundtrip_through_the_encoder() {
    for stream in [POINTS, PROBES, REGIONS, VERTICES] {
        unsafe {
            let decoder = dapple_decoder_new(null());
            assert_eq!(push(decoder, stream).1, 0);
            let mut status = 1;
            let encoder = dapple_encoder_new(null(), &raw mut status);
            assert_eq!(status, 0);
            assert_eq!(dapple_encoder_group(encoder, null()), 0);
            let count = dapple_decoder_track_count(decoder);
            let mut transforms = Vec::new();
            let mut written = Vec::new();
            for index in 0..count {
                let mut track = std::mem::MaybeUninit::<Track>::uninit();
                assert_eq!(dapple_decoder_track(decoder, index, track.as_mut_ptr()), 0);
                let track = track.assume_init();
                if track.has_transform != 0 {
                    transforms.push(Transform {
                        track: track.id,
                        world_from_grid: track.world_from_grid,
                    });
                }
                written.push(track);
            }
            assert_eq!(dapple_encoder_tracks(encoder, written.as_ptr(), count), 0);
            if !transforms.is_empty() {
                let status =
                    dapple_encoder_transforms(encoder, transforms.as_ptr(), transforms.len());
                assert_eq!(status, 0);
            }
            for track in &written {
                assert_eq!(
                    copy_content(decoder, encoder, track),
                    0,
                    "model {}",
                    track.model
                );
            }
            assert_eq!(dapple_encoder_commit(encoder, 5), 0);
            assert_eq!(dapple_encoder_end(encoder), 0);
            let (mut bytes, mut size) = (null(), 0);
            assert_eq!(
                dapple_encoder_bytes(encoder, &raw mut bytes, &raw mut size),
                0
            );
            let bytes = std::slice::from_raw_parts(bytes, size);
            let again = codec::decode_all(bytes, codec::Limits::default(), |_, _| {});
            let mut digest = 0;
            dapple_decoder_state_digest(decoder, &raw mut digest);
            assert_eq!(again.expect("valid").state_digest(), digest);
            dapple_decoder_free(decoder);
            dapple_encoder_free(encoder);
        }
    }
}

/// Gives an encoder what a decoder has of a track, as a keyframe.
unsafe fn copy_content(decoder: *mut Decoder, encoder: *mut Encoder, track: &Track) -> i32 {
    let array = |buffer: u32| unsafe {
        let mut array = empty_array();
        assert_eq!(
            dapple_decoder_array(decoder, buffer, track.id, &raw mut array),
            0
        );
        array
    };
    let id = track.id;
    unsafe {
        match track.model {
            1 => {
                let grid = track.parameters.points;
                let (buckets, cells) = (grid.bucket_count, grid.cell_capacity);
                let bucket_indices: Vec<u32> = (0..buckets).collect();
                let cell_indices: Vec<u32> = (0..cells).collect();
                let words = |buffer, first: u32| {
                    array(buffer)
                        .data
                        .cast::<u32>()
                        .wrapping_add(8 * first as usize)
                };
                let update = PointsUpdate {
                    track: id,
                    reserved: 0,
                    bucket_indices: bucket_indices.as_ptr(),
                    buckets: words(0, grid.first_bucket),
                    bucket_count: bucket_indices.len(),
                    cell_indices: cell_indices.as_ptr(),
                    cells: words(1, grid.first_cell),
                    cell_count: cell_indices.len(),
                };
                dapple_encoder_points(encoder, 0, &raw const update, 1, 1)
            }
            2 => {
                let volume = track.parameters.probes;
                let count = volume.dims.iter().product::<u32>() as usize;
                let absent = Probe {
                    level: 0,
                    codes: [0; 27],
                };
                let mut probes = vec![absent; count];
                let status = dapple_decoder_probes(decoder, id, 0, count, probes.as_mut_ptr());
                assert_eq!(status, 0);
                let mut bits = vec![0; count.div_ceil(32)];
                let status = dapple_decoder_presence(decoder, id, bits.as_mut_ptr(), bits.len());
                assert_eq!(status, 0);
                for (at, probe) in probes.iter().enumerate() {
                    assert_eq!(bits[at / 32] >> (at % 32) & 1 == 1, probe.level > 0);
                }
                let visibility = array(3);
                let update = ProbesUpdate {
                    track: id,
                    reserved: 0,
                    base: null(),
                    probes: probes.as_ptr(),
                    count,
                    visibility: match visibility.size {
                        0 => null(),
                        _ => visibility.data.cast(),
                    },
                    visibility_size: visibility.size,
                };
                dapple_encoder_probes(encoder, 0, &raw const update, 1, 1)
            }
            3 => {
                let vertices = track.parameters.vertices;
                let count = (vertices.count * vertices.signals.count) as usize;
                let first = vertices.first_value as usize;
                let values = array(4).data.cast::<u8>().wrapping_add(first);
                let values = std::slice::from_raw_parts(values, count);
                let codes: Vec<u8> = match vertices.bits {
                    8 => values.to_vec(),
                    _ => values.iter().map(|value| value >> 3).collect(),
                };
                let update = VerticesUpdate {
                    track: id,
                    reserved: 0,
                    codes: codes.as_ptr(),
                    count,
                };
                dapple_encoder_vertices(encoder, &raw const update, 1, 1)
            }
            4 => {
                let table = track.parameters.instances;
                let (keys, values) = (array(5), array(6));
                let signals = table.signals.count as usize;
                let keys = std::slice::from_raw_parts(keys.data.cast::<u64>(), keys.size / 8);
                let values =
                    std::slice::from_raw_parts(values.data.cast::<[i16; 4]>(), values.size / 8);
                let step = table.step as i16;
                let entries = keys.iter().zip(values.chunks(signals));
                let entries = entries.map(|(&key, values)| {
                    let code = |at: usize| values.get(at).map_or([0; 4], |v| v.map(|v| v / step));
                    let codes = [code(0), code(1)];
                    InstanceEntry {
                        key,
                        linear: codes.iter().any(|code| code[1..] != [0; 3]).into(),
                        reserved: 0,
                        codes,
                    }
                });
                let entries: Vec<InstanceEntry> = entries.collect();
                let update = InstancesUpdate {
                    track: id,
                    reserved: 0,
                    entries: entries.as_ptr(),
                    count: entries.len(),
                };
                dapple_encoder_instances(encoder, &raw const update, 1, 1)
            }
            _ => {
                let (regions, pairs) = (array(7), array(8));
                let count = regions.size / 48;
                let all = std::slice::from_raw_parts(regions.data.cast::<Region>(), count);
                // The last region's pairs are the last in use.
                let used = all.iter().map(|region| {
                    let form = region.form;
                    let side = (form >> 2 & 3) + 1;
                    let derivatives = [0, 3, 6][(form & 3) as usize];
                    let signals = (form >> 4 & 1) + 1;
                    region.first + ((1 + derivatives) * side * side * signals).div_ceil(2)
                });
                let update = RegionsUpdate {
                    track: id,
                    reserved: 0,
                    regions: regions.data.cast(),
                    region_count: count,
                    pairs: pairs.data.cast(),
                    pair_count: used.max().unwrap_or(0) as usize,
                };
                dapple_encoder_regions(encoder, &raw const update, 1, 1)
            }
        }
    }
}
