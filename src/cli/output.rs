//! What commands print on stdout.

use std::io::{ErrorKind, Write};

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
