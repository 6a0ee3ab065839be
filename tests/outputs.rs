//! What becomes of files: outputs that appear whole or not at all, inputs that are never written
//! over, and options that have no effect.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use dapple::render::image::Picture;

/// A level square, `2 * half` metres wide, as a glTF file with its buffer beside it. It rises by a
/// metre within a second where `moves`.
fn write_floor(path: &Path, half: f32, moves: bool) {
    let corners = [[-half, -half], [-half, half], [half, half], [half, -half]];
    let mut bytes: Vec<u8> = Vec::new();
    let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|f| f.to_le_bytes()));
    for [x, z] in corners {
        put(&[x, 0.0, z]);
    }
    put(&[0.0, 1.0]);
    put(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    for index in [0u16, 1, 2, 0, 2, 3] {
        bytes.extend(index.to_le_bytes());
    }
    let buffer = path.with_extension("bin");
    std::fs::write(&buffer, &bytes).expect("written");
    let view = |offset: usize, length: usize| serde_json::json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let mut document = serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "floor", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": bytes.len(), "uri": buffer.file_name().expect("a name").to_str()}],
        "bufferViews": [view(0, 48), view(80, 12), view(48, 8), view(56, 24)],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
             "min": [-half, 0.0, -half], "max": [half, 0.0, half]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
            {"bufferView": 2, "componentType": 5126, "type": "SCALAR", "count": 2, "min": [0.0], "max": [1.0]},
            {"bufferView": 3, "componentType": 5126, "type": "VEC3", "count": 2},
        ],
    });
    if moves {
        document["animations"] = serde_json::json!([{
            "samplers": [{"input": 2, "output": 3}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]
        }]);
    }
    std::fs::write(path, document.to_string()).expect("written");
}

/// A folder with the scene `a.gltf`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_floor(&folder.path().join("a.gltf"), 1.0, false);
    folder
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dapple"));
    command.args(line.split_whitespace()).current_dir(folder);
    command
}

