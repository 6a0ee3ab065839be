//! The command line, one file a command.
//!
//! Rules that hold for all of them: exit code 0 for success, 1 for bad input with one sentence on
//! stderr (`dapple: ...`), 2 for bad usage; `--json` prints one JSON document on stdout and nothing
//! else; long work shows its progress on stderr, and only on a terminal; a reader that closes
//! stdout ends the program silently.

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::{Error, Result};

pub mod args;
pub mod chart;
pub mod compare;
pub mod conformance;
pub mod decode;
pub mod demo;
pub mod encode;
pub mod inspect;
pub mod job;
pub mod limits;
pub mod output;
pub mod progress;
pub mod records;
pub mod render;
pub mod stability;
pub mod stream;
pub mod validate;

/// Streamed and baked low-frequency light: encoder, decoder, reference and measurements.
#[derive(Debug, Parser)]
#[command(name = "dapple", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Encode(encode::Args),
    Render(render::Args),
    Chart(chart::Args),
    Inspect(inspect::Args),
    Validate(validate::Args),
    Decode(decode::Args),
    Compare(compare::Args),
    Stability(stability::Args),
    Conformance(conformance::Args),
}

/// Runs the program on its arguments.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come as errors with exit code 0. A closed stream is no failure.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let result = match cli.command {
        Command::Demo(args) => demo::run(&args),
        Command::Encode(args) => encode::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Chart(args) => chart::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Validate(args) => validate::run(&args),
        Command::Decode(args) => decode::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Stability(args) => stability::run(&args),
        Command::Conformance(args) => conformance::run(&args),
    };
    finish(result)
}

/// The exit code of a command, its error told on stderr.
fn finish(result: Result<ExitCode>) -> ExitCode {
    match result {
        Ok(code) => code,
        Err(error) if output::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::from(1)
        }
    }
}

/// One sentence on stderr.
pub fn tell(error: &Error) {
    // Names and messages come from outside: control characters must not reach the terminal.
    let text: String = error
        .to_string()
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let _ = writeln!(std::io::stderr(), "dapple: {text}");
}
