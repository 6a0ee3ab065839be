//! `inspect`, `validate` and `decode` on streams, whole and broken.

mod encoding;
#[cfg(target_os = "linux")]
mod memory;
mod reading;
mod server;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dapple::codec::container::{HEADER_BYTES, PREAMBLE_BYTES, RecordHeader};
use dapple::codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
use dapple::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, Target, Track, Transform,
};
use server::Server;

fn dapple(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(arguments)
        .output()
        .expect("dapple runs")
}

fn run(command: &str, file: &Path, options: &[&str]) -> Output {
    dapple(&[&[command, file.to_str().expect("UTF-8 path")], options].concat())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

fn grid(widths: PointWidths) -> Grid {
    Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims: [4, 4, 4],
        cell_edge: 0.5,
        radius: 0.25,
        widths,
        bucket_count: 7,
        cell_capacity: 8,
        coding: Coding::Cells,
    }
}

/// A cell with `count` points, and the bucket that it belongs to.
fn cell(grid: &Grid, at: [u32; 3], count: usize, ao: f32) -> (u32, Cell) {
    let point = grid.widths.pack([0.5, 0.25, 0.75], [0.0, 1.0, 0.0], ao);
    let points = std::array::from_fn(|i| if i < count { point } else { 0 });
    (
        grid.bucket(at),
        Cell {
            key: grid.key(at),
            points,
        },
    )
}

