//! Tracks of `vertices` and their records, byte by byte, from `spec/vertices.md` alone.

use crate::models::Parameters;
use crate::models::entry::Entry;
use crate::models::signals::SignalsBlock;
use crate::stream_builder::words;

/// The parameters of a track as they will stand there, and its coding.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertices {
    pub signals: SignalsBlock,
    pub count: u32,
    pub bits: u8,
    pub order: u8,
    pub reserved: u16,
    pub packed: bool,
}

impl Vertices {
    /// One signal of so many vertices, 8 bits, raw, in the order of the file.
    pub fn raw(count: u32) -> Vertices {
        Vertices {
            signals: SignalsBlock::ONE,
            count,
            bits: 8,
            order: 0,
            reserved: 0,
            packed: false,
        }
    }

    /// The same packed.
    pub fn packed(count: u32) -> Vertices {
        Vertices {
            packed: true,
            ..Vertices::raw(count)
        }
    }

    /// With two signals.
    pub fn two(self) -> Vertices {
        Vertices {
            signals: SignalsBlock::TWO,
            ..self
        }
    }

    /// At 5 bits.
    pub fn five(self) -> Vertices {
        Vertices { bits: 5, ..self }
    }

    /// The 24 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.signals.bytes();
        bytes.extend(words(&[self.count]));
        bytes.extend([self.bits, self.order]);
        bytes.extend(self.reserved.to_le_bytes());
        bytes
    }

    /// Signals of a vertex.
    pub fn signal_count(&self) -> usize {
        self.signals.count.into()
    }

    /// Values of the track.
    pub fn values(&self) -> usize {
        self.count as usize * self.signal_count()
    }

    /// The largest code.
    pub fn most(&self) -> u8 {
        if self.bits == 5 { 31 } else { 255 }
    }

    /// The value of a code.
    pub fn value(&self, code: u8) -> u8 {
        match self.bits {
            5 => ((255 * u16::from(code) + 15) / 31) as u8,
            _ => code,
        }
    }

    /// What the section of a track with these codes is.
    pub fn section(&self, codes: &[u8]) -> Vec<u8> {
        if self.packed {
            let mut section = Vec::new();
            for signal in 0..self.signal_count() {
                let mut before = i32::from(self.most());
                for vertex in 0..self.count as usize {
                    let code = i32::from(codes[vertex * self.signal_count() + signal]);
                    section.push((code - before).rem_euclid(i32::from(self.most()) + 1) as u8);
                    before = code;
                }
            }
            return section;
        }
        if self.bits != 5 {
            return codes.to_vec();
        }
        let mut section = vec![0; (5 * codes.len()).div_ceil(8)];
        for (k, code) in codes.iter().enumerate() {
            for b in 0..5 {
                section[(5 * k + b) / 8] |= (code >> b & 1) << ((5 * k + b) % 8);
            }
        }
        section
    }
}

impl Entry {
    /// An entry of `vertices`.
    pub fn of_vertices(id: u32, vertices: Vertices) -> Entry {
        let coding = u16::from(vertices.packed);
        Entry {
            has_hash: 1,
            hash: 0x0123_4567_89ab_cdef,
            path: Vec::new(),
            ..Entry::of(id, 3, coding, Parameters::Vertices(vertices))
        }
    }

    /// The parameters of an entry of `vertices`; `None` for another model.
    pub fn vertices(&self) -> Option<&Vertices> {
        let Parameters::Vertices(vertices) = &self.parameters else {
            return None;
        };
        Some(vertices)
    }
}

/// A track's part of a `vertices` payload.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Section {
    pub id: u32,
    /// What the table says of its size; `None` for the one that fits.
    pub size: Option<u32>,
    pub reserved: u32,
    pub bytes: Vec<u8>,
}

/// Payload of a `vertices` record.
pub fn payload(sections: &[Section]) -> Vec<u8> {
    let mut payload = words(&[sections.len() as u32, 1, 0, 0]);
    for section in sections {
        let size = section.size.unwrap_or(section.bytes.len() as u32);
        payload.extend(words(&[section.id, size, section.reserved]));
    }
    for section in sections {
        payload.extend(&section.bytes);
    }
    payload
}
