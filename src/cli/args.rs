//! Arguments that several commands share, and the parsers that turn nonsense away.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use glam::{DVec3, Vec3};

use super::inputs;
use super::limits::LimitArgs;
use crate::codec::points::PointWidths;
use crate::codec::{Compression, TickRate};
use crate::models::Model;
use crate::points::sample::Fallback;
use crate::points::server::Space;
use crate::points::server::hidden::MIN_AO;
use crate::points::store::Overflow;
use crate::probes::server::InsideGeometry;
use crate::probes::source::Fit;
use crate::render::MAX_SIDE;
use crate::scene::{LoadOptions, Scene};
use crate::{Error, Result};

/// Which scene, seen from where, when, and how large.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Scene and view")]
pub struct SceneArgs {
    /// A glTF 2.0 file (.glb or .gltf), `-` for one on standard input, or `hall` for the built-in
    /// scene.
    #[arg(value_name = "SCENE", help_heading = "Arguments")]
    pub scene: PathBuf,
    /// The scene within the glTF file, by number or name; the file's default one if not given.
    #[arg(long = "scene", visible_alias = "gltf-scene", value_name = "N|NAME")]
    pub gltf_scene: Option<String>,
    #[command(flatten)]
    pub view: ViewArgs,
}

/// From where, when, and how large.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Scene and view")]
pub struct ViewArgs {
    /// A camera of the scene by name; the first one if not given, or one that frames the scene
    /// where it has none.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["eye", "target"])]
    pub camera: Option<String>,
    /// Look from here, in the file's metres, instead of a camera of the scene.
    #[arg(long, value_name = "X,Y,Z", requires = "target", value_parser = vector,
        allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// Look at this point.
    #[arg(long, value_name = "X,Y,Z", requires = "eye", value_parser = vector,
        allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// Width and height in pixels of pictures; for `encode`, their ratio decides what the camera sees.
    #[arg(long, value_name = "WxH", default_value = "480x270", value_parser = size)]
    pub size: (u32, u32),
    /// The animation that plays, by name or number; otherwise all that do not overlap.
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,
    /// Frame to show, or to start at, counted from 0 at the frame rate.
    #[arg(long, value_name = "K", conflicts_with = "time")]
    pub frame: Option<u32>,
    /// Time to show, or to start at, in seconds.
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub time: Option<f64>,
}

/// Headings in the help.
const MODELS: &str = "Models and quality";
const POINTS: &str = "Points (ambient occlusion)";
const STREAM: &str = "Stream";

