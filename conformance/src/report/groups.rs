use std::collections::BTreeMap;

use crate::checks::Failure;
use crate::run::{NOT_RUN, Outcome, Report};

/// Vectors whose first failure is alike: one fault of a decoder shows in many vectors.
pub struct Group<'r> {
    /// In the order of their paths.
    pub outcomes: Vec<&'r Outcome>,
}

/// The failed vectors by what failed, the largest group first; without those that were not run.
pub fn groups(report: &Report) -> Vec<Group<'_>> {
    let failed = report.outcomes.iter().filter(|outcome| outcome.failed());
    let mut by_kind: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for outcome in failed.filter(|outcome| !not_run(outcome)) {
        let kind = outcome.failures.first().map(kind).unwrap_or_default();
        by_kind.entry(kind).or_default().push(outcome);
    }
    let groups = by_kind.into_values().map(|outcomes| Group { outcomes });
    let mut groups: Vec<Group> = groups.collect();
    groups.sort_by_key(|group| (usize::MAX - group.outcomes.len(), &group.outcomes[0].path));
    groups
}

/// Whether a vector was not run.
pub fn not_run(outcome: &Outcome) -> bool {
    let mut failures = outcome.failures.iter();
    failures.any(|failure| failure.check == NOT_RUN)
}

/// A failure without the numbers that differ from vector to vector: all but error ids.
fn kind(failure: &Failure) -> String {
    let mut kind = failure.level.name().to_string();
    for text in [&failure.check, &failure.expected, &failure.got] {
        let mut before = "";
        kind.push('\n');
        for word in text.split_whitespace() {
            let digits = word.contains(|c: char| c.is_ascii_digit());
            let id = ["framing", "record", "codec", "session"].contains(&before);
            kind.push_str(if digits && !id { "#" } else { word });
            kind.push(' ');
            before = word;
        }
    }
    kind
}
