//! Decodes a stream from a file: `cargo run -p dapple-codec --example file -- scene.dapple`. Without a path
//! it decodes a stream of its own.

use std::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use dapple_codec::{Decoder, Event, Limits, ModelKind};

/// Decodes a file, prints its frames and returns how many there are. [`dapple_codec::decode_all`] is shorter
/// for a file that is in memory as a whole.
fn decode(path: &Path) -> Result<u32, Box<dyn Error>> {
    let mut file = File::open(path)?;
    let mut decoder = Decoder::new(Limits::default());
    let mut frames = 0;
    let mut buffer = vec![0; 64 << 10];
    loop {
        let length = file.read(&mut buffer)?;
        if length == 0 {
            break;
        }
        decoder.push_all(&buffer[..length], |decoder, event| {
            if let Event::Frame(frame) = event {
                // Here the decoder has the light of this frame.
                print!("frame {}, {} tracks", frame.number, decoder.tracks().len());
                for model in ModelKind::ALL {
                    print!(", {} items of {}", frame.count(model), model.name());
                }
                println!();
                frames += 1;
            }
        })?;
    }
    decoder.finish()?; // Tells a file that was cut off from a whole one.
    Ok(frames)
}

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(path) = std::env::args_os().nth(1) {
        decode(path.as_ref())?;
        return Ok(());
    }
    let name = format!("dapple-example-{}.dapple", std::process::id());
    let path = std::env::temp_dir().join(name);

    std::fs::write(&path, sender::stream()?)?;
    let frames = decode(&path);
    std::fs::write(&path, &sender::stream()?[..1000])?;
    let cut_off = decode(&path);
    std::fs::remove_file(&path)?;

    assert_eq!(frames?, sender::FRAMES);
    let error = cut_off.unwrap_err().downcast::<dapple_codec::Error>()?;
    assert_eq!(error.name(), "truncated");
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
