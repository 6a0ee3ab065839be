//! An external decoder as a program that answers: started for each request, or once for all.
//!
//! Nothing that the program does may hang or stop the runner. So its pipes have threads of their
//! own, which only talk to us through channels and are never waited for: where the program leaves
//! a pipe open in a process that outlives it, its thread stays behind.

use std::io::{self, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use crate::protocol::{Answer, Arguments, Program, Status};

/// A command line, and what its processes may take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CommandLine {
    /// For the shell; arguments are appended.
    pub command: String,
    /// Time for a request.
    pub timeout: Duration,
    /// Address space in MiB; 0 for no limit. Kept by the shell's `ulimit`.
    pub memory_mib: u64,
}

/// A program that is started for each request.
#[derive(Clone, Debug)]
pub struct OneShot(pub CommandLine);

/// A program that is started once, and again after it failed.
#[derive(Debug)]
pub struct Batch {
    command_line: CommandLine,
    running: Option<Running>,
}

/// No dump of a vector comes near this many bytes.
const MAX_OUTPUT: u32 = 64 << 20;

/// Time that a program has to end by itself once it closed its output.
const GRACE: Duration = Duration::from_millis(500);

impl Program for OneShot {
    fn check(&mut self) -> Result<(), String> {
        check_start(&self.0, &[])
    }

    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
        let deadline = Instant::now() + self.0.timeout;
        let mut process = Process::start(&self.0, &arguments.words())?;
        let requests = writer(process.stdin());
        let _ = requests.send(input.to_vec());
        // The pipe closes after the input.
        drop(requests);
        let outputs = whole_output(process.stdout());
        let output = match outputs.recv_timeout(left(deadline)) {
            Ok(output) => output?,
            Err(_) => return Err(process.timed_out(self.0.timeout)),
        };
        let status = process.wait(deadline);
        let status = status.ok_or_else(|| process.timed_out(self.0.timeout))?;
        let status = match status.code() {
            Some(0) => Status::Complete,
            Some(1) => Status::Refused,
            Some(89) => Status::NotImplemented,
            _ => return Err(process.last_words(&ending(status))),
        };
        Ok(Answer { status, output })
    }
}

impl Batch {
    /// A program that is not started yet.
    pub fn new(command_line: CommandLine) -> Batch {
        Batch {
            command_line,
            running: None,
        }
    }
}

impl Program for Batch {
    fn check(&mut self) -> Result<(), String> {
        check_start(&self.command_line, &["--batch".to_string()])
    }

    fn request(&mut self, arguments: &Arguments, input: &[u8]) -> Result<Answer, String> {
        let mut running = match self.running.take() {
            Some(running) => running,
            None => Running::start(&self.command_line)?,
        };
        let answer = running.request(arguments, input, self.command_line.timeout);
        // After a failure nothing is known of what is still in its pipes.
        if answer.is_ok() {
            self.running = Some(running);
        }
        answer
    }
}

/// Starts a program without input, to find out whether the shell can.
///
/// # Errors
/// A sentence with what the shell says.
fn check_start(command_line: &CommandLine, words: &[String]) -> Result<(), String> {
    let mut process = Process::start(command_line, words)?;
    drop(process.stdin());
    // The output goes nowhere, however much it is.
    let mut output = process.stdout();
    thread::spawn(move || io::copy(&mut output, &mut io::sink()));
    let status = process.wait(Instant::now() + command_line.timeout);
    match status.and_then(|status| status.code()) {
        // What a shell exits with where it finds no such command, or cannot run it.
        Some(code @ (126 | 127)) => {
            let ended = process.last_words(&format!("exit code {code}"));
            Err(format!("the decoder cannot be started: {ended}"))
        }
        _ => Ok(()),
    }
}

/// A program in batch mode.
#[derive(Debug)]
struct Running {
    // Dropped before the process, so that its input closes first.
    requests: Sender<Vec<u8>>,
    answers: Receiver<Result<Answer, String>>,
    process: Process,
}

impl Running {
    fn start(command_line: &CommandLine) -> Result<Running, String> {
        let mut process = Process::start(command_line, &["--batch".to_string()])?;
        Ok(Running {
            requests: writer(process.stdin()),
            answers: answers(process.stdout()),
            process,
        })
    }