fn dapple(folder: &Path, line: &str) -> Output {
    command(folder, line).output().expect("dapple runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the program, which must succeed; returns its lines on stderr.
fn warnings(folder: &Path, line: &str) -> Vec<String> {
    let output = dapple(folder, line);
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{line}: {stderr}");
    let ours = stderr.lines().filter(|line| line.starts_with("dapple: "));
    ours.map(str::to_owned).collect()
}

/// Runs the program, which must end with this code and one error that contains `names`.
fn refuses(folder: &Path, line: &str, code: i32, names: &str) {
    let output = dapple(folder, line);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {stderr}");
    assert!(output.stdout.is_empty(), "{line}");
    let errors = stderr.lines().filter(|line| !line.contains("warning: "));
    let errors: Vec<&str> = errors.collect();
    assert_eq!(errors.len(), 1, "{line}: {stderr}");
    assert!(errors[0].contains(names), "{line}: {stderr}");
}

/// Names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("an entry").file_name();
    let mut names: Vec<String> = entries
        .map(|e| name(e).to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

const POINTS: &str = "--density 16 --rays 16";
const LIGHT: &str = "--model probes --probes 2x2x2 --samples 2 --warm-up 1 --sky 1,1,1";
const SMALL: &str = "--size 16x9 --backend cpu";

#[test]
fn inputs_are_never_written_over() {
    let folder = folder();
    let at = folder.path();
    warnings(at, &format!("encode a.gltf -o a.dapple {POINTS}"));
    // A picture may have any name; so may a stream.
    for (input, copy) in [("a.gltf", "scene"), ("a.dapple", "stream")] {
        std::fs::copy(at.join(input), at.join(copy)).expect("copied");
    }
    std::fs::hard_link(at.join("scene"), at.join("hard")).expect("a link");
    let before: Vec<Vec<u8>> = ["scene", "stream", "a.bin"]
        .map(|name| std::fs::read(at.join(name)).expect("read"))
        .into();
    let lines = [
        "encode scene -o scene",
        "encode scene -o ./scene",
        "encode scene -o hard",
        "encode scene -o a.bin",
        "encode hard -o scene",
        "render stream --scene scene -o scene",
        "render stream --scene scene -o stream",
        "render stream --scene scene --method none -o stream",
        "render --method path --scene scene -o a.png --linear hard",
        "render --method path --scene scene -o a --linear a",
    ];
    for line in lines {
        let names = match line.ends_with("-o a --linear a") {
            true => "two outputs",
            false => "input",
        };
        refuses(at, line, 2, names);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("scene", at.join("soft")).expect("a link");
        refuses(at, "encode scene -o soft", 2, "input");
        refuses(at, "encode soft -o scene", 2, "input");
    }
    for (name, bytes) in ["scene", "stream", "a.bin"].iter().zip(before) {
        assert_eq!(std::fs::read(at.join(name)).expect("read"), bytes, "{name}");
    }
}

#[test]
fn outputs_make_their_folders_and_refuse_to_be_one() {
    let folder = folder();
    let at = folder.path();
    warnings(at, &format!("encode a.gltf -o x/y/a.dapple {POINTS}"));
    let line = format!("render x/y/a.dapple --scene a.gltf {SMALL} -o p/q/a.png");
    warnings(at, &line);
    assert_eq!(names(&at.join("p/q")), ["a.png"]);
    assert_eq!(names(&at.join("x/y")), ["a.dapple"]);
    refuses(at, "encode a.gltf -o x", 2, "folder");
    refuses(at, "encode a.gltf -o z/", 2, "folder");
    refuses(at, "render --method none --scene a.gltf -o x", 2, "folder");
    assert_eq!(names(at), ["a.bin", "a.gltf", "p", "x"]);
}

#[test]
fn a_failed_run_leaves_the_old_file() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("a.dapple"), b"old").expect("written");
    if Path::new("/dev/full").exists() {
        let line = format!("encode a.gltf -o /dev/full {POINTS}");
        refuses(at, &line, 1, "/dev/full");
    }
    // No surface that holds points: found after the output was opened.
    let glass = std::fs::read_to_string(at.join("a.gltf")).expect("read");
    let glass = glass
        .replace("\"indices\":1", "\"indices\":1,\"material\":0")
        .replace(
            "\"meshes\"",
            "\"materials\":[{\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.1]}}],\"meshes\"",
        );
    std::fs::write(at.join("a.gltf"), glass).expect("written");
    refuses(at, "encode a.gltf -o a.dapple", 1, "no surface");
    assert_eq!(std::fs::read(at.join("a.dapple")).expect("read"), b"old");
    assert_eq!(names(at), ["a.bin", "a.dapple", "a.gltf"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_the_old_file() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("a.png"), b"old").expect("written");
    let endless = "render --method path --scene a.gltf --size 480x270 --samples 1048576 -o a.png";
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let mut child = command(at, endless).spawn().expect("dapple runs");
        while names(at).len() < 4 {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let sent = Command::new("kill")
            .args([format!("-{signal}"), child.id().to_string()])
            .status();
        assert!(sent.expect("kill runs").success());
        assert_eq!(child.wait().expect("a child").code(), Some(code));
        assert_eq!(names(at), ["a.bin", "a.gltf", "a.png"]);
        assert_eq!(std::fs::read(at.join("a.png")).expect("read"), b"old");
    }
}

#[test]
fn a_dash_is_standard_input_and_output() {
    let folder = folder();
    let at = folder.path();
    warnings(at, &format!("encode a.gltf -o a.dapple {POINTS}"));
    let output = dapple(at, &format!("encode a.gltf -o - {POINTS}"));
    let stream = std::fs::read(at.join("a.dapple")).expect("read");
    assert!(output.stdout == stream, "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("standard output: 1 frame at"));

    let file = |name: &str| std::fs::File::open(at.join(name)).expect("opened");
    let line = format!("render - --scene a.gltf {SMALL} -o -");
    let output = command(at, &line).stdin(file("a.dapple")).output();
    let picture = output.expect("dapple runs").stdout;
    warnings(
        at,
        &format!("render a.dapple --scene a.gltf {SMALL} -o a.png"),
    );
    assert_eq!(std::fs::read(at.join("a.png")).expect("read"), picture);

    for (line, names) in [
        ("render - --scene - -o a.png", "two inputs"),
        (
            "render --method path --scene a.gltf -o - --linear -",
            "two outputs",
        ),
        ("encode a.gltf -o - --json", "not both"),
    ] {
        let output = command(at, line).stdin(Stdio::piped()).output();
        let output = output.expect("dapple runs");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {stderr}");
        assert!(stderr.contains(names), "{line}: {stderr}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn paths_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let at = folder.path();
    let name = |bytes: &'static [u8]| OsStr::from_bytes(bytes);
    let (scene, stream) = (name(b"\xff\xfe.gltf"), name(b"\xfd/\xfc.dapple"));
    std::fs::copy(at.join("a.gltf"), at.join(scene)).expect("copied");
    let run = |command: &mut Command| {
        let output = command.output().expect("dapple runs");
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    run(command(at, &format!("encode {POINTS} -o")).args([stream, scene]));
    run(command(at, &format!("render {SMALL} -o")).args([
        name(b"\xfb.png"),
        stream,
        name(b"--scene"),
        scene,
    ]));
    Picture::read_png(&at.join(name(b"\xfb.png"))).expect("a picture");
    let refused = command(at, "encode -o").args([scene, scene]).output();
    assert_eq!(refused.expect("dapple runs").status.code(), Some(2));
}

#[test]
fn the_method_follows_the_stream() {
    let folder = folder();
    let at = folder.path();
    warnings(at, &format!("encode a.gltf -o points.dapple {POINTS}"));
    warnings(at, &format!("encode a.gltf -o light.dapple {LIGHT}"));
    let render = |stream: &str, options: &str, name: &str| {
        let line = format!("render {stream}.dapple --scene a.gltf {SMALL} {options} -o {name}.png");
        assert_eq!(warnings(at, &line), [""; 0], "{line}");
        Picture::read_png(&at.join(format!("{name}.png"))).expect("a picture")
    };
    let sky = "--sky 1,1,1";
    let light = render("light", sky, "a");
    assert_eq!(
        light,
        render("light", &format!("--method probes {sky}"), "b")
    );
    let points = render("points", "", "c");
    assert_eq!(points, render("points", "--method points", "d"));
    assert_ne!(light, points);
    for (line, names) in [
        ("light.dapple --method points", "no points but probes"),
        ("points.dapple --method probes", "no probes but points"),
        ("points.dapple --method ddgi", "no probes but points"),
    ] {
        let line = format!("render {line} --scene a.gltf -o x.png");
        refuses(at, &line, 1, names);
    }
    refuses(at, "render --scene a.gltf -o x.png", 2, "name a stream");
    for line in [
        "render points.dapple --scene a.gltf -o x.jpg",
        "render --method path --scene a.gltf -o x.png --linear x.exr",
    ] {
        refuses(at, line, 2, "name a file that ends with");
    }
    assert!(!names(at).iter().any(|name| name.starts_with('x')));
}

#[test]
fn frames_beyond_the_stream_are_refused() {
    let folder = folder();
    let at = folder.path();
    write_floor(&at.join("b.gltf"), 1.0, true);
    warnings(
        at,
        &format!("encode b.gltf -o b.dapple {POINTS} --fps 30 --frames 5"),
    );
    let render =
        |options: &str| format!("render b.dapple --scene b.gltf {SMALL} -o a.png {options}");
    // Frames are those of the stream.
    for (options, frame) in [("--frame 4", 4), ("--frame 4 --fps 60", 2), ("", 0)] {
        let output = dapple(at, &render(options));
        let shown = text(&output.stdout);
        assert!(shown.contains(&format!("stream frame {frame},")), "{shown}");
    }
    refuses(at, &render("--frame 5"), 1, "its last frame is 4 (0.133 s)");
    refuses(at, &render("--time 9"), 1, "its last frame is 4 (0.133 s)");
    // Nothing moves in this one: its light holds for ever.
    warnings(at, &format!("encode a.gltf -o a.dapple {POINTS}"));
    warnings(
        at,
        &format!("render a.dapple --scene a.gltf {SMALL} -o a.png --frame 999"),
    );
}

#[test]
fn options_without_effect_are_told_once() {
    let folder = folder();
    let at = folder.path();
    let line = format!("encode a.gltf -o a.dapple {LIGHT} --density 5 --fov-margin 4");
    let told = warnings(at, &line);
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].contains("--density has no effect"), "{told:?}");
    assert!(told[1].contains("--fov-margin has no effect"), "{told:?}");
    let line = format!("render a.dapple --scene a.gltf {SMALL} -o a.png");
    let told = warnings(
        at,
        &format!("{line} --linear a.pfm --part direct --no-coats"),
    );
    assert_eq!(told.len(), 3, "{told:?}");
    assert!(!at.join("a.pfm").exists());
    let line = format!("render a.dapple --scene a.gltf {SMALL} -o a.png --method none");
    let told = warnings(at, &line);
    assert!(told[0].contains("STREAM has no effect"), "{told:?}");
    let report = dapple(
        at,
        &format!("encode a.gltf -o b.dapple {POINTS} --sky 1,1,1 --json"),
    );
    let report: serde_json::Value = serde_json::from_slice(&report.stdout).expect("JSON");
    assert_eq!(report["warnings"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_stream_of_another_mesh_is_refused() {
    let folder = folder();
    let at = folder.path();
    warnings(at, &format!("encode a.gltf -o a.dapple {POINTS}"));
    write_floor(&at.join("a.gltf"), 1.5, false);
    let line = format!("render a.dapple --scene a.gltf {SMALL} -o a.png");
    refuses(at, &line, 1, "another mesh of 'floor'");
    assert!(!at.join("a.png").exists());
}
