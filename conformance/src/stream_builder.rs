//! Builds streams byte by byte: every field can be given a value that no encoder writes, and the
//! checksums above it are mended, so that the fault which is meant is the first that a decoder
//! meets.
//!
//! Nothing here uses the codec's own writer: layouts are written out once more, from `spec/`.

pub mod probes;
pub mod range;

use std::hash::Hasher as _;

use dapple_codec::container::crc32c;
use dapple_codec::points::EMPTY;
use twox_hash::XxHash64;

use probes::Volume;

/// Record types of the specification.
pub mod kind {
    pub const STREAM: u16 = 0x01;
    pub const GROUP: u16 = 0x02;
    pub const TRACK: u16 = 0x03;
    pub const TRACK_REMOVE: u16 = 0x04;
    pub const TRANSFORMS: u16 = 0x05;
    pub const COMMIT: u16 = 0x06;
    pub const END: u16 = 0x07;
    pub const SEEK_INDEX: u16 = 0x10;
    pub const POINTS: u16 = 0x20;
    pub const PROBES: u16 = 0x21;
}

/// Bytes of a preamble and of a record header.
pub const PREAMBLE: usize = 16;
pub const HEADER: usize = 32;

/// A packing, with what the packer needs to know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pack {
    #[default]
    None,
    Lz4,
    /// Level.
    Zstd(i32),
}

/// A record header's fields as they will stand there; `header_crc` is what the CRC is XORed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    pub record_type: u16,
    pub critical: bool,
    pub version: u8,
    pub packing: u8,
    pub reserved: u32,
    pub sequence: u64,
    pub stored: u32,
    pub unpacked: u32,
    pub payload_crc: u32,
    pub header_crc: u32,
}

impl Header {
    fn bytes(&self) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        let record_type = self.record_type | if self.critical { 0x8000 } else { 0 };
        bytes[0..2].copy_from_slice(&record_type.to_le_bytes());
        bytes[2] = self.version;
        bytes[3] = self.packing;
        bytes[4..8].copy_from_slice(&self.reserved.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.stored.to_le_bytes());
        bytes[20..24].copy_from_slice(&self.unpacked.to_le_bytes());
        bytes[24..28].copy_from_slice(&self.payload_crc.to_le_bytes());
        let crc = crc32c(&bytes[..28]) ^ self.header_crc;
        bytes[28..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }
}

/// A stream in the making.
#[derive(Clone, Debug)]
pub struct StreamBuilder {
    pub bytes: Vec<u8>,
    /// Sequence number of the next record.
    pub sequence: u64,
    headers: XxHash64,
    /// Offset of each record's header.
    pub starts: Vec<usize>,
}

impl Default for StreamBuilder {
    fn default() -> Self {
        StreamBuilder::new()
    }
}

impl StreamBuilder {
    /// A valid preamble.
    pub fn new() -> StreamBuilder {
        StreamBuilder::with_preamble(1, 0)
    }

    /// A preamble of some version and profile, with its CRC.
    pub fn with_preamble(version: u16, profile: u16) -> StreamBuilder {
        StreamBuilder::with_magic(*b"\x89DPL\r\n\x1a\n", version, profile)
    }

    /// A preamble of some magic, version and profile, with its CRC.
    pub fn with_magic(magic: [u8; 8], version: u16, profile: u16) -> StreamBuilder {
        let mut bytes = magic.to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend(profile.to_le_bytes());
        bytes.extend(crc32c(&bytes).to_le_bytes());
        let mut headers = XxHash64::with_seed(0);
        headers.write(&bytes);
        StreamBuilder {
            bytes,
            sequence: 0,
            headers,
            starts: Vec::new(),
        }
    }

    /// A preamble and the usual `stream` record: 60 ticks a second.
    pub fn started() -> StreamBuilder {
        let mut builder = StreamBuilder::new();
        builder.put(kind::STREAM, &words(&[60, 1]));
        builder
    }

    /// Appends a critical record, as it is.
    pub fn put(&mut self, record_type: u16, payload: &[u8]) -> &mut StreamBuilder {
        self.put_with(record_type, Pack::None, payload, |_| {})
    }

