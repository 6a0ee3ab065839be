//! The requests about a vector, and the expected answers.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::models::Query;
use crate::options::{Level, Options};
use crate::protocol::{Answer, Arguments, Fault, Mode, Program, Status, split};
use crate::reference::Reference;
use crate::vector::{Kind, Vector, sha256};

/// A check that failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The lowest level that needs it.
    pub level: Level,
    /// What was done.
    pub check: String,
    /// What should have come of it.
    pub expected: String,
    /// Its result.
    pub got: String,
}

/// Why a vector was left before all requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The decoder does not do this.
    NotImplemented,
    /// The decoder gave no answer; the failure is among the others.
    NoAnswer,
}

/// What was found out about a vector.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The first few failures.
    pub failures: Vec<Failure>,
    /// How many more there are.
    pub left_out: u64,
    /// Requests made.
    pub requests: u64,
}

/// Failures of a vector that are kept: a decoder that gets all prefixes wrong needs no thousand.
const KEPT: usize = 4;

/// Vectors up to this size have every prefix tried, and their bits flipped.
const SMALL: usize = 4096;

/// The error of bytes after the end: the one fault that a complete stream can be a prefix of.
const TRAILING: u16 = 1020;

/// A part of the checks, which decides about some levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The stream of a vector, whole and in parts.
    Stream,
    /// The script of a session.
    Session,
    /// The look-ups of a query vector.
    Queries,
}

impl Stage {
    /// All.
    pub const ALL: [Stage; 3] = [Stage::Stream, Stage::Session, Stage::Queries];

    /// The levels that it decides about.
    pub fn levels(self) -> &'static [Level] {
        match self {
            Stage::Stream => &[Level::Core, Level::Full, Level::Limits],
            Stage::Session => &[Level::Sessions],
            Stage::Queries => &[Level::Queries],
        }
    }
}

/// Makes the checks of a stage.
pub fn run(
    stage: Stage,
    program: &mut dyn Program,
    vector: &Vector,
    options: &Options,
) -> (Found, Result<(), Stop>) {
    let lowest = match vector.kind {
        Kind::Limits => Level::Limits,
        _ => stage.levels()[0],
    };
    let mut checks = Checks {
        program,
        vector,
        options,
        lowest,
        found: Found::default(),
    };
    let stop = match stage {
        Stage::Stream => checks.stream(),
        Stage::Session => checks.session(),
        Stage::Queries => checks.queries(),
    };
    (checks.found, stop)
}

struct Checks<'a> {
    program: &'a mut dyn Program,
    vector: &'a Vector,
    options: &'a Options,
    /// Level of what everyone has to get right.
    lowest: Level,
    found: Found,
}

