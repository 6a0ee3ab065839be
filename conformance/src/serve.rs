//! A decoder as a program that speaks the protocol, one shot or in batch.

use std::io::{self, Read, Write};
use std::process::ExitCode;

use crate::protocol::{Arguments, Program};

/// Answers the request in the arguments of this process, or with `--batch` all that come.
pub fn main(program: &mut dyn Program, words: &[String]) -> ExitCode {
    let result = if words.iter().any(|word| word == "--batch") {
        batch(program)
    } else {
        one_shot(program, words)
    };
    result.unwrap_or_else(|error| {
        eprintln!("{error}");
        // No answer: none of the protocol's exit codes.
        ExitCode::from(70)
    })
}

fn one_shot(program: &mut dyn Program, words: &[String]) -> Result<ExitCode, String> {
    let arguments = Arguments::parse(words.iter().map(String::as_str))?;
    let mut input = Vec::new();
    let read = io::stdin().lock().read_to_end(&mut input);
    read.map_err(|e| e.to_string())?;
    let answer = program.request(&arguments, &input)?;
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(&answer.output)
        .and_then(|()| stdout.flush());
    written.map_err(|e| e.to_string())?;
    Ok(ExitCode::from(answer.status as u8))
}

fn batch(program: &mut dyn Program) -> Result<ExitCode, String> {
    let (mut stdin, mut stdout) = (io::stdin().lock(), io::stdout().lock());
    while let Some(words) = part(&mut stdin)? {
        let words = String::from_utf8(words).map_err(|_| "the arguments are not text")?;
        let arguments = Arguments::parse(words.split_ascii_whitespace())?;
        let input = part(&mut stdin)?.ok_or("a request without input")?;
        let answer = program.request(&arguments, &input)?;
        let mut bytes = vec![answer.status as u8];
        bytes.extend((answer.output.len() as u32).to_le_bytes());
        bytes.extend(answer.output);
        let written = stdout.write_all(&bytes).and_then(|()| stdout.flush());
        written.map_err(|e| e.to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A length and so many bytes; `None` at the end of the input.
fn part(input: &mut impl Read) -> Result<Option<Vec<u8>>, String> {
    let mut length = [0; 4];
    match input.read_exact(&mut length) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
        Err(error) => return Err(error.to_string()),
    }
    let mut bytes = Vec::new();
    let length = u64::from(u32::from_le_bytes(length));
    let read = input.take(length).read_to_end(&mut bytes);
    if read.map_err(|e| e.to_string())? as u64 != length {
        return Err("a request is cut off".to_string());
    }
    Ok(Some(bytes))
}
