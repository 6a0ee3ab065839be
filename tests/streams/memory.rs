//! `validate` and `inspect` in constant memory.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use super::server::Server;

/// Peak resident memory of a command in bytes, by asking the system until the command ends.
fn peak_memory(command: &str, path: &Path) -> u64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_dapple"))
        .arg(command)
        .arg(path)
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("dapple runs");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        // The line is gone once the process has ended.
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
        peak = peak.max(kilobytes.unwrap_or(0) << 10);
        if let Some(ended) = child.try_wait().expect("a child") {
            assert!(ended.success(), "{command} {}", path.display());
            return peak;
        }
        std::thread::sleep(std::time::Duration::from_micros(100));
    }
}

/// Memory of `validate` and `inspect` does not grow with the stream. Writes a gigabyte to the
/// folder for temporary files; run with `cargo test --test main streams -- --ignored --nocapture`.
#[test]
#[ignore = "writes a gigabyte"]
fn a_gigabyte_takes_no_more_memory_than_ten_megabytes() {
    let folder = tempfile::tempdir().expect("folder");
    let write = |name: &str, length: u64| {
        let path = folder.path().join(name);
        let mut out = std::fs::File::create(&path).expect("created");
        let mut server = Server::new();
        let mut frame = 0;
        while server.encoder.written() < length {
            server.frame(frame, frame.is_multiple_of(100), 512);
            out.write_all(&server.bytes).expect("written");
            server.bytes.clear();
            frame += 1;
        }
        let mut last = server.bytes;
        server.encoder.end(&mut last).expect("end");
        out.write_all(&last).expect("written");
        path
    };
    let small = write("small.dapple", 10_000_000);
    let large = write("large.dapple", 1_000_000_001);
    assert!(std::fs::metadata(&large).expect("a file").len() > 1_000_000_000);
    for command in ["validate", "inspect"] {
        let [few, many] = [&small, &large].map(|path| peak_memory(command, path));
        println!("{command}: {few} bytes for 10 MB, {many} for 1 GB");
        assert!(few > 1 << 20, "{command}: no peak was read");
        assert!(
            many < few + (8 << 20),
            "{command}: {few} bytes for 10 MB, {many} for 1 GB"
        );
    }
}
