//! zstd frames, by a native decoder or, without `zstd-native`, by a portable one. Frames are checked before
//! they are decoded, so that both see the same, and neither reserves more.

use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use ruzstd::io::Read as _;

use crate::error::{ErrorDetail, ErrorKind, Limit};

/// Largest content of a zstd block, and so of four bytes of a frame (RFC 8878, 3.1.1.2.4).
pub(super) const BLOCK_BYTES: u64 = 128 << 10;

/// A context of the C decoder, which writes to its output and needs no window (95 KiB in 1.5.7).
const CONTEXT_BYTES: u64 = 192 << 10;
/// The pure-Rust decoder without three times the window: tables, a block as it came, its literals,
/// and 98 047 sequences, which is the most that the three bytes of their count can state; each of
/// those grows by doubling.
const PORTABLE_BYTES: u64 = 8 << 20;

/// Decodes frames; keeps its tables from one to the next.
#[derive(Default)]
pub(super) struct ZstdDecoders {
    #[cfg(feature = "zstd-native")]
    native_tables: Option<zstd::bulk::Decompressor<'static>>,
    #[cfg_attr(feature = "zstd-native", allow(dead_code))]
    portable_tables: Option<alloc::boxed::Box<FrameDecoder>>,
}

impl ZstdDecoders {
    /// Fills `out` from a frame.
    pub(super) fn unpack(
        &mut self,
        frame: &[u8],
        out: &mut [u8],
        window_limit: u32,
    ) -> Result<(), ErrorDetail> {
        let blocks = check_frame(frame, out.len(), window_limit)?;
        self.decode(frame, blocks, out, window_limit)
            .map_err(ErrorDetail::from)
    }

    #[cfg(feature = "zstd-native")]
    fn decode(
        &mut self,
        stored: &[u8],
        _: Blocks,
        out: &mut [u8],
        _: u32,
    ) -> Result<(), ErrorKind> {
        self.native(stored, out)
    }

    #[cfg(not(feature = "zstd-native"))]
    fn decode(
        &mut self,
        stored: &[u8],
        blocks: Blocks,
        out: &mut [u8],
        window_limit: u32,
    ) -> Result<(), ErrorKind> {
        self.portable(stored, blocks, out, window_limit)
    }

    #[cfg(feature = "zstd-native")]
    fn native(&mut self, stored: &[u8], out: &mut [u8]) -> Result<(), ErrorKind> {
        let decompressor = match &mut self.native_tables {
            Some(kept) => kept,
            none => none.insert(zstd::bulk::Decompressor::new().map_err(|_| ErrorKind::Zstd)?),
        };
        match decompressor.decompress_to_buffer(stored, out) {
            Ok(bytes) if bytes == out.len() => Ok(()),
            _ => Err(ErrorKind::Zstd),
        }
    }

    #[cfg_attr(
        all(feature = "zstd-native", not(any(test, fuzzing))),
        allow(dead_code)
    )]
    fn portable(
        &mut self,
        stored: &[u8],
        blocks: Blocks,
        out: &mut [u8],
        window: u32,
    ) -> Result<(), ErrorKind> {
        check_sections(stored, blocks)?;
        let decoder = self.portable_tables.get_or_insert_default();
        // The smallest window that a frame without a single segment can state is 1 KiB.
        decoder.set_max_window_size(u64::from(window).max(1024));
        decode_blocks(decoder, stored, out).ok_or_else(|| {
            // A failed frame leaves tables half built; they are not worth keeping.
            self.portable_tables = None;
            ErrorKind::Zstd
        })
    }
}

/// The most bytes that the decoder of this build has allocated at once.
pub(super) fn heap_bytes(window: u32) -> u64 {
    if cfg!(feature = "zstd-native") {
        return CONTEXT_BYTES;
    }
    3 * u64::from(window) + PORTABLE_BYTES
}

