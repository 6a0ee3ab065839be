//! Scenes made to fail: what must hold in a taste of each, and the command that writes them all.

use dapple::measure::stress::{CASES, Effort, Finding};
use std::process::Command;

fn run(name: &str) -> Finding {
    let finding = run_without_pictures(name);
    assert!(!finding.pictures.is_empty());
    finding
}

fn run_without_pictures(name: &str) -> Finding {
    let case = CASES.iter().find(|c| c.name == name).expect("a case");
    let finding = (case.run)(Effort::Quick).expect("a finding");
    for row in &finding.rows {
        println!("{name}, {}: {} = {}", row.at, row.figure, row.value);
        assert_ne!(row.holds(), Some(false), "{row:?}");
    }
    finding
}

fn value(finding: &Finding, at: &str, figure: &str) -> f64 {
    let value = finding.value(at, figure);
    value.unwrap_or_else(|| panic!("no {figure} at {at}"))
}

#[test]
fn a_sealed_room_stays_dark_and_presence_alone_does_not_do_it() {
    let found = run("sealed-room");
    assert!(value(&found, "0.2", "presence alone, worst") > 0.1);
    assert!(value(&found, "0.2", "trilinear, worst") > 0.1);
    assert!(value(&found, "0.2", "visibility-weighted, worst") <= 0.01);
    assert!(value(&found, "0.2", "visibility-weighted along walls, worst") <= 0.01);
    // Not by making all dark.
    let bright = value(&found, "0.2", "bright room, visibility-weighted");
    assert!((0.8..1.25).contains(&bright), "{bright}");
}

/// At every frame, keyframes and deltas, and where probes lie in the faces of walls.
#[test]
fn a_sealed_house_stays_dark_at_every_frame() {
    let found = run("sealed-house");
    for at in ["lamp, 0.75", "sky, 0", "sky, 0.25"] {
        // Probes that lie in the faces of walls have no light of the other side at all.
        let trilinear = value(&found, at, "trilinear, worst");
        assert!(trilinear > 0.2 || at == "sky, 0", "{trilinear}");
        assert!(value(&found, at, "visibility-weighted, worst") <= 0.01);
        assert!(value(&found, at, "visibility-weighted along walls, worst") <= 0.01);
        let bright = value(&found, at, "bright side, visibility-weighted");
        assert!((0.7..1.3).contains(&bright), "{bright}");
    }
}

#[test]
fn a_small_lamp_rings_and_dering_lifts_it() {
    let found = run("ringing");
    for at in ["2", "0.25"] {
        assert!(value(&found, at, "least, plain") < -0.02);
        assert!(value(&found, at, "least, dering") >= -1e-5);
        // What is cut off was wrong; no negative light is right.
        let plain = value(&found, at, "error, plain");
        assert!(value(&found, at, "error, cut off") <= plain);
    }
    let noise = |at| value(&found, at, "noise, 256 rays, 25 frames");
    assert!(noise("0.25") > 3.0 * noise("2"));
}

#[test]
fn light_goes_out_as_fast_as_hysteresis_says() {
    let found = run("lag");
    for (at, a) in [("fixed 0.8", 0.8f64), ("fixed 0.95", 0.95)] {
        for (figure, share) in [("frames to 10 %", 0.1f64), ("frames to 1 %", 0.01)] {
            let frames = value(&found, at, figure);
            let exact = share.ln() / a.ln();
            assert!((frames - exact).abs() <= 1.1, "{at}: {frames} for {exact}");
        }
        let ghost = value(&found, at, "ghost");
        assert!((ghost / a.powi(30) - 1.0).abs() < 0.01, "{at}: {ghost}");
    }
    assert!(value(&found, "adaptive 0.99", "frames to 1 %") <= 4.0);
}

#[test]
fn flicker_falls_with_rays_and_hysteresis() {
    let found = run("flicker");
    let flicker = |at| value(&found, at, "flicker, server");
    // The root of 16, and (1 - a) sqrt(2 / (1 + a)) of both: 4 and 21.
    let rays = flicker("16, fixed 0.99") / flicker("256, fixed 0.99");
    let share = flicker("256, fixed 0.8") / flicker("256, fixed 0.99");
    assert!((2.0..9.0).contains(&rays), "{rays}");
    assert!((12.0..35.0).contains(&share), "{share}");
    let bytes = |at| value(&found, at, "coded bytes a probe and frame");
    assert!(bytes("256, fixed 0.8") > bytes("256, fixed 0.99"));
}

#[test]
fn probes_in_a_wall_are_left_out() {
    let found = run("probes-in-walls");
    assert!(value(&found, "0.3", "both") < 0.6 * value(&found, "0.3", "neither"));
    assert!(value(&found, "0.3", "trilinear, filled") < value(&found, "0.3", "trilinear, neither"));
    assert!(value(&found, "0.3", "probes disabled") >= 12.0);
}

#[test]
fn a_sun_of_any_brightness_comes_through() {
    let found = run("bright-sun");
    assert_eq!(value(&found, "1", "exponent"), 0.0);
    assert!(value(&found, "1e5", "error, raw, exponent 0") > 0.01);
    assert!(value(&found, "1e6", "error, raw, exponent 0") > 0.5);
    for at in ["1", "1e5", "1e6"] {
        assert!(value(&found, at, "error, raw") < 1e-3);
        assert!(value(&found, at, "leak, worst") < 0.01);
    }
}