    /// Appends a critical record, packed.
    pub fn put_packed(
        &mut self,
        record_type: u16,
        pack: Pack,
        payload: &[u8],
    ) -> &mut StreamBuilder {
        self.put_with(record_type, pack, payload, |_| {})
    }

    /// Appends a record whose header fields `change` may alter before its CRC is computed.
    pub fn put_with(
        &mut self,
        record_type: u16,
        pack: Pack,
        payload: &[u8],
        change: impl FnOnce(&mut Header),
    ) -> &mut StreamBuilder {
        let stored = packed(pack, payload);
        self.put_stored(record_type, pack, payload.len(), &stored, change)
    }

    /// Appends a record whose payload is packed already.
    pub fn put_stored(
        &mut self,
        record_type: u16,
        pack: Pack,
        unpacked: usize,
        stored: &[u8],
        change: impl FnOnce(&mut Header),
    ) -> &mut StreamBuilder {
        let mut header = Header {
            record_type,
            critical: true,
            version: 0,
            packing: match pack {
                Pack::None => 0,
                Pack::Lz4 => 1,
                Pack::Zstd(_) => 2,
            },
            reserved: 0,
            sequence: self.sequence,
            stored: stored.len() as u32,
            unpacked: unpacked as u32,
            payload_crc: crc32c(stored),
            header_crc: 0,
        };
        change(&mut header);
        let bytes = header.bytes();
        self.starts.push(self.bytes.len());
        self.headers.write(&bytes);
        self.bytes.extend(bytes);
        self.bytes.extend(stored);
        self.sequence += 1;
        self
    }

    /// Offset of the last record's header.
    pub fn last(&self) -> usize {
        self.starts.last().copied().unwrap_or(PREAMBLE)
    }

    /// Appends the `end` record that fits.
    pub fn end(&mut self) -> &mut StreamBuilder {
        let payload = self.end_payload();
        self.put(kind::END, &payload)
    }

    /// The payload of the `end` record that fits.
    pub fn end_payload(&self) -> Vec<u8> {
        let mut payload = self.sequence.to_le_bytes().to_vec();
        payload.extend(self.headers.finish().to_le_bytes());
        payload
    }

    /// The stream so far with an `end` record.
    pub fn ended(&self) -> Vec<u8> {
        self.clone().end().bytes.clone()
    }
}

/// Packs a payload.
pub fn packed(pack: Pack, payload: &[u8]) -> Vec<u8> {
    match pack {
        Pack::None => payload.to_vec(),
        Pack::Lz4 => {
            let mut block = vec![0; lz4_flex::block::get_maximum_output_size(payload.len())];
            let bytes = lz4_flex::block::compress_into(payload, &mut block);
            block.truncate(bytes.unwrap_or_default());
            block
        }
        // One plain frame with its content size, which is what the library writes by default.
        Pack::Zstd(level) => zstd::bulk::compress(payload, level).unwrap_or_default(),
    }
}

