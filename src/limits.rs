//! Whether the decoders that shall read a stream accept its tracks: asked before anything is traced.

use crate::codec::probes::Coding;
use crate::codec::{Limit, Limits, Model, Track};
use crate::{Error, Result};

/// Bytes of a bucket or cell in a keyframe, with its index.
const ITEM_BYTES: u64 = 36;
/// Bytes of a probe in the coding `raw`.
const RAW_PROBE_BYTES: u64 = 56;
/// Bytes of a region and of a pair of coefficients in the coding `raw`; `packed` takes fewer.
const REGION_BYTES: u64 = 40;
const PAIR_BYTES: u64 = 4;

/// Refuses tracks whose declaration, state or keyframe exceeds the limits.
///
/// # Errors
/// `Invalid`, with the limit and what to do.
pub fn check_tracks(scene: &str, tracks: &[Track], limits: &Limits) -> Result<()> {
    let check = |which: Limit, asked: u64, what: &str, advice: &str| {
        let (allowed, name) = (limits.get(which), which.name());
        if asked <= allowed {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "{scene}: {what} {asked}, and the decoders' limit {name} is {allowed}; {advice}, or \
             raise the limit here and in every decoder"
        )))
    };
    let count = tracks.len() as u64;
    let join = "join meshes that never move against each other";
    check(
        Limit::Tracks,
        count,
        "the mesh instances that need a track are",
        join,
    )?;
    let path = tracks.iter().map(|track| track.target.path.len()).max();
    let path = path.unwrap_or(0) as u64;
    let names = "shorten the names of its nodes";
    check(
        Limit::PathBytes,
        path,
        "the bytes of the longest node path are",
        names,
    )?;
    let state: u64 = tracks.iter().map(|track| track.model.state_bytes()).sum();
    let is_baked = |track: &Track| match track.model {
        Model::Points(_) | Model::Probes(_) => false,
        Model::Vertices(_) | Model::Instances(_) | Model::Regions(_) => true,
    };
    let fewer = match tracks.iter().all(is_baked) {
        true => "give the scene fewer vertices",
        false => "lower --density or --probes",
    };
    check(
        Limit::StateBytes,
        state,
        "the bytes of state of all tracks are",
        fewer,
    )?;
    let keyframe: u64 = tracks.iter().map(keyframe_bytes).sum();
    let largest = tracks.iter().map(keyframe_bytes).max().unwrap_or(0);
    check(
        Limit::FrameBytes,
        keyframe,
        "the bytes of a keyframe may be",
        fewer,
    )?;
    for which in [Limit::UnpackedBytes, Limit::StoredBytes] {
        check(
            which,
            largest,
            "the bytes of one track in a keyframe may be",
            fewer,
        )?;
    }
    Ok(())
}

/// The most payload bytes of a track in a keyframe; of `packed` probes those of the visibility block.
fn keyframe_bytes(track: &Track) -> u64 {
    match &track.model {
        Model::Points(grid) => {
            ITEM_BYTES * (u64::from(grid.bucket_count) + u64::from(grid.cell_capacity))
        }
        Model::Probes(volume) => {
            let probe = match volume.coding {
                Coding::Raw => RAW_PROBE_BYTES,
                Coding::Packed(_) => 0,
            };
            volume.visibility_bytes() + probe * volume.count() as u64
        }
        Model::Vertices(vertices) => vertices.values() as u64,
        // A key, its form, and four codes a signal.
        Model::Instances(table) => {
            u64::from(table.count) * (9 + 8 * u64::from(table.signals.count))
        }
        Model::Regions(set) => {
            REGION_BYTES * u64::from(set.count) + PAIR_BYTES * u64::from(set.capacity)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::points::{Grid, PointWidths};
    use crate::codec::{LookupSpace, Target, Transform};

    fn track(path: &str) -> Track {
        Track {
            id: 0,
            target: Target {
                path: path.into(),
                ..Target::default()
            },
            aabb_min: [0.0; 3],
            aabb_max: [1.0; 3],
            space: LookupSpace::Mesh,
            model: Model::Points(Grid {
                grid_from_mesh: Transform::IDENTITY.world_from_grid,
                dims: [1; 3],
                cell_edge: 1.0,
                radius: 0.5,
                widths: PointWidths::BITS_32,
                bucket_count: 10,
                cell_capacity: 20,
                coding: crate::codec::points::Coding::Cells,
            }),
        }
    }

    #[test]
    fn each_limit_is_named_with_the_figures() {
        let tracks = [track("path"), track("longer/path")];
        for (which, asked) in [
            (Limit::Tracks, 2),
            (Limit::PathBytes, 11),
            (Limit::StateBytes, 2 * (10 * 32 + 20 * 36)),
            (Limit::FrameBytes, 2 * 30 * 36),
            (Limit::UnpackedBytes, 30 * 36),
            (Limit::StoredBytes, 30 * 36),
        ] {
            let mut limits = Limits::default();
            assert!(limits.set(which, asked));
            check_tracks("room", &tracks, &limits).expect("within the limits");
            assert!(limits.set(which, asked - 1));
            let error = check_tracks("room", &tracks, &limits).expect_err(which.name());
            let (text, allowed) = (error.to_string(), asked - 1);
            let figures = format!(
                " {asked}, and the decoders' limit {} is {allowed};",
                which.name()
            );
            assert!(
                text.starts_with("room: ") && text.contains(&figures),
                "{text}"
            );
        }
    }
}
