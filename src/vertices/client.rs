//! The client's view of the model `vertices`: which values each mesh instance has, for the samplers on the
//! CPU ([`MeshValues::ao`]) and on a device.

use super::sample::MeshValues;
use crate::client::Client;
use crate::codec::TrackState;
use crate::codec::vertices::{State, Vertices};

/// The values of a client's mesh instances as of its last frame.
pub struct VerticesView<'c> {
    /// Values of all tracks.
    pub values: &'c [u8],
    meshes: Vec<Option<InstanceValues>>,
}

/// What a mesh instance has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceValues {
    pub values: MeshValues,
    /// The values are of the instance where it stands, and not local ones of its mesh, which all its instances
    /// share.
    pub is_own: bool,
    /// Vertices are counted as by [`remap`](crate::codec::vertices::remap).
    pub is_remapped: bool,
    /// Vertices of the track.
    pub count: u32,
}

impl<'c> VerticesView<'c> {
    /// Finds the values of every mesh instance, once.
    pub fn new(client: &'c Client) -> VerticesView<'c> {
        let state = client.decoder().vertices();
        let mut meshes = vec![None; client.instances().len()];
        for live in client.decoder().tracks() {
            let track = &live.track;
            let (Some(vertices), Some(hash)) = (track.vertices(), track.target.content_hash) else {
                continue;
            };
            let Some(values) = values_of(state, live, vertices) else {
                continue;
            };
            let is_own = !track.target.path.is_empty();
            let found = InstanceValues {
                values,
                is_own,
                is_remapped: vertices.order == Vertices::DISTINCT_ORDER,
                count: vertices.count,
            };
            if is_own {
                if let Some(instance) = client.instance_of(track) {
                    meshes[instance] = Some(found);
                }
                continue;
            }
            for (own, instance) in meshes.iter_mut().zip(client.instances()) {
                if instance.content_hash == hash && own.is_none_or(|own| !own.is_own) {
                    *own = Some(found);
                }
            }
        }
        VerticesView {
            values: state.values(),
            meshes,
        }
    }

    /// What a mesh instance has, by its index in [`Client::instances`]; `None` without a track.
    pub fn of_instance(&self, instance: usize) -> Option<&InstanceValues> {
        self.meshes.get(instance)?.as_ref()
    }
}

/// Where a track's values are; `None` where it is of another model.
pub fn values_of(state: &State, live: &TrackState, vertices: &Vertices) -> Option<MeshValues> {
    Some(MeshValues {
        first: state.first_of(live)?,
        signals: u32::from(vertices.signals.count),
        share: match vertices.signals.count {
            2 => vertices.signals.share,
            _ => 0.0,
        },
    })
}
