//! The JSON beside each vector fits `vector.schema.json`.
//!
//! A crate that checks JSON schemas brings some sixty others with it; this checks the dozen words
//! that our schema uses, and fails at any other.

use std::fs;

use dapple_conformance::vector;
use serde_json::{Value, json};

fn schema() -> Value {
    let text = fs::read(vector::folder().join("vector.schema.json")).expect("the schema");
    serde_json::from_slice(&text).expect("JSON")
}

/// The first fault of a value, if it has one.
fn fault(root: &Value, schema: &Value, value: &Value) -> Result<(), String> {
    for (word, rule) in schema.as_object().expect("a schema is an object") {
        check(root, schema, word, rule, value).map_err(|inner| format!("{word}: {inner}"))?;
    }
    Ok(())
}

fn check(
    root: &Value,
    schema: &Value,
    word: &str,
    rule: &Value,
    value: &Value,
) -> Result<(), String> {
    let number = |rule: &Value| rule.as_i64().expect("a whole number");
    let length = || match value {
        Value::Array(items) => items.len() as i64,
        Value::String(text) => text.chars().count() as i64,
        _ => 0,
    };
    let fits = match word {
        "$schema" | "title" | "description" | "$defs" => true,
        "type" => match rule.as_str().expect("a type") {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "integer" => value.is_i64() || value.is_u64(),
            other => panic!("{other}: no such type here"),
        },
        "const" => value == rule,
        "enum" => rule.as_array().expect("a list").contains(value),
        "minimum" => value.as_i64().is_none_or(|value| value >= number(rule)),
        "maximum" => value
            .as_u64()
            .is_none_or(|value| value <= number(rule) as u64),
        "minItems" | "minLength" => length() >= number(rule),
        "maxItems" => length() <= number(rule),
        "uniqueItems" => {
            let items = value.as_array().expect("a list");
            let twice = |(i, item): (usize, &Value)| items[..i].contains(item);
            !items.iter().enumerate().any(twice)
        }
        "pattern" => {
            let text = value.as_str().unwrap_or_default();
            match rule.as_str().expect("a pattern") {
                "^[0-9a-f]{64}$" => {
                    let hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
                    text.len() == 64 && text.chars().all(hex)
                }
                "^[A-Z]-[0-9]{3}$" => dapple_conformance::clauses::is_id(text),
                other => panic!("{other}: no such pattern here"),
            }
        }
        "required" => {
            let names = rule.as_array().expect("names");
            names
                .iter()
                .all(|name| value.get(name.as_str().expect("a name")).is_some())
        }
        "additionalProperties" => {
            let known = &schema["properties"];
            let mut names = value
                .as_object()
                .into_iter()
                .flat_map(|object| object.keys());
            names.all(|name| known.get(name).is_some())
        }
        "properties" => {
            for (name, rule) in rule.as_object().expect("properties") {
                if let Some(value) = value.get(name) {
                    fault(root, rule, value).map_err(|inner| format!("{name}: {inner}"))?;
                }
            }
            true
        }
        "items" => {
            for item in value.as_array().into_iter().flatten() {
                fault(root, rule, item)?;
            }
            true
        }
        "oneOf" => {
            let rules = rule.as_array().expect("schemas").iter();
            rules
                .filter(|rule| fault(root, rule, value).is_ok())
                .count()
                == 1
        }
        "$ref" => {
            let pointer = rule.as_str().and_then(|rule| rule.strip_prefix('#'));
            let rule = pointer.and_then(|pointer| root.pointer(pointer));
            fault(root, rule.expect("a place in the schema"), value)?;
            true
        }
        other => panic!("{other}: no such word here"),
    };
    if fits {
        Ok(())
    } else {
        Err(format!("{value} does not fit {rule}"))
    }
}

#[test]
fn every_vector_fits_the_schema() {
    let schema = schema();
    let vectors = vector::load(&vector::folder()).expect("vectors");
    for vector in vectors {
        let path = vector::folder().join(vector.path() + ".json");
        let value = serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON");
        let fits = fault(&schema, &schema, &value);
        assert_eq!(fits, Ok(()), "{}", vector.path());
    }
}

#[test]
fn what_no_vector_says_does_not_fit() {
    let schema = schema();
    let hash = "0".repeat(64);
    let good = json!({
        "clauses": ["C-001"], "since": 1, "class": "reject", "comment": "a",
        "error": { "layer": "codec", "id": 3001, "offset": 0 },
        "released_sha256": hash, "bytes": 1, "sha256": hash,
    });
    assert_eq!(fault(&schema, &schema, &good), Ok(()));
    let changes = [
        ("/clauses", json!([])),
        ("/clauses", json!(["C-01"])),
        ("/clauses", json!(["C-001", "C-001"])),
        ("/since", json!(0)),
        ("/since", json!("1")),
        ("/class", json!("other")),
        ("/comment", json!("")),
        ("/error/layer", json!("wire")),
        ("/error/id", json!(1000)),
        ("/error/offset", json!(-1)),
        ("/error", json!({ "layer": "codec", "id": 3001 })),
        ("/sha256", json!("0".repeat(63))),
        ("/sha256", json!("G".repeat(64))),
    ];
    for (place, value) in changes {
        let mut bad = good.clone();
        *bad.pointer_mut(place).expect("a place") = value;
        assert!(fault(&schema, &schema, &bad).is_err(), "{bad}");
    }
    let light = json!([[0, 1], [0, 1], [0, 1]]);
    let probes = json!([{
        "track": 1, "position": [0, 0, 0], "normal": [0, 0, 1], "view": [0, 0, 1],
        "roughness": 65536, "interpolation": "visibility-weighted", "irradiance": light, "radiance": light,
    }]);
    let mut asking = good.clone();
    asking["queries"] = probes.clone();
    assert_eq!(fault(&schema, &schema, &asking), Ok(()));
    for (name, value) in [
        ("roughness", json!(65537)),
        ("interpolation", json!("nearest")),
        ("irradiance", json!([[0, 1], [0, 1]])),
        ("radiance", json!([[0, 1], [0, 1], [0, -1]])),
        ("ao", json!([0, 1])),
    ] {
        asking["queries"] = probes.clone();
        asking["queries"][0][name] = value;
        assert!(fault(&schema, &schema, &asking).is_err(), "{asking}");
    }
    for (name, value) in [
        ("other", json!(1)),
        ("dump_sha256", json!(hash)),
        ("live", json!(false)),
        ("limits", json!({ "other": 1 })),
        ("limits", json!({ "tracks": 4_294_967_296_u64 })),
        (
            "queries",
            json!([{ "track": 1, "position": [0, 0], "normal": [0, 0, 1], "ao": [0, 1] }]),
        ),
    ] {
        let mut bad = good.clone();
        bad[name] = value;
        assert!(fault(&schema, &schema, &bad).is_err(), "{bad}");
    }
}
