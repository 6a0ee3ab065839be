//! Records of all types in any order, with valid checksums and plausible fields: no panic, every
//! committed state keeps the rules and the limits, through errors, `resume` and `reset`.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_fuzz::stream_builder::StreamBuilder;
use dapple_fuzz::viewer::Viewer;
use dapple_fuzz::{LIMITS, records};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut u = Unstructured::new(data);
    let mut viewer = Viewer::new(LIMITS);
    while !u.is_empty() && run(&mut u, &mut viewer).is_ok() {
        viewer.reset();
    }
});

/// One stream.
fn run(u: &mut Unstructured<'_>, viewer: &mut Viewer) -> Result<()> {
    let mut builder = StreamBuilder::new();
    let mut at = 0;
    while !u.is_empty() {
        records::record(u, &viewer.decoder, &mut builder)?;
        loop {
            let (_, result) = viewer.feed_whole(&builder.bytes[at..]);
            at = viewer.decoder.position() as usize;
            match result {
                // The stream goes on.
                Err(error) if error.id == 1019 => break,
                Ok(()) if u.ratio(7, 8)? => return Ok(()),
                Ok(()) => break,
                Err(_) if !viewer.decoder.resume() => return Ok(()),
                Err(_) => {}
            }
        }
        if u.ratio(1, 40)? {
            return Ok(());
        }
    }
    Ok(())
}