    fn request(
        &mut self,
        arguments: &Arguments,
        input: &[u8],
        timeout: Duration,
    ) -> Result<Answer, String> {
        match self.answers.try_recv() {
            Ok(Ok(_)) => return Err("an answer without a request".to_string()),
            Ok(Err(garbage)) => return Err(self.process.last_words(&garbage)),
            // Where the program is gone, the wait below says how.
            Err(_) => {}
        }
        let words = arguments.words().join(" ");
        let mut request = Vec::with_capacity(8 + words.len() + input.len());
        for part in [words.as_bytes(), input] {
            request.extend((part.len() as u32).to_le_bytes());
            request.extend(part);
        }
        // Where the writer is gone, so is the program, and the reader says how.
        let _ = self.requests.send(request);
        match self.answers.recv_timeout(timeout) {
            Ok(Ok(answer)) => Ok(answer),
            Ok(Err(garbage)) => Err(self.process.last_words(&garbage)),
            Err(RecvTimeoutError::Timeout) => Err(self.process.timed_out(timeout)),
            Err(RecvTimeoutError::Disconnected) => {
                let ended = match self.process.wait(Instant::now() + GRACE) {
                    Some(status) => ending(status),
                    None => "closed its output".to_string(),
                };
                let words = format!("{ended} instead of an answer");
                Err(self.process.last_words(&words))
            }
        }
    }
}

/// Time until then.
fn left(deadline: Instant) -> Duration {
    deadline.saturating_duration_since(Instant::now())
}

/// How a process ended.
fn ending(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return format!("signal {signal}");
    }
    match status.code() {
        // What a shell makes of a signal that ends a program it started.
        Some(code @ 129..=192) => format!("exit code {code} (signal {})", code - 128),
        Some(code) => format!("exit code {code}"),
        None => "no exit code".to_string(),
    }
}

/// A process that is killed with all it started when it is dropped.
#[derive(Debug)]
struct Process {
    child: Child,
    killed: bool,
    errors: Receiver<String>,
}

impl Process {
    fn start(command_line: &CommandLine, words: &[String]) -> Result<Process, String> {
        let mut child = shell(command_line, words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{} cannot be started: {e}", command_line.command))?;
        let errors = error_line(child.stderr.take());
        Ok(Process {
            child,
            killed: false,
            errors,
        })
    }

    fn stdin(&mut self) -> Option<ChildStdin> {
        self.child.stdin.take()
    }

    fn stdout(&mut self) -> impl Read + Send + use<> {
        let stdout = self.child.stdout.take();
        stdout.map_or(Box::new(io::empty()) as Box<dyn Read + Send>, |pipe| {
            Box::new(pipe)
        })
    }

    /// Waits for its end, but not beyond the deadline.
    fn wait(&mut self, deadline: Instant) -> Option<ExitStatus> {
        let mut pause = Duration::from_micros(50);
        loop {
            match self.child.try_wait() {
                Ok(None) if Instant::now() < deadline => thread::sleep(pause),
                Ok(status) => return status,
                Err(_) => return None,
            }
            pause = (pause * 2).min(Duration::from_millis(5));
        }
    }

    fn timed_out(&mut self, timeout: Duration) -> String {
        self.kill();
        let words = format!("no end within {} s", timeout.as_secs_f64());
        self.last_words(&words)
    }

    /// What happened, with the line of the program's stderr that names an error, or its last one.
    fn last_words(&mut self, what: &str) -> String {
        self.kill();
        match self.errors.recv_timeout(GRACE) {
            Ok(line) if !line.is_empty() => format!("{what}; it says: {line}"),
            _ => what.to_string(),
        }
    }

    /// Ends it and all that it started, also where it has ended by itself.
    fn kill(&mut self) {
        if std::mem::replace(&mut self.killed, true) {
            return;
        }
        // It leads a process group, which only `kill` reaches without unsafe code. The group goes
        // before its leader is waited for, since then its id may be free. Where the exit code was
        // needed first, the id is taken as long as someone is left in the group, and otherwise
        // comes up again only after all others had their turn.
        #[cfg(unix)]
        let _ = Command::new("kill")
            .args(["-KILL", "--", &format!("-{}", self.child.id())])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

#[cfg(unix)]
fn shell(command_line: &CommandLine, words: &[String]) -> Command {
    let mut line = String::new();
    if command_line.memory_mib > 0 {
        // Lines, so that a shell may let the last command take its place.
        line = format!(
            "ulimit -v {} || exit 126\n",
            command_line.memory_mib.saturating_mul(1024)
        );
    }
    line += &command_line.command;
    // Parameters and no text: the shell acts on nothing that stands in a vector.
    line += " \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", &line, "sh"]).args(words);
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

#[cfg(not(unix))]
fn shell(command_line: &CommandLine, words: &[String]) -> Command {
    let mut command = Command::new("cmd");
    command.args(["/C", &command_line.command]).args(words);
    command
}

/// A thread that writes what it is sent, and closes the pipe when no more can come. A program that
/// does not read to the end has its reasons: it is judged by its answer.
fn writer(pipe: Option<ChildStdin>) -> Sender<Vec<u8>> {
    let (sender, requests) = mpsc::channel::<Vec<u8>>();
    if let Some(mut pipe) = pipe {
        thread::spawn(move || {
            for request in requests {
                let written = pipe.write_all(&request).and_then(|()| pipe.flush());
                if written.is_err() {
                    return;
                }
            }
        });
    }
    sender
}

/// A thread that reads all output.
fn whole_output(pipe: impl Read + Send + 'static) -> Receiver<Result<Vec<u8>, String>> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut output = Vec::new();
        let limit = u64::from(MAX_OUTPUT);
        let read = pipe.take(limit + 1).read_to_end(&mut output);
        let result = match read {
            Ok(_) if output.len() as u64 > limit => Err(too_much()),
            Ok(_) => Ok(output),
            Err(error) => Err(format!("its output cannot be read: {error}")),
        };
        let _ = sender.send(result);
    });
    receiver
}

