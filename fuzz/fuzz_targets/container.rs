//! Any bytes, their checksums recomputed as the first byte says: an error or a state that holds, and a
//! decoder that can be used again.
#![no_main]

use dapple_fuzz::LIMITS;
use dapple_fuzz::recompute::{Recompute, recompute};
use dapple_fuzz::stream_builder::tiny;
use dapple_fuzz::viewer::Viewer;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&how, bytes)) = data.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    recompute(&mut bytes, Recompute::choose(how));
    let mut viewer = Viewer::new(LIMITS);
    let (_, mut result) = viewer.feed_whole(&bytes);
    // Most inputs: go on after errors, as long as that is possible.
    while how & 0x80 == 0 && result.is_err() && viewer.decoder.resume() {
        let position = viewer.decoder.position() as usize;
        result = viewer.feed_whole(&bytes[position..]).1;
        if viewer.decoder.position() as usize == bytes.len() {
            break;
        }
    }
    viewer.reset();
    assert!(
        viewer.feed_whole(&tiny()).1.is_ok(),
        "a decoder that was reset is as good as new"
    );
});
