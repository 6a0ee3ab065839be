//! The samplers of the client against the query vectors of `instances`: `instances/sample.rs` on the CPU
//! and, where there is an adapter, `embed/shaders/wgsl/instances.wgsl`, which must agree with each other as well.

use bytemuck::{Pod, Zeroable};
use dapple::codec::instances::{Table, key};
use dapple::codec::{Decoder, TrackState};
use dapple::instances::client::entry_of;
use dapple::instances::sample::Bounds;
use dapple::render::gpu::Gpu;
use dapple_conformance::models::POSITION_UNIT;
use dapple_conformance::models::Query;
use dapple_conformance::models::instances::queries::InstancesQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{self, Kind, Vector};

pub(crate) fn vectors() -> Vec<Vector> {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|vector| vector.kind == Kind::Queries && vector.area == "instances");
    assert!(vectors.len() >= 8, "{} vectors", vectors.len());
    vectors
}

pub(crate) fn queries(vector: &Vector) -> Vec<&InstancesQuery> {
    let queries = vector.info.queries.iter().map(|query| match query {
        Query::Instances(query) => query,
        _ => panic!("{}: not of instances", vector.path()),
    });
    queries.collect()
}

/// The only track.
pub(crate) fn track(decoder: &Decoder) -> (&TrackState, &Table) {
    let [live] = decoder.tracks() else {
        panic!("{} tracks", decoder.tracks().len());
    };
    (
        live,
        live.track.instance_table().expect("a track of instances"),
    )
}

fn position(query: &InstancesQuery) -> [f32; 3] {
    query.position.map(|v| v as f32 * POSITION_UNIT)
}

fn local(query: &InstancesQuery) -> f32 {
    query.local as f32 / 65536.0
}

fn on_cpu(decoder: &Decoder, query: &InstancesQuery) -> f32 {
    match entry_of(decoder, track(decoder).0, &query.instance) {
        Some(entry) => entry.ao(position(query), local(query)),
        None => local(query),
    }
}

pub(crate) fn check(vector: &Vector, number: usize, ao: f32) {
    let query = &vector.info.queries[number];
    let path = vector.path();
    assert!(
        query.accepts(&[f64::from(ao)]),
        "{path}: {ao} for {query:?}"
    );
}

#[test]
fn on_the_cpu() {
    for vector in vectors() {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        for (number, query) in queries(&vector).into_iter().enumerate() {
            check(&vector, number, on_cpu(&decoder, query));
        }
    }
}

/// 48 bytes, as in `embed/shaders/wgsl/instances.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct DeviceTable {
    centre: [f32; 3],
    share: f32,
    per_half_extent: [f32; 3],
    scale: f32,
    signals: u32,
    pad: [u32; 3],
}

impl DeviceTable {
    pub(crate) fn of(live: &TrackState, table: &Table) -> DeviceTable {
        let bounds = Bounds::new(live.track.aabb_min, live.track.aabb_max);
        DeviceTable {
            centre: bounds.centre,
            share: table.signals.share,
            per_half_extent: bounds.per_half_extent,
            scale: f32::from(1u8 << table.exponent),
            signals: table.signals.count.into(),
            pad: [0; 3],
        }
    }
}

/// 32 bytes, as in `ask.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Question {
    pub(crate) position: [f32; 3],
    pub(crate) local: f32,
    pub(crate) entry: u32,
    pad: [u32; 3],
}

impl Question {
    pub(crate) fn of(decoder: &Decoder, query: &InstancesQuery) -> Question {
        let keys = decoder.instances().keys_of(track(decoder).0);
        let entry = keys.binary_search(&key(&query.instance));
        Question {
            position: position(query),
            local: local(query),
            entry: entry.map_or(u32::MAX, |index| index as u32),
            pad: [0; 3],
        }
    }
}

fn ask(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    decoder: &Decoder,
    questions: &[Question],
) -> Vec<f32> {
    let (live, table) = track(decoder);
    let values = bytemuck::cast_slice(decoder.instances().values_of(live));
    let values = gpu.storage("values", values).expect("the values fit");
    let table = DeviceTable::of(live, table);
    let table = gpu.uniform("table", bytemuck::bytes_of(&table));
    let questions_ = gpu.storage("questions", bytemuck::cast_slice(questions));
    let questions_ = questions_.expect("the questions fit");
    let size = 4 * questions.len() as u64;
    let answers = gpu.empty_storage("answers", size).expect("they fit");
    let staging = gpu.staging(size);
    let asked = gpu.bind(&pipeline.get_bind_group_layout(0), &[&questions_, &answers]);
    let sampler = gpu.bind_numbered(
        &pipeline.get_bind_group_layout(1),
        &[(0, &table), (48, &values)],
    );
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &asked, &[]);
        pass.set_bind_group(1, &sampler, &[]);
        pass.dispatch_workgroups(questions.len().div_ceil(64) as u32, 1, 1);
    }
    commands.copy_buffer_to_buffer(&answers, 0, &staging, 0, size);
    let answers = gpu.read(commands, &staging, |bytes| {
        bytes
            .chunks_exact(4)
            .map(bytemuck::pod_read_unaligned)
            .collect()
    });
    answers.expect("the shader runs")
}

#[test]
fn on_a_device() {
    let gpu = match Gpu::new() {
        Ok(gpu) => gpu,
        Err(e) if std::env::var_os("CI").is_some() => panic!("CI needs an adapter: {e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            return;
        }
    };
    let source = concat!(
        include_str!("../embed/shaders/wgsl/instances.wgsl"),
        include_str!("../embed/shaders/wgsl/instances_buffers.wgsl"),
        include_str!("instances_queries/ask.wgsl")
    );
    let module = wgpu::ShaderModuleDescriptor {
        label: Some("ask.wgsl"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    };
    let module = gpu.device.create_shader_module(module);
    let pipeline = wgpu::ComputePipelineDescriptor {
        label: Some("ask"),
        layout: None,
        module: &module,
        entry_point: Some("ask"),
        compilation_options: Default::default(),
        cache: None,
    };
    let pipeline = gpu.device.create_compute_pipeline(&pipeline);
    gpu.check().expect("the shader is sound");
    for vector in vectors() {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        let queries = queries(&vector);
        let questions: Vec<_> = queries.iter().map(|q| Question::of(&decoder, q)).collect();
        let answers = ask(&gpu, &pipeline, &decoder, &questions);
        assert_eq!(answers.len(), queries.len());
        for (number, (query, ao)) in queries.iter().zip(answers).enumerate() {
            check(&vector, number, ao);
            let twin = on_cpu(&decoder, query);
            assert!(
                (ao - twin).abs() < 1e-5,
                "{}: {ao} and {twin}",
                vector.path()
            );
        }
    }
}
