use super::*;
use crate::codec::probes::f32_from_f16;
use crate::points::sample::tests::Random;
use crate::probes::lattice::Lattice;
use crate::probes::visibility::Visibility;
use glam::Affine3A;

/// A made-up volume that owns its arrays.
pub struct MadeUp {
    pub lattice: Lattice,
    pub grid_from_world: Affine3A,
    pub exponent: i8,
    pub texels: Vec<Texel>,
    pub present: Vec<bool>,
    pub side: u32,
    pub range: f32,
    pub blocks: Vec<[u8; 2]>,
}

impl MadeUp {
    /// Random light of about radiance 1 in all directions, no two probes alike.
    pub fn new(seed: u32, dims: [u16; 3], spacing: Vec3, grid_from_world: Affine3A) -> MadeUp {
        let mut random = Random::new(seed);
        let lattice = Lattice { dims, spacing };
        let count = lattice.count();
        let mut expansion = || {
            let mut c: L2 = std::array::from_fn(|_| random.vec() * 2.0 - 1.0);
            c[0] = c[0].abs() * 2.0 + 2.0;
            c
        };
        let radiance: Vec<L2> = (0..count).map(|_| expansion()).collect();
        let side = 8;
        let code = |r: &mut Random| (r.unit() * 256.0) as u8;
        MadeUp {
            lattice,
            grid_from_world,
            exponent: -3,
            texels: texels(&radiance, -3),
            present: (0..count).map(|i| i % 7 != 3).collect(),
            side,
            range: 4.0,
            blocks: (0..count * 64)
                .map(|_| [code(&mut random), code(&mut random) / 4])
                .collect(),
        }
    }

    pub fn volume(&self, visibility: bool) -> ProbesVolume<'_> {
        ProbesVolume::from_parts(
            self.lattice,
            self.grid_from_world,
            self.exponent,
            &self.texels,
            &self.present,
            visibility.then_some(Visibility {
                side: self.side,
                range: self.range,
                texels: &self.blocks,
            }),
        )
    }
}

#[test]
fn texels_hold_what_was_put_into_them() {
    let mut random = Random::new(1);
    let radiance: Vec<L2> = (0..6)
        .map(|_| std::array::from_fn(|_| (random.vec() - 0.3) * 1e5))
        .collect();
    let exponent = exponent(&radiance);
    assert!((1..=3).contains(&exponent), "{exponent}");
    let texels = texels(&radiance, exponent);
    assert!(
        (0..6).all(|p| texels[6 * 6 + p][3] == 0),
        "the 28th is spare"
    );
    let lattice = Lattice {
        dims: [3, 2, 1],
        spacing: Vec3::ONE,
    };
    let present = vec![true; 6];
    let volume = ProbesVolume::from_parts(
        lattice,
        Affine3A::IDENTITY,
        exponent,
        &texels,
        present,
        None,
    );
    volume.check().unwrap();
    for (a, b) in radiance
        .iter()
        .flatten()
        .zip(volume.radiance().iter().flatten())
    {
        assert!((*a - *b).abs().max_element() <= a.abs().max_element() / 2048.0);
    }
    // The planes' order, by hand: value 13, green of coefficient 4, of probe 2.
    let value = f32_from_f16(texels[3 * 6 + 2][1]) * volume.scale();
    assert_eq!(value, volume.radiance()[2][4].y);
}

#[test]
fn what_is_missing_is_an_error() {
    let whole = MadeUp::new(4, [3, 2, 2], Vec3::ONE, Affine3A::IDENTITY);
    whole.volume(true).check().unwrap();
    let made = || MadeUp::new(4, [3, 2, 2], Vec3::ONE, Affine3A::IDENTITY);
    let [mut few, mut unmarked, mut blind, mut none] = [made(), made(), made(), made()];
    few.texels.pop();
    unmarked.present.pop();
    blind.blocks.truncate(64);
    none.lattice.dims = [0, 2, 2];
    for (volume, word) in [
        (few, "texels"),
        (unmarked, "presence"),
        (blind, "visibility"),
        (none, "probe"),
    ] {
        let error = volume.volume(true).check().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_place_is_lit_by_the_volume_that_holds_it_or_the_nearest() {
    let shifted = |x: f32| Affine3A::from_translation(Vec3::new(-x, 0.0, 0.0));
    let made = [0.0, 1.5, 9.0].map(|x| MadeUp::new(1, [3, 2, 2], Vec3::ONE, shifted(x)));
    let volumes = made.each_ref().map(|m| m.volume(false));
    let at = |x: f32| volume_at(&volumes, Vec3::new(x, 0.5, 0.5));
    assert_eq!(at(1.0), Some(0));
    assert_eq!(at(1.8), Some(0), "the first of two that hold it");
    assert_eq!(at(2.5), Some(1));
    assert_eq!((at(4.0), at(8.0), at(99.0)), (Some(1), Some(2), Some(2)));
    assert_eq!(volume_at(&[], Vec3::ZERO), None);
}
