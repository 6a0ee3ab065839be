//! An unfinished picture as a file, so that hours of samples survive an interruption.
//!
//! Little-endian: magic `DAPPLEPT`, version, width, height, samples a half (u32 each), three
//! checksums that identify what the picture shows ([`PictureId`]), then 12 f64 a pixel (two halves, two parts,
//! RGB) and the CRC-32C of all before. A file is replaced as a whole or not at all.

use super::{Options, PathPicture, SampleSums};
use crate::codec::container::crc32c;
use crate::scene::{CameraPose, Scene};
use crate::trace::path::Sky;
use crate::{Error, Result, files};
use glam::DVec3;
use std::path::Path;

const MAGIC: &[u8; 8] = b"DAPPLEPT";
const VERSION: u32 = 1;
const HEADER: usize = 8 + 4 * 7;
const PIXEL: usize = 12 * 8;

/// Identifies what a picture shows: samples of different pictures must not be mixed. Checksums, so that a
/// mistake is found, not an attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureId {
    scene: u32,
    camera: u32,
    options: u32,
}

impl PictureId {
    /// `time` in seconds, `coats` as [`crate::trace::path::PathTracer::without_coats`] has it.
    pub fn new(
        scene: &Scene,
        time: f64,
        camera: &CameraPose,
        options: &Options,
        sky: &Sky,
        coats: bool,
    ) -> PictureId {
        let mut of_scene = scene.name.clone().into_bytes();
        for mesh in &scene.meshes {
            of_scene.extend_from_slice(bytemuck::cast_slice(&mesh.positions));
            of_scene.extend_from_slice(bytemuck::cast_slice(&mesh.triangles));
        }
        of_scene.extend(format!("{:?} {:?}", scene.instances, scene.materials).bytes());
        of_scene.extend(format!("{:?} {:?}", scene.nodes, scene.lights).bytes());
        let of_camera = format!("{time:?} {camera:?}");
        let of_options = format!("{options:?} {sky:?} {coats}");
        PictureId {
            scene: crc32c(&of_scene),
            camera: crc32c(of_camera.as_bytes()),
            options: crc32c(of_options.as_bytes()),
        }
    }
}

/// Writes the state of a picture.
///
/// # Errors
/// As [`files::write`].
pub fn save(path: &Path, picture: &PathPicture, id: &PictureId) -> Result<()> {
    let mut bytes = Vec::with_capacity(HEADER + picture.halves[0].direct.len() * PIXEL + 4);
    bytes.extend_from_slice(MAGIC);
    for number in [
        VERSION,
        picture.width,
        picture.height,
        picture.samples,
        id.scene,
        id.camera,
        id.options,
    ] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    for half in &picture.halves {
        for sum in half.direct.iter().chain(&half.indirect) {
            for value in sum.to_array() {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
        }
    }
    bytes.extend_from_slice(&crc32c(&bytes).to_le_bytes());
    files::write(path, &bytes)
}

/// Reads the state of a picture `id` of `width` x `height` pixels; an empty picture where
/// there is no such file.
///
/// # Errors
/// `Io` where the file cannot be read, `Invalid` where it is damaged, no such file, or of another
/// picture.
pub fn load(path: &Path, width: u32, height: u32, id: &PictureId) -> Result<PathPicture> {
    let mut picture = PathPicture::new(width, height);
    let bytes = match std::fs::read(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(picture),
        read => read.map_err(|source| Error::Io {
            path: path.into(),
            source,
        })?,
    };
    let refuse = |what: &str| Err(Error::Invalid(format!("{}: {what}", path.display())));
    if bytes.len() < HEADER + 4 || &bytes[..8] != MAGIC {
        return refuse("this is no state of a path-traced picture");
    }
    let (body, crc) = bytes.split_at(bytes.len() - 4);
    let number = |bytes: &[u8], at: usize| {
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    if number(crc, 0) != crc32c(body) {
        return refuse("the state of the picture is damaged; remove the file to begin anew");
    }
    let [version, w, h, samples, scene, camera, options]: [u32; 7] =
        std::array::from_fn(|i| number(body, 8 + 4 * i));
    if version != VERSION {
        return refuse("the state of the picture is of another version of this program");
    }
    if (w, h) != (width, height) {
        let what = format!("the state is of a picture of {w}x{h} pixels, not {width}x{height}");
        return refuse(&what);
    }
    let found = PictureId {
        scene,
        camera,
        options,
    };
    if found != *id {
        let other = if found.scene != id.scene {
            "of another scene"
        } else if found.camera != id.camera {
            "from another camera or time"
        } else {
            "with other options"
        };
        return refuse(&format!(
            "the state is of a picture {other}; name another file"
        ));
    }
    let pixels = width as usize * height as usize;
    if body.len() - HEADER != pixels * PIXEL {
        return refuse("the state of the picture has another length than its size asks for");
    }
    let mut values = body[HEADER..].chunks_exact(8).map(|b| {
        let bytes: [u8; 8] = std::array::from_fn(|i| b[i]);
        f64::from_le_bytes(bytes)
    });
    let mut sums = |count: usize| -> Vec<DVec3> {
        let mut next = || values.next().unwrap_or(0.0);
        (0..count)
            .map(|_| DVec3::new(next(), next(), next()))
            .collect()
    };
    for half in &mut picture.halves {
        *half = SampleSums {
            direct: sums(pixels),
            indirect: sums(pixels),
        };
    }
    picture.samples = samples;
    Ok(picture)
}