/// Decodes one frame block by block, so that no more than the window and one block wait for being
/// read. `None` for anything but a frame of `out.len()` bytes.
#[cfg_attr(
    all(feature = "zstd-native", not(any(test, fuzzing))),
    allow(dead_code)
)]
fn decode_blocks(decoder: &mut FrameDecoder, mut stored: &[u8], mut out: &mut [u8]) -> Option<()> {
    decoder.reset(&mut stored).ok()?;
    let mut last = false;
    while !last {
        let one = BlockDecodingStrategy::UptoBlocks(1);
        last = decoder.decode_blocks(&mut stored, one).ok()?;
        let bytes = decoder.read(out).ok()?;
        out = &mut out[bytes..];
        // More than there is room for.
        if decoder.can_collect() != 0 {
            return None;
        }
    }
    (stored.is_empty() && out.is_empty()).then_some(())
}

/// What each of the two zstd decoders, C first, makes of a frame that passes the checks before them:
/// the content, or what the decoder says of the frame.
#[cfg(all(fuzzing, feature = "zstd-native"))]
pub fn unpack_zstd_twice(
    frame: &[u8],
    content: usize,
    window: u32,
) -> Option<[Result<alloc::vec::Vec<u8>, alloc::string::String>; 2]> {
    use alloc::string::ToString as _;
    let blocks = check_frame(frame, content, window).ok()?;
    let mut decoders = ZstdDecoders::default();
    let (mut native, mut portable) = (alloc::vec![0; content], alloc::vec![0; content]);
    let first = decoders.native(frame, &mut native).map_err(|_| {
        let mut out = alloc::vec![0; content];
        match zstd::bulk::decompress_to_buffer(frame, &mut out) {
            Ok(bytes) => alloc::format!("{bytes} bytes"),
            Err(error) => error.to_string(),
        }
    });
    let second = decoders
        .portable(frame, blocks, &mut portable, window)
        .map_err(|_| {
            let mut out = alloc::vec![0; content];
            match FrameDecoder::new().decode_all(frame, &mut out) {
                Ok(bytes) => alloc::format!("{bytes} bytes"),
                Err(error) => alloc::format!("{error:?}"),
            }
        });
    Some([first.map(|()| native), second.map(|()| portable)])
}

/// The blocks of a frame.
#[cfg_attr(
    all(feature = "zstd-native", not(any(test, fuzzing))),
    allow(dead_code)
)]
#[derive(Clone, Copy)]
pub(super) struct Blocks {
    /// Byte of the frame where the first one begins.
    start: usize,
    /// What one of them may hold, stored or unpacked.
    most_bytes: u64,
}

/// The little-endian number in `bytes` bytes of a frame, up to 8; `None` beyond its end.
fn little(frame: &[u8], at: usize, bytes: usize) -> Option<u64> {
    let bytes = frame.get(at..)?.get(..bytes)?;
    Some(
        bytes
            .iter()
            .rev()
            .fold(0, |value, &byte| value << 8 | u64::from(byte)),
    )
}

