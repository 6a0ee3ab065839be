//! The content of frames, model by model.

use alloc::vec::Vec;

use dapple_codec as codec;
use dapple_codec::{instances, points, probes, regions, vertices};

use super::{Encoder, compression, encode};
use crate::call::{ARGUMENT, Status, items};
use crate::numbers::Coverage;
use crate::parameters::Grid;
use crate::track::Probe;

/// Content of a track of `points` for one frame. Indices count within the track and ascend strictly.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct PointsUpdate {
    /// Id of the track.
    pub track: u32,
    /// 0.
    pub reserved: u32,
    /// Indices of the buckets.
    pub bucket_indices: *const u32,
    /// Whole buckets, 8 words each.
    pub buckets: *const u32,
    /// Number of buckets.
    pub bucket_count: usize,
    /// Indices of the cells.
    pub cell_indices: *const u32,
    /// Whole cells, 8 words each: key and 7 points.
    pub cells: *const u32,
    /// Number of cells.
    pub cell_count: usize,
}

/// Content of a track of `probes` for one frame.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct ProbesUpdate {
    /// Id of the track.
    pub track: u32,
    /// 0.
    pub reserved: u32,
    /// All its probes in the last committed frame, for a delta; not looked at in a keyframe.
    pub base: *const Probe,
    /// All its probes.
    pub probes: *const Probe,
    /// Number of probes.
    pub count: usize,
    /// Its visibility block where it is sent, or null.
    pub visibility: *const u8,
    /// Bytes of that block.
    pub visibility_size: usize,
}

/// Content of a track of `vertices`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct VerticesUpdate {
    /// Id of the track.
    pub track: u32,
    /// 0.
    pub reserved: u32,
    /// The code of each value, signals of a vertex side by side: 0 to 255, or to 31 at 5 bits.
    pub codes: *const u8,
    /// Number of codes.
    pub count: usize,
}

/// An entry of a track of `instances`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct InstanceEntry {
    /// XXH64 of the path of the mesh instance (`dapple_instance_key`).
    pub key: u64,
    /// 1 for four coefficients of each signal, 0 for one.
    pub linear: u32,
    /// 0.
    pub reserved: u32,
    /// Codes of each signal; 0 where there is none.
    pub codes: [[i16; 4]; 2],
}

/// Content of a track of `instances`: all of it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct InstancesUpdate {
    /// Id of the track.
    pub track: u32,
    /// 0.
    pub reserved: u32,
    /// Its entries, keys ascending.
    pub entries: *const InstanceEntry,
    /// Number of entries.
    pub count: usize,
}

/// A region.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Region {
    /// Smallest corner of its box in metres.
    pub min: [f32; 3],
    /// Index of its first pair of coefficients among those of the track.
    pub first: u32,
    /// Largest corner.
    pub max: [f32; 3],
    /// Bits of its form: derivatives 0 and 1, degree 2 and 3, signals less one 4, centred 5.
    pub form: u32,
    /// What offsets count from.
    pub centre: [f32; 3],
    /// 0.
    pub reserved: u32,
}

/// Content of a track of `regions`: all of it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RegionsUpdate {
    /// Id of the track.
    pub track: u32,
    /// 0.
    pub reserved: u32,
    /// Its regions, as many as it declares.
    pub regions: *const Region,
    /// Number of regions.
    pub region_count: usize,
    /// Their coefficients, two `int16_t` a pair; those of each region follow those of the one before.
    pub pairs: *const i16,
    /// Number of pairs.
    pub pair_count: usize,
}

fn coverage(number: u32) -> Result<codec::Coverage, Status> {
    const KEYFRAME: u32 = Coverage::Keyframe as u32;
    const DELTA: u32 = Coverage::Delta as u32;
    match number {
        KEYFRAME => Ok(codec::Coverage::Keyframe),
        DELTA => Ok(codec::Coverage::Delta),
        _ => Err(ARGUMENT),
    }
}

/// Content of the frame for tracks of `points`, ids ascending; each track at most once a frame. `coverage` is
/// `DAPPLE_COVERAGE_*`, `compression` is `DAPPLE_COMPRESSION_*`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_points(
    encoder: *mut Encoder,
    coverage: u32,
    updates: *const PointsUpdate,
    count: usize,
    compression: u32,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let coverage = self::coverage(coverage)?;
            let compression = self::compression(compression)?;
            let updates = items(updates, count)?.iter().map(|update| {
                let buckets = items(update.buckets.cast::<[u32; 8]>(), update.bucket_count)?;
                let cells = items(update.cells.cast::<[u32; 8]>(), update.cell_count)?;
                Ok(points::Update {
                    track: update.track,
                    bucket_indices: items(update.bucket_indices, update.bucket_count)?,
                    buckets: bytemuck::cast_slice(buckets),
                    cell_indices: items(update.cell_indices, update.cell_count)?,
                    cells: bytemuck::cast_slice(cells),
                })
            });
            let updates: Result<Vec<_>, Status> = updates.collect();
            Ok(codec
                .points(out, coverage, &updates?, compression)
                .map(|()| 0))
        })
    }
}

