//! Pieces of text that dumps are made of.

use std::fmt::Write as _;

/// Floats as their bits, each after a space.
pub fn floats(values: &[f32], out: &mut String) {
    for value in values {
        let _ = write!(out, " {:08x}", value.to_bits());
    }
}

/// Text in quotes, on one line.
pub fn quoted(text: &str, out: &mut String) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\0'..='\x1f' | '\x7f' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            _ => out.push(c),
        }
    }
    out.push('"');
}

/// Items with commas between.
pub fn commas<T>(
    items: impl IntoIterator<Item = T>,
    out: &mut String,
    write: impl Fn(T, &mut String) -> std::fmt::Result,
) {
    for (at, item) in items.into_iter().enumerate() {
        if at > 0 {
            out.push(',');
        }
        let _ = write(item, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_what_would_break_a_line() {
        let mut out = String::new();
        quoted("a\"b\\c\nd\u{7f}é\u{85}", &mut out);
        assert_eq!(out, "\"a\\\"b\\\\c\\u000ad\\u007fé\u{85}\"");
    }
}
