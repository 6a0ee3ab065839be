//! Writes the vectors of this repository, and `spec/clauses.md`, which ties them to the clauses of
//! the specification: `cargo run -p dapple-conformance --bin generate`. With `--check` it writes
//! nothing and fails where a file differs from what it would write.

use std::process::ExitCode;

use dapple_conformance::vector::Vector;
use dapple_conformance::{clauses, generate, vector};

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
            true => vector::compare(&vector::folder(), &files)?,
            false => vector::write(&vector::folder(), &files)?,
        }
        table(check, &vectors)?;
        Ok(vectors.len())
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

fn table(check: bool, vectors: &[Vector]) -> Result<(), String> {
    let folder = clauses::folder();
    let stated = clauses::read(&clauses::chapters(&folder)?)?;
    let text = clauses::table(&stated, vectors);
    let path = folder.join(clauses::TABLE);
    let at = |e| format!("{}: {e}", path.display());
    match check {
        true if std::fs::read_to_string(&path).map_err(at)? != text => {
            Err(format!("{}: not what the generator writes", path.display()))
        }
        true => Ok(()),
        false => std::fs::write(&path, text).map_err(at),
    }
}
