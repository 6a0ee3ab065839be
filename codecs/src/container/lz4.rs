//! lz4 blocks.

use crate::error::ErrorKind;

/// An lz4 block of n bytes unpacks to less than 255 n bytes.
pub(super) const RATIO: u64 = 255;
/// The last match of an lz4 block starts so many bytes before the end of the content, or earlier...
const LAST_MATCH: u64 = 12;
/// ...and ends before its last literals.
const LAST_LITERALS: u64 = 5;

/// Fills `out` from a block.
pub(super) fn unpack(block: &[u8], out: &mut [u8]) -> Result<(), ErrorKind> {
    check_block(block, out.len())?;
    match lz4_flex::block::decompress_into(block, out) {
        Ok(bytes) if bytes == out.len() => Ok(()),
        _ => Err(ErrorKind::Lz4),
    }
}

/// Walks the sequences of an lz4 block: no match starts in the last 12 bytes of the content or ends
/// in the last 5. The format says so, and decoders differ in whether they check it.
fn check_block(block: &[u8], content: usize) -> Result<(), ErrorKind> {
    let byte = |at: usize| block.get(at).copied().ok_or(ErrorKind::Lz4);
    let length = |nibble: u8, at: &mut usize| -> Result<u64, ErrorKind> {
        let mut length = u64::from(nibble);
        let mut more = nibble == 15;
        while more {
            let next = byte(*at)?;
            *at += 1;
            length += u64::from(next);
            more = next == 255;
        }
        Ok(length)
    };
    let (mut at, mut done) = (0, 0);
    loop {
        let token = byte(at)?;
        at += 1;
        let literals = length(token >> 4, &mut at)?;
        if literals >= (block.len() - at) as u64 {
            // The last sequence. Whether the lengths come out, and the offsets, is for the decoder
            // to check.
            return Ok(());
        }
        at += literals as usize + 2;
        done += literals;
        let start = done;
        done += 4 + length(token & 15, &mut at)?;
        if start + LAST_MATCH > content as u64 || done + LAST_LITERALS > content as u64 {
            return Err(ErrorKind::Lz4);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    #[test]
    fn blocks_keep_their_end_conditions() {
        // One literal, a match of `length` at offset 1, and `last` literals.
        let unpacked = |length: u8, last: u8| {
            let mut block = vec![0x10 | (length - 4), 7, 1, 0, last << 4];
            block.extend((0..last).map(|i| i + 1));
            let mut out = vec![0; 1 + usize::from(length) + usize::from(last)];
            unpack(&block, &mut out).map(|()| out)
        };
        let right = [&[7; 8][..], &[1, 2, 3, 4, 5]].concat();
        assert_eq!(unpacked(7, 5), Ok(right));
        assert!(unpacked(8, 5).is_ok());
        // The match ends too late; it starts too late.
        assert_eq!(unpacked(8, 4), Err(ErrorKind::Lz4));
        assert_eq!(unpacked(6, 5), Err(ErrorKind::Lz4));
        // A sequence that breaks off, and nothing at all.
        for block in [&[0x10][..], &[0x10, 7, 1], &[0xf0, 255], &[]] {
            assert_eq!(unpack(block, &mut [0; 20]), Err(ErrorKind::Lz4));
        }
    }
}