/// Little-endian 32-bit words.
pub fn words(values: &[u32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Little-endian bits of floats.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Replaces the word at an offset.
pub fn set_word(payload: &mut [u8], offset: usize, value: u32) {
    payload[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
}

/// Payload of a `group` record.
pub fn group(id: u32, start: u32, digest: u64) -> Vec<u8> {
    let mut payload = words(&[id, start]);
    payload.extend(digest.to_le_bytes());
    payload
}

/// Payload of a `track` record.
pub fn tracks(entries: &[Entry]) -> Vec<u8> {
    let mut payload = words(&[entries.len() as u32, 0]);
    payload.extend(entries.iter().flat_map(Entry::bytes));
    payload
}

/// Payload of a `track remove` record.
pub fn removal(ids: &[u32]) -> Vec<u8> {
    let mut payload = words(&[ids.len() as u32]);
    payload.extend(words(ids));
    payload
}

/// Payload of a `transforms` record.
pub fn transforms(entries: &[(u32, [f32; 12])]) -> Vec<u8> {
    let mut payload = words(&[entries.len() as u32, 0]);
    for (id, rows) in entries {
        payload.extend(id.to_le_bytes());
        payload.extend(floats(rows));
    }
    payload
}

/// Payload of a `commit` record.
pub fn commit(tick: u64, frame: u32, digest: Option<u64>) -> Vec<u8> {
    let mut payload = tick.to_le_bytes().to_vec();
    payload.extend(words(&[frame, u32::from(digest.is_some())]));
    payload.extend(digest.iter().flat_map(|digest| digest.to_le_bytes()));
    payload
}

/// An entry of a `track` record with all its fields as they will stand there: of a volume where it
/// has one, else of a hash grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Size of the entry; `None` for the one that fits.
    pub size: Option<u32>,
    pub id: u32,
    pub model: u16,
    pub coding: u16,
    pub space: u8,
    pub has_hash: u8,
    /// Length of the path; `None` for the one that fits.
    pub path_length: Option<u16>,
    pub application: u64,
    pub hash: u64,
    pub aabb: [f32; 6],
    pub grid_from_mesh: [f32; 12],
    pub dims: [u16; 3],
    pub dims_reserved: u16,
    pub cell_edge: f32,
    pub radius: f32,
    /// Position, normal, AO.
    pub widths: [u8; 3],
    pub widths_reserved: u8,
    pub buckets: u32,
    pub capacity: u32,
    /// Parameters of `probes` in place of those of `points`.
    pub volume: Option<Volume>,
    pub path: Vec<u8>,
    /// Bytes after the path; `None` for zeros to a multiple of four.
    pub padding: Option<Vec<u8>>,
}

/// The identity as rows of a 3x4 matrix.
pub const IDENTITY: [f32; 12] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.];

impl Entry {
    /// A small grid of 4 x 3 x 2 cubes, 5 buckets and room for 6 cells.
    pub fn new(id: u32) -> Entry {
        Entry {
            size: None,
            id,
            model: 1,
            coding: 0,
            space: 0,
            has_hash: 0,
            path_length: None,
            application: 0,
            hash: 0,
            aabb: [0.0, 0.0, 0.0, 2.0, 1.5, 1.0],
            grid_from_mesh: IDENTITY,
            dims: [4, 3, 2],
            dims_reserved: 0,
            cell_edge: 0.5,
            radius: 0.25,
            widths: [5, 4, 8],
            widths_reserved: 0,
            buckets: 5,
            capacity: 6,
            volume: None,
            path: b"a".to_vec(),
            padding: None,
        }
    }

    /// A volume of `probes`, packed or raw as it has steps or none.
    pub fn of_volume(id: u32, volume: Volume) -> Entry {
        Entry {
            model: 2,
            coding: u16::from(volume.steps != [0; 6]),
            volume: Some(volume),
            ..Entry::new(id)
        }
    }

    /// The entry with its padding.
    pub fn bytes(&self) -> Vec<u8> {
        let mut rest = Vec::new();
        rest.extend(self.id.to_le_bytes());
        rest.extend(self.model.to_le_bytes());
        rest.extend(self.coding.to_le_bytes());
        rest.extend([self.space, self.has_hash]);
        let path_length = self.path_length.unwrap_or(self.path.len() as u16);
        rest.extend(path_length.to_le_bytes());
        rest.extend(self.application.to_le_bytes());
        rest.extend(self.hash.to_le_bytes());
        rest.extend(floats(&self.aabb));
        match &self.volume {
            Some(volume) => rest.extend(volume.bytes()),
            None => rest.extend(self.grid()),
        }
        rest.extend(&self.path);
        match &self.padding {
            Some(padding) => rest.extend(padding),
            None => rest.resize(rest.len().next_multiple_of(4), 0),
        }
        let size = self.size.unwrap_or(rest.len() as u32 + 4);
        [&size.to_le_bytes()[..], &rest].concat()
    }

    /// The parameters of `points`.
    fn grid(&self) -> Vec<u8> {
        let mut grid = floats(&self.grid_from_mesh);
        grid.extend(self.dims.iter().flat_map(|dim| dim.to_le_bytes()));
        grid.extend(self.dims_reserved.to_le_bytes());
        grid.extend(floats(&[self.cell_edge, self.radius]));
        grid.extend(self.widths);
        grid.push(self.widths_reserved);
        grid.extend(words(&[self.buckets, self.capacity]));
        grid
    }

    /// Dense index of a cube.
    pub fn key(&self, [x, y, z]: [u32; 3]) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        x.wrapping_add(dx.wrapping_mul(y.wrapping_add(dy.wrapping_mul(z))))
    }

    /// Bucket of a key (PSAO Eq. 1).
    pub fn bucket(&self, key: u32) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        let (x, y, z) = (key % dx, key / dx % dy, key / dx / dy);
        let h = x
            .wrapping_add(y.wrapping_mul(dx.wrapping_mul(17)))
            .wrapping_add(z.wrapping_mul(dx.wrapping_mul(dy).wrapping_mul(31)));
        h % self.buckets
    }

    /// Bytes of a packed point.
    pub fn point_bytes(&self) -> usize {
        let [position, normal, ao] = self.widths.map(usize::from);
        (1 + 3 * position + 2 * normal + ao) / 8
    }

    /// A point of this track's widths from its codes.
    pub fn point(&self, position: [u32; 3], normal: [u32; 2], ao: u32) -> u32 {
        let [p, n, a] = self.widths.map(u32::from);
        let mut word = 1;
        for axis in [2, 1, 0] {
            word = word << p | position[axis];
        }
        word << (2 * n + a) | normal[1] << (n + a) | normal[0] << a | ao
    }
}

