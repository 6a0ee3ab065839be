//! Runs vectors through a decoder, level by level.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use crate::checks::{self, Failure, Stage, Stop};
use crate::options::{Extent, Level, Options, SAMPLE_STEP};
use crate::protocol::Program;
use crate::vector::{Kind, Vector};

/// How a vector came out at a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// As it must be.
    Passed,
    /// Not as it must be.
    Failed,
    /// The decoder says that it does not do this.
    NotImplemented,
    /// Failed, and the skip file says that it may.
    Skipped,
}

impl Verdict {
    /// All, in the order of reports.
    pub const ALL: [Verdict; 4] = [
        Verdict::Passed,
        Verdict::Failed,
        Verdict::NotImplemented,
        Verdict::Skipped,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed => "failed",
            Verdict::NotImplemented => "not implemented",
            Verdict::Skipped => "skipped",
        }
    }
}

/// What a decoder made of a vector.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Path of the vector below the folder of vectors.
    pub path: String,
    /// Its area.
    pub area: String,
    /// Its clauses.
    pub clauses: Vec<String>,
    /// How it came out at each level that was requested and that it belongs to.
    pub verdicts: Vec<(Level, Verdict)>,
    /// What failed; the first few.
    pub failures: Vec<Failure>,
    /// How many failures are not among them.
    pub left_out: u64,
    /// Why it may fail.
    pub skip: Option<String>,
    /// Requests to the decoder.
    pub requests: u64,
}

impl Outcome {
    /// Whether it failed at some level.
    pub fn failed(&self) -> bool {
        self.verdicts.iter().any(|v| v.1 == Verdict::Failed)
    }

    /// Whether it passed at all levels.
    pub fn passed(&self) -> bool {
        self.verdicts.iter().all(|v| v.1 == Verdict::Passed)
    }
}

/// What a decoder made of all vectors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// What the decoder is called.
    pub decoder: String,
    /// In the order of the vectors' paths.
    pub outcomes: Vec<Outcome>,
    /// Vectors that were not run, since the run was stopped.
    pub not_run: usize,
    /// Sentences on what was run and what was not.
    pub extent: Vec<String>,
}

impl Report {
    /// Whether nothing failed and something passed, at each level that the decoder implements:
    /// what is skipped or not implemented is no failure, but proves nothing either.
    pub fn passed(&self) -> bool {
        let passed = |level| self.count(level, None, Verdict::Passed) > 0;
        !self.outcomes.iter().any(Outcome::failed)
            && self.not_run == 0
            && Level::ALL.into_iter().any(passed)
            && self.hollow().is_none()
    }

    /// The first level at which nothing passed although the decoder implements it: there all that
    /// it answered was skipped.
    fn hollow(&self) -> Option<Level> {
        Level::ALL.into_iter().find(|&level| {
            self.count(level, None, Verdict::Passed) == 0
                && self.count(level, None, Verdict::Skipped) > 0
        })
    }

    /// What it came to, in a few words.
    pub fn result(&self) -> String {
        let unknown = |outcome: &&Outcome| {
            let mut verdicts = outcome.verdicts.iter();
            verdicts.any(|verdict| verdict.1 == Verdict::NotImplemented)
        };
        let unknown = self.outcomes.iter().filter(unknown).count();
        match self.hollow() {
            _ if self.not_run > 0 => format!("stopped: {} vectors were not run", self.not_run),
            _ if self.outcomes.iter().any(Outcome::failed) => "failed".to_string(),
            Some(level) => format!("failed: no vector passed at level {}", level.name()),
            None if !self.passed() => "failed: nothing is implemented".to_string(),
            None if unknown > 0 => format!("nothing failed, {unknown} not implemented"),
            None => "passed".to_string(),
        }
    }

    /// How many vectors came out so at a level, in one area or in all.
    pub fn count(&self, level: Level, area: Option<&str>, verdict: Verdict) -> usize {
        let outcomes = self.outcomes.iter();
        outcomes
            .filter(|outcome| area.is_none_or(|area| outcome.area == area))
            .filter(|outcome| outcome.verdicts.contains(&(level, verdict)))
            .count()
    }

    /// The areas of the vectors, in order.
    pub fn areas(&self) -> Vec<&str> {
        let mut areas: Vec<&str> = self.outcomes.iter().map(|o| o.area.as_str()).collect();
        areas.sort_unstable();
        areas.dedup();
        areas
    }

    /// Requests to the decoder.
    pub fn requests(&self) -> u64 {
        self.outcomes.iter().map(|outcome| outcome.requests).sum()
    }
}

/// So many vectors in a row without an answer, and the rest are not run: a decoder that
/// always hangs is reported soon.
const GIVE_UP: usize = 10;

/// The check of a vector that was not run, since the decoder gave no answers.
pub const NOT_RUN: &str = "not run";

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress<'r> {
    /// So many vectors are done.
    Vectors(usize),
    /// All vectors of an area are done.
    Area {
        /// The area.
        name: &'r str,
        /// Its vectors.
        vectors: usize,
        /// Those that failed at some level.
        failed: usize,
    },
}

