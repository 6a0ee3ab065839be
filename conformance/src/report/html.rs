use std::fmt::Write as _;

use super::escaped;
use super::groups::{groups, not_run};
use crate::clauses::{self, Clause};
use crate::options::Level;
use crate::run::{Outcome, Report, Verdict};

const STYLE: &str = include_str!("page.css");

/// One page that needs nothing else: totals, failures, and how far each clause is covered.
pub fn html(report: &Report, clauses: &[Clause]) -> String {
    let decoder = escaped(&report.decoder);
    let class = match report.passed() {
        true => "good",
        false => "bad",
    };
    let result = report.result();
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Dapple conformance: {decoder}</title>\n<style>\n{STYLE}</style>\n\
         <header>\n<h1>Dapple conformance</h1>\n<p><code>{decoder}</code> \
         <strong class=\"{class}\">{result}</strong></p>\n<p class=\"quiet\">{} vectors, {} \
         requests, {} clauses</p>\n<p class=\"quiet\">{}</p>\n<nav>{}<a href=\"#clauses\">Clauses</a></nav>\n</header>\n<main>\n",
        report.outcomes.len(),
        report.requests(),
        clauses.len(),
        escaped(&report.extent.join("; ")),
        match report.outcomes.iter().any(Outcome::failed) {
            true => "<a href=\"#failures\">Failures</a> ",
            false => "",
        },
    );
    totals(report, &mut out);
    failures(report, &mut out);
    skipped(report, &mut out);
    coverage(report, clauses, &mut out);
    out += "</main>\n</html>\n";
    out
}

// Writing to a String does not fail: the results of write! are not looked at.

fn totals(report: &Report, out: &mut String) {
    *out += "<h2>Totals</h2>\n<div class=\"wide\"><table class=\"totals\">\n\
             <thead><tr><th>level<th>area<th class=\"n\">passed<th class=\"n\">failed\
             <th class=\"n\">not implemented<th class=\"n\">skipped</tr></thead>\n<tbody>\n";
    for level in Level::ALL {
        for area in report.areas() {
            let counts = Verdict::ALL.map(|verdict| report.count(level, Some(area), verdict));
            if counts.iter().sum::<usize>() == 0 {
                continue;
            }
            let _ = write!(out, "<tr><td>{}<td>{}", level.name(), escaped(area));
            for (verdict, count) in Verdict::ALL.into_iter().zip(counts) {
                number(verdict, count, out);
            }
            *out += "</tr>\n";
        }
    }
    *out += "</tbody></table></div>\n";
}

fn number(verdict: Verdict, count: usize, out: &mut String) {
    let class = match (verdict, count) {
        (_, 0) => "quiet",
        (Verdict::Passed, _) => "good",
        (Verdict::Failed, _) => "bad",
        (Verdict::NotImplemented | Verdict::Skipped, _) => "other",
    };
    let _ = write!(out, "<td class=\"n {class}\">{count}");
}

fn failures(report: &Report, out: &mut String) {
    let failed: Vec<&Outcome> = report.outcomes.iter().filter(|o| o.failed()).collect();
    if failed.is_empty() {
        return;
    }
    let _ = writeln!(out, "<h2 id=\"failures\">Failures ({})</h2>", failed.len());
    let not_run = failed.iter().filter(|o| not_run(o)).count();
    if not_run > 0 {
        let _ = writeln!(
            out,
            "<p>{not_run} were not run, since too many before them had no answer.</p>"
        );
    }
    for group in groups(report) {
        let [outcome, others @ ..] = group.outcomes.as_slice() else {
            continue;
        };
        let _ = write!(
            out,
            "<article>\n<h3>{}</h3>\n<p class=\"quiet\">",
            escaped(&outcome.path)
        );
        for (level, verdict) in &outcome.verdicts {
            let _ = write!(out, "{} {} &middot; ", level.name(), verdict.name());
        }
        let _ = writeln!(out, "{}</p>", escaped(&outcome.clauses.join(", ")));
        for failure in &outcome.failures {
            let _ = writeln!(
                out,
                "<dl><dt>{}<dd class=\"label\">expected<dd><code>{}</code>\
                 <dd class=\"label\">got<dd><code>{}</code></dl>",
                escaped(&failure.check),
                escaped(&failure.expected),
                escaped(&failure.got)
            );
        }
        if outcome.left_out > 0 {
            let _ = writeln!(out, "<p class=\"quiet\">and {} more</p>", outcome.left_out);
        }
        if !others.is_empty() {
            let _ = write!(
                out,
                "<details><summary>{} more alike</summary><ul>",
                others.len()
            );
            for other in others {
                let _ = write!(out, "<li>{}", escaped(&other.path));
            }
            *out += "</ul></details>\n";
        }
        *out += "</article>\n";
    }
}

