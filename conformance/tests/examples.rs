//! The worked stream of the specification decodes to the dump beside it.

use std::fs;

use dapple_conformance::clauses;
use dapple_conformance::protocol::{Arguments, Own, Program as _, Status};

/// The lines of the fenced blocks of one kind.
fn blocks<'t>(text: &'t str, kind: &str) -> Vec<&'t str> {
    let fence = format!("```{kind}");
    let mut lines = text.lines();
    let mut found = Vec::new();
    while let Some(line) = lines.next() {
        if line == fence {
            found.extend(lines.by_ref().take_while(|line| *line != "```"));
        }
    }
    found
}

fn bytes(lines: &[&str]) -> Vec<u8> {
    let bytes = lines.iter().map(|line| line.split(';').next());
    let words = bytes.flat_map(|bytes| bytes.unwrap_or_default().split_ascii_whitespace());
    words
        .map(|word| {
            assert_eq!(word.len(), 2, "{word}");
            u8::from_str_radix(word, 16).expect("a byte")
        })
        .collect()
}

#[test]
fn the_bytes_decode_to_the_dump() {
    let path = clauses::folder().join("examples.md");
    let text = fs::read_to_string(path).expect("examples");
    let stream = bytes(&blocks(&text, "hex"));
    let dump = blocks(&text, "dump").join("\n") + "\n";
    assert!(stream.len() > 500, "the blocks are not found");
    let answer = Own::default()
        .ask(&Arguments::default(), &stream)
        .expect("an answer");
    assert_eq!(String::from_utf8_lossy(&answer.output), dump);
    assert_eq!(answer.status, Status::Complete);
    let said = format!("The stream has {} bytes", stream.len());
    assert!(text.contains(&said), "{said}");
}

#[test]
fn each_record_type_that_is_defined_has_its_bytes() {
    let path = clauses::folder().join("examples.md");
    let text = fs::read_to_string(path).expect("examples");
    let stream = bytes(&blocks(&text, "hex"));
    let mut types = Vec::new();
    let mut at = 16;
    while at < stream.len() {
        let word = |offset: usize| {
            let bytes = &stream[at + offset..at + offset + 4];
            u32::from_le_bytes(bytes.try_into().expect("four bytes"))
        };
        types.push(word(0) & 0x7fff);
        at += 32 + word(16) as usize;
    }
    for defined in [1, 2, 3, 4, 5, 6, 7, 0x20] {
        assert!(
            types.contains(&defined),
            "{defined:#x} is not in {types:x?}"
        );
    }
}
