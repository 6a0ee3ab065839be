//! The main job as a user types it: `demo`, and `encode`, `validate`, `inspect`, `decode`,
//! `render`, `compare` one after the other.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dapple::render::image::Picture;

/// What `encode --json` prints and `report.json` holds, at least.
const FIGURES: [&str; 17] = [
    "scene",
    "seed",
    "frames",
    "fps",
    "points",
    "cells",
    "buckets",
    "dropped_points",
    "dropped_cells",
    "changed_points",
    "rays",
    "bytes_startup",
    "bytes_steady",
    "mbps_steady",
    "mbps_with_keyframes",
    "keyframe_interval",
    "stage_ms",
];

/// Runs the program in a folder.
fn dapple(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("dapple runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Runs the program, which must succeed in silence on stderr; returns its stdout.
fn succeeds(folder: &Path, line: &str) -> String {
    let output = dapple(folder, line);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{line}: {}",
        text(&output.stderr)
    );
    assert!(output.stderr.is_empty(), "{line}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn json(folder: &Path, line: &str) -> serde_json::Value {
    serde_json::from_str(&succeeds(folder, line)).expect("one JSON document")
}

/// Runs the program, which must say in one sentence on stderr what it does not like; the sentence
/// must contain all of `names`.
fn refuses(folder: &Path, line: &str, names: &[&str]) {
    let output = dapple(folder, line);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{line}: {stderr}");
    assert!(output.stdout.is_empty(), "{line}: {}", text(&output.stdout));
    assert!(
        stderr.starts_with("dapple: ") && stderr.lines().count() == 1,
        "{line}: {stderr}"
    );
    for name in names {
        assert!(
            stderr.contains(name),
            "{line}: '{stderr}' does not name {name}"
        );
    }
    assert!(!stderr.contains("panicked"), "{line}: {stderr}");
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn picture(folder: &Path, name: &str) -> Picture {
    Picture::read_png(&folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A box over a floor as a glTF file without cameras. The box moves up over one second where
/// `animated`.
fn write_box(path: &Path, animated: bool) {
    let mut positions: Vec<[f32; 3]> = Vec::new();
    let mut indices: Vec<u16> = Vec::new();
    let mut quad = |corners: [[f32; 3]; 4]| {
        let first = positions.len() as u16;
        positions.extend(corners);
        indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    };
    quad([
        [-2.0, 0.0, -2.0],
        [-2.0, 0.0, 2.0],
        [2.0, 0.0, 2.0],
        [2.0, 0.0, -2.0],
    ]);
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let corner = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                p[axis] = 0.5 * sign;
                p[(axis + 1) % 3] = 0.5 * u;
                p[(axis + 2) % 3] = 0.5 * v * sign;
                p
            };
            quad([
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ]);
        }
    }
    let mut bytes: Vec<u8> = positions
        .as_flattened()
        .iter()
        .flat_map(|f| f.to_le_bytes())
        .collect();
    let position_bytes = bytes.len();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    let keys = bytes.len();
    for f in [0.0f32, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(f.to_le_bytes());
    }
    let animations = match animated {
        true => serde_json::json!([{
            "samplers": [{"input": 3, "output": 4}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]
        }]),
        false => serde_json::json!([]),
    };
    let mut document = serde_json::json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "floor", "mesh": 0}, {"name": "box", "mesh": 1, "translation": [0.0, 0.5, 0.0]}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]},
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 2}]}
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": "box.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": position_bytes},
            {"buffer": 0, "byteOffset": position_bytes, "byteLength": keys - position_bytes},
            {"buffer": 0, "byteOffset": keys, "byteLength": 32}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": positions.len(),
             "min": [-2.0, -0.5, -2.0], "max": [2.0, 0.5, 2.0]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
            {"bufferView": 1, "byteOffset": 12, "componentType": 5123, "type": "SCALAR", "count": 36},
            {"bufferView": 2, "componentType": 5126, "type": "SCALAR", "count": 2, "min": [0.0], "max": [1.0]},
            {"bufferView": 2, "byteOffset": 8, "componentType": 5126, "type": "VEC3", "count": 2}
        ],
        "animations": animations
    });
    if !animated {
        // glTF allows no empty list.
        document
            .as_object_mut()
            .expect("an object")
            .remove("animations");
    }
    std::fs::write(path.with_file_name("box.bin"), bytes).expect("written");
    std::fs::write(path, document.to_string()).expect("written");
}

