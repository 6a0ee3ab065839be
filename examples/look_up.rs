//! Looks up ambient occlusion and irradiance at one place, as a client does for each fragment:
//!
//! ```sh
//! dapple encode hall --model points,probes --frames 1 -o hall.dapple
//! cargo run --no-default-features --example look_up -- hall.dapple NODE 0,0,0 0,1,0
//! ```
//!
//! NODE is the path of a node as `dapple inspect` lists it; position and normal are in its mesh space,
//! which for this example is taken to be world space for the probes. Needs no feature but the client's.

use std::error::Error;

use dapple::points::sample::{Fallback, GridTransform, sample};
use dapple::probes::client::ProbesVolume;
use dapple::probes::sample::{incoming_light, visibility_weighted};
use dapple_codec::{Event, Limits, LookupSpace, Model, decode_all};
use glam::Vec3;

fn vector(text: &str) -> Result<Vec3, Box<dyn Error>> {
    let parts: Vec<f32> = text.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let parts: [f32; 3] = parts.try_into().map_err(|_| "expected X,Y,Z")?;
    Ok(parts.into())
}

fn look_up() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [stream, node, position, normal] = &arguments[..] else {
        return Err("usage: look_up STREAM NODE X,Y,Z NX,NY,NZ".into());
    };
    let (x, n) = (vector(position)?, vector(normal)?.normalize());
    let mut found_track = false;
    decode_all(
        &std::fs::read(stream)?,
        Limits::default(),
        |decoder, event| {
            let Event::Frame(frame) = event else { return };
            let points = decoder.points();
            for state in decoder.tracks() {
                let track = &state.track;
                match &track.model {
                    Model::Points(_) if track.target.path == *node => {
                        // A fragment of a mesh looks up the track of its node. A skinned mesh in rest space
                        // passes its rest position and rest normal.
                        let space = match track.space {
                            LookupSpace::Mesh => "as posed",
                            LookupSpace::Rest => "in its rest pose",
                        };
                        let Some(place) = points.place_of(state) else {
                            continue;
                        };
                        found_track = true;
                        let transform = GridTransform::new(&place.grid);
                        let found = sample(
                            &place.grid,
                            points.buckets_of(state),
                            points.cells_of(state),
                            transform.position(x),
                            transform.normal(n),
                            Fallback::Fill,
                        );
                        println!("frame {}: AO {:.3}, mesh {space}", frame.number, found.ao);
                    }
                    Model::Probes(_) => {
                        found_track = true;
                        let Some(volume) = ProbesVolume::new(decoder, state) else {
                            continue;
                        };
                        let at = volume.grid_from_world.transform_point3(x);
                        let radiance = visibility_weighted(&volume.field(), at, n, n);
                        let light = incoming_light(&radiance, n, n, 1.0);
                        println!("frame {}: irradiance {:.3}", frame.number, light.irradiance);
                    }
                    Model::Points(_)
                    | Model::Vertices(_)
                    | Model::Instances(_)
                    | Model::Regions(_) => {}
                }
            }
        },
    )?;
    match found_track {
        true => Ok(()),
        false => Err(format!("{stream} has no track of node {node}").into()),
    }
}

fn main() -> std::process::ExitCode {
    match look_up() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("look_up: {error}");
            std::process::ExitCode::FAILURE
        }
    }
}