/// Three frames at 60 Hz, one keyframe: two tracks, the second with a transform; the second frame
/// changes a cell, the third nothing. Content lies in the cells from `first` on. Returns the bytes
/// and where each commit ends.
fn stream(compression: Compression, first: u32) -> (Vec<u8>, Vec<usize>) {
    let track = |id: u32, path: &str, space, widths| Track {
        id,
        target: Target {
            path: path.to_string(),
            ..Target::default()
        },
        aabb_min: [0.0; 3],
        aabb_max: [2.0; 3],
        space,
        model: Model::Points(grid(widths)),
    };
    let tracks = [
        track(
            1,
            "hall/floor \"a\"",
            LookupSpace::Mesh,
            PointWidths::BITS_32,
        ),
        track(5, "walker", LookupSpace::Rest, PointWidths::BITS_16),
    ];
    let rows = [
        [1.0, 0.0, 0.0, 3.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];
    let entries = |used: &[u32]| {
        Bucket(std::array::from_fn(|i| {
            used.get(i).map_or(EMPTY, |&entry| entry)
        }))
    };

    let mut bytes = Vec::new();
    let mut commits = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("encoder");
    encoder
        .group(&mut bytes, GroupStart::Keyframes)
        .expect("group");
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let transform = (
        5,
        Transform {
            world_from_grid: rows,
        },
    );
    encoder
        .transforms(&mut bytes, &[transform], compression)
        .expect("transforms");
    let (bucket, a) = cell(tracks[0].grid().unwrap(), [1, 2, 3], 7, 0.5);
    let (_, b) = cell(tracks[0].grid().unwrap(), [1, 2, 3], 2, 1.0);
    let (other, c) = cell(tracks[1].grid().unwrap(), [0, 0, 1], 3, 0.25);
    let updates = [
        Update {
            track: 1,
            bucket_indices: &[bucket],
            buckets: &[entries(&[first, first + 1])],
            cell_indices: &[first, first + 1],
            cells: &[a, b],
        },
        Update {
            track: 5,
            bucket_indices: &[other],
            buckets: &[entries(&[first])],
            cell_indices: &[first],
            cells: &[c],
        },
    ];
    encoder
        .points(&mut bytes, Coverage::Keyframe, &updates, compression)
        .expect("points");
    encoder.commit(&mut bytes, 10, None).expect("commit");
    commits.push(bytes.len());

    let (_, a) = cell(tracks[0].grid().unwrap(), [1, 2, 3], 6, 0.75);
    let update = Update {
        track: 1,
        bucket_indices: &[],
        buckets: &[],
        cell_indices: &[first],
        cells: &[a],
    };
    encoder
        .points(&mut bytes, Coverage::Delta, &[update], compression)
        .expect("points");
    encoder.commit(&mut bytes, 11, None).expect("commit");
    commits.push(bytes.len());
    encoder.commit(&mut bytes, 12, None).expect("commit");
    commits.push(bytes.len());
    encoder.end(&mut bytes).expect("end");
    (bytes, commits)
}

fn file(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join("a.dapple");
    std::fs::write(&path, bytes).expect("written");
    path
}

#[test]
fn inspect_counts_what_the_encoder_wrote() {
    let folder = tempfile::tempdir().expect("folder");
    let (bytes, commits) = stream(Compression::Lz4, 0);
    let path = file(&folder, &bytes);
    let report = json(&run("inspect", &path, &["--json"]));
    assert_eq!(report["bytes"], bytes.len());
    assert_eq!(report["tick_rate"], serde_json::json!([60, 1]));
    assert_eq!(
        (&report["frames"], &report["keyframes"]),
        (&3.into(), &1.into())
    );
    assert_eq!(report["bytes_startup"], commits[0]);
    assert_eq!(report["bytes_steady"], commits[2] - commits[0]);
    // Two frames of 1/60 s each.
    let rate = (commits[2] - commits[0]) as f64 * 8.0 * 30.0 / 1e6;
    for name in ["mbps_steady", "mbps_with_keyframes"] {
        assert!(
            (report[name].as_f64().expect("rate") - rate).abs() < 1e-9,
            "{name}"
        );
    }
    let tracks = report["tracks"].as_array().expect("tracks");
    let of = |name: &str| tracks.iter().map(|t| t[name].clone()).collect::<Vec<_>>();
    assert_eq!(of("id"), [1, 5]);
    assert_eq!(of("cells"), [2, 1]);
    assert_eq!(of("points"), [8, 3]);
    assert_eq!(of("space"), ["mesh", "rest"]);
    assert_eq!(
        (&report["ended"], &report["fault"]),
        (&true.into(), &serde_json::Value::Null)
    );
    let records = report["records"].as_array().expect("records");
    let points = records
        .iter()
        .find(|r| r["name"] == "points")
        .expect("points records");
    assert_eq!(points["records"], 2);
    // Headers, preamble and payloads make up the file.
    let sum = |name: &str| {
        records
            .iter()
            .map(|r| r[name].as_u64().expect("count"))
            .sum::<u64>()
    };
    assert_eq!(
        16 + 32 * sum("records") + sum("stored_bytes"),
        bytes.len() as u64
    );

    let shown = run("inspect", &path, &[]);
    assert_eq!(shown.status.code(), Some(0));
    let shown = text(&shown.stdout);
    assert!(
        shown.contains("60 ticks a second") && shown.contains("walker"),
        "{shown}"
    );
}

#[test]
fn inspect_lists_keyframes_and_bins_of_bytes_per_frame() {
    let folder = tempfile::tempdir().expect("folder");
    let mut server = Server::new();
    let mut ends = vec![0];
    // Keyframes 20 frames apart, then one after 10.
    let is_keyframe = |frame: u64| frame.is_multiple_of(20) || frame == 90;
    for frame in 0..100 {
        server.frame(frame, is_keyframe(frame), 1 + frame as u32 % 7);
        ends.push(server.bytes.len() as u64);
    }
    let mut bytes = server.bytes;
    server.encoder.end(&mut bytes).expect("end");
    let path = file(&folder, &bytes);
    let report = json(&run("inspect", &path, &["--json"]));

    let sizes: Vec<u64> = ends.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let number = |value: &serde_json::Value| value.as_u64().expect("a number");
    let listed: Vec<(u64, u64)> = report["keyframe_list"]
        .as_array()
        .expect("keyframes")
        .iter()
        .map(|keyframe| (number(&keyframe["frame"]), number(&keyframe["bytes"])))
        .collect();
    let expected: Vec<(u64, u64)> = (0..100)
        .filter(|&frame| is_keyframe(frame))
        .map(|frame| (frame, sizes[frame as usize]))
        .collect();
    assert_eq!(listed, expected);
    assert_eq!(
        report["keyframe_interval"],
        serde_json::json!({"shortest": 10, "longest": 20})
    );
    // Every byte belongs to one kind of frame.
    let kinds = ["startup", "keyframes", "steady", "after"];
    let sum: u64 = kinds
        .iter()
        .map(|kind| number(&report[format!("bytes_{kind}")]))
        .sum();
    assert_eq!(sum, bytes.len() as u64);
    assert_eq!(
        number(&report["bytes_after"]),
        bytes.len() as u64 - ends[100]
    );
    // More frames than bins.
    let line = &report["bytes_per_frame"];
    assert_eq!(line["frames_per_bin"], 2);
    let bins: Vec<u64> = line["bins"]
        .as_array()
        .expect("bins")
        .iter()
        .map(|bin| number(&bin["bytes"]))
        .collect();
    let pairs: Vec<u64> = sizes.chunks(2).map(|pair| pair.iter().sum()).collect();
    assert_eq!(bins, pairs);

    let shown = text(&run("inspect", &path, &[]).stdout);
    for part in [
        "keyframes: frame 0, 20, 40, 60, 80, 90; 10 to 20 frames apart",
        "the mean of 2 frames each",
        "█",
    ] {
        assert!(shown.contains(part), "{part} is not in {shown}");
    }
}

#[test]
fn inspect_counts_tracks_that_were_removed() {
    let folder = tempfile::tempdir().expect("folder");
    let mut server = Server::new();
    server.frame(0, true, 3);
    server.declare(2);
    server.declare(3);
    server.commit(1);
    server
        .encoder
        .remove_tracks(&mut server.bytes, &[2])
        .expect("removed");
    server.commit(2);
    let path = file(&folder, &server.bytes);
    let report = json(&run("inspect", &path, &["--json"]));
    assert_eq!(
        (&report["tracks_declared"], &report["tracks_removed"]),
        (&3.into(), &1.into())
    );
    assert_eq!(report["tracks"].as_array().map(Vec::len), Some(2));
    let shown = text(&run("inspect", &path, &[]).stdout);
    assert!(
        shown.contains("3 tracks were declared, 1 of them"),
        "{shown}"
    );
}

#[test]
fn validate_names_the_limit_and_both_figures() {
    let folder = tempfile::tempdir().expect("folder");
    let (mut bytes, _) = stream(Compression::None, 0);
    // The second record claims more than the default limits allow, with its checksum in order.
    let at = PREAMBLE_BYTES + HEADER_BYTES + 8;
    let header: &[u8; HEADER_BYTES] = bytes[at..at + HEADER_BYTES].try_into().expect("a header");
    let mut header = RecordHeader::read(header).expect("a record header");
    header.stored_bytes = 300 << 20;
    header.unpacked_bytes = 300 << 20;
    bytes[at..at + HEADER_BYTES].copy_from_slice(&header.to_bytes());
    let path = file(&folder, &bytes);

    let report = json(&run("validate", &path, &["--json"]));
    assert_eq!(
        (&report["kind"], &report["which"]),
        (&"LimitExceeded".into(), &"stored_bytes".into())
    );
    let figures = [(300u64 << 20).to_string(), (256u64 << 20).to_string()];
    assert_eq!(report["asked"].to_string(), figures[0]);
    assert_eq!(report["allowed"].to_string(), figures[1]);
    let told = text(&run("validate", &path, &[]).stderr);
    for part in ["the limit is stored_bytes", &figures[0], &figures[1]] {
        assert!(told.contains(part), "{part} is not in {told}");
    }
}

#[test]
fn a_live_stream_is_valid_only_where_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("folder");
    let (bytes, commits) = stream(Compression::None, 0);
    let path = file(&folder, &bytes[..commits[1]]);
    assert_eq!(run("validate", &path, &["--live"]).status.code(), Some(0));
    assert_eq!(run("validate", &path, &[]).status.code(), Some(1));
    let report = run("inspect", &path, &["--json"]);
    assert_eq!(report.status.code(), Some(0));
    assert_eq!(
        (&json(&report)["ended"], &json(&report)["frames"]),
        (&false.into(), &2.into())
    );
}

