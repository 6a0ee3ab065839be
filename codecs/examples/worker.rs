//! Decodes on a worker thread. Two patches go round between worker and renderer: one is filled
//! while the other is drawn, so neither waits for the other and in steady state nothing is allocated.

use std::collections::BTreeMap;
use std::error::Error;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use dapple_codec::{Buffer, Decoder, Dirty, Event, Limits};

/// The renderer's own arrays, by buffer and track.
type Arrays = BTreeMap<(Buffer, Option<u32>), Vec<u8>>;

/// What one frame changed.
#[derive(Default)]
struct Patch {
    frame: u32,
    /// Each range, and the length of the array that it is in.
    ranges: Vec<(Dirty, usize)>,
    /// The bytes of all ranges, one after the other.
    bytes: Vec<u8>,
}

impl Patch {
    fn fill(&mut self, decoder: &Decoder) {
        self.ranges.clear();
        self.bytes.clear();
        for dirty in decoder.dirty() {
            let array = decoder.array(dirty.buffer, dirty.track);
            self.ranges.push((dirty, array.len()));
            self.bytes.extend_from_slice(&array[dirty.bytes()]);
        }
    }

    fn apply(&self, arrays: &mut Arrays) {
        let mut bytes = &self.bytes[..];
        for &(dirty, length) in &self.ranges {
            let array = arrays.entry((dirty.buffer, dirty.track)).or_default();
            array.resize(length, 0);
            let range = dirty.bytes();
            let (now, later) = bytes.split_at(range.len());
            array[range].copy_from_slice(now);
            bytes = later;
        }
    }
}

/// The worker: bytes in, patches out, the decoder back at the end.
fn work(
    bytes: Receiver<Vec<u8>>,
    empty: Receiver<Patch>,
    full: Sender<Patch>,
) -> Result<Decoder, dapple_codec::Error> {
    let mut decoder = Decoder::new(Limits::default());
    for piece in bytes {
        decoder.push_all(&piece, |decoder, event| {
            let Event::Frame(frame) = event else { return };
            let Ok(mut patch) = empty.recv() else { return }; // The renderer has gone.
            patch.frame = frame.number;
            patch.fill(decoder);
            decoder.clear_dirty();
            let _ = full.send(patch); // As above.
        })?;
    }
    decoder.finish()?;
    Ok(decoder)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (bytes_in, bytes) = channel();
    let (give_back, empty) = channel();
    let (full, patches) = channel();
    for _ in 0..2 {
        give_back.send(Patch::default())?;
    }
    let worker = thread::spawn(move || work(bytes, empty, full));
    for piece in sender::stream()?.chunks(1500) {
        bytes_in.send(piece.to_vec())?;
    }
    drop(bytes_in);

    // The renderer draws from its arrays between two patches.
    let mut arrays = Arrays::new();
    let mut drawn = 0;
    for patch in patches {
        patch.apply(&mut arrays);
        assert_eq!(patch.frame, drawn); // None is left out.
        drawn += 1;
        let _ = give_back.send(patch); // The worker may have ended.
    }
    let decoder = worker.join().expect("the worker does not panic")?;
    assert_eq!(drawn, sender::FRAMES);
    for (&(buffer, track), array) in &arrays {
        assert_eq!(array, decoder.array(buffer, track));
    }
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