impl Checks<'_> {
    /// The whole stream, byte by byte, its prefixes, and its neighbours by one bit.
    fn stream(&mut self) -> Result<(), Stop> {
        let vector = self.vector;
        let mut arguments = self.arguments(Mode::Stream);
        arguments.live = vector.info.live;
        let whole = self.request("decode", &arguments, &vector.bytes)?;
        self.judge("decode", &arguments, &whole);
        let bytewise = Arguments {
            pieces: 1,
            ..arguments.clone()
        };
        let answer = self.request("byte by byte", &bytewise, &vector.bytes)?;
        self.judge("byte by byte", &bytewise, &answer);
        self.prefixes(&whole)?;
        if vector.info.error.is_none() && vector.bytes.len() <= SMALL {
            self.flips(&arguments, &whole)?;
        }
        Ok(())
    }

    /// Compares an answer about the whole stream with the vector.
    fn judge(&mut self, check: &str, arguments: &Arguments, answer: &Answer) {
        let info = &self.vector.info;
        let (dump, fault) = split(answer);
        let (status, hash) = match info.error {
            None => (Status::Complete, &info.dump_sha256),
            Some(_) => (Status::Refused, &info.released_sha256),
        };
        let expected = match &info.error {
            None => "accepted".to_string(),
            Some(fault) => format!("refused with {}", fault_text(Some(fault))),
        };
        if answer.status != status || unexplained(answer) {
            self.fail(self.lowest, check, expected, verdict_text(answer));
            return;
        }
        if hash.as_ref() != Some(&sha256(dump)) {
            self.differs(check, arguments, hash.as_deref(), answer);
        }
        if fault != info.error {
            self.fail(self.full(), check, expected, verdict_text(answer));
        }
    }

    /// No proper prefix is a stream, and what it releases the whole releases, too.
    fn prefixes(&mut self, whole: &Answer) -> Result<(), Stop> {
        let vector = self.vector;
        let length = vector.bytes.len();
        let Some(step) = self.options.prefixes.step() else {
            return Ok(());
        };
        let lengths: Vec<usize> = if self.options.partial && length <= SMALL {
            (0..length).step_by(step).collect()
        } else {
            let mut few = vec![0, 16, length / 3, length / 2, length.saturating_sub(1)];
            few.retain(|&few| few < length);
            few.sort_unstable();
            few.dedup();
            few
        };
        let mut arguments = self.arguments(Mode::Stream);
        arguments.partial = self.options.partial;
        let fault = vector.info.error.as_ref();
        for length in lengths {
            let check = format!("prefix of {length} bytes");
            let bytes = &vector.bytes[..length];
            let answer = self.request(&check, &arguments, bytes)?;
            let (dump, found) = split(&answer);
            let got = || verdict_text(&answer);
            match answer.status {
                _ if unexplained(&answer) => {
                    let expected = "a last line that states layer, id and offset".to_string();
                    self.fail(self.lowest, &check, expected, got());
                    continue;
                }
                Status::Complete if fault.is_some_and(|fault| fault.id == TRAILING) => {}
                Status::NeedInput if arguments.partial => {}
                Status::Refused if !arguments.partial => {}
                Status::Refused if fault.is_some() => {
                    if found.as_ref() != fault {
                        let expected = format!("need_input or {}", fault_text(fault));
                        self.fail(self.full(), &check, expected, got());
                        continue;
                    }
                }
                _ => {
                    let expected = if arguments.partial {
                        "need_input"
                    } else {
                        "refused"
                    };
                    self.fail(self.lowest, &check, expected.to_string(), got());
                    continue;
                }
            }
            if !split(whole).0.starts_with(dump) {
                let expected = "the beginning of what the whole stream gives".to_string();
                self.fail(self.lowest, &check, expected, "something else".to_string());
            } else {
                self.compare(&check, &arguments, bytes, &answer);
            }
        }
        Ok(())
    }

    /// A stream with one wrong bit is refused, or the bit means nothing.
    fn flips(&mut self, arguments: &Arguments, whole: &Answer) -> Result<(), Stop> {
        let Some(step) = self.options.flips.step() else {
            return Ok(());
        };
        let mut bytes = self.vector.bytes.clone();
        for bit in (0..bytes.len() * 8).step_by(step) {
            let (byte, mask) = (bit / 8, 1 << (bit % 8));
            let check = format!("bit {} of byte {byte} flipped", bit % 8);
            bytes[byte] ^= mask;
            let answer = self.request(&check, arguments, &bytes)?;
            let same = answer.status == Status::Complete && answer.output == whole.output;
            let refused = answer.status == Status::Refused && !unexplained(&answer);
            if refused || same {
                self.compare(&check, arguments, &bytes, &answer);
            } else {
                let expected = "refused, or the same dump".to_string();
                let got = match answer.status {
                    Status::Complete => "accepted with another dump".to_string(),
                    _ => verdict_text(&answer),
                };
                self.fail(self.lowest, &check, expected, got);
            }
            bytes[byte] ^= mask;
        }
        Ok(())
    }

    /// The script, whole and byte by byte.
    fn session(&mut self) -> Result<(), Stop> {
        let vector = self.vector;
        for (check, pieces) in [("session", 0), ("session byte by byte", 1)] {
            let arguments = Arguments {
                pieces,
                ..self.arguments(Mode::Session)
            };
            let answer = self.request(check, &arguments, &vector.bytes)?;
            let hash = &vector.info.transcript_sha256;
            if answer.status != Status::Complete {
                let expected = "the script run to its end, and exit code 0".to_string();
                self.fail(self.lowest, check, expected, verdict_text(&answer));
            } else if hash.as_ref() != Some(&sha256(&answer.output)) {
                self.differs(check, &arguments, hash.as_deref(), &answer);
            }
        }
        Ok(())
    }

    /// Each look-up, in its interval.
    fn queries(&mut self) -> Result<(), Stop> {
        let vector = self.vector;
        let queries = &vector.info.queries;
        let input = query_input(&vector.bytes, queries);
        let answer = self.request("queries", &self.arguments(Mode::Queries), &input)?;
        let text = String::from_utf8_lossy(&answer.output);
        let lines: Vec<&str> = text.lines().collect();
        if answer.status != Status::Complete || lines.len() != queries.len() {
            let expected = format!("{} lines", queries.len());
            let got = match answer.status {
                Status::Complete => format!("{} lines", lines.len()),
                _ => verdict_text(&answer),
            };
            self.fail(self.lowest, "queries", expected, got);
            return Ok(());
        }
        for (number, (query, line)) in queries.iter().zip(lines).enumerate() {
            let numbers: Option<Vec<f64>> = line
                .split_whitespace()
                .map(|word| word.parse().ok())
                .collect();
            if !numbers.is_some_and(|numbers| query.accepts(&numbers)) {
                let check = format!("query {number}: {}", query.line());
                let intervals = query.intervals();
                let intervals = intervals
                    .iter()
                    .map(|[low, high]| format!("{low} to {high}"));
                let expected = intervals.collect::<Vec<_>>().join(", ");
                self.fail(
                    self.lowest,
                    &check,
                    expected,
                    shown(format!("{line}\n").as_bytes()),
                );
            }
        }
        Ok(())
    }

    fn arguments(&self, mode: Mode) -> Arguments {
        Arguments {
            mode,
            limits: self.vector.info.limits.clone(),
            ..Arguments::default()
        }
    }

    /// The level that needs layer, number and offset.
    fn full(&self) -> Level {
        match self.lowest {
            Level::Core => Level::Full,
            other => other,
        }
    }

    fn request(
        &mut self,
        check: &str,
        arguments: &Arguments,
        input: &[u8],
    ) -> Result<Answer, Stop> {
        self.found.requests += 1;
        match caught(self.program, arguments, input) {
            // Whoever has answered about the vector does implement it: later this is a wrong
            // answer as any other.
            Ok(answer) if answer.status == Status::NotImplemented && self.found.requests == 1 => {
                Err(Stop::NotImplemented)
            }
            Ok(answer) => Ok(answer),
            Err(error) => {
                self.fail(self.lowest, check, "an answer".to_string(), error);
                Err(Stop::NoAnswer)
            }
        }
    }

    fn fail(&mut self, level: Level, check: &str, expected: String, got: String) {
        // The first at each level is kept: it decides about the level.
        let failures = &mut self.found.failures;
        if failures.len() < KEPT || failures.iter().all(|failure| failure.level > level) {
            failures.push(Failure {
                level,
                check: check.to_string(),
                expected,
                got,
            });
        } else {
            self.found.left_out += 1;
        }
    }

    /// Compares a verdict that no file states with that of the reference decoder.
    fn compare(&mut self, check: &str, arguments: &Arguments, input: &[u8], answer: &Answer) {
        if !self.options.compare {
            return;
        }
        let reference = match caught(&mut Reference::default(), arguments, input) {
            Ok(reference) => reference,
            // Nobody knows what the answer is worth then, and that must not look like a pass.
            Err(error) => {
                let expected = "what the reference decoder answers".to_string();
                self.fail(
                    self.lowest,
                    check,
                    expected,
                    format!("its failure: {error}"),
                );
                return;
            }
        };
        let (reference_dump, reference_fault) = split(&reference);
        let (dump, fault) = split(answer);
        let expected = verdict_text(&reference);
        if reference.status != answer.status {
            self.fail(self.lowest, check, expected, verdict_text(answer));
        } else if reference_dump != dump {
            let (expected, got) = first_difference(reference_dump, dump);
            self.fail(self.lowest, check, expected, got);
        } else if reference_fault != fault {
            self.fail(self.full(), check, expected, verdict_text(answer));
        }
    }

    /// Another output than the hash stands for: shown by its first wrong line, where the reference
    /// decoder has the right one.
    fn differs(&mut self, check: &str, arguments: &Arguments, hash: Option<&str>, answer: &Answer) {
        let reference = caught(&mut Reference::default(), arguments, &self.vector.bytes);
        let got = split(answer).0;
        let lines = match &reference {
            Ok(reference) if hash == Some(&sha256(split(reference).0)) => {
                first_difference(split(reference).0, got)
            }
            _ => (
                format!("output with SHA-256 {}", hash.unwrap_or("unknown")),
                format!("{} bytes with SHA-256 {}", got.len(), sha256(got)),
            ),
        };
        self.fail(self.lowest, check, lines.0, lines.1);
    }
}

