//! Every WGSL module against a strict compiler: that of Chromium, which refuses some of what naga
//! takes.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use dapple::render::shaders::{self, Shader};
use serde_json::{Value, json};

/// The sampler of `probes` as its query test asks it.
const QUERY: Shader = Shader {
    name: "tests/probes_queries/ask.wgsl",
    source: concat!(
        include_str!("../src/probes/sample.wgsl"),
        include_str!("probes_queries/ask.wgsl")
    ),
};

/// The sampler of `instances` likewise.
const INSTANCES_QUERY: Shader = Shader {
    name: "tests/instances_queries/ask.wgsl",
    source: concat!(
        include_str!("../src/instances/sample.wgsl"),
        include_str!("instances_queries/ask.wgsl")
    ),
};

/// That of `regions`.
const REGIONS_QUERY: Shader = Shader {
    name: "tests/regions_queries/ask.wgsl",
    source: concat!(
        include_str!("../src/regions/sample.wgsl"),
        include_str!("regions_queries/ask.wgsl")
    ),
};

/// All modules: of the program, and samplers as their query tests ask them.
fn all() -> impl Iterator<Item = &'static Shader> {
    let queries = [&QUERY, &INSTANCES_QUERY, &REGIONS_QUERY];
    shaders::ALL.iter().chain(queries)
}

/// Names of the browser's program.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Runs WebGPU without a graphics device.
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
fn serve(stream: TcpStream, modules: &Value) -> std::io::Result<Option<Value>> {
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
        Some("/") => ("text/html", include_str!("shaders/page.html").to_owned()),
        Some("/shaders") => ("application/json", modules.to_string()),
        _ => ("text/plain", String::new()),
    };
    let length = answer.len();
    write!(
        &stream,
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{answer}"
    )?;
    let posted = request.starts_with("POST /result");
    Ok(posted.then(|| serde_json::from_slice(&body).expect("the page posts JSON")))
}

#[test]
fn modules_pass_a_strict_compiler() {
    let modules: Vec<Value> = all()
        .map(|shader| json!({ "name": shader.name, "source": shader.source }))
        .collect();
    let modules = Value::from(modules);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.set_nonblocking(true).expect("a listener");
    let url = format!("http://{}/", listener.local_addr().expect("an address"));
    let profile = tempfile::tempdir().expect("a folder");
    let Some(_browser) = Browser::open(profile.path(), &url) else {
        let required = std::env::var_os("CI").is_some();
        assert!(!required, "CI needs Chromium for the strict WGSL compiler");
        eprintln!("skipped: Chromium is not installed");
        return;
    };
    let start = Instant::now();
    let result = loop {
        assert!(start.elapsed() < PATIENCE, "the browser gave no result");
        match listener.accept() {
            Ok((stream, _)) => {
                // A connection that the browser opens and drops is none of ours.
                if let Ok(Some(result)) = serve(stream, &modules) {
                    break result;
                }
            }
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let expected = json!({ "checked": all().count(), "messages": [] });
    assert_eq!(result, expected);
}

#[test]
fn modules_hold_every_shader_file() {
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "wgsl") {
                let source = std::fs::read_to_string(&path).expect("a shader");
                let known = all().any(|s| s.source.contains(&source));
                assert!(known, "{} is in no module", path.display());
                files += 1;
            }
        }
    }
    assert!(files >= shaders::ALL.len());
}
