//! What a decoder is asked and what it answers (`conformance/README.md`), and our own decoder as
//! one that answers.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use dapple_codec::{Decoder, Error, Event, Limit, Limits, LiveTrack, Model};
use serde::{Deserialize, Serialize};

use crate::dump;

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

/// AO at a grid-space position (metres) with a unit normal on a track of `points`.
pub type Sampler = fn(&Decoder, &LiveTrack, [f32; 3], [f32; 3]) -> f32;

/// Irradiance and filtered radiance, RGB each, of a surface in a track of `probes`.
pub type LightSampler = fn(&Decoder, &LiveTrack, &Surface) -> [[f32; 3]; 2];

/// What is lit, in grid space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Metres.
    pub position: [f32; 3],
    /// Unit.
    pub normal: [f32; 3],
    /// Unit, to the viewer.
    pub view: [f32; 3],
    /// 0 to 1.
    pub roughness: f32,
    /// How probes are weighed.
    pub interpolation: Interpolation,
}

/// How the probes about a place are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// By distance along the axes alone.
    Trilinear,
    /// By what each probe can see of the place as well (Chebyshev).
    VisibilityWeighted,
}

impl Interpolation {
    /// All.
    pub const ALL: [Interpolation; 2] =
        [Interpolation::Trilinear, Interpolation::VisibilityWeighted];

    /// Its name in the specification.
    pub fn name(self) -> &'static str {
        match self {
            Interpolation::Trilinear => "trilinear",
            Interpolation::VisibilityWeighted => "visibility-weighted",
        }
    }
}

/// Our own decoder once it has taken in a whole stream.
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

/// A decoder that can be asked.
pub trait Program {
    /// Asks.
    ///
    /// # Errors
    /// A sentence on what the decoder did instead of answering.
    fn ask(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String>;

    /// One more that answers the same, for another thread; `None` where requests have to come one
    /// after the other.
    fn another(&self) -> Option<Box<dyn Program + Send>> {
        None
    }
}

/// `dapple-codec`, in this process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Own {
    /// What queries of AO are answered with.
    pub sampler: Option<Sampler>,
    /// What queries of light are answered with.
    pub light: Option<LightSampler>,
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

impl Program for Own {
    fn ask(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
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
    // What a push left behind at a fault.
    let mut held: &[u8] = &[];
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
                    fed = std::mem::take(&mut held);
                    push(decoder, fed, arguments.pieces, &mut output)
                } else {
                    Ok(())
                }
            }
            None if line == "reset" => {
                decoder.reset();
                held = &[];
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
                held = fed.get(used..).unwrap_or(&[]);
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

impl Own {
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
        if self.sampler.is_none() && self.light.is_none() {
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
            let asked = ask(decoder, line).ok_or_else(|| format!("{line}: no query"))?;
            let values = match (asked, self.sampler, self.light) {
                ((live, Asked::Ao(x, n)), Some(sampler), _) => {
                    vec![sampler(decoder, live, x, n)]
                }
                ((live, Asked::Light(surface)), _, Some(light)) => {
                    light(decoder, live, &surface).concat()
                }
                _ => return Ok(not_implemented),
            };
            let words: Vec<String> = values.iter().map(f32::to_string).collect();
            let _ = writeln!(output, "{}", words.join(" "));
        }
        Ok(Answer {
            status: Status::Complete,
            output: output.into_bytes(),
        })
    }
}

/// Metres a unit of a query's position.
pub const POSITION_UNIT: f32 = 1.0 / 65536.0;

/// What a line asks for.
enum Asked {
    /// AO at a position with a unit normal.
    Ao([f32; 3], [f32; 3]),
    /// Light.
    Light(Surface),
}

/// What a line asks of which track; `None` where it is no query of one that there is.
fn ask<'d>(decoder: &'d Decoder, line: &str) -> Option<(&'d LiveTrack, Asked)> {
    let (track, rest) = line.split_once(' ')?;
    let track: u32 = track.parse().ok()?;
    let mut tracks = decoder.tracks().iter();
    let live = tracks.find(|live| live.track.id == track)?;
    let probes = matches!(live.track.model, Model::Probes(_));
    let (numbers, interpolation) = match probes {
        true => rest.rsplit_once(' ')?,
        false => (rest, ""),
    };
    let numbers: Vec<i32> = numbers
        .split(' ')
        .map(|word| word.parse().ok())
        .collect::<Option<_>>()?;
    let (&[x, y, z, nx, ny, nz], more) = numbers.split_first_chunk()?;
    let position = [x, y, z].map(|v| v as f32 * POSITION_UNIT);
    let normal = unit([nx, ny, nz])?;
    let asked = match *more {
        [] if !probes => Asked::Ao(position, normal),
        [vx, vy, vz, roughness @ 0..=65536] if probes => Asked::Light(Surface {
            position,
            normal,
            view: unit([vx, vy, vz])?,
            roughness: roughness as f32 / 65536.0,
            interpolation: *Interpolation::ALL
                .iter()
                .find(|i| i.name() == interpolation)?,
        }),
        _ => return None,
    };
    Some((live, asked))
}

/// The unit vector of a direction; `None` of none.
fn unit(direction: [i32; 3]) -> Option<[f32; 3]> {
    let direction = direction.map(f64::from);
    let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length > 0.0).then(|| direction.map(|v| (v / length) as f32))
}
