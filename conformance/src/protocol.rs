//! Requests to a decoder and its answers (`conformance/README.md`).

use std::collections::BTreeMap;

use dapple_codec::{Limit, Limits};
use serde::{Deserialize, Serialize};

/// What to do with the input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Decode it as a stream.
    #[default]
    Stream,
    /// Run it as a session script.
    Session,
    /// Decode the stream in it, and look up what follows.
    Queries,
}

/// The arguments of a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Arguments {
    /// What to do.
    pub mode: Mode,
    /// Limits other than the defaults, by name.
    pub limits: BTreeMap<String, u64>,
    /// The input may stop after any commit.
    pub live: bool,
    /// More input may come: no end and no fault is [`Status::NeedInput`].
    pub partial: bool,
    /// Bytes that the decoder is fed at a time; 0 for all at once.
    pub pieces: usize,
}

/// How a request ended; the exit code of a one-shot decoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The stream is complete, or the script was run.
    Complete = 0,
    /// The stream was refused; the last line of the output says why.
    Refused = 1,
    /// No fault so far, and no end.
    NeedInput = 2,
    /// The decoder does not do this.
    NotImplemented = 89,
}

/// A fault as the protocol reports it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// `framing`, `record`, `codec` or `session`.
    pub layer: String,
    /// Stable number.
    pub id: u16,
    /// Byte offset in the stream.
    pub offset: u64,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// How it ended.
    pub status: Status,
    /// Dump, transcript, or values of queries.
    pub output: Vec<u8>,
}

/// What was put out before a fault, and the fault; none where the last line does not state it.
pub fn split(answer: &Answer) -> (&[u8], Option<Fault>) {
    if answer.status != Status::Refused {
        return (&answer.output, None);
    }
    let end = answer.output.len().saturating_sub(1);
    let line = answer.output[..end].iter().rposition(|&byte| byte == b'\n');
    let (dump, last) = answer.output.split_at(line.map_or(0, |at| at + 1));
    // No line of a dump begins with a brace.
    match last.first() {
        Some(b'{') => (dump, serde_json::from_slice(last).ok()),
        _ => (&answer.output, None),
    }
}

/// A decoder that answers requests.
pub trait Program {
    /// Sends a request and returns the answer.
    ///
    /// # Errors
    /// A sentence on what the decoder did instead of answering.
    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String>;

    /// Whether it can be started.
    ///
    /// # Errors
    /// A sentence on why it cannot.
    fn check(&mut self) -> Result<(), String> {
        Ok(())
    }

    /// One more that answers the same, for another thread; `None` where requests have to come one
    /// after the other.
    fn another(&self) -> Option<Box<dyn Program + Send>> {
        None
    }
}

impl Arguments {
    /// The words of a command line or batch request.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        match self.mode {
            Mode::Stream => {}
            Mode::Session => words.push("--session".to_string()),
            Mode::Queries => words.push("--queries".to_string()),
        }
        for (name, value) in &self.limits {
            words.extend(["--limit".to_string(), format!("{name}={value}")]);
        }
        if self.live {
            words.push("--live".to_string());
        }
        if self.partial {
            words.push("--partial".to_string());
        }
        if self.pieces > 0 {
            words.extend(["--pieces".to_string(), self.pieces.to_string()]);
        }
        words
    }

    /// Reads such words.
    ///
    /// # Errors
    /// A sentence that names the word.
    pub fn parse<'w>(words: impl IntoIterator<Item = &'w str>) -> Result<Arguments, String> {
        let mut arguments = Arguments::default();
        let mut words = words.into_iter();
        while let Some(word) = words.next() {
            match word {
                "--session" => arguments.mode = Mode::Session,
                "--queries" => arguments.mode = Mode::Queries,
                "--live" => arguments.live = true,
                "--partial" => arguments.partial = true,
                "--pieces" => {
                    let value = words.next().and_then(|value| value.parse().ok());
                    arguments.pieces = value.ok_or("--pieces needs a number")?;
                }
                "--limit" => {
                    let pair = words.next().and_then(|pair| pair.split_once('='));
                    let (name, value) = pair.ok_or("--limit needs NAME=VALUE")?;
                    let value = value
                        .parse()
                        .map_err(|_| format!("--limit {name} needs a number"))?;
                    arguments.limits.insert(name.to_string(), value);
                    limits(&arguments.limits)?;
                }
                _ => return Err(format!("{word}: no such argument")),
            }
        }
        Ok(arguments)
    }
}

/// The default limits with some replaced, by name.
///
/// # Errors
/// A sentence that names the limit that does not exist or is out of range.
pub fn limits(named: &BTreeMap<String, u64>) -> Result<Limits, String> {
    let mut limits = Limits::default();
    for (name, &value) in named {
        let which = Limit::ALL.iter().find(|which| which.name() == name);
        let &which = which.ok_or_else(|| format!("{name}: no such limit"))?;
        if !limits.set(which, value) {
            return Err(format!("{name}: at most {}", u32::MAX));
        }
    }
    Ok(limits)
}
