//! A valid stream of any content, packed in every way, decodes to the states that the server had,
//! bit for bit, and to the digests that it wrote.
#![no_main]

use arbitrary::Unstructured;
use dapple_codec::Event;
use dapple_fuzz::viewer::Viewer;
use dapple_fuzz::{LIMITS, server};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(script) = server::script(&mut Unstructured::new(data)) else {
        return;
    };
    let mut viewer = Viewer::new(LIMITS);
    let mut rest = &script.bytes[..];
    let mut frames = 0;
    loop {
        let (consumed, seen) = viewer.push(rest).expect("a valid stream");
        rest = &rest[consumed..];
        match seen.event {
            Event::Frame(frame) => {
                frames += 1;
                assert_eq!(viewer.shown(), script.frames[&frame.number]);
            }
            Event::End => break,
            Event::NeedInput => panic!("the stream has an end"),
            _ => {}
        }
    }
    assert!(rest.is_empty() && viewer.decoder.finish().is_ok());
    assert_eq!(frames, script.frames.len());
});
