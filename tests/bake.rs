//! `dapple bake` as a whole: copies of scenes with values, tasks and their merge, and what is refused.

use std::path::Path;
use std::process::{Command, Output};

/// A room's corner as a glTF file: a floor and a wall that share one mesh of four vertices, with normals.
fn corner() -> serde_json::Value {
    let mut data: Vec<u8> = Vec::new();
    let mut put = |values: &[f32]| data.extend(values.iter().flat_map(|f| f.to_le_bytes()));
    for [x, z] in [[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0]] {
        put(&[x, 0.0, z]);
    }
    for _ in 0..4 {
        put(&[0.0, 1.0, 0.0]);
    }
    data.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"name": "floor", "mesh": 0},
            // Turned about x, so that it faces along +z.
            {"name": "wall", "mesh": 0, "translation": [0, 2, 0], "rotation": [half, 0, 0, half],
             "extras": {"kept": 1.50}},
        ],
        "meshes": [{"name": "square", "primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 2}, "indices": 1}]}],
        "buffers": [{"byteLength": data.len(), "uri": "corner.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 12},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
             "min": [0, 0, 0], "max": [2, 0, 2]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
            {"bufferView": 2, "componentType": 5126, "type": "VEC3", "count": 4},
        ],
        "extras": {"bytes": data},
    })
}

/// Writes a scene of [`corner`]'s kind with its buffer.
fn write(folder: &Path, name: &str, document: &serde_json::Value) {
    let bytes: Vec<u8> =
        serde_json::from_value(document["extras"]["bytes"].clone()).expect("bytes");
    std::fs::write(folder.join("corner.bin"), bytes).expect("written");
    std::fs::write(folder.join(name), document.to_string()).expect("written");
}

/// A folder with the scene `a.gltf`.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.gltf", &corner());
    folder
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dapple"));
    command.args(line.split_whitespace()).current_dir(folder);
    command
}

/// Runs the program, which must succeed; returns what it prints.
pub fn runs(folder: &Path, line: &str) -> String {
    let Output {
        status,
        stdout,
        stderr,
    } = command(folder, line).output().expect("dapple runs");
    assert!(
        status.success(),
        "{line}: {}",
        String::from_utf8_lossy(&stderr)
    );
    String::from_utf8_lossy(&stdout).into_owned()
}

/// Runs the program, which must end with this code and one sentence that contains `names`.
pub fn refuses(folder: &Path, line: &str, code: i32, names: &str) {
    let output = command(folder, line).output().expect("dapple runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{line}: {stderr}");
    assert!(output.stdout.is_empty(), "{line}");
    assert!(stderr.contains(names), "{line}: {stderr}");
    if code == 1 {
        let errors = stderr.lines().filter(|line| !line.contains("warning: "));
        assert_eq!(errors.count(), 1, "{line}: {stderr}");
    }
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).expect("read")
}

const SMALL: &str = "--samples 16 --rays 64";

