//! The encoder (PSAO §3.4): runs the server over a span of time and writes what the client needs,
//! a frame a tick.

use super::server::{Options, Server, Tick, Track};
use crate::codec::{self, Compression, Encoder};
use crate::scene::{CameraPose, Pose, Scene};
use crate::{Error, Result};
use std::io::Write;
use std::time::{Duration, Instant};

/// Unpacked bytes after which a frame's update goes on in another record: keeps a client's memory
/// for one record small.
const RECORD_BYTES: usize = 1 << 22;

/// Whose eyes the stream is made for.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// A camera of the scene, which may be animated.
    Camera(usize),
    Fixed(CameraPose),
}

impl View {
    pub fn at(&self, pose: &Pose) -> CameraPose {
        match self {
            View::Camera(i) => pose.cameras[*i],
            View::Fixed(camera) => *camera,
        }
    }
}

/// What is to be encoded.
#[derive(Clone, Debug)]
pub struct Job {
    pub options: Options,
    pub view: View,
    /// Frames, the start-up frame included.
    pub frames: usize,
    /// Server frames a second.
    pub fps: u32,
    /// Seconds into the animation at which the first frame lies.
    pub start: f64,
    /// Frames between keyframes; 0 for none after the first.
    pub keyframe_interval: usize,
    pub compression: Compression,
}

/// What encoding came to. Times are means over the frames after the first.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Report {
    pub scene: String,
    pub seed: u64,
    pub frames: usize,
    pub fps: u32,
    /// Candidates per square metre, before thinning.
    pub density: f32,
    pub candidates: usize,
    pub points: usize,
    /// Interpolation radius in metres.
    pub radius: f32,
    pub cells: usize,
    pub buckets: usize,
    pub dropped_points: u64,
    pub dropped_cells: u64,
    /// Points sent again, summed over the frames after the first.
    pub changed_points: usize,
    /// Points traced again, summed over the frames after the first.
    pub traced_points: usize,
    /// Rays of the start-up frame.
    pub rays_startup: u64,
    /// Rays of the frames after the first.
    pub rays: u64,
    /// Everything up to the first commit.
    pub bytes_startup: u64,
    /// Frames after the first that carry no keyframe.
    pub bytes_steady: u64,
    /// Frames after the first that carry one.
    pub bytes_keyframes: u64,
    /// Rate of the frames after the first that carry no keyframe.
    pub mbps_steady: f64,
    /// Rate of the whole stream, its first keyframe included.
    pub mbps_with_keyframes: f64,
    /// Frames between keyframes; 0 when only the first is one.
    pub keyframe_interval: usize,
    pub stage_ms: StageMs,
    /// Seconds for placing, grids and the first trace of every point.
    pub startup_s: f64,
}

/// Mean milliseconds of a tick by stage.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct StageMs {
    /// Animation and skinning.
    pub pose: f64,
    /// Acceleration structures.
    pub update: f64,
    /// Finding the points to trace.
    pub select: f64,
    pub trace: f64,
    /// Buckets and cells.
    pub store: f64,
    /// Packing and compressing.
    pub encode: f64,
}

impl StageMs {
    pub fn total(&self) -> f64 {
        self.pose + self.update + self.select + self.trace + self.store + self.encode
    }

    fn add(&mut self, tick: &Tick, encode: Duration) {
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        self.pose += ms(tick.pose_time);
        self.update += ms(tick.update_time);
        self.select += ms(tick.select_time);
        self.trace += ms(tick.trace_time);
        self.store += ms(tick.store_time);
        self.encode += ms(encode);
    }

    fn scaled(self, by: f64) -> StageMs {
        StageMs {
            pose: self.pose * by,
            update: self.update * by,
            select: self.select * by,
            trace: self.trace * by,
            store: self.store * by,
            encode: self.encode * by,
        }
    }
}
