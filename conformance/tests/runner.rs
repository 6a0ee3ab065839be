//! The runner against decoders: one that is right, and one for each way to be wrong.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use std::ops::ControlFlow;

use dapple_conformance::checks::query_input;
use dapple_conformance::models::Query;
use dapple_conformance::models::Samplers;
use dapple_conformance::models::entry::{Entry, tracks};
use dapple_conformance::models::points::queries::PointsQuery;
use dapple_conformance::models::points::writer::{Part, points};
use dapple_conformance::models::probes::queries::Interpolation;
use dapple_conformance::models::probes::writer::Volume;
use dapple_conformance::options::{Extent, Level, Options};
use dapple_conformance::program::{Batch, CommandLine, OneShot};
use dapple_conformance::protocol::{Answer, Arguments, Mode, Program, Status, split};
use dapple_conformance::reference::Reference;
use dapple_conformance::run::{Outcome, Progress, Report, Verdict, run, skips};
use dapple_conformance::stream_builder::{self, StreamBuilder, commit, group, kind};
use dapple_conformance::vector::{Class, Info, Kind, Vector, files_of, load, sha256};

const DECODER: &str = env!("CARGO_BIN_EXE_decoder");
const BROKEN: &str = env!("CARGO_BIN_EXE_broken");

/// A stream of one frame with one point.
fn stream() -> StreamBuilder {
    let entry = Entry::new(1);
    let key = entry.grid().key([1, 1, 1]);
    let point = entry.grid().point([3, 7, 30], [1, 2], 200);
    let part = Part::of(&entry)
        .bucket(entry.grid().bucket(key), &[0])
        .cell(0, key, &[point]);
    let mut builder = StreamBuilder::started();
    builder
        .put(kind::TRACK, &tracks(&[entry]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::POINTS, &points(None, &[part]))
        .put(kind::COMMIT, &commit(0, 0, None));
    builder
}

/// What our decoder makes of it is what the vector asks for.
fn vector(kind: Kind, name: &str, bytes: Vec<u8>, limits: &[(&str, u64)]) -> Vector {
    let limits: BTreeMap<String, u64> = limits.iter().map(|l| (l.0.to_string(), l.1)).collect();
    let session = kind == Kind::Sessions;
    let arguments = Arguments {
        mode: if session { Mode::Session } else { Mode::Stream },
        limits: limits.clone(),
        ..Arguments::default()
    };
    let answer = Reference::default()
        .request(&arguments, &bytes)
        .expect("an answer");
    let (dump, error) = split(&answer);
    let hash = Some(sha256(dump));
    let queries = match kind {
        Kind::Queries => vec![Query::Points(PointsQuery {
            track: 1,
            position: [49152; 3],
            normal: [0, 1, 0],
            ao: [16384, 32768],
        })],
        _ => Vec::new(),
    };
    let info = Info {
        clauses: vec!["C-001".to_string()],
        since: 1,
        class: Class::Value,
        comment: String::new(),
        limits,
        live: false,
        dump_sha256: hash.clone().filter(|_| !session && error.is_none()),
        released_sha256: hash.clone().filter(|_| error.is_some()),
        transcript_sha256: hash.filter(|_| session),
        error,
        queries,
        bytes: bytes.len() as u64,
        sha256: sha256(&bytes),
    };
    Vector {
        area: "container".to_string(),
        kind,
        name: name.to_string(),
        bytes,
        info,
    }
}

/// One vector of each kind.
fn vectors() -> Vec<Vector> {
    let whole = stream().ended();
    let mut damaged = whole.clone();
    let payload = stream().starts[3] + stream_builder::HEADER;
    damaged[payload] ^= 1;
    let mut script = Vec::new();
    for step in [&damaged, &whole] {
        script.extend(format!("push {}\n", step.len()).bytes());
        script.extend(step);
        script.extend(b"resume\nreset\n");
    }
    vec![
        vector(Kind::Invalid, "E1011-payload", damaged, &[]),
        vector(
            Kind::Limits,
            "stored",
            whole.clone(),
            &[("stored_bytes", 100)],
        ),
        vector(Kind::Queries, "point", whole.clone(), &[]),
        vector(Kind::Sessions, "damaged", script, &[]),
        vector(Kind::Valid, "whole", whole, &[]),
    ]
}

fn command_line(command: String, seconds: f64, memory_mib: u64) -> CommandLine {
    CommandLine {
        command,
        timeout: Duration::from_secs_f64(seconds),
        memory_mib,
    }
}

fn options(batch: bool) -> Options {
    Options {
        prefixes: Extent::All,
        flips: if batch { Extent::All } else { Extent::None },
        partial: batch,
        ..Options::default()
    }
}

fn report_of(program: &mut dyn Program, vectors: &[Vector], options: &Options) -> Report {
    run("a decoder", program, vectors, options, &mut |_| {
        ControlFlow::Continue(())
    })
    .expect("a report")
}

/// One shot, with a few prefixes, and batch, with all prefixes and flips.
fn both(command: &str, seconds: f64, vectors: &[Vector]) -> [Report; 2] {
    let command_line = command_line(command.to_string(), seconds, 1024);
    [
        report_of(&mut OneShot(command_line.clone()), vectors, &options(false)),
        report_of(&mut Batch::new(command_line), vectors, &options(true)),
    ]
}

fn outcome<'r>(report: &'r Report, name: &str) -> &'r Outcome {
    let mut outcomes = report.outcomes.iter();
    let named = outcomes.find(|outcome| outcome.path.ends_with(name));
    named.expect("a vector of this name")
}

