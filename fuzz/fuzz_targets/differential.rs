//! Our decoder and the one in Python, which share nothing: the same status, the same dump, the same
//! error and offset. `DAPPLE_DECODER` is the other decoder's command line.
#![no_main]

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::Duration;

use dapple_codec::{Limit, Limits};
use dapple_conformance::program::{Batch, CommandLine};
use dapple_conformance::protocol::{Arguments, Program};
use dapple_conformance::reference::Reference;
use dapple_fuzz::recompute::{Recompute, recompute};
use dapple_fuzz::{LIMITS, structured};
use libfuzzer_sys::fuzz_target;

const PYTHON: &str = "../conformance/decoders/python/run.sh";

thread_local! {
    static OTHER: RefCell<Batch> = RefCell::new(Batch::new(CommandLine {
        command: std::env::var("DAPPLE_DECODER").unwrap_or_else(|_| PYTHON.into()),
        timeout: Duration::from_secs(15),
        memory_mib: 0,
    }));
}

fuzz_target!(|data: &[u8]| {
    let Some((&how, rest)) = data.split_first() else {
        return;
    };
    // A stream of plausible records, or any bytes with recomputed checksums.
    let bytes = if how & 0x40 == 0 {
        structured::stream(rest)
    } else {
        let mut bytes = rest.to_vec();
        recompute(&mut bytes, Recompute::choose(how));
        bytes
    };
    let mut arguments = Arguments {
        limits: named(&LIMITS),
        live: how & 0x20 != 0,
        partial: how & 0x10 != 0,
        ..Arguments::default()
    };
    // Other decoders need not count their work.
    arguments
        .limits
        .insert(Limit::WorkPerByte.name().into(), u32::MAX.into());
    let ours = Reference::default()
        .request(&arguments, &bytes)
        .expect("our decoder answers");
    arguments.limits.remove(Limit::WorkPerByte.name());
    let other = OTHER.with_borrow_mut(|other| other.request(&arguments, &bytes));
    let other = other.expect("the other decoder answers");
    if ours != other {
        let text = |output: &[u8]| String::from_utf8_lossy(output).into_owned();
        let (a, b) = (text(&ours.output), text(&other.output));
        let at = a.lines().zip(b.lines()).take_while(|(a, b)| a == b).count();
        let line = |text: &str| text.lines().nth(at).unwrap_or_default().to_string();
        panic!(
            "we: {:?} {}\nthey: {:?} {}",
            ours.status,
            line(&a),
            other.status,
            line(&b)
        );
    }
});

fn named(limits: &Limits) -> BTreeMap<String, u64> {
    let value = |which: &Limit| (which.name().to_string(), limits.get(*which));
    Limit::ALL.iter().map(value).collect()
}
