//! Streams with losses, joined streams, streams that arrive slowly, and streams for newer programs.

use std::io::{BufRead, BufReader, Write};
use std::ops::Range;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use dapple::codec::container::{HEADER_BYTES, PREAMBLE_BYTES, RecordHeader, crc32c};

use super::server::Server;
use super::{file, json, run, text};

/// Thirty frames with a keyframe group every ten, and `cells` cells in each.
fn thirty_frames(cells: u32) -> Vec<u8> {
    let mut server = Server::new();
    for frame in 0..30 {
        server.frame(frame, frame % 10 == 0, cells);
    }
    let mut bytes = server.bytes;
    server.encoder.end(&mut bytes).expect("end");
    bytes
}

fn header(bytes: &[u8], at: usize) -> RecordHeader {
    let bytes = bytes[at..at + HEADER_BYTES].try_into().expect("a header");
    RecordHeader::read(bytes).expect("a record header")
}

/// The bytes of each record.
fn records(bytes: &[u8]) -> Vec<Range<usize>> {
    let mut records = Vec::new();
    let mut at = PREAMBLE_BYTES;
    while at < bytes.len() {
        let end = at + HEADER_BYTES + header(bytes, at).stored_bytes as usize;
        records.push(at..end);
        at = end;
    }
    records
}

/// The numbers of the frames that `decode` prints.
fn frames(output: &str) -> Vec<u32> {
    let frames = output
        .lines()
        .filter_map(|line| line.strip_prefix("frame "));
    frames
        .map(|rest| {
            rest.split(' ')
                .next()
                .expect("a field")
                .parse()
                .expect("a number")
        })
        .collect()
}

fn dapple(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("dapple runs")
}

