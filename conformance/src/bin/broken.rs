//! A decoder with a fault of one's choice: `broken FAULT` and then the words of the protocol. What
//! the tests of the runner hold it against.

use std::io::Write as _;
use std::process::{ExitCode, abort, exit};
use std::time::Duration;

use dapple_conformance::protocol::{Answer, Arguments, Program, Status, split};
use dapple_conformance::reference::Reference;
use dapple_conformance::serve;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let Some((fault, words)) = words.split_first() else {
        eprintln!("usage: broken FAULT [WORD]...");
        return ExitCode::from(70);
    };
    if fault == "silent" {
        return ExitCode::SUCCESS;
    }
    let mut broken = Broken {
        fault: fault.clone(),
    };
    serve::main(&mut broken, words)
}

struct Broken {
    fault: String,
}

impl Program for Broken {
    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
        let mut arguments = arguments.clone();
        if self.fault == "limits" {
            arguments.limits.clear();
        }
        let mut answer = Reference::default().request(&arguments, input)?;
        let (dump, error) = split(&answer);
        let dump = dump.to_vec();
        let id = error.as_ref().map_or(0, |error| error.id);
        let stdout = &mut std::io::stdout();
        match self.fault.as_str() {
            // Digits that are wrong, here and there.
            "dump" => answer.output = changed(&answer.output, "frame 0 0", "frame 0 1"),
            "id" => answer.output = changed(&answer.output, "\"id\":1", "\"id\":2"),
            "offset" => answer.output = changed(&answer.output, "\"offset\":", "\"offset\":1"),
            "no-line" => answer.output = dump,
            "cut-dump" if arguments.pieces == 1 => answer.output.truncate(14),
            "session" => answer.output = changed(&answer.output, "resume yes", "resume no"),
            // Checks that are not made.
            "prefix" if answer.status == Status::NeedInput || id == 1019 => {
                answer = Answer {
                    status: Status::Complete,
                    output: dump,
                };
            }
            "checksum" if id == 1011 => {
                answer = Answer {
                    status: Status::Complete,
                    output: dump,
                };
            }
            "eager" if answer.status == Status::NeedInput => {
                answer.status = Status::Refused;
                answer
                    .output
                    .extend(b"{\"layer\":\"framing\",\"id\":1019,\"offset\":0}\n");
            }
            "not-implemented" => answer.status = Status::NotImplemented,
            "later-89" if arguments.pieces == 1 => answer.status = Status::NotImplemented,
            // No answers.
            "hang" => loop {
                std::thread::sleep(Duration::from_secs(1));
            },
            "abort" => {
                eprintln!("last words\n");
                abort();
            }
            "exit" => exit(7),
            "memory" => {
                let much = vec![1u8; 2 << 30];
                answer.output.extend(&much[..1]);
            }
            "flood" => while stdout.write_all(&[b'x'; 4096]).is_ok() {},
            "garbage" => {
                let _ = stdout.write_all(b"hello\n");
                exit(0);
            }
            "cut-answer" => {
                let _ = stdout.write_all(&[0, 100, 0, 0, 0, b'd']);
                exit(0);
            }
            "twice" => {
                let _ = stdout.write_all(&[0, 0, 0, 0, 0]);
            }
            _ => {}
        }
        Ok(answer)
    }
}

fn changed(output: &[u8], from: &str, to: &str) -> Vec<u8> {
    String::from_utf8_lossy(output)
        .replace(from, to)
        .into_bytes()
}
