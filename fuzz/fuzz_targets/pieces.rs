//! Events, digests, errors and their offsets do not depend on how the input was cut, through
//! errors and `resume` too.
#![no_main]

use dapple_codec::Error;
use dapple_fuzz::LIMITS;
use dapple_fuzz::recompute::{Recompute, recompute};
use dapple_fuzz::viewer::{EventDigest, ShownTrack, Viewer};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&[how, seed], bytes)) = data.split_first_chunk() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    recompute(&mut bytes, Recompute::choose(how));
    let whole = outcome(&bytes, |left| left);
    let mut state = u32::from(seed);
    let cut = outcome(&bytes, |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Bytes one by one, or pieces up to a record or so.
        if seed == 0 {
            1
        } else {
            1 + (state >> 24) as usize % (seed as usize * 2)
        }
    });
    assert_eq!(whole, cut);
});

type Outcome = (Vec<EventDigest>, Vec<Error>, u64, Vec<ShownTrack>);

fn outcome(bytes: &[u8], mut cut: impl FnMut(usize) -> usize) -> Outcome {
    let mut viewer = Viewer::new(LIMITS);
    let (mut all, mut errors) = (Vec::new(), Vec::new());
    let mut at = 0;
    loop {
        let (seen, result) = viewer.feed(&bytes[at..], &mut cut);
        all.extend(seen);
        at = viewer.decoder.position() as usize;
        match result {
            Ok(()) => break,
            Err(error) => errors.push(error),
        }
        if errors.len() > 8 || !viewer.decoder.resume() || at == bytes.len() {
            break;
        }
    }
    (all, errors, viewer.decoder.position(), viewer.shown())
}
