//! `encode` writes what decoders with its limits read, or refuses before it traces.

use std::path::{Path, PathBuf};
use std::process::Output;

use super::{dapple, json, run, text};

/// A triangle: three positions of three f32.
const TRIANGLE: &str = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

/// A scene whose nodes stand below each other or side by side, each with the triangle or the last
/// one alone.
fn scene(folder: &Path, count: usize, nested: bool) -> PathBuf {
    let node = |i: usize| {
        let name = format!(r#"{{"name":"{:a>30}""#, i);
        match (nested, i + 1 == count) {
            (true, false) => format!(r#"{name},"children":[{}]}}"#, i + 1),
            _ => format!(r#"{name},"mesh":0}}"#),
        }
    };
    let nodes: Vec<String> = (0..count).map(node).collect();
    let roots: Vec<String> = (0..if nested { 1 } else { count })
        .map(|i| i.to_string())
        .collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{TRIANGLE}"}}]}}"#,
        roots.join(","),
        nodes.join(",")
    );
    let path = folder.join("scene.gltf");
    std::fs::write(&path, json).expect("written");
    path
}

fn encode(scene: &Path, out: &Path, options: &[&str]) -> Output {
    let (scene, out) = (scene.to_str().expect("UTF-8"), out.to_str().expect("UTF-8"));
    let fixed = ["encode", scene, "-o", out, "--density", "64", "--rays", "1"];
    dapple(&[&fixed, options].concat())
}

#[test]
fn long_node_paths_are_shortened_with_a_warning() {
    let folder = tempfile::tempdir().expect("folder");
    let out = folder.path().join("a.dapple");
    let scene = scene(folder.path(), 40, true);
    let output = encode(&scene, &out, &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let warnings = json(&output)["warnings"].to_string();
    assert!(warnings.contains("longer than 1024 bytes"), "{warnings}");
    assert_eq!(run("validate", &out, &[]).status.code(), Some(0));
    let report = json(&run("inspect", &out, &["--json"]));
    let path = report["tracks"][0]["path"].as_str().expect("a path");
    assert_eq!(path.len(), 1024);
    assert!(path.ends_with(&format!("/{:a>30}", 39)), "{path}");

    // The client finds the instance again.
    let picture = folder.path().join("a.png");
    let scene = scene.to_str().expect("UTF-8");
    let picture = picture.to_str().expect("UTF-8");
    let options = [
        "--scene",
        scene,
        "-o",
        picture,
        "--size",
        "32x18",
        "--backend",
        "cpu",
    ];
    let output = run("render", &out, &options);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

#[test]
fn scenes_beyond_the_limits_are_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let out = folder.path().join("a.dapple");
    let scene = scene(folder.path(), 3, false);
    for (option, limit, figures) in [
        (
            "--max-tracks",
            "2",
            "are 3, and the decoders' limit tracks is 2",
        ),
        (
            "--max-path-bytes",
            "29",
            "are 30, and the decoders' limit path_bytes is 29",
        ),
        (
            "--max-state-bytes",
            "99",
            "the decoders' limit state_bytes is 99",
        ),
        (
            "--max-frame-bytes",
            "99",
            "the decoders' limit frame_bytes is 99",
        ),
    ] {
        let output = encode(&scene, &out, &[option, limit]);
        assert_eq!(output.status.code(), Some(1));
        let told = text(&output.stderr);
        assert!(
            told.contains(figures) && told.lines().count() == 1,
            "{told}"
        );
        assert!(!out.exists());
    }
    let output = encode(&scene, &out, &["--max-tracks", "3"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(
        run("validate", &out, &["--max-tracks", "3"]).status.code(),
        Some(0)
    );
}
