use std::fmt::Write as _;

use super::groups::{Group, groups, not_run};
use crate::options::Level;
use crate::run::{Report, Verdict};

/// Counts by level and area, then what failed, vectors that fail alike together; then what was
/// skipped, and what was run.
pub fn text(report: &Report) -> String {
    let mut out = format!(
        "{}: {} vectors, {} requests\n\n{:<10}{:<12}{:>8}{:>8}{:>17}{:>9}\n",
        report.decoder,
        report.outcomes.len(),
        report.requests(),
        "level",
        "area",
        "passed",
        "failed",
        "not implemented",
        "skipped"
    );
    for level in Level::ALL {
        for area in report.areas() {
            let counts = Verdict::ALL.map(|verdict| report.count(level, Some(area), verdict));
            if counts.iter().sum::<usize>() == 0 {
                continue;
            }
            let [passed, failed, not_implemented, skipped] = counts;
            // Writing to a String does not fail.
            let _ = writeln!(
                out,
                "{:<10}{area:<12}{passed:>8}{failed:>8}{not_implemented:>17}{skipped:>9}",
                level.name(),
            );
        }
    }
    for group in groups(report) {
        failed(&group, &mut out);
    }
    let not_run = report.outcomes.iter().filter(|o| not_run(o)).count();
    if not_run > 0 {
        let _ = writeln!(
            out,
            "\nfailed: {not_run} more, not run, since too many before them had no answer"
        );
    }
    let mut heading = "\n";
    for outcome in report.outcomes.iter().filter(|outcome| !outcome.failed()) {
        if let Some(reason) = &outcome.skip {
            let _ = writeln!(out, "{heading}skipped: {}: {reason}", outcome.path);
            heading = "";
        }
    }
    out.push('\n');
    for sentence in &report.extent {
        let _ = writeln!(out, "{sentence}");
    }
    let _ = writeln!(out, "\n{}", report.result());
    out
}

/// Paths of a group that are shown.
const PATHS: usize = 5;

/// The failures of the first vector of a group, and the paths of the others.
fn failed(group: &Group<'_>, out: &mut String) {
    let [first, others @ ..] = group.outcomes.as_slice() else {
        return;
    };
    let levels = first.verdicts.iter().filter(|v| v.1 == Verdict::Failed);
    let levels: Vec<&str> = levels.map(|v| v.0.name()).collect();
    let (levels, clauses) = (levels.join(", "), first.clauses.join(", "));
    let count = match others.len() {
        0 => String::new(),
        others => format!("{} vectors alike, the first is ", others + 1),
    };
    // Writing to a String does not fail.
    let _ = writeln!(out, "\nfailed: {count}{} ({levels}; {clauses})", first.path);
    for failure in &first.failures {
        let _ = writeln!(
            out,
            "  {}\n    expected  {}\n    got       {}",
            failure.check, failure.expected, failure.got
        );
    }
    if first.left_out > 0 {
        let _ = writeln!(out, "  and {} more", first.left_out);
    }
    for other in others.iter().take(PATHS - 1) {
        let _ = writeln!(out, "  alike: {}", other.path);
    }
    if others.len() >= PATHS {
        let more = others.len() + 1 - PATHS;
        let _ = writeln!(out, "  and {more} more vectors; --json lists all");
    }
}
