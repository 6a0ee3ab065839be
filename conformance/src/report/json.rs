use serde_json::{Map, Value, json};

use crate::options::Level;
use crate::run::{Outcome, Report, Verdict};

/// One JSON document: counts by level and area, and what came of every vector.
pub fn json(report: &Report) -> String {
    let mut levels = Map::new();
    for level in Level::ALL {
        let mut areas = Map::new();
        for area in report.areas() {
            let counts = Verdict::ALL.map(|verdict| report.count(level, Some(area), verdict));
            if counts.iter().sum::<usize>() > 0 {
                let names = Verdict::ALL.map(|verdict| verdict.name().replace(' ', "_"));
                let counts = counts.map(Value::from);
                areas.insert(
                    area.to_string(),
                    Map::from_iter(names.into_iter().zip(counts)).into(),
                );
            }
        }
        if !areas.is_empty() {
            levels.insert(level.name().to_string(), areas.into());
        }
    }
    let vectors: Vec<Value> = report.outcomes.iter().map(outcome).collect();
    let document = json!({
        "decoder": report.decoder,
        "passed": report.passed(),
        "result": report.result(),
        "requests": report.requests(),
        "extent": report.extent,
        "not_run": report.not_run,
        "levels": levels,
        "vectors": vectors,
    });
    // Strings, numbers and lists only: this cannot fail.
    serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
}

fn outcome(outcome: &Outcome) -> Value {
    let verdicts = outcome.verdicts.iter().map(|(level, verdict)| {
        let name = verdict.name().replace(' ', "_");
        (level.name().to_string(), Value::from(name))
    });
    let mut value = json!({
        "path": outcome.path,
        "clauses": outcome.clauses,
        "levels": Map::from_iter(verdicts),
    });
    if let Some(reason) = &outcome.skip {
        value["skip"] = Value::from(reason.as_str());
    }
    if outcome.failed() {
        let failures = outcome.failures.iter().map(|failure| {
            json!({
                "level": failure.level.name(),
                "check": failure.check,
                "expected": failure.expected,
                "got": failure.got,
            })
        });
        value["failures"] = failures.collect();
        value["failures_left_out"] = Value::from(outcome.left_out);
    }
    value
}