fn skipped(report: &Report, out: &mut String) {
    let quiet = |outcome: &&Outcome| !outcome.failed();
    let reasons = report.outcomes.iter().filter(quiet);
    let reasons: Vec<(&Outcome, &String)> = reasons
        .filter_map(|outcome| Some((outcome, outcome.skip.as_ref()?)))
        .collect();
    if reasons.is_empty() {
        return;
    }
    let _ = writeln!(out, "<h2>Skipped ({})</h2>\n<ul>", reasons.len());
    for (outcome, reason) in reasons {
        let (path, reason) = (escaped(&outcome.path), escaped(reason));
        let _ = writeln!(out, "<li><code>{path}</code>: {reason}");
    }
    *out += "</ul>\n";
}

fn coverage(report: &Report, clauses: &[Clause], out: &mut String) {
    if clauses.is_empty() {
        return;
    }
    *out += "<h2 id=\"clauses\">Clauses</h2>\n<p class=\"quiet\">Vectors of this run that name the clause, and \
             tests of the reference decoder.</p>\n<div class=\"wide\"><table>\n\
             <thead><tr><th>clause<th>class<th class=\"far\">chapter<th class=\"far\">errors\
             <th class=\"n\">passed<th class=\"n\">failed<th class=\"n\">other<th>vectors and \
             tests</tr></thead>\n<tbody>\n";
    for clause in clauses {
        let of_clause = |outcome: &&Outcome| outcome.clauses.contains(&clause.id);
        let outcomes: Vec<&Outcome> = report.outcomes.iter().filter(of_clause).collect();
        let failed = outcomes.iter().filter(|o| o.failed()).count();
        let passed = outcomes.iter().filter(|o| o.passed()).count();
        let ids: Vec<String> = clause.errors.iter().map(u16::to_string).collect();
        let _ = write!(
            out,
            "<tr><td>{}<td>{}<td class=\"far\">{}<td class=\"far\">{}",
            clause.id,
            clause.class.name(),
            escaped(&clause.chapter),
            ids.join(" ")
        );
        number(Verdict::Passed, passed, out);
        number(Verdict::Failed, failed, out);
        number(Verdict::Skipped, outcomes.len() - passed - failed, out);
        *out += "<td>";
        named(clause, &outcomes, out);
        *out += "</tr>\n";
    }
    *out += "</tbody></table></div>\n";
}

/// The vectors and tests of a clause, folded up.
fn named(clause: &Clause, outcomes: &[&Outcome], out: &mut String) {
    let tests: Vec<_> = clauses::tests(&clause.id).collect();
    if outcomes.is_empty() && tests.is_empty() {
        *out += "<span class=\"bad\">none</span>";
        return;
    }
    let counts = match (outcomes.len(), tests.len()) {
        (vectors, 0) => format!("{vectors}"),
        (vectors, tests) => format!("{vectors} + {tests}"),
    };
    let _ = write!(out, "<details><summary>{counts}</summary><ul>");
    for outcome in outcomes {
        let class = match (outcome.failed(), outcome.passed()) {
            (true, _) => "bad",
            (_, true) => "good",
            _ => "other",
        };
        let _ = write!(out, "<li class=\"{class}\">{}", escaped(&outcome.path));
    }
    for (file, function) in tests {
        let _ = write!(out, "<li>{file}: {function}");
    }
    *out += "</ul></details>";
}
