//! The reference decoder, `dapple-codec`, as a program that answers requests in this process.

use std::fmt::Write as _;

use dapple_codec::{Decoder, Error, Event, Limits};

use crate::dump;
use crate::models::{self, NoAnswer, Samplers};
use crate::protocol::{Answer, Arguments, Mode, Program, Status, limits};

/// The reference decoder.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference {
    /// What queries are answered with; those of a model without a sampler are not implemented.
    pub samplers: Samplers,
}

/// The reference decoder after a whole stream.
///
/// # Errors
/// The stream's first fault, or none where it has no end.
pub fn decoded(stream: &[u8]) -> Result<Decoder, Option<Error>> {
    let mut decoder = Decoder::new(Limits::default());
    let mut input = stream;
    loop {
        let (used, event) = decoder.push(input).map_err(Some)?;
        input = &input[used..];
        match event {
            Event::End => return Ok(decoder),
            Event::NeedInput => return Err(None),
            _ => {}
        }
    }
}

impl Program for Reference {
    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
        let mut decoder = Decoder::new(limits(&arguments.limits)?);
        match arguments.mode {
            Mode::Stream => Ok(stream(&mut decoder, arguments, input)),
            Mode::Session => session(&mut decoder, arguments, input),
            Mode::Queries => self.queries(&mut decoder, arguments, input),
        }
    }

    fn another(&self) -> Option<Box<dyn Program + Send>> {
        Some(Box::new(*self))
    }
}

fn stream(decoder: &mut Decoder, arguments: &Arguments, input: &[u8]) -> Answer {
    let mut output = dump::HEAD.to_string();
    let mut result = push(decoder, input, arguments.pieces, &mut output);
    let mut status = Status::Complete;
    if result.is_ok() {
        if arguments.partial && decoder.finish().is_err() {
            status = Status::NeedInput;
        } else if arguments.live {
            result = decoder.finish_live();
        } else {
            result = decoder.finish();
        }
    }
    if let Err(error) = result {
        let _ = writeln!(
            output,
            "{{\"layer\":\"{}\",\"id\":{},\"offset\":{}}}",
            error.layer.name(),
            error.id,
            error.offset
        );
        status = Status::Refused;
    }
    Answer {
        status,
        output: output.into_bytes(),
    }
}

/// Feeds all of `input`, or up to the first fault.
fn push(
    decoder: &mut Decoder,
    input: &[u8],
    pieces: usize,
    output: &mut String,
) -> Result<(), Error> {
    let piece_bytes = if pieces == 0 { input.len() } else { pieces };
    for piece in input.chunks(piece_bytes.max(1)) {
        let mut rest = piece;
        while !rest.is_empty() {
            let (consumed, event) = decoder.push(rest)?;
            dump::event(decoder, event, output);
            rest = &rest[consumed..];
        }
    }
    Ok(())
}

/// The error of a decoder that is pushed on after one.
const STOPPED: u16 = 4011;

/// Runs a session script.
fn session(decoder: &mut Decoder, arguments: &Arguments, script: &[u8]) -> Result<Answer, String> {
    let mut output = dump::HEAD.to_string();
    // Bytes of a push that a decoder left when it stopped.
    let mut kept: &[u8] = &[];
    let mut script = script;
    while let Some(end) = script.iter().position(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(&script[..end]).into_owned();
        script = &script[end + 1..];
        let before = decoder.position();
        let mut fed: &[u8] = &[];
        let result = match line.split_once(' ') {
            Some(("push", length)) => {
                let length: usize = length.parse().map_err(|_| format!("{line}: no length"))?;
                let bytes = script.get(..length);
                fed = bytes.ok_or_else(|| format!("{line}: fewer bytes follow"))?;
                script = &script[length..];
                push(decoder, fed, arguments.pieces, &mut output)
            }
            None if line == "resume" => {
                let resumed = decoder.resume();
                let _ = writeln!(output, "resume {}", if resumed { "yes" } else { "no" });
                if resumed {
                    fed = std::mem::take(&mut kept);
                    push(decoder, fed, arguments.pieces, &mut output)
                } else {
                    Ok(())
                }
            }
            None if line == "reset" => {
                decoder.reset();
                kept = &[];
                output.push_str("reset\n");
                Ok(())
            }
            None if line == "finish" || line == "finish-live" => {
                let finished = match line.as_str() {
                    "finish" => decoder.finish(),
                    _ => decoder.finish_live(),
                };
                if finished.is_ok() {
                    output.push_str("finished\n");
                }
                finished
            }
            _ => return Err(format!("{line}: no such step of a session")),
        };
        if let Err(error) = result {
            let used = (decoder.position() - before) as usize;
            // A push into a decoder that has stopped is lost; what it stopped in is not.
            if !fed.is_empty() && error.id != STOPPED {
                kept = fed.get(used..).unwrap_or(&[]);
            }
            let _ = writeln!(
                output,
                "error {} {} {}",
                error.layer.name(),
                error.id,
                error.offset
            );
        }
    }
    Ok(Answer {
        status: Status::Complete,
        output: output.into_bytes(),
    })
}

impl Reference {
    fn queries(
        &self,
        decoder: &mut Decoder,
        arguments: &Arguments,
        input: &[u8],
    ) -> Result<Answer, String> {
        let not_implemented = Answer {
            status: Status::NotImplemented,
            output: Vec::new(),
        };
        if self.samplers.is_empty() {
            return Ok(not_implemented);
        }
        let short = || "the queries end within the stream".to_string();
        let (length, rest) = input.split_first_chunk::<4>().ok_or_else(short)?;
        let length = u32::from_le_bytes(*length) as usize;
        let (bytes, lines) = rest.split_at_checked(length).ok_or_else(short)?;
        let decoded = stream(decoder, arguments, bytes);
        if decoded.status != Status::Complete {
            return Ok(decoded);
        }
        let lines = str::from_utf8(lines).map_err(|_| "the queries are not text")?;
        let mut output = String::new();
        for line in lines.lines() {
            match self.query(decoder, line) {
                Ok(values) => {
                    let words: Vec<String> = values.iter().map(f32::to_string).collect();
                    let _ = writeln!(output, "{}", words.join(" "));
                }
                Err(NoAnswer::NoQuery) => return Err(format!("{line}: no query")),
                Err(NoAnswer::NotImplemented) => return Ok(not_implemented),
            }
        }
        Ok(Answer {
            status: Status::Complete,
            output: output.into_bytes(),
        })
    }

    /// The numbers that answer a query line.
    fn query(&self, decoder: &Decoder, line: &str) -> Result<Vec<f32>, NoAnswer> {
        let (track, words) = line.split_once(' ').ok_or(NoAnswer::NoQuery)?;
        let track: u32 = track.parse().map_err(|_| NoAnswer::NoQuery)?;
        let mut tracks = decoder.tracks().iter();
        let live = tracks.find(|live| live.track.id == track);
        let live = live.ok_or(NoAnswer::NoQuery)?;
        models::of(&live.track.model).answer(&self.samplers, decoder, live, words)
    }
}
