//! What commands print: results on stdout, warnings on stderr.

use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::inputs::is_dash;
use crate::files::NewFile;
use crate::measure::table::grouped;
use crate::{Error, Result};

/// The name that errors give standard output.
const NAME: &str = "standard output";

/// Prints text as it is.
///
/// # Errors
/// `Io` where stdout cannot be written; [`is_closed_pipe`] tells whether its reader went away.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(error)
}

/// Where the main output of a command goes.
pub enum Sink {
    File(NewFile),
    Stdout,
}

impl Sink {
    /// Starts an output: a file, or stdout for `-`.
    ///
    /// # Errors
    /// As [`NewFile::create`], and `Usage` where stdout is a terminal or has another output already.
    pub fn create(path: &Path) -> Result<Sink> {
        static TAKEN: AtomicBool = AtomicBool::new(false);
        if !is_dash(path) {
            return Ok(Sink::File(NewFile::create(path)?));
        }
        let usage = |what: &str| Err(Error::Usage(format!("{NAME} (-) {what}")));
        if TAKEN.swap(true, Ordering::Relaxed) {
            return usage("is named for two outputs");
        }
        if std::io::stdout().is_terminal() {
            return usage("is a terminal; redirect it to a file or a pipe");
        }
        Ok(Sink::Stdout)
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// `Io` where they cannot be written.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        match self {
            Sink::File(file) => file.write_all(bytes).map_err(|e| file.error(e)),
            Sink::Stdout => std::io::stdout().write_all(bytes).map_err(error),
        }
    }

    /// Ends the output: a file appears.
    ///
    /// # Errors
    /// As [`NewFile::finish`].
    pub fn finish(self) -> Result<()> {
        match self {
            Sink::File(file) => file.finish(),
            Sink::Stdout => std::io::stdout().flush().map_err(error),
        }
    }
}

/// Prints what there is to say of an output at `path`: on stdout, or on stderr where the output
/// itself has stdout.
///
/// # Errors
/// As [`print()`].
pub fn print_about(path: &Path, text: &str) -> Result<()> {
    if !is_dash(path) {
        return print(&format!("{}: {text}", path.display()));
    }
    let _ = write!(std::io::stderr(), "{NAME}: {text}");
    Ok(())
}

/// Prints one JSON document. A float that is not finite becomes `null`.
///
/// # Errors
/// As [`print()`].
pub fn print_json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::Invalid(format!("the result is no JSON ({e})")))?;
    print(&(text + "\n"))
}

/// Prints a report as one JSON document, with the warnings of this run as its `warnings`.
///
/// # Errors
/// As [`print()`].
pub fn print_report(report: &impl Serialize) -> Result<()> {
    #[derive(Serialize)]
    struct Document<'a, T> {
        #[serde(flatten)]
        report: &'a T,
        warnings: Vec<String>,
    }
    print_json(&Document {
        report,
        warnings: warnings(),
    })
}

/// Warnings of this run, in the order they came.
static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Prints one sentence on stderr as a warning, once a run, and keeps it for [`print_report`].
pub fn warn(text: &str) {
    let mut known = WARNINGS.lock().unwrap_or_else(|e| e.into_inner());
    if !known.iter().any(|t| t == text) {
        super::tell(&Error::Invalid(format!("warning: {text}")));
        known.push(text.to_owned());
    }
}

/// Writes a line about progress to stderr. One that is closed is no failure.
pub fn progress_line(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// The warnings of this run so far.
pub fn warnings() -> Vec<String> {
    WARNINGS.lock().unwrap_or_else(|e| e.into_inner()).clone()
}

/// An error of writing to stdout.
pub fn error(source: std::io::Error) -> Error {
    Error::Io {
        path: NAME.into(),
        source,
    }
}

/// Whether the error is that the reader of stdout went away, as `head` does.
pub fn is_closed_pipe(error: &Error) -> bool {
    matches!(error, Error::Io { path, source }
        if path.as_os_str() == NAME && source.kind() == ErrorKind::BrokenPipe)
}

/// A number with its noun, such as `1 frame` and `2 frames`.
pub fn counted(count: u64, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(count))
}

/// A number with four significant digits, without zeros at its end.
pub fn significant(value: f64) -> String {
    let before = value.abs().log10().floor();
    let decimals = match before.is_finite() {
        true => (3.0 - before).clamp(0.0, 12.0) as usize,
        false => 0,
    };
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Rows of text in columns two spaces apart: the first column flush left, the others flush right.
pub fn columns(rows: &[Vec<String>]) -> String {
    let length = |text: &str| text.chars().count();
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..count)
        .map(|c| {
            rows.iter()
                .filter_map(|row| row.get(c))
                .map(|t| length(t))
                .max()
                .unwrap_or(0)
        })
        .collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (i, (value, &width)) in row.iter().zip(&widths).enumerate() {
            let padding = " ".repeat(width - length(value));
            line += &if i == 0 {
                format!("{value}{padding}")
            } else {
                format!("  {padding}{value}")
            };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_are_four() {
        for (value, text) in [
            (0.6, "0.6"),
            (2048.0002, "2048"),
            (0.000_862_13, "0.0008621"),
            (123_456.0, "123456"),
            (0.0, "0"),
            (5.7446, "5.745"),
        ] {
            assert_eq!(significant(value), text);
        }
    }
}
