//! The samplers in GLSL 300 es, whose arrays come as textures, in a browser's WebGL 2: all query vectors.

use bytemuck::{bytes_of, cast_slice};
use dapple::codec::Decoder;
use dapple::probes::ggx::{ENVIRONMENT, LOBE};
use dapple_conformance::vector::Vector;
use serde_json::{Value, json};

use super::folder;
use crate::browser;

/// An array as a texture.
pub struct Texture {
    pub name: &'static str,
    pub format: &'static str,
    /// Two or three dimensions in texels.
    pub size: Vec<u32>,
    pub bytes: Vec<u8>,
}

/// Texels of a row of arrays that have any width: even, a multiple of 6, and less than most arrays need.
const WIDTH: usize = 12;

impl Texture {
    /// Texels row by row, [`WIDTH`] a row.
    pub fn rows(name: &'static str, format: &'static str, texel: usize, bytes: &[u8]) -> Texture {
        let rows = bytes.len().div_ceil(WIDTH * texel).max(1);
        let mut bytes = bytes.to_vec();
        bytes.resize(rows * WIDTH * texel, 0);
        Texture {
            name,
            format,
            size: vec![WIDTH as u32, rows as u32],
            bytes,
        }
    }

    /// Questions: one a column, four numbers a row.
    fn questions<const N: usize>(questions: &[[[f32; 4]; N]]) -> Texture {
        let row = |row: usize| questions.iter().map(move |question| question[row]);
        let texels: Vec<[f32; 4]> = (0..N).flat_map(row).collect();
        Texture {
            name: "questions",
            format: "rgba32float",
            size: vec![questions.len() as u32, N as u32],
            bytes: cast_slice(&texels).to_vec(),
        }
    }
}

/// A drawing whose pixels are the answers to a list of questions.
pub struct Job {
    pub name: String,
    pub fragment: String,
    pub textures: Vec<Texture>,
    /// The uniform block `Parameters`.
    pub parameters: Vec<u8>,
    /// Questions, and vectors of an answer.
    pub size: [usize; 2],
}

impl Job {
    fn json(&self) -> Value {
        let texture = |t: &Texture| json!({ "name": t.name, "format": t.format, "size": t.size, "bytes": t.bytes });
        json!({
            "name": self.name,
            "fragment": self.fragment,
            "textures": self.textures.iter().map(texture).collect::<Vec<_>>(),
            "parameters": self.parameters,
            "width": self.size[0],
            "height": self.size[1],
        })
    }
}

/// A fragment shader of a model's generated file and a `main`.
fn fragment(model: &str, main: &str) -> String {
    let path = folder().join(format!("glsl300es/{model}_textures.glsl"));
    let sampler = std::fs::read_to_string(path).expect("a generated file");
    format!(
        "#version 300 es\nprecision highp float;\nprecision highp int;\n{sampler}\n\
         uniform highp sampler2D questions;\nout vec4 answer;\n\
         vec4 question(int row) {{ return texelFetch(questions, ivec2(int(gl_FragCoord.x), row), 0); }}\n\
         {main}"
    )
}

/// The pixels of each job, row by row. `None` without a browser.
pub fn draw(jobs: &[Job]) -> Option<Vec<Vec<[f32; 4]>>> {
    let input: Vec<Value> = jobs.iter().map(Job::json).collect();
    let result = browser::result_of(include_str!("webgl.html"), &input.into())?;
    let Some(answers) = result["answers"].as_array() else {
        panic!("{result}");
    };
    assert_eq!(answers.len(), jobs.len());
    let pixels = |(job, answer): (&Job, &Value)| {
        let numbers: Vec<f32> = answer
            .as_array()
            .expect("pixels")
            .iter()
            .map(|n| n.as_f64().map_or(f32::NAN, |n| n as f32))
            .collect();
        let (pixels, _) = numbers.as_chunks::<4>();
        assert_eq!(pixels.len(), job.size[0] * job.size[1], "{}", job.name);
        pixels.to_vec()
    };
    Some(jobs.iter().zip(answers).map(pixels).collect())
}