/// A thread that reads answers, up to the first that is none.
fn answers(mut pipe: impl Read + Send + 'static) -> Receiver<Result<Answer, String>> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        loop {
            match answer(&mut pipe) {
                // The channel closes: the program is gone.
                Ok(None) => return,
                Ok(Some(answer)) => {
                    if sender.send(Ok(answer)).is_err() {
                        return;
                    }
                }
                Err(garbage) => {
                    let _ = sender.send(Err(garbage));
                    return;
                }
            }
        }
    });
    receiver
}

/// The next answer; `None` where the output ends before one.
fn answer(pipe: &mut impl Read) -> Result<Option<Answer>, String> {
    let cut = |_| "an answer that is cut off".to_string();
    let mut status = [0];
    if pipe.read_exact(&mut status).is_err() {
        return Ok(None);
    }
    let status = match status[0] {
        0 => Status::Complete,
        1 => Status::Refused,
        2 => Status::NeedInput,
        89 => Status::NotImplemented,
        other => return Err(format!("status {other}, which there is not")),
    };
    let mut length = [0; 4];
    pipe.read_exact(&mut length).map_err(cut)?;
    let length = u32::from_le_bytes(length);
    if length > MAX_OUTPUT {
        return Err(too_much());
    }
    let mut output = Vec::new();
    let read = pipe.take(u64::from(length)).read_to_end(&mut output);
    match read {
        Ok(bytes) if bytes == length as usize => Ok(Some(Answer { status, output })),
        _ => Err("an answer that is cut off".to_string()),
    }
}

fn too_much() -> String {
    format!("more than {} MiB of output", MAX_OUTPUT >> 20)
}

/// A thread that reads stderr to its end and gives its last line that names an error, or its last line.
fn error_line(pipe: Option<impl Read + Send + 'static>) -> Receiver<String> {
    const KEPT: usize = 2048;
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let Some(mut pipe) = pipe else { return };
        let mut tail = Vec::new();
        let mut buffer = [0; KEPT];
        while let Ok(bytes @ 1..) = pipe.read(&mut buffer) {
            tail.extend(&buffer[..bytes]);
            tail.drain(..tail.len().saturating_sub(KEPT));
        }
        let text = String::from_utf8_lossy(&tail);
        let mut lines = text.lines().rev().filter(|line| !line.trim().is_empty());
        // Some runtimes write where they stopped, or their version, after the error.
        let names_error = |line: &&str| line.to_ascii_lowercase().contains("error");
        let line = lines.clone().find(names_error).or_else(|| lines.next());
        let line = line.unwrap_or_default().trim();
        let _ = sender.send(line.escape_debug().take(200).collect());
    });
    receiver
}