fn verdict(report: &Report, name: &str, level: Level) -> Verdict {
    let verdicts = &outcome(report, name).verdicts;
    let found = verdicts.iter().find(|verdict| verdict.0 == level);
    found.expect("a verdict at this level").1
}

#[test]
fn command_that_cannot_start_is_one_error() {
    let command_line = command_line("/nowhere/decoder".to_string(), 20.0, 0);
    let programs: [&mut dyn Program; 2] = [
        &mut OneShot(command_line.clone()),
        &mut Batch::new(command_line),
    ];
    for program in programs {
        let report = run("", program, &vectors(), &options(false), &mut |progress| {
            panic!("{progress:?}")
        });
        let error = report.expect_err("no report");
        assert!(error.contains("cannot be started"), "{error}");
        assert!(error.contains("/nowhere/decoder"), "{error}");
    }
}

#[test]
fn failures_that_differ_in_offsets_are_grouped() {
    // Other offsets of the same error, and one vector of another error.
    let mut vectors: Vec<Vector> = (1..8)
        .map(|count| {
            let mut builder = stream();
            for number in 1..count {
                builder.put(kind::COMMIT, &commit(number.into(), number, None));
            }
            let mut bytes = builder.ended();
            *bytes.last_mut().expect("an end record") ^= 1;
            vector(Kind::Invalid, &format!("E1011-commits-{count}"), bytes, &[])
        })
        .collect();
    let mut magic = stream().ended();
    magic[0] = 0;
    vectors.push(vector(Kind::Invalid, "E1001-magic", magic, &[]));
    let command_line = command_line(format!("{BROKEN} id"), 20.0, 1024);
    let report = report_of(&mut Batch::new(command_line), &vectors, &Options::default());
    assert_eq!(report.outcomes.iter().filter(|o| o.failed()).count(), 8);
    let text = dapple_conformance::report::text(&report);
    assert_eq!(text.matches("\nfailed: ").count(), 2, "{text}");
    let first =
        "failed: 7 vectors alike, the first is container/invalid/E1011-commits-1 (full; C-001)";
    assert!(text.contains(first), "{text}");
    assert!(text.contains("alike: container/invalid/E1011-commits-5\n  and 2 more vectors"));
    let html = dapple_conformance::report::html(&report, &[]);
    assert_eq!(html.matches("<article>").count(), 2);
    assert!(html.contains("6 more alike"));
}

