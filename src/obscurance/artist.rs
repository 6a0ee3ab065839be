//! How the distances of a bake become the one value that a picture shows (section 3).

use crate::{Error, Result};

/// Weights of the long and the short distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Share of the long distance in 0..=1; the short one has the rest.
    pub long: f32,
}

impl Default for Blend {
    /// 97 % long, 3 % short.
    fn default() -> Self {
        Blend { long: 0.97 }
    }
}

impl Blend {
    pub fn apply(self, short: f32, long: f32) -> f32 {
        short + (long - short) * self.long
    }

    /// # Errors
    /// `Invalid` for a share outside 0..=1.
    pub fn check(self) -> Result<()> {
        if (0.0..=1.0).contains(&self.long) {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "the share of the long distance is {}; it must be between 0 and 1",
            self.long
        )))
    }
}

/// A curve from obscurance to obscurance, by which an artist sets contrast: straight between its
/// knots, constant before the first and after the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Remap {
    knots: Vec<[f32; 2]>,
}

impl Default for Remap {
    /// The curve that changes nothing.
    fn default() -> Self {
        Remap {
            knots: vec![[0.0, 0.0], [1.0, 1.0]],
        }
    }
}

impl Remap {
    /// Of knots (input, output).
    ///
    /// # Errors
    /// `Invalid` where there is no knot, a number lies outside 0..=1, or inputs do not ascend.
    pub fn new(knots: &[[f32; 2]]) -> Result<Remap> {
        let within = knots.iter().flatten().all(|x| (0.0..=1.0).contains(x));
        let ascend = knots.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        if knots.is_empty() || !within || !ascend {
            return Err(Error::Invalid(
                "a remap curve needs knots between 0 and 1 whose inputs ascend".into(),
            ));
        }
        Ok(Remap {
            knots: knots.to_vec(),
        })
    }

    /// The curve at `x`, in 0..=1.
    pub fn apply(&self, x: f32) -> f32 {
        let after = self.knots.partition_point(|knot| knot[0] <= x);
        match (self.knots[..after].last(), self.knots.get(after)) {
            (Some(&[x0, y0]), Some(&[x1, y1])) => {
                let t = (x - x0) / (x1 - x0);
                (y0 * (1.0 - t) + y1 * t).clamp(0.0, 1.0)
            }
            (Some(&[_, y]), None) | (None, Some(&[_, y])) => y,
            (None, None) => x,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_blend_is_nearly_all_long() {
        let blend = Blend::default();
        assert!((blend.apply(0.2, 0.8) - (0.97 * 0.8 + 0.03 * 0.2)).abs() < 1e-6);
        assert_eq!(blend.apply(0.3, 0.3), 0.3);
        assert!(Blend { long: 1.1 }.check().is_err());
        assert!(Blend { long: f32::NAN }.check().is_err());
    }

    #[test]
    fn default_remap_changes_nothing() {
        let remap = Remap::default();
        for i in 0..=256 {
            let x = i as f32 / 256.0;
            assert_eq!(remap.apply(x), x);
        }
    }

    #[test]
    fn remap_is_straight_between_knots_and_constant_outside() {
        let remap = Remap::new(&[[0.2, 0.1], [0.4, 0.9], [0.8, 0.5]]).expect("a sound curve");
        for (x, y) in [
            (0.0, 0.1),
            (0.2, 0.1),
            (0.3, 0.5),
            (0.6, 0.7),
            (0.8, 0.5),
            (1.0, 0.5),
        ] {
            assert!((remap.apply(x) - y).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn unsound_curves_are_refused() {
        for knots in [
            &[][..],
            &[[0.0, 0.0], [0.0, 1.0]],
            &[[0.5, 0.0], [0.2, 1.0]],
            &[[0.0, 1.5]],
            &[[f32::NAN, 0.0]],
        ] {
            assert!(Remap::new(knots).is_err(), "{knots:?}");
        }
    }
}
