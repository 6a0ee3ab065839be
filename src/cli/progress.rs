//! Progress of long work on stderr: a bar on a terminal, a line every ten seconds elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output;

/// Time from one line to the next where stderr is no terminal.
const INTERVAL: Duration = Duration::from_secs(10);

/// Progress of one stage of work. A bar is erased when dropped, so that results stand alone.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// When the last line was written; none on a terminal, where the bar is.
    last_line: Option<Mutex<Instant>>,
}

impl Progress {
    /// Progress through `total` steps.
    pub fn new(label: &str, total: u64) -> Progress {
        let terminal = std::io::stderr().is_terminal();
        let target = match terminal {
            true => ProgressDrawTarget::stderr(),
            false => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        if let Ok(style) =
            ProgressStyle::with_template("{msg:22} {bar:32} {pos}/{len}  {elapsed}, {eta} left")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(label.to_string());
        Progress {
            bar,
            last_line: (!terminal).then(|| Mutex::new(Instant::now())),
        }
    }

    /// Work of an unknown number of steps: a spinner on a terminal, nothing elsewhere.
    pub fn spinner(label: &str) -> Progress {
        let progress = Progress::new(label, 0);
        if let Ok(style) = ProgressStyle::with_template("{msg:22} {spinner} {elapsed}") {
            progress.bar.set_style(style);
        }
        progress.bar.enable_steady_tick(Duration::from_millis(100));
        progress
    }

    /// Moves on by `steps`; may be called from any thread.
    pub fn step(&self, steps: u64) {
        self.bar.inc(steps);
        self.write_line();
    }

    /// Prints a line on stderr, above the bar if there is one.
    pub fn line(&self, line: &str) {
        self.bar.suspend(|| output::progress_line(line));
    }

    /// Moves to `position`; may be called from any thread.
    pub fn at(&self, position: u64) {
        self.bar.set_position(position);
        self.write_line();
    }

    fn write_line(&self) {
        let Some(mut last) = self.last_line.as_ref().and_then(|last| last.lock().ok()) else {
            return;
        };
        if last.elapsed() >= INTERVAL {
            *last = Instant::now();
            let (position, total) = (self.bar.position(), self.bar.length().unwrap_or(0));
            let line = line(&self.bar.message(), position, total, self.bar.elapsed());
            output::progress_line(&line);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Such as `Encoding frames: 120 of 900, 15 s, about 98 s left`.
fn line(label: &str, position: u64, total: u64, elapsed: Duration) -> String {
    let seconds = elapsed.as_secs_f64();
    let left = match position {
        0 => String::new(),
        _ => {
            let rest = total.saturating_sub(position) as f64;
            format!(", about {:.0} s left", seconds * rest / position as f64)
        }
    };
    format!("{label}: {position} of {total}, {seconds:.0} s{left}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_estimate_the_time_left() {
        let after =
            |position, seconds| line("Encoding", position, 900, Duration::from_secs(seconds));
        assert_eq!(
            after(100, 20),
            "Encoding: 100 of 900, 20 s, about 160 s left"
        );
        assert_eq!(after(0, 20), "Encoding: 0 of 900, 20 s");
        assert_eq!(after(900, 20), "Encoding: 900 of 900, 20 s, about 0 s left");
    }
}