#[test]
fn decode_resumes_after_a_lost_record() {
    let folder = tempfile::tempdir().expect("folder");
    let mut bytes = thirty_frames(4);
    // Group, track, content and commit of frame 0; then content and commit of each.
    let lost = records(&bytes)[1 + 4 + 2 * 4].clone();
    bytes.drain(lost.clone());
    let path = file(&folder, &bytes);
    let output = run("decode", &path, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(frames(&text(&output.stdout)), [0, 1, 2, 3, 4]);

    let output = run("decode", &path, &["--resume"]);
    let shown = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{shown}");
    let expected: Vec<u32> = (0..5).chain(10..30).collect();
    assert_eq!(frames(&shown), expected);
    let line = format!("\nerror framing 1008 {}\nresume yes\ngroup 1 ", lost.start);
    assert!(shown.contains(&line), "{line} is not in {shown}");
    let told = text(&output.stderr);
    assert!(
        told.starts_with("dapple: warning: ") && told.lines().count() == 1,
        "{told}"
    );

    // Lost framing ends the stream in any case.
    let at = records(&bytes)[40].start;
    bytes[at] ^= 1;
    let output = run("decode", &file(&folder, &bytes), &["--resume"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("E1005"));
}

#[test]
fn decode_joins_a_stream_in_its_middle() {
    let folder = tempfile::tempdir().expect("folder");
    let mut bytes = thirty_frames(4);
    let records = records(&bytes);
    // From the content of frame 5 on.
    bytes.drain(records[1].start..records[1 + 4 + 2 * 4].start);
    let path = file(&folder, &bytes);
    let output = run("decode", &path, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("E1008"));

    let output = run("decode", &path, &["--join"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    assert_eq!(frames(&text(&output.stdout)), (10..30).collect::<Vec<_>>());

    // A loss later on is a fault.
    let lost = self::records(&bytes)[40].clone();
    bytes.drain(lost);
    let output = run("decode", &file(&folder, &bytes), &["--join"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("E1008"));
}

#[test]
fn a_live_frame_is_printed_when_it_is_complete() {
    let mut server = Server::new();
    let mut child = dapple(&["decode", "--live", "-"]);
    let mut to = child.stdin.take().expect("a pipe");
    let from = BufReader::new(child.stdout.take().expect("a pipe"));
    let (sender, lines) = mpsc::channel();
    let reader = std::thread::spawn(move || {
        for line in from.lines() {
            sender.send(line.expect("a line")).expect("the test waits");
        }
    });
    for frame in 0..3 {
        server.frame(frame, frame == 0, 4);
        to.write_all(&server.bytes).expect("written");
        server.bytes.clear();
        let wanted = format!("frame {frame} ");
        while !lines
            .recv_timeout(Duration::from_secs(60))
            .expect("the frame is there before more bytes come")
            .starts_with(&wanted)
        {}
    }
    drop(to);
    assert_eq!(child.wait().expect("a child").code(), Some(0));
    reader.join().expect("the reader ends");
}

#[test]
fn standard_input_is_read_as_a_file_is() {
    let folder = tempfile::tempdir().expect("folder");
    let mut bytes = thirty_frames(4);
    for broken in [false, true] {
        if broken {
            let last = bytes.len() - 1;
            bytes[last] ^= 1;
        }
        let path = file(&folder, &bytes);
        for command in ["validate", "inspect", "decode"] {
            let mut child = dapple(&[command, "-"]);
            let mut to = child.stdin.take().expect("a pipe");
            to.write_all(&bytes).expect("written");
            drop(to);
            let piped = child.wait_with_output().expect("a child");
            let read = run(command, &path, &[]);
            assert_eq!(piped.status.code(), Some(i32::from(broken)));
            let name = path.to_str().expect("UTF-8");
            for (piped, read) in [(piped.stdout, read.stdout), (piped.stderr, read.stderr)] {
                let read = text(&read).replace(name, "standard input");
                assert_eq!(text(&piped), read);
            }
        }
    }
}

#[test]
fn newer_containers_are_named_and_not_called_damaged() {
    let folder = tempfile::tempdir().expect("folder");
    let mut bytes = thirty_frames(400);
    assert!(bytes.len() > 100_000);
    bytes[8] = 2;
    let crc = crc32c(&bytes[..12]);
    bytes[12..16].copy_from_slice(&crc.to_le_bytes());
    let path = file(&folder, &bytes);
    for command in ["validate", "inspect", "decode"] {
        let output = run(command, &path, &[]);
        assert_eq!(output.status.code(), Some(1));
        let told = text(&output.stderr);
        let sentence = "container version 2 is newer than this program, which reads version 1";
        assert!(told.contains(sentence), "{told}");
    }
    let shown = text(&run("inspect", &path, &[]).stdout);
    let line = format!(
        ", {} bytes, container version 2, made for a newer program\n",
        bytes.len()
    );
    assert!(shown.contains(&line), "{shown}");
    let report = json(&run("inspect", &path, &["--json"]));
    assert_eq!(report["bytes"], bytes.len());
    assert_eq!(report["container_version"], 2);
    assert_eq!(report["records"], serde_json::json!([]));
    assert_eq!(report["fault"]["found"], 2);
}

#[test]
fn inspect_counts_the_records_before_a_fault_and_all_bytes() {
    let folder = tempfile::tempdir().expect("folder");
    let bytes = thirty_frames(400);
    let records = records(&bytes);
    for (at, of_header) in [(12, true), (12, false), (3, true), (50, false)] {
        let mut broken = bytes.clone();
        let record = records[at].clone();
        match of_header {
            // An unknown type that must be understood.
            true => {
                let mut header = header(&bytes, record.start);
                header.record_type = 0x155;
                let place = record.start..record.start + HEADER_BYTES;
                broken[place].copy_from_slice(&header.to_bytes());
            }
            false => broken[record.end - 1] ^= 1,
        }
        let path = file(&folder, &broken);
        let output = run("inspect", &path, &["--json"]);
        assert_eq!(output.status.code(), Some(1));
        let report = json(&output);
        let types = report["records"].as_array().expect("records");
        let counts = types
            .iter()
            .map(|t| t["records"].as_u64().expect("a count"));
        assert_eq!(counts.sum::<u64>(), at as u64);
        assert_eq!(report["bytes"], bytes.len());
        let told = text(&run("validate", &path, &[]).stderr);
        assert_eq!(told.contains("(type 341, unknown)"), of_header, "{told}");
    }
}

#[test]
fn limits_are_options() {
    let folder = tempfile::tempdir().expect("folder");
    let path = file(&folder, &thirty_frames(4));
    for command in ["validate", "inspect", "decode"] {
        let output = run(command, &path, &["--max-state-bytes", "4K"]);
        assert_eq!(output.status.code(), Some(1));
        let told = text(&output.stderr);
        assert!(
            told.contains("the limit is state_bytes, which --max-state-bytes sets"),
            "{told}"
        );
        let output = run(command, &path, &["--max-state-bytes", "60K"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
}
