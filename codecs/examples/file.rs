//! Decodes a stream from a file.

use std::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use dapple_codec::{Decoder, Event, Limits};

/// Decodes a file and returns its frames.
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
        let mut rest = &buffer[..length];
        while !rest.is_empty() {
            let (used, event) = decoder.push(rest)?;
            rest = &rest[used..];
            if let Event::Frame(frame) = event {
                // Here decoder.points() holds the light of this frame.
                frames = frame.number + 1;
            }
        }
    }
    decoder.finish()?; // Tells a file that was cut off from a whole one.
    Ok(frames)
}

fn main() -> Result<(), Box<dyn Error>> {
    let name = format!("dapple-example-{}.dapple", std::process::id());
    let path = std::env::temp_dir().join(name);

    std::fs::write(&path, sender::stream()?)?;
    let frames = decode(&path);
    std::fs::write(&path, &sender::stream()?[..1000])?;
    let cut_off = decode(&path);
    std::fs::remove_file(&path)?;

    assert_eq!(frames?, sender::FRAMES);
    let fault = cut_off.unwrap_err().downcast::<dapple_codec::Error>()?;
    assert_eq!(fault.name(), "truncated");
    Ok(())
}

mod sender {
    include!(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/sender/mod.rs"
    ));
}