#[test]
fn validate_names_layer_kind_id_and_offset() {
    let folder = tempfile::tempdir().expect("folder");
    let (bytes, commits) = stream(Compression::None, 0);
    let path = file(&folder, &bytes);
    let valid = run("validate", &path, &["--json"]);
    assert_eq!(valid.status.code(), Some(0));
    assert_eq!(
        json(&valid),
        serde_json::json!({"valid": true, "frames": 3})
    );

    // The last byte of the first commit's payload.
    let mut damaged = bytes.clone();
    damaged[commits[0] - 1] ^= 1;
    let path = file(&folder, &damaged);
    let output = run("validate", &path, &["--json"]);
    assert_eq!(output.status.code(), Some(1));
    let report = json(&output);
    assert_eq!(report["valid"], false);
    assert_eq!(
        (&report["layer"], &report["kind"]),
        (&"framing".into(), &"Checksum".into())
    );
    assert_eq!(
        (&report["id"], &report["name"]),
        (&1011.into(), &"payload-checksum".into())
    );
    let offset = report["offset"].as_u64().expect("offset") as usize;
    assert!(offset < commits[0] && offset + 80 > commits[0], "{offset}");

    let output = run("validate", &path, &[]);
    let stderr = text(&output.stderr);
    assert!(
        stderr.starts_with("dapple: ") && stderr.lines().count() == 1,
        "{stderr}"
    );
    assert!(
        stderr.contains("a.dapple") && stderr.contains("E1011"),
        "{stderr}"
    );
    assert!(output.stdout.is_empty());
}

