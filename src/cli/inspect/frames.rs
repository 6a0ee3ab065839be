//! Frames and the bytes they took, as the stream goes by, in constant memory.

use serde::Serialize;

use super::sparkline::Sparkline;
use crate::codec::{Decoder, Event, GroupStart, TickRate};

/// Keyframes that are listed; more are only counted.
const LISTED_KEYFRAMES: usize = 256;
/// Keyframes that the text report names.
const NAMED_KEYFRAMES: usize = 12;

/// The frames of a stream. A frame's bytes are those after the commit before it, up to the end of
/// its own commit, headers included; the preamble belongs to the first frame.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Frames {
    pub frames: u64,
    /// Frames that start a group from nothing.
    pub keyframes: u64,
    first_tick: Option<u64>,
    last_tick: Option<u64>,
    /// Up to the end of the first commit.
    pub bytes_startup: u64,
    /// Of later frames that are no keyframes.
    pub bytes_steady: u64,
    /// Of later keyframes.
    pub bytes_keyframes: u64,
    /// The first keyframes, at most 256.
    keyframe_list: Vec<Keyframe>,
    keyframe_interval: Option<Interval>,
    bytes_per_frame: Sparkline,
    #[serde(skip)]
    last_keyframe: Option<u64>,
    #[serde(skip)]
    keyframe_next: bool,
    /// End of the last commit.
    #[serde(skip)]
    pub position: u64,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Keyframe {
    /// Frame number.
    frame: u32,
    tick: u64,
    bytes: u64,
}

/// Frames from one keyframe to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Interval {
    shortest: u64,
    longest: u64,
}

impl Frames {
    /// Takes an event in.
    pub fn event(&mut self, decoder: &Decoder, event: Event) {
        match event {
            Event::Group {
                start: GroupStart::Keyframes,
                ..
            } => self.keyframe_next = true,
            Event::Frame(frame) => {
                let bytes = decoder.position() - self.position;
                self.position = decoder.position();
                match (self.frames, self.keyframe_next) {
                    (0, _) => self.bytes_startup = bytes,
                    (_, false) => self.bytes_steady += bytes,
                    (_, true) => self.bytes_keyframes += bytes,
                }
                if std::mem::take(&mut self.keyframe_next) {
                    self.keyframe(Keyframe {
                        frame: frame.number,
                        tick: frame.tick,
                        bytes,
                    });
                }
                self.bytes_per_frame.push(bytes);
                self.frames += 1;
                self.first_tick.get_or_insert(frame.tick);
                self.last_tick = Some(frame.tick);
            }
            _ => {}
        }
    }

    fn keyframe(&mut self, keyframe: Keyframe) {
        self.keyframes += 1;
        if self.keyframe_list.len() < LISTED_KEYFRAMES {
            self.keyframe_list.push(keyframe);
        }
        if let Some(last) = self.last_keyframe.replace(self.frames) {
            let frames = self.frames - last;
            let interval = self.keyframe_interval.get_or_insert(Interval {
                shortest: frames,
                longest: frames,
            });
            interval.shortest = interval.shortest.min(frames);
            interval.longest = interval.longest.max(frames);
        }
    }

    /// Seconds from the first commit to the last.
    fn seconds(&self, rate: TickRate) -> Option<f64> {
        let ticks = self
            .last_tick?
            .checked_sub(self.first_tick?)
            .filter(|&t| t > 0)?;
        Some(ticks as f64 / rate.hz())
    }

    /// Later keyframes, and later frames that are none.
    pub fn later(&self) -> (u64, u64) {
        let later = self.frames.saturating_sub(1);
        let first_is_keyframe = u64::from(self.keyframes > 0);
        let keyframes = self.keyframes.saturating_sub(first_is_keyframe).min(later);
        (keyframes, later - keyframes)
    }

    /// Mean Mbit/s of the frames after the first: that of frames which are no keyframes, as if the
    /// keyframes were such frames too, and that of all.
    pub fn rates(&self, rate: TickRate) -> (Option<f64>, Option<f64>) {
        let Some(seconds) = self.seconds(rate) else {
            return (None, None);
        };
        let (keyframes, plain) = self.later();
        let megabits = |bytes: u64| bytes as f64 * 8.0 / 1e6 / seconds;
        let steady = megabits(self.bytes_steady) * (keyframes + plain) as f64 / plain as f64;
        let all = megabits(self.bytes_steady + self.bytes_keyframes);
        ((plain > 0).then_some(steady), Some(all))
    }

    /// Which frames are keyframes, and a line of bytes per frame.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        if !self.keyframe_list.is_empty() {
            let named = self.keyframe_list.iter().take(NAMED_KEYFRAMES);
            let named: Vec<String> = named.map(|keyframe| keyframe.frame.to_string()).collect();
            text += &format!("keyframes: frame {}", named.join(", "));
            if self.keyframes > NAMED_KEYFRAMES as u64 {
                let more = self.keyframes - NAMED_KEYFRAMES as u64;
                text += &format!(" and {more} more");
            }
            text += &match self.keyframe_interval {
                None => String::new(),
                Some(Interval { shortest, longest }) if shortest == longest => {
                    format!("; every {longest} frames")
                }
                Some(Interval { shortest, longest }) => {
                    format!("; {shortest} to {longest} frames apart")
                }
            };
            text.push('\n');
        }
        text + &self.bytes_per_frame.to_text()
    }
}
