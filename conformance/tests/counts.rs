//! Counts of vectors, clauses and fuzz targets in README and docs are those of the files.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use dapple_conformance::clauses;
use dapple_conformance::vector::{self, Kind, Vector};

fn vectors() -> Vec<Vector> {
    vector::load(&vector::folder()).expect("vectors")
}

/// A page of the repository without link targets, emphasis and line breaks.
fn page(path: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = fs::read_to_string(root.join(path)).expect(path);
    let mut plain = String::new();
    let mut parts = text.split("](");
    plain += parts.next().unwrap_or_default();
    for part in parts {
        plain += part.split_once(')').map_or("", |(_, after)| after);
    }
    let plain = plain.replace(['[', ']', '*', '`'], "");
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Each number that stands before `words` on a page.
fn numbers(page: &str, words: &str) -> Vec<usize> {
    let words = format!(" {words}");
    let before = page.match_indices(&words).map(|(at, _)| &page[..at]);
    let number = |text: &str| text.rsplit([' ', '(']).next()?.parse().ok();
    before.filter_map(number).collect()
}

fn refused(vectors: &[Vector]) -> usize {
    let refused = vectors.iter().filter(|vector| vector.info.error.is_some());
    refused.count()
}

fn queries(vectors: &[Vector]) -> usize {
    vectors.iter().map(|vector| vector.info.queries.len()).sum()
}

#[test]
fn readme_states_the_counts() {
    let (page, vectors) = (page("README.md"), vectors());
    let clauses = clauses::chapters(&clauses::folder()).and_then(|c| clauses::read(&c));
    let targets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/fuzz_targets");
    let targets = fs::read_dir(targets).expect("fuzz targets").count();
    for (words, count) in [
        ("conformance vectors", vectors.len()),
        ("of which must be refused", refused(&vectors)),
        ("numbered clauses", clauses.expect("clauses").len()),
        ("fuzz targets", targets),
    ] {
        for stated in numbers(&page, words) {
            assert_eq!(stated, count, "{words}");
        }
    }
    assert!(!numbers(&page, "conformance vectors").is_empty());
}

#[test]
fn docs_state_the_counts() {
    let (page, vectors) = (page("docs/conformance.md"), vectors());
    let of = |kind: Kind| vectors.iter().filter(|vector| vector.kind == kind).count();
    let mut rows: Vec<String> = Kind::ALL
        .iter()
        .map(|&kind| format!("| {} | {}", kind.folder(), of(kind)))
        .collect();
    rows.push(format!("with {} look-ups", queries(&vectors)));
    let (all, refusals) = (vectors.len(), refused(&vectors));
    rows.push(format!(
        "| all | {all}, of which {refusals} must be refused"
    ));
    let probes: Vec<Vector> = vectors
        .iter()
        .filter(|v| v.area == "probes")
        .cloned()
        .collect();
    rows.push(format!(
        "{} of them, {} refused, are of probes; so are {} look-ups",
        probes.len(),
        refused(&probes),
        queries(&probes)
    ));
    let mut pairs = BTreeSet::new();
    let mut sets = BTreeSet::new();
    for vector in &vectors {
        let clauses: BTreeSet<&str> = vector.info.clauses.iter().map(String::as_str).collect();
        match &vector.info.error {
            Some(error) => _ = pairs.insert((error.id, clauses)),
            None if vector.kind != Kind::Sessions => _ = sets.insert(clauses),
            None => {}
        }
    }
    rows.push(format!(
        "{} pairs of an error and a set of clauses",
        pairs.len()
    ));
    rows.push(format!("{} sets of clauses show a value", sets.len()));
    let clauses = clauses::chapters(&clauses::folder()).and_then(|c| clauses::read(&c));
    rows.push(format!("All {} clauses", clauses.expect("clauses").len()));
    let missing: Vec<&String> = rows.iter().filter(|row| !page.contains(*row)).collect();
    assert!(
        missing.is_empty(),
        "docs/conformance.md does not say {missing:#?}"
    );
}
