//! Lines of `points` in dumps (`spec/dump.md`).

use std::fmt::Write as _;

use dapple_codec::TrackState;
use dapple_codec::points::{EMPTY, Grid, State};

use crate::text::floats;

/// The line of the parameters.
pub fn parameters(id: u32, grid: &Grid, out: &mut String) {
    let [dx, dy, dz] = grid.dims;
    let widths = grid.widths;
    let _ = write!(
        out,
        "grid {id} {dx} {dy} {dz} {} {} {},{},{}",
        grid.bucket_count, grid.cell_capacity, widths.position, widths.normal, widths.ao
    );
    floats(&[grid.cell_edge, grid.radius], out);
    floats(grid.grid_from_mesh.as_flattened(), out);
    out.push('\n');
}

/// Each bucket that names a cell, with the cells in its order.
pub fn buckets(state: &State, live: &TrackState, grid: &Grid, out: &mut String) {
    let digits = grid.widths.bits() as usize / 4;
    for (index, bucket) in state.buckets_of(live).iter().enumerate() {
        if bucket.0[0] == EMPTY {
            continue;
        }
        let _ = write!(out, "bucket {} {index}", live.track.id);
        for cell in state.cells_in(live, bucket) {
            let _ = write!(out, " {}:", cell.key);
            let used = cell.points.iter().take_while(|&&point| point != 0);
            for (slot, point) in used.enumerate() {
                let comma = if slot > 0 { "," } else { "" };
                let _ = write!(out, "{comma}{point:0digits$x}");
            }
        }
        out.push('\n');
    }
}
