//! The client's view of the model `points`: arrays for the sampler, by instance.

use crate::client::Client;
use crate::codec::LookupSpace;
use crate::codec::points::{Bucket, Cell, DirtyRange, Grid};

/// Where a track's state lies in the shared buffers.
#[derive(Clone, Copy, Debug)]
pub struct PointsTrack {
    pub grid: Grid,
    /// Index of its first bucket; `grid.bucket_count` of them are its own.
    pub first_bucket: u32,
    /// Index of its first cell; `grid.cell_capacity` of them are its own.
    pub first_cell: u32,
}

/// The decoded state of all tracks, as it lies in the decoder.
#[derive(Clone, Copy, Debug)]
pub struct PointsState<'a> {
    pub tracks: &'a [PointsTrack],
    pub buckets: &'a [Bucket],
    pub cells: &'a [Cell],
    /// Per instance of the scene, an index into `tracks`; beyond its end there is none.
    pub track_of_instance: &'a [Option<u32>],
    /// What changed since the last call with the same state: the device uploads that alone. `None`
    /// uploads everything, as after a jump or for another state.
    pub dirty: Option<Dirty<'a>>,
}

/// Changed items of the shared buffers, as the decoder reports them.
#[derive(Clone, Copy, Debug)]
pub struct Dirty<'a> {
    pub buckets: &'a [DirtyRange],
    pub cells: &'a [DirtyRange],
}

/// The points of a client as of its last frame.
pub struct PointsView<'c> {
    client: &'c Client,
    tracks: Vec<PointsTrack>,
    track_of_instance: Vec<Option<u32>>,
    rest: bool,
}

impl<'c> PointsView<'c> {
    pub fn new(client: &'c Client) -> PointsView<'c> {
        let mut view = PointsView {
            client,
            tracks: Vec::new(),
            track_of_instance: vec![None; client.instance_count()],
            rest: false,
        };
        for live in client.decoder().tracks() {
            let place = client.decoder().points().place_of(live);
            let (Some(place), Some(instance)) = (place, client.instance_of(&live.track)) else {
                continue;
            };
            view.track_of_instance[instance] = Some(view.tracks.len() as u32);
            view.rest |= live.track.space == LookupSpace::Rest;
            view.tracks.push(PointsTrack {
                grid: place.grid,
                first_bucket: place.first_bucket,
                first_cell: place.first_cell,
            });
        }
        view
    }

    /// Whether a mesh instance has points, by its index in [`Client::instances`].
    pub fn has(&self, instance: usize) -> bool {
        self.track_of_instance
            .get(instance)
            .is_some_and(Option::is_some)
    }

    /// Whether deforming meshes are looked up in their rest pose.
    pub fn looks_up_rest_pose(&self) -> bool {
        self.rest
    }

    /// What the sampler needs.
    pub fn state(&self) -> PointsState<'_> {
        let points = self.client.decoder().points();
        PointsState {
            tracks: &self.tracks,
            buckets: points.buckets(),
            cells: points.cells(),
            track_of_instance: &self.track_of_instance,
            dirty: None,
        }
    }
}
