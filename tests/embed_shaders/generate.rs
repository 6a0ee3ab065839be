//! The samplers of `embed/shaders/wgsl` in other languages, by naga.

use std::collections::BTreeMap;
use std::path::Path;

use naga::back::{glsl, hlsl, msl};
use naga::proc::BoundsCheckPolicies;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, ShaderStage};

pub const MODELS: [&str; 5] = ["points", "probes", "vertices", "instances", "regions"];
/// How the arrays of a model can come.
pub fn accessors(model: &str) -> &'static [&'static str] {
    match model {
        "probes" => &["buffers", "textures", "packed"],
        _ => &["buffers", "textures"],
    }
}

/// A language.
struct Target {
    folder: &'static str,
    extension: &'static str,
    has_buffers: bool,
    write: fn(&Module, &ModuleInfo) -> String,
    /// What the file needs before it.
    needs: &'static str,
}

const TARGETS: [Target; 5] = [
    Target {
        folder: "glsl450",
        extension: "glsl",
        has_buffers: true,
        write: |module, info| glsl(module, info, glsl::Version::Desktop(450)),
        needs: "`#version 450`",
    },
    Target {
        folder: "glsl310es",
        extension: "glsl",
        has_buffers: true,
        write: |module, info| glsl(module, info, glsl::Version::new_gles(310)),
        needs: "`#version 310 es` and `precision highp` for float and int",
    },
    Target {
        folder: "glsl300es",
        extension: "glsl",
        has_buffers: false,
        write: |module, info| {
            let version = glsl::Version::Embedded {
                version: 300,
                is_webgl: true,
            };
            glsl(module, info, version)
        },
        needs: "`#version 300 es` and `precision highp` for float and int",
    },
    Target {
        folder: "hlsl",
        extension: "hlsl",
        has_buffers: true,
        write: hlsl,
        needs: "shader model 5.0",
    },
    Target {
        folder: "msl",
        extension: "metal",
        has_buffers: true,
        write: msl,
        needs: "Metal 2.1; what a function reads is passed to it",
    },
];

/// The WGSL of a model's sampler, an accessor and the example.
pub fn example(root: &Path, model: &str, accessor: &str) -> String {
    let parts = [
        format!("{model}.wgsl"),
        format!("{model}_{accessor}.wgsl"),
        format!("examples/{model}.wgsl"),
    ];
    parts.map(|part| read(root, &part)).join("\n")
}

/// A file of `wgsl/`.
pub fn read(root: &Path, name: &str) -> String {
    let path = root.join("wgsl").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A valid module.
pub fn parse(source: &str) -> (Module, ModuleInfo) {
    let module = naga::front::wgsl::parse_str(source);
    let module = module.unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
    let mut validator = Validator::new(
        ValidationFlags::all(),
        Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    );
    let info = validator.validate(&module);
    let info = info.unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
    (module, info)
}

/// All generated files by their paths in `embed/shaders`.
pub fn all(root: &Path) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    for model in MODELS {
        for target in &TARGETS {
            for accessor in accessors(model) {
                if *accessor == "buffers" && !target.has_buffers {
                    continue;
                }
                let source = example(root, model, accessor);
                let (module, info) = parse(&source);
                let text = (target.write)(&module, &info);
                let accessors = read(root, &format!("{model}_{accessor}.wgsl"));
                let accessors = functions(&accessors);
                let text = include(&text, model, &accessors, target.folder != "msl");
                let Target {
                    folder,
                    extension,
                    needs,
                    ..
                } = target;
                let head = format!(
                    "// Generated from `embed/shaders/wgsl/{model}.wgsl` and `{model}_{accessor}.wgsl`.\n\
                     // Needs {needs}.\n\n"
                );
                let path = format!("{folder}/{model}_{accessor}.{extension}");
                files.insert(path, head + &text);
            }
        }
    }
    files
}

