// Accessors of `points.wgsl` by storage buffers. The binding numbers are yours to change.

// An entry a track.
@group(1) @binding(32) var<storage, read> dapple_points_tracks: array<DapplePointsTrack>;
// `PointsBuckets` and `PointsCells` as they are.
@group(1) @binding(33) var<storage, read> dapple_points_buckets: array<array<u32, 8>>;
@group(1) @binding(34) var<storage, read> dapple_points_cells: array<array<u32, 8>>;

fn dapple_points_track(track: u32) -> DapplePointsTrack {
    return dapple_points_tracks[track];
}

fn dapple_points_bucket(bucket: u32, entry: u32) -> u32 {
    return dapple_points_buckets[bucket][entry];
}

fn dapple_points_cell(cell: u32, word: u32) -> u32 {
    return dapple_points_cells[cell][word];
}
