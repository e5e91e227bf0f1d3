//! A reference photo beside the picture, from which colours are picked.

mod error;
mod jpeg;

use std::io::Cursor;
use std::path::Path;

use egui::{ColorImage, Sense, TextureHandle, TextureOptions};
use strandlight_formats::read_file;

use super::field::Changes;
use error::MAX_PIXELS;

pub use error::PhotoError;

/// Longest file that is read.
const MAX_BYTES: u64 = 256 << 20;

/// Bytes that decoding may take.
const MAX_DECODED: usize = 1 << 30;

/// Longest side that is shown; larger photos are reduced by whole factors.
const MAX_SIDE: usize = 1024;

/// Extensions of photos.
#[cfg(not(target_arch = "wasm32"))]
pub const EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Is the file at `path` a photo, by its name or by how it begins?
#[cfg(not(target_arch = "wasm32"))]
pub fn is_photo(path: &Path) -> bool {
    use std::io::Read;

    let has_name = path.extension().is_some_and(|of_file| {
        let mut known = EXTENSIONS.iter();
        known.any(|extension| of_file.eq_ignore_ascii_case(extension))
    });
    let begins = || {
        let mut bytes = [0; 8];
        let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut bytes));
        read.is_ok() && (jpeg::is_jpeg(&bytes) || bytes == *b"\x89PNG\r\n\x1a\n")
    };
    has_name || begins()
}

/// A photo, reduced to what is shown.
pub struct Photo {
    name: String,
    size: [usize; 2],
    /// sRGB, rows from the top.
    pixels: Vec<[u8; 3]>,
    texture: Option<TextureHandle>,
}

impl std::fmt::Debug for Photo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = f.debug_struct("Photo");
        shown.field("name", &self.name).field("size", &self.size);
        shown.finish_non_exhaustive()
    }
}

impl Photo {
    /// Reads a PNG of 8 or 16 bits or a JPEG, taken for sRGB whatever profile it has; alpha is over black, and a JPEG is
    /// turned upright by its EXIF orientation.
    ///
    /// # Errors
    /// A file that is none, is damaged or too large, by name.
    pub fn read(path: &Path) -> Result<Photo, PhotoError> {
        let name = path.file_name().unwrap_or(path.as_os_str());
        let name = name.to_string_lossy().into_owned();
        let bytes = read_file(path, MAX_BYTES)?;
        Photo::decode(name, &bytes)
    }

    fn decode(name: String, bytes: &[u8]) -> Result<Photo, PhotoError> {
        if jpeg::is_jpeg(bytes) {
            let decoded = jpeg::decode(&name, bytes)?;
            let (size, pixels) = reduced(decoded.size, &decoded.pixels);
            let (size, pixels) = decoded.orientation.upright(size, pixels);
            return Ok(Photo {
                name,
                size,
                pixels,
                texture: None,
            });
        }
        let wrong = |source: png::DecodingError| PhotoError::Png {
            name: name.clone(),
            source,
        };
        let limits = png::Limits { bytes: MAX_DECODED };
        let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(wrong)?;
        let info = reader.info();
        let pixels = u64::from(info.width) * u64::from(info.height);
        if pixels > MAX_PIXELS {
            return Err(PhotoError::TooLarge { name, pixels });
        }
        let mut data = vec![0; reader.output_buffer_size().unwrap_or_default()];
        let frame = reader.next_frame(&mut data).map_err(wrong)?;
        let channels = frame.color_type.samples();
        let [width, height] = [frame.width, frame.height].map(|side| side as usize);
        let rgb = |pixel: &[u8]| match *pixel {
            [grey] => [grey; 3],
            [grey, alpha] => [over_black(grey, alpha); 3],
            [r, g, b] => [r, g, b],
            [r, g, b, alpha] => [r, g, b].map(|x| over_black(x, alpha)),
            _ => [0; 3],
        };
        let pixels: Vec<[u8; 3]> = data.chunks_exact(channels).map(rgb).collect();
        let (size, pixels) = reduced([width, height], &pixels);
        Ok(Photo {
            name,
            size,
            pixels,
            texture: None,
        })
    }

