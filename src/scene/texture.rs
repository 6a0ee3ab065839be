//! Texture sampling on the CPU.
//!
//! Colours and normals are sampled bilinearly on the largest level; alpha masks by the nearest
//! texel, so that a ray and a rasteriser agree on what is a hole without filtering it.

use super::{Alpha, Material, Mesh, Scene, Texture, TextureRef, Wrap};
use glam::{Vec2, Vec3, Vec4};
use std::sync::LazyLock;

/// Linear value of each 8-bit sRGB code (IEC 61966-2-1).
static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let c = i as f64 / 255.0;
        let linear = if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        };
        linear as f32
    })
});

/// Decodes one 8-bit sRGB code to a linear value in 0..=1.
pub fn srgb_to_linear(code: u8) -> f32 {
    SRGB[usize::from(code)]
}

/// A texel index inside `0..size`.
fn wrap(index: i64, size: u32, mode: Wrap) -> usize {
    let size = i64::from(size);
    if (0..size).contains(&index) {
        return index as usize;
    }
    let inside = match mode {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0, size - 1),
        Wrap::Mirror => {
            let around = index.rem_euclid(2 * size);
            around.min(2 * size - 1 - around)
        }
    };
    inside as usize
}

/// Texel coordinates far outside any image lose their fraction anyway.
fn to_index(x: f32) -> i64 {
    x.clamp(-1e9, 1e9) as i64
}

impl Texture {
    /// The texel at integer coordinates, wrapped. White for a texture without texels.
    pub fn texel(&self, x: i64, y: i64) -> [u8; 4] {
        if self.width == 0 || self.height == 0 {
            return [255; 4];
        }
        let x = wrap(x, self.width, self.wrap_s);
        let y = wrap(y, self.height, self.wrap_t);
        let texel = self.texels.get(y * self.width as usize + x);
        texel.copied().unwrap_or([255; 4])
    }

    /// The texel that holds `uv`; (0, 0) is the upper left corner of the image.
    pub fn nearest(&self, uv: Vec2) -> [u8; 4] {
        let at = uv * Vec2::new(self.width as f32, self.height as f32);
        self.texel(to_index(at.x.floor()), to_index(at.y.floor()))
    }

    /// Bilinear sample of an sRGB image: linear RGB and alpha, filtered after decoding.
    pub fn sample_srgb(&self, uv: Vec2) -> Vec4 {
        self.bilinear(uv, |[r, g, b, a]| {
            Vec4::new(
                srgb_to_linear(r),
                srgb_to_linear(g),
                srgb_to_linear(b),
                f32::from(a) / 255.0,
            )
        })
    }

    /// Bilinear sample of an image that holds plain numbers, such as a normal map; 0..=1.
    pub fn sample_linear(&self, uv: Vec2) -> Vec4 {
        self.bilinear(uv, |texel| Vec4::from(texel.map(f32::from)) / 255.0)
    }

    fn bilinear(&self, uv: Vec2, decode: impl Fn([u8; 4]) -> Vec4) -> Vec4 {
        let at = uv * Vec2::new(self.width as f32, self.height as f32) - Vec2::splat(0.5);
        let corner = at.floor();
        let f = at - corner;
        let (x, y) = (to_index(corner.x), to_index(corner.y));
        let row = |y| {
            let (a, b) = (decode(self.texel(x, y)), decode(self.texel(x + 1, y)));
            a + (b - a) * f.x
        };
        let (top, bottom) = (row(y), row(y + 1));
        top + (bottom - top) * f.y
    }
}

impl Mesh {
    /// Coordinates of a triangle's corners on a texture; `None` where the mesh lacks the set.
    pub fn corner_uvs(&self, texture: &TextureRef, triangle: usize) -> Option<[Vec2; 3]> {
        let set = self.uvs.get(texture.set).filter(|set| !set.is_empty())?;
        let at = |v: u32| texture.transform.transform_point2(set[v as usize]);
        Some(self.triangles[triangle].map(at))
    }

    /// Coordinates on a texture at barycentric `u`, `v` (weights of the second and third corner).
    pub fn uv(&self, texture: &TextureRef, triangle: usize, u: f32, v: f32) -> Option<Vec2> {
        let [a, b, c] = self.corner_uvs(texture, triangle)?;
        Some(a + (b - a) * u + (c - a) * v)
    }

    /// The vertex colour at barycentric `u`, `v`, if the mesh has any.
    pub fn color(&self, triangle: usize, u: f32, v: f32) -> Option<Vec4> {
        if self.colors.is_empty() {
            return None;
        }
        let [a, b, c] = self.triangles[triangle].map(|v| self.colors[v as usize]);
        Some(a + (b - a) * u + (c - a) * v)
    }
}

impl Material {
    /// Whether a ray or a point on this material must ask [`Scene::alpha_is_hole`].
    pub fn has_holes(&self) -> bool {
        self.window || self.alpha != Alpha::Opaque
    }
}

