//! Boulders that roll to and fro on the floor, baked as keys.

use crate::scene::{Channel, ChannelValues, Interpolation, Mesh};
use glam::{Quat, Vec3};

/// Where a boulder rolls.
pub(super) struct Lane {
    pub from: Vec3,
    pub to: Vec3,
    /// Metres, mean.
    pub radius: f32,
    /// Share of the loop by which it is ahead.
    pub phase: f32,
    /// Round trips a loop.
    pub trips: f32,
}

/// Keys of translation and rotation for `node`, whose scale is the radius. The boulder rolls
/// without slipping: it turns by distance over radius about the axis across its way. Its lowest
/// vertex touches the floor at every key.
pub(super) fn channels(lane: &Lane, mesh: &Mesh, node: usize, times: &[f32]) -> [Channel; 2] {
    let duration = times.last().copied().unwrap_or(1.0);
    let way = lane.to - lane.from;
    let direction = way.normalize_or(Vec3::X);
    let axis = Vec3::Y.cross(direction);
    let mut translations = Vec::with_capacity(times.len());
    let mut rotations = Vec::with_capacity(times.len());
    for time in times {
        let turn = (time / duration * lane.trips + lane.phase).fract();
        let travelled = way.length() * 0.5 * (1.0 - (std::f32::consts::TAU * turn).cos());
        let rotation = Quat::from_axis_angle(axis, travelled / lane.radius);
        let lowest = mesh
            .positions
            .iter()
            .map(|p| (rotation * *p).y)
            .fold(f32::INFINITY, f32::min);
        let centre = lane.from + direction * travelled - Vec3::Y * (lowest * lane.radius);
        translations.push(centre);
        rotations.push(rotation);
    }
    [
        ChannelValues::Translation(translations),
        ChannelValues::Rotation(rotations),
    ]
    .map(|values| Channel {
        node,
        interpolation: Interpolation::Linear,
        times: times.to_vec(),
        values,
    })
}
