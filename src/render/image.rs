//! 8-bit sRGB pictures and their PNG files.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::Vec3;

use crate::{Error, Result, files};

/// Largest width and height of a picture that is read or written, in pixels.
pub const MAX_SIDE: u32 = 16_384;

/// An 8-bit picture in sRGB, row by row from the top left.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `width * height` pixels, sRGB-encoded.
    pub rgb: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, colour: [u8; 3]) -> Picture {
        Picture {
            width,
            height,
            rgb: vec![colour; width as usize * height as usize],
        }
    }

    /// Encodes linear colour in 0..=1; what lies beyond is clamped, NaN is black.
    pub fn from_linear(width: u32, height: u32, linear: &[Vec3]) -> Picture {
        let encode = |c: &Vec3| c.to_array().map(srgb8_from_linear);
        Picture {
            width,
            height,
            rgb: linear.iter().map(encode).collect(),
        }
    }

    /// A gray picture of values that are no colours (AO): `round(255 * value)` in all three
    /// channels, displayed as it is, with no transfer curve. NaN is black.
    pub fn from_values(width: u32, height: u32, values: &[f32]) -> Picture {
        // NaN becomes 0 in the cast.
        let encode = |v: &f32| [(v.clamp(0.0, 1.0) * 255.0).round() as u8; 3];
        Picture {
            width,
            height,
            rgb: values.iter().map(encode).collect(),
        }
    }

    /// The left half of one picture and the right half of another of the same size, with a white line
    /// between them.
    pub fn halves(left: &Picture, right: &Picture) -> Picture {
        let middle = left.width / 2;
        let pixel = |(i, (l, r)): (usize, (&[u8; 3], &[u8; 3]))| match (i as u32
            % left.width.max(1))
        .cmp(&middle)
        {
            std::cmp::Ordering::Less => *l,
            std::cmp::Ordering::Equal => [255; 3],
            std::cmp::Ordering::Greater => *r,
        };
        let pairs = left.rgb.iter().zip(&right.rgb);
        Picture {
            rgb: pairs.enumerate().map(pixel).collect(),
            width: left.width,
            height: left.height,
        }
    }

    /// Reads a PNG of at most [`MAX_SIDE`] pixels a side. 16-bit channels are rounded to 8, gray is
    /// spread over the three channels, and alpha is dropped (colours are taken as stored).
    ///
    /// # Errors
    /// `Io` where the file cannot be opened, `Invalid` where it is no PNG, is damaged or too large.
    pub fn read_png(path: &Path) -> Result<Picture> {
        let file = File::open(path).map_err(|source| Error::Io {
            path: path.to_path_buf(),
            source,
        })?;
        let mut reader =
            ::image::ImageReader::with_format(BufReader::new(file), ::image::ImageFormat::Png);
        let mut limits = ::image::Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        // Room for the largest picture at 16 bits and four channels.
        limits.max_alloc = Some(8 * u64::from(MAX_SIDE) * u64::from(MAX_SIDE));
        reader.limits(limits);
        let decoded = reader.decode().map_err(|source| {
            let message = match source {
                ::image::ImageError::Limits(_) => {
                    format!("is larger than {MAX_SIDE} pixels a side")
                }
                other => format!("is not a readable PNG ({other})"),
            };
            Error::Invalid(format!("{} {message}", path.display()))
        })?;
        let buffer = decoded.into_rgb8();
        let (width, height) = buffer.dimensions();
        let rgb = buffer.pixels().map(|p| p.0).collect();
        Ok(Picture { width, height, rgb })
    }

    /// Writes an 8-bit RGB PNG, whole or not at all.
    ///
    /// # Errors
    /// As [`files::write`], and `Invalid` where the picture is empty or its pixels do not match its
    /// size.
    pub fn write_png(&self, path: &Path) -> Result<()> {
        files::write(path, &self.to_png()?)
    }

    /// The bytes of the PNG that [`Picture::write_png`] writes.
    ///
    /// # Errors
    /// `Invalid` where the picture is empty, too large, or its pixels do not match its size.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        use ::image::ImageEncoder;
        let pixels = self.width as usize * self.height as usize;
        if pixels == 0 || self.width > MAX_SIDE || self.height > MAX_SIDE {
            return Err(Error::Invalid(format!(
                "a picture of {}x{} pixels cannot be written: each side must be 1 to {MAX_SIDE}",
                self.width, self.height
            )));
        }
        if self.rgb.len() != pixels {
            return Err(Error::Invalid(format!(
                "a {}x{} picture needs {pixels} pixels, not {}",
                self.width,
                self.height,
                self.rgb.len()
            )));
        }
        let mut bytes = Vec::new();
        ::image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(
                bytemuck::cast_slice(&self.rgb),
                self.width,
                self.height,
                ::image::ExtendedColorType::Rgb8,
            )
            .map_err(|e| Error::Invalid(format!("the picture cannot be encoded as PNG ({e})")))?;
        Ok(bytes)
    }
}