#[test]
fn stopped_run_reports_what_it_has() {
    for alone in [true, false] {
        let vectors: Vec<Vector> = (60..90)
            .map(|i| {
                let name = format!("v{i:02}");
                vector(Kind::Limits, &name, stream().ended(), &[("tracks", i)])
            })
            .collect();
        let report = run(
            "stopped",
            &mut Unreliable { alone },
            &vectors,
            &options(true),
            &mut |progress| match progress {
                Progress::Vectors(3..) => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            },
        );
        let report = report.expect("a report");
        assert_eq!(report.outcomes.len() + report.not_run, vectors.len());
        assert!(!report.outcomes.iter().any(Outcome::failed) && !report.passed());
        let text = dapple_conformance::report::text(&report);
        let last = format!("\nstopped: {} vectors were not run\n", report.not_run);
        assert!(text.ends_with(&last), "{text}");
        if alone {
            assert_eq!(report.outcomes.len(), 3);
        }
    }
}

#[test]
fn areas_are_reported_as_they_end() {
    let mut vectors = vectors();
    vectors[4].area = "points".to_string();
    let mut areas = Vec::new();
    let command_line = command_line(format!("{BROKEN} dump"), 20.0, 1024);
    let report = run(
        "",
        &mut Batch::new(command_line),
        &vectors,
        &Options::default(),
        &mut |progress| {
            if let Progress::Area {
                name,
                vectors,
                failed,
            } = progress
            {
                areas.push((name.to_string(), vectors, failed));
            }
            ControlFlow::Continue(())
        },
    );
    assert!(report.is_ok());
    let [container, points] = areas.as_slice() else {
        panic!("{areas:?}");
    };
    assert_eq!((container.0.as_str(), container.1), ("container", 4));
    assert_eq!(points, &("points".to_string(), 1, 1));
}

#[test]
fn report_states_what_was_run() {
    let text = |options: &Options| {
        let report = report_of(&mut Reference::default(), &vectors(), options);
        dapple_conformance::report::text(&report)
    };
    let quick = text(&Options::default());
    for sentence in [
        "prefixes: one in 29 of",
        "(--prefixes all",
        "flips: none",
        "(--flips",
    ] {
        assert!(quick.contains(sentence), "{quick}");
    }
    let whole = text(&Options {
        prefixes: Extent::All,
        flips: Extent::All,
        ..Options::default()
    });
    assert!(
        whole.contains("prefixes: all of") && whole.contains("flips: all of"),
        "{whole}"
    );
    assert!(!whole.contains("--"), "{whole}");
    let some = text(&Options {
        filters: vec!["valid/whole".to_string()],
        ..options(false)
    });
    assert!(some.contains("1 of 5 vectors have"), "{some}");
    assert!(some.contains("prefixes: five of each"), "{some}");
}

#[test]
fn a_right_decoder_passes_one_shot_and_in_batch() {
    for report in both(DECODER, 20.0, &vectors()) {
        assert!(report.passed(), "{report:#?}");
        assert_eq!(verdict(&report, "point", Level::Core), Verdict::Passed);
        assert_eq!(
            verdict(&report, "point", Level::Queries),
            Verdict::NotImplemented
        );
        assert_eq!(
            verdict(&report, "damaged", Level::Sessions),
            Verdict::Passed
        );
        assert_eq!(verdict(&report, "stored", Level::Limits), Verdict::Passed);
    }
}

#[test]
fn wrong_answers_fail_where_they_are_wrong() {
    // The fault, a vector that shows it, and the level that it fails.
    let cases = [
        ("dump", "whole", Level::Core),
        ("cut-dump", "whole", Level::Core),
        ("id", "E1011-payload", Level::Full),
        ("offset", "E1011-payload", Level::Full),
        ("no-line", "E1011-payload", Level::Core),
        ("later-89", "whole", Level::Core),
        ("later-89", "damaged", Level::Sessions),
        ("prefix", "whole", Level::Core),
        ("checksum", "E1011-payload", Level::Core),
        ("session", "damaged", Level::Sessions),
        ("limits", "stored", Level::Limits),
    ];
    let vectors = vectors();
    for (fault, name, level) in cases {
        for report in both(&format!("{BROKEN} {fault}"), 20.0, &vectors) {
            assert_eq!(verdict(&report, name, level), Verdict::Failed, "{fault}");
            let outcome = outcome(&report, name);
            let first = outcome.failures.first();
            assert_eq!(first.map(|first| first.level), Some(level), "{fault}");
            if level == Level::Full {
                let core = verdict(&report, name, Level::Core);
                assert_eq!(core, Verdict::Passed, "{fault}");
            }
        }
    }
}