mod points {
    use super::*;
    use crate::queries::{check, decoded, place, queries, vectors};

    const MAIN: &str = "void main() {
        vec4 position = question(0);
        answer = vec4(dapple_points_ao(uint(position.w), position.xyz, question(1).xyz, 0u));
    }";

    /// A mirror, a turn and a shift, all of them exact: grid space has (2 - y, z - 4, x + 8).
    const GRID_FROM_MESH: [[f32; 4]; 3] = [
        [0.0, -1.0, 0.0, 2.0],
        [0.0, 0.0, 1.0, -4.0],
        [1.0, 0.0, 0.0, 8.0],
    ];

    fn job(vector: &Vector) -> Job {
        let decoded = decoded(vector);
        let mut tracks: Vec<u32> = Vec::new();
        for track in &decoded.tracks {
            let (grid, w) = (&track.grid, track.grid.widths);
            tracks.extend([track.first_bucket, track.first_cell]);
            tracks.extend([grid.bucket_count, grid.cell_capacity]);
            tracks.extend(grid.dims.map(u32::from));
            tracks.push(u32::from(w.position) | u32::from(w.normal) << 8 | u32::from(w.ao) << 16);
            tracks.extend([grid.cell_edge.to_bits(), grid.radius.to_bits(), 0, 0]);
            tracks.extend(GRID_FROM_MESH.as_flattened().iter().map(|v| v.to_bits()));
        }
        let question = |query| {
            let (x, n) = place(query);
            let track = decoded.track(query) as f32;
            [
                [x.z - 8.0, 2.0 - x.x, x.y + 4.0, track],
                [n.z, -n.x, n.y, 0.0],
            ]
        };
        let questions: Vec<_> = queries(vector).map(question).collect();
        let state = decoded.decoder.points();
        let words = |name, bytes: &[u8]| Texture::rows(name, "rgba32uint", 16, bytes);
        Job {
            name: vector.path(),
            fragment: fragment("points", MAIN),
            size: [questions.len(), 1],
            textures: vec![
                Texture::questions(&questions),
                words("dapple_points_tracks", cast_slice(&tracks)),
                words("dapple_points_buckets", cast_slice(state.buckets())),
                words("dapple_points_cells", cast_slice(state.cells())),
            ],
            parameters: Vec::new(),
        }
    }

    #[test]
    fn points_answer_the_vectors() {
        let vectors = vectors();
        let jobs: Vec<Job> = vectors.iter().map(job).collect();
        for (vector, pixels) in vectors.iter().zip(draw(&jobs).unwrap_or_default()) {
            let results: Vec<f32> = pixels.iter().map(|p| p[0]).collect();
            check(vector, &results);
        }
    }
}

mod probes {
    use super::*;
    use crate::probes_queries::{Question, check, decoded, queries, vectors};
    use dapple::probes::client::ProbesVolume;
    use dapple::render::probes::device::GpuVolume;
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

    /// The arrays of a volume.
    fn textures(volume: &ProbesVolume) -> Vec<Texture> {
        let present: Vec<u8> = volume.present.iter().map(|p| u8::from(*p)).collect();
        let blocks = volume
            .visibility()
            .map_or(&[][..], |v| v.texels.as_flattened());
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
        let planes = names.into_iter().zip(planes).map(|(name, texels)| Texture {
            name,
            format: "rgba16float",
            size: volume.lattice.dims.map(u32::from).to_vec(),
            bytes: cast_slice(texels).to_vec(),
        });
        let table = |name, format, size: [u32; 2], bytes: &[u8]| Texture {
            name,
            format,
            size: size.to_vec(),
            bytes: bytes.to_vec(),
        };
        let arrays = [
            Texture::rows("dapple_probes_presence", "r8uint", 1, &present),
            Texture::rows("dapple_probes_blocks", "rg8uint", 2, blocks),
            table(
                "dapple_probes_lobes",
                "rgba32float",
                [64, 1],
                cast_slice(&LOBE),
            ),
            table(
                "dapple_probes_environments",
                "rg32float",
                [32, 32],
                cast_slice(&ENVIRONMENT),
            ),
        ];
        planes.chain(arrays).collect()
    }

