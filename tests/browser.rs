//! A page in headless Chromium: what it asks for and what it posts.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Names of the browser's program.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Runs WebGPU and WebGL without a graphics device.
const FLAGS: [&str; 15] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--mute-audio",
];

/// Longest time that the browser may take.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser that ends with its owner.
struct Browser(Child);

impl Browser {
    fn open(profile: &Path, url: &str) -> Option<Browser> {
        BROWSERS.iter().find_map(|program| {
            Command::new(program)
                .args(FLAGS)
                .arg(format!("--user-data-dir={}", profile.display()))
                .arg(url)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .ok()
                .map(Browser)
        })
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Answers one request of the page; returns what it posts.
fn serve(stream: TcpStream, page: &str, input: &str) -> std::io::Result<Option<Value>> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(Duration::from_secs(10)))?;
    let mut reader = BufReader::new(&stream);
    let mut request = String::new();
    reader.read_line(&mut request)?;
    let mut length = 0;
    loop {
        let mut header = String::new();
        if reader.read_line(&mut header)? == 0 || header.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = header.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().unwrap_or(0);
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let (kind, answer) = match request.split_whitespace().nth(1) {
        Some("/") => ("text/html", page),
        Some("/input") => ("application/json", input),
        _ => ("text/plain", ""),
    };
    let length = answer.len();
    write!(
        &stream,
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{answer}"
    )?;
    let posted = request.starts_with("POST /result");
    Ok(posted.then(|| serde_json::from_slice(&body).expect("the page posts JSON")))
}

/// What a page posts to `/result`; it finds `input` at `/input`. `None` where no browser is installed, which
/// in CI is an error.
pub fn result_of(page: &str, input: &Value) -> Option<Value> {
    let input = input.to_string();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.set_nonblocking(true).expect("a listener");
    let url = format!("http://{}/", listener.local_addr().expect("an address"));
    let profile = tempfile::tempdir().expect("a folder");
    let Some(_browser) = Browser::open(profile.path(), &url) else {
        let required = std::env::var_os("CI").is_some();
        assert!(!required, "CI needs Chromium for its shader compilers");
        eprintln!("skipped: Chromium is not installed");
        return None;
    };
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < PATIENCE, "the browser gave no result");
        match listener.accept() {
            Ok((stream, _)) => {
                // A connection that the browser opens and drops is none of ours.
                if let Ok(Some(result)) = serve(stream, page, &input) {
                    return Some(result);
                }
            }
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}
