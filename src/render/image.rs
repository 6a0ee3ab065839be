//! Pictures of 8-bit sRGB and their PNG files.

use crate::{Error, Result};
use glam::Vec3;
use std::path::Path;

/// An sRGB picture, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// `width * height` pixels.
    pub rgb: Vec<[u8; 3]>,
}

impl Picture {
    /// Encodes linear colour in 0..=1; what lies beyond is clamped, NaN is black.
    pub fn from_linear(width: u32, height: u32, linear: &[Vec3]) -> Picture {
        let rgb = linear
            .iter()
            .map(|c| c.to_array().map(srgb8_from_linear))
            .collect();
        Picture { width, height, rgb }
    }

    /// A grey picture of values that are no colours (AO): 0..=1 becomes 0..=255, not sRGB-encoded.
    pub fn from_values(width: u32, height: u32, values: &[f32]) -> Picture {
        let rgb = values
            .iter()
            .map(|v| [(v.clamp(0.0, 1.0) * 255.0).round() as u8; 3])
            .collect();
        Picture { width, height, rgb }
    }

    /// Reads a PNG file; grey and 16-bit ones are converted, alpha is dropped.
    pub fn read_png(path: &Path) -> Result<Picture> {
        let bytes = std::fs::read(path).map_err(|source| io(path, source))?;
        let image = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
            .map_err(|e| Error::Invalid(format!("{}: no readable PNG: {e}", path.display())))?
            .to_rgb8();
        let (width, height) = image.dimensions();
        let rgb = image.pixels().map(|p| p.0).collect();
        Ok(Picture { width, height, rgb })
    }

    /// Writes a PNG file; the folder must exist.
    pub fn write_png(&self, path: &Path) -> Result<()> {
        let bytes = self.rgb.as_flattened().to_vec();
        let image = image::RgbImage::from_raw(self.width, self.height, bytes).ok_or_else(|| {
            Error::Invalid(format!(
                "{}: a picture of {}x{} needs {} pixels, not {}",
                path.display(),
                self.width,
                self.height,
                u64::from(self.width) * u64::from(self.height),
                self.rgb.len()
            ))
        })?;
        let mut png = std::io::Cursor::new(Vec::new());
        image
            .write_to(&mut png, image::ImageFormat::Png)
            .map_err(|e| Error::Invalid(format!("{}: cannot encode: {e}", path.display())))?;
        std::fs::write(path, png.into_inner()).map_err(|source| io(path, source))
    }
}

fn io(path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        path: path.to_path_buf(),
        source,
    }
}

/// IEC 61966-2-1 transfer function, to the nearest of 256 steps.
pub fn srgb8_from_linear(c: f32) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 {
        12.92 * c
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    };
    (s * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trips_and_a_png_reads_back() {
        for i in 0..=255 {
            assert_eq!(
                srgb8_from_linear(crate::scene::texture::srgb_to_linear(i)),
                i
            );
        }
        let rgb = (0..15u8).map(|i| [i, 255 - i, i * 7]).collect();
        let picture = Picture {
            width: 5,
            height: 3,
            rgb,
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        picture.write_png(&path).unwrap();
        assert_eq!(Picture::read_png(&path).unwrap(), picture);
    }

    #[test]
    fn a_bad_file_or_size_is_one_sentence() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        std::fs::write(&path, b"no picture").unwrap();
        let message = Picture::read_png(&path).unwrap_err().to_string();
        assert!(
            message.contains("p.png") && !message.contains('\n'),
            "{message}"
        );
        assert!(Picture::read_png(&dir.path().join("none.png")).is_err());
        let short = Picture {
            width: 2,
            height: 2,
            rgb: vec![[0; 3]],
        };
        assert!(
            short
                .write_png(&path)
                .unwrap_err()
                .to_string()
                .contains("4 pixels")
        );
    }
}