    #[test]
    fn probes_answer_the_vectors() {
        let vectors = vectors();
        let (mut jobs, mut asked) = (Vec::new(), Vec::new());
        for vector in &vectors {
            for (id, volume) in decoded(vector) {
                let queries = queries(vector, id);
                let question = |query| {
                    let q = Question::of(query);
                    let ([x, y, z], n, v) = (q.position, q.normal, q.view);
                    [
                        [x, y, z, q.roughness],
                        [n[0], n[1], n[2], q.visibility_weighted as f32],
                        [v[0], v[1], v[2], 0.0],
                    ]
                };
                let questions: Vec<_> = queries.iter().map(|(_, query)| question(query)).collect();
                let mut textures = textures(&volume);
                textures.push(Texture::questions(&questions));
                jobs.push(Job {
                    name: vector.path(),
                    fragment: fragment("probes", MAIN),
                    size: [questions.len(), 2],
                    textures,
                    parameters: bytes_of(&GpuVolume::of(&volume)).to_vec(),
                });
                asked.push((
                    vector,
                    queries
                        .iter()
                        .map(|(number, _)| *number)
                        .collect::<Vec<_>>(),
                ));
            }
        }
        for ((vector, numbers), pixels) in asked.iter().zip(draw(&jobs).unwrap_or_default()) {
            let (irradiance, filtered) = pixels.split_at(numbers.len());
            for ((number, irradiance), filtered) in numbers.iter().zip(irradiance).zip(filtered) {
                let [irradiance, filtered] =
                    [irradiance, filtered].map(|p| Vec3::new(p[0], p[1], p[2]));
                check(vector, *number, irradiance, filtered);
            }
        }
    }
}

mod instances {
    use super::*;
    use crate::instances_queries::{DeviceTable, Question, check, queries, track, vectors};
    use dapple_conformance::reference;

    const MAIN: &str = "layout(std140) uniform Parameters { DappleInstancesTable table; };
    void main() {
        vec4 x = question(0);
        vec4 other = question(1);
        uint entry = other.y < 0.0 ? DAPPLE_INSTANCES_NO_ENTRY : uint(other.y);
        answer = vec4(dapple_instances_ao(table, entry, x.xyz, other.x));
    }";

    fn job(vector: &Vector, decoder: &Decoder) -> Job {
        let (live, table) = track(decoder);
        let question = |query| {
            let q = Question::of(decoder, query);
            let entry = if q.entry == u32::MAX {
                -1.0
            } else {
                q.entry as f32
            };
            let [x, y, z] = q.position;
            [[x, y, z, 0.0], [q.local, entry, 0.0, 0.0]]
        };
        let questions: Vec<_> = queries(vector).into_iter().map(question).collect();
        let values = cast_slice(decoder.instances().values_of(live));
        Job {
            name: vector.path(),
            fragment: fragment("instances", MAIN),
            size: [questions.len(), 1],
            textures: vec![
                Texture::questions(&questions),
                Texture::rows("dapple_instances_values", "rg32uint", 8, values),
            ],
            parameters: bytes_of(&DeviceTable::of(live, table)).to_vec(),
        }
    }

    #[test]
    fn instances_answer_the_vectors() {
        let vectors = vectors();
        let decode = |vector: &Vector| reference::decoded(&vector.bytes).expect("a valid stream");
        let jobs: Vec<Job> = vectors.iter().map(|v| job(v, &decode(v))).collect();
        for (vector, pixels) in vectors.iter().zip(draw(&jobs).unwrap_or_default()) {
            for (number, pixel) in pixels.iter().enumerate() {
                check(vector, number, pixel[0]);
            }
        }
    }
}
