//! Specular-glossiness to metallic-roughness, as Khronos's own converter does it
//! (`KHR_materials_pbrSpecularGlossiness`, examples/convert-between-workflows).

use glam::Vec3;

/// Reflectance of dielectrics.
const DIELECTRIC: f32 = 0.04;
const EPSILON: f32 = 1e-6;

/// Base colour and metallic of a diffuse and a specular colour; all linear.
pub(super) fn metallic(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let rest = 1.0 - specular.max_element();
    let metallic = solve_metallic(brightness(diffuse), brightness(specular), rest);
    let of_diffuse = diffuse * (rest / (1.0 - DIELECTRIC) / (1.0 - metallic).max(EPSILON));
    let of_specular =
        (specular - Vec3::splat(DIELECTRIC * (1.0 - metallic))) / metallic.max(EPSILON);
    let base = of_diffuse.lerp(of_specular, metallic * metallic);
    (base.clamp(Vec3::ZERO, Vec3::ONE), metallic)
}

fn brightness(c: Vec3) -> f32 {
    (c * c).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt()
}

/// The root of `DIELECTRIC m^2 + b m + c`, which equates both workflows.
fn solve_metallic(diffuse: f32, specular: f32, rest: f32) -> f32 {
    if specular < DIELECTRIC {
        return 0.0;
    }
    let b = diffuse * rest / (1.0 - DIELECTRIC) + specular - 2.0 * DIELECTRIC;
    let c = DIELECTRIC - specular;
    let root = (b * b - 4.0 * DIELECTRIC * c).max(0.0).sqrt();
    ((root - b) / (2.0 * DIELECTRIC)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectrics_and_metals_come_back() {
        let red = Vec3::new(0.5, 0.1, 0.1);
        let (base, m) = metallic(red, Vec3::splat(DIELECTRIC));
        assert!(m < 1e-3 && base.abs_diff_eq(red, 1e-3), "{base} {m}");
        let gold = Vec3::new(1.0, 0.8, 0.3);
        let (base, m) = metallic(Vec3::ZERO, gold);
        assert!(m > 0.999 && base.abs_diff_eq(gold, 1e-3), "{base} {m}");
        assert_eq!(metallic(red, Vec3::ZERO).1, 0.0);
    }
}