#[test]
fn demo_writes_stream_pictures_page_and_figures() {
    let folder = folder();
    let at = folder.path();
    let out = succeeds(
        at,
        "demo --out made/here --density 16 --rays 16 --frames 4 --size 96x54",
    );
    assert!(
        out.contains("PSNR") && out.contains("Mbit/s") && out.contains("drawn by"),
        "{out}"
    );
    let made = at.join("made/here");
    for name in [
        "points",
        "rtao",
        "points_ao",
        "rtao_ao",
        "difference",
        "no_ao",
    ] {
        let picture = picture(&made, &format!("{name}.png"));
        assert_eq!((picture.width, picture.height), (96, 54), "{name}");
    }
    let page = std::fs::read_to_string(made.join("index.html")).expect("a page");
    for name in [
        "points.png",
        "rtao.png",
        "difference.png",
        "PSNR",
        "FLIP",
        "Mbit/s",
    ] {
        assert!(page.contains(name), "the page has no {name}");
    }

    let report = std::fs::read(made.join("report.json")).expect("figures");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    // The figures of the stream stand at the top or under "stream".
    let stream = report.get("stream").unwrap_or(&report);
    for name in FIGURES {
        assert!(!stream[name].is_null(), "report.json has no {name}");
    }
    assert_eq!(
        (&stream["frames"], &stream["scene"]),
        (&4.into(), &"hall".into())
    );
    let psnr = report["picture"]["psnr"].as_f64().expect("PSNR");
    assert!((15.0..60.0).contains(&psnr), "{psnr} dB");
    assert!(
        report["picture"]["flip"]
            .as_f64()
            .is_some_and(|f| f > 0.0 && f < 0.5)
    );

    // What it scored is what it shows.
    let compared = json(&made, "compare points.png rtao.png --json");
    assert!(
        (compared["psnr"].as_f64().expect("PSNR") - psnr).abs() < 0.2,
        "{compared}"
    );
    let checked = json(&made, "validate stream.dapple --json");
    assert_eq!(checked, serde_json::json!({"valid": true, "frames": 4}));
    let bytes = std::fs::metadata(made.join("stream.dapple"))
        .expect("a stream")
        .len();
    let counted: u64 = ["bytes_startup", "bytes_steady", "bytes_keyframes"]
        .iter()
        .map(|name| stream[name].as_u64().unwrap_or(0))
        .sum();
    assert!(
        bytes > counted && bytes < counted + 100,
        "{bytes} in the file, {counted} in the report"
    );
}

#[test]
fn from_a_scene_to_a_compared_picture() {
    let folder = folder();
    let at = folder.path();
    let figures = json(
        at,
        "encode hall -o hall.dapple --density 16 --rays 16 --frames 8 --fps 30 --seed 5 \
         --keyframe-interval 3 --json",
    );
    for name in FIGURES {
        assert!(!figures[name].is_null(), "no {name} in {figures}");
    }
    assert_eq!(
        (&figures["seed"], &figures["fps"]),
        (&5.into(), &30.0.into())
    );
    assert!(!at.join("hall.dapple.part").exists());

    assert_eq!(json(at, "validate hall.dapple --json")["frames"], 8);
    let inspected = json(at, "inspect hall.dapple --json");
    assert_eq!(
        (&inspected["frames"], &inspected["keyframes"]),
        (&8.into(), &3.into())
    );
    assert_eq!(inspected["bytes_startup"], figures["bytes_startup"]);
    let dump = succeeds(at, "decode hall.dapple --dump");
    assert_eq!(dump.matches("\nframe ").count(), 8);
    assert!(dump.ends_with("\nend\n"));

    let view = "--scene hall --size 64x36 --frame 7 --fps 30 --backend cpu";
    let shown = succeeds(at, &format!("render hall.dapple {view} -o a.png"));
    assert!(shown.contains("stream frame 7"), "{shown}");
    succeeds(
        at,
        &format!("render --method rtao --rays 64 {view} -o rtao.png"),
    );
    succeeds(at, &format!("render --method none {view} -o none.png"));
    let psnr = |name: &str| {
        json(at, &format!("compare {name} rtao.png --json"))["psnr"]
            .as_f64()
            .expect("PSNR")
    };
    assert!(
        psnr("a.png") > psnr("none.png") + 1.0,
        "{} against {}",
        psnr("a.png"),
        psnr("none.png")
    );

    // The same bytes again, and the same picture.
    succeeds(
        at,
        "encode hall -o again.dapple --density 16 --rays 16 --frames 8 --fps 30 --seed 5 --keyframe-interval 3",
    );
    assert!(
        std::fs::read(at.join("hall.dapple")).ok() == std::fs::read(at.join("again.dapple")).ok()
    );
    succeeds(at, &format!("render again.dapple {view} -o b.png"));
    assert!(std::fs::read(at.join("a.png")).ok() == std::fs::read(at.join("b.png")).ok());
}

