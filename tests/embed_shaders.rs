//! The samplers that engines include, `embed/shaders`: the generated files are current, and those for
//! WebGL 2 answer the query vectors.

pub mod generate;
mod webgl;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dapple::probes::ggx::{ENVIRONMENT, ENVIRONMENT_SIDE};

pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("embed/shaders")
}

/// WGSL modules with their names: each example with each accessor, and all samplers in one.
pub fn modules() -> Vec<(String, String)> {
    let root = folder();
    let mut modules = Vec::new();
    for model in generate::MODELS {
        for accessor in generate::accessors(model) {
            let name = format!("embed/shaders/wgsl/examples/{model}.wgsl with {accessor}");
            modules.push((name, generate::example(&root, model, accessor)));
        }
    }
    for accessor in ["buffers", "textures"] {
        let part = |model| {
            let sampler = generate::read(&root, &format!("{model}.wgsl"));
            sampler + &generate::read(&root, &format!("{model}_{accessor}.wgsl"))
        };
        let together = generate::MODELS.map(part).concat();
        modules.push((format!("all samplers with {accessor}"), together));
    }
    modules
}

/// The table of environment BRDFs as CSV and as little-endian f32.
fn tables() -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut add = |name: &str, head: &str, rows: Vec<&[f32]>| {
        let line = |row: &&[f32]| row.iter().map(f32::to_string).collect::<Vec<_>>().join(",");
        let lines: Vec<String> = rows.iter().map(line).collect();
        let text = format!("{head}\n{}\n", lines.join("\n"));
        files.insert(format!("tables/{name}.csv"), text.into_bytes());
        let bytes = rows.concat().into_iter().flat_map(f32::to_le_bytes);
        files.insert(format!("tables/{name}.f32"), bytes.collect());
    };
    let environments = ENVIRONMENT.iter().map(|row| &row[..]);
    add("environments", "scale,bias", environments.collect());
    files
}

/// All generated files by their paths in [`folder`].
fn generated() -> BTreeMap<String, Vec<u8>> {
    let shaders = generate::all(&folder()).into_iter();
    let shaders = shaders.map(|(path, text)| (path, text.into_bytes()));
    shaders.chain(tables()).collect()
}

/// Paths of all files of a folder of [`folder`].
fn files(folder_name: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder().join(folder_name)).expect("a folder");
    entries
        .map(|entry| {
            let name = entry.expect("an entry").file_name();
            format!("{folder_name}/{}", name.to_string_lossy())
        })
        .collect()
}

#[test]
fn all_samplers_fit_into_one_module() {
    for (name, source) in modules() {
        let (module, _) = generate::parse(&source);
        assert!(!module.functions.is_empty(), "{name}");
    }
}

#[test]
fn names_have_the_prefix() {
    let (module, _) = generate::parse(&modules().last().expect("modules").1);
    let functions = module.functions.iter().map(|(_, f)| f.name.as_ref());
    let globals = module.global_variables.iter().map(|(_, g)| g.name.as_ref());
    let constants = module.constants.iter().map(|(_, c)| c.name.as_ref());
    let types = module.types.iter().map(|(_, t)| t.name.as_ref());
    let mut names = 0;
    for name in functions
        .chain(globals)
        .chain(constants)
        .chain(types)
        .flatten()
    {
        assert!(name.to_lowercase().starts_with("dapple"), "{name}");
        names += 1;
    }
    assert!(names > 80, "{names}");
}

#[test]
fn generated_files_are_current() {
    let generated = generated();
    for (path, bytes) in &generated {
        let there = std::fs::read(folder().join(path)).unwrap_or_default();
        assert!(
            there == *bytes,
            "{path} is not what the generator writes: run \
             `cargo test --test main -- --ignored write_embed_shaders`"
        );
    }
    for folder_name in ["glsl450", "glsl310es", "glsl300es", "hlsl", "msl", "tables"] {
        for path in files(folder_name) {
            assert!(generated.contains_key(&path), "{path} is not generated");
        }
    }
}

#[test]
#[ignore = "writes the files"]
fn write_embed_shaders() {
    for (path, bytes) in generated() {
        let path = folder().join(path);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
}

#[test]
fn tables_have_the_sizes_that_the_shaders_read() {
    let tables = tables();
    let side = ENVIRONMENT_SIDE;
    assert_eq!(tables["tables/environments.f32"].len(), side * side * 2 * 4);
}
