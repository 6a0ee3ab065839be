//! `dapple conformance` as a user types it.

use std::fs;
use std::process::{Command, Output};

fn conformance(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dapple"))
        .arg("conformance")
        .args(arguments)
        .output()
        .expect("dapple runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn our_decoder_and_sampler_pass_all_levels() {
    let folder = tempfile::tempdir().expect("folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (json, junit, html) = (path("a.json"), path("a.xml"), path("a.html"));
    let output = conformance(&["--json", &json, "--junit", &junit, "--html", &html]);
    let summary = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{summary}");
    assert!(summary.ends_with("\npassed\n"), "{summary}");
    let report = fs::read(&json).expect("a report");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!(report["passed"], true);
    let vectors = report["vectors"].as_array().expect("a list");
    let core = report["levels"]["core"].as_object().expect("areas");
    let passed = core.values().map(|area| area["passed"].as_u64());
    let passed: u64 = passed.map(|count| count.expect("a count")).sum();
    assert!(passed > 0 && passed <= vectors.len() as u64);
    for counts in report["levels"]
        .as_object()
        .into_iter()
        .flat_map(|l| l.values())
    {
        for area in counts
            .as_object()
            .into_iter()
            .flat_map(|areas| areas.values())
        {
            assert_eq!(
                (&area["failed"], &area["not_implemented"]),
                (&0.into(), &0.into())
            );
        }
    }
    let junit = fs::read_to_string(&junit).expect("a report");
    let suites = report["levels"]
        .as_object()
        .map_or(0, |levels| levels.len());
    assert_eq!(junit.matches("<testsuite ").count(), suites);
    let html = fs::read_to_string(&html).expect("a report");
    assert!(html.contains("C-001") && html.ends_with("</html>\n"));
}

#[test]
fn a_program_that_is_no_decoder_fails() {
    let output = conformance(&[
        "--decoder",
        "exit 7 #",
        "--filter",
        "least",
        "--level",
        "core",
    ]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("exit code 7"));
}

#[test]
fn decoder_that_cannot_start_is_one_sentence() {
    for batch in [&[][..], &["--batch"]] {
        let output = conformance(&[&["--decoder", "/nowhere/decoder"], batch].concat());
        assert_eq!(output.status.code(), Some(2));
        let error = text(&output.stderr);
        assert!(
            error.contains("cannot be started") && error.lines().count() == 1,
            "{error}"
        );
        assert!(output.stdout.is_empty());
    }
}

#[cfg(unix)]
#[test]
fn interrupt_ends_with_the_results_so_far() {
    let folder = tempfile::tempdir().expect("folder");
    let mark = folder.path().join("asked");
    // Only a request is followed by a second start.
    let decoder = format!("echo >> {}; sleep 0.1; exit 1 #", mark.display());
    let child = Command::new(env!("CARGO_BIN_EXE_dapple"))
        .args(["conformance", "--decoder", &decoder])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("dapple runs");
    while fs::read(&mark).map_or(0, |marks| marks.len()) < 2 {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let id = child.id().to_string();
    let signalled = Command::new("kill").args(["-INT", &id]).status();
    assert!(signalled.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130));
    let summary = text(&output.stdout);
    assert!(summary.contains("\nstopped: "), "{summary}");
}

#[test]
fn what_makes_no_sense_is_one_sentence() {
    let folder = tempfile::tempdir().expect("folder");
    let skip = folder.path().join("skip");
    fs::write(&skip, "container/valid/nothing because").expect("a file");
    let skip = skip.display().to_string();
    let missing = folder.path().join("missing").display().to_string();
    for arguments in [
        ["--skip", &skip],
        ["--skip", &missing],
        ["--vectors", &missing],
        ["--filter", "nothing of that name"],
        ["--level", "perfect"],
        ["--timeout", "0"],
    ] {
        let output = conformance(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
    }
}
