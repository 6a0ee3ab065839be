//! Decodes on a worker thread. Two patches go round between worker and renderer: one is filled
//! while the other is drawn, so neither waits for the other and in steady state nothing is allocated.

use std::error::Error;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use dapple_codec::points::{Bucket, Cell, DirtyRange};
use dapple_codec::{Decoder, Event, Limits};

/// What one frame changed.
#[derive(Default)]
struct Patch {
    frame: u32,
    buckets: Part<Bucket>,
    cells: Part<Cell>,
}

/// Changed items of one array.
struct Part<T> {
    /// Length of the whole array.
    length: usize,
    ranges: Vec<DirtyRange>,
    /// The items of all ranges, one after the other.
    items: Vec<T>,
}

impl<T> Default for Part<T> {
    fn default() -> Self {
        Part {
            length: 0,
            ranges: Vec::new(),
            items: Vec::new(),
        }
    }
}

impl<T: Copy> Part<T> {
    fn copy_from(&mut self, array: &[T], dirty: &[DirtyRange]) {
        self.length = array.len();
        self.ranges.clear();
        self.items.clear();
        self.ranges.extend_from_slice(dirty);
        for range in dirty {
            self.items
                .extend_from_slice(&array[range.start as usize..range.end as usize]);
        }
    }

    /// Items that are new are always in a dirty range, so `any` does not stay.
    fn apply(&self, array: &mut Vec<T>, any: T) {
        array.resize(self.length, any);
        let mut items = &self.items[..];
        for range in &self.ranges {
            let (now, later) = items.split_at((range.end - range.start) as usize);
            array[range.start as usize..range.end as usize].copy_from_slice(now);
            items = later;
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
        let mut rest = &piece[..];
        while !rest.is_empty() {
            let (used, event) = decoder.push(rest)?;
            rest = &rest[used..];
            if let Event::Frame(frame) = event {
                let Ok(mut patch) = empty.recv() else {
                    return Ok(decoder); // The renderer has gone.
                };
                let points = decoder.points();
                patch.frame = frame.number;
                patch
                    .buckets
                    .copy_from(points.buckets(), points.dirty_buckets());
                patch.cells.copy_from(points.cells(), points.dirty_cells());
                decoder.clear_dirty();
                let _ = full.send(patch); // As above: the next turn sees it.
            }
        }
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

    // The renderer's own arrays, which it draws from between two patches.
    let (mut buckets, mut cells) = (Vec::new(), Vec::new());
    let mut drawn = 0;
    for patch in patches {
        patch.buckets.apply(&mut buckets, Bucket::EMPTY);
        patch.cells.apply(&mut cells, Cell::FREE);
        assert_eq!(patch.frame, drawn); // None is left out.
        drawn += 1;
        let _ = give_back.send(patch); // The worker may have ended.
    }
    let decoder = worker.join().expect("the worker does not panic")?;
    assert_eq!(drawn, sender::FRAMES);
    assert!(buckets == decoder.points().buckets() && cells == decoder.points().cells());
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
