//! Paths of tracks: what is text, and what is not.

use super::{entry, shown};
use crate::generate::Draft;
use crate::generate::plan::valid;
use crate::models::entry::Entry;

/// Paths that are no text, with everything around them in order.
pub fn paths(drafts: &mut Vec<Draft>) {
    for (name, path, comment) in [
        (
            "path-continuation-first",
            &b"a\x80b"[..],
            "A continuation byte without a first one.",
        ),
        ("path-overlong-two", b"a\xc0\x80", "U+0000 in two bytes."),
        (
            "path-overlong-two-last",
            b"\xc1\xbf",
            "U+007F in two bytes.",
        ),
        (
            "path-overlong-three",
            b"\xe0\x9f\xbf",
            "U+07FF in three bytes.",
        ),
        (
            "path-overlong-four",
            b"\xf0\x8f\xbf\xbf",
            "U+FFFF in four bytes.",
        ),
        (
            "path-surrogate-first",
            b"\xed\xa0\x80",
            "The surrogate U+D800.",
        ),
        (
            "path-surrogate-last",
            b"\xed\xbf\xbf",
            "The surrogate U+DFFF.",
        ),
        (
            "path-surrogate-pair",
            b"\xed\xa0\xbd\xed\xb8\x80",
            "A pair of surrogates.",
        ),
        (
            "path-above-last",
            b"\xf4\x90\x80\x80",
            "A code point above U+10FFFF.",
        ),
        (
            "path-five-bytes",
            b"\xf8\x88\x80\x80\x80",
            "A code of five bytes.",
        ),
        (
            "path-latin-1",
            b"caf\xe9",
            "Text in Latin-1: the path ends within a code.",
        ),
        (
            "path-cut-two",
            b"ab\xc3",
            "The path ends after the first byte of two.",
        ),
        (
            "path-cut-three",
            b"a\xe2\x82",
            "The path ends after two bytes of three.",
        ),
        (
            "path-cut-four",
            b"\xf0\x9f\x8e",
            "The path ends after three bytes of four.",
        ),
        (
            "path-byte-order-mark-utf-16",
            b"\xff\xfea\0",
            "Text in UTF-16.",
        ),
    ] {
        drafts.push(entry((2011, name), &["C-072"], 1, comment, |e| {
            e.path = path.to_vec()
        }));
    }
    // The padding continues the code, but is not of the path.
    drafts.push(entry(
        (2011, "path-code-in-padding"),
        &["C-072", "C-112"],
        1,
        "The last code runs on into the padding: the text is checked first.",
        |e| {
            e.path = b"a\xc3".to_vec();
            e.padding = Some(vec![0xa9, 0]);
        },
    ));
}

/// Paths.
pub fn texts(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, comment, paths: &[&str]| {
        let entries: Vec<_> = paths
            .iter()
            .zip(1..)
            .map(|(path, id)| Entry {
                path: path.as_bytes().to_vec(),
                ..Entry::new(id)
            })
            .collect();
        drafts.push(valid(name, &["C-070", "C-072"], comment, &shown(&entries)));
    };
    good(
        "path-padding",
        "Paths of 0 to 4 bytes: no padding, and one to three bytes of it.",
        &["", "a", "ab", "abc", "abcd"],
    );
    good(
        "path-code-lengths",
        "The first and last code points of 1, 2, 3 and 4 bytes.",
        &[
            "\u{1}\u{7e}",
            "\u{80}\u{7ff}",
            "\u{800}\u{ffff}",
            "\u{10000}\u{10ffff}",
        ],
    );
    good(
        "path-around-surrogates",
        "The code points on either side of the surrogates.",
        &["\u{d7ff}\u{e000}"],
    );
    good(
        "path-controls",
        "Control characters, which the dump escapes.",
        &["a\0b", "\n\r\t", "\u{1f}\u{7f}\u{80}\u{9f}"],
    );
    good(
        "path-quotes",
        "Quotes and backslashes, which the dump escapes.",
        &["\"", "\\", "a \"b\" \\n c"],
    );
    good(
        "path-scripts",
        "Paths in several scripts, and with an emoji.",
        &[
            "cathédrale/nef",
            "寺院/柱",
            "храм",
            "🏛/col",
            "e\u{301}\u{feff}",
        ],
    );
    good(
        "path-spaces",
        "Spaces at both ends, which are part of the path.",
        &[" a  b "],
    );
    let long = "x".repeat(1024);
    good(
        "path-most",
        "A path of 1024 bytes, the default limit.",
        &[&long],
    );
}
