//! Payloads of a model, in a stream that is otherwise right.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::{Packing, record_type};
use dapple_codec::{Encoder, EncoderConfig, GroupStart, ModelKind, Track};

use crate::stream_builder::StreamBuilder;
use crate::viewer::Viewer;
use crate::{LIMITS, server};

/// Declares one or two tracks that the input chooses, and shows a viewer frame after frame until the
/// input ends or a frame is refused. `payloads` makes those of a frame, by its number.
pub fn show(
    u: &mut Unstructured<'_>,
    kind: ModelKind,
    payloads: impl Fn(&mut Unstructured<'_>, u32, &[Track]) -> Result<Vec<Vec<u8>>>,
) -> Result<()> {
    // The payload of a track record, by the encoder.
    let count = u.int_in_range(1..=2)?;
    let mut tracks = Vec::new();
    for id in 1..=count {
        tracks.push(server::track_of_kind(u, id, kind)?);
    }
    let mut start = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut start).expect("preamble");
    encoder
        .group(&mut start, GroupStart::Keyframes)
        .expect("group");
    encoder.tracks(&mut start, &tracks).expect("tracks");

    let mut viewer = Viewer::new(LIMITS);
    let mut builder = StreamBuilder::new();
    builder.end.record(&[]);
    builder.end.record(&[]);
    builder.end.record(&[]);
    builder.bytes = start;
    let mut frame = 0u32;
    while !u.is_empty() {
        for payload in payloads(u, frame, &tracks)? {
            builder.record(kind.record_type(), &payload, Packing::None, |_| {});
        }
        let mut commit = u64::from(frame).to_le_bytes().to_vec();
        commit.extend(frame.to_le_bytes());
        commit.extend([0; 4]);
        builder.record(record_type::COMMIT, &commit, Packing::None, |_| {});
        let before = viewer.decoder.position() as usize;
        let result = viewer.feed_whole(&builder.bytes).1.map_err(|e| e.id);
        let taken = viewer.decoder.position() as usize - before;
        assert!(taken <= builder.bytes.len());
        builder.bytes.clear();
        match result {
            Err(1019) => frame += 1,
            _ => break,
        }
    }
    Ok(())
}
