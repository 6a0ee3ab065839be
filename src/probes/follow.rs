//! Which visibility maps have to be measured again: those of probes that something has moved near.

use super::server::Server;
use crate::trace::Aabb;
use crate::world::World;

/// Maps that are out of date, and where what may move was when they were last looked at.
#[derive(Clone, Debug)]
pub struct Follower {
    /// By instance.
    boxes: Vec<Aabb>,
    /// By probe.
    stale: Vec<bool>,
    /// The probe whose turn it is.
    next: usize,
}

impl Follower {
    /// All maps are up to date.
    pub fn new(world: &World, probes: usize) -> Follower {
        let instances = 0..world.scene().instances.len();
        Follower {
            boxes: instances.map(|i| world.tracer().bounds(i)).collect(),
            stale: vec![false; probes],
            next: 0,
        }
    }

    /// Takes in what has moved, and returns up to `most` probes whose maps are to be measured, each in
    /// its turn.
    pub fn take(&mut self, world: &World, server: &Server, most: usize) -> Vec<usize> {
        let boxes = self.boxes.iter_mut().enumerate();
        for (instance, before) in boxes.filter(|(i, _)| world.scene().can_move(*i)) {
            let now = world.tracer().bounds(instance);
            let same = now.min == before.min && now.max == before.max;
            // What turns in its box is among the movers.
            if same && world.movers().binary_search(&instance).is_err() {
                continue;
            }
            for (probe, stale) in self.stale.iter_mut().enumerate() {
                *stale |= is_near(server, probe, before) || is_near(server, probe, &now);
            }
            *before = now;
        }
        let count = self.stale.len();
        let turn = (0..count).map(|step| (self.next + step) % count);
        let taken: Vec<usize> = turn.filter(|&probe| self.stale[probe]).take(most).collect();
        taken.iter().for_each(|&probe| self.stale[probe] = false);
        self.next = taken.last().map_or(self.next, |last| last + 1);
        taken
    }
}

/// Whether a box is within the distances that a probe's map holds: the cells around the probe, or the
/// range where it stands on the boundary of the grid.
fn is_near(server: &Server, probe: usize, of: &Aabb) -> bool {
    let volume = server.volume();
    let (lattice, position) = (&volume.lattice, volume.position(probe));
    let place = lattice.place(probe);
    (0..3).all(|axis| {
        let last = u32::from(lattice.dims[axis].max(1)) - 1;
        let inside = place[axis] > 0 && place[axis] < last;
        let reach = match inside {
            // The cell, and the offset from a surface.
            true => 1.25 * lattice.spacing[axis],
            false => server.range(),
        };
        of.min[axis] <= position[axis] + reach && of.max[axis] >= position[axis] - reach
    })
}