/// Takes the progress of a run; [`ControlFlow::Break`] stops the run.
pub type OnProgress<'p> = dyn FnMut(Progress<'_>) -> ControlFlow<()> + 'p;

/// Runs vectors through a decoder. The report does not depend on the number of threads.
///
/// # Errors
/// A sentence where the decoder cannot be started, the skip file names a vector that does not exist,
/// or the filter leaves none.
pub fn run(
    decoder: &str,
    program: &mut dyn Program,
    vectors: &[Vector],
    options: &Options,
    progress: &mut OnProgress<'_>,
) -> Result<Report, String> {
    for path in options.skips.keys() {
        if !vectors.iter().any(|vector| vector.path() == *path) {
            return Err(format!("the skip file names {path}, which is no vector"));
        }
    }
    let selected = vectors
        .iter()
        .filter(|vector| options.takes(&vector.path()) && !levels(vector, options).is_empty());
    let selected: Vec<&Vector> = selected.collect();
    if selected.is_empty() {
        return Err("no vector has that level and that text in its path".to_string());
    }
    program.check()?;
    let extent = extent(&selected, vectors.len(), options);
    let total = selected.len();
    let (ahead, mut flow) = ahead(program, &selected, options, progress);
    let done = ahead.len();
    let mut ahead = ahead.into_iter();
    let mut outcomes = Vec::new();
    // For each kind by itself: a decoder without sessions may do all else.
    let mut silent: BTreeMap<Kind, usize> = BTreeMap::new();
    let mut area_start = 0;
    for (index, vector) in selected.iter().enumerate() {
        if flow.is_break() && index >= done {
            break;
        }
        let silent = silent.entry(vector.kind).or_default();
        let (outcome, answered) = match ahead.next() {
            _ if *silent >= GIVE_UP => (given_up(vector, options), false),
            Some(found) => found,
            None => one(program, vector, options),
        };
        *silent = if answered { 0 } else { *silent + 1 };
        outcomes.push(outcome);
        if flow.is_continue() {
            flow = progress(Progress::Vectors(outcomes.len().max(done)));
        }
        if selected
            .get(index + 1)
            .is_none_or(|next| next.area != vector.area)
        {
            let of_area = &outcomes[area_start..];
            // At its end the run is over anyway.
            let _ = progress(Progress::Area {
                name: &vector.area,
                vectors: of_area.len(),
                failed: of_area.iter().filter(|outcome| outcome.failed()).count(),
            });
            area_start = outcomes.len();
        }
    }
    Ok(Report {
        decoder: decoder.to_string(),
        not_run: total - outcomes.len(),
        outcomes,
        extent,
    })
}

/// Sentences on what is run of the vectors and what is not.
fn extent(run: &[&Vector], all: usize, options: &Options) -> Vec<String> {
    let of = |extent: Extent, few: &str| match extent {
        Extent::None => "none".to_string(),
        Extent::Sample => format!("one in {} {few}", SAMPLE_STEP),
        Extent::All => format!("all {few}"),
    };
    let mut sentences = Vec::new();
    if run.len() < all {
        sentences.push(format!(
            "{} of {all} vectors have the level and filter",
            run.len()
        ));
    }
    let mut prefixes = of(
        options.prefixes,
        "of streams up to 4 KiB, five of longer ones",
    );
    if !options.partial && options.prefixes != Extent::None {
        prefixes = "five of each stream (--batch tries more)".to_string();
    } else if options.prefixes != Extent::All {
        prefixes += " (--prefixes all runs every one)";
    }
    sentences.push(format!("prefixes: {prefixes}"));
    let mut flips = of(options.flips, "of valid streams up to 4 KiB");
    if options.flips != Extent::All {
        flips += " (--flips sample or all)";
    }
    sentences.push(format!("single-bit flips: {flips}"));
    sentences
}

/// What [`one`] gives for each vector, found on all cores; empty where there is one core, or the
/// decoder answers one request after the other.
fn ahead(
    program: &dyn Program,
    vectors: &[&Vector],
    options: &Options,
    progress: &mut OnProgress<'_>,
) -> (Vec<(Outcome, bool)>, ControlFlow<()>) {
    let threads = thread::available_parallelism().map_or(1, |threads| threads.get());
    let programs = (0..threads.min(vectors.len())).map_while(|_| program.another());
    let programs: Vec<_> = programs.collect();
    if programs.len() < 2 {
        return (Vec::new(), ControlFlow::Continue(()));
    }
    let next = AtomicUsize::new(0);
    let mut flow = ControlFlow::Continue(());
    let mut results: Vec<Option<(Outcome, bool)>> = vec![None; vectors.len()];
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for mut program in programs {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(vector) = vectors.get(index) else {
                        return;
                    };
                    let found = one(program.as_mut(), vector, options);
                    let _ = sender.send((index, found));
                }
            });
        }
        drop(sender);
        for (done, (index, found)) in (1..).zip(receiver) {
            results[index] = Some(found);
            if flow.is_continue() {
                flow = progress(Progress::Vectors(done));
            }
            if flow.is_break() {
                // The threads find no further vector.
                next.store(vectors.len(), Ordering::Relaxed);
            }
        }
    });
    let results = results.into_iter().map_while(|result| result);
    (results.collect(), flow)
}