#[test]
fn prefixes_and_flips_are_compared_with_the_reference() {
    let vectors = vectors();
    let whole = &vectors[4..];
    let report = |fault: &str, options: &Options| {
        let command_line = command_line(format!("{BROKEN} {fault}"), 20.0, 1024);
        report_of(&mut Batch::new(command_line), whole, options)
    };
    let eager = report("eager", &options(true));
    let failures = &outcome(&eager, "whole").failures;
    assert!(failures[0].check.starts_with("prefix of 0"), "{failures:?}");
    // A valid vector alone shows a check that is missing only where its bits are flipped.
    assert!(report("checksum", &Options::default()).passed());
    // A program that dies has exit code 1, too: one shot prefixes show it, in batch flips.
    for report in both(&format!("{BROKEN} no-line"), 20.0, whole) {
        assert_eq!(verdict(&report, "whole", Level::Core), Verdict::Failed);
    }
    let flipped = report("checksum", &options(true));
    let outcome = outcome(&flipped, "whole");
    assert!(outcome.failures[0].check.contains("flipped"), "{outcome:?}");
    assert!(outcome.left_out > 0);
}

#[test]
fn a_decoder_that_gives_no_answer_fails_and_stops_nothing() {
    // The fault, and what is said of it one shot and in batch.
    let cases = [
        ("abort", "signal 6", "signal 6"),
        ("exit", "exit code 7", "exit code 7"),
        ("hang", "no end within", "no end within"),
        ("memory", "signal 6", "signal 6"),
        ("flood", "more than 64 MiB", "status 120"),
        ("garbage", "line 1: hello", "status 104"),
        ("cut-answer", "line 1: ", "cut off"),
        ("silent", "0 lines", "exit code 0 instead of an answer"),
    ];
    let whole = &vectors()[4..];
    for (fault, one_shot, batch) in cases {
        let seconds = if fault == "hang" { 0.3 } else { 20.0 };
        let reports = both(&format!("{BROKEN} {fault}"), seconds, whole);
        for (report, words) in reports.iter().zip([one_shot, batch]) {
            let outcome = outcome(report, "whole");
            assert!(outcome.failed(), "{fault}");
            let failure = &outcome.failures[0];
            assert!(failure.got.contains(words), "{fault}: {failure:?}");
        }
    }
    let aborted = &both(&format!("{BROKEN} abort"), 20.0, whole)[1];
    assert!(
        outcome(aborted, "whole").failures[0]
            .got
            .contains("it says: ")
    );
}

#[test]
fn answers_that_nobody_asked_for_are_noticed() {
    let command_line = command_line(format!("{BROKEN} twice"), 20.0, 1024);
    let report = report_of(&mut Batch::new(command_line), &vectors(), &options(true));
    assert!(report.outcomes[0].failed());
}

#[test]
fn a_decoder_that_never_answers_is_given_up() {
    let vectors: Vec<Vector> = (0..40)
        .map(|i| vector(Kind::Valid, &format!("v{i:02}"), stream().ended(), &[]))
        .collect();
    let command_line = command_line("exit 9 #".to_string(), 20.0, 0);
    let skipping = Options {
        skips: skips("container/valid/v30 because").expect("skips"),
        ..options(false)
    };
    let report = report_of(&mut OneShot(command_line), &vectors, &skipping);
    let others = |outcome: &&Outcome| !outcome.path.ends_with("v30");
    assert!(report.outcomes.iter().filter(others).all(Outcome::failed));
    assert_eq!(verdict(&report, "v30", Level::Core), Verdict::Skipped);
    assert!(outcome(&report, "v30").failures.is_empty());
    assert_eq!(report.requests(), 10);
}

/// Our decoder, but for some values of a limit; on one thread, or on all.
struct Unreliable {
    alone: bool,
}

impl Program for Unreliable {
    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
        match arguments.limits["tracks"] {
            7 | 20..40 => Err("no answer now".to_string()),
            _ => Reference::default().request(arguments, input),
        }
    }

    fn another(&self) -> Option<Box<dyn Program + Send>> {
        (!self.alone).then(|| Box::new(Unreliable { alone: true }) as Box<dyn Program + Send>)
    }
}

