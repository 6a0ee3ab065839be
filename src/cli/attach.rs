//! `dapple attach`: a stream in a copy of the glTF file of its scene.

use super::gltf_output::GltfOutput;
use super::inputs::{self, is_dash};
use super::limits::LimitArgs;
use super::{output, stream};
use crate::client::Client;
use crate::codec::Limits;
use crate::gltf_writer::stream::{Attached, TracksOfNodes, attach};
use crate::measure::table::grouped;
use crate::scene::{GltfFile, LoadOptions, Scene};
use crate::{Error, Result, files};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Put a stream into a copy of its scene: one glTF file for both, in the extension `DAPPLE_stream`.
///
/// Commands that take a stream take such a file, too; `render` finds the stream in its scene.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scene that the stream was made for: a glTF file, `-` for one on standard input.
    scene: PathBuf,
    /// The stream; `-` for standard input.
    stream: PathBuf,
    /// The copy: a .glb, or a .gltf with a .bin of the same name beside it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Runs the command.
///
/// # Errors
/// `Scene`, `Io`, `Codec` for unusable files, `Invalid` for a stream of another scene and for one that
/// has no end, `Usage` for outputs that cannot be taken.
pub fn run(args: &Args) -> Result<ExitCode> {
    if is_dash(&args.scene) && is_dash(&args.stream) {
        let text = "standard input (-) is named for two inputs";
        return Err(Error::Usage(text.into()));
    }
    if args.scene == Path::new("hall") {
        let text = "the built-in scene is no glTF file; name one";
        return Err(Error::Usage(text.into()));
    }
    let (bytes, folder) = match is_dash(&args.scene) {
        true => (inputs::read_stdin()?, None),
        false => {
            inputs::protect_scene(&args.scene);
            let folder = args.scene.parent().unwrap_or(Path::new(""));
            (Scene::read_file(&args.scene)?, Some(folder))
        }
    };
    let name = stream::name(&args.scene);
    let options = LoadOptions {
        colors: false,
        ..LoadOptions::default()
    };
    let scene = Scene::from_bytes_with(&name, &bytes, folder, &options)?;
    files::protect(&args.stream);
    let (content, tracks) = read(&args.stream, &scene, args.limits.limits())?;
    let copy = GltfOutput::create(&args.output)?;

    let failed = |message| Error::Scene {
        name: name.clone(),
        message,
    };
    let file = GltfFile::open(&bytes, folder, &options).map_err(failed)?;
    let attached = Attached {
        stream: &content,
        tracks,
    };
    let document = attach(&file, &attached).map_err(failed)?;
    for text in &document.warnings {
        output::warn(&format!("{}: {text}", args.output.display()));
    }
    let size = copy.write(document)?;
    let nodes = attached.tracks.len() as u64;
    output::print_about(
        &args.output,
        &format!(
            "{} bytes, {} of them the stream; tracks at {}\n",
            grouped(size),
            grouped(content.len() as u64),
            output::counted(nodes, "node")
        ),
    )?;
    Ok(ExitCode::SUCCESS)
}

/// A whole stream, and the tracks of each node of the scene's file.
fn read(path: &Path, scene: &Scene, limits: Limits) -> Result<(Vec<u8>, TracksOfNodes)> {
    let named = |error| match error {
        Error::Codec(fault) => stream::error(path, &fault),
        Error::Invalid(message) => Error::Invalid(format!("{}: {message}", stream::name(path))),
        other => other,
    };
    let content = stream::Source::open(path)?.read_all()?;
    let mut client = Client::of_scene(scene, limits);
    let mut tracks = TracksOfNodes::new();
    let mut used = 0;
    loop {
        let next = client.last_frame().map_or(0, |(number, _)| number + 1);
        let (consumed, shown) = client.push_until(&content[used..], next).map_err(named)?;
        used += consumed;
        for live in client.decoder().tracks() {
            let instance = client.instance_of(&live.track);
            let place = instance.and_then(|i| scene.instances[i].file);
            if let Some(place) = place {
                let ids = tracks.entry(place.node).or_default();
                if !ids.contains(&live.track.id) {
                    ids.push(live.track.id);
                }
            }
        }
        if !shown {
            break;
        }
    }
    let end = client.decoder().finish();
    end.map_err(|fault| stream::error(path, &fault))?;
    Ok((content, tracks))
}