/// The models and their servers.
#[derive(Clone, Debug, Args)]
pub struct EncodeArgs {
    /// What the stream carries: `points`, `probes`, or both as `points,probes`.
    #[arg(
        long,
        value_name = "MODEL,MODEL",
        value_delimiter = ',',
        default_value = "points",
        help_heading = MODELS
    )]
    pub model: Vec<Model>,
    /// Accuracy against time and bytes. Options that are given take precedence.
    #[arg(long, default_value = "standard", help_heading = MODELS)]
    pub quality: Quality,
    #[command(flatten)]
    pub probes: ProbesArgs,
    /// Candidate points per square metre, before thinning. If not given: 1024 in scenes of 4 to
    /// 40 m, more in smaller ones and on small objects, fewer in larger ones, times what --quality
    /// says.
    #[arg(long, value_name = "N", value_parser = density, help_heading = POINTS)]
    pub density: Option<f64>,
    /// Points generated for each one that is kept.
    #[arg(long, value_name = "RATIO", default_value = "2.0", value_parser = thinning, help_heading = POINTS)]
    pub thinning: f64,
    /// Rays traced for a point. If not given: 128 (64 for draft, 256 for fine quality).
    #[arg(long, value_name = "COUNT",
        value_parser = clap::value_parser!(u32).range(1..=65_536), help_heading = POINTS)]
    pub rays: Option<u32>,
    /// Length of an occlusion ray in metres. If not given: 0.6 in scenes of 4 to 40 m, in proportion
    /// in smaller and larger ones.
    #[arg(long, value_name = "M", value_parser = distance, help_heading = POINTS)]
    pub distance: Option<f32>,
    /// Smallest change of AO that is sent, in steps of 1/255; 0 sends every change. If not given: 4
    /// (8 for draft, 2 for fine quality).
    #[arg(long, value_name = "STEPS", help_heading = POINTS)]
    pub threshold: Option<u8>,
    /// Frames to encode; the length of the animation if not given.
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=1_000_000), help_heading = STREAM)]
    pub frames: Option<u32>,
    /// Server frames a second, also as a fraction: 30000/1001.
    #[arg(long, value_name = "RATE", default_value = "60", help_heading = STREAM)]
    pub fps: Rate,
    /// Seed of point placement and of the rays.
    #[arg(long, default_value = "0", help_heading = STREAM)]
    pub seed: u32,
    /// Bits of a packed point.
    #[arg(long, value_name = "BITS", default_value = "32", help_heading = POINTS)]
    pub width: Width,
    /// `zstd:LEVEL` (1 to 19) with the lazy strategy; `zstd:LEVEL:auto` with the
    /// level's own; `lz4`; or `none`.
    #[arg(long, value_name = "METHOD", default_value = "zstd:15", value_parser = compression, help_heading = STREAM)]
    pub compression: Compression,
    /// Frames from one keyframe to the next; only the first frame is one if not given.
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..), help_heading = STREAM)]
    pub keyframe_interval: Option<u32>,
    /// Update every point, not only those within the extended field of view.
    #[arg(long, help_heading = POINTS)]
    pub no_visibility: bool,
    /// Degrees by which the field of view is extended on each side.
    #[arg(long, value_name = "DEGREES", default_value = "10", value_parser = margin,
        conflicts_with = "no_visibility", help_heading = POINTS)]
    pub fov_margin: f32,
    /// Trace at most so many points a frame, in turn; for a renderer without a network.
    #[arg(long, value_name = "POINTS", value_parser = clap::value_parser!(u32).range(1..), help_heading = POINTS)]
    pub budget: Option<u32>,
    /// Space of a skinned mesh's points and grid.
    #[arg(long, default_value = "posed", help_heading = POINTS)]
    pub space: Space,
    /// Leave out points whose AO is below so many steps of 1/255 for as long as it is, and those that
    /// close surfaces hide; 0 keeps all, as in PSAO.
    #[arg(long, value_name = "STEPS", default_value_t = MIN_AO, help_heading = POINTS)]
    pub min_ao: u8,
    /// What to do with points beyond the seven of a grid cell.
    #[arg(long, default_value = "chain", help_heading = POINTS)]
    pub overflow: Overflow,
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// A volume of probes and its server.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Probes (indirect light)")]
pub struct ProbesArgs {
    /// Probes along x, y and z. If not given: 16x8x8 (32x16x16 for fine quality).
    #[arg(long, value_name = "XxYxZ", value_parser = probes)]
    pub probes: Option<[u16; 3]>,
    /// Smallest and largest corner of the box of probes, in metres; fitted to the scene if not given.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = volume, allow_hyphen_values = true)]
    pub volume: Option<(DVec3, DVec3)>,
    /// Paths traced for a probe in a frame. If not given: 256 (64 for draft quality).
    #[arg(long, value_name = "COUNT",
        value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub samples: Option<u32>,
    /// Share of the last frame's light that a frame keeps, 0.8 to 0.998.
    #[arg(long, value_name = "SHARE", default_value = "0.99", value_parser = hysteresis)]
    pub hysteresis: f32,
    /// Drop earlier frames' light where the light has changed by more than its noise.
    #[arg(long)]
    pub adaptive: bool,
    /// Frames that the server runs before the first one that is sent.
    #[arg(long, value_name = "FRAMES", default_value = "16",
        value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub warm_up: u32,
    /// Texels a side of each probe's map of distances, which keeps light from passing through walls;
    /// 0 for no map.
    #[arg(long, value_name = "TEXELS", default_value = "16", value_parser = visibility)]
    pub visibility_side: u32,
    /// What distances in those maps are rounded to, in 1/255 of their range: larger steps take fewer bytes.
    #[arg(long, value_name = "STEP", default_value = "1",
        value_parser = clap::value_parser!(u8).range(1..=64))]
    pub visibility_step: u8,
    /// Maps of distances that are measured again in a frame, of probes that something has moved near; 0
    /// where maps have what never moves alone.
    #[arg(long, value_name = "COUNT", default_value = "0")]
    pub visibility_updates: u32,
    /// Whether probes inside geometry are kept.
    #[arg(long, value_name = "WHAT", default_value = "disabled")]
    pub inside: InsideGeometry,
    /// Whether probes hold the light at their places, or values that make the look-up right on
    /// surfaces, for which half of the paths are traced.
    #[arg(long, value_name = "WHEN", default_value = "off")]
    pub fit: Fit,
    /// How probes are coded: 56 bytes each, or entropy-coded.
    #[arg(long, default_value = "packed")]
    pub coding: Coding,
    /// Error that packed irradiance may have, as a share of the brightest.
    #[arg(long, value_name = "SHARE", default_value = "0.004", value_parser = share)]
    pub tolerance: f32,
    /// Radiance of the sky, the same from everywhere.
    #[arg(long, value_name = "R,G,B", default_value = "0,0,0", value_parser = radiance)]
    pub sky: Vec3,
}

