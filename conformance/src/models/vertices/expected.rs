//! Expected values of tracks of `vertices`, worked out a second time from `spec/vertices.md`, and frames of
//! them.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use super::writer::{Section, Vertices, payload};
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::{Expected, ExpectedState};
use crate::stream_builder::kind;

/// The values of a track.
#[derive(Clone, Debug)]
pub struct Values {
    pub vertices: Vertices,
    /// A byte each, vertex by vertex.
    pub values: Vec<u8>,
}

impl Values {
    /// An open track.
    pub fn new(vertices: &Vertices) -> Values {
        Values {
            vertices: vertices.clone(),
            values: vec![255; vertices.values()],
        }
    }

    /// AO in a triangle, in real numbers (V-050, O-010).
    pub fn look_up(&self, vertices: [u32; 3], weights: [u32; 3]) -> f64 {
        let count = self.vertices.signal_count();
        let signal = |signal: usize| {
            let corners = vertices.into_iter().zip(weights);
            let of = |vertex: u32| f64::from(self.values[vertex as usize * count + signal]);
            let sum: f64 = corners.map(|(v, w)| of(v) * f64::from(w) / 65536.0).sum();
            sum / 255.0
        };
        let signals: Vec<f64> = (0..count).map(signal).collect();
        self.vertices.signals.blend(&signals)
    }
}

impl ExpectedState for Values {
    /// `spec/vertices.md` §7.
    fn digest(&self, digest: &mut XxHash64) {
        digest.write(&self.values);
    }
}

impl TrackContent {
    /// The state of a track of `vertices`; `None` for another model.
    pub fn values(&self) -> Option<&Values> {
        let Expected::Vertices(values) = &self.state else {
            return None;
        };
        Some(values)
    }
}

impl Frames {
    /// A `vertices` record that gives these tracks these codes.
    pub fn vertices(mut self, contents: &[(u32, Vec<u8>)]) -> Frames {
        let payload = payload(&self.vertices_sections(contents));
        for (id, codes) in contents {
            let track = self.pending_mut(*id);
            if let Some(Expected::Vertices(values)) = track.map(|track| &mut track.state) {
                let vertices = &values.vertices;
                values.values = codes.iter().map(|&code| vertices.value(code)).collect();
            }
        }
        self.content(kind::VERTICES, &payload)
    }

    /// The sections that [`Frames::vertices`] would put.
    pub fn vertices_sections(&self, contents: &[(u32, Vec<u8>)]) -> Vec<Section> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let section = |(id, codes): &(u32, Vec<u8>)| {
            Some(Section {
                id: *id,
                bytes: track(*id)?.entry.vertices()?.section(codes),
                ..Section::default()
            })
        };
        contents.iter().filter_map(section).collect()
    }
}
