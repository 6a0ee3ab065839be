//! The pass of the `points` model: AO for every pixel of a G-buffer, on the device
//! (`points.wgsl`, compute) or on the CPU (`points/sample.rs`).

use super::gbuffer::{GBuffer, NONE};
use super::gpu::Gpu;
use super::shaders;
use crate::points::client::{PointsState, PointsTrack};
use crate::points::sample::{self, Case, Fallback, GridTransform, NO_TRACK};
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use dapple_codec::points::{Bucket, Cell, DirtyRange};
use rayon::prelude::*;

/// How the pixels that see geometry came by their AO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Points within reach.
    pub found: u64,
    /// None within reach, filled from the block ([`Fallback::Fill`]).
    pub filled: u64,
    /// Nothing to go by: AO = 1.
    pub none: u64,
    /// The instance has no track: AO = 1.
    pub untracked: u64,
}

impl Counts {
    /// Adds another picture's fragments.
    pub fn add(&mut self, other: &Counts) {
        self.found += other.found;
        self.filled += other.filled;
        self.none += other.none;
        self.untracked += other.untracked;
    }

    /// Share of the fragments with a track that have no point within reach.
    pub fn without_point(&self) -> f64 {
        (self.filled + self.none) as f64 / self.tracked()
    }

    /// Share of the fragments with a track that even the fallback could do nothing for.
    pub fn without_any(&self) -> f64 {
        self.none as f64 / self.tracked()
    }

    fn tracked(&self) -> f64 {
        (self.found + self.filled + self.none).max(1) as f64
    }
}

/// AO per pixel and how it was come by.
#[derive(Clone, Debug, PartialEq)]
pub struct PointsAo {
    /// One value a pixel, row by row from the top; 1 in the sky.
    pub ao: Vec<f32>,
    pub counts: Counts,
}

/// A pixel's question to the sampler. 32 bytes, as in `points.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Query {
    /// Grid space.
    pub position: [f32; 3],
    /// Index of the track, or [`NO_TRACK`].
    pub track: u32,
    pub normal: [f32; 3],
    pub pad: u32,
}

/// 96 bytes, as in `embed/shaders/wgsl/points.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuTrack {
    first_bucket: u32,
    first_cell: u32,
    bucket_count: u32,
    cell_count: u32,
    dims: [u32; 3],
    widths: u32,
    cell_edge: f32,
    radius: f32,
    pad: [u32; 2],
    grid_from_mesh: [[f32; 4]; 3],
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuResult {
    ao: f32,
    case_and_points: u32,
}

impl<'a> PointsState<'a> {
    /// The track's own buckets and cells.
    fn own(&self, index: usize) -> Result<(&'a [Bucket], &'a [Cell])> {
        let track = &self.tracks[index];
        let range = |first: u32, count: u32| first as usize..first as usize + count as usize;
        let buckets = self
            .buckets
            .get(range(track.first_bucket, track.grid.bucket_count));
        let cells = self
            .cells
            .get(range(track.first_cell, track.grid.cell_capacity));
        match (buckets, cells) {
            (Some(buckets), Some(cells)) if sample::usable(&track.grid) => Ok((buckets, cells)),
            _ => Err(Error::Invalid(format!(
                "points track {index} does not fit: {} buckets from {}, {} cells from {}, in {} \
                 buckets and {} cells",
                track.grid.bucket_count,
                track.first_bucket,
                track.grid.cell_capacity,
                track.first_cell,
                self.buckets.len(),
                self.cells.len()
            ))),
        }
    }

    fn check(&self) -> Result<()> {
        (0..self.tracks.len()).try_for_each(|i| self.own(i).map(|_| ()))
    }

    /// The questions of a G-buffer: lookup positions and normals taken to grid space.
    pub(super) fn queries(&self, gbuffer: &GBuffer) -> Vec<Query> {
        let transforms: Vec<_> = self
            .tracks
            .iter()
            .map(|t| GridTransform::new(&t.grid))
            .collect();
        let query = |fragment: &super::gbuffer::Fragment| {
            let instance = fragment.instance as usize;
            let track = self.track_of_instance.get(instance).copied().flatten();
            let known = track.and_then(|t| Some((t, transforms.get(t as usize)?)));
            match known {
                Some((track, transform)) if fragment.instance != NONE => Query {
                    position: transform.position(fragment.lookup_position).to_array(),
                    track,
                    normal: transform.normal(fragment.lookup_normal).to_array(),
                    pad: 0,
                },
                _ => Query {
                    track: NO_TRACK,
                    ..Query::zeroed()
                },
            }
        };
        gbuffer.fragments.par_iter().map(query).collect()
    }
}