/// Accuracy against time and bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Quality {
    /// A quarter of the points, half of the rays: for a first look.
    Draft,
    Standard,
    /// Four times the points and twice the rays; eight times the probes.
    Fine,
}

impl Quality {
    /// Factor of the density of candidate points.
    pub fn density_factor(self) -> f32 {
        self.of(0.25, 1.0, 4.0)
    }

    /// Rays of a point.
    pub fn rays(self) -> u32 {
        self.of(64, 128, 256)
    }

    /// Smallest change of AO that is sent, in steps of 1/255.
    pub fn threshold(self) -> u8 {
        self.of(8, 4, 2)
    }

    /// Probes along each axis.
    pub fn probes(self) -> [u16; 3] {
        self.of([16, 8, 8], [16, 8, 8], [32, 16, 16])
    }

    /// Paths of a probe and frame.
    pub fn samples(self) -> u32 {
        self.of(64, 256, 256)
    }

    fn of<T>(self, draft: T, standard: T, fine: T) -> T {
        match self {
            Quality::Draft => draft,
            Quality::Standard => standard,
            Quality::Fine => fine,
        }
    }
}

/// A coding of the model `probes`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Coding {
    Raw,
    Packed,
}

/// The client.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Client")]
pub struct ClientArgs {
    /// Server frames a second that reach the client; all of the stream's if not given.
    #[arg(long, value_name = "RATE")]
    pub server_fps: Option<Rate>,
    /// Milliseconds from a server frame to its use.
    #[arg(long, value_name = "MS", default_value = "0", value_parser = latency)]
    pub latency_ms: f64,
    /// AO of a fragment with no point in reach.
    #[arg(long, default_value = "fill")]
    pub fallback: Fallback,
}

/// Bits of a packed point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Width {
    #[value(name = "32")]
    Bits32,
    #[value(name = "24")]
    Bits24,
    #[value(name = "16")]
    Bits16,
}

/// A rate in Hz as a fraction, both parts positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    pub numerator: u32,
    pub denominator: u32,
}

impl SceneArgs {
    /// Loads the scene, for ambient occlusion alone without `colors`; no output can replace its files
    /// from then on.
    ///
    /// # Errors
    /// As [`Scene::load_with`] and [`inputs::scene_from_stdin`], and `Usage` for a choice in the
    /// built-in scene, which has none.
    pub fn load(&self, colors: bool) -> Result<Scene> {
        let options = LoadOptions {
            colors,
            animation: self.view.animation.clone(),
            scene: self.gltf_scene.clone(),
        };
        if self.scene == Path::new("hall") {
            if options.animation.is_some() || options.scene.is_some() {
                let text = "the built-in scene has one scene and one animation to choose from";
                return Err(Error::Usage(text.into()));
            }
            return Ok(Scene::hall());
        }
        if inputs::is_dash(&self.scene) {
            return inputs::scene_from_stdin(&options);
        }
        let scene = Scene::load_with(&self.scene, &options)?;
        inputs::protect_scene(&self.scene);
        Ok(scene)
    }
}

