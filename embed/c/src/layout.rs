//! Sizes and offsets of all structs, as `tests/layout.c` has them on the other side. It compiles, or a struct has
//! changed: then [`crate::ABI_VERSION`] has to.

use core::mem::offset_of;

use crate::*;

macro_rules! layout {
    ($($type:ident $size:literal { $($field:ident $offset:literal),* })*) => {
        const _: () = { $(
            assert!(size_of::<$type>() == $size, stringify!($type));
            $( assert!(offset_of!($type, $field) == $offset, stringify!($type.$field)); )*
        )* };
    };
}

layout! {
    DirtyRange 16 { buffer 0, track 4, start 8, end 12 }
    Limits 40 {
        state_bytes 0, stored_bytes 8, unpacked_bytes 12, frame_bytes 16, zstd_window_bytes 20,
        tracks 24, path_bytes 28, work_per_byte 32, reserved 36
    }
    Frame 40 { tick 0, number 8, transforms 12, items 16 }
    EventInfo 80 {
        kind 0, group 4, digest 8, has_digest 16, tracks_added 20, record_type 24, stored_bytes 28,
        ticks 32, seconds 36, frame 40
    }
    ErrorInfo 64 {
        id 0, layer 4, class_ 8, limit 12, offset 16, asked 24, allowed 32, found 40, has_found 48,
        track 52, has_track 56, reserved 60
    }
    Grid 96 {
        grid_from_mesh 0, dims 48, cell_edge 60, radius 64, position_bits 68, normal_bits 72,
        ao_bits 76, bucket_count 80, cell_capacity 84, first_bucket 88, first_cell 92
    }
    Volume 112 {
        grid_from_mesh 0, dims 48, spacing 60, exponent 72, visibility_side 76, visibility_range 80,
        luma_steps 84, chroma_steps 96, visibility_steps 108
    }
    Signals 24 { count 0, kinds 4, distances 12, share 20 }
    Vertices 40 { signals 0, count 24, bits 28, order 32, first_value 36 }
    Instances 36 { signals 0, count 24, exponent 28, step 32 }
    Regions 40 { signals 0, count 24, capacity 28, exponent 32, step 36 }
    Parameters 112 { points 0, probes 0, vertices 0, instances 0, regions 0 }
    Probe 56 { level 0, codes 2 }
}

#[cfg(target_pointer_width = "64")]
layout! {
    Array 40 { data 0, size 8, element_size 16, dirty 24, dirty_count 32 }
    Track 240 {
        application_id 0, content_hash 8, id 16, model 20, coding 24, space 28, has_content_hash 32,
        has_transform 36, aabb_min 40, aabb_max 52, world_from_grid 64, parameters 112, path 224,
        path_size 232
    }
}

// `embed/js/dapple.js` has these.
#[cfg(target_pointer_width = "32")]
layout! {
    Array 20 { data 0, size 4, element_size 8, dirty 12, dirty_count 16 }
    Track 232 {
        application_id 0, content_hash 8, id 16, model 20, coding 24, space 28, has_content_hash 32,
        has_transform 36, aabb_min 40, aabb_max 52, world_from_grid 64, parameters 112, path 224,
        path_size 228
    }
}

#[cfg(feature = "encode")]
layout! {
    EncoderConfig 48 { limits 0, ticks 40, seconds 44 }
    Transform 52 { track 0, world_from_grid 4 }
    InstanceEntry 32 { key 0, linear 8, reserved 12, codes 16 }
    Region 48 { min 0, first 12, max 16, form 28, centre 32, reserved 44 }
}

#[cfg(all(feature = "encode", target_pointer_width = "64"))]
layout! {
    PointsUpdate 56 {
        track 0, reserved 4, bucket_indices 8, buckets 16, bucket_count 24, cell_indices 32,
        cells 40, cell_count 48
    }
    ProbesUpdate 48 {
        track 0, reserved 4, base 8, probes 16, count 24, visibility 32, visibility_size 40
    }
    VerticesUpdate 24 { track 0, reserved 4, codes 8, count 16 }
    InstancesUpdate 24 { track 0, reserved 4, entries 8, count 16 }
    RegionsUpdate 40 { track 0, reserved 4, regions 8, region_count 16, pairs 24, pair_count 32 }
}
