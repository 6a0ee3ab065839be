//! The figures of an encoding run, under the names that `dapple encode --json` and `report.json`
//! give them.

use serde::Serialize;

use super::bitrate::mbit_per_second;

/// What `dapple encode` did and what came of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct EncodeSummary {
    pub scene: String,
    pub seed: u32,
    pub frames: u64,
    /// Server frames a second.
    pub fps: f64,
    /// Points generated, before thinning.
    pub points_before_thinning: u64,
    pub points: u64,
    /// Cells in use after the last frame.
    pub cells: u64,
    pub buckets: u64,
    pub dropped_points: u64,
    pub dropped_cells: u64,
    /// Sum over all frames after the first.
    pub changed_points: u64,
    /// Occlusion rays traced, all frames.
    pub rays: u64,
    /// Bytes up to and including the first frame's commit.
    pub bytes_startup: u64,
    /// Bytes of all later frames, those of later keyframes left out.
    pub bytes_steady: u64,
    /// Bytes of keyframes after the first frame.
    pub bytes_keyframes: u64,
    /// Keyframes after the first frame.
    pub later_keyframes: u64,
    /// Mean rate in Mbit/s of the frames after the first that are no keyframes; `None` where there
    /// are none.
    pub mbps_steady: Option<f64>,
    /// Mean rate in Mbit/s of the frames after the first, keyframes included.
    pub mbps_with_keyframes: Option<f64>,
    /// Frames from one keyframe to the next; `None` where only the first frame is one.
    pub keyframe_interval: Option<u32>,
    pub stage_ms: StageTimes,
}

/// Mean milliseconds of each stage; the server's stages are per frame after the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageTimes {
    /// Point generation, once.
    pub place: f64,
    /// The first frame, once.
    pub first_frame: f64,
    /// Animation and skinning.
    pub pose: f64,
    /// Acceleration structures.
    pub accelerate: f64,
    /// Visibility and the choice of points to trace.
    pub select: f64,
    /// Rays.
    pub trace: f64,
    /// Threshold, reallocation, compaction.
    pub update: f64,
    /// Serialisation and compression.
    pub encode: f64,
}

impl EncodeSummary {
    /// Fills in the rates from bytes, frames and `fps`.
    pub fn with_rates(mut self) -> EncodeSummary {
        let later = self.frames.saturating_sub(1);
        let plain = later.saturating_sub(self.later_keyframes);
        self.mbps_steady = mbit_per_second(self.bytes_steady, plain, self.fps);
        let all = self.bytes_steady.saturating_add(self.bytes_keyframes);
        self.mbps_with_keyframes = mbit_per_second(all, later, self.fps);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_leave_the_first_frame_out() {
        let summary = EncodeSummary {
            frames: 61 + 60,
            fps: 60.0,
            bytes_startup: 99_000_000,
            bytes_steady: 1_000_000,
            bytes_keyframes: 500_000,
            later_keyframes: 60,
            ..EncodeSummary::default()
        }
        .with_rates();
        assert_eq!(
            (summary.mbps_steady, summary.mbps_with_keyframes),
            (Some(8.0), Some(6.0))
        );
        let one = EncodeSummary {
            frames: 1,
            fps: 60.0,
            ..EncodeSummary::default()
        }
        .with_rates();
        assert_eq!(one.mbps_steady, None);
    }

    #[test]
    fn json_has_the_documented_names() {
        let json = serde_json::to_value(EncodeSummary::default()).expect("serialised");
        let names = "scene seed frames fps points cells buckets dropped_points dropped_cells \
                     changed_points rays bytes_startup bytes_steady mbps_steady \
                     mbps_with_keyframes keyframe_interval stage_ms";
        for name in names.split_whitespace() {
            assert!(json.get(name).is_some(), "{name}");
        }
    }
}