impl ViewArgs {
    /// The time to show in seconds: `--time`, or `--frame` at `fps`, or 0.
    pub fn seconds(&self, fps: Rate) -> f64 {
        self.time_at(fps.hz()).unwrap_or(0.0)
    }

    /// The time that was asked for in seconds, with frames at a rate in Hz.
    pub fn time_at(&self, rate: f64) -> Option<f64> {
        self.time
            .or(self.frame.map(|frame| f64::from(frame) / rate))
    }

    /// `--eye` and `--target`.
    pub fn look(&self) -> Option<(DVec3, DVec3)> {
        self.eye.zip(self.target)
    }
}

impl Width {
    /// Bits of each part of a point.
    pub fn widths(self) -> PointWidths {
        match self {
            Width::Bits32 => PointWidths {
                position: 5,
                normal: 4,
                ao: 8,
            },
            Width::Bits24 => PointWidths {
                position: 4,
                normal: 3,
                ao: 5,
            },
            Width::Bits16 => PointWidths {
                position: 2,
                normal: 2,
                ao: 5,
            },
        }
    }
}

impl Rate {
    /// In Hz.
    pub fn hz(self) -> f64 {
        TickRate::from(self).hz()
    }
}

impl From<Rate> for TickRate {
    fn from(rate: Rate) -> TickRate {
        TickRate {
            numerator: rate.numerator,
            denominator: rate.denominator,
        }
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.denominator {
            1 => write!(f, "{}", self.numerator),
            d => write!(f, "{}/{d}", self.numerator),
        }
    }
}

impl std::str::FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Rate, String> {
        let wrong = || {
            "a rate is a whole number of Hz or a fraction, such as 60 or 30000/1001, from 1/60 to \
             1000 Hz"
                .to_string()
        };
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        let part = |text: &str| {
            text.parse::<u32>()
                .ok()
                .filter(|n| *n > 0)
                .ok_or_else(wrong)
        };
        let rate = Rate {
            numerator: part(numerator)?,
            denominator: part(denominator)?,
        };
        let usable = (1.0 / 60.0..=1000.0).contains(&rate.hz());
        if usable { Ok(rate) } else { Err(wrong()) }
    }
}

type Parsed<T> = std::result::Result<T, String>;

/// A finite number within a range, or a sentence that says what is wanted.
fn number(text: &str, range: impl std::ops::RangeBounds<f64>, wanted: &str) -> Parsed<f64> {
    let value = text
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|v| v.is_finite() && range.contains(v));
    value.ok_or_else(|| format!("expected {wanted}"))
}

pub fn compression(text: &str) -> Parsed<Compression> {
    let zstd = |text: &str| {
        let (level, lazy) = match text.strip_suffix(":auto") {
            Some(level) => (level, false),
            None => (text, true),
        };
        let level = level
            .parse::<i32>()
            .ok()
            .filter(|level| (1..=19).contains(level))?;
        Some(Compression::Zstd { level, lazy })
    };
    let parsed = match text {
        "none" => Some(Compression::None),
        "lz4" => Some(Compression::Lz4),
        "zstd" => zstd("15"),
        _ => text.strip_prefix("zstd:").and_then(zstd),
    };
    parsed.ok_or_else(|| {
        "expected none, lz4, or zstd:1 to zstd:19, with :auto for the level's own strategy"
            .to_string()
    })
}

/// Points per square metre.
pub fn density(text: &str) -> Parsed<f64> {
    number(
        text,
        1e-12..=1e12,
        "points per square metre from 1e-12 to 1e12",
    )
}

fn thinning(text: &str) -> Parsed<f64> {
    number(text, 1.0..=100.0, "a ratio from 1 (keep all) to 100")
}

