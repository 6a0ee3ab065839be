//! The query vectors of `probes` in WebGL 2.

use super::*;
use crate::probes_queries::{Question, check, decoded, place as surface, queries, vectors};
use dapple::probes::client::ProbesVolume;
use dapple::probes::pack::Packed;
use dapple::probes::sample::{self, Field, IncomingLight};
use dapple::probes::sh::L2;
use dapple::render::probes::device::GpuVolume;
use dapple_conformance::models::probes::queries::{Interpolation, ProbesQuery};
use glam::Vec3;

const MAIN: &str = "layout(std140) uniform Parameters { DappleProbesVolume volume; };
void main() {
    vec4 x = question(0);
    vec4 n = question(1);
    vec3 v = question(2).xyz;
    vec3[9] radiance;
    if (n.w == 1.0) {
        radiance = dapple_probes_visibility_weighted(volume, x.xyz, n.xyz, v);
    } else {
        radiance = dapple_probes_trilinear(volume, x.xyz);
    }
    DappleProbesIncomingLight light = dapple_probes_incoming_light(radiance, n.xyz, v, x.w);
    answer = vec4(gl_FragCoord.y < 1.0 ? light.irradiance : light.filtered, 1.0);
}";

/// The arrays of a volume but its light.
fn arrays(volume: &ProbesVolume) -> Vec<Texture> {
    let present: Vec<u8> = volume.present.iter().map(|p| u8::from(*p)).collect();
    let visibility = volume.visibility();
    let blocks = visibility.map_or(&[][..], |v| v.texels.as_flattened());
    let table = |name, format, size: [u32; 2], bytes: &[u8]| Texture {
        name,
        format,
        size: size.to_vec(),
        bytes: bytes.to_vec(),
    };
    vec![
        Texture::rows("dapple_probes_presence", "r8uint", 1, &present),
        Texture::rows("dapple_probes_blocks", "rg8uint", 2, blocks),
        table(
            "dapple_probes_environments",
            "rg32float",
            [32, 32],
            cast_slice(&ENVIRONMENT),
        ),
    ]
}

fn plane(volume: &ProbesVolume, name: &'static str, format: &'static str, bytes: &[u8]) -> Texture {
    Texture {
        name,
        format,
        size: volume.lattice.dims.map(u32::from).to_vec(),
        bytes: bytes.to_vec(),
    }
}

/// The seven planes of f16.
fn planes(volume: &ProbesVolume) -> Vec<Texture> {
    let names = [
        "dapple_probes_plane_a",
        "dapple_probes_plane_b",
        "dapple_probes_plane_c",
        "dapple_probes_plane_d",
        "dapple_probes_plane_e",
        "dapple_probes_plane_f",
        "dapple_probes_plane_g",
    ];
    let planes = volume.texels.chunks_exact(volume.lattice.count());
    let planes = names.into_iter().zip(planes);
    let planes = planes.map(|(name, p)| plane(volume, name, "rgba16float", cast_slice(p)));
    planes.collect()
}

/// A texture a function.
fn packed_planes(volume: &ProbesVolume, packed: &Packed) -> Vec<Texture> {
    let names = [
        "dapple_probes_light_a",
        "dapple_probes_light_b",
        "dapple_probes_light_c",
        "dapple_probes_light_d",
        "dapple_probes_light_e",
        "dapple_probes_light_f",
        "dapple_probes_light_g",
        "dapple_probes_light_h",
        "dapple_probes_light_i",
    ];
    let planes = names.into_iter().zip(&packed.planes);
    let planes = planes.map(|(name, p)| plane(volume, name, "rgb9e5", cast_slice(p)));
    planes.collect()
}