#[test]
fn both_kinds_of_files_have_the_same_values() {
    let folder = folder();
    let at = folder.path();
    for name in ["out/b.glb", "out/b.gltf"] {
        let text = runs(at, &format!("bake a.gltf --gltf {name} {SMALL} --json"));
        let figures: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(figures["vertices"], 8);
        assert_eq!(figures["gltf"]["mesh_copies"], 1);
    }
    let text = String::from_utf8(read(at, "out/b.gltf")).expect("text");
    assert!(text.contains(r#""kept":1.5"#));
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let buffer = read(at, "out/b.bin");
    assert_eq!(json["buffers"][0]["byteLength"], buffer.len());
    let glb = read(at, "out/b.glb");
    assert!(glb.windows(buffer.len()).any(|bytes| bytes == buffer));
    let values = |node: usize| -> Vec<u8> {
        let index = |value: &serde_json::Value| value.as_u64().expect("an index") as usize;
        let mesh = &json["meshes"][index(&json["nodes"][node]["mesh"])];
        let accessor = &json["accessors"][index(&mesh["primitives"][0]["attributes"]["_AO"])];
        let view = &json["bufferViews"][index(&accessor["bufferView"])];
        let start = index(&view["byteOffset"]);
        (0..4).map(|vertex| buffer[start + 4 * vertex]).collect()
    };
    // The corner's edge is at z = 0 of the floor, and at y = 0 of the wall, its vertices 1 and 2.
    let (floor, wall) = (values(0), values(1));
    for (inner, outer) in [
        (floor[0], floor[1]),
        (floor[3], floor[2]),
        (wall[1], wall[0]),
    ] {
        assert!(inner < outer, "{floor:?} {wall:?}");
    }
}

#[test]
fn merged_tasks_equal_a_single_run() {
    let folder = folder();
    let at = folder.path();
    // Many items: 2 instances of 2 faces of up to 5000 samples.
    let quality = "--samples 100000 --face-samples 5000 --rays 2";
    runs(
        at,
        &format!("bake a.gltf --gltf whole.glb -o whole.dapple {quality}"),
    );
    let whole = read(at, "whole.glb");
    for tasks in [1, 3, 16] {
        for task in 1..=tasks {
            let line = format!("bake a.gltf --task {task}/{tasks} --parts p{tasks} {quality}");
            runs(at, &line);
            let again = runs(at, &format!("{line} --resume"));
            assert!(again.contains("is done"), "{again}");
        }
        runs(
            at,
            &format!("bake a.gltf --merge p{tasks} --gltf merged.glb -o merged.dapple {quality}"),
        );
        assert!(read(at, "merged.glb") == whole, "{tasks} tasks");
        assert!(read(at, "merged.dapple") == read(at, "whole.dapple"));
    }
    // From a job array, as the single parts, and twice.
    let mut slurm = command(at, &format!("bake a.gltf --task slurm --parts s {quality}"));
    slurm
        .env("SLURM_ARRAY_TASK_ID", "2")
        .env("SLURM_ARRAY_TASK_COUNT", "3");
    slurm.env("SLURM_ARRAY_TASK_MIN", "0");
    assert!(slurm.output().expect("dapple runs").status.success());
    let parts = |folder: &str| -> Vec<String> {
        let entries = std::fs::read_dir(at.join(folder)).expect("a folder");
        let paths = entries.map(|e| e.expect("an entry").path());
        let mut paths: Vec<String> = paths.map(|p| p.to_string_lossy().into_owned()).collect();
        paths.sort();
        paths
    };
    assert_eq!(
        std::fs::read(&parts("s")[0]).ok(),
        std::fs::read(&parts("p3")[2]).ok()
    );
    let all = [parts("p3"), parts("s"), parts("p1")].concat().join(" ");
    runs(
        at,
        &format!("bake a.gltf --gltf merged.glb {quality} --merge {all}"),
    );
    assert!(read(at, "merged.glb") == whole);

    let merge = |line: &str| format!("bake a.gltf --gltf merged.glb {line}");
    let some = &parts("p3")[..2].join(" ");
    refuses(
        at,
        &merge(&format!("{quality} --merge {some}")),
        1,
        "parts are missing",
    );
    refuses(
        at,
        &merge(&format!("{quality} --seed 1 --merge {some}")),
        2,
        "--seed",
    );
    refuses(at, &merge("--rays 3 --merge p3"), 1, "other settings");
    refuses(
        at,
        &merge(&format!("{quality} --merge a.gltf")),
        1,
        "not a part",
    );
    refuses(at, &merge(&format!("{quality} --merge gone")), 1, "gone");
    refuses(at, &merge(&format!("{quality} --merge .")), 1, "no parts");
    let first = &parts("p1")[0];
    let bytes = std::fs::read(first).expect("a part");
    std::fs::write(first, &bytes[..bytes.len() / 2]).expect("written");
    refuses(at, &merge(&format!("{quality} --merge p1")), 1, "cut short");
    // A part that was cut short is made anew.
    let line = format!("bake a.gltf --task 1/1 --parts p1 {quality} --resume");
    assert!(!runs(at, &line).contains("is done"));
    assert_eq!(std::fs::read(first).expect("a part"), bytes);
    let mut document = corner();
    document["nodes"][0]["translation"] = serde_json::json!([0, 0.5, 0]);
    write(at, "a.gltf", &document);
    refuses(
        at,
        &merge(&format!("{quality} --merge p3")),
        1,
        "another scene",
    );
}

/// A baked stream is drawn by its own method, wherever its values come from.
#[test]
fn baked_streams_are_drawn() {
    let folder = folder();
    let at = folder.path();
    for (options, source) in [
        ("", "lit at vertices 100.0 %"),
        ("--tolerance 1", "by instance 100.0 %"),
    ] {
        runs(at, &format!("bake a.gltf -o b.dapple {SMALL} {options}"));
        let drawn = "render b.dapple --scene a.gltf --size 64x36 --backend cpu -o b.png";
        let text = runs(at, drawn);
        assert!(text.contains(source), "{text}");
    }
}

/// Where no rung is within the tolerance, points take the instance over, and a picture mixes them with the rest.
#[test]
fn escalated_instances_are_drawn_by_points() {
    let folder = folder();
    let at = folder.path();
    // A third square, far from the corner, which one number describes.
    let mut document = corner();
    let far = serde_json::json!({"name": "far", "mesh": 0, "translation": [4, 0, 0]});
    document["nodes"].as_array_mut().expect("nodes").push(far);
    document["scenes"][0]["nodes"] = serde_json::json!([0, 1, 2]);
    write(at, "a.gltf", &document);
    let bake = format!("bake a.gltf -o b.dapple {SMALL} --ao 1 --tolerance 0.01 --json");
    let parse = |text: String| -> serde_json::Value { serde_json::from_str(&text).expect("JSON") };
    let without = parse(runs(at, &bake));
    assert_eq!(without["points"], serde_json::json!([]));
    let figures = parse(runs(at, &format!("{bake} --escalate points")));
    let points = figures["points"].as_array().expect("a list");
    assert!(!points.is_empty(), "{figures}");
    for it in points {
        let number = |name: &str| it[name].as_f64().expect(name);
        assert!(number("error") < number("error_before"), "{it}");
        assert!(number("points") > 0.0 && number("density") > 0.0, "{it}");
    }
    let error = |figures: &serde_json::Value| {
        let chosen = &figures["stream"]["alternatives"]["chosen"];
        chosen["error"].as_f64().expect("an error")
    };
    assert!(error(&figures) < error(&without), "{figures} {without}");
    runs(at, "validate b.dapple");
    runs(at, "inspect b.dapple");
    let drawn = "render b.dapple --scene a.gltf --size 64x36 --backend cpu --ao-only -o";
    let text = runs(at, &format!("{drawn} mixed.png"));
    assert!(
        text.contains("by points ") && !text.contains("by points 100.0"),
        "{text}"
    );
    assert!(text.contains("not baked 0.0 %"), "{text}");
    runs(at, &format!("{drawn} points.png --method points"));
    refuses(
        at,
        "bake a.gltf -o c.dapple --escalate points",
        2,
        "--tolerance",
    );
}

#[test]
fn chart_of_baked_obscurance_has_tables_charts_pictures_and_a_page() {
    let folder = folder();
    let at = folder.path();
    let chart = "chart hall --baked --size 32x18 --points 200 --rays 8 --reference 64 -o";
    let shown = runs(at, &format!("{chart} a"));
    assert!(shown.contains("index.html"), "{shown}");
    for file in [
        "table.csv",
        "table.md",
        "vertices.svg",
        "rungs.csv",
        "regions.csv",
        "time.svg",
        "reference.png",
        "least_squares.png",
        "index.html",
    ] {
        assert!(at.join("a").join(file).exists(), "{file}");
    }
    let rows: serde_json::Value = serde_json::from_slice(&read(at, "a/report.json")).expect("JSON");
    let rows = rows.as_array().expect("rows");
    let get = |method: &str, setting: &str, figure: &str| -> f64 {
        let row = rows
            .iter()
            .find(|row| row["method"] == method && row["setting"] == setting);
        let row = row.unwrap_or_else(|| panic!("{method}, {setting}"));
        row[figure].as_f64().expect("a number")
    };
    let (fit, instances) = (
        "least squares, 8 bits",
        "local values, times an instance's function",
    );
    assert!(get(fit, "16", "rmse") < get("AO = 1", "", "rmse"));
    assert!(get(fit, "16", "rmse") < get(fit, "1", "rmse"));
    assert!(get("least squares, 5 bits", "16", "bytes") < get(fit, "16", "bytes"));
    assert!(get(instances, "linear", "rmse") < get(instances, "none", "rmse"));
    assert!(get("one rung for all", "scalar", "bytes") < get("by tolerance", "0.025", "bytes"));
    assert!(
        get("regions, degree 1", "constant", "bytes")
            < get("regions, degree 1", "six derivatives", "bytes")
    );
    // Again in another folder: all but times is the same.
    runs(at, &format!("{chart} b"));
    for file in ["vertices.csv", "rungs.csv", "regions.svg", "regions.png"] {
        assert_eq!(
            read(at, &format!("a/{file}")),
            read(at, &format!("b/{file}")),
            "{file}"
        );
    }
}

#[test]
fn bad_arguments_and_scenes_are_refused_in_a_sentence() {
    let folder = folder();
    let at = folder.path();
    for (line, code, names) in [
        ("bake a.gltf", 2, "name an output"),
        ("bake gone.glb --gltf b.glb", 1, "gone.glb"),
        ("bake a.gltf --gltf b.png", 2, ".glb"),
        ("bake a.gltf --gltf -", 2, ".glb"),
        ("bake a.gltf --gltf a.gltf", 2, "input"),
        ("bake a.gltf --gltf corner.gltf", 2, "input"),
        ("bake a.gltf --gltf a.gltf/b.glb", 1, "a.gltf"),
        ("bake hall --gltf b.glb", 2, "built-in"),
        (
            "bake a.gltf --gltf b.glb --distances 300,2",
            2,
            "--distances",
        ),
        (
            "bake a.gltf --gltf b.glb --distances 1,2,3",
            2,
            "--distances",
        ),
        (
            "bake a.gltf --gltf b.glb --separate --ao 1",
            2,
            "--separate",
        ),
        ("bake a.gltf --gltf b.glb --remap 0:0,0:1", 2, "knots"),
        ("bake a.gltf --gltf b.glb --blend 2", 2, "--blend"),
        ("bake a.gltf --gltf b.glb --rays 0", 2, "--rays"),
        ("bake a.gltf --gltf b.glb --alpha=-1", 2, "--alpha"),
        ("bake a.gltf -o b.dapple --tolerance 2", 2, "--tolerance"),
        (
            "bake a.gltf -o b.dapple --regions gone.json",
            1,
            "gone.json",
        ),
        ("bake a.gltf -o b.dapple --regions a.gltf", 1, "a.gltf"),
        (
            "bake a.gltf -o b.dapple --regions --remap 0:0.1,1:1",
            2,
            "--remap",
        ),
        ("bake a.gltf --task 9/8 --parts p", 2, "1 to 8"),
        ("bake a.gltf --task 1/8", 2, "--parts"),
        ("bake a.gltf --task slurm --parts p", 2, "job array"),
        ("bake a.gltf --task 1/2 --parts a.gltf", 1, "a.gltf"),
    ] {
        refuses(at, line, code, names);
    }
    let no_faces = |d: &mut serde_json::Value| d["accessors"][1]["count"] = 0.into();
    let no_area = |d: &mut serde_json::Value| {
        let bytes = d["extras"]["bytes"].as_array_mut().expect("bytes");
        bytes[..48].fill(0.into());
    };
    let not_a_number = |d: &mut serde_json::Value| {
        let bytes = d["extras"]["bytes"].as_array_mut().expect("bytes");
        bytes[..48].fill(255.into());
    };
    let see_through = |d: &mut serde_json::Value| {
        d["materials"] = serde_json::json!([{"alphaMode": "BLEND",
            "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}]);
        d["meshes"][0]["primitives"][0]["material"] = 0.into();
    };
    let flat = |d: &mut serde_json::Value| {
        for node in 0..2 {
            d["nodes"][node]["scale"] = serde_json::json!([1, 1, 0]);
        }
    };
    type Change<'a> = &'a dyn Fn(&mut serde_json::Value);
    for (change, names) in [
        (&no_faces as Change, "no triangles"),
        (&no_area, "no triangles"),
        (&not_a_number, "not finite"),
        (&see_through, "see-through"),
        (&flat, "no area"),
    ] {
        let mut document = corner();
        change(&mut document);
        write(at, "bad.gltf", &document);
        refuses(
            at,
            "bake bad.gltf --gltf b.glb --samples 1 --rays 1",
            1,
            names,
        );
        assert!(!at.join("b.glb").exists());
    }
    assert_eq!(read(at, "a.gltf"), corner().to_string().into_bytes());
}

/// A mesh without area beside another one costs nothing but a warning.
#[test]
fn meshes_without_area_stay_open() {
    let folder = folder();
    let at = folder.path();
    let mut document = corner();
    document["nodes"][1]["scale"] = serde_json::json!([0, 0, 1]);
    write(at, "b.gltf", &document);
    let output = command(at, &format!("bake b.gltf --gltf out.glb {SMALL}")).output();
    let output = output.expect("dapple runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("wall is see-through or has no area"),
        "{stderr}"
    );
}

#[test]
fn reports_have_pictures_and_figures() {
    let folder = folder();
    let at = folder.path();
    runs(at, &format!("bake a.gltf --report r --size 32x18 {SMALL}"));
    for name in ["vertices_ao.png", "without_and_with.png"] {
        let picture = image_size(&read(at, &format!("r/{name}")));
        assert_eq!(picture, (32, 18), "{name}");
    }
    let figures: serde_json::Value =
        serde_json::from_slice(&read(at, "r/report.json")).expect("JSON");
    assert_eq!(figures["instances"], 2);
    // Parts of obscurance are there where instances share local values alone.
    assert!(!at.join("r/local_ao.png").exists());
    let shared = format!("bake a.gltf --report s --size 32x18 --instances {SMALL}");
    runs(at, &shared);
    for name in ["local_ao.png", "global_ao.png", "traced_ao.png"] {
        assert_eq!(image_size(&read(at, &format!("s/{name}"))), (32, 18));
    }
    let page = String::from_utf8(read(at, "r/index.html")).expect("text");
    for text in ["floor", "wall", "vertices_ao.png"] {
        assert!(page.contains(text), "{text}");
    }
}

/// Width and height of a PNG.
fn image_size(png: &[u8]) -> (u32, u32) {
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
    assert!(png.starts_with(b"\x89PNG"));
    (number(16), number(20))
}

#[test]
fn streams_are_valid_and_go_to_standard_output() {
    let folder = folder();
    let at = folder.path();
    for line in ["", "--bits 5 --separate", "--ao 1 --compression lz4"] {
        let line = format!("bake a.gltf {SMALL} {line}");
        runs(at, &format!("{line} -o s/a.dapple"));
        runs(at, "validate s/a.dapple");
        let output = command(at, &format!("{line} -o -"))
            .output()
            .expect("dapple runs");
        assert!(output.status.success());
        assert!(output.stdout == read(at, "s/a.dapple"), "{line}");
    }
    refuses(at, "bake a.gltf -o - --json", 2, "--json");
    refuses(at, "bake a.gltf -o a.gltf", 2, "input");
    refuses(at, "bake a.gltf -o b.dapple --bits 6", 2, "--bits");
    let limited = "bake a.gltf -o b.dapple --samples 1 --rays 1 --max-tracks 1";
    refuses(at, limited, 1, "limit tracks");
    assert!(!at.join("b.dapple").exists());
}

/// Half of what stands behind a tree is seen through it.
#[test]
fn foliage_attenuates_where_it_is_asked_for() {
    let folder = folder();
    let at = folder.path();
    let mean = |options: &str| -> f64 {
        let line = format!("bake a.gltf -o a.dapple {SMALL} --json {options}");
        let figures: serde_json::Value = serde_json::from_str(&runs(at, &line)).expect("JSON");
        assert_eq!(
            figures["foliage"].as_array().map_or(0, Vec::len),
            usize::from(!options.is_empty())
        );
        figures["mean"].as_f64().expect("a number")
    };
    let (solid, tree) = (mean(""), mean("--foliage --trees square"));
    assert!(tree > solid + 0.05, "{solid} {tree}");
}
