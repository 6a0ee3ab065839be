//! C zstd and the pure-Rust decoder: the same verdict on every frame that passes the checks of the
//! format, and the same bytes, but for what `fuzz/README.md` says of frames that break RFC 8878.
#![no_main]

use arbitrary::{Result, Unstructured};
use dapple_codec::fuzzing::unpack_zstd_twice;
use dapple_codec::points::{Coding, Grid, PointWidths};
use dapple_codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, Target, Track, Transform,
};
use libfuzzer_sys::fuzz_target;

const WINDOW: u32 = 1 << 20;

/// What C lets pass and the pure-Rust decoder does not: Huffman streams whose last code runs past
/// their end, that hold more codes than literals are stated, or whose last byte is 0 and so lacks
/// the bit that ends them. RFC 8878 §4.2.2 calls them corrupt.
const ONLY_C: [&str; 3] = [
    "DecodedLiteralCountMismatch",
    "BitstreamReadMismatch",
    "ExtraPadding",
];

/// What C says of frames that the pure-Rust decoder lets pass; which they are is not known yet.
const ONLY_RUST: &str = "Data corruption detected";

fuzz_target!(|data: &[u8]| {
    let _ = run(data);
});

fn run(data: &[u8]) -> Result<()> {
    let Some((&how, rest)) = data.split_first() else {
        return Ok(());
    };
    let frame = if how & 1 == 0 {
        rest.to_vec()
    } else {
        mutated(rest)?
    };
    let Some(content) = content_size(&frame).filter(|&size| size <= 1 << 20) else {
        return Ok(());
    };
    match unpack_zstd_twice(&frame, content, WINDOW) {
        Some([Ok(native), Ok(portable)]) => assert!(
            native == portable || has_four_streams(&frame),
            "different bytes"
        ),
        Some([Ok(_), Err(why)]) if !ONLY_C.iter().any(|known| why.contains(known)) => {
            panic!("only C takes it: {why}")
        }
        Some([Err(why), Ok(_)]) if !why.contains(ONLY_RUST) => {
            panic!("only Rust takes it: {why}")
        }
        _ => {}
    }
    Ok(())
}

/// A frame that the encoder made, with a few bytes changed.
fn mutated(data: &[u8]) -> Result<Vec<u8>> {
    let mut u = Unstructured::new(data);
    let lazy = u.arbitrary()?;
    let level = u.int_in_range(1..=19)?;
    let mut entries = Vec::new();
    let count = u.int_in_range(0..=255)?;
    let mut transform = Transform::IDENTITY;
    for id in 0..count {
        if u.ratio(1, 3)? {
            let at = (u.choose_index(3)?, u.choose_index(4)?);
            transform.world_from_grid[at.0][at.1] = u.arbitrary::<i16>()?.into();
        }
        entries.push((id, transform));
    }
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("preamble");
    let tracks: Vec<_> = entries.iter().map(|&(id, _)| smallest_track(id)).collect();
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let group = encoder.group(&mut bytes, GroupStart::Keyframes);
    group.expect("group");
    let start = bytes.len() + 32;
    let compression = Compression::Zstd { level, lazy };
    encoder
        .transforms(&mut bytes, &entries, compression)
        .expect("transforms");
    let mut frame = bytes.split_off(start);
    for _ in 0..u.int_in_range(0..=3)? {
        let at = u.choose_index(frame.len())?;
        frame[at] = u.arbitrary()?;
    }
    Ok(frame)
}

/// A track of one bucket and one cell.
fn smallest_track(id: u32) -> Track {
    Track {
        id,
        target: Target::default(),
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Points(Grid {
            grid_from_mesh: Transform::IDENTITY.world_from_grid,
            dims: [1; 3],
            cell_edge: 1.0,
            radius: 0.5,
            widths: PointWidths::BITS_32,
            bucket_count: 1,
            cell_capacity: 1,
            coding: Coding::Cells,
        }),
    }
}

/// Whether a block of the frame has literals in four Huffman streams. Where one of them holds more
/// codes than its share and the next fewer, C stops each at its share and the pure-Rust decoder
/// strings together what came.
fn has_four_streams(frame: &[u8]) -> bool {
    let descriptor = frame[4];
    let single = descriptor >> 5 & 1 == 1;
    let size_bytes = [usize::from(single), 2, 4, 8][usize::from(descriptor >> 6)];
    let mut at = 5 + usize::from(!single) + size_bytes;
    loop {
        let header = u32::from_le_bytes([frame[at], frame[at + 1], frame[at + 2], 0]);
        let (last, kind, size) = (header & 1, header >> 1 & 3, (header >> 3) as usize);
        at += 3;
        // Literals of type 2 or 3, in another format than that of one stream.
        if kind == 2 && size > 0 && frame[at] >> 1 & 1 == 1 && frame[at] >> 2 & 3 != 0 {
            return true;
        }
        at += if kind == 1 { 1 } else { size };
        if last == 1 {
            return false;
        }
    }
}

/// The content size that the frame states, where it states one.
fn content_size(frame: &[u8]) -> Option<usize> {
    let descriptor = *frame.get(4)?;
    let single = descriptor & 0x20 != 0;
    let (bytes, add) = match descriptor >> 6 {
        0 if single => (1, 0),
        0 => return None,
        1 => (2, 256),
        2 => (4, 0),
        _ => (8, 0),
    };
    let start = if single { 5 } else { 6 };
    let field = frame.get(start..start + bytes)?;
    let size = field
        .iter()
        .rev()
        .fold(0u64, |value, &byte| value << 8 | u64::from(byte));
    usize::try_from(size).ok()?.checked_add(add)
}