/// Sends a request; a panic of the reference decoder, which runs in this process, is no answer and stops nothing.
fn caught(
    program: &mut dyn Program,
    arguments: &Arguments,
    input: &[u8],
) -> Result<Answer, String> {
    let answer = catch_unwind(AssertUnwindSafe(|| program.request(arguments, input)));
    answer.unwrap_or_else(|_| Err("a panic".to_string()))
}

/// The input of a query request: the stream with its length, and a line for each query.
pub fn query_input(stream: &[u8], queries: &[Query]) -> Vec<u8> {
    let mut input = (stream.len() as u32).to_le_bytes().to_vec();
    input.extend(stream);
    for query in queries {
        input.extend(query.line().bytes());
        input.push(b'\n');
    }
    input
}

/// A refusal that does not say of what: so ends a program that dies with exit code 1, too.
fn unexplained(answer: &Answer) -> bool {
    answer.status == Status::Refused && split(answer).1.is_none()
}

fn fault_text(fault: Option<&Fault>) -> String {
    match fault {
        Some(fault) => format!("{} {} at byte {}", fault.layer, fault.id, fault.offset),
        None => "no line that states layer, id and offset".to_string(),
    }
}

fn verdict_text(answer: &Answer) -> String {
    match answer.status {
        Status::Complete => "accepted".to_string(),
        Status::NeedInput => "need_input".to_string(),
        Status::NotImplemented => "not implemented".to_string(),
        Status::Refused => format!("refused with {}", fault_text(split(answer).1.as_ref())),
    }
}

