//! What holds of the vectors as a whole.

use dapple_conformance::generate;
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