#[test]
fn the_client_shows_the_frame_that_has_arrived() {
    let folder = folder();
    let at = folder.path();
    write_box(&at.join("box.gltf"), true);
    succeeds(
        at,
        "encode box.gltf -o box.dapple --density 16 --rays 16 --frames 31",
    );
    // At 15 Hz frames 0, 4, 8 ... of 60 arrive; 100 ms are six frames.
    for (options, frame) in [
        ("--frame 20", 20),
        ("--frame 30", 30),
        ("--time 0.25", 15),
        ("--frame 23 --server-fps 15", 20),
        ("--frame 24 --server-fps 15", 24),
        ("--frame 20 --latency-ms 100", 14),
        ("--frame 20 --server-fps 15 --latency-ms 100", 12),
        ("--frame 3 --server-fps 15 --latency-ms 100", 0),
        ("--frame 29 --server-fps 5 --latency-ms 0", 24),
    ] {
        let line = format!(
            "render box.dapple --scene box.gltf --size 16x9 --backend cpu {options} -o a.png"
        );
        let shown = succeeds(at, &line);
        assert!(
            shown.contains(&format!("stream frame {frame},")),
            "{options}: {shown}"
        );
    }
    refuses(
        at,
        "render box.dapple --scene box.gltf -o a.png --frame 45",
        &["its last frame is 30 (0.500 s), before 45 (0.750 s)"],
    );
}

#[test]
fn a_stream_may_start_at_any_time() {
    let folder = folder();
    let at = folder.path();
    write_box(&at.join("box.gltf"), true);
    succeeds(
        at,
        "encode box.gltf -o box.dapple --density 16 --rays 16 --frames 5 --time 0.5",
    );
    // Between two ticks it starts at the nearer one.
    succeeds(
        at,
        "encode box.gltf -o between.dapple --density 16 --rays 16 --frames 5 --time 0.495",
    );
    assert!(
        std::fs::read(at.join("box.dapple")).ok() == std::fs::read(at.join("between.dapple")).ok()
    );
    for (frame, shown) in [(30, 0), (33, 3)] {
        let line = format!(
            "render box.dapple --scene box.gltf --size 16x9 --backend cpu --frame {frame} -o a.png"
        );
        let out = succeeds(at, &line);
        assert!(
            out.contains(&format!("stream frame {shown},")),
            "{frame}: {out}"
        );
    }
    let line = "render box.dapple --scene box.gltf --size 16x9 --backend cpu -o first.png";
    assert!(succeeds(at, line).contains("stream frame 0,"));
    let line = "render box.dapple --scene box.gltf --size 16x9 --backend cpu --frame 30 -o 30.png";
    succeeds(at, line);
    assert_eq!(picture(at, "first.png"), picture(at, "30.png"));
    refuses(
        at,
        "render box.dapple --scene box.gltf -o a.png --frame 0",
        &["its first frame is 30 (0.500 s), after 0 (0.000 s)"],
    );
}

#[test]
fn a_scene_without_cameras_is_framed_and_eye_and_target_override() {
    let folder = folder();
    let at = folder.path();
    write_box(&at.join("box.gltf"), false);
    // Nothing moves: one frame.
    let figures = json(
        at,
        "encode box.gltf -o box.dapple --density 64 --rays 32 --json",
    );
    assert_eq!(
        (&figures["frames"], &figures["scene"]),
        (&1.into(), &"box".into())
    );
    let render = |options: &str, name: &str| {
        let line = format!(
            "render box.dapple --scene box.gltf --size 64x36 --backend cpu {options} -o {name}"
        );
        succeeds(at, &line);
        picture(at, name)
    };
    let framed = render("", "framed.png");
    let different: std::collections::BTreeSet<_> = framed.rgb.iter().collect();
    assert!(
        different.len() > 50,
        "the picture is empty: {} colours",
        different.len()
    );
    // A floor from straight above fills the picture with one material; from below there is sky.
    let eye = render("--eye 0,1.6,0.01 --target 0,0,0", "eye.png");
    assert!(eye.rgb != framed.rgb);
    refuses(
        at,
        "render box.dapple --scene box.gltf --camera main -o a.png",
        &["box", "no cameras"],
    );
}

