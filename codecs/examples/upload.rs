//! Uploads what changed to a graphics device: `cargo run -p dapple-codec --example upload -- scene.dapple`.
//! Without a path it decodes a stream of its own. A `Vec<u8>` stands for a buffer of the device; with wgpu
//! `write` is `queue.write_buffer(&buffer, offset, bytes)`.

use std::collections::BTreeMap;
use std::error::Error;

use dapple_codec::{Buffer, Decoder, Event, Limits, decode_all};

/// The device's buffers: one for each array of the decoder.
#[derive(Default)]
struct Device {
    buffers: BTreeMap<(Buffer, Option<u32>), Vec<u8>>,
    /// Bytes that were uploaded.
    uploaded: usize,
}

impl Device {
    /// Uploads what the last frame changed, of whatever model.
    fn update(&mut self, decoder: &mut Decoder) {
        // Arrays of tracks that are gone.
        let tracks = decoder.tracks();
        let declared = |id| tracks.iter().any(|track| track.track.id == id);
        self.buffers
            .retain(|(_, track), _| track.is_none_or(declared));
        for dirty in decoder.dirty() {
            let array = decoder.array(dirty.buffer, dirty.track);
            let buffer = self.buffers.entry((dirty.buffer, dirty.track)).or_default();
            if buffer.len() != array.len() {
                // Tracks were declared, or a visibility block came: a buffer of another size. What was in
                // the old one has to be copied on the device.
                buffer.resize(array.len(), 0);
            }
            let range = dirty.bytes();
            self.write(dirty.buffer, dirty.track, range.start, &array[range]);
        }
        decoder.clear_dirty();
    }

    fn write(&mut self, buffer: Buffer, track: Option<u32>, offset: usize, bytes: &[u8]) {
        let memory = self.buffers.entry((buffer, track)).or_default();
        memory[offset..offset + bytes.len()].copy_from_slice(bytes);
        self.uploaded += bytes.len();
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1);
    let stream = match &path {
        Some(path) => std::fs::read(path)?,
        None => sender::stream()?,
    };
    let mut device = Device::default();
    decode_all(&stream, Limits::default(), |decoder, event| {
        let Event::Frame(frame) = event else { return };
        let before = device.uploaded;
        device.update(decoder);

        let mut whole = 0;
        for (&(buffer, track), memory) in &device.buffers {
            assert_eq!(memory, decoder.array(buffer, track), "{buffer:?} {track:?}");
            whole += memory.len();
        }
        let uploaded = device.uploaded - before;
        println!(
            "frame {}: {uploaded} bytes uploaded, of {whole} in {} buffers",
            frame.number,
            device.buffers.len()
        );
        if path.is_none() {
            // All of both arrays once, and then one cell of 32 bytes a frame.
            assert_eq!(device.buffers.len(), 2);
            assert_eq!(device.uploaded, whole + 32 * frame.number as usize);
        }
    })?;
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