/// Content of the frame for tracks of `probes`, ids ascending; each track at most once a frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_probes(
    encoder: *mut Encoder,
    coverage: u32,
    updates: *const ProbesUpdate,
    count: usize,
    compression: u32,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let coverage = self::coverage(coverage)?;
            let compression = self::compression(compression)?;
            let updates = items(updates, count)?;
            let mut all = Vec::new();
            for update in updates {
                let base = match coverage {
                    codec::Coverage::Keyframe => Vec::new(),
                    codec::Coverage::Delta => to_probes(items(update.base, update.count)?)?,
                };
                all.push((base, to_probes(items(update.probes, update.count)?)?));
            }
            let updates = updates.iter().zip(&all).map(|(update, (base, probes))| {
                let visibility = match update.visibility.is_null() {
                    true => None,
                    false => Some(items(update.visibility, update.visibility_size)?),
                };
                Ok(probes::Update {
                    track: update.track,
                    base,
                    probes,
                    visibility,
                })
            });
            let updates: Result<Vec<_>, Status> = updates.collect();
            Ok(codec
                .probes(out, coverage, &updates?, compression)
                .map(|()| 0))
        })
    }
}

fn to_probes(probes: &[Probe]) -> Result<Vec<probes::Probe>, Status> {
    let probes = probes.iter().map(|probe| {
        Ok(probes::Probe {
            level: u8::try_from(probe.level).map_err(|_| ARGUMENT)?,
            codes: probe.codes,
        })
    });
    probes.collect()
}

/// Content of the frame for tracks of `vertices`, ids ascending: all values of each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_vertices(
    encoder: *mut Encoder,
    updates: *const VerticesUpdate,
    count: usize,
    compression: u32,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let compression = self::compression(compression)?;
            let updates = items(updates, count)?.iter().map(|update| {
                Ok(vertices::Update {
                    track: update.track,
                    codes: items(update.codes, update.count)?,
                })
            });
            let updates: Result<Vec<_>, Status> = updates.collect();
            Ok(codec.vertices(out, &updates?, compression).map(|()| 0))
        })
    }
}

/// Content of the frame for tracks of `instances`, ids ascending: all entries of each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_instances(
    encoder: *mut Encoder,
    updates: *const InstancesUpdate,
    count: usize,
    compression: u32,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let compression = self::compression(compression)?;
            let updates = items(updates, count)?;
            let mut all = Vec::new();
            for update in updates {
                let entries = items(update.entries, update.count)?.iter();
                let entries = entries.map(|entry| instances::Entry {
                    key: entry.key,
                    form: match entry.linear {
                        0 => instances::Form::Scalar,
                        _ => instances::Form::Linear,
                    },
                    codes: entry.codes,
                });
                all.push(entries.collect::<Vec<_>>());
            }
            let updates = updates.iter().zip(&all);
            let updates = updates.map(|(update, entries)| instances::Update {
                track: update.track,
                entries,
            });
            let updates: Vec<_> = updates.collect();
            Ok(codec.instances(out, &updates, compression).map(|()| 0))
        })
    }
}

/// Content of the frame for tracks of `regions`, ids ascending: all regions of each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_regions(
    encoder: *mut Encoder,
    updates: *const RegionsUpdate,
    count: usize,
    compression: u32,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let compression = self::compression(compression)?;
            let updates = items(updates, count)?.iter().map(|update| {
                Ok(regions::Update {
                    track: update.track,
                    regions: bytemuck::cast_slice(items(update.regions, update.region_count)?),
                    pairs: items(update.pairs.cast::<regions::Pair>(), update.pair_count)?,
                })
            });
            let updates: Result<Vec<_>, Status> = updates.collect();
            Ok(codec.regions(out, &updates?, compression).map(|()| 0))
        })
    }
}

/// A packed point: `position` in units of the cell's edge, 0 to 1; a unit normal; AO from 0 (closed) to 1
/// (open). 0 for a null pointer or widths that no track may have.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_points_pack(
    grid: *const Grid,
    position: *const f32,
    normal: *const f32,
    ao: f32,
) -> u32 {
    // SAFETY: the caller's promise: three numbers each.
    unsafe {
        let grid = grid.as_ref().and_then(|grid| grid.to_codec());
        let position = items(position.cast::<[f32; 3]>(), 1);
        let normal = items(normal.cast::<[f32; 3]>(), 1);
        let (Some(grid), Ok([position]), Ok([normal])) = (grid, position, normal) else {
            return 0;
        };
        let widths = grid.widths;
        let fits = (1..=8).contains(&widths.position)
            && (2..=8).contains(&widths.normal)
            && (1..=8).contains(&widths.ao)
            && widths.bits() <= 32;
        match fits {
            true => widths.pack(*position, *normal, ao),
            false => 0,
        }
    }
}

/// The key of a cell: `x + dims[0] * (y + dims[1] * z)`, mod 2^32. 0 for a null pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_points_key(grid: *const Grid, x: u32, y: u32, z: u32) -> u32 {
    // SAFETY: the caller's promise.
    unsafe { grid.as_ref() }.map_or(0, |grid| {
        let [dx, dy, _] = grid.dims;
        let row = y.wrapping_add(dy.wrapping_mul(z));
        x.wrapping_add(dx.wrapping_mul(row))
    })
}

/// The bucket that a key hashes to. 0 for a null pointer or a grid that no track may have.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_points_bucket(grid: *const Grid, key: u32) -> u32 {
    // SAFETY: the caller's promise.
    let grid = unsafe { grid.as_ref() }.and_then(|grid| grid.to_codec());
    grid.map_or(0, |grid| {
        match grid.bucket_count == 0 || grid.dims.contains(&0) {
            true => 0,
            false => grid.bucket_of_key(key),
        }
    })
}

/// The key of a mesh instance by its path, which has `size` bytes of UTF-8. 0 where it is not UTF-8.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_instance_key(path: *const core::ffi::c_char, size: usize) -> u64 {
    // SAFETY: the caller's promise.
    let path = unsafe { items(path.cast::<u8>(), size) };
    let path = path.ok().and_then(|path| core::str::from_utf8(path).ok());
    path.map_or(0, instances::key)
}
