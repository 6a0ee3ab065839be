/* Sizes and offsets of all structs, as src/layout.rs has them on the other side. It compiles, or a struct has
 * changed: then DAPPLE_ABI_VERSION has to. */
#include <assert.h>
#include <stdint.h>

#include "dapple.h"

#define SIZE(type, size) static_assert(sizeof(type) == (size), #type)
#define AT(type, field, offset) static_assert(offsetof(type, field) == (offset), #type "." #field)

SIZE(dapple_dirty_range, 16);
AT(dapple_dirty_range, buffer, 0);
AT(dapple_dirty_range, track, 4);
AT(dapple_dirty_range, start, 8);
AT(dapple_dirty_range, end, 12);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_array, 40);
AT(dapple_array, data, 0);
AT(dapple_array, size, 8);
AT(dapple_array, element_size, 16);
AT(dapple_array, dirty, 24);
AT(dapple_array, dirty_count, 32);
#endif

SIZE(dapple_limits, 40);
AT(dapple_limits, state_bytes, 0);
AT(dapple_limits, stored_bytes, 8);
AT(dapple_limits, unpacked_bytes, 12);
AT(dapple_limits, frame_bytes, 16);
AT(dapple_limits, zstd_window_bytes, 20);
AT(dapple_limits, tracks, 24);
AT(dapple_limits, path_bytes, 28);
AT(dapple_limits, work_per_byte, 32);
AT(dapple_limits, reserved, 36);

SIZE(dapple_frame, 40);
AT(dapple_frame, tick, 0);
AT(dapple_frame, number, 8);
AT(dapple_frame, transforms, 12);
AT(dapple_frame, items, 16);

SIZE(dapple_event_info, 80);
AT(dapple_event_info, kind, 0);
AT(dapple_event_info, group, 4);
AT(dapple_event_info, digest, 8);
AT(dapple_event_info, has_digest, 16);
AT(dapple_event_info, tracks_added, 20);
AT(dapple_event_info, record_type, 24);
AT(dapple_event_info, stored_bytes, 28);
AT(dapple_event_info, ticks, 32);
AT(dapple_event_info, seconds, 36);
AT(dapple_event_info, frame, 40);

SIZE(dapple_error, 64);
AT(dapple_error, id, 0);
AT(dapple_error, layer, 4);
AT(dapple_error, class_, 8);
AT(dapple_error, limit, 12);
AT(dapple_error, offset, 16);
AT(dapple_error, asked, 24);
AT(dapple_error, allowed, 32);
AT(dapple_error, found, 40);
AT(dapple_error, has_found, 48);
AT(dapple_error, track, 52);
AT(dapple_error, has_track, 56);
AT(dapple_error, reserved, 60);

SIZE(dapple_encoder_config, 48);
AT(dapple_encoder_config, limits, 0);
AT(dapple_encoder_config, ticks, 40);
AT(dapple_encoder_config, seconds, 44);

SIZE(dapple_grid, 96);
AT(dapple_grid, grid_from_mesh, 0);
AT(dapple_grid, dims, 48);
AT(dapple_grid, cell_edge, 60);
AT(dapple_grid, radius, 64);
AT(dapple_grid, position_bits, 68);
AT(dapple_grid, normal_bits, 72);
AT(dapple_grid, ao_bits, 76);
AT(dapple_grid, bucket_count, 80);
AT(dapple_grid, cell_capacity, 84);
AT(dapple_grid, first_bucket, 88);
AT(dapple_grid, first_cell, 92);

SIZE(dapple_volume, 112);
AT(dapple_volume, grid_from_mesh, 0);
AT(dapple_volume, dims, 48);
AT(dapple_volume, spacing, 60);
AT(dapple_volume, exponent, 72);
AT(dapple_volume, visibility_side, 76);
AT(dapple_volume, visibility_range, 80);
AT(dapple_volume, luma_steps, 84);
AT(dapple_volume, chroma_steps, 96);
AT(dapple_volume, visibility_steps, 108);

SIZE(dapple_signals, 24);
AT(dapple_signals, count, 0);
AT(dapple_signals, kinds, 4);
AT(dapple_signals, distances, 12);
AT(dapple_signals, share, 20);

