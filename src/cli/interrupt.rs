//! What Ctrl-C and a request to end do: unfinished outputs are removed, and the exit code is 128 and
//! the number of the signal, as a shell reports it.

/// Starts to listen for the signals; without a thread for it they end the program as they always do.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else {
        return;
    };
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
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