#[test]
fn threads_leave_no_mark_on_a_report() {
    let vectors: Vec<Vector> = (1..60)
        .map(|i| {
            let name = format!("v{i:02}");
            vector(Kind::Limits, &name, stream().ended(), &[("tracks", i)])
        })
        .collect();
    let [in_turn, at_once] = [true, false].map(|alone| {
        let mut done = Vec::new();
        let report = run(
            "unreliable",
            &mut Unreliable { alone },
            &vectors,
            &options(true),
            &mut |progress| {
                if let Progress::Vectors(count) = progress {
                    done.push(count);
                }
                ControlFlow::Continue(())
            },
        );
        assert!(done.is_sorted() && done.last() == Some(&59));
        report.expect("a report")
    });
    assert_eq!(in_turn, at_once);
    // One without an answer is forgiven, ten in a row are not, and then nothing more is run.
    for (name, failed) in [("v06", false), ("v07", true), ("v19", false), ("v59", true)] {
        assert_eq!(outcome(&at_once, name).failed(), failed, "{name}");
    }
    assert_eq!(outcome(&at_once, "v29").requests, 1);
    assert_eq!(outcome(&at_once, "v30").requests, 0);
}

#[cfg(unix)]
#[test]
fn a_pipe_that_nobody_reads_blocks_nothing() {
    let large = vec![7; 4 << 20];
    let mut leaves = OneShot(command_line("exit 1 #".to_string(), 20.0, 0));
    let answer = leaves
        .request(&Arguments::default(), &large)
        .expect("an exit code");
    assert_eq!(answer.status, Status::Refused);
    for command in ["sleep 60 #", "sleep 60 & exec sleep 60 #"] {
        let command_line = command_line(command.to_string(), 0.2, 0);
        let late = OneShot(command_line.clone()).request(&Arguments::default(), &large);
        assert!(late.is_err_and(|error| error.contains("no end within")));
        let late = Batch::new(command_line).request(&Arguments::default(), &large);
        assert!(late.is_err_and(|error| error.contains("no end within")));
    }
    // Garbage that was there before the request.
    let chatter = "head -c 8 >/dev/null; printf '\\0\\0\\0\\0\\0hello'; sleep 60 #";
    let mut chatter = Batch::new(command_line(chatter.to_string(), 20.0, 0));
    let first = chatter.request(&Arguments::default(), b"");
    assert!(first.is_ok_and(|answer| answer.status == Status::Complete));
    std::thread::sleep(Duration::from_millis(100));
    let second = chatter.request(&Arguments::default(), b"");
    assert!(second.is_err_and(|error| error.contains("status 104")));
    // A process that outlives its parent and holds the pipes open.
    let mut orphan = OneShot(command_line("sleep 3 & exit 1 #".to_string(), 0.2, 0));
    assert!(orphan.request(&Arguments::default(), b"").is_err());
}

#[cfg(unix)]
#[test]
fn children_in_the_background_die_with_their_program() {
    let folder = temporary("background");
    // A program that ends by itself, with its exit code, and one that leaves its output open.
    for (number, silence) in [" >/dev/null 2>&1", ""].into_iter().enumerate() {
        let file = folder.join(number.to_string());
        let child = format!("(sleep 2; echo alive > {})", file.display());
        let command = format!("{child}{silence} & exit 1 #");
        let seconds = [20.0, 0.3][number];
        let mut program = OneShot(command_line(command, seconds, 0));
        let answer = program.request(&Arguments::default(), b"");
        assert_eq!(answer.is_ok(), number == 0, "{answer:?}");
    }
    std::thread::sleep(Duration::from_secs(3));
    let left = std::fs::read_dir(&folder).expect("the folder").count();
    assert_eq!(left, 0, "children that live on");
}

#[cfg(unix)]
#[test]
fn the_shell_acts_on_nothing_in_a_vector() {
    let folder = temporary("shell");
    let file = folder.join("made");
    let limits = [(format!("tracks;touch {};", file.display()), 1)];
    let arguments = Arguments {
        limits: limits.into_iter().collect(),
        ..Arguments::default()
    };
    let mut program = OneShot(command_line("true".to_string(), 20.0, 0));
    let answer = program.request(&arguments, b"").expect("an exit code");
    assert_eq!(answer.status, Status::Complete);
    assert!(!file.exists());
}

