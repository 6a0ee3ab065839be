//! Uploads what changed to a graphics device. A `Vec<u8>` stands for the device's buffer; with wgpu
//! `write` is `queue.write_buffer(&buffer, offset, bytes)`.

use std::error::Error;

use dapple_codec::points::DirtyRange;
use dapple_codec::{Decoder, Event, Limits};

/// A buffer on the device, and how many bytes went there.
#[derive(Default)]
struct Buffer {
    memory: Vec<u8>,
    uploaded: usize,
}

impl Buffer {
    fn write(&mut self, offset: usize, bytes: &[u8]) {
        self.memory[offset..offset + bytes.len()].copy_from_slice(bytes);
        self.uploaded += bytes.len();
    }

    /// Uploads the dirty ranges of an array, whose items have the layout that shaders read.
    fn update<T: bytemuck::NoUninit>(&mut self, array: &[T], dirty: &[DirtyRange]) {
        let bytes: &[u8] = bytemuck::cast_slice(array);
        if self.memory.len() < bytes.len() {
            // Tracks were declared. A new buffer starts empty, so all of the array goes there.
            self.memory = vec![0; bytes.len()];
            self.write(0, bytes);
            return;
        }
        for range in dirty {
            let offset = range.start as usize * size_of::<T>();
            let end = range.end as usize * size_of::<T>();
            self.write(offset, &bytes[offset..end]);
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let bytes = sender::stream()?;
    let mut decoder = Decoder::new(Limits::default());
    let (mut buckets, mut cells) = (Buffer::default(), Buffer::default());
    let mut rest = &bytes[..];
    while !rest.is_empty() {
        let (used, event) = decoder.push(rest)?;
        rest = &rest[used..];
        if let Event::Frame(frame) = event {
            let points = decoder.points();
            buckets.update(points.buckets(), points.dirty_buckets());
            cells.update(points.cells(), points.dirty_cells());

            assert_eq!(
                buckets.memory,
                bytemuck::cast_slice::<_, u8>(points.buckets())
            );
            assert_eq!(cells.memory, bytemuck::cast_slice::<_, u8>(points.cells()));
            // All of both arrays once, and then one cell of 32 bytes a frame.
            let whole = 32 * (points.buckets().len() + points.cells().len());
            assert_eq!(
                buckets.uploaded + cells.uploaded,
                whole + 32 * frame.number as usize
            );

            decoder.clear_dirty();
        }
    }
    decoder.finish()?;
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
