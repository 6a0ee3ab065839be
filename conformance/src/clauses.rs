//! The numbered clauses of the specification, and what holds a decoder to each.
//!
//! A clause is stated where its number has a class beside it, `[C-001 reject]`; a number alone
//! refers to it. A statement goes on to the end of its line.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::vector::{Class, Kind, Vector};

/// A clause as the specification states it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clause {
    /// Such as `C-017`.
    pub id: String,
    /// Its class.
    pub class: Class,
    /// File name of its chapter.
    pub chapter: String,
    /// Errors that its statement names.
    pub errors: Vec<u16>,
}

/// Tests of the reference decoder for clauses that no vector can show, or not all of: clause, file,
/// function. Every clause of the class behaviour without a session vector stands here.
pub const BEHAVIOUR: &[(&str, &str, &str)] = &[
    ("C-023", "codecs/tests/memory.rs", "allocations"),
    (
        "C-076",
        "codecs/tests/stream.rs",
        "tracks_beyond_the_limit_take_no_memory",
    ),
    (
        "C-104",
        "tests/streams.rs",
        "a_live_stream_is_valid_only_where_that_is_asked_for",
    ),
    (
        "C-110",
        "codecs/tests/stream.rs",
        "every_flipped_bit_is_an_error_and_the_last_frame_stands",
    ),
    (
        "C-111",
        "codecs/tests/stream.rs",
        "every_split_gives_the_same",
    ),
    (
        "C-111",
        "conformance/tests/vectors.rs",
        "our_decoder_passes_every_vector",
    ),
    (
        "C-112",
        "conformance/tests/vectors.rs",
        "our_decoder_passes_every_vector",
    ),
    (
        "C-113",
        "conformance/tests/vectors.rs",
        "our_decoder_passes_every_vector",
    ),
    (
        "C-119",
        "codecs/tests/stream.rs",
        "resume_goes_on_at_the_next_group",
    ),
];

/// The tests that hold our decoder to a clause: file and function.
pub fn tests(clause: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let named = BEHAVIOUR.iter().filter(move |test| test.0 == clause);
    named.map(|&(_, file, function)| (file, function))
}

/// The specification of this repository.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec")
}

/// Name of the file with the [`table`].
pub const TABLE: &str = "clauses.md";

/// The chapters, by file name, but the table of clauses.
///
/// # Errors
/// A sentence that names the file that cannot be read.
pub fn chapters(folder: &Path) -> Result<BTreeMap<String, String>, String> {
    let at = |path: &Path, e: std::io::Error| format!("{}: {e}", path.display());
    let mut chapters = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(|e| at(folder, e))? {
        let path = entry.map_err(|e| at(folder, e))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".md") && name != TABLE {
            let text = fs::read_to_string(&path).map_err(|e| at(&path, e))?;
            chapters.insert(name.into_owned(), text);
        }
    }
    Ok(chapters)
}

/// The clauses that chapters state, in the order of their numbers.
///
/// # Errors
/// A sentence that names a clause which is stated twice.
pub fn read(chapters: &BTreeMap<String, String>) -> Result<Vec<Clause>, String> {
    let mut clauses: Vec<Clause> = Vec::new();
    for (chapter, text) in chapters {
        for line in text.lines() {
            for (id, class, statement) in statements(line) {
                if clauses.iter().any(|clause| clause.id == id) {
                    return Err(format!("{chapter} states {id} once more"));
                }
                clauses.push(Clause {
                    id: id.to_string(),
                    class,
                    chapter: chapter.clone(),
                    errors: errors(statement),
                });
            }
        }
    }
    clauses.sort_by(|a, b| a.id.cmp(&b.id));
    Ok(clauses)
}

/// Number, class and text of each clause that a line states.
pub fn statements(line: &str) -> Vec<(&str, Class, &str)> {
    let mut found: Vec<(&str, Class, usize, usize)> = Vec::new();
    for (start, _) in line.match_indices('[') {
        let Some(end) = line[start..].find(']').map(|length| start + length) else {
            break;
        };
        let Some((id, class)) = line[start + 1..end].split_once(' ') else {
            continue;
        };
        let class = match class {
            "reject" => Class::Reject,
            "value" => Class::Value,
            "behaviour" => Class::Behaviour,
            _ => continue,
        };
        if is_id(id) {
            found.push((id, class, start, end + 1));
        }
    }
    let ends = found.iter().skip(1).map(|next| next.2);
    let ends: Vec<usize> = ends.chain([line.len()]).collect();
    let ends = ends.into_iter();
    found
        .iter()
        .zip(ends)
        .map(|(&(id, class, _, start), end)| (id, class, &line[start..end]))
        .collect()
}