/// Names of the functions of a WGSL text.
fn functions(text: &str) -> Vec<&str> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("fn "));
    lines.filter_map(|rest| rest.split('(').next()).collect()
}

/// Number of a binding in GLSL, where there may be as few as 8 of storage buffers and 16 of textures: arrays from 0,
/// then the planes of `probes`.
fn slot(binding: u32) -> u8 {
    let slot = match binding {
        1..=4 => binding + 2,
        6..=14 => binding + 6,
        32..=34 => binding - 32,
        40 => 8,
        48 => 9,
        56 | 57 => binding - 46,
        // Not in the file: the sampler, which GLSL has with its textures, and what the example binds.
        _ => 255,
    };
    slot as u8
}

fn glsl(module: &Module, info: &ModuleInfo, version: glsl::Version) -> String {
    let mut options = glsl::Options {
        version,
        writer_flags: glsl::WriterFlags::empty(),
        zero_initialize_workgroup_memory: false,
        ..Default::default()
    };
    let mut names = Vec::new();
    for (_, global) in module.global_variables.iter() {
        let (Some(binding), Some(name)) = (&global.binding, &global.name) else {
            continue;
        };
        if !matches!(version, glsl::Version::Embedded { version: 300, .. }) {
            options.binding_map.insert(*binding, slot(binding.binding));
        }
        let generated = format!("_group_{}_binding_{}_fs", binding.group, binding.binding);
        names.push((generated, name.clone()));
    }
    let pipeline = glsl::PipelineOptions {
        shader_stage: ShaderStage::Fragment,
        entry_point: "example".into(),
        multiview: None,
    };
    let mut text = String::new();
    let policies = BoundsCheckPolicies::default();
    glsl::Writer::new(&mut text, module, info, &options, &pipeline, policies)
        .and_then(|mut writer| writer.write())
        .expect("GLSL can be written");
    for (generated, name) in names {
        text = text.replace(&generated, &name);
    }
    text
}

fn hlsl(module: &Module, info: &ModuleInfo) -> String {
    let mut options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V5_1,
        fake_missing_bindings: false,
        restrict_indexing: false,
        force_loop_bounding: false,
        zero_initialize_workgroup_memory: false,
        ..Default::default()
    };
    for (_, global) in module.global_variables.iter() {
        if let Some(binding) = global.binding {
            let target = hlsl::BindTarget {
                // Direct3D 11 has one space.
                space: 0,
                register: binding.binding,
                ..Default::default()
            };
            options.binding_map.insert(binding, target);
            let key = hlsl::SamplerIndexBufferKey {
                group: binding.group,
            };
            let target = hlsl::BindTarget::default();
            options.sampler_buffer_binding_map.insert(key, target);
        }
    }
    let pipeline = hlsl::PipelineOptions { entry_point: None };
    let mut text = String::new();
    hlsl::Writer::new(&mut text, &options, &pipeline)
        .write(module, info, None)
        .expect("HLSL can be written");
    text.lines().map(with_list).collect()
}

/// A line of HLSL whose array of zeros, `(float4[7])0`, is a list: glslang has no casts to arrays.
fn with_list(line: &str) -> String {
    let parts = line.split_once("= (").or(line.split_once("return ("));
    let array = parts.and_then(|(before, rest)| {
        let (element, count) = rest.strip_suffix("])0;")?.split_once('[')?;
        Some((before, element, count.parse::<usize>().ok()?))
    });
    let Some((before, element, count)) = array else {
        return format!("{line}\n");
    };
    let zeros = vec![format!("({element})0"); count].join(", ");
    if line.contains("return") {
        format!("{before}{element} ret[{count}] = {{ {zeros} }};\n{before}return ret;\n")
    } else {
        format!("{before}= {{ {zeros} }};\n")
    }
}

fn msl(module: &Module, info: &ModuleInfo) -> String {
    let options = msl::Options {
        lang_version: (2, 1),
        zero_initialize_workgroup_memory: false,
        force_loop_bounding: false,
        ..Default::default()
    };
    let (text, _) =
        msl::write_string(module, info, &options, &Default::default()).expect("MSL can be written");
    text
}