pub fn distance(text: &str) -> Parsed<f32> {
    number(text, 1e-7..=1e7, "metres from 0.0000001 to 10000000").map(|v| v as f32)
}

fn margin(text: &str) -> Parsed<f32> {
    number(text, 0.0..=90.0, "degrees from 0 to 90").map(|v| v as f32)
}

pub fn latency(text: &str) -> Parsed<f64> {
    number(text, 0.0..=60_000.0, "milliseconds from 0 to 60000")
}

fn seconds(text: &str) -> Parsed<f64> {
    number(text, 0.0..=1e6, "seconds from 0 to 1000000")
}

/// Largest coordinate that is taken, in metres.
const FARTHEST: f64 = 1e12;

fn vector(text: &str) -> Parsed<DVec3> {
    let wanted = "three numbers in metres, such as 1,1.7,-4.5";
    Ok(numbers(text, FARTHEST, wanted)?.into())
}

fn numbers<const N: usize>(text: &str, most: f64, wanted: &str) -> Parsed<[f64; N]> {
    let parts: Vec<f64> = text
        .split(',')
        .map(|part| number(part, -most..=most, wanted))
        .collect::<Parsed<_>>()?;
    parts.try_into().map_err(|_| format!("expected {wanted}"))
}

fn volume(text: &str) -> Parsed<(DVec3, DVec3)> {
    let wanted = "six numbers in metres, the smallest corner first";
    let [a, b, c, d, e, f] = numbers(text, FARTHEST, wanted)?;
    let (min, max) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
    if min.cmple(max).all() {
        Ok((min, max))
    } else {
        Err(format!("expected {wanted}"))
    }
}

fn radiance(text: &str) -> Parsed<Vec3> {
    let wanted = "three numbers from 0 to a million, such as 0.5,0.6,0.8";
    let rgb: [f64; 3] = numbers(text, 1e6, wanted)?;
    match rgb.iter().all(|c| *c >= 0.0) {
        true => Ok(Vec3::from(rgb.map(|c| c as f32))),
        false => Err(format!("expected {wanted}")),
    }
}

fn probes(text: &str) -> Parsed<[u16; 3]> {
    let parts: Option<Vec<u16>> = text.split('x').map(|part| part.parse().ok()).collect();
    parts
        .and_then(|parts| <[u16; 3]>::try_from(parts).ok())
        .filter(|dims| {
            let count: u64 = dims.iter().map(|&d| u64::from(d)).product();
            (1..=1 << 20).contains(&count)
        })
        .ok_or_else(|| "expected three counts, such as 16x8x8, of a million probes at most".into())
}

pub fn exposure(text: &str) -> std::result::Result<f32, String> {
    let value = text.trim().parse().ok();
    value
        .filter(|v| (1e-6..=1e6).contains(v))
        .ok_or_else(|| "expected a factor from 0.000001 to 1000000".into())
}

fn hysteresis(text: &str) -> Parsed<f32> {
    Ok(number(text, 0.8..=0.998, "a share from 0.8 to 0.998")? as f32)
}

pub fn share(text: &str) -> Parsed<f32> {
    Ok(number(text, 0.0..=1.0, "a share from 0 to 1")? as f32)
}

/// A weight of at least 0.
pub fn weight(text: &str) -> Parsed<f64> {
    number(text, 0.0..=1e6, "a weight from 0 to 1000000")
}

fn visibility(text: &str) -> Parsed<u32> {
    match text {
        "0" | "4" | "8" | "16" => Ok(text.parse().unwrap_or(0)),
        _ => Err("expected 0, 4, 8 or 16".into()),
    }
}

