// Accessors of `points.wgsl` by textures alone. The binding numbers are yours to change.

// `rgba32uint`, any even width: item i of 8 words is texels 2 i and 2 i + 1, counted row by row. A track is
// the six texels from 6 t of a texture of its own, whose width is a multiple of 6.
@group(1) @binding(32) var dapple_points_tracks: texture_2d<u32>;
@group(1) @binding(33) var dapple_points_buckets: texture_2d<u32>;
@group(1) @binding(34) var dapple_points_cells: texture_2d<u32>;

fn dapple_points_track(track: u32) -> DapplePointsTrack {
    let width = textureDimensions(dapple_points_tracks).x;
    let at = vec2u((6u * track) % width, (6u * track) / width);
    let a = textureLoad(dapple_points_tracks, at, 0);
    let b = textureLoad(dapple_points_tracks, at + vec2u(1u, 0u), 0);
    let c = textureLoad(dapple_points_tracks, at + vec2u(2u, 0u), 0);
    var t: DapplePointsTrack;
    t.first_bucket = a.x;
    t.first_cell = a.y;
    t.bucket_count = a.z;
    t.cell_count = a.w;
    t.dims = b.xyz;
    t.widths = b.w;
    t.cell_edge = bitcast<f32>(c.x);
    t.radius = bitcast<f32>(c.y);
    t.row_x = bitcast<vec4f>(textureLoad(dapple_points_tracks, at + vec2u(3u, 0u), 0));
    t.row_y = bitcast<vec4f>(textureLoad(dapple_points_tracks, at + vec2u(4u, 0u), 0));
    t.row_z = bitcast<vec4f>(textureLoad(dapple_points_tracks, at + vec2u(5u, 0u), 0));
    return t;
}

fn dapple_points_bucket(bucket: u32, entry: u32) -> u32 {
    let width = textureDimensions(dapple_points_buckets).x;
    let at = 2u * bucket + entry / 4u;
    return textureLoad(dapple_points_buckets, vec2u(at % width, at / width), 0)[entry % 4u];
}

fn dapple_points_cell(cell: u32, word: u32) -> u32 {
    let width = textureDimensions(dapple_points_cells).x;
    let at = 2u * cell + word / 4u;
    return textureLoad(dapple_points_cells, vec2u(at % width, at / width), 0)[word % 4u];
}
