//! Frames of tracks of `probes`.

use super::expected::{Content, Probes};
use super::writer::{self, Section};
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Expected;
use crate::stream_builder::kind;

impl Frames {
    /// A `probes` record that leaves these tracks with these probes.
    pub fn probes(self, keyframe: bool, contents: &[Content]) -> Frames {
        let sections = self.sections(keyframe, contents);
        self.probes_as(keyframe, contents, &sections)
    }

    /// The same with sections of another form, which must come to the same.
    pub fn probes_as(
        mut self,
        keyframe: bool,
        contents: &[Content],
        sections: &[Section],
    ) -> Frames {
        let payload = writer::payload(self.base(keyframe), sections);
        for content in contents {
            let track = self.pending_mut(content.id);
            if let Some(Expected::Probes(probes)) = track.map(|track| &mut track.state) {
                probes.write(keyframe, content);
            }
        }
        self.content(kind::PROBES, &payload)
    }

    /// The sections that [`Frames::probes`] would put.
    pub fn sections(&self, keyframe: bool, contents: &[Content]) -> Vec<Section> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let section =
            |content: &Content| Some(track(content.id)?.probes()?.section(keyframe, content));
        contents.iter().filter_map(section).collect()
    }

    /// The payload that [`Frames::probes`] would put.
    pub fn probes_payload(&self, keyframe: bool, contents: &[Content]) -> Vec<u8> {
        writer::payload(self.base(keyframe), &self.sections(keyframe, contents))
    }
}

impl TrackContent {
    /// The state of a track of `probes`; `None` for another model.
    pub fn probes(&self) -> Option<&Probes> {
        let Expected::Probes(probes) = &self.state else {
            return None;
        };
        Some(probes)
    }
}