/// Walks the frame header and the block headers (RFC 8878, 3.1.1): one frame and nothing else, no
/// dictionary, no content checksum (the record has its own), content size as the record says,
/// window within the limit. So both zstd decoders see the same, and neither reserves more.
pub(super) fn check_frame(
    frame: &[u8],
    content: usize,
    window_limit: u32,
) -> Result<Blocks, ErrorDetail> {
    let bad = ErrorKind::ZstdFrame;
    let little = |at, bytes| little(frame, at, bytes).ok_or(bad);
    if little(0, 4)? != 0xfd2f_b528 {
        return Err(bad.into());
    }
    let descriptor = little(4, 1)?;
    let single_segment = descriptor & 0x20 != 0;
    // Unused and reserved bits, content checksum, dictionary id: all zero.
    if descriptor & 0x1f != 0 {
        return Err(bad.into());
    }
    let mut at = 5;
    let mut window = None;
    if !single_segment {
        let field = little(at, 1)?;
        let base = 1u64 << (10 + (field >> 3));
        window = Some(base + base / 8 * (field & 7));
        at += 1;
    }
    let size_bytes = match (descriptor >> 6, single_segment) {
        (0, true) => 1,
        (0, false) => return Err(bad.into()),
        (1, _) => 2,
        (2, _) => 4,
        _ => 8,
    };
    let stated = little(at, size_bytes)? + if size_bytes == 2 { 256 } else { 0 };
    at += size_bytes;
    if stated != content as u64 {
        return Err(bad.into());
    }
    let window = window.unwrap_or(stated);
    if window > u64::from(window_limit) {
        let limit = u64::from(window_limit);
        return Err(ErrorDetail::limit(
            ErrorKind::ZstdWindow,
            Limit::ZstdWindowBytes,
            window,
            limit,
        ));
    }
    let blocks = Blocks {
        start: at,
        most_bytes: BLOCK_BYTES.min(window),
    };
    loop {
        let block = little(at, 3)?;
        let size = block >> 3;
        at += 3 + match block >> 1 & 3 {
            1 => 1,
            0 | 2 => size as usize,
            _ => return Err(bad.into()),
        };
        // RFC 8878 has both bounds; of the two decoders, one holds raw blocks against the window.
        if size > blocks.most_bytes {
            return Err(bad.into());
        }
        if block & 1 == 1 {
            break;
        }
    }
    if at == frame.len() {
        Ok(blocks)
    } else {
        Err(bad.into())
    }
}

/// What the native decoder checks in the compressed blocks of a frame that [`check_frame`]
/// passed, and the portable one does not: the literals of a block are no more than the block may
/// hold (RFC 8878, 3.1.1.2.4), and the two reserved bits of the modes are zero (3.1.1.3.2.1).
#[cfg_attr(
    all(feature = "zstd-native", not(any(test, fuzzing))),
    allow(dead_code)
)]
fn check_sections(frame: &[u8], blocks: Blocks) -> Result<(), ErrorKind> {
    let little = |at, bytes| little(frame, at, bytes).ok_or(ErrorKind::Zstd);
    let mut at = blocks.start;
    loop {
        let header = little(at, 3)?;
        let (kind, size) = (header >> 1 & 3, (header >> 3) as usize);
        at += 3;
        if kind == 2 {
            // Literals: type and format of the sizes, then the sizes and the literals (3.1.1.3.1).
            let head = little(at, size.min(5))?;
            // Bytes of the header, literals, and the bytes that they are stored in.
            let (header_bytes, literals, stored) = match (head & 3, head >> 2 & 3) {
                (0, 0 | 2) => (1, head >> 3 & 0x1f, None),
                (0, 1) => (2, head >> 4 & 0xfff, None),
                (0, _) => (3, head >> 4 & 0xf_ffff, None),
                (1, 0 | 2) => (1, head >> 3 & 0x1f, Some(1)),
                (1, 1) => (2, head >> 4 & 0xfff, Some(1)),
                (1, _) => (3, head >> 4 & 0xf_ffff, Some(1)),
                (_, 0 | 1) => (3, head >> 4 & 0x3ff, Some(head >> 14 & 0x3ff)),
                (_, 2) => (4, head >> 4 & 0x3fff, Some(head >> 18 & 0x3fff)),
                _ => (5, head >> 4 & 0x3_ffff, Some(head >> 22 & 0x3_ffff)),
            };
            if literals > blocks.most_bytes {
                return Err(ErrorKind::Zstd);
            }
            // Sequences: their count in one to three bytes, and if there are any the modes.
            let count = at + header_bytes + stored.unwrap_or(literals) as usize;
            let modes = match little(count, 1)? {
                0 => None,
                1..128 => Some(count + 1),
                128 if little(count + 1, 1)? == 0 => None,
                128..255 => Some(count + 2),
                _ => Some(count + 3),
            };
            if let Some(modes) = modes
                && little(modes, 1)? & 3 != 0
            {
                return Err(ErrorKind::Zstd);
            }
        }
        at += if kind == 1 { 1 } else { size };
        if header & 1 == 1 {
            return Ok(());
        }
    }
}