fn size(text: &str) -> Parsed<(u32, u32)> {
    let side = |text: &str| {
        text.parse::<u32>()
            .ok()
            .filter(|s| (1..=MAX_SIDE).contains(s))
    };
    text.split_once('x')
        .and_then(|(width, height)| side(width).zip(side(height)))
        // With four samples a pixel, this many take about 4 GB.
        .filter(|(width, height)| width * height <= 1 << 24)
        .ok_or_else(|| {
            format!(
                "expected WIDTHxHEIGHT in pixels, such as 480x270, sides from 1 to {MAX_SIDE} and \
                 at most 16 million pixels"
            )
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct All {
        #[command(flatten)]
        scene: SceneArgs,
        #[command(flatten)]
        encode: EncodeArgs,
        #[command(flatten)]
        client: ClientArgs,
    }

    fn parse(arguments: &str) -> std::result::Result<All, clap::Error> {
        All::try_parse_from(["test"].into_iter().chain(arguments.split_whitespace()))
    }

    #[test]
    fn defaults_are_the_papers() {
        let all = parse("hall").expect("parsed");
        let e = &all.encode;
        assert_eq!(
            (e.density, e.thinning, e.quality.rays(), e.distance),
            (None, 2.0, 128, None)
        );
        assert_eq!(
            (e.quality.threshold(), e.compression, e.fps.hz()),
            (
                4,
                Compression::Zstd {
                    level: 15,
                    lazy: true
                },
                60.0
            )
        );
        assert_eq!(
            (e.width, e.keyframe_interval, e.no_visibility),
            (Width::Bits32, None, false)
        );
        assert_eq!(all.scene.view.size, (480, 270));
        let auto = Compression::Zstd {
            level: 3,
            lazy: false,
        };
        let other = parse("hall --compression zstd:3:auto").expect("parsed");
        assert_eq!(other.encode.compression, auto);
        assert_eq!(all.scene.view.seconds(all.encode.fps), 0.0);
    }

    #[test]
    fn what_is_meant_is_understood() {
        let all = parse(
            "a.glb --eye -1,2,-3.5 --target 0,0,0 --size 1920x1080 --frame 30 --fps 30000/1001 \
             --compression lz4 --width 16 --server-fps 5 --fallback one --keyframe-interval 60",
        )
        .expect("parsed");
        let (eye, target) = all.scene.view.look().expect("a view");
        assert_eq!((eye, target), (DVec3::new(-1.0, 2.0, -3.5), DVec3::ZERO));
        assert!((all.scene.view.seconds(all.encode.fps) - 1.001).abs() < 1e-12);
        assert_eq!(all.encode.fps.to_string(), "30000/1001");
        assert_eq!(
            all.client.server_fps,
            Some(Rate {
                numerator: 5,
                denominator: 1
            })
        );
    }

    #[test]
    fn packed_points_have_the_bits_they_name() {
        for (width, bits) in [
            (Width::Bits32, 32),
            (Width::Bits24, 24),
            (Width::Bits16, 16),
        ] {
            assert_eq!(width.widths().bits(), bits);
        }
    }

    #[test]
    fn nonsense_is_refused_with_exit_code_2() {
        let cases = [
            "--density 0",
            "--density NaN",
            "--density -5",
            "--density 1e30",
            "--density inf",
            "--thinning 0.5",
            "--rays 0",
            "--rays 99999999",
            "--distance 0",
            "--distance 1e400",
            "--threshold 256",
            "--threshold -1",
            "--frames 0",
            "--fps 0",
            "--fps 60/0",
            "--fps 59.94",
            "--fps 4000000000",
            "--seed -1",
            "--width 31",
            "--compression zstd:20",
            "--compression zstd:",
            "--compression gzip",
            "--keyframe-interval 0",
            "--fov-margin 91",
            "--budget 0",
            "--latency-ms -1",
            "--server-fps 0",
            "--size 0x5",
            "--size 5",
            "--size 16384x10",
            "--size 8192x8192",
            "--size 99999999999x1",
            "--time -1",
            "--time nan",
            "--time 1 --frame 2",
            "--eye 1,2,3",
            "--eye 1,2 --target 0,0,0",
            "--eye 1,2,3,4 --target 0,0,0",
            "--eye 1,2,inf --target 0,0,0",
            "--eye 1,2,3 --target 0,0,0 --camera a",
        ];
        for case in cases {
            let error = parse(&format!("hall {case}")).expect_err(case);
            assert_eq!(error.exit_code(), 2, "{case}");
        }
    }
}
