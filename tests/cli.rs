//! What a user types, and what comes back.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use dapple::render::image::Picture;

fn dapple(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(arguments)
        .output()
        .expect("dapple runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Exit code 1, nothing on stdout, one sentence on stderr that names what it must.
fn assert_refused(output: &Output, names: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(output.stdout.is_empty());
    assert!(
        stderr.starts_with("dapple: ") && stderr.lines().count() == 1,
        "{stderr}"
    );
    assert!(stderr.contains(names), "{stderr} does not name {names}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().expect("UTF-8 path").to_string()
}

mod compare {
    use super::*;

    fn pictures(folder: &Path) -> (String, String) {
        let (a, b) = (path(folder, "a.png"), path(folder, "b.png"));
        Picture::filled(16, 16, [100; 3])
            .write_png(Path::new(&a))
            .expect("written");
        Picture::filled(16, 16, [151; 3])
            .write_png(Path::new(&b))
            .expect("written");
        (a, b)
    }

    #[test]
    fn prints_the_metrics() {
        let folder = tempfile::tempdir().expect("folder");
        let (a, b) = pictures(folder.path());
        // 51 codes of 255 everywhere: 20 log10(5) dB.
        let output = dapple(&["compare", &a, &b]);
        assert_eq!(output.status.code(), Some(0));
        let shown = text(&output.stdout);
        assert!(shown.starts_with("PSNR  13.98 dB\nSSIM  0.9"), "{shown}");
        let shown = text(&dapple(&["compare", &a, &a]).stdout);
        assert_eq!(
            shown,
            "PSNR  inf dB\nSSIM  1.00000\nFLIP  0.00000\nRMSE  0.000000\n"
        );
    }

    #[test]
    fn json_is_one_document() {
        let folder = tempfile::tempdir().expect("folder");
        let (a, b) = pictures(folder.path());
        let read = |arguments: &[&str]| -> serde_json::Value {
            serde_json::from_slice(&dapple(arguments).stdout).expect("one JSON document")
        };
        let json = read(&["compare", &a, &b, "--json"]);
        assert!((json["psnr"].as_f64().expect("PSNR") - 20.0 * 5f64.log10()).abs() < 1e-9);
        assert_eq!(
            (&json["values"], &json["pixels"]),
            (&"srgb".into(), &256.into())
        );
        let linear = read(&["compare", &a, &b, "--json", "--linear"]);
        assert!(linear["psnr"].as_f64() > json["psnr"].as_f64() && linear["flip"] == json["flip"]);
        assert!(read(&["compare", &a, &a, "--json"])["psnr"].is_null());
    }

    #[test]
    fn bad_input_is_one_sentence() {
        let folder = tempfile::tempdir().expect("folder");
        let (a, b) = pictures(folder.path());
        let missing = path(folder.path(), "missing.png");
        assert_refused(&dapple(&["compare", &a, &missing]), "missing.png");
        assert_refused(
            &dapple(&["compare", folder.path().to_str().expect("UTF-8"), &a]),
            "PNG",
        );
        let whole = std::fs::read(&b).expect("read");
        std::fs::write(&b, &whole[..whole.len() / 2]).expect("written");
        assert_refused(&dapple(&["compare", &a, &b]), "b.png");
        std::fs::write(&b, b"").expect("written");
        assert_refused(&dapple(&["compare", &a, &b]), "b.png");
        Picture::filled(16, 15, [0; 3])
            .write_png(Path::new(&b))
            .expect("written");
        assert_refused(&dapple(&["compare", &a, &b]), "16x16 against 16x15");
    }
}

#[test]
fn bad_usage_exits_with_2() {
    for arguments in [
        &[][..],
        &["nonsense"],
        &["compare"],
        &["compare", "a", "b", "--no-such"],
    ] {
        let output = dapple(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty());
    }
    let help = dapple(&["--help"]);
    assert_eq!(help.status.code(), Some(0));
    assert!(text(&help.stdout).contains("compare"));
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let folder = tempfile::tempdir().expect("folder");
    let a = path(folder.path(), "a.png");
    Picture::filled(16, 16, [1; 3])
        .write_png(Path::new(&a))
        .expect("written");
    for arguments in [vec!["compare", &a, &a], vec!["--help"]] {
        let (reader, writer) = std::io::pipe().expect("pipe");
        drop(reader);
        let output = Command::new(env!("CARGO_BIN_EXE_dapple"))
            .args(&arguments)
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .expect("dapple runs");
        assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
        assert_eq!(output.status.code(), Some(0));
    }
}

/// A scene of one triangle without lights.
const DARK: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn scenes_without_light_are_told() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = path(folder.path(), "dark.gltf");
    std::fs::write(&scene, DARK).expect("written");
    let (stream, picture) = (
        path(folder.path(), "a.dapple"),
        path(folder.path(), "a.png"),
    );
    let encode = [
        "encode",
        &scene,
        "--model",
        "probes",
        "--probes",
        "2x2x2",
        "--samples",
        "8",
        "--warm-up",
        "0",
        "--volume",
        "0,0,-1,1,1,1",
        "-o",
        &stream,
    ];
    let render = [
        "render",
        "--scene",
        &scene,
        "--method",
        "path",
        "--samples",
        "2",
        "--size",
        "8x8",
        "-o",
        &picture,
    ];
    for arguments in [&encode[..], &render[..]] {
        let output = dapple(arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        assert!(stderr.contains("the scene has no light") && stderr.contains("--sky"));
        let stdout = text(&output.stdout);
        assert!(
            !stdout.contains("no dB") && !stdout.contains("inf"),
            "{stdout}"
        );
        let lit = [arguments, &["--sky", "1,1,1"]].concat();
        assert!(!text(&dapple(&lit).stderr).contains("no light"));
    }
}
