use std::fmt::Write as _;

use super::escaped;
use crate::options::Level;
use crate::run::{Outcome, Report, Verdict};

/// JUnit XML: a suite a level, a case a vector.
pub fn junit(report: &Report) -> String {
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    for level in Level::ALL {
        let at_level = |outcome: &&Outcome| outcome.verdicts.iter().any(|v| v.0 == level);
        let outcomes: Vec<&Outcome> = report.outcomes.iter().filter(at_level).collect();
        if outcomes.is_empty() {
            continue;
        }
        let failed = report.count(level, None, Verdict::Failed);
        let passed = report.count(level, None, Verdict::Passed);
        // Writing to a String does not fail.
        let _ = writeln!(
            out,
            "  <testsuite name=\"{}: {}\" tests=\"{}\" failures=\"{failed}\" errors=\"0\" \
             skipped=\"{}\">",
            escaped(&report.decoder),
            level.name(),
            outcomes.len(),
            outcomes.len() - failed - passed,
        );
        for outcome in outcomes {
            case(level, outcome, &mut out);
        }
        out += "  </testsuite>\n";
    }
    out + "</testsuites>\n"
}

fn case(level: Level, outcome: &Outcome, out: &mut String) {
    let (folder, name) = outcome.path.rsplit_once('/').unwrap_or(("", &outcome.path));
    let class = format!("{}.{}", level.name(), folder.replace('/', "."));
    let _ = write!(
        out,
        "    <testcase classname=\"{}\" name=\"{}\"",
        escaped(&class),
        escaped(name)
    );
    let verdict = outcome.verdicts.iter().find(|v| v.0 == level).map(|v| v.1);
    match verdict {
        Some(Verdict::Failed) => {
            let mut message = "";
            let mut details = String::new();
            let at_level = outcome.failures.iter().filter(|f| f.level <= level);
            for failure in at_level {
                if message.is_empty() {
                    message = &failure.got;
                }
                let _ = writeln!(
                    details,
                    "{}: expected {}, got {}",
                    failure.check, failure.expected, failure.got
                );
            }
            let _ = writeln!(
                out,
                ">\n      <failure message=\"{}\">{}</failure>\n    </testcase>",
                escaped(message),
                escaped(&details)
            );
        }
        Some(Verdict::Skipped) => {
            let reason = outcome.skip.as_deref().unwrap_or_default();
            let _ = writeln!(
                out,
                ">\n      <skipped message=\"{}\"/>\n    </testcase>",
                escaped(reason)
            );
        }
        Some(Verdict::NotImplemented) => {
            *out += ">\n      <skipped message=\"not implemented\"/>\n    </testcase>\n";
        }
        Some(Verdict::Passed) | None => *out += "/>\n",
    }
}
