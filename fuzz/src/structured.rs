//! A whole stream of plausible records from the bytes of an input.

use arbitrary::{Result, Unstructured};

use crate::forge::Forge;
use crate::viewer::Viewer;
use crate::{LIMITS, records};

/// Records in any order, with valid checksums, up to the first that a decoder refuses.
pub fn stream(data: &[u8]) -> Vec<u8> {
    let mut forge = Forge::new();
    let _ = write(&mut Unstructured::new(data), &mut forge);
    forge.bytes
}

fn write(u: &mut Unstructured<'_>, forge: &mut Forge) -> Result<()> {
    let mut viewer = Viewer::new(LIMITS);
    let mut at = 0;
    while !u.is_empty() {
        records::record(u, &viewer.decoder, forge)?;
        let (_, result) = viewer.feed_whole(&forge.bytes[at..]);
        at = forge.bytes.len();
        // 1019: all is well so far, and more may come.
        if result.map_err(|error| error.id) != Err(1019) {
            break;
        }
    }
    Ok(())
}
