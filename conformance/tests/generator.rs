//! What holds of the vectors as a whole.

use std::collections::BTreeSet;

use dapple_conformance::generate;
use dapple_conformance::protocol::{Arguments, Mode, Program as _};
use dapple_conformance::reference::Reference;
use dapple_conformance::vector::{self, Kind, Vector};

fn vectors() -> Vec<Vector> {
    generate::all().unwrap_or_else(|error| panic!("\n{error}"))
}

#[test]
fn two_runs_give_the_same_bytes() {
    assert!(vector::files_of(&vectors()) == vector::files_of(&vectors()));
}

#[test]
fn names_state_the_error() {
    for vector in vectors() {
        let stated = vector.name.strip_prefix('E').and_then(|rest| {
            let (id, fault) = rest.split_once('-')?;
            Some((id.parse::<u16>().ok()?, fault))
        });
        let error = vector.info.error.as_ref().map(|fault| fault.id);
        assert_eq!(stated.map(|(id, _)| id), error, "{}", vector.path());
        if vector.kind == Kind::Invalid {
            assert!(error.is_some(), "{}: nothing is refused", vector.path());
        }
        let fault = stated.map_or(vector.name.as_str(), |(_, fault)| fault);
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        assert!(fault.chars().all(plain), "{}", vector.path());
    }
}

/// Identifiers of the table of errors.
fn table() -> BTreeSet<u16> {
    let readme = concat!(env!("CARGO_MANIFEST_DIR"), "/../spec/README.md");
    let text = std::fs::read_to_string(readme).expect("the specification");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
    let ids = rows.filter_map(|row| row.split(' ').next()?.parse::<u16>().ok());
    ids.filter(|&id| id >= 1000).collect()
}

/// Faults of an encoder's caller and of the machine, and a limit that a decoder need not have.
const OF_NO_STREAM: [u16; 3] = [4012, 4013, 4014];

#[test]
fn each_error_has_a_vector() {
    let mut missing = table();
    assert!(missing.len() > 60 && OF_NO_STREAM.iter().all(|id| missing.remove(id)));
    let arguments = Arguments {
        mode: Mode::Session,
        ..Arguments::default()
    };
    for vector in vectors() {
        if let Some(fault) = &vector.info.error {
            missing.remove(&fault.id);
        }
        if vector.kind == Kind::Sessions {
            let answer = Reference::default().request(&arguments, &vector.bytes);
            let transcript = String::from_utf8(answer.expect("a script").output);
            for line in transcript.expect("text").lines() {
                let words: Vec<&str> = line.split(' ').collect();
                if let ["error", _, id, _] = words.as_slice() {
                    missing.remove(&id.parse().expect("a number"));
                }
            }
        }
    }
    assert!(missing.is_empty(), "no vector has {missing:?}");
}
