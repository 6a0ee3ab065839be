//! Frames of tracks of `regions`.

use super::expected::{Content, Regions};
use super::writer::{self, Section};
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Expected;
use crate::stream_builder::kind;

impl Frames {
    /// A `regions` record that leaves these tracks with these regions.
    pub fn regions(self, contents: &[Content]) -> Frames {
        let sections = self.region_sections(contents);
        self.regions_as(contents, &sections)
    }

    /// The same with sections of another form, which must come to the same.
    pub fn regions_as(mut self, contents: &[Content], sections: &[Section]) -> Frames {
        let payload = writer::payload(sections);
        for content in contents {
            let track = self.pending_mut(content.id);
            if let Some(Expected::Regions(regions)) = track.map(|track| &mut track.state) {
                regions.regions.clone_from(&content.regions);
            }
        }
        self.content(kind::REGIONS, &payload)
    }

    /// The sections that [`Frames::regions`] would put.
    pub fn region_sections(&self, contents: &[Content]) -> Vec<Section> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let section = |content: &Content| Some(track(content.id)?.regions()?.section(content));
        contents.iter().filter_map(section).collect()
    }

    /// The payload that [`Frames::regions`] would put.
    pub fn regions_payload(&self, contents: &[Content]) -> Vec<u8> {
        writer::payload(&self.region_sections(contents))
    }
}

impl TrackContent {
    /// The state of a track of `regions`; `None` for another model.
    pub fn regions(&self) -> Option<&Regions> {
        let Expected::Regions(regions) = &self.state else {
            return None;
        };
        Some(regions)
    }
}