/// IEC 61966-2-1 transfer function, of 0..=1 to 0..=1; what lies beyond is clamped.
pub fn srgb_from_linear(c: f32) -> f32 {
    let c = c.clamp(0.0, 1.0);
    if c <= 0.003_130_8 {
        12.92 * c
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    }
}

/// [`srgb_from_linear`], to the nearest of 256 steps.
pub fn srgb8_from_linear(c: f32) -> u8 {
    (srgb_from_linear(c) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn temporary(name: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join(name);
        (folder, path)
    }

    #[test]
    fn png_keeps_every_pixel() {
        let (_folder, path) = temporary("a.png");
        let rgb = (0..35u8)
            .map(|i| [i, 255 - i, i.wrapping_mul(37)])
            .collect();
        let picture = Picture {
            width: 7,
            height: 5,
            rgb,
        };
        picture.write_png(&path).expect("written");
        assert_eq!(Picture::read_png(&path).expect("read"), picture);
    }

    #[test]
    fn every_truncation_of_a_png_is_an_error() {
        let (_folder, path) = temporary("a.png");
        let bytes = Picture::filled(3, 2, [9, 8, 7]).to_png().expect("encoded");
        // The last 12 bytes are the IEND chunk, which carries nothing.
        for length in 0..bytes.len() - 12 {
            std::fs::write(&path, &bytes[..length]).expect("written");
            assert!(
                Picture::read_png(&path).is_err(),
                "{length} bytes were accepted"
            );
        }
    }

    #[test]
    fn a_header_that_claims_a_huge_picture_is_refused() {
        let (_folder, path) = temporary("huge.png");
        let mut bytes = Picture::filled(3, 2, [9, 8, 7]).to_png().expect("encoded");
        bytes[16..20].copy_from_slice(&100_000u32.to_be_bytes());
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        std::fs::write(&path, &bytes).expect("written");
        let message = Picture::read_png(&path).expect_err("refused").to_string();
        assert!(message.contains("larger than 16384"), "{message}");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |c, _| {
                (c >> 1) ^ (0xedb8_8320 & (c & 1).wrapping_neg())
            })
        })
    }

    #[test]
    fn sizes_are_checked() {
        assert!(Picture::filled(0, 4, [0; 3]).to_png().is_err());
        assert!(
            Picture {
                width: 2,
                height: 2,
                rgb: vec![[0; 3]; 3]
            }
            .to_png()
            .is_err()
        );
    }

    #[test]
    fn linear_light_by_hand() {
        let linear = [0.0, 0.002, 0.502_886_5, 2.0].map(Vec3::splat);
        let picture = Picture::from_linear(4, 1, &linear);
        assert_eq!(picture.rgb, [[0; 3], [7; 3], [188; 3], [255; 3]]);
    }

    #[test]
    fn gray_rounds_and_clamps() {
        let picture = Picture::from_values(4, 1, &[-1.0, 0.5, 2.0, f32::NAN]);
        assert_eq!(picture.rgb, [[0; 3], [128; 3], [255; 3], [0; 3]]);
    }
}