/// The first lines that differ.
fn first_difference(expected: &[u8], got: &[u8]) -> (String, String) {
    let mut expected = expected.split_inclusive(|&byte| byte == b'\n');
    let mut got = got.split_inclusive(|&byte| byte == b'\n');
    let mut number = 1;
    loop {
        let (want, have) = (expected.next(), got.next());
        if want != have || want.is_none() {
            let text = |line: Option<&[u8]>| match line {
                Some(line) => format!("line {number}: {}", shown(line)),
                None => format!("{} lines", number - 1),
            };
            return (text(want), text(have));
        }
        number += 1;
    }
}

/// A line as reports show it: not too long, with escapes for what a reader would not see or a terminal
/// would act on.
fn shown(line: &[u8]) -> String {
    const LONGEST: usize = 200;
    let (line, end) = match line.strip_suffix(b"\n") {
        Some(line) => (line, ""),
        None => (line, " (no line feed)"),
    };
    let spaces = line.iter().rev().take_while(|&&byte| byte == b' ').count();
    let (line, spaces) = line.split_at(line.len() - spaces);
    let mut text = String::new();
    for chunk in line.utf8_chunks() {
        text.extend(chunk.valid().escape_debug());
        for byte in chunk.invalid() {
            text += &format!("\\x{byte:02x}");
        }
    }
    let cut = text.char_indices().nth(LONGEST).map(|(at, _)| at);
    if let Some(cut) = cut {
        text.truncate(cut);
        text += " ...";
    }
    match spaces.len() {
        0 => {}
        1..=4 => text += &"\\u{20}".repeat(spaces.len()),
        count => text += &format!("\\u{{20}} ({count} times)"),
    }
    text + end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invisible_differences_are_escaped() {
        for (got, text) in [
            (&b"end \n"[..], "line 1: end\\u{20}"),
            (b"end\r\n", "line 1: end\\r"),
            (b"end\0\n", "line 1: end\\0"),
            (b"\xef\xbb\xbfend\n", "line 1: \\u{feff}end"),
            (b"e\xc2\xa0nd\n", "line 1: e\\u{a0}nd"),
            (b"\xffend\n", "line 1: \\xffend"),
            (b"end", "line 1: end (no line feed)"),
        ] {
            let (expected, got) = first_difference(b"end\n", got);
            assert_eq!((expected.as_str(), got.as_str()), ("line 1: end", text));
        }
    }
}
