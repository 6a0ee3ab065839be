// Accessors of `regions.wgsl` by storage buffers. The binding numbers are yours to change.

// The decoder's regions of a track, and their pairs of signed values of 16 bits.
@group(1) @binding(56) var<storage, read> dapple_regions_regions: array<DappleRegionsRegion>;
@group(1) @binding(57) var<storage, read> dapple_regions_pairs: array<u32>;

fn dapple_regions_count() -> u32 {
    return arrayLength(&dapple_regions_regions);
}

fn dapple_regions_region(index: u32) -> DappleRegionsRegion {
    return dapple_regions_regions[index];
}

fn dapple_regions_pair(index: u32) -> u32 {
    return dapple_regions_pairs[index];
}