/// The pass on the CPU.
pub fn ao_on_cpu(gbuffer: &GBuffer, state: &PointsState, fallback: Fallback) -> Result<PointsAo> {
    let queries = state.queries(gbuffer);
    let results = sample_on_cpu(&queries, state, fallback)?;
    Ok(gather(gbuffer, &queries, &results))
}

/// The pass on a device. Keeps its pipeline and buffers from call to call.
pub struct PointsPass {
    pipeline: wgpu::ComputePipeline,
    /// Queries, tracks, buckets, cells, results, staging; grown as needed.
    buffers: [Option<wgpu::Buffer>; 6],
}

impl PointsPass {
    pub fn new(gpu: &Gpu) -> Result<PointsPass> {
        let module = gpu.module(&shaders::POINTS);
        let pipeline = gpu
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("points"),
                layout: None,
                module: &module,
                entry_point: Some("main"),
                compilation_options: Default::default(),
                cache: None,
            });
        gpu.check()?;
        Ok(PointsPass {
            pipeline,
            buffers: [const { None }; 6],
        })
    }

    pub fn ao(
        &mut self,
        gpu: &Gpu,
        gbuffer: &GBuffer,
        state: &PointsState,
        fallback: Fallback,
    ) -> Result<PointsAo> {
        let queries = state.queries(gbuffer);
        let results = self.sample(gpu, gbuffer.width, &queries, state, fallback)?;
        Ok(gather(gbuffer, &queries, &results))
    }

    /// AO, case and number of points of each query; they lie in rows of `width`.
    pub(super) fn sample(
        &mut self,
        gpu: &Gpu,
        width: u32,
        queries: &[Query],
        state: &PointsState,
        fallback: Fallback,
    ) -> Result<Vec<(f32, Case, u32)>> {
        state.check()?;
        if queries.is_empty() {
            return Ok(Vec::new());
        }
        let height = queries.len() as u32 / width;
        let tracks: Vec<GpuTrack> = state.tracks.iter().map(gpu_track).collect();
        let result_bytes = size_of_val(queries) as u64 / 4;
        type Input<'i> = (&'i str, &'i [u8], Option<&'i [DirtyRange]>);
        let inputs: [Input; 4] = [
            ("queries", bytemuck::cast_slice(queries), None),
            ("tracks", bytemuck::cast_slice(&tracks), None),
            (
                "buckets",
                bytemuck::cast_slice(state.buckets),
                state.dirty.map(|d| d.buckets),
            ),
            (
                "cells",
                bytemuck::cast_slice(state.cells),
                state.dirty.map(|d| d.cells),
            ),
        ];
        for (slot, (label, bytes, dirty)) in self.buffers.iter_mut().zip(inputs) {
            let kept = slot
                .as_ref()
                .is_some_and(|b| b.size() >= bytes.len() as u64);
            let buffer = grown(slot, bytes.len() as u64, |n| gpu.empty_storage(label, n))?;
            match dirty.filter(|_| kept) {
                Some(ranges) => upload(gpu, buffer, bytes, ranges),
                None => gpu.queue.write_buffer(buffer, 0, bytes),
            }
        }
        let [queries_, tracks_, buckets_, cells_, results, staging] = &mut self.buffers;
        let results = grown(results, result_bytes, |n| gpu.empty_storage("results", n))?;
        let staging = grown(staging, result_bytes, |n| Ok(gpu.staging(n)))?;
        let (Some(queries_), Some(tracks_), Some(buckets_), Some(cells_)) =
            (&*queries_, &*tracks_, &*buckets_, &*cells_)
        else {
            return Err(Error::Gpu(format!("{}: buffers are missing", gpu.name())));
        };
        let pass = gpu.uniform(
            "pass",
            bytemuck::cast_slice(&[width, height, fallback as u32, 0]),
        );
        let own = gpu.bind(
            &self.pipeline.get_bind_group_layout(0),
            &[&pass, queries_, results],
        );
        let model = gpu.bind_numbered(
            &self.pipeline.get_bind_group_layout(1),
            &[(32, tracks_), (33, buckets_), (34, cells_)],
        );
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &own, &[]);
            pass.set_bind_group(1, &model, &[]);
            pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        }
        commands.copy_buffer_to_buffer(results, 0, staging, 0, result_bytes);
        gpu.read(commands, staging, |bytes| {
            let result = |bytes: &[u8]| {
                let r: GpuResult = bytemuck::pod_read_unaligned(bytes);
                let case = match r.case_and_points & 0xff {
                    0 => Case::Found,
                    1 => Case::Filled,
                    _ => Case::None,
                };
                (r.ao, case, r.case_and_points >> 8)
            };
            bytes[..result_bytes as usize]
                .chunks_exact(8)
                .map(result)
                .collect()
        })
    }
}

