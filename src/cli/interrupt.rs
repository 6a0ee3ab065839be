//! What Ctrl-C and a request to end do: unfinished outputs are removed, and the exit code is 128 and
//! the number of the signal, as a shell reports it.

use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

static DEFERRED: AtomicBool = AtomicBool::new(false);
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// From here on the first signal ends nothing and is only reported by [`signal`], for a command that
/// shows partial results; the second one ends the program as before.
pub fn defer() {
    DEFERRED.store(true, Ordering::Relaxed);
}

/// The deferred signal, if one came.
pub fn signal() -> Option<u8> {
    u8::try_from(SIGNAL.load(Ordering::Relaxed))
        .ok()
        .filter(|&signal| signal > 0)
}

/// Starts to listen for the signals; without a thread for it they end the program as they always do.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else {
        return;
    };
    let wait = move || {
        for signal in signals.forever() {
            if DEFERRED.swap(false, Ordering::Relaxed) {
                SIGNAL.store(signal, Ordering::Relaxed);
                continue;
            }
            crate::files::abandon();
            // Other threads still work: nothing of theirs may be torn down under them.
            signal_hook::low_level::exit(128 + signal);
        }
    };
    let _ = std::thread::Builder::new().spawn(wait);
}

/// Elsewhere an interruption may leave a file whose name ends with `.part`.
#[cfg(not(unix))]
pub fn listen() {}
