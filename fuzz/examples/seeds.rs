//! Fills `corpus/TARGET` with streams to start from: those of the small server, and the vectors of
//! `conformance/vectors` where there are any. Run in `fuzz/`.

use std::io;
use std::path::{Path, PathBuf};

use arbitrary::Unstructured;
use dapple_fuzz::server;
use dapple_fuzz::stream_builder::record_starts;

/// Targets that read a stream, each with the bytes before it: one seed for each.
const STREAMS: [(&str, &[&[u8]]); 6] = [
    ("container", &[&[0], &[1], &[2]]),
    ("differential", &[&[0x40], &[0x71]]),
    ("pieces", &[&[0, 0], &[1, 3], &[2, 40]]),
    ("c_interface", &[&[0, 0], &[1, 0]]),
    ("output_leak", &[&[0, 0], &[0x22, 128]]),
    (
        "limits",
        &[&[2, 0x88, 0x88, 0xff, 8], &[1, 0x22, 0x22, 0x42, 0x12]],
    ),
];
/// Targets that build their own streams from any bytes.
const BUILDERS: [&str; 11] = [
    "differential",
    "encoder",
    "instances",
    "points",
    "probes",
    "vertices",
    "regions",
    "structured",
    "round_trip",
    "session",
    "zstd",
];

fn main() -> io::Result<()> {
    let mut seeds = 0;
    for seed in 0..24 {
        let bytes = noise(seed, [60, 250, 1000, 3000][seed as usize % 4]);
        for target in BUILDERS {
            write(target, &format!("noise-{seed}"), &[&bytes])?;
            seeds += 1;
        }
        let Ok(script) = server::script(&mut Unstructured::new(&bytes)) else {
            continue;
        };
        seeds += stream(&format!("server-{seed}"), &script.bytes)?;
    }
    for path in vectors(Path::new("../conformance/vectors"))? {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        seeds += stream(&name, &std::fs::read(&path)?)?;
    }
    println!("{seeds} seeds");
    Ok(())
}

/// Seeds of one stream; the count.
fn stream(name: &str, bytes: &[u8]) -> io::Result<usize> {
    if bytes.len() > 16 << 10 {
        return Ok(0);
    }
    let mut seeds = 0;
    for (target, heads) in STREAMS {
        for (i, head) in heads.iter().enumerate() {
            // Two streams where the target cuts its input in two.
            let again: &[u8] = if head.last() == Some(&128) {
                bytes
            } else {
                &[]
            };
            write(target, &format!("{name}-{i}"), &[head, again, bytes])?;
            seeds += 1;
        }
    }
    for start in record_starts(bytes) {
        let Some(payload) = bytes.get(start + 32..) else {
            break;
        };
        let stored = bytes[start + 16..start + 20]
            .try_into()
            .map_or(0, u32::from_le_bytes);
        if bytes[start + 3] == 2 && payload.len() >= stored as usize {
            write(
                "zstd",
                &format!("{name}-{start}"),
                &[&[0], &payload[..stored as usize]],
            )?;
            seeds += 1;
        }
    }
    Ok(seeds)
}

fn write(target: &str, name: &str, parts: &[&[u8]]) -> io::Result<()> {
    let folder = Path::new("corpus").join(target);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join(name), parts.concat())
}

/// All vectors, sorted.
fn vectors(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    if !folder.is_dir() {
        return Ok(found);
    }
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(vectors(&path)?);
        } else if path.extension().is_some_and(|e| e == "dapple") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Bytes that are small half of the time, so that choices vary and numbers stay plausible.
fn noise(seed: u64, bytes: usize) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as u8
    };
    (0..bytes)
        .map(|_| if next() & 1 == 0 { next() } else { next() & 7 })
        .collect()
}