/// A track's part of a `points` payload.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    pub id: u32,
    /// Index and entries; fewer than eight are filled up with EMPTY.
    pub buckets: Vec<(u32, Vec<u32>)>,
    /// Index, key and points; fewer than seven are filled up with 0.
    pub cells: Vec<(u32, u32, Vec<u32>)>,
    /// Bytes of a point.
    pub point_bytes: usize,
}

impl Part {
    /// An empty part of a track.
    pub fn of(entry: &Entry) -> Part {
        Part {
            id: entry.id,
            point_bytes: entry.point_bytes(),
            ..Part::default()
        }
    }

    /// With a bucket.
    pub fn bucket(mut self, index: u32, entries: &[u32]) -> Part {
        self.buckets.push((index, entries.to_vec()));
        self
    }

    /// With a cell.
    pub fn cell(mut self, index: u32, key: u32, points: &[u32]) -> Part {
        self.cells.push((index, key, points.to_vec()));
        self
    }
}

/// Payload of a `points` record; `base` is `None` for a keyframe.
pub fn points(base: Option<u32>, parts: &[Part]) -> Vec<u8> {
    let flags = u32::from(base.is_none());
    let mut payload = words(&[parts.len() as u32, flags, base.unwrap_or(0), 0]);
    for part in parts {
        let counts = [part.buckets.len() as u32, part.cells.len() as u32];
        payload.extend(words(&[part.id, counts[0], counts[1]]));
    }
    for part in parts {
        payload.extend(words(&gaps(part.buckets.iter().map(|bucket| bucket.0))));
        for (_, entries) in &part.buckets {
            let mut all = [EMPTY; 8];
            all[..entries.len()].copy_from_slice(entries);
            payload.extend(words(&all));
        }
        payload.extend(words(&gaps(part.cells.iter().map(|cell| cell.0))));
        payload.extend(words(&part.cells.iter().map(|c| c.1).collect::<Vec<_>>()));
        for (_, _, points) in &part.cells {
            let mut all = [0; 7];
            all[..points.len()].copy_from_slice(points);
            for point in all {
                payload.extend(&point.to_le_bytes()[..part.point_bytes]);
            }
        }
        payload.resize(payload.len().next_multiple_of(4), 0);
    }
    payload
}

/// Gaps of ascending indices.
pub fn gaps(indices: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut next = 0u32;
    indices
        .map(|index| {
            let gap = index.wrapping_sub(next);
            next = index.wrapping_add(1);
            gap
        })
        .collect()
}
