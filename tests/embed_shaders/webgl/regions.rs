//! The query vectors of `regions` in WebGL 2.

use super::*;
use crate::regions_queries::hold;
use dapple::regions::sample::Regions;
use glam::Vec3;

const MAIN: &str = "layout(std140) uniform Parameters { DappleRegionsSet region_set; };
void main() {
    vec4 x = question(0);
    answer = vec4(dapple_regions_sample(region_set, uint(x.w), x.xyz, question(1).xyz));
}";

fn job(regions: &Regions, places: &[(Vec3, Vec3, usize)]) -> Job {
    let question = |(x, n, region): &(Vec3, Vec3, usize)| {
        // A number beyond any of the vectors' stands for none.
        let region = (*region).min(1 << 20) as f32;
        [[x.x, x.y, x.z, region], [n.x, n.y, n.z, 0.0]]
    };
    let questions: Vec<_> = places.iter().map(question).collect();
    let rows = Texture {
        name: "dapple_regions_regions",
        format: "rgba32uint",
        size: vec![3, regions.regions.len() as u32],
        bytes: cast_slice(regions.regions).to_vec(),
    };
    let pairs = cast_slice(regions.pairs);
    Job {
        name: "regions".into(),
        fragment: fragment("regions", "textures", MAIN),
        size: [questions.len(), 1],
        textures: vec![
            Texture::questions(&questions),
            rows,
            Texture::rows("dapple_regions_pairs", "r32uint", 4, pairs),
        ],
        parameters: cast_slice(&[regions.scale, regions.share, 0.0, 0.0]).to_vec(),
    }
}

#[test]
fn regions_answer_the_vectors() {
    let mut jobs = Vec::new();
    hold(|regions, places| {
        if !places.is_empty() && !regions.regions.is_empty() {
            jobs.push(job(regions, places));
        }
        let answer = |&(p, n, region): &(Vec3, Vec3, usize)| regions.sample(region, p, n);
        places.iter().map(answer).collect()
    });
    let Some(answers) = draw(&jobs) else { return };
    let mut answers = answers.into_iter();
    hold(|regions, places| {
        // A track without regions has no texture.
        if places.is_empty() || regions.regions.is_empty() {
            return vec![1.0; places.len()];
        }
        let pixels = answers.next().expect("a drawing for each track");
        pixels.iter().map(|p| p[0]).collect()
    });
}
