//! Every clause of the specification has what holds a decoder to it, and nothing else claims to.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use dapple_conformance::clauses::{self, BEHAVIOUR, Clause};
use dapple_conformance::protocol::{Arguments, Mode, Own, Program as _};
use dapple_conformance::vector::{self, Class, Kind, Vector};

fn chapters() -> BTreeMap<String, String> {
    clauses::chapters(&clauses::folder()).expect("chapters")
}

fn stated() -> Vec<Clause> {
    clauses::read(&chapters()).expect("each clause stated once")
}

fn vectors() -> Vec<Vector> {
    vector::load(&vector::folder()).expect("vectors")
}

#[test]
fn every_clause_has_a_vector_or_a_test() {
    let vectors = vectors();
    let mut bare = Vec::new();
    for clause in stated() {
        let shown = vectors.iter().any(|vector| clauses::shows(vector, &clause));
        let tested = clauses::tests(&clause.id).next().is_some();
        let enough = shown || (clause.class == Class::Behaviour && tested);
        if !enough {
            bare.push(format!("{} ({})", clause.id, clause.class.name()));
        }
    }
    assert!(bare.is_empty(), "nothing holds a decoder to {bare:?}");
}

#[test]
fn every_reject_clause_names_an_error_of_the_table() {
    let ids = clauses::error_ids(&chapters());
    assert!(ids.len() > 50, "the table of errors is not found");
    for clause in stated() {
        if clause.class == Class::Reject {
            assert!(!clause.errors.is_empty(), "{} names no error", clause.id);
        }
        for id in &clause.errors {
            assert!(ids.contains(id), "{} names {id}", clause.id);
        }
    }
}

#[test]
fn no_vector_names_another_clause() {
    let stated: BTreeSet<String> = stated().into_iter().map(|clause| clause.id).collect();
    for vector in vectors() {
        assert!(!vector.info.clauses.is_empty(), "{}", vector.path());
        for clause in &vector.info.clauses {
            assert!(stated.contains(clause), "{}: {clause}", vector.path());
        }
    }
}

/// A vector that breaks a clause says so of the right one.
#[test]
fn an_invalid_vector_breaks_a_clause_that_it_names() {
    let stated = stated();
    for vector in vectors() {
        let Some(error) = &vector.info.error else {
            continue;
        };
        let mut named = stated
            .iter()
            .filter(|c| vector.info.clauses.contains(&c.id));
        // What a decoder does at an error, such as which it meets first, may be shown by any.
        let breaks =
            |clause: &Clause| clause.errors.contains(&error.id) || clause.class == Class::Behaviour;
        assert!(named.any(breaks), "{}: {}", vector.path(), error.id);
    }
}

#[test]
fn every_reference_is_to_a_clause() {
    let stated: BTreeSet<String> = stated().into_iter().map(|clause| clause.id).collect();
    for (chapter, text) in chapters() {
        for part in text.split('[').skip(1) {
            let id = part.split([']', ' ']).next().unwrap_or_default();
            assert!(
                !clauses::is_id(id) || stated.contains(id),
                "{chapter}: {id}"
            );
        }
    }
}

/// `README.md` says what the words mean.
#[test]
fn every_must_stands_in_a_clause() {
    for (chapter, text) in chapters() {
        for line in text.lines().filter(|_| chapter != "README.md") {
            let place = line.find("MUST");
            let clause = line
                .find('[')
                .filter(|_| !clauses::statements(line).is_empty());
            if let Some(place) = place {
                assert!(clause.is_some_and(|at| at < place), "{chapter}: {line}");
            }
        }
    }
}

/// 4012 is a fault of a caller, 4013 one of the machine, and 4014 a limit that a decoder need not have.
#[test]
fn every_error_has_a_vector() {
    let mut shown = BTreeSet::from([4012, 4013, 4014]);
    for vector in vectors() {
        if let Some(error) = &vector.info.error {
            shown.insert(error.id);
        }
        if vector.kind == Kind::Sessions {
            shown.extend(faults(&vector));
        }
    }
    let ids = clauses::error_ids(&chapters());
    let without: Vec<&u16> = ids.iter().filter(|id| !shown.contains(id)).collect();
    assert!(without.is_empty(), "no vector shows {without:?}");
}

/// The ids in the transcript of a session.
fn faults(vector: &Vector) -> Vec<u16> {
    let arguments = Arguments {
        mode: Mode::Session,
        limits: vector.info.limits.clone(),
        ..Arguments::default()
    };
    let answer = Own::default().ask(&arguments, &vector.bytes);
    let output = answer.expect("a transcript").output;
    let text = String::from_utf8(output).expect("text");
    let faults = text.lines().filter_map(|line| line.strip_prefix("error "));
    faults
        .map(|fault| fault.split(' ').nth(1).and_then(|id| id.parse().ok()))
        .map(|id| id.expect("a number"))
        .collect()
}

#[test]
fn the_tests_that_clauses_name_are_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let stated: BTreeSet<String> = stated().into_iter().map(|clause| clause.id).collect();
    for (clause, file, function) in BEHAVIOUR {
        assert!(stated.contains(*clause), "{clause}");
        let text = fs::read_to_string(root.join(file)).expect(file);
        let head = format!("#[test]\nfn {function}() {{");
        let module = format!("    #[test]\n    fn {function}() {{");
        let found = text.contains(&head) || text.contains(&module);
        assert!(found, "{file} has no test {function}");
    }
}

#[test]
fn the_table_is_the_one_that_the_generator_writes() {
    let table = clauses::table(&stated(), &vectors());
    let path = clauses::folder().join(clauses::TABLE);
    let file = fs::read_to_string(path).unwrap_or_default();
    assert!(table == file, "spec/clauses.md: run the generator");
}
