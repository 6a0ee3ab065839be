//! What records a stream has, told from their headers alone, in constant memory.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::codec::container::{HEADER_BYTES, PREAMBLE_BYTES, Preamble, RecordHeader, record_type};

/// Reads the preamble and the record headers from pieces of a stream and skips what they announce.
/// Checks nothing but their own checksums: it runs beside a decoder, which checks all.
#[derive(Debug, Default)]
pub struct RecordScan {
    preamble: Vec<u8>,
    /// Bytes of a payload that are still to be skipped.
    skip: u64,
    header: [u8; HEADER_BYTES],
    /// Bytes of `header` that have arrived.
    filled: usize,
    /// The record whose payload is skipped. It counts once it is whole.
    record: Option<RecordHeader>,
    /// A header was damaged: nothing after it can be told.
    lost: bool,
    totals: BTreeMap<u16, RecordTotal>,
}

/// All records of one type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecordTotal {
    pub records: u64,
    /// Payload bytes as stored, headers not counted.
    pub stored_bytes: u64,
    /// Payload bytes as unpacked, by what the headers say.
    pub unpacked_bytes: u64,
}

impl RecordScan {
    /// Takes the next piece of the stream.
    pub fn push(&mut self, bytes: &[u8]) {
        let missing = (PREAMBLE_BYTES - self.preamble.len()).min(bytes.len());
        let (preamble, mut bytes) = bytes.split_at(missing);
        self.preamble.extend_from_slice(preamble);
        while !bytes.is_empty() && !self.lost {
            if self.skip > 0 {
                let skipped = usize::try_from(self.skip)
                    .unwrap_or(usize::MAX)
                    .min(bytes.len());
                self.skip -= skipped as u64;
                bytes = &bytes[skipped..];
                self.count_whole();
                continue;
            }
            let taken = bytes.len().min(HEADER_BYTES - self.filled);
            self.header[self.filled..self.filled + taken].copy_from_slice(&bytes[..taken]);
            self.filled += taken;
            bytes = &bytes[taken..];
            if self.filled == HEADER_BYTES {
                self.filled = 0;
                match RecordHeader::read(&self.header) {
                    Ok(header) => {
                        self.skip = u64::from(header.stored_bytes);
                        self.record = Some(header);
                        self.count_whole();
                    }
                    Err(_) => self.lost = true,
                }
            }
        }
    }

    /// Counts the record in progress if it is whole.
    fn count_whole(&mut self) {
        if self.skip == 0
            && let Some(header) = self.record.take()
        {
            let total = self.totals.entry(header.record_type).or_default();
            total.records += 1;
            total.stored_bytes += u64::from(header.stored_bytes);
            total.unpacked_bytes += u64::from(header.unpacked_bytes);
        }
    }

    /// The version in the preamble; none where that is damaged or has not come.
    pub fn container_version(&self) -> Option<u16> {
        let bytes = self.preamble.first_chunk::<PREAMBLE_BYTES>()?;
        Preamble::read(bytes).ok().map(|preamble| preamble.version)
    }

    /// Number, name and total of each type that occurred, by number.
    pub fn by_type(&self) -> impl Iterator<Item = (u16, &'static str, RecordTotal)> {
        self.totals
            .iter()
            .map(|(&number, &total)| (number, record_type::name(number), total))
    }

    /// All types together.
    pub fn total(&self) -> RecordTotal {
        self.totals
            .values()
            .fold(RecordTotal::default(), |sum, total| sum.plus(total))
    }
}

impl RecordTotal {
    /// The sum of two totals.
    pub fn plus(&self, other: &RecordTotal) -> RecordTotal {
        RecordTotal {
            records: self.records + other.records,
            stored_bytes: self.stored_bytes + other.stored_bytes,
            unpacked_bytes: self.unpacked_bytes + other.unpacked_bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::container::crc32c;

    fn stream() -> Vec<u8> {
        let mut bytes = vec![7; PREAMBLE_BYTES];
        for (record_type, stored_bytes, unpacked_bytes) in [
            (record_type::POINTS, 5, 50),
            (record_type::COMMIT, 0, 0),
            (record_type::POINTS, 70, 80),
        ] {
            let header = RecordHeader {
                record_type,
                critical: true,
                version: 0,
                packing: 0,
                sequence: 0,
                stored_bytes,
                unpacked_bytes,
                payload_crc: 0,
            };
            bytes.extend(header.to_bytes());
            bytes.extend(vec![9; stored_bytes as usize]);
        }
        bytes
    }

    #[test]
    fn totals_are_the_same_for_any_split() {
        let bytes = stream();
        for piece in 1..bytes.len() {
            let mut scan = RecordScan::default();
            bytes.chunks(piece).for_each(|chunk| scan.push(chunk));
            let total = |records, stored_bytes, unpacked_bytes| RecordTotal {
                records,
                stored_bytes,
                unpacked_bytes,
            };
            assert_eq!(scan.total(), total(3, 75, 130), "pieces of {piece}");
            let types: Vec<_> = scan.by_type().collect();
            assert_eq!(
                types,
                [
                    (record_type::COMMIT, "commit", total(1, 0, 0)),
                    (record_type::POINTS, "points", total(2, 75, 130))
                ]
            );
        }
    }

    #[test]
    fn a_damaged_header_ends_the_count() {
        let mut bytes = stream();
        bytes[PREAMBLE_BYTES + HEADER_BYTES + 5 + 3] ^= 1;
        let mut scan = RecordScan::default();
        scan.push(&bytes);
        assert_eq!(scan.total().records, 1);
    }

    #[test]
    fn versions_are_read_from_whole_preambles() {
        let mut preamble = vec![0x89, b'D', b'P', b'L', 0x0d, 0x0a, 0x1a, 0x0a, 7, 0, 0, 0];
        preamble.extend(crc32c(&preamble).to_le_bytes());
        let mut scan = RecordScan::default();
        scan.push(&preamble[..15]);
        assert_eq!(scan.container_version(), None);
        scan.push(&preamble[15..]);
        assert_eq!(scan.container_version(), Some(7));
        preamble[8] = 8;
        let mut scan = RecordScan::default();
        scan.push(&preamble);
        assert_eq!(scan.container_version(), None);
    }
}
