//! Which points stand for nothing that can be seen.
//!
//! A point's AO is used for fragments up to the interpolation radius r away. Under a decal, between
//! the shells of a double wall or inside closed geometry, points are dark because of a surface that hides
//! them from view, and they darken the open surface beside. Three signs tell them:
//!
//! - no ray leaves: the AO is below [`Options::min_ao`];
//! - almost all rays end within [`SHELL`] r;
//! - most rays end within [`LAYER`] r. Beside a wall only half of them do.
//!
//! Such points are left out for as long as they show one of these signs. One that was left out comes
//! back once it is clear of the limits by a margin, so that it does not flicker.

use super::Options;

/// Default of [`Options::min_ao`].
pub const MIN_AO: u8 = 1;
/// Length of rays in interpolation radii, and the least share of them that is free.
const SHELL: (f32, f32) = (2.0, 12.0 / 255.0);
const LAYER: (f32, f32) = (0.25, 0.4);
/// Factor on the least shares for points that were left out.
const MARGIN: f32 = 1.25;

/// What a point's rays say: the shares that are free over the AO distance (the AO), within [`SHELL`]
/// and within [`LAYER`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Openness {
    pub(super) ao: f32,
    shell: f32,
    layer: f32,
}

impl Openness {
    /// A point of a given AO that nothing hides.
    pub(super) fn open(ao: f32) -> Openness {
        Openness {
            ao,
            shell: 1.0,
            layer: 1.0,
        }
    }

    /// `ao(distance)` traces the point.
    pub(super) fn trace(
        options: &Options,
        radius: f32,
        mut ao: impl FnMut(f32) -> f32,
    ) -> Openness {
        let far = ao(options.distance);
        // A ray that is free is free near by as well, so open points need no other rays.
        let mut within = |(radii, least): (f32, f32)| {
            let distance = radii * radius;
            let asked = options.min_ao > 0 && far < least * MARGIN && distance < options.distance;
            if asked {
                ao(distance)
            } else {
                far.max(least * MARGIN)
            }
        };
        Openness {
            ao: far,
            shell: within(SHELL),
            layer: within(LAYER),
        }
    }

    /// Whether the point is to be left out, given whether it was.
    pub(super) fn is_hidden(&self, options: &Options, was_hidden: bool) -> bool {
        let margin = if was_hidden { MARGIN } else { 1.0 };
        let least = (f32::from(options.min_ao) - 0.5) / 255.0;
        options.min_ao > 0
            && (self.ao < least * margin
                || self.shell < SHELL.1 * margin
                || self.layer < LAYER.1 * margin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_near_a_limit_do_not_flicker() {
        let options = Options::default();
        let at = |layer| Openness {
            ao: 0.3,
            shell: 0.3,
            layer,
        };
        let mut hidden = false;
        let shown = [0.6, 0.41, 0.39, 0.41, 0.45, 0.51, 0.45].map(|layer| {
            hidden = at(layer).is_hidden(&options, hidden);
            !hidden
        });
        assert_eq!(shown, [true, true, false, false, false, true, true]);
        let all = Options {
            min_ao: 0,
            ..options
        };
        assert!(!at(0.0).is_hidden(&all, true));
    }
}