/// The questions of a track of a vector, their numbers, and their drawing.
fn job(
    vector: &Vector,
    id: u32,
    volume: &ProbesVolume,
    accessor: &str,
    planes: Vec<Texture>,
) -> (Vec<usize>, Job) {
    let queries = queries(vector, id);
    let question = |(_, query): &(usize, &ProbesQuery)| {
        let q = Question::of(query);
        let ([x, y, z], n, v) = (q.position, q.normal, q.view);
        [
            [x, y, z, q.roughness],
            [n[0], n[1], n[2], q.visibility_weighted as f32],
            [v[0], v[1], v[2], 0.0],
        ]
    };
    let questions: Vec<_> = queries.iter().map(question).collect();
    let mut textures = arrays(volume);
    textures.extend(planes);
    textures.push(Texture::questions(&questions));
    let job = Job {
        name: vector.path(),
        fragment: fragment("probes", accessor, MAIN),
        size: [questions.len(), 2],
        textures,
        parameters: bytes_of(&GpuVolume::of(volume)).to_vec(),
    };
    (queries.iter().map(|(number, _)| *number).collect(), job)
}

/// Irradiance and filtered radiance of each question.
fn answers(pixels: &[[f32; 4]]) -> Vec<[Vec3; 2]> {
    let (irradiance, filtered) = pixels.split_at(pixels.len() / 2);
    let pairs = irradiance.iter().zip(filtered);
    pairs
        .map(|(a, b)| [a, b].map(|p| Vec3::new(p[0], p[1], p[2])))
        .collect()
}

#[test]
fn probes_answer_the_vectors() {
    let vectors = vectors();
    let (mut jobs, mut asked) = (Vec::new(), Vec::new());
    for vector in &vectors {
        for (id, volume) in decoded(vector) {
            let (numbers, job) = job(vector, id, &volume, "textures", planes(&volume));
            jobs.push(job);
            asked.push((vector, numbers));
        }
    }
    for ((vector, numbers), pixels) in asked.iter().zip(draw(&jobs).unwrap_or_default()) {
        for (number, [irradiance, filtered]) in numbers.iter().zip(answers(&pixels)) {
            check(vector, *number, irradiance, filtered);
        }
    }
}

/// The packed textures against their twin on the CPU. A texel that is fetched is exact; a texture unit may
/// be off by 1/256 of a probe along each axis, of at most 3.8 times degree 0.
#[test]
fn packed_probes_answer_as_their_twin() {
    let (mut jobs, mut expected) = (Vec::new(), Vec::new());
    for vector in &vectors() {
        for (id, volume) in decoded(vector) {
            let packed = Packed::new(volume.radiance(), volume.scale());
            let planes = packed_planes(&volume, &packed);
            jobs.push(job(vector, id, &volume, "packed", planes).1);
            expected.push(twins(vector, id, &volume, &packed));
        }
    }
    for (twins, pixels) in expected.iter().zip(draw(&jobs).unwrap_or_default()) {
        for ((twin, bound), [irradiance, filtered]) in twins.iter().zip(answers(&pixels)) {
            let irradiance = (irradiance - twin.irradiance).abs().max_element();
            let filtered = (filtered - twin.filtered).abs().max_element();
            assert!(irradiance <= *bound, "{irradiance} of {bound}");
            assert!(filtered <= *bound, "{filtered} of {bound}");
        }
    }
}

/// What the CPU finds in packed textures for each question, and how far a device may be from it.
fn twins(
    vector: &Vector,
    id: u32,
    volume: &ProbesVolume,
    packed: &Packed,
) -> Vec<(IncomingLight, f32)> {
    let (lattice, scale) = (volume.lattice, volume.scale());
    let count = lattice.count();
    let radiance: Vec<L2> = (0..count).map(|p| packed.expansion(p, scale)).collect();
    let field = Field {
        radiance: &radiance,
        ..volume.field()
    };
    let peaks = radiance.iter().map(|l2| l2[0].max_element());
    let peak = peaks.fold(0.0, f32::max);
    let twin = |(_, query): (usize, &ProbesQuery)| {
        let surface = surface(query);
        let [x, n, v] = [surface.position, surface.normal, surface.view].map(Vec3::from);
        let (light, tolerance) = match surface.interpolation {
            Interpolation::Trilinear => (packed.trilinear(&lattice, x, scale), 3.0 / 256.0 * 3.8),
            Interpolation::VisibilityWeighted => {
                (sample::visibility_weighted(&field, x, n, v), 1e-3)
            }
        };
        let light = sample::incoming_light(&light, n, v, surface.roughness);
        (light, tolerance * peak)
    };
    queries(vector, id).into_iter().map(twin).collect()
}
