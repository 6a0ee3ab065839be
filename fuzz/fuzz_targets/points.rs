//! Any bytes as `points` payloads of tracks that the input chooses, in a stream that is otherwise
//! right: every committed state keeps the rules of `spec/points.md` §5.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::container::{Packing, record_type};
use dapple_codec::{Encoder, EncoderConfig, GroupStart};
use dapple_fuzz::forge::Forge;
use dapple_fuzz::viewer::Viewer;
use dapple_fuzz::{LIMITS, server};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = run(&mut Unstructured::new(data));
});

fn run(u: &mut Unstructured<'_>) -> Result<()> {
    // The payload of a track record, by the encoder.
    let count = u.int_in_range(1..=2)?;
    let mut tracks = Vec::new();
    for id in 1..=count {
        tracks.push(server::track(u, id)?);
    }
    let mut start = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut start).expect("preamble");
    encoder
        .group(&mut start, GroupStart::Keyframes)
        .expect("group");
    encoder.tracks(&mut start, &tracks).expect("tracks");

    let mut viewer = Viewer::new(LIMITS);
    let mut forge = Forge::new();
    forge.end.record(&[]);
    forge.end.record(&[]);
    forge.end.record(&[]);
    forge.bytes = start;
    let mut frame = 0u32;
    while !u.is_empty() {
        for _ in 0..u.int_in_range(1..=2)? {
            let rest = u.len();
            let bytes = u.int_in_range(0..=rest.min(600))?;
            let raw = u.bytes(bytes.min(u.len()))?;
            let mut payload = Vec::new();
            match u.int_in_range(0..=7)? {
                0 => payload.extend(raw),
                kind => {
                    // A right head; the sections are the input's.
                    let keyframe = frame == 0 || kind < 4;
                    let base = if keyframe { 0 } else { frame - 1 };
                    let (buckets, cells) = (u.int_in_range(0..=3u32)?, u.int_in_range(0..=3u32)?);
                    let id = u.int_in_range(1..=count)?;
                    for word in [1, keyframe.into(), base, 0, id, buckets, cells] {
                        payload.extend(word.to_le_bytes());
                    }
                    let size = tracks[id as usize - 1].grid().expect("points").widths.bits() / 8;
                    let wanted = (36 * buckets + 8 * cells + 7 * size * cells).next_multiple_of(4);
                    payload.extend(raw);
                    payload.resize(28 + wanted as usize, 0);
                }
            }
            forge.record(record_type::POINTS, &payload, Packing::None, |_| {});
        }
        let mut commit = u64::from(frame).to_le_bytes().to_vec();
        commit.extend(frame.to_le_bytes());
        commit.extend([0; 4]);
        forge.record(record_type::COMMIT, &commit, Packing::None, |_| {});
        let result = viewer.feed_whole(&forge.bytes).1.map_err(|e| e.id);
        forge.bytes.clear();
        match result {
            Err(1019) => frame += 1,
            _ => break,
        }
    }
    Ok(())
}