#[test]
fn bad_input_is_one_sentence_that_names_the_file() {
    let folder = folder();
    let at = folder.path();
    write_box(&at.join("box.gltf"), false);
    succeeds(at, "encode box.gltf -o box.dapple --density 16 --rays 16");
    let good = std::fs::read(at.join("box.dapple")).expect("a stream");
    let write = |name: &str, bytes: &[u8]| std::fs::write(at.join(name), bytes).expect("written");
    write("cut.dapple", &good[..good.len() / 2]);
    write("empty.dapple", b"");
    let mut bent = good.clone();
    bent[good.len() / 2] ^= 4;
    write("bent.dapple", &bent);
    write("text.dapple", b"this is no stream, and never was one");

    let render = |stream: &str, scene: &str| {
        format!("render {stream} --scene {scene} --size 16x9 --backend cpu -o a.png")
    };
    for stream in [
        "missing.dapple",
        "cut.dapple",
        "empty.dapple",
        "bent.dapple",
        "text.dapple",
        ".",
    ] {
        refuses(at, &render(stream, "box.gltf"), &[stream]);
    }
    // A stream of another scene.
    refuses(
        at,
        &render("box.dapple", "hall"),
        &["box.dapple", "another version of the scene"],
    );
    assert!(!at.join("a.png").exists());

    write("broken.gltf", b"{\"asset\": {\"version\": \"2.0\"}, ");
    write("empty.glb", b"");
    write("cut.glb", b"glTF\x02\0\0\0\xff\0\0\0");
    for scene in ["missing.glb", "broken.gltf", "empty.glb", "cut.glb", "."] {
        refuses(at, &format!("encode {scene} -o x.dapple"), &[scene]);
        refuses(at, &format!("demo {scene} --out x"), &[scene]);
        refuses(at, &render("box.dapple", scene), &[scene]);
    }
    let left: Vec<PathBuf> = std::fs::read_dir(at)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| {
            path.file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with('x'))
        })
        .collect();
    assert!(left.is_empty(), "left behind: {left:?}");
}

#[test]
fn where_nothing_can_be_written_it_says_so() {
    let folder = folder();
    let at = folder.path();
    write_box(&at.join("box.gltf"), false);
    let small = "--density 16 --rays 16 --size 16x9";
    // A file stands where the folder should go: nobody may write there, root neither.
    std::fs::write(at.join("taken"), b"").expect("written");
    refuses(
        at,
        &format!("demo box.gltf --out taken {small}"),
        &["taken"],
    );
    refuses(
        at,
        &format!("demo box.gltf --out taken/below {small}"),
        &["taken"],
    );
    refuses(
        at,
        "encode box.gltf -o taken/a.dapple --density 16 --rays 16",
        &["taken"],
    );
    refuses(
        at,
        "render --method none --scene box.gltf --size 16x9 --backend cpu -o taken/a.png",
        &["taken"],
    );
}

#[test]
fn bad_usage_exits_with_2() {
    let folder = folder();
    let at = folder.path();
    for line in [
        "demo --frames 0",
        "encode hall",
        "encode hall -o a.dapple --frames 0",
        "encode hall -o a.dapple --eye 1,2,3",
        "encode hall -o a.dapple --camera main --eye 1,2,3 --target 0,0,0",
        "encode hall -o a.dapple --frame 1 --time 1",
        "encode hall -o a.dapple --budget 0",
        "render a.dapple -o a.png",
        "render --scene hall -o a.png",
        "demo --model probes",
        "render a.dapple --scene hall --size 0x9 -o a.png",
    ] {
        let output = dapple(at, line);
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(
            output.stdout.is_empty() && !output.stderr.is_empty(),
            "{line}"
        );
    }
    assert_eq!(std::fs::read_dir(at).expect("a folder").count(), 0);
}

#[test]
fn a_chart_of_probes_has_tables_charts_pictures_and_a_page() {
    let folder = folder();
    let folder = folder.path();
    let chart = "chart hall --model probes --probes 3x2x3 --samples 16 --warm-up 2 --size 32x18 \
                 --reference 4 --parts 2 --frames 2 -o";
    let shown = succeeds(folder, &format!("{chart} a"));
    for method in [
        "direct light alone",
        "DDGI",
        "visibility-weighted, kept inside geometry",
        "raw, XOR, zstd 19",
    ] {
        assert!(shown.contains(method), "{shown} lacks {method}");
    }
    for file in [
        "table.csv",
        "parts.csv",
        "rates.csv",
        "size.svg",
        "time.svg",
        "lobe.csv",
        "ddgi.png",
        "reference.png",
        "disabled_trilinear.png",
        "denser_visibility-weighted.png",
        "index.html",
    ] {
        assert!(folder.join("a").join(file).exists(), "{file}");
    }
    // Again in another folder: all but times is the same.
    succeeds(folder, &format!("{chart} b"));
    for file in ["parts.csv", "rates.csv", "denser_visibility-weighted.png"] {
        let read = |run: &str| std::fs::read(folder.join(run).join(file)).expect("written");
        assert_eq!(read("a"), read("b"), "{file}");
    }
}
