//! The samplers in GLSL 300 es, whose arrays come as textures, in a browser's WebGL 2: all query vectors.

mod instances;
mod points;
mod probes;
mod regions;
mod vertices;

use bytemuck::{bytes_of, cast_slice};
use dapple::codec::Decoder;
use dapple::probes::ggx::ENVIRONMENT;
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
fn fragment(model: &str, accessor: &str, main: &str) -> String {
    let path = folder().join(format!("glsl300es/{model}_{accessor}.glsl"));
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
