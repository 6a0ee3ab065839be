//! What decoding costs: steps that are counted, held against bytes and changed state.

use crate::common::*;
use crate::volumes;
use dapple_codec::points::PointWidths;
use dapple_codec::probes::*;
use dapple_codec::*;

/// A stream of a volume in which all probes but those of the first two rows are absent.
struct Sparse {
    out: Vec<u8>,
    encoder: Encoder,
    fixture: volumes::VolumeFixture,
    frame: u64,
}

impl Sparse {
    fn new(dims: [u16; 3]) -> Sparse {
        let volume = volumes::volume(dims, 0, Coding::Packed(volumes::STEPS));
        let mut fixture = volumes::VolumeFixture::new(1, volume);
        let present = Probe {
            level: 1,
            codes: std::array::from_fn(|code| if code == 0 { 200 } else { 0 }),
        };
        fixture.probes[..2 * usize::from(dims[0])].fill(present);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        encoder.tracks(&mut out, &[fixture.track.clone()]).unwrap();
        let mut stream = Sparse {
            out,
            encoder,
            fixture,
            frame: 0,
        };
        stream.send(Coverage::Keyframe);
        stream
    }

    fn send(&mut self, coverage: Coverage) {
        let updates = [self.fixture.update()];
        self.encoder
            .probes(&mut self.out, coverage, &updates, Compression::None)
            .unwrap();
        self.encoder
            .commit(&mut self.out, self.frame, None)
            .unwrap();
        self.fixture.base.clone_from(&self.fixture.probes);
        self.frame += 1;
    }
}

fn work_of(bytes: &[u8]) -> (Decoder, u64) {
    let mut decoder = Decoder::new(Limits::default());
    assert_eq!(decode(&mut decoder, bytes).1, Ok(()));
    let work = decoder.work();
    (decoder, work)
}

/// A probe that changes fills those within four steps, however large the volume is.
#[test]
fn a_change_of_one_probe_costs_the_fill_around_it() {
    let mut stream = Sparse::new([32, 32, 32]);
    let mut start = Decoder::new(Limits::default());
    feed(&mut start, &stream.out);
    let first = stream.out.len();
    let before = start.work();
    start.clear_dirty();
    let frames = 40;
    for frame in 0..frames {
        let probe = &mut stream.fixture.probes[5];
        match frame % 4 {
            3 => *probe = Probe::ABSENT,
            _ => {
                probe.level = 1;
                probe.codes[0] = 210 + frame as i16;
            }
        }
        stream.send(Coverage::Delta);
    }
    feed(&mut start, &stream.out[first..]);
    let work = start.work() - before;
    // 129 probes are within four steps; with their distances each counts a few times.
    assert!(work < frames * 129 * 8 * 8, "{work} steps");
    // What changed is dirty, and not the volume.
    let texels = start.dirty().filter(|d| d.buffer == Buffer::ProbesTexels);
    let dirty: Vec<DirtyRange> = texels.map(|dirty| dirty.range).collect();
    let texels: u32 = dirty.iter().map(|range| range.end - range.start).sum();
    assert!(
        dirty.len() <= 7 * 8 && texels < 7 * 32 * 32 * 32 / 4,
        "{dirty:?}"
    );
}

fn feed(decoder: &mut Decoder, bytes: &[u8]) {
    decoder.push_all(bytes, |_, _| {}).unwrap();
}

/// Tracks are removed in one pass, whichever their number is.
#[test]
fn removed_tracks_cost_a_few_steps_each() {
    let count = 4000;
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let tracks: Vec<Track> = (0..count)
        .map(|id| match id % 2 {
            0 => track(id, PointWidths::BITS_32, 1, 1),
            _ => volumes::volume_track(id, volumes::volume([1, 1, 1], 0, Coding::Raw)),
        })
        .collect();
    encoder.tracks(&mut out, &tracks).unwrap();
    let ids: Vec<u32> = (0..count).collect();
    encoder.remove_tracks(&mut out, &ids).unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    encoder.end(&mut out).unwrap();
    let (decoder, work) = work_of(&out);
    assert!(decoder.tracks().is_empty());
    assert!(
        work < 8 * u64::from(count) + out.len() as u64,
        "{work} steps"
    );
}

/// The digest of a state that did not change is not computed again.
#[test]
fn digests_of_an_unchanged_state_cost_one_pass() {
    let mut stream = Sparse::new([32, 32, 32]);
    let mut decoder = Decoder::new(Limits::default());
    feed(&mut decoder, &stream.out);
    let digest = decoder.state_digest();
    let (before, length) = (decoder.work(), stream.out.len());
    for _ in 0..100 {
        stream
            .encoder
            .commit(&mut stream.out, stream.frame, Some(digest))
            .unwrap();
        stream
            .encoder
            .group(&mut stream.out, GroupStart::State(digest))
            .unwrap();
        stream
            .encoder
            .commit(&mut stream.out, stream.frame, Some(digest))
            .unwrap();
    }
    feed(&mut decoder, &stream.out[length..]);
    let work = decoder.work() - before;
    assert!(work < 2 * 32 * 32 * 32, "{work} steps");
}

/// A stream that needs more work than its bytes allow is refused before the next record.
#[test]
fn work_beyond_the_limit_is_refused() {
    let mut stream = Sparse::new([4, 4, 4]);
    for _ in 0..100 {
        stream.send(Coverage::Keyframe);
    }
    stream.encoder.end(&mut stream.out).unwrap();
    let (_, work) = work_of(&stream.out);
    let limits = Limits {
        state_bytes: 4 * 4 * 4 * 184,
        work_per_byte: 0,
        ..Limits::default()
    };
    assert!(work > limits.state_bytes / 2, "{work} steps");
    let mut decoder = Decoder::new(limits);
    let error = decode(&mut decoder, &stream.out).1.unwrap_err();
    assert_eq!((error.id, error.name()), (4014, "work-limit"));
    assert!(decoder.last_frame().is_some());
}