#[cfg(all(test, feature = "zstd-native"))]
mod tests {
    use super::*;
    use crate::container::header::Packing;
    use crate::container::pack::{Compression, Packer};
    use alloc::vec;
    use alloc::vec::Vec;

    fn sample(bytes: usize) -> Vec<u8> {
        let mut state = 9u32;
        let mut sample: Vec<u8> = Vec::new();
        while sample.len() < bytes {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            let repeat = state >> 28;
            sample.extend((0..repeat * repeat).map(|i| (state >> 13) as u8 ^ (i & 2) as u8));
        }
        sample.truncate(bytes);
        sample
    }

    fn zstd_frame(level: i32, lazy: bool, payload: &[u8]) -> Vec<u8> {
        let mut frame = Vec::new();
        let compression = Compression::Zstd { level, lazy };
        let packing = Packer::default().pack(compression, payload, 8 << 20, &mut frame);
        assert_eq!(packing, Ok(Packing::Zstd));
        frame
    }

    #[test]
    fn both_zstd_decoders_give_the_payload() {
        let mut decoders = ZstdDecoders::default();
        for size in [100, 1000, 70_000, 300_000, 1_000_000] {
            let payload = sample(size);
            for (level, lazy) in [(1, false), (3, false), (15, true), (19, false)] {
                let frame = zstd_frame(level, lazy, &payload);
                let blocks = check_frame(&frame, size, 8 << 20).unwrap();
                let (mut native, mut portable) = (vec![0; size], vec![0; size]);
                decoders.native(&frame, &mut native).unwrap();
                decoders
                    .portable(&frame, blocks, &mut portable, 8 << 20)
                    .unwrap();
                assert!(native == payload && portable == payload, "{size} {level}");
            }
        }
    }

