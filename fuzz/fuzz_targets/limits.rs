//! Peak heap of any input under any limits is at most [`Limits::heap_bytes`], what C allocates
//! included: AddressSanitizer's hooks see every allocation.
#![no_main]

use std::ffi::{c_int, c_void};
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use dapple_codec::{Decoder, Event, Limits};
use dapple_fuzz::recompute::{Recompute, recompute};
use libfuzzer_sys::fuzz_target;

/// Allowed above what the limits state.
const SLACK: u64 = 64 << 10;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

unsafe extern "C" {
    fn __sanitizer_install_malloc_and_free_hooks(
        on_malloc: extern "C" fn(*const c_void, usize),
        on_free: extern "C" fn(*const c_void),
    ) -> c_int;
    fn __sanitizer_get_allocated_size(pointer: *const c_void) -> usize;
}

extern "C" fn on_malloc(_: *const c_void, bytes: usize) {
    let now = NOW.fetch_add(bytes, Relaxed).wrapping_add(bytes);
    // Less than none: something older than the hooks was freed.
    if now < usize::MAX / 2 {
        PEAK.fetch_max(now, Relaxed);
    }
}

extern "C" fn on_free(pointer: *const c_void) {
    if !pointer.is_null() {
        // SAFETY: the hook is called before the memory is freed.
        NOW.fetch_sub(unsafe { __sanitizer_get_allocated_size(pointer) }, Relaxed);
    }
}

fuzz_target!(|data: &[u8]| {
    static HOOKS: Once = Once::new();
    HOOKS.call_once(|| {
        // SAFETY: both hooks live as long as the program and allocate nothing.
        let installed = unsafe { __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free) };
        assert!(installed > 0, "no place for the hooks");
    });
    let Some((&[how, a, b, c, d], bytes)) = data.split_first_chunk() else {
        return;
    };
    let limits = Limits {
        stored_bytes: small(a),
        unpacked_bytes: small(a >> 4),
        frame_bytes: small(b),
        zstd_window_bytes: small(b >> 4),
        tracks: 1 << (c & 7),
        path_bytes: u32::from(c >> 3),
        state_bytes: small(d).into(),
        work_per_byte: 400,
    };
    let mut bytes = bytes.to_vec();
    recompute(&mut bytes, Recompute::choose(how));
    let pieces = 1 + usize::from(d >> 4) * 100;

    NOW.store(0, Relaxed);
    PEAK.store(0, Relaxed);
    let mut decoder = Decoder::new(limits);
    for round in 0..2 {
        // What is kept from one stream to the next counts too.
        decode(&mut decoder, &bytes[bytes.len() / 3 * round..], pieces);
        decoder.reset();
        decode(&mut decoder, &bytes, bytes.len().max(1));
        decoder.reset();
    }
    let peak = PEAK.load(Relaxed) as u64;
    let allowed = limits.heap_bytes() + SLACK;
    assert!(peak <= allowed, "{peak} bytes of {allowed}: {limits:?}");
    drop(decoder);
    assert_eq!(NOW.load(Relaxed), 0, "everything is given back");
});

/// 1 KiB to 8 MiB.
fn small(bits: u8) -> u32 {
    1024 << (bits & 15).min(13)
}

fn decode(decoder: &mut Decoder, bytes: &[u8], pieces: usize) {
    let mut faults = 0;
    for piece in bytes.chunks(pieces) {
        let mut rest = piece;
        loop {
            let before = decoder.position();
            match decoder.push(rest) {
                Ok((_, Event::NeedInput)) => break,
                Ok((consumed, Event::End)) if consumed == rest.len() => break,
                Ok((consumed, _)) => rest = &rest[consumed..],
                Err(_) => {
                    rest = &rest[(decoder.position() - before) as usize..];
                    faults += 1;
                    if faults > 16 || !decoder.resume() {
                        return;
                    }
                }
            }
        }
    }
}