/// Whether this is the number of a clause: a capital, a hyphen, three digits.
pub fn is_id(text: &str) -> bool {
    match text.as_bytes() {
        [letter, b'-', digits @ ..] => {
            letter.is_ascii_uppercase()
                && digits.len() == 3
                && digits.iter().all(u8::is_ascii_digit)
        }
        _ => false,
    }
}

/// The ids that a text names as *error 1011*, or *errors 1001 to 1006* by their first.
fn errors(text: &str) -> Vec<u16> {
    let mut ids = Vec::new();
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    for pair in words.windows(2) {
        let word = pair[0].trim_start_matches(['*', '(']).to_ascii_lowercase();
        if word != "error" && word != "errors" {
            continue;
        }
        let digits = pair[1].trim_matches(|c: char| !c.is_ascii_digit());
        match digits.parse() {
            Ok(id) if digits.len() == 4 && !ids.contains(&id) => ids.push(id),
            _ => {}
        }
    }
    ids
}

/// The error ids of the table in `README.md`.
pub fn error_ids(chapters: &BTreeMap<String, String>) -> Vec<u16> {
    let text = chapters.get("README.md").map_or("", String::as_str);
    let cells = text.lines().filter_map(|line| line.strip_prefix("| "));
    cells
        .filter_map(|line| line.split_once(" |")?.0.parse().ok())
        .filter(|id| (1000..5000).contains(id))
        .collect()
}

/// Whether a vector holds a decoder to a clause that it names.
pub fn shows(vector: &Vector, clause: &Clause) -> bool {
    let info = &vector.info;
    info.clauses.contains(&clause.id)
        && match (clause.class, vector.kind, &info.error) {
            // The order of checks, say, is shown by streams with two faults.
            (Class::Behaviour, _, _) | (_, Kind::Sessions, _) => true,
            (Class::Reject, _, Some(error)) => clause.errors.contains(&error.id),
            (Class::Value, _, error) => error.is_none(),
            (Class::Reject, _, None) => false,
        }
}

/// A table of the clauses with all that holds a decoder to them, as Markdown.
pub fn table(clauses: &[Clause], vectors: &[Vector]) -> String {
    const NAMED: usize = 3;
    let mut text = String::from(
        "# Clauses\n\n\
         Written by the generator of the conformance vectors, from the chapters and the vectors. \
         A clause of the class *reject* has a vector that is refused with one of its errors, one \
         of the class *value* a vector that a wrong decoder fails, one of the class *behaviour* a \
         session vector or a test with a name.\n\n\
         | clause | class | chapter | errors | vectors | tests |\n\
         | --- | --- | --- | --- | --- | --- |\n",
    );
    for clause in clauses {
        let ids: Vec<String> = clause.errors.iter().map(u16::to_string).collect();
        let shown: Vec<&Vector> = vectors.iter().filter(|v| shows(v, clause)).collect();
        let mut links = match shown.len() {
            0 => String::new(),
            count => format!("{count}: "),
        };
        for (number, vector) in shown.iter().take(NAMED).enumerate() {
            let comma = if number > 0 { ", " } else { "" };
            let (name, path) = (&vector.name, vector.path());
            let _ = write!(links, "{comma}[{name}](../conformance/vectors/{path}.json)");
        }
        if shown.len() > NAMED {
            links += ", ...";
        }
        let tests: Vec<String> = tests(&clause.id)
            .map(|(file, function)| format!("[{function}](../{file})"))
            .collect();
        let Clause {
            id, class, chapter, ..
        } = clause;
        let _ = writeln!(
            text,
            "| {id} | {} | [{chapter}]({chapter}) | {} | {links} | {} |",
            class.name(),
            ids.join(", "),
            tests.join(", ")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_statement_ends_where_the_next_begins() {
        let line = "- [C-001 reject] A MUST. *Error 1001.* See [C-009]. [P-002 value] B; error 12.";
        let found = statements(line);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].0, found[0].1), ("C-001", Class::Reject));
        assert_eq!(errors(found[0].2), [1001]);
        assert_eq!((found[1].0, found[1].1), ("P-002", Class::Value));
        assert_eq!(errors(found[1].2), [0u16; 0]);
        assert!(statements("[C-001] [C-01 reject] [c-001 reject] [C-001 other]").is_empty());
    }

    #[test]
    fn errors_are_named_in_every_form_that_the_text_uses() {
        let text = "*Error 1001.* (*error 2004*) *error 1007*, any *error 1008*; error 12345";
        assert_eq!(errors(text), [1001, 2004, 1007, 1008]);
    }
}
