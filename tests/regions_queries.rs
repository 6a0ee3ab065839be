//! The query vectors of `regions`, answered by the client's samplers: `regions/sample.rs` on the CPU and, where
//! there is an adapter, `embed/shaders/wgsl/regions.wgsl`.

use bytemuck::{Pod, Zeroable};
use dapple::regions::index::Index;
use dapple::regions::sample::Regions;
use dapple::render::gpu::Gpu;
use dapple_conformance::models::Query;
use dapple_conformance::models::regions::queries::RegionsQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{self, Kind, Vector};
use glam::Vec3;

fn vectors() -> Vec<Vector> {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|vector| vector.kind == Kind::Queries && vector.area == "regions");
    assert!(vectors.len() >= 40, "{} vectors", vectors.len());
    vectors
}

fn query(query: &Query) -> &RegionsQuery {
    match query {
        Query::Regions(query) => query,
        _ => panic!("not of regions"),
    }
}

/// Position and normal as the protocol says them.
fn surface(query: &RegionsQuery) -> (Vec3, Vec3) {
    let position = query.position.map(|v| v as f32 / 65536.0);
    let n = query.normal.map(f64::from);
    let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    (position.into(), n.map(|v| (v / length) as f32).into())
}

/// 32 bytes, as in `ask.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Question {
    position: [f32; 3],
    region: u32,
    normal: [f32; 3],
    pad: u32,
}

/// Answers of the shader to questions in one track.
fn ask(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    regions: &Regions,
    questions: &[Question],
) -> Vec<f32> {
    let storage = |name: &str, bytes: &[u8]| gpu.storage(name, bytes).expect("it fits");
    let size = 4 * questions.len() as u64;
    let answers = gpu.empty_storage("answers", size).expect("they fit");
    let staging = gpu.staging(size);
    let asked = storage("questions", bytemuck::cast_slice(questions));
    let asked = gpu.bind(&pipeline.get_bind_group_layout(0), &[&asked, &answers]);
    let set = [regions.scale, regions.share, 0.0, 0.0];
    let set = gpu.uniform("set", bytemuck::cast_slice(&set));
    let arrays = [
        storage("regions", bytemuck::cast_slice(regions.regions)),
        storage("pairs", bytemuck::cast_slice(regions.pairs)),
    ];
    let sampler = gpu.bind_numbered(
        &pipeline.get_bind_group_layout(1),
        &[(0, &set), (56, &arrays[0]), (57, &arrays[1])],
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
        bytemuck::pod_collect_to_vec::<u8, f32>(bytes)
    });
    answers.expect("the shader runs")
}

/// Answers of a sampler to all queries of all vectors must lie in their intervals. It gets the regions of a
/// track, and place, normal and region of each query.
pub(crate) fn hold(mut sampler: impl FnMut(&Regions, &[(Vec3, Vec3, usize)]) -> Vec<f32>) {
    for vector in vectors() {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        for live in decoder.tracks() {
            let Some(set) = live.track.region_set() else {
                continue;
            };
            let state = decoder.regions();
            let regions = Regions::new(set, state.regions_of(live), state.pairs_of(live));
            let index = Index::new(regions.regions);
            let asked: Vec<&Query> = vector
                .info
                .queries
                .iter()
                .filter(|q| query(q).track == live.track.id)
                .collect();
            let places = asked.iter().map(|q| {
                let (position, normal) = surface(query(q));
                let region = index.find(regions.regions, position);
                assert_eq!(region, regions.find(position));
                // None is beyond any array.
                (position, normal, region.unwrap_or(usize::MAX))
            });
            let answers = sampler(&regions, &places.collect::<Vec<_>>());
            assert_eq!(answers.len(), asked.len());
            for (asked, answer) in asked.iter().zip(answers) {
                assert!(
                    asked.accepts(&[answer.into()]),
                    "{}: {answer} for {asked:?}",
                    vector.path()
                );
            }
        }
    }
}

#[test]
fn regions_on_the_cpu() {
    hold(|regions, places| {
        let answer = |&(p, n, region): &(Vec3, Vec3, usize)| regions.sample(region, p, n);
        places.iter().map(answer).collect()
    });
}

#[test]
fn regions_on_a_device() {
    let gpu = match Gpu::new() {
        Ok(gpu) => gpu,
        Err(e) if std::env::var_os("CI").is_some() => panic!("CI needs an adapter: {e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            return;
        }
    };
    let source = concat!(
        include_str!("../embed/shaders/wgsl/regions.wgsl"),
        include_str!("../embed/shaders/wgsl/regions_buffers.wgsl"),
        include_str!("regions_queries/ask.wgsl")
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
    hold(|regions, places| {
        // A track without regions has no buffer to bind.
        if places.is_empty() || regions.regions.is_empty() {
            return vec![1.0; places.len()];
        }
        let questions: Vec<Question> = places
            .iter()
            .map(|&(position, normal, region)| Question {
                position: position.to_array(),
                region: region as u32,
                normal: normal.to_array(),
                pad: 0,
            })
            .collect();
        let answers = ask(&gpu, &pipeline, regions, &questions);
        for (&(p, n, region), answer) in places.iter().zip(&answers) {
            // The twin does the same in the same order.
            let own = regions.sample(region, p, n);
            assert!((own - answer).abs() < 1e-5, "{own} {answer}");
        }
        answers
    });
}