#[test]
fn outside_of_the_volume_light_is_finite_steady_and_wrong() {
    let found = run("outside");
    for way in ["trilinear", "visibility-weighted"] {
        let error = |at| value(&found, at, &format!("error, {way}"));
        assert!(error("-1") < 0.2 && error("-1") < error("1") && error("1") < error("4"));
        assert!(value(&found, "border", &format!("step, {way}")) < 0.01);
        assert_eq!(
            value(&found, "1000 to infinity", &format!("finite, {way}")),
            1.0
        );
    }
}

#[test]
fn least_squares_beats_vertices_on_a_floor_that_boxes_pierce() {
    let found = run_without_pictures("vertices-inside-geometry");
    let inside = |at| value(&found, at, "vertices inside (share)");
    // 1, 9, 25 or 49 vertices a box.
    assert!((inside("1.2") - 36.0 / 289.0).abs() < 1e-9);
    assert!((inside("3.2") - 196.0 / 289.0).abs() < 1e-9);
    for at in ["1.2", "2.2", "3.2"] {
        let error = value(&found, at, "error, least squares");
        assert!(error > 0.0 && error < 0.3, "{error}");
    }
}

#[test]
fn a_huge_triangle_takes_the_vertices_of_its_small_neighbours() {
    let found = run_without_pictures("huge-triangle");
    let error = |at| value(&found, at, "error, small faces at the long ones");
    assert!(error("64") > 2.0 * error("0.25"));
    assert_eq!(value(&found, "64", "outside of 0 to 1, with bounds"), 0.0);
}

#[test]
fn a_flat_object_has_no_slope_across() {
    let found = run_without_pictures("flat-object");
    for (at, axes) in [
        ("plane, 0.3, 192", 3.0),
        ("plane, 0.0001, 192", 2.0),
        ("line, 0.01, 192", 1.0),
        ("point, 0.01, 192", 0.0),
    ] {
        assert_eq!(value(&found, at, "axes"), axes, "{at}");
        assert!(value(&found, at, "error, scalar") <= value(&found, at, "error, 1"));
    }
    let gain = |at| value(&found, at, "error, linear") / value(&found, at, "error, scalar");
    assert!(gain("plane, 0.3, 192") < 0.8);
    assert!((gain("point, 0.0001, 192") - 1.0).abs() < 1e-3);
}

#[test]
fn a_large_beta_closes_the_step_at_a_door_and_costs_the_rooms() {
    let found = run_without_pictures("region-boundary");
    let step = |at| value(&found, at, "step, rms");
    assert!(step("100") < step("0.3") && step("0.3") < step("0"));
    let error = |at| value(&found, at, "error, room");
    assert!(error("100") > error("0"));
}

#[test]
fn the_command_writes_tables_and_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args([
            "stability",
            "--quick",
            "--json",
            "--case",
            "outside",
            "--case",
            "lag",
            "-o",
        ])
        .arg(folder.path())
        .output()
        .expect("dapple runs");
    assert!(output.status.success());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
    let names: Vec<_> = json
        .as_array()
        .expect("cases")
        .iter()
        .map(|c| &c["case"])
        .collect();
    assert_eq!(names, ["lag", "outside"], "in the order of the table");
    assert!(
        json[1]["rows"]
            .as_array()
            .is_some_and(|rows| rows.len() > 5)
    );
    for file in [
        "table.md",
        "table.csv",
        "index.html",
        "report.json",
        "lag.png",
        "outside.png",
    ] {
        let size = std::fs::metadata(folder.path().join(file)).map(|m| m.len());
        assert!(size.is_ok_and(|s| s > 100), "{file}");
    }
    let csv = std::fs::read_to_string(folder.path().join("table.csv")).expect("a table");
    assert!(csv.starts_with("case,parameter,setting,figure,value,bound,holds\n"));
    let nothing = Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(["stability", "--case", "nonsense"])
        .output()
        .expect("dapple runs");
    assert_eq!(nothing.status.code(), Some(2));
}

#[test]
fn light_without_a_visibility_block_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let dapple = |line: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_dapple"))
            .args(line.split_whitespace())
            .current_dir(folder.path())
            .output()
            .expect("dapple runs");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let encode = "encode hall --model probes --probes 2x2x2 --samples 4 --warm-up 0 --frames 1";
    dapple(&format!("{encode} --visibility-side 0 -o without.dapple"));
    dapple(&format!("{encode} -o with.dapple"));
    let render = |stream: &str, how: &str| {
        let how = format!("--method probes --interpolation {how}");
        dapple(&format!(
            "render {stream}.dapple --scene hall {how} --size 16x9 -o a.png"
        ))
    };
    let told = render("without", "visibility-weighted");
    assert!(told.contains("no visibility block"), "{told}");
    assert!(!render("without", "trilinear").contains("warning"));
    assert!(!render("with", "visibility-weighted").contains("warning"));
}