/// Uploads ranges of 32-byte items; what lies beyond the end is left out.
fn upload(gpu: &Gpu, buffer: &wgpu::Buffer, bytes: &[u8], ranges: &[DirtyRange]) {
    const ITEM: usize = size_of::<Cell>();
    const _: () = assert!(size_of::<Bucket>() == ITEM);
    for range in ranges {
        let (start, end) = (range.start as usize * ITEM, range.end as usize * ITEM);
        if let Some(bytes) = bytes.get(start..end.min(bytes.len())) {
            gpu.queue.write_buffer(buffer, start as u64, bytes);
        }
    }
}

fn grown(
    slot: &mut Option<wgpu::Buffer>,
    size: u64,
    make: impl FnOnce(u64) -> Result<wgpu::Buffer>,
) -> Result<&wgpu::Buffer> {
    let buffer = match slot.take() {
        Some(buffer) if buffer.size() >= size => buffer,
        _ => make(size)?,
    };
    Ok(slot.insert(buffer))
}

fn gpu_track(track: &PointsTrack) -> GpuTrack {
    let w = track.grid.widths;
    GpuTrack {
        first_bucket: track.first_bucket,
        first_cell: track.first_cell,
        bucket_count: track.grid.bucket_count,
        cell_count: track.grid.cell_capacity,
        dims: track.grid.dims.map(u32::from),
        widths: u32::from(w.position) | u32::from(w.normal) << 8 | u32::from(w.ao) << 16,
        cell_edge: track.grid.cell_edge,
        radius: track.grid.radius,
        pad: [0; 2],
        grid_from_mesh: track.grid.grid_from_mesh,
    }
}

/// Twin of [`PointsPass::sample`].
pub(super) fn sample_on_cpu(
    queries: &[Query],
    state: &PointsState,
    fallback: Fallback,
) -> Result<Vec<(f32, Case, u32)>> {
    let own: Result<Vec<_>> = (0..state.tracks.len()).map(|i| state.own(i)).collect();
    let own = own?;
    let sample = |q: &Query| {
        if q.track == NO_TRACK {
            return (1.0, Case::None, 0);
        }
        let grid = &state.tracks[q.track as usize].grid;
        let (buckets, cells) = own[q.track as usize];
        let (x, n) = (q.position.into(), q.normal.into());
        let s = sample::sample(grid, buckets, cells, x, n, fallback);
        (s.ao, s.case, s.points)
    };
    Ok(queries.par_iter().map(sample).collect())
}

fn gather(gbuffer: &GBuffer, queries: &[Query], results: &[(f32, Case, u32)]) -> PointsAo {
    let mut counts = Counts::default();
    let pixels = gbuffer.fragments.iter().zip(queries).zip(results);
    for ((fragment, query), (_, case, _)) in pixels {
        if fragment.instance == NONE {
            continue;
        }
        *match case {
            _ if query.track == NO_TRACK => &mut counts.untracked,
            Case::Found => &mut counts.found,
            Case::Filled => &mut counts.filled,
            Case::None => &mut counts.none,
        } += 1;
    }
    PointsAo {
        ao: results.iter().map(|(ao, ..)| *ao).collect(),
        counts,
    }
}

#[cfg(test)]
mod tests {
    use super::super::gpu;
    use super::*;
    use crate::points::client::Dirty;
    use crate::points::sample::tests::{Random, WIDTHS, random_state};
    use dapple_codec::points::PointWidths;
    use glam::Vec3;