    /// Mean colour of the 3 x 3 pixels around a place, 0..=1 across and down, linear RGB.
    pub fn color_at(&self, [x, y]: [f32; 2]) -> [f64; 3] {
        let [width, height] = self.size;
        let at = |x: f32, side: usize| ((x * side as f32) as usize).min(side - 1);
        let (x, y) = (at(x, width), at(y, height));
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                let pixel = self.pixels[y * width + x].map(linear_from_srgb8);
                sum = [0, 1, 2].map(|c| sum[c] + pixel[c]);
                n += 1.0;
            }
        }
        sum.map(|sum| sum / n)
    }

    /// Shows it in a window of its own until that is closed. Answers the colour that was clicked, linear RGB.
    pub fn show(
        &mut self,
        ctx: &egui::Context,
        picture: egui::Rect,
        is_open: &mut bool,
        changes: &mut Changes,
    ) -> Option<[f64; 3]> {
        let texture = self.texture.get_or_insert_with(|| {
            let image = ColorImage::from_rgb(self.size, self.pixels.as_flattened());
            ctx.load_texture("photo", image, TextureOptions::LINEAR)
        });
        let texture = egui::load::SizedTexture::from_handle(texture);
        let mut picked = None;
        let window = egui::Window::new(format!("Reference: {}", self.name))
            .id(egui::Id::unique("photo"))
            .open(is_open)
            .default_pos(picture.min + egui::vec2(12.0, 12.0))
            .default_size([320.0, 320.0])
            .resizable(true);
        let shown = window.show(ctx, |ui| {
            let image = egui::Image::new(texture).max_size(ui.available_size());
            let image = image.maintain_aspect_ratio(true).sense(Sense::click());
            let response = ui.add(image.shrink_to_fit());
            changes.place("Reference photo", &response);
            let rect = response.rect;
            if let (true, Some(at)) = (response.clicked(), response.interact_pointer_pos()) {
                let at = (at - rect.min) / rect.size().max(egui::Vec2::splat(1.0));
                picked = Some([at.x, at.y]);
            }
            let response = response.on_hover_cursor(egui::CursorIcon::Crosshair);
            response.on_hover_text("Click: the dye takes this colour");
        });
        if let Some(shown) = shown {
            changes.place("Reference window", &shown.response);
        }
        picked.map(|at| self.color_at(at))
    }

    /// Forgets what was on a device that is lost.
    pub fn forget_texture(&mut self) {
        self.texture = None;
    }
}

fn over_black(x: u8, alpha: u8) -> u8 {
    (u32::from(x) * u32::from(alpha) / 255) as u8
}

/// IEC 61966-2-1.
fn linear_from_srgb8(x: u8) -> f64 {
    let x = f64::from(x) / 255.0;
    match x <= 0.040_45 {
        true => x / 12.92,
        false => ((x + 0.055) / 1.055).powf(2.4),
    }
}

/// The picture with no side longer than [`MAX_SIDE`]: every so many pixels one.
fn reduced([width, height]: [usize; 2], pixels: &[[u8; 3]]) -> ([usize; 2], Vec<[u8; 3]>) {
    let step = width.max(height).div_ceil(MAX_SIDE).max(1);
    let size = [width.div_ceil(step), height.div_ceil(step)];
    let rows = (0..height).step_by(step);
    let kept = rows.flat_map(|y| (0..width).step_by(step).map(move |x| y * width + x));
    (
        size,
        kept.filter_map(|ix| pixels.get(ix).copied()).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(size: [u32; 2], color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(data).expect("pixels");
        writer.finish().expect("an end");
        file
    }

    fn read(bytes: &[u8]) -> Result<Photo, PhotoError> {
        Photo::decode("hair.png".to_owned(), bytes)
    }

    #[test]
    fn colours_are_picked_from_pngs_of_every_kind() {
        use png::{BitDepth, ColorType};
        let red = [188, 0, 0].repeat(64);
        let photo = read(&png([8, 8], ColorType::Rgb, BitDepth::Eight, &red)).expect("a PNG");
        let [r, g, b] = photo.color_at([0.5, 1.0]);
        assert!((r - 0.5).abs() < 0.005 && g == 0.0 && b == 0.0, "{r}");
        let half = [255, 128].repeat(64);
        let photo = read(&png(
            [8, 8],
            ColorType::GrayscaleAlpha,
            BitDepth::Eight,
            &half,
        ));
        assert_eq!(photo.expect("a PNG").pixels[0], [128; 3]);
        let deep = [255, 255].repeat(64);
        let photo = read(&png([8, 8], ColorType::Grayscale, BitDepth::Sixteen, &deep));
        assert_eq!(photo.expect("a PNG").color_at([0.0, 0.0]), [1.0; 3]);
        // The right half is another colour, beyond the three pixels of an edge.
        let halves: Vec<u8> = (0..64).map(|ix| if ix % 8 < 4 { 0 } else { 255 }).collect();
        let photo = read(&png([8, 8], ColorType::Grayscale, BitDepth::Eight, &halves));
        let photo = photo.expect("a PNG");
        assert_eq!(photo.color_at([0.1, 0.5]), [0.0; 3]);
        assert_eq!(photo.color_at([0.9, 0.5]), [1.0; 3]);
    }

    #[test]
    fn large_photos_are_reduced_and_faults_are_named() {
        let size = [3000, 10];
        let data = vec![100; 30_000];
        let bytes = png(size, png::ColorType::Grayscale, png::BitDepth::Eight, &data);
        let photo = read(&bytes).expect("a PNG");
        assert_eq!(photo.size, [1000, 4]);
        assert_eq!(photo.pixels.len(), 4000);
        for end in [0, 8, 30, bytes.len() - 20] {
            let error = read(&bytes[..end]).expect_err("cut short").to_string();
            assert!(error.starts_with("hair.png: "), "{error}");
        }
        // A header of 2^62 pixels.
        let mut absurd = bytes.clone();
        absurd[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(read(&absurd).is_err());
    }
}
