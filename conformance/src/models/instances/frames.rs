//! Frames of tracks of `instances`.

use super::expected::{Content, Entries};
use super::writer::{self, Section};
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Expected;
use crate::stream_builder::kind;

impl Frames {
    /// An `instances` record that leaves these tracks with these entries.
    pub fn instances(mut self, contents: &[Content]) -> Frames {
        let payload = writer::payload(&self.instance_sections(contents));
        for content in contents {
            let track = self.pending_mut(content.id);
            if let Some(Expected::Instances(entries)) = track.map(|track| &mut track.state) {
                entries.instances.clone_from(&content.instances);
            }
        }
        self.content(kind::INSTANCES, &payload)
    }

    /// The sections that [`Frames::instances`] would put.
    pub fn instance_sections(&self, contents: &[Content]) -> Vec<Section> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let section = |content: &Content| Some(track(content.id)?.entries()?.section(content));
        contents.iter().filter_map(section).collect()
    }

    /// The payload that [`Frames::instances`] would put.
    pub fn instances_payload(&self, contents: &[Content]) -> Vec<u8> {
        writer::payload(&self.instance_sections(contents))
    }
}

impl TrackContent {
    /// The state of a track of `instances`; `None` for another model.
    pub fn entries(&self) -> Option<&Entries> {
        let Expected::Instances(entries) = &self.state else {
            return None;
        };
        Some(entries)
    }
}