SIZE(dapple_vertices, 40);
AT(dapple_vertices, signals, 0);
AT(dapple_vertices, count, 24);
AT(dapple_vertices, bits, 28);
AT(dapple_vertices, order, 32);
AT(dapple_vertices, first_value, 36);

SIZE(dapple_instances, 36);
AT(dapple_instances, signals, 0);
AT(dapple_instances, count, 24);
AT(dapple_instances, exponent, 28);
AT(dapple_instances, step, 32);

SIZE(dapple_regions, 40);
AT(dapple_regions, signals, 0);
AT(dapple_regions, count, 24);
AT(dapple_regions, capacity, 28);
AT(dapple_regions, exponent, 32);
AT(dapple_regions, step, 36);

SIZE(dapple_parameters, 112);
AT(dapple_parameters, points, 0);
AT(dapple_parameters, probes, 0);
AT(dapple_parameters, vertices, 0);
AT(dapple_parameters, instances, 0);
AT(dapple_parameters, regions, 0);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_track, 240);
AT(dapple_track, application_id, 0);
AT(dapple_track, content_hash, 8);
AT(dapple_track, id, 16);
AT(dapple_track, model, 20);
AT(dapple_track, coding, 24);
AT(dapple_track, space, 28);
AT(dapple_track, has_content_hash, 32);
AT(dapple_track, has_transform, 36);
AT(dapple_track, aabb_min, 40);
AT(dapple_track, aabb_max, 52);
AT(dapple_track, world_from_grid, 64);
AT(dapple_track, parameters, 112);
AT(dapple_track, path, 224);
AT(dapple_track, path_size, 232);
#endif

SIZE(dapple_transform, 52);
AT(dapple_transform, track, 0);
AT(dapple_transform, world_from_grid, 4);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_points_update, 56);
AT(dapple_points_update, track, 0);
AT(dapple_points_update, reserved, 4);
AT(dapple_points_update, bucket_indices, 8);
AT(dapple_points_update, buckets, 16);
AT(dapple_points_update, bucket_count, 24);
AT(dapple_points_update, cell_indices, 32);
AT(dapple_points_update, cells, 40);
AT(dapple_points_update, cell_count, 48);
#endif

SIZE(dapple_probe, 56);
AT(dapple_probe, level, 0);
AT(dapple_probe, codes, 2);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_probes_update, 48);
AT(dapple_probes_update, track, 0);
AT(dapple_probes_update, reserved, 4);
AT(dapple_probes_update, base, 8);
AT(dapple_probes_update, probes, 16);
AT(dapple_probes_update, count, 24);
AT(dapple_probes_update, visibility, 32);
AT(dapple_probes_update, visibility_size, 40);
#endif

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_vertices_update, 24);
AT(dapple_vertices_update, track, 0);
AT(dapple_vertices_update, reserved, 4);
AT(dapple_vertices_update, codes, 8);
AT(dapple_vertices_update, count, 16);
#endif

SIZE(dapple_instance_entry, 32);
AT(dapple_instance_entry, key, 0);
AT(dapple_instance_entry, linear, 8);
AT(dapple_instance_entry, reserved, 12);
AT(dapple_instance_entry, codes, 16);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_instances_update, 24);
AT(dapple_instances_update, track, 0);
AT(dapple_instances_update, reserved, 4);
AT(dapple_instances_update, entries, 8);
AT(dapple_instances_update, count, 16);
#endif

SIZE(dapple_region, 48);
AT(dapple_region, min, 0);
AT(dapple_region, first, 12);
AT(dapple_region, max, 16);
AT(dapple_region, form, 28);
AT(dapple_region, centre, 32);
AT(dapple_region, reserved, 44);

#if UINTPTR_MAX == UINT64_MAX
SIZE(dapple_regions_update, 40);
AT(dapple_regions_update, track, 0);
AT(dapple_regions_update, reserved, 4);
AT(dapple_regions_update, regions, 8);
AT(dapple_regions_update, region_count, 16);
AT(dapple_regions_update, pairs, 24);
AT(dapple_regions_update, pair_count, 32);
#endif

int main(void) { return 0; }
