//! A decoder that decoded something else before, and was reset, gives what a new one gives: old
//! contents of its buffers do not show.
#![no_main]

use dapple_fuzz::LIMITS;
use dapple_fuzz::recompute::{Recompute, recompute};
use dapple_fuzz::viewer::Viewer;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&[how, split], bytes)) = data.split_first_chunk() else {
        return;
    };
    let at = bytes.len() * usize::from(split) / 256;
    let (mut first, mut second) = (bytes[..at].to_vec(), bytes[at..].to_vec());
    recompute(&mut first, Recompute::choose(how));
    recompute(&mut second, Recompute::choose(how >> 4));

    let mut used = Viewer::new(LIMITS);
    // In pieces, so that payloads are collected in the buffer that the second stream uses.
    let _ = used.feed(&first, |left| left.min(100));
    used.reset();
    let mut fresh = Viewer::new(LIMITS);
    let cut = |left: usize| if how & 8 == 0 { left } else { left.min(100) };
    assert_eq!(used.feed(&second, cut), fresh.feed(&second, cut));
    assert_eq!(used.shown(), fresh.shown());
    assert!(used.decoder.points().buckets() == fresh.decoder.points().buckets());
    assert!(used.decoder.points().cells() == fresh.decoder.points().cells());
    assert_eq!(used.decoder.state_digest(), fresh.decoder.state_digest());
});