impl Scene {
    /// Linear radiance of a triangle at barycentric `u`, `v`.
    pub fn emission(&self, mesh: usize, triangle: usize, u: f32, v: f32) -> Vec3 {
        let mesh = &self.meshes[mesh];
        let material = mesh.materials.get(triangle).map(|m| *m as usize);
        let Some(material) = material.and_then(|m| self.materials.get(m)) else {
            return Vec3::ZERO;
        };
        let texel = material
            .emissive_texture
            .filter(|_| material.emissive != Vec3::ZERO)
            .and_then(|texture| {
                let uv = mesh.uv(&texture, triangle, u, v)?;
                Some(self.textures[texture.texture].sample_srgb(uv).truncate())
            });
        material.emissive * texel.unwrap_or(Vec3::ONE)
    }

    /// Share of light that passes a triangle at barycentric `u`, `v` where it is no metal.
    pub fn transmission(&self, mesh: usize, triangle: usize, u: f32, v: f32) -> f32 {
        let mesh = &self.meshes[mesh];
        let material = mesh.materials.get(triangle).map(|m| *m as usize);
        let Some(material) = material.and_then(|m| self.materials.get(m)) else {
            return 0.0;
        };
        let texel = material.transmission_texture.and_then(|texture| {
            let uv = mesh.uv(&texture, triangle, u, v)?;
            Some(self.textures[texture.texture].sample_linear(uv).x)
        });
        material.transmission * texel.unwrap_or(1.0)
    }

    /// Whether a camera or an occlusion ray passes through the triangle at barycentric coordinates
    /// `u`, `v` (weights of its second and third corner): masked texels below the cutoff, everything
    /// blended, and windows.
    pub fn alpha_is_hole(&self, mesh: usize, triangle: usize, u: f32, v: f32) -> bool {
        let material = self.meshes[mesh].materials.get(triangle);
        material
            .and_then(|m| self.materials.get(*m as usize))
            .is_some_and(|m| m.window)
            || self.mask_is_hole(mesh, triangle, u, v)
    }

    /// [`Scene::alpha_is_hole`] by alpha alone: windows stop a ray that asks what light they let
    /// through.
    pub fn mask_is_hole(&self, mesh: usize, triangle: usize, u: f32, v: f32) -> bool {
        let mesh = &self.meshes[mesh];
        let Some(material) = mesh
            .materials
            .get(triangle)
            .and_then(|m| self.materials.get(*m as usize))
        else {
            return false;
        };
        let cutoff = match material.alpha {
            Alpha::Opaque => return false,
            Alpha::Blend => return true,
            Alpha::Mask { cutoff } => cutoff,
        };
        let mut alpha = material.base_color.w;
        if let Some(color) = mesh.color(triangle, u, v) {
            alpha *= color.w;
        }
        if let Some(texture) = material.base_color_texture
            && let Some(uv) = mesh.uv(&texture, triangle, u, v)
        {
            alpha *= f32::from(self.textures[texture.texture].nearest(uv)[3]) / 255.0;
        }
        alpha < cutoff
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two by two: red, green / blue, clear white.
    fn checker(wrap_s: Wrap, wrap_t: Wrap) -> Texture {
        Texture {
            width: 2,
            height: 2,
            texels: [
                [255, 0, 0, 255],
                [0, 255, 0, 255],
                [0, 0, 255, 255],
                [255, 255, 255, 0],
            ]
            .into(),
            wrap_s,
            wrap_t,
        }
    }

    #[test]
    fn wrap_modes_pick_the_texel() {
        for (mode, expected) in [
            (Wrap::Repeat, [0, 1, 0, 1, 0, 1]),
            (Wrap::Clamp, [0, 0, 0, 1, 1, 1]),
            (Wrap::Mirror, [1, 0, 0, 1, 1, 0]),
        ] {
            let got: Vec<usize> = (-2..4).map(|i| wrap(i, 2, mode)).collect();
            assert_eq!(got, expected, "{mode:?}");
        }
        let texture = checker(Wrap::Repeat, Wrap::Clamp);
        assert_eq!(texture.nearest(Vec2::new(1.25, 0.25)), [255, 0, 0, 255]);
        assert_eq!(texture.nearest(Vec2::new(0.25, 7.0)), [0, 0, 255, 255]);
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            texture.nearest(Vec2::splat(odd));
            texture.sample_srgb(Vec2::splat(odd));
        }
    }

    #[test]
    fn bilinear_meets_texel_centres_and_their_mean() {
        let texture = checker(Wrap::Clamp, Wrap::Clamp);
        let red = texture.sample_srgb(Vec2::new(0.25, 0.25));
        assert_eq!(red, Vec4::new(1.0, 0.0, 0.0, 1.0));
        let middle = texture.sample_linear(Vec2::splat(0.5));
        assert!(middle.abs_diff_eq(Vec4::new(0.5, 0.5, 0.5, 0.75), 1e-6));
    }

    #[test]
    fn srgb_middle_grey() {
        assert_eq!(srgb_to_linear(0), 0.0);
        assert_eq!(srgb_to_linear(255), 1.0);
        assert!((srgb_to_linear(188) - 0.5029).abs() < 1e-3);
    }
}