    /// Several tracks of random states in shared buffers, and queries within and about them.
    #[test]
    fn device_and_cpu_agree() {
        let Some(gpu) = gpu::for_test() else { return };
        let mut pass = PointsPass::new(&gpu).unwrap();
        let (mut tracks, mut buckets, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        let odd = PointWidths {
            position: 5,
            normal: 6,
            ao: 4,
        };
        for (seed, widths) in WIDTHS.into_iter().chain([odd]).enumerate() {
            let state = random_state(seed as u32 + 20, widths);
            tracks.push(PointsTrack {
                grid: state.grid,
                first_bucket: buckets.len() as u32,
                first_cell: cells.len() as u32,
            });
            buckets.extend(state.buckets);
            cells.extend(state.cells);
        }
        let state = PointsState {
            tracks: &tracks,
            buckets: &buckets,
            cells: &cells,
            track_of_instance: &[],
            dirty: None,
        };
        let mut random = Random::new(77);
        let query = |i: u32, random: &mut Random| Query {
            position: (random.vec() * Vec3::new(1.8, 1.4, 1.6) - 0.2).to_array(),
            track: if i % 10 == 9 { NO_TRACK } else { i % 4 },
            normal: random.direction().to_array(),
            pad: 0,
        };
        let queries: Vec<_> = (0..100 * 61).map(|i| query(i, &mut random)).collect();
        for fallback in [Fallback::One, Fallback::Fill] {
            let on_cpu = sample_on_cpu(&queries, &state, fallback).unwrap();
            let on_gpu = pass.sample(&gpu, 100, &queries, &state, fallback).unwrap();
            assert_eq!(on_cpu.len(), on_gpu.len());
            let mut strays = 0;
            for (cpu, gpu) in on_cpu.iter().zip(&on_gpu) {
                // A point within rounding of a threshold may count on one side only.
                strays +=
                    u32::from((cpu.1, cpu.2) != (gpu.1, gpu.2) || (cpu.0 - gpu.0).abs() > 1e-4);
            }
            assert!(strays <= 2, "{strays} of {} differ", queries.len());
            let cases = |case| on_cpu.iter().filter(|r| r.1 == case).count();
            assert!(cases(Case::Found) > 500 && cases(Case::None) > 500);
            assert_eq!(cases(Case::Filled) > 100, fallback == Fallback::Fill);
        }
    }

    #[test]
    fn only_dirty_ranges_are_uploaded() {
        let Some(gpu) = gpu::for_test() else { return };
        let mut pass = PointsPass::new(&gpu).unwrap();
        let mut own = random_state(31, WIDTHS[0]);
        let track = PointsTrack {
            grid: own.grid,
            first_bucket: 0,
            first_cell: 0,
        };
        let mut random = Random::new(3);
        let mut query = || Query {
            position: (random.vec() * 1.2).to_array(),
            track: 0,
            normal: random.direction().to_array(),
            pad: 0,
        };
        let queries: Vec<_> = (0..4096).map(|_| query()).collect();
        let mut mean = |cells: &[Cell], dirty: Option<&[DirtyRange]>| {
            let state = PointsState {
                tracks: &[track],
                buckets: &own.buckets,
                cells,
                track_of_instance: &[],
                dirty: dirty.map(|cells| Dirty {
                    buckets: &[],
                    cells,
                }),
            };
            let results = pass
                .sample(&gpu, 64, &queries, &state, Fallback::Fill)
                .unwrap();
            let cpu = sample_on_cpu(&queries, &state, Fallback::Fill).unwrap();
            let mean = |results: &[(f32, Case, u32)]| results.iter().map(|r| r.0).sum::<f32>();
            (mean(&results) / 4096.0, mean(&cpu) / 4096.0)
        };
        let (before, expected) = mean(&own.cells, None);
        assert!((before - expected).abs() < 1e-3, "{before} {expected}");
        // Everything turns black, and the device is told of nothing, then of all of it.
        own.cells
            .iter_mut()
            .flat_map(|cell| &mut cell.points)
            .for_each(|word| *word &= !0xff);
        let (stale, expected) = mean(&own.cells, Some(&[]));
        assert_eq!(stale, before);
        let all = DirtyRange {
            start: 0,
            end: own.cells.len() as u32,
        };
        let (after, _) = mean(&own.cells, Some(&[all]));
        assert!(
            (after - expected).abs() < 1e-3 && after < before - 0.1,
            "{after} {expected}"
        );
    }

    #[test]
    fn a_track_beyond_the_buffers_is_an_error() {
        let own = random_state(1, WIDTHS[0]);
        let track = PointsTrack {
            grid: own.grid,
            first_bucket: 1,
            first_cell: 0,
        };
        let state = PointsState {
            tracks: &[track],
            buckets: &own.buckets,
            cells: &own.cells,
            track_of_instance: &[],
            dirty: None,
        };
        let error = sample_on_cpu(&[], &state, Fallback::Fill).unwrap_err();
        assert!(error.to_string().contains("points track 0"), "{error}");
    }
}