    #[test]
    fn both_zstd_decoders_refuse_reserved_bits_of_modes() {
        let frame = |modes| {
            let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x20, 16];
            // One block: two raw literals, one sequence.
            frame.extend([0x45, 0, 0, 0x10, 0, 0, 1, modes, 0x32, 0xc0, 2]);
            frame
        };
        let mut decoders = ZstdDecoders::default();
        for modes in 0..4 {
            let frame = frame(modes);
            let blocks = check_frame(&frame, 16, 1024).unwrap();
            let wanted = if modes == 0 {
                Ok(())
            } else {
                Err(ErrorKind::Zstd)
            };
            let mut out = [0; 16];
            assert_eq!(decoders.native(&frame, &mut out), wanted);
            let portable = decoders.portable(&frame, blocks, &mut out, 1024);
            assert_eq!(portable, wanted);
        }
    }

    /// What a block may hold is the window of 1 KiB, 128 KiB, or a content less than either.
    #[test]
    fn both_zstd_decoders_refuse_more_literals_than_a_block_may_hold() {
        let mut decoders = ZstdDecoders::default();
        for (window, content, most) in [
            (Some(0), 3000u32, 1024u32),
            (Some(10 << 3), 300_000, 128 << 10),
            (None, 3000, 3000),
            (None, 300_000, 128 << 10),
        ] {
            for more in [0, 1] {
                let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd];
                frame.push(if window.is_some() { 0x80 } else { 0xa0 });
                frame.extend(window);
                frame.extend(content.to_le_bytes());
                // A block of one repeated literal and no sequences, then runs.
                let first = most + more;
                frame.extend([5 << 3 | 2 << 1 | u8::from(first >= content), 0, 0]);
                frame.extend(&(first << 4 | 3 << 2 | 1).to_le_bytes()[..3]);
                frame.extend([7, 0]);
                let mut left = content.saturating_sub(first);
                while left > 0 {
                    let run = left.min(most);
                    left -= run;
                    let header = run << 3 | 1 << 1 | u32::from(left == 0);
                    frame.extend(&header.to_le_bytes()[..3]);
                    frame.push(7);
                }
                let size = content as usize;
                let blocks = check_frame(&frame, size, 8 << 20).unwrap();
                let mut out = vec![0; size];
                let wanted = if more == 0 {
                    Ok(())
                } else {
                    Err(ErrorKind::Zstd)
                };
                assert_eq!(decoders.native(&frame, &mut out), wanted);
                let portable = decoders.portable(&frame, blocks, &mut out, 8 << 20);
                assert_eq!(portable, wanted, "{content} {most} {more}");
            }
        }
    }

    #[test]
    fn damaged_zstd_frames_never_unpack_to_different_bytes() {
        let payload = sample(2000);
        let frame = zstd_frame(15, true, &payload);
        let mut decoders = ZstdDecoders::default();
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let Ok(blocks) = check_frame(&damaged, payload.len(), 8 << 20) else {
                continue;
            };
            let (mut native, mut portable) = (vec![0; 2000], vec![0; 2000]);
            let a = decoders.native(&damaged, &mut native);
            let b = decoders.portable(&damaged, blocks, &mut portable, 8 << 20);
            if a.is_ok() && b.is_ok() {
                assert_eq!(native, portable, "bit {bit}");
            }
        }
    }

    #[test]
    fn zstd_blocks_are_no_larger_than_the_window() {
        let check = |sizes: &[u32]| {
            // A window of 1 KiB, a content size of 2048 in two bytes, then runs.
            let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x40, 0, 0, 7];
            for (i, size) in sizes.iter().enumerate() {
                let last = u32::from(i + 1 == sizes.len());
                frame.extend(&(size << 3 | 1 << 1 | last).to_le_bytes()[..3]);
                frame.push(b'a');
            }
            let checked = check_frame(&frame, 2048, 8 << 20);
            checked.map(|_| ()).map_err(|failure| failure.kind)
        };
        assert_eq!(check(&[1024, 1024]), Ok(()));
        assert_eq!(check(&[1025, 1023]), Err(ErrorKind::ZstdFrame));
        assert_eq!(check(&[2048]), Err(ErrorKind::ZstdFrame));
    }

    #[test]
    fn zstd_frames_that_are_not_plain_are_refused() {
        let payload = sample(5000);
        let frame = zstd_frame(3, false, &payload);
        let check = |frame: &[u8]| {
            let checked = check_frame(frame, 5000, 8 << 20);
            checked.map(|_| ()).map_err(|f| f.kind)
        };
        assert_eq!(check(&frame), Ok(()));
        assert_eq!(
            check(&[&frame[..], &[0]].concat()),
            Err(ErrorKind::ZstdFrame)
        );
        assert_eq!(
            check(&[&frame[..], &frame[..]].concat()),
            Err(ErrorKind::ZstdFrame)
        );
        for end in 0..frame.len() {
            assert_eq!(check(&frame[..end]), Err(ErrorKind::ZstdFrame));
        }
        let window = check_frame(&frame, 5000, 4999).map_err(|f| f.kind);
        assert_eq!(window.err(), Some(ErrorKind::ZstdWindow));
        let mut with_checksum = zstd::bulk::Compressor::new(3).unwrap();
        with_checksum.include_checksum(true).unwrap();
        assert_eq!(
            check(&with_checksum.compress(&payload).unwrap()),
            Err(ErrorKind::ZstdFrame)
        );
        let mut without_size = zstd::bulk::Compressor::new(3).unwrap();
        without_size.include_contentsize(false).unwrap();
        assert_eq!(
            check(&without_size.compress(&payload).unwrap()),
            Err(ErrorKind::ZstdFrame)
        );
    }
}
