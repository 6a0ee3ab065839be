//! From the distance of the closest blocker to visibility.

use crate::{Error, Result};

/// Half-distances after which an exponential kernel is 1 in `f32`: 2^-25 is half its spacing there.
const HALVINGS: f32 = 25.0;

/// The visibility that remains with a blocker at some distance: 0 at the point itself, 1 for none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// `rho(x) = 1 - exp(ln(0.5) / d * x)`, with the half-distance d in metres: a blocker at d halves
    /// visibility (Eq. 1).
    Exponential { half_distance: f32 },
    /// Ambient occlusion: 0 up to a distance in metres, 1 beyond.
    CutOff { distance: f32 },
}

impl Kernel {
    /// Visibility in 0..=1 with the closest blocker at `distance` metres, which is infinite where
    /// there is none.
    pub fn visibility(self, distance: f32) -> f32 {
        match self {
            // 1 - 2^-x by way of expm1, which keeps the digits of near blockers.
            Kernel::Exponential { half_distance } => {
                -(-std::f32::consts::LN_2 * (distance / half_distance)).exp_m1()
            }
            Kernel::CutOff { distance: cut_off } => f32::from(u8::from(distance > cut_off)),
        }
    }

    /// Metres beyond which a blocker makes no difference.
    pub fn reach(self) -> f32 {
        match self {
            Kernel::Exponential { half_distance } => HALVINGS * half_distance,
            Kernel::CutOff { distance } => distance,
        }
    }

    /// # Errors
    /// `Invalid` for a distance that is not a positive number of metres with a finite reach.
    pub fn check(self) -> Result<()> {
        let reach = self.reach();
        if reach > 0.0 && reach.is_finite() {
            return Ok(());
        }
        let (Kernel::Exponential {
            half_distance: distance,
        }
        | Kernel::CutOff { distance }) = self;
        Err(Error::Invalid(format!(
            "a distance of obscurance is {distance} m; it must be a positive number of metres"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blockers_at_the_half_distance_halve_visibility() {
        for half_distance in [0.01, 2.0, 300.0] {
            let kernel = Kernel::Exponential { half_distance };
            for halvings in 0..8 {
                let x = half_distance * halvings as f32;
                let expected = 1.0 - 0.5f32.powi(halvings);
                assert!((kernel.visibility(x) - expected).abs() < 1e-6);
            }
            assert_eq!(kernel.visibility(f32::INFINITY), 1.0);
            assert_eq!(kernel.visibility(kernel.reach()), 1.0);
            assert!(kernel.visibility(0.9 * kernel.reach()) < 1.0);
        }
    }

    #[test]
    fn near_blockers_keep_their_digits() {
        let kernel = Kernel::Exponential {
            half_distance: 300.0,
        };
        let expected = std::f64::consts::LN_2 * 1e-6 / 300.0;
        let got = f64::from(kernel.visibility(1e-6));
        assert!((got / expected - 1.0).abs() < 1e-6, "{got:e}");
    }

    #[test]
    fn cut_off_includes_its_distance() {
        let kernel = Kernel::CutOff { distance: 0.5 };
        assert_eq!(kernel.visibility(0.5), 0.0);
        assert_eq!(kernel.visibility(0.500_001), 1.0);
        assert_eq!(kernel.visibility(f32::INFINITY), 1.0);
    }

    #[test]
    fn distances_that_are_none_are_refused() {
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, 2e37] {
            let exponential = Kernel::Exponential { half_distance: bad };
            assert!(exponential.check().is_err(), "{bad}");
        }
        assert!(Kernel::CutOff { distance: 0.0 }.check().is_err());
        assert!(Kernel::CutOff { distance: 1.0 }.check().is_ok());
    }
}
