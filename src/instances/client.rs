//! The client's view of the model `instances`: which entry each mesh instance has, for the samplers on
//! the CPU ([`InstanceEntry::ao`]) and on a device.

use super::sample::{Bounds, InstanceEntry};
use crate::client::Client;
use crate::codec::instances::key;
use crate::codec::{Decoder, TrackState};
use std::collections::BTreeMap;

/// The entries of a client's mesh instances as of its last frame.
pub struct InstancesView {
    entries: Vec<Option<InstanceEntry>>,
}

impl InstancesView {
    /// Finds the entry of every mesh instance, once.
    pub fn new(client: &Client) -> InstancesView {
        let decoder = client.decoder();
        // The last track of a mesh is the latest one.
        let tracks = decoder.tracks().iter();
        let of_mesh: BTreeMap<u64, &TrackState> = tracks
            .filter(|track| track.track.instance_table().is_some())
            .filter_map(|track| Some((track.track.target.content_hash?, track)))
            .collect();
        let entry = |path: &str, mesh: u64| entry_of(decoder, of_mesh.get(&mesh)?, path);
        let instances = client.instances().iter();
        InstancesView {
            entries: instances
                .map(|instance| entry(&instance.path, instance.content_hash))
                .collect(),
        }
    }

    /// The entry of a mesh instance, by its index in [`Client::instances`]; `None` without one.
    pub fn entry(&self, instance: usize) -> Option<&InstanceEntry> {
        self.entries.get(instance)?.as_ref()
    }

    /// AO of a mesh instance at `position` in mesh space (metres), with a local AO that its mesh has
    /// there, 1 without one. An instance without an entry has the local AO alone.
    pub fn ao(&self, instance: usize, position: [f32; 3], local: f32) -> f32 {
        match self.entry(instance) {
            Some(entry) => entry.ao(position, local),
            None => local.clamp(0.0, 1.0),
        }
    }
}

/// The entry that a track has of the mesh instance of a path; `None` where it has none, or is of
/// another model.
pub fn entry_of(decoder: &Decoder, track: &TrackState, path: &str) -> Option<InstanceEntry> {
    let table = track.track.instance_table()?;
    let values = decoder.instances().find(track, key(path))?;
    let bounds = Bounds::new(track.track.aabb_min, track.track.aabb_max);
    Some(InstanceEntry::new(table, bounds, values))
}