#[test]
fn every_broken_stream_is_one_sentence() {
    let folder = tempfile::tempdir().expect("folder");
    let (bytes, _) = stream(
        Compression::Zstd {
            level: 3,
            lazy: false,
        },
        0,
    );
    let mut cases: Vec<Vec<u8>> = (0..bytes.len())
        .step_by(29)
        .map(|length| bytes[..length].to_vec())
        .collect();
    cases.extend((0..bytes.len()).step_by(31).map(|at| {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        damaged
    }));
    cases.push([&bytes[..], &[0]].concat());
    cases.push(b"\x89PNG\r\n\x1a\n and more that is no stream at all".to_vec());
    for (i, case) in cases.iter().enumerate() {
        let path = file(&folder, case);
        for command in ["validate", "decode"] {
            let output = run(command, &path, &[]);
            let stderr = text(&output.stderr);
            assert_eq!(
                output.status.code(),
                Some(1),
                "case {i} {command}: {stderr}"
            );
            assert!(
                stderr.starts_with("dapple: ") && stderr.lines().count() == 1,
                "{stderr}"
            );
            assert!(stderr.contains("a.dapple"), "{stderr}");
        }
    }
    for command in ["validate", "inspect", "decode"] {
        for name in ["missing.dapple", "."] {
            let output = run(command, &folder.path().join(name), &[]);
            assert_eq!(output.status.code(), Some(1));
            assert!(text(&output.stderr).starts_with("dapple: "));
        }
    }
}

#[test]
fn the_dump_does_not_depend_on_packing_or_on_where_cells_lie() {
    let folder = tempfile::tempdir().expect("folder");
    let dump = |compression, first| {
        let path = file(&folder, &stream(compression, first).0);
        let output = run("decode", &path, &["--dump"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let plain = dump(Compression::None, 0);
    assert_eq!(plain, dump(Compression::Lz4, 0));
    assert_eq!(
        plain,
        dump(
            Compression::Zstd {
                level: 15,
                lazy: true
            },
            3
        )
    );

    let grid = grid(PointWidths::BITS_32);
    let (bucket, a) = cell(&grid, [1, 2, 3], 1, 0.75);
    let (_, b) = cell(&grid, [1, 2, 3], 1, 1.0);
    let points = |cell: Cell, count| vec![format!("{:08x}", cell.points[0]); count].join(",");
    let line = format!(
        "bucket 1 {bucket} {0}:{1} {0}:{2}",
        a.key,
        points(a, 6),
        points(b, 2)
    );
    let frames: Vec<&str> = plain.split("\nframe ").collect();
    assert_eq!(frames.len(), 4, "{plain}");
    assert!(
        plain.starts_with("dapple-dump 1\nstream 60 1\ngroup 0 keyframes\nframe 0 10 "),
        "{plain}"
    );
    assert!(frames[2].contains(&line), "{line} is not in {}", frames[2]);
    assert!(!frames[1].contains(&line));
    assert!(
        frames[1].contains("transform 5 3f800000 00000000 00000000 40400000 "),
        "{plain}"
    );
    assert!(
        frames[1].contains("\ntrack 1 points cells mesh "),
        "{plain}"
    );
    assert!(frames[1].contains(" \"hall/floor \\\"a\\\"\"\n"), "{plain}");
    assert!(frames[1].contains("\ngrid 1 4 4 4 7 "), "{plain}");
    assert!(
        frames[1].contains(" 5,4,8 3f000000 3e800000 3f800000 "),
        "{plain}"
    );
    assert!(plain.ends_with("\nend\n"));
}
