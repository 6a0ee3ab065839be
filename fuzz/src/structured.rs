//! A whole stream of plausible records from the bytes of an input.

use arbitrary::{Result, Unstructured};

use crate::stream_builder::StreamBuilder;
use crate::viewer::Viewer;
use crate::{LIMITS, records};

/// Records in any order, with valid checksums, up to the first that a decoder refuses.
pub fn stream(data: &[u8]) -> Vec<u8> {
    let mut builder = StreamBuilder::new();
    let _ = write(&mut Unstructured::new(data), &mut builder);
    builder.bytes
}

fn write(u: &mut Unstructured<'_>, builder: &mut StreamBuilder) -> Result<()> {
    let mut viewer = Viewer::new(LIMITS);
    let mut at = 0;
    while !u.is_empty() {
        records::record(u, &viewer.decoder, builder)?;
        let (_, result) = viewer.feed_whole(&builder.bytes[at..]);
        at = builder.bytes.len();
        // 1019: all is well so far, and more may come.
        if result.map_err(|error| error.id) != Err(1019) {
            break;
        }
    }
    Ok(())
}
