//! The command line, one file a command.
//!
//! Rules that hold for all of them: exit code 0 for success, 1 for bad input with one sentence on
//! stderr (`dapple: ...`), 2 for bad usage; `--json` prints one JSON document on stdout and nothing
//! else; long work shows its progress on stderr, and only on a terminal; a reader that closes
//! stdout ends the program silently. Outputs are [`NewFile`](crate::files::NewFile)s: they appear
//! whole or not at all, never replace an input, and their folders are made. An option that has no
//! effect is told ([`effects`]).

use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::{Error, Result};
use effects::Given;

pub mod args;
pub mod attach;
pub mod bake;
pub mod chart;
pub mod compare;
pub mod conformance;
pub mod decode;
pub mod demo;
pub mod effects;
pub mod encode;
pub mod gltf_output;
pub mod inputs;
pub mod inspect;
pub mod interrupt;
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
    Bake(bake::Args),
    Attach(attach::Args),
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
    let mut command = Cli::command();
    let matches = command.try_get_matches_from_mut(std::env::args_os());
    let parsed = matches.and_then(|m| Ok((Cli::from_arg_matches(&m)?, m)));
    let (cli, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help and version come as errors with exit code 0. A closed stream is no failure.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let given = given(&command, &matches);
    interrupt::listen();
    let result = match cli.command {
        Command::Demo(args) => demo::run(&args, &given),
        Command::Encode(args) => encode::run(&args, &given),
        Command::Bake(args) => bake::run(&args, &given),
        Command::Attach(args) => attach::run(&args),
        Command::Render(args) => render::run(&args, &given),
        Command::Chart(args) => chart::run(&args, &given),
        Command::Inspect(args) => inspect::run(&args),
        Command::Validate(args) => validate::run(&args),
        Command::Decode(args) => decode::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Stability(args) => stability::run(&args),
        Command::Conformance(args) => conformance::run(&args),
    };
    finish(result)
}

/// The options that the user typed after the name of a command.
fn given(command: &clap::Command, matches: &clap::ArgMatches) -> Given {
    let given = matches.subcommand().and_then(|(name, matches)| {
        let command = command.find_subcommand(name)?;
        Some(Given::new(command, matches))
    });
    given.unwrap_or_default()
}

/// The exit code of a command, its error told on stderr.
fn finish(result: Result<ExitCode>) -> ExitCode {
    match result {
        Ok(code) => code,
        Err(error) if output::is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::from(match error {
                Error::Usage(_) => 2,
                _ => 1,
            })
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
