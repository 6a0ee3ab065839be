use std::fmt::Write as _;

use crate::options::Level;
use crate::run::{NOT_ASKED, Report, Verdict};

/// Counts by level and area, then every vector that failed, and why; then what was skipped.
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
    let mut not_asked = 0;
    for outcome in report.outcomes.iter().filter(|outcome| outcome.failed()) {
        if outcome
            .failures
            .iter()
            .any(|failure| failure.check == NOT_ASKED)
        {
            not_asked += 1;
            continue;
        }
        let levels = outcome.verdicts.iter().filter(|v| v.1 == Verdict::Failed);
        let levels: Vec<&str> = levels.map(|v| v.0.name()).collect();
        let clauses = outcome.clauses.join(", ");
        let _ = writeln!(
            out,
            "\nfailed: {} ({}; {clauses})",
            outcome.path,
            levels.join(", ")
        );
        for failure in &outcome.failures {
            let _ = writeln!(
                out,
                "  {}\n    expected  {}\n    got       {}",
                failure.check, failure.expected, failure.got
            );
        }
        if outcome.left_out > 0 {
            let _ = writeln!(out, "  and {} more", outcome.left_out);
        }
    }
    if not_asked > 0 {
        let _ = writeln!(
            out,
            "\nfailed: {not_asked} more, not asked, for too many before them went without an answer"
        );
    }
    let mut heading = "\n";
    for outcome in report.outcomes.iter().filter(|outcome| !outcome.failed()) {
        if let Some(reason) = &outcome.skip {
            let _ = writeln!(out, "{heading}skipped: {}: {reason}", outcome.path);
            heading = "";
        }
    }
    let _ = writeln!(out, "\n{}", report.result());
    out
}