/// An empty folder of a test.
fn temporary(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Writes the vectors after a change, and reads them.
fn loaded(vectors: &[Vector], change: impl FnOnce(&mut BTreeMap<String, Vec<u8>>)) -> String {
    let folder = temporary("vectors");
    let mut files = files_of(vectors);
    change(&mut files);
    for (name, bytes) in &files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
    load(&folder).map_or_else(|sentence| sentence, |read| format!("{} read", read.len()))
}

#[test]
fn vectors_are_read_with_care() {
    let good = vectors();
    assert_eq!(loaded(&good, |_| {}), "5 read");
    let without = |files: &mut BTreeMap<String, Vec<u8>>| drop(files.remove("manifest.json"));
    assert_eq!(loaded(&good, without), "5 read");
    // What a vector of the kind does not state, with a manifest that fits.
    type Change = fn(&mut Info);
    let changes: [(usize, Change, &str); 10] = [
        (
            1,
            |i| i.limits = BTreeMap::from([("tracks;true".into(), 1)]),
            "no such limit",
        ),
        (
            1,
            |i| i.limits = BTreeMap::from([("tracks".into(), 1 << 32)]),
            "at most",
        ),
        (4, |i| i.bytes += 1, "was written for"),
        (4, |i| i.dump_sha256 = None, "states dump_sha256"),
        (4, |i| i.transcript_sha256 = i.dump_sha256.clone(), "alone"),
        (0, |i| i.error = None, "states error"),
        (0, |i| i.released_sha256 = None, "states error"),
        (
            3,
            |i| i.transcript_sha256 = None,
            "states transcript_sha256",
        ),
        (2, |i| i.queries.clear(), "queries belong"),
        (
            4,
            |i| {
                i.queries = vec![Query::Points(PointsQuery {
                    track: 1,
                    position: [0; 3],
                    normal: [0, 1, 0],
                    ao: [0, 1],
                })]
            },
            "queries belong",
        ),
    ];
    for (number, change, words) in changes {
        let mut bad = good.clone();
        change(&mut bad[number].info);
        let sentence = loaded(&bad, |_| {});
        assert!(sentence.contains(words), "{words}: {sentence}");
    }
    // Files that the manifest does not fit.
    let whole = "container/valid/whole";
    let sentence = loaded(&good, |files| {
        files.remove(&format!("{whole}.json"));
        files.remove(&format!("{whole}.dapple"));
    });
    assert!(sentence.contains("is not there"), "{sentence}");
    let sentence = loaded(&good, |files| {
        files.insert(format!("{whole}r.dapple"), Vec::new());
    });
    assert!(sentence.ends_with("not in manifest.json"), "{sentence}");
    let sentence = loaded(&good, |files| {
        let json = files.get_mut(&format!("{whole}.json")).expect("a file");
        json.push(b' ');
    });
    assert!(
        sentence.ends_with("not the file of manifest.json"),
        "{sentence}"
    );
}

#[test]
fn a_query_is_seven_numbers_in_range() {
    let mut own = Reference {
        samplers: Samplers {
            points: Some(|_, _, _, normal| normal[1]),
            ..Samplers::default()
        },
    };
    let arguments = Arguments {
        mode: Mode::Queries,
        ..Arguments::default()
    };
    let stream = stream().ended();
    let mut ask = |line: &str| {
        let mut input = query_input(&stream, &[]);
        input.extend(line.bytes());
        own.request(&arguments, &input)
    };
    // The squares of these have no sum in 64 bits.
    let answer = ask("1 0 0 0 0 -2147483648 0\n").expect("a value");
    assert_eq!(answer.output, b"-1\n");
    let least = "1 0 0 0 -2147483648 -2147483648 -2147483648\n";
    let answer = ask(least).expect("a value");
    assert!(answer.output.starts_with(b"-0.577"));
    for line in [
        "1 0 0 0 0 0 0\n",
        "1 0 0 2147483648 0 1 0\n",
        "1 0 0 0 0 3037000500 0\n",
        "-1 0 0 0 0 1 0\n",
        "2 0 0 0 0 1 0\n",
        "1 0 0 0 0 1\n",
        "1 0 0 0 0 1 0 0\n",
    ] {
        assert!(ask(line).is_err_and(|e| e.contains("no query")), "{line}");
    }
}

/// Requests in order.
#[test]
fn a_query_of_light_is_eleven_numbers_and_a_word() {
    let mut own = Reference {
        samplers: Samplers {
            probes: Some(|_, _, s| {
                let visibility_weighted = s.interpolation == Interpolation::VisibilityWeighted;
                let roughness = s.roughness;
                [
                    s.position,
                    [
                        s.normal[1],
                        s.view[0],
                        if visibility_weighted { roughness } else { -1.0 },
                    ],
                ]
            }),
            ..Samplers::default()
        },
    };
    let arguments = Arguments {
        mode: Mode::Queries,
        ..Arguments::default()
    };
    let entry = Entry::of_volume(3, Volume::packed([1, 2, 1]));
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&[entry]));
    let stream = builder.ended();
    let mut ask = |line: &str| {
        let mut input = query_input(&stream, &[]);
        input.extend(line.bytes());
        own.request(&arguments, &input)
    };
    let answer = ask("3 65536 -32768 0 0 -9 0 5 0 0 16384 visibility-weighted\n").expect("a line");
    assert_eq!(answer.output, b"1 -0.5 0 -1 1 0.25\n");
    let answer = ask("3 65536 -32768 0 0 -9 0 5 0 0 65536 trilinear\n").expect("a line");
    assert_eq!(answer.output, b"1 -0.5 0 -1 1 -1\n");
    for line in [
        "3 0 0 0 0 1 0\n",
        "3 0 0 0 0 1 0 0 1 0 0\n",
        "3 0 0 0 0 1 0 0 1 0 0 other\n",
        "3 0 0 0 0 1 0 0 1 0 visibility-weighted\n",
        "3 0 0 0 0 1 0 0 1 0 65537 visibility-weighted\n",
        "3 0 0 0 0 1 0 0 1 0 -1 visibility-weighted\n",
        "3 0 0 0 0 0 0 0 1 0 0 visibility-weighted\n",
        "3 0 0 0 0 1 0 0 0 0 0 visibility-weighted\n",
        "2 0 0 0 0 1 0 0 1 0 0 visibility-weighted\n",
    ] {
        assert!(ask(line).is_err_and(|e| e.contains("no query")), "{line}");
    }
    // Who samples points alone does not do this.
    let mut own = Reference {
        samplers: Samplers {
            points: Some(|_, _, _, _| 1.0),
            ..Samplers::default()
        },
    };
    let mut input = query_input(&stream, &[]);
    input.extend(b"3 0 0 0 0 1 0 0 1 0 0 visibility-weighted\n");
    let answer = own.request(&arguments, &input).expect("an answer");
    assert_eq!(answer.status, Status::NotImplemented);
}

