//! Every clause of the specification has a vector or a test, and the tables beside the chapters are
//! those of the text and of the code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use dapple_conformance::clauses::{self, BEHAVIOUR, Clause};
use dapple_conformance::models::probes::range::INITIAL;
use dapple_conformance::protocol::{Arguments, Mode, Program as _};
use dapple_conformance::reference::Reference;
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
    let answer = Reference::default().request(&arguments, &vector.bytes);
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

/// The rows of a table of `spec/tables`, without its head.
fn csv(name: &str) -> Vec<Vec<String>> {
    let path = clauses::folder().join("tables").join(name);
    let text = fs::read_to_string(path).expect(name);
    text.lines().skip(1).map(fields).collect()
}

/// The fields of a line, some in double quotes, none with double quotes in it.
fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            _ => fields.last_mut().expect("a field").push(character),
        }
    }
    fields
}

/// The fenced block of `probes.md` that begins with a line.
fn block(first: &str) -> String {
    let text = &chapters()["probes.md"];
    let fence = format!("```text\n{first}");
    let start = text.find(&fence).expect(first) + "```text\n".len();
    let end = text[start..].find("```").expect("the end of a block");
    text[start..start + end].to_string()
}

/// That of `README.md`, which a test of the codec holds to the code.
#[test]
fn error_table_is_that_of_the_text() {
    let readme = &chapters()["README.md"];
    let rows = csv("errors.csv");
    assert_eq!(rows.len(), clauses::error_ids(&chapters()).len());
    for row in rows {
        let line = format!("\n| {} |\n", row.join(" | "));
        assert!(readme.contains(&line), "{line}");
    }
}

#[test]
fn context_table_is_that_of_the_text_and_the_code() {
    const SHAPES: [(&str, &[usize]); 14] = [
        ("CHANGED", &[2, 4]),
        ("LEVEL_CHANGED", &[]),
        ("LEVEL", &[4, 2]),
        ("BAND", &[2, 6, 4, 2]),
        ("SIGNIFICANT", &[2, 6, 4]),
        ("SIGN", &[2, 2, 3]),
        ("PREFIX", &[2, 6, 6]),
        ("SUFFIX", &[2, 6]),
        ("MAP_CHANGED", &[2, 4]),
        ("MAP_DEVIATES", &[]),
        ("MAP_SIGNIFICANT", &[2, 8, 3, 4]),
        ("MAP_SIGN", &[2, 8, 3]),
        ("MAP_PREFIX", &[2, 8, 7]),
        ("MAP_SUFFIX", &[2, 7]),
    ];
    let stated: Vec<u8> = block("196 117")
        .split_ascii_whitespace()
        .map(|start| start.parse().expect("a start value"))
        .collect();
    assert_eq!(stated, INITIAL);
    let mut rows = csv("contexts.csv").into_iter();
    let mut number = 0;
    for (name, shape) in SHAPES {
        let indices: Vec<String> = shape.iter().map(|extent| format!("[{extent}]")).collect();
        let line = format!("| {name} | {} | {number} |", indices.concat());
        let line = line.replace("|  |", "| |");
        assert!(chapters()["probes.md"].contains(&line), "{line}");
        for at in 0..shape.iter().product() {
            let mut rest: usize = at;
            let mut indices = Vec::new();
            for extent in shape.iter().rev() {
                indices.insert(0, (rest % extent).to_string());
                rest /= extent;
            }
            let start = INITIAL[number].to_string();
            let row = [number.to_string(), name.into(), indices.join(" "), start];
            assert_eq!(rows.next().expect("a row"), row);
            number += 1;
        }
    }
    assert_eq!((number, rows.next()), (INITIAL.len(), None));
}

/// Its hash is in the chapter, where a test of the codec holds the codec's own to it.
#[test]
fn power_table_has_the_hash_of_the_text() {
    let rows = csv("powers.csv");
    assert_eq!(rows.len(), 256);
    let mut bytes = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(row[0], i.to_string());
        let power: u32 = row[1].parse().expect("a number");
        bytes.extend(power.to_le_bytes());
    }
    let hash = twox_hash::XxHash64::oneshot(0, &bytes);
    let hash = format!("`{hash:016x}`");
    assert!(chapters()["probes.md"].contains(&hash), "{hash}");
}

/// Clauses that only say of others what they come to.
const IMPLIED: [&str; 1] = ["C-082"];

#[test]
fn table_of_checks_has_every_reject_clause_with_its_errors() {
    let mut checks = BTreeSet::new();
    for row in csv("checks.csv") {
        assert_eq!(row.len(), 5, "{row:?}");
        let error: u16 = row[3].parse().expect("an error");
        checks.insert((row[2].clone(), error));
    }
    let rejects = stated().into_iter().filter(|c| c.class == Class::Reject);
    let stated: BTreeSet<(String, u16)> = rejects
        .filter(|clause| !IMPLIED.contains(&clause.id.as_str()))
        .flat_map(|clause| {
            clause
                .errors
                .into_iter()
                .map(move |e| (clause.id.clone(), e))
        })
        .collect();
    assert_eq!(checks, stated);
}

#[test]
fn table_of_checks_is_that_of_the_text() {
    let container = &chapters()["container.md"];
    let mut missing: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for row in csv("checks.csv") {
        let check = format!("[{}] {} {}", row[2], row[3], row[4]);
        missing.entry(row[0].clone()).or_default().push(check);
    }
    for (record, checks) in missing {
        let head = format!("\n| {record} | ");
        let lines = container.split(&head).skip(1);
        let stated = lines.filter_map(|rest| rest.split(" |\n").next());
        let mut stated = stated.filter(|row| row.contains(&checks[0]));
        let mut rest = stated.next().expect(&record);
        for check in &checks {
            let at = rest.find('[').expect(check);
            assert!(rest[at..].starts_with(check.as_str()), "{record}: {check}");
            rest = &rest[at + check.len()..];
        }
        assert!(!rest.contains('['), "{record}: {rest}");
    }
}
