//! The samplers of the client against the query vectors of `probes`: `probes/sample.rs` on the CPU
//! and, where there is an adapter, `embed/shaders/wgsl/probes.wgsl`.

use bytemuck::{Pod, Zeroable};
use dapple::codec::{Decoder, TrackState};
use dapple::probes::client::ProbesVolume;
use dapple::probes::sample::{Field, IncomingLight};
use dapple::probes::{sample, visibility};
use dapple::render::gpu::Gpu;
use dapple::render::probes::device::{Tables, Volume};
use dapple_conformance::clauses;
use dapple_conformance::models::POSITION_UNIT;
use dapple_conformance::models::Query;
use dapple_conformance::models::Samplers;
use dapple_conformance::models::probes::oracle;
use dapple_conformance::models::probes::queries::Interpolation;
use dapple_conformance::models::probes::queries::ProbesQuery;
use dapple_conformance::models::probes::queries::Surface;
use dapple_conformance::protocol::{Arguments, Mode, Program as _};
use dapple_conformance::reference;
use dapple_conformance::reference::Reference;
use dapple_conformance::vector::{self, Kind, Vector};
use glam::{DVec3, Vec3};

pub(crate) fn vectors() -> Vec<Vector> {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|vector| vector.kind == Kind::Queries && vector.area == "probes");
    assert!(vectors.len() >= 40, "{} vectors", vectors.len());
    vectors
}

/// What a stream leaves: ids and volumes.
pub(crate) fn decoded(vector: &Vector) -> Vec<(u32, ProbesVolume<'static>)> {
    let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
    let volume = |live: &TrackState| {
        let volume = ProbesVolume::new(&decoder, live).expect("a track of probes");
        (live.track.id, volume.into_owned())
    };
    decoder.tracks().iter().map(volume).collect()
}

/// The queries of a track, each with its number.
pub(crate) fn queries(vector: &Vector, track: u32) -> Vec<(usize, &ProbesQuery)> {
    let queries = vector.info.queries.iter().enumerate();
    let queries = queries.map(|(number, query)| match query {
        Query::Probes(query) => (number, query),
        _ => panic!("{}: not of probes", vector.path()),
    });
    queries.filter(|(_, query)| query.track == track).collect()
}

pub(crate) fn place(query: &ProbesQuery) -> Surface {
    let unit = |v: [i32; 3]| DVec3::from(v.map(f64::from)).normalize().as_vec3();
    Surface {
        position: query.position.map(|v| v as f32 * POSITION_UNIT),
        normal: unit(query.normal).to_array(),
        view: unit(query.view).to_array(),
        roughness: query.roughness as f32 / 65536.0,
        interpolation: query.interpolation,
    }
}

/// What the sampler on the CPU finds.
fn incoming_light(field: &Field, surface: &Surface) -> IncomingLight {
    let [x, n, v] = [surface.position, surface.normal, surface.view].map(Vec3::from);
    let light = match surface.interpolation {
        Interpolation::Trilinear => sample::trilinear(field, x),
        Interpolation::VisibilityWeighted => sample::visibility_weighted(field, x, n, v),
    };
    sample::incoming_light(&light, n, v, surface.roughness)
}

/// The same of a track, for the protocol.
fn light(decoder: &Decoder, live: &TrackState, surface: &Surface) -> [[f32; 3]; 2] {
    let volume = ProbesVolume::new(decoder, live).expect("a track of probes");
    let light = incoming_light(&volume.field(), surface);
    [light.irradiance.to_array(), light.filtered.to_array()]
}

/// Irradiance and filtered radiance of a query must lie in its intervals.
pub(crate) fn check(vector: &Vector, number: usize, irradiance: Vec3, filtered: Vec3) {
    let answer = [irradiance, filtered].map(|v| v.to_array().map(f64::from));
    let query = &vector.info.queries[number];
    let path = vector.path();
    assert!(
        query.accepts(answer.as_flattened()),
        "{path}: {answer:?} for {query:?}: {:?}",
        query.intervals()
    );
}

#[test]
fn on_the_cpu() {
    for vector in vectors() {
        let mut asked = 0;
        for (id, volume) in decoded(&vector) {
            let field = volume.field();
            for (number, query) in queries(&vector, id) {
                let light = incoming_light(&field, &place(query));
                check(&vector, number, light.irradiance, light.filtered);
                asked += 1;
            }
        }
        assert_eq!(asked, vector.info.queries.len());
    }
}

/// 48 bytes, as in `ask.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Question {
    pub(crate) position: [f32; 3],
    pub(crate) roughness: f32,
    pub(crate) normal: [f32; 3],
    pub(crate) visibility_weighted: u32,
    pub(crate) view: [f32; 3],
    pad: u32,
}

impl Question {
    pub(crate) fn of(query: &ProbesQuery) -> Question {
        let surface = place(query);
        Question {
            position: surface.position,
            roughness: surface.roughness,
            normal: surface.normal,
            visibility_weighted: u32::from(
                surface.interpolation == Interpolation::VisibilityWeighted,
            ),
            view: surface.view,
            pad: 0,
        }
    }
}

