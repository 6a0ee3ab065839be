//! What a `regions` track adds to the state digest (`spec/regions.md` §9).

use bytemuck::cast_slice;

use super::{Pair, Region};
use crate::session::digest::StateDigest;
use crate::session::transforms::Transform;

impl StateDigest {
    /// Adds a `regions` track: its id, its last transform, its regions and their pairs.
    pub fn regions(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        regions: &[Region],
        pairs: &[Pair],
    ) {
        self.header(id, transform);
        self.regions_content(regions, pairs);
    }

    pub(super) fn regions_content(&mut self, regions: &[Region], pairs: &[Pair]) {
        self.word(regions.len() as u32);
        for region in regions {
            self.bytes(&region.bytes());
            let first = region.first as usize;
            let count = region.form().map_or(0, |form| form.pairs());
            let pairs = pairs.get(first..first + count).unwrap_or(&[]);
            if cfg!(target_endian = "little") {
                self.bytes(cast_slice(pairs));
            } else {
                let values = pairs.as_flattened().iter();
                values.for_each(|value| self.bytes(&value.to_le_bytes()));
            }
        }
    }
}
