//! What records a stream has, told from their headers alone, in constant memory.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::codec::container::{HEADER_BYTES, PREAMBLE_BYTES, RecordHeader, record_type};

/// Reads record headers from pieces of a stream and skips what they announce. Checks nothing but
/// the headers' own checksums: it runs beside a decoder, which checks all.
#[derive(Debug)]
pub struct RecordScan {
    /// Bytes of the preamble or of a payload that are still to be skipped.
    skip: u64,
    header: [u8; HEADER_BYTES],
    /// Bytes of `header` that have arrived.
    filled: usize,
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

impl Default for RecordScan {
    fn default() -> Self {
        RecordScan {
            skip: PREAMBLE_BYTES as u64,
            header: [0; HEADER_BYTES],
            filled: 0,
            lost: false,
            totals: BTreeMap::new(),
        }
    }
}

impl RecordScan {
    /// Takes the next piece of the stream.
    pub fn push(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() && !self.lost {
            if self.skip > 0 {
                let skipped = usize::try_from(self.skip)
                    .unwrap_or(usize::MAX)
                    .min(bytes.len());
                self.skip -= skipped as u64;
                bytes = &bytes[skipped..];
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
                        let total = self.totals.entry(header.record_type).or_default();
                        total.records += 1;
                        total.stored_bytes += u64::from(header.stored_bytes);
                        total.unpacked_bytes += u64::from(header.unpacked_bytes);
                    }
                    Err(_) => self.lost = true,
                }
            }
        }
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
}