#[test]
fn query_answers_outside_their_intervals_fail() {
    let vectors = vectors();
    for (ao, expected) in [
        (0.25, Verdict::Passed),
        (0.51, Verdict::Failed),
        (f32::NAN, Verdict::Failed),
    ] {
        let samplers: [(f32, dapple_conformance::models::points::queries::Sampler); 3] = [
            (0.25, |_, _, _, _| 0.25),
            (0.51, |_, _, _, _| 0.51),
            (f32::NAN, |_, _, _, _| f32::NAN),
        ];
        let sampler = samplers.iter().find(|s| s.0.to_bits() == ao.to_bits());
        let mut own = Reference {
            samplers: Samplers {
                points: sampler.map(|s| s.1),
                ..Samplers::default()
            },
        };
        let report = report_of(&mut own, &vectors, &Options::default());
        assert_eq!(verdict(&report, "point", Level::Queries), expected);
    }
}

#[test]
fn a_panic_is_a_failure_of_its_vector() {
    let mut own = Reference {
        samplers: Samplers {
            points: Some(|_, _, _, _| panic!("a fault of the decoder under test")),
            ..Samplers::default()
        },
    };
    let report = report_of(&mut own, &vectors(), &Options::default());
    assert_eq!(verdict(&report, "point", Level::Queries), Verdict::Failed);
    assert_eq!(verdict(&report, "whole", Level::Core), Verdict::Passed);
}

