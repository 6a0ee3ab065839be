//! Every WGSL module against a strict compiler: that of Chromium, which refuses some of what naga
//! takes.

use std::path::Path;

use dapple::render::shaders;
use serde_json::{Value, json};

use crate::browser;
use crate::embed_shaders::{self, generate};

/// Samplers as their query tests ask them.
const QUERIES: [(&str, &str); 3] = [
    ("probes", include_str!("probes_queries/ask.wgsl")),
    ("instances", include_str!("instances_queries/ask.wgsl")),
    ("regions", include_str!("regions_queries/ask.wgsl")),
];

/// Names and sources of all modules: those of the program, of the query tests and of `embed/shaders`.
fn all() -> Vec<(String, String)> {
    let program = shaders::ALL.iter();
    let program = program.map(|shader| (shader.name.to_owned(), shader.source.to_owned()));
    let queries = QUERIES.map(|(model, ask)| {
        let parts = [format!("{model}.wgsl"), format!("{model}_buffers.wgsl")];
        let sampler = parts.map(|part| generate::read(&embed_shaders::folder(), &part));
        (
            format!("tests/{model}_queries/ask.wgsl"),
            sampler.concat() + ask,
        )
    });
    program
        .chain(queries)
        .chain(embed_shaders::modules())
        .collect()
}

#[test]
fn modules_pass_a_strict_compiler() {
    let modules: Vec<Value> = all()
        .into_iter()
        .map(|(name, source)| json!({ "name": name, "source": source }))
        .collect();
    let modules = Value::from(modules);
    let Some(result) = browser::result_of(include_str!("shaders/page.html"), &modules) else {
        return;
    };
    let expected = json!({ "checked": all().len(), "messages": [] });
    assert_eq!(result, expected);
}

#[test]
fn modules_hold_every_shader_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src"), root.join("embed/shaders/wgsl")];
    let modules = all();
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "wgsl") {
                let source = std::fs::read_to_string(&path).expect("a shader");
                let known = modules.iter().any(|(_, module)| module.contains(&source));
                assert!(known, "{} is in no module", path.display());
                files += 1;
            }
        }
    }
    assert!(files >= shaders::ALL.len());
}
