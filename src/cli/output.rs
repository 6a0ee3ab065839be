//! What commands print: results on stdout, warnings on stderr.

use std::io::{ErrorKind, Write};
use std::sync::Mutex;

use serde::Serialize;

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
