//! Writes the vectors of this repository: `cargo run -p dapple-conformance --bin generate`. With
//! `--check` it writes nothing and fails where a file differs from what it would write.

use std::process::ExitCode;

use dapple_conformance::{generate, vector};

fn main() -> ExitCode {
    let check = match std::env::args().skip(1).collect::<Vec<_>>().as_slice() {
        [] => false,
        [word] if word == "--check" => true,
        _ => {
            eprintln!("usage: generate [--check]");
            return ExitCode::from(2);
        }
    };
    let result = generate::all().and_then(|vectors| {
        let files = vector::files_of(&vectors);
        match check {
            true => vector::compare(&vector::folder(), &files).map(|()| vectors.len()),
            false => vector::write(&vector::folder(), &files).map(|()| vectors.len()),
        }
    });
    match result {
        Ok(count) => {
            println!("{count} vectors");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(1)
        }
    }
}