#[test]
fn skip_file_entries_that_pass_or_do_not_exist_are_errors() {
    let text = "# why\n\ncontainer/valid/whole  no frames yet\n";
    let skipping = Options {
        skips: skips(text).expect("skips"),
        ..Options::default()
    };
    let command_line = command_line(format!("{BROKEN} dump"), 20.0, 1024);
    let mut vectors = vectors();
    let mut dump = Batch::new(command_line);
    let report = report_of(&mut dump, &vectors[4..], &skipping);
    assert_eq!(report.count(Level::Core, None, Verdict::Skipped), 1);
    assert!(!report.passed(), "all that there is was skipped");
    let result = report.result();
    assert_eq!(result, "failed: no vector passed at level core");
    vectors.push(vector(
        Kind::Valid,
        "empty",
        StreamBuilder::started().ended(),
        &[],
    ));
    let report = report_of(&mut dump, &vectors[4..], &skipping);
    assert!(report.passed(), "{report:#?}");
    assert_eq!(report.count(Level::Core, None, Verdict::Skipped), 1);
    let report = report_of(&mut Reference::default(), &vectors, &skipping);
    assert!(!report.passed());
    assert_eq!(outcome(&report, "whole").failures[0].check, "skip file");
    let unknown = Options {
        skips: skips("container/valid/nothing because").expect("skips"),
        ..Options::default()
    };
    let error = run(
        "",
        &mut Reference::default(),
        &vectors,
        &unknown,
        &mut |_| ControlFlow::Continue(()),
    );
    assert!(error.is_err_and(|error| error.contains("container/valid/nothing")));
    assert!(skips("container/valid/whole").is_err());
    assert!(skips("a b\na c").is_err());
}

#[test]
fn what_is_not_implemented_does_not_pass() {
    let vectors = vectors();
    let command_line = command_line(format!("{BROKEN} not-implemented"), 20.0, 1024);
    let report = report_of(&mut Batch::new(command_line), &vectors, &Options::default());
    assert!(!report.outcomes.iter().any(Outcome::failed));
    assert!(!report.passed());
    assert_eq!(report.result(), "failed: nothing is implemented");
    // Without a sampler, and thus without queries.
    let report = report_of(&mut Reference::default(), &vectors, &Options::default());
    assert!(report.passed());
    assert_eq!(report.result(), "nothing failed, 1 not implemented");
    let text = dapple_conformance::report::text(&report);
    assert!(text.ends_with("\nnothing failed, 1 not implemented\n"));
    let mut own = Reference {
        samplers: Samplers {
            points: Some(|_, _, _, _| 0.25),
            ..Samplers::default()
        },
    };
    let report = report_of(&mut own, &vectors, &Options::default());
    assert_eq!(report.result(), "passed");
}

#[test]
fn levels_and_extents_are_known_by_name() {
    for level in Level::ALL {
        assert_eq!(level.name().parse(), Ok(level));
    }
    for extent in Extent::ALL {
        assert_eq!(extent.name().parse(), Ok(extent));
    }
    assert!("perfect".parse::<Level>().is_err() && "some".parse::<Extent>().is_err());
}

#[test]
fn levels_and_filter_choose() {
    let vectors = vectors();
    let core = Options {
        levels: vec![Level::Core],
        ..Options::default()
    };
    let command_line = command_line(format!("{BROKEN} id"), 20.0, 1024);
    let report = report_of(&mut Batch::new(command_line), &vectors, &core);
    assert!(report.passed(), "core does not look at ids");
    assert_eq!(report.outcomes.len(), 3);
    let filter = Options {
        filters: vec!["valid/whole".to_string()],
        ..Options::default()
    };
    let report = report_of(&mut Reference::default(), &vectors, &filter);
    assert_eq!(report.outcomes.len(), 1);
    let nothing = Options {
        filters: vec!["nothing".to_string()],
        ..Options::default()
    };
    assert!(
        run(
            "",
            &mut Reference::default(),
            &vectors,
            &nothing,
            &mut |_| ControlFlow::Continue(())
        )
        .is_err()
    );
}