/// The skips of a skip file: a path and a reason a line; empty lines and those from `#` are not
/// looked at.
///
/// # Errors
/// A sentence that names the line without a reason, or the path that comes twice.
pub fn skips(text: &str) -> Result<BTreeMap<String, String>, String> {
    let mut skips = BTreeMap::new();
    for line in text.lines().map(str::trim) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (path, reason) = line
            .split_once(char::is_whitespace)
            .ok_or_else(|| format!("the skip file gives no reason for {line}"))?;
        let before = skips.insert(path.to_string(), reason.trim().to_string());
        if before.is_some() {
            return Err(format!("the skip file names {path} twice"));
        }
    }
    Ok(skips)
}

/// The levels that a vector belongs to and that are requested.
fn levels(vector: &Vector, options: &Options) -> Vec<Level> {
    let of_kind: &[Level] = match vector.kind {
        Kind::Valid | Kind::Invalid => &[Level::Core, Level::Full],
        Kind::Limits => &[Level::Limits],
        Kind::Sessions => &[Level::Sessions],
        Kind::Queries => &[Level::Core, Level::Full, Level::Queries],
    };
    let requested = |level: &Level| {
        let with_full = *level == Level::Core && options.levels.contains(&Level::Full);
        options.levels.contains(level) || with_full
    };
    of_kind.iter().copied().filter(requested).collect()
}

/// Runs one vector through the decoder. Also whether it always answered.
fn one(program: &mut dyn Program, vector: &Vector, options: &Options) -> (Outcome, bool) {
    let levels = levels(vector, options);
    let mut outcome = empty(vector, options);
    let mut answered = true;
    for stage in Stage::ALL {
        let levels: Vec<Level> = levels
            .iter()
            .copied()
            .filter(|level| stage.levels().contains(level))
            .collect();
        if levels.is_empty() {
            continue;
        }
        let (found, stop) = checks::run(stage, program, vector, options);
        outcome.requests += found.requests;
        outcome.left_out += found.left_out;
        answered &= !matches!(stop, Err(Stop::NoAnswer));
        for level in levels {
            // A stream that is wrongly accepted has no fault to compare: what fails at the level
            // below fails at this one.
            let failed = found.failures.iter().any(|failure| failure.level <= level);
            let verdict = match stop {
                _ if failed => Verdict::Failed,
                Err(Stop::NotImplemented) => Verdict::NotImplemented,
                _ => Verdict::Passed,
            };
            outcome.verdicts.push((level, verdict));
        }
        let decides = |failure: &Failure| {
            let mut verdicts = outcome.verdicts.iter();
            verdicts.any(|(level, verdict)| *verdict == Verdict::Failed && failure.level <= *level)
        };
        let failures = found.failures.into_iter().filter(decides);
        outcome.failures.extend(failures.collect::<Vec<_>>());
    }
    skip(&mut outcome);
    (outcome, answered)
}

fn empty(vector: &Vector, options: &Options) -> Outcome {
    let path = vector.path();
    Outcome {
        area: vector.area.clone(),
        clauses: vector.info.clauses.clone(),
        verdicts: Vec::new(),
        failures: Vec::new(),
        left_out: 0,
        skip: options.skips.get(&path).cloned(),
        requests: 0,
        path,
    }
}

/// Does what the skip file says.
fn skip(outcome: &mut Outcome) {
    let Some(reason) = &outcome.skip else {
        return;
    };
    let passed = outcome.passed();
    let verdict = if passed {
        Verdict::Failed
    } else {
        Verdict::Skipped
    };
    outcome.failures.clear();
    outcome.left_out = 0;
    if passed {
        outcome.failures.push(Failure {
            level: outcome.verdicts.first().map_or(Level::Core, |v| v.0),
            check: "skip file".to_string(),
            expected: format!("a failure, since it is to be skipped: {reason}"),
            got: "it passes; take it off the skip file".to_string(),
        });
    }
    for (_, old) in &mut outcome.verdicts {
        *old = verdict;
    }
}

/// A vector that is not run any more.
fn given_up(vector: &Vector, options: &Options) -> Outcome {
    let mut outcome = empty(vector, options);
    let levels = levels(vector, options).into_iter();
    outcome.verdicts = levels.map(|level| (level, Verdict::Failed)).collect();
    outcome.failures.push(Failure {
        level: outcome.verdicts[0].0,
        check: NOT_RUN.to_string(),
        expected: "an answer".to_string(),
        got: format!("{GIVE_UP} vectors of this kind in a row went without an answer"),
    });
    skip(&mut outcome);
    outcome
}
