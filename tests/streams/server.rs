//! A server that writes streams of any length.

use dapple::codec::points::{Bucket, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, Update};
use dapple::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, Target, Track,
};

use super::{cell, grid};

/// A server with one track of 512 cells, whose bytes can be taken away as they come.
pub struct Server {
    pub encoder: Encoder,
    grid: Grid,
    pub bytes: Vec<u8>,
}

impl Server {
    pub fn new() -> Server {
        let mut bytes = Vec::new();
        let encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("encoder");
        let grid = Grid {
            dims: [16, 16, 16],
            bucket_count: 1031,
            cell_capacity: 512,
            coding: Coding::Cells,
            ..grid(PointWidths::BITS_32)
        };
        Server {
            encoder,
            grid,
            bytes,
        }
    }

    /// Declares a track, within a group.
    pub fn declare(&mut self, id: u32) {
        let track = Track {
            id,
            target: Target::default(),
            aabb_min: [0.0; 3],
            aabb_max: [8.0; 3],
            space: LookupSpace::Mesh,
            model: Model::Points(self.grid),
        };
        let declared = self.encoder.tracks(&mut self.bytes, &[track]);
        declared.expect("tracks");
    }

    /// A frame of track 1: a keyframe, which starts a group, or a change of its first `cells`.
    pub fn frame(&mut self, number: u64, keyframe: bool, cells: u32) {
        if keyframe {
            let group = self.encoder.group(&mut self.bytes, GroupStart::Keyframes);
            group.expect("group");
            self.declare(1);
        }
        let content: Vec<Cell> = (0..cells)
            .map(|key| {
                let ao = ((u64::from(key) + number) % 256) as f32 / 255.0;
                cell(&self.grid, self.grid.cell_of(key), 7, ao).1
            })
            .collect();
        let mut buckets = vec![Bucket::EMPTY; self.grid.bucket_count as usize];
        for (key, cell) in content.iter().enumerate().filter(|_| keyframe) {
            let entries = &mut buckets[self.grid.bucket_of_key(cell.key) as usize].0;
            let free = entries.iter().position(|&entry| entry == EMPTY);
            entries[free.expect("no bucket overflows")] = key as u32;
        }
        let indices: Vec<u32> = (0..self.grid.bucket_count).collect();
        let update = Update {
            track: 1,
            bucket_indices: if keyframe { &indices } else { &[] },
            buckets: if keyframe { &buckets } else { &[] },
            cell_indices: &indices[..cells as usize],
            cells: &content,
        };
        let coverage = if keyframe {
            Coverage::Keyframe
        } else {
            Coverage::Delta
        };
        self.encoder
            .points(&mut self.bytes, coverage, &[update], Compression::None)
            .expect("points");
        self.commit(number);
    }

    pub fn commit(&mut self, number: u64) {
        let commit = self.encoder.commit(&mut self.bytes, number, None);
        commit.expect("commit");
    }
}