/// What of a module an engine includes: without the example and what belongs to it. Where a language has
/// global resources, they and the accessors stand behind a macro that an engine defines to bring its own.
fn include(text: &str, model: &str, accessors: &[&str], guarded: bool) -> String {
    let (mut head, mut resources, mut body) = (Vec::new(), Vec::new(), Vec::new());
    let mut prototypes = Vec::new();
    for item in items(text) {
        let first = item.lines().next().unwrap_or_default();
        let is_example = [
            "struct Fragment",
            " in ",
            " out ",
            "void main(",
            "example",
            "nagaS",
            "nagaC",
        ]
        .iter()
        .any(|word| first.contains(word));
        let is_resource = ["uniform ", "buffer ", "cbuffer ", "register("]
            .iter()
            .any(|word| first.contains(word));
        let of = |name: &&str| first.contains(&format!(" {name}("));
        let is_function = first.contains('(') && item.ends_with('}') && item.contains("\n");
        if first.contains("dapple_probes_filtering = nagaSamplerHeap") {
            resources.push("SamplerState dapple_probes_filtering : register(s6);".into());
        } else if is_example || is_resource && !item.contains("dapple_") {
            continue;
        } else if is_resource {
            resources.push(item);
        } else if guarded && accessors.iter().any(of) {
            let signature = item.split('{').next().unwrap_or_default().trim_end();
            prototypes.push(format!("{signature};"));
            resources.push(item);
        } else if is_function && first.contains(" dapple_") {
            body.push(item);
        } else {
            head.push(item);
        }
    }
    let custom = format!("DAPPLE_{}_CUSTOM", model.to_uppercase());
    let mut parts = vec![head.join("\n")];
    if guarded {
        parts.push(format!(
            "// Define {custom} to bring these functions.\n#ifndef {custom}\n{}\n\n#else\n{}\n#endif",
            resources.join("\n"),
            prototypes.join("\n")
        ));
    }
    parts.push(body.join("\n\n"));
    prefixed(&parts.join("\n\n"), model) + "\n"
}

/// The items of a text at its top level, without directives that come once a shader.
fn items(text: &str) -> Vec<String> {
    let mut items = Vec::new();
    let (mut item, mut depth) = (String::new(), 0);
    for line in text.lines() {
        if depth == 0 && item.is_empty() {
            let once = ["#version", "#extension", "precision ", "//"];
            if line.trim().is_empty() || once.iter().any(|word| line.starts_with(word)) {
                continue;
            }
        }
        if !item.is_empty() {
            item.push('\n');
        }
        item += line;
        depth += line.matches('{').count();
        depth -= line.matches('}').count();
        let ends = line.ends_with(';') || line.ends_with('}') || line.starts_with('#');
        if depth == 0 && ends {
            items.push(std::mem::take(&mut item));
        }
    }
    items
}

/// The text with the model's prefix at names that naga makes, so that the files of several models fit into
/// one shader.
fn prefixed(text: &str, model: &str) -> String {
    let own = [
        "naga_",
        "Naga",
        "Construct",
        "ret_Construct",
        "ZeroValue",
        "ret_ZeroValue",
        "type_",
        "_mslBufferSizes",
    ];
    let mut result = String::with_capacity(text.len());
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut rest = text;
    while let Some(start) = rest.find(is_part) {
        let word = &rest[start..];
        let end = word.find(|c| !is_part(c)).unwrap_or(word.len());
        let word = &word[..end];
        result += &rest[..start];
        if own.iter().any(|prefix| word.starts_with(prefix)) {
            result += &format!("dapple_{model}_{}", word.trim_start_matches('_'));
        } else if word.contains("_block_") {
            result += &format!("dapple_{model}_{word}");
        } else {
            result += word;
        }
        rest = &rest[start + end..];
    }
    result + rest
}
