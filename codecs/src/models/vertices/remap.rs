//! Distinct vertices of a mesh (`spec/vertices.md` §2).

use alloc::vec::Vec;

/// For each vertex of a mesh in file order the index of its distinct vertex: vertices whose positions
/// and normals are the same in all bits are one, and they are numbered in the order of their first
/// appearance.
///
/// It turns the values of a track in [`super::Vertices::DISTINCT_ORDER`] into those of a mesh: vertex i has the
/// values of distinct vertex `remap[i]`. An importer that welds or reorders keeps for each of its
/// vertices one that it came from, and looks that up.
///
/// `normals` is empty, or as long as `positions`; what is missing counts as 0.
pub fn remap(positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<u32> {
    let bits = |vector: [f32; 3]| vector.map(f32::to_bits);
    let key = |vertex: u32| {
        let normal = normals.get(vertex as usize).copied().unwrap_or_default();
        (bits(positions[vertex as usize]), bits(normal))
    };
    let mut sorted: Vec<u32> = (0..positions.len() as u32).collect();
    sorted.sort_unstable_by_key(|&vertex| (key(vertex), vertex));
    // The first of each group of equal vertices, then the numbers of those.
    let mut remap: Vec<u32> = (0..positions.len() as u32).collect();
    for pair in 1..sorted.len() {
        let (before, now) = (sorted[pair - 1], sorted[pair]);
        if key(before) == key(now) {
            remap[now as usize] = remap[before as usize];
        }
    }
    let mut count = 0;
    for vertex in 0..remap.len() {
        let first = remap[vertex] as usize;
        remap[vertex] = match first == vertex {
            true => {
                count += 1;
                count - 1
            }
            // Numbered already.
            false => remap[first],
        };
    }
    remap
}