/// The answers of the shader to questions in a volume.
fn ask(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    tables: &Tables,
    volume: &ProbesVolume,
    questions: &[Question],
) -> Vec<[Vec3; 2]> {
    let on_device = Volume::new(gpu, volume).expect("the volume fits");
    let questions_ = gpu.storage("questions", bytemuck::cast_slice(questions));
    let questions_ = questions_.expect("the questions fit");
    let size = 32 * questions.len() as u64;
    let answers = gpu.empty_storage("answers", size).expect("they fit");
    let staging = gpu.staging(size);
    let asked = gpu.bind(&pipeline.get_bind_group_layout(0), &[&questions_, &answers]);
    let sampler = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(1),
        // No question needs the environment BRDF, which is binding 4.
        entries: &on_device
            .entries(tables)
            .into_iter()
            .filter(|entry| entry.binding != 4)
            .collect::<Vec<_>>(),
    });
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &asked, &[]);
        pass.set_bind_group(1, &sampler, &[]);
        pass.dispatch_workgroups(questions.len().div_ceil(64) as u32, 1, 1);
    }
    commands.copy_buffer_to_buffer(&answers, 0, &staging, 0, size);
    let answer = |bytes: &[u8]| {
        let vectors: [[f32; 4]; 2] = bytemuck::pod_read_unaligned(bytes);
        vectors.map(|[x, y, z, _]| Vec3::new(x, y, z))
    };
    let answers = gpu.read(commands, &staging, |bytes| {
        bytes.chunks_exact(32).map(answer).collect()
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
        include_str!("../embed/shaders/wgsl/probes.wgsl"),
        include_str!("../embed/shaders/wgsl/probes_buffers.wgsl"),
        include_str!("probes_queries/ask.wgsl")
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
    let tables = Tables::new(&gpu).expect("the tables fit");
    for vector in vectors() {
        let mut asked = 0;
        for (id, volume) in decoded(&vector) {
            let queries = queries(&vector, id);
            let questions: Vec<_> = queries.iter().map(|(_, q)| Question::of(q)).collect();
            let answers = ask(&gpu, &pipeline, &tables, &volume, &questions);
            for ((number, _), [irradiance, filtered]) in queries.iter().zip(answers) {
                check(&vector, *number, irradiance, filtered);
                asked += 1;
            }
        }
        assert_eq!(asked, vector.info.queries.len());
    }
}

/// The questions at the end of `spec/examples-probes.md`, as the protocol asks them.
#[test]
fn the_worked_questions_are_answered_as_the_text_says() {
    let text = std::fs::read_to_string(clauses::folder().join("examples-probes.md"));
    let text = text.expect("the chapter");
    let block = |kind: &str| {
        let mut lines = Vec::new();
        let mut rest = text.lines();
        while let Some(line) = rest.next() {
            if line == format!("```{kind}") {
                lines.extend(rest.by_ref().take_while(|line| *line != "```"));
            }
        }
        lines
    };
    let mut bytes = Vec::new();
    for line in block("hex") {
        let words = line.split(';').next().unwrap_or_default();
        let words = words.split_ascii_whitespace();
        bytes.extend(words.map(|word| u8::from_str_radix(word, 16).expect("a byte")));
    }
    let mut own = Reference {
        samplers: Samplers {
            probes: Some(light),
            ..Samplers::default()
        },
    };
    let arguments = Arguments {
        mode: Mode::Queries,
        ..Arguments::default()
    };
    let lines = block("queries");
    assert!(lines.len() >= 4);
    for line in lines {
        let (question, stated) = line.split_once(" ; ").expect("a question and an answer");
        let mut input = (bytes.len() as u32).to_le_bytes().to_vec();
        input.extend(&bytes);
        input.extend(question.bytes());
        let answer = own.request(&arguments, &input).expect("an answer").output;
        let answer = String::from_utf8(answer).expect("text");
        let numbers = |text: &str| -> Vec<f64> {
            let words = text.split_whitespace();
            words.map(|word| word.parse().expect("a number")).collect()
        };
        let (found, stated) = (numbers(&answer), numbers(stated));
        assert_eq!(found.len(), stated.len());
        for (f, s) in found.iter().zip(&stated) {
            assert!((f - s).abs() < 1e-4 * (1.0 + s.abs()), "{line}: {answer}");
        }
    }
}

/// Specification, oracle and client have the same numbers.
#[test]
fn the_constants_are_those_of_the_specification() {
    let own = [
        ("WRAP", sample::WRAP),
        ("NORMAL_BIAS", sample::NORMAL_BIAS),
        ("VIEW_BIAS", sample::VIEW_BIAS),
        ("CRUSH", visibility::CRUSH),
        ("UNSEEN", sample::UNSEEN),
        ("ABSENT", sample::ABSENT),
    ];
    for ((name, value), (other, stated)) in own.iter().zip(oracle::CONSTANTS) {
        assert_eq!((*name, *value), (other, stated as f32));
    }
}
