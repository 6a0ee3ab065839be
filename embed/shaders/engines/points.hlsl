// `points` in an engine that numbers its own registers, as Unity and Unreal do.

#define DAPPLE_POINTS_CUSTOM
#include "../hlsl/points_buffers.hlsl"

// `PointsBuckets` and `PointsCells` as they are, 8 words an item; 24 words a track.
StructuredBuffer<uint> DappleBuckets;
StructuredBuffer<uint> DappleCells;
StructuredBuffer<uint> DappleTracks;

uint dapple_points_bucket(uint bucket, uint entry) { return DappleBuckets[8 * bucket + entry]; }

uint dapple_points_cell(uint cell, uint word) { return DappleCells[8 * cell + word]; }

uint4 DappleTrackWords(uint track, uint row) {
    uint first = 24 * track + 4 * row;
    return uint4(DappleTracks[first], DappleTracks[first + 1], DappleTracks[first + 2], DappleTracks[first + 3]);
}

DapplePointsTrack dapple_points_track(uint track) {
    DapplePointsTrack t = (DapplePointsTrack)0;
    uint4 counts = DappleTrackWords(track, 0);
    t.first_bucket = counts.x;
    t.first_cell = counts.y;
    t.bucket_count = counts.z;
    t.cell_count = counts.w;
    uint4 dims = DappleTrackWords(track, 1);
    t.dims = dims.xyz;
    t.widths = dims.w;
    uint4 lengths = DappleTrackWords(track, 2);
    t.cell_edge = asfloat(lengths.x);
    t.radius = asfloat(lengths.y);
    t.row_x = asfloat(DappleTrackWords(track, 3));
    t.row_y = asfloat(DappleTrackWords(track, 4));
    t.row_z = asfloat(DappleTrackWords(track, 5));
    return t;
}
