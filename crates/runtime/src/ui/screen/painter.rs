//! egui's triangles painted in memory: what egui-wgpu does on a device, pixel by pixel.
//!
//! Colours are sRGB times alpha and are blended as they are, as egui wants it.

use std::collections::HashMap;

use egui::epaint::{ImageData, ImageDelta, Primitive, Vertex};
use egui::{ClippedPrimitive, Color32, TextureFilter, TextureId};

/// A picture to be painted on: 0x00RRGGBB, row by row.
pub struct Frame<'a> {
    /// As many as `size` says.
    pub pixels: &'a mut [u32],
    /// Width and height.
    pub size: [usize; 2],
}

/// Textures, and how triangles are filled with them.
#[derive(Default)]
pub struct Painter {
    textures: HashMap<TextureId, Texture>,
}

struct Texture {
    size: [usize; 2],
    texels: Vec<Color32>,
    /// Interpolates between texels.
    is_smooth: bool,
}

/// A corner of a triangle: place in pixels, place in texels, colour in levels.
#[derive(Clone, Copy)]
struct Corner {
    at: [f32; 2],
    /// u, v, r, g, b, a.
    values: [f32; 6],
}

/// A rectangle of pixels: left, top, and beyond right and bottom.
#[derive(Clone, Copy)]
struct Clip {
    min: [usize; 2],
    max: [usize; 2],
}

impl Painter {
    /// Takes up a texture of egui's, or a part of one.
    pub fn set(&mut self, id: TextureId, delta: &ImageDelta) {
        let ImageData::Color(image) = &delta.image;
        let is_smooth = delta.options.magnification == TextureFilter::Linear;
        let Some([left, top]) = delta.pos else {
            let texture = Texture {
                size: image.size,
                texels: image.pixels.clone(),
                is_smooth,
            };
            self.textures.insert(id, texture);
            return;
        };
        let Some(texture) = self.textures.get_mut(&id) else {
            return;
        };
        let [width, height] = texture.size;
        let columns = image.size[0].min(width.saturating_sub(left));
        let rows = image.pixels.chunks_exact(image.size[0].max(1));
        for (row, y) in rows.zip(top..height) {
            texture.texels[y * width + left..][..columns].copy_from_slice(&row[..columns]);
        }
    }

    /// Takes up a whole texture, sRGB times alpha, whose texels are shown as they are.
    pub fn set_picture(&mut self, id: TextureId, size: [u32; 2], pixels: &[[u8; 4]]) {
        let texture = self.textures.entry(id).or_insert_with(|| Texture {
            size: [0, 0],
            texels: Vec::new(),
            is_smooth: false,
        });
        texture.size = size.map(|side| side as usize);
        texture.texels.clear();
        let texels = pixels
            .iter()
            .map(|&[r, g, b, a]| Color32::from_rgba_premultiplied(r, g, b, a));
        texture.texels.extend(texels);
    }

    /// Forgets a texture.
    pub fn free(&mut self, id: TextureId) {
        self.textures.remove(&id);
    }

    /// Paints what egui has tessellated.
    pub fn paint(&self, frame: &mut Frame<'_>, jobs: &[ClippedPrimitive], pixels_per_point: f32) {
        for job in jobs {
            let Primitive::Mesh(mesh) = &job.primitive else {
                continue;
            };
            let Some(texture) = self.textures.get(&mesh.texture_id) else {
                continue;
            };
            let rect = job.clip_rect * pixels_per_point;
            let pixel = |x: f32, side: usize| (x.round().max(0.0) as usize).min(side);
            let corner = |at: egui::Pos2| [pixel(at.x, frame.size[0]), pixel(at.y, frame.size[1])];
            let clip = Clip {
                min: corner(rect.min),
                max: corner(rect.max),
            };
            let corner = |ix: u32| {
                let vertex = mesh.vertices.get(ix as usize)?;
                Some(texture.corner(vertex, pixels_per_point))
            };
            for &[a, b, c] in mesh.indices.as_chunks::<3>().0 {
                if let (Some(a), Some(b), Some(c)) = (corner(a), corner(b), corner(c)) {
                    fill(frame, clip, texture, [a, b, c]);
                }
            }
        }
    }
}

impl Texture {
    fn corner(&self, vertex: &Vertex, pixels_per_point: f32) -> Corner {
        let [width, height] = self.size.map(|side| side as f32);
        let [r, g, b, a] = vertex.color.to_array().map(f32::from);
        Corner {
            at: [vertex.pos.x, vertex.pos.y].map(|x| x * pixels_per_point),
            values: [vertex.uv.x * width, vertex.uv.y * height, r, g, b, a],
        }
    }

    fn texel(&self, x: f32, y: f32) -> [f32; 4] {
        let place = |at: f32, side: usize| (at.max(0.0) as usize).min(side.saturating_sub(1));
        let ix = place(y, self.size[1]) * self.size[0] + place(x, self.size[0]);
        let texel = self.texels.get(ix).copied().unwrap_or_default();
        texel.to_array().map(f32::from)
    }

    /// Levels at a place in texels.
    fn sample(&self, u: f32, v: f32) -> [f32; 4] {
        if !self.is_smooth {
            return self.texel(u, v);
        }
        let (x, y) = ((u - 0.5).floor(), (v - 0.5).floor());
        let (s, t) = (u - 0.5 - x, v - 0.5 - y);
        let mix = |a: [f32; 4], b: [f32; 4], t: f32| [0, 1, 2, 3].map(|c| a[c] + t * (b[c] - a[c]));
        let row = |y: f32| mix(self.texel(x, y), self.texel(x + 1.0, y), s);
        mix(row(y), row(y + 1.0), t)
    }
}

/// `color` times `texel`, both in levels.
fn times(color: [f32; 4], texel: [f32; 4]) -> [u32; 4] {
    [0, 1, 2, 3].map(|c| (color[c] * texel[c] / 255.0 + 0.5).clamp(0.0, 255.0) as u32)
}

/// Puts a colour times alpha over a pixel.
fn blend(pixel: &mut u32, [r, g, b, a]: [u32; 4]) {
    let over = |shift: u32, color: u32| {
        let behind = (*pixel >> shift & 255) * (255 - a);
        (color + (behind + 127) / 255).min(255) << shift
    };
    *pixel = over(16, r) | over(8, g) | over(0, b);
}

/// Where the line through `p` and `q` meets the height `y`: the same for both of its triangles.
fn crossing(p: [f32; 2], q: [f32; 2], y: f32) -> f32 {
    let (p, q) = if (p[1], p[0]) <= (q[1], q[0]) {
        (p, q)
    } else {
        (q, p)
    };
    p[0] + (q[0] - p[0]) * ((y - p[1]) / (q[1] - p[1]))
}

/// Pixels whose centres lie in `low..high`, of those in `min..max`.
fn centres(low: f32, high: f32, min: usize, max: usize) -> std::ops::Range<usize> {
    let first = |x: f32| ((x - 0.5).ceil().max(0.0) as usize).clamp(min, max);
    first(low)..first(high)
}

/// Fills a triangle. A pixel is its own whose centre is, so that none between two is filled twice.
fn fill(frame: &mut Frame<'_>, clip: Clip, texture: &Texture, corners: [Corner; 3]) {
    let [a, b, c] = corners;
    let to = |corner: Corner| [corner.at[0] - a.at[0], corner.at[1] - a.at[1]];
    let (ab, ac) = (to(b), to(c));
    let area = ab[0] * ac[1] - ab[1] * ac[0];
    if clip.min[0] >= clip.max[0] || clip.min[1] >= clip.max[1] || !area.is_normal() {
        return;
    }
    let is_flat = a.values == b.values && b.values == c.values;
    // Change of the values for a pixel to the right and one down.
    let slope = |ix: usize| {
        let (b, c) = (b.values[ix] - a.values[ix], c.values[ix] - a.values[ix]);
        let right = (b * ac[1] - c * ab[1]) / area;
        let down = (c * ab[0] - b * ac[0]) / area;
        [right, down]
    };
    let slopes = [0, 1, 2, 3, 4, 5].map(slope);
    let is_plain = a.values[2..] == b.values[2..] && b.values[2..] == c.values[2..];
    // Texels lie on pixels and are shown as they are.
    let is_copy = is_plain
        && a.values[2..] == [255.0; 4]
        && !texture.is_smooth
        && (slopes[0][0] - 1.0).abs() < 1e-4
        && slopes[1][0].abs() < 1e-4;
    let mut sorted = corners.map(|corner| corner.at);
    sorted.sort_by(|p, q| p[1].total_cmp(&q[1]));
    let [upper, middle, lower] = sorted;
    for y in centres(upper[1], lower[1], clip.min[1], clip.max[1]) {
        let height = y as f32 + 0.5;
        let x = crossing(upper, lower, height);
        let other = match height < middle[1] {
            true => crossing(upper, middle, height),
            false => crossing(middle, lower, height),
        };
        let span = centres(x.min(other), x.max(other), clip.min[0], clip.max[0]);
        let left = span.start;
        let pixels = &mut frame.pixels[y * frame.size[0]..][span];
        let from = [left as f32 + 0.5 - a.at[0], height - a.at[1]];
        let value = |ix: usize| {
            let [right, down] = slopes[ix];
            a.values[ix] + right * from[0] + down * from[1]
        };
        let mut values = [0, 1, 2, 3, 4, 5].map(value);
        let color = |values: &[f32; 6]| [values[2], values[3], values[4], values[5]];
        if is_flat {
            let color = times(color(&values), texture.sample(values[0], values[1]));
            match color {
                [r, g, b, 255] => pixels.fill(r << 16 | g << 8 | b),
                _ => pixels.iter_mut().for_each(|pixel| blend(pixel, color)),
            }
        } else if is_copy {
            let row = (values[1].max(0.0) as usize).min(texture.size[1].saturating_sub(1));
            let start = row * texture.size[0] + values[0].max(0.0) as usize;
            let texels = texture.texels.get(start..).unwrap_or_default();
            for (pixel, texel) in pixels.iter_mut().zip(texels) {
                match texel.to_array().map(u32::from) {
                    [r, g, b, 255] => *pixel = r << 16 | g << 8 | b,
                    color => blend(pixel, color),
                }
            }
        } else {
            for pixel in pixels {
                let texel = texture.sample(values[0], values[1]);
                blend(pixel, times(color(&values), texel));
                for (value, [right, _]) in values.iter_mut().zip(slopes) {
                    *value += right;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use egui::epaint::{Mesh, pos2};
    use egui::{Rect, vec2};

    use super::*;

    /// A painter with a white texture of one texel, as egui's fills have, and one of four colours.
    fn painter() -> Painter {
        let mut painter = Painter::default();
        painter.set_picture(TextureId::default(), [1, 1], &[[255; 4]]);
        let texels = [
            [10, 0, 0, 255],
            [20, 0, 0, 255],
            [30, 0, 0, 255],
            [0, 0, 0, 0],
        ];
        painter.set_picture(TextureId::User(2), [2, 2], &texels);
        painter
    }

    fn painted(meshes: Vec<Mesh>, clip: Rect, size: [usize; 2]) -> Vec<u32> {
        let jobs: Vec<ClippedPrimitive> = meshes
            .into_iter()
            .map(|mesh| ClippedPrimitive {
                clip_rect: clip,
                primitive: Primitive::Mesh(mesh),
            })
            .collect();
        let mut pixels = vec![0x80; size[0] * size[1]];
        let mut frame = Frame {
            pixels: &mut pixels,
            size,
        };
        painter().paint(&mut frame, &jobs, 1.0);
        pixels
    }

    #[test]
    fn triangles_side_by_side_fill_every_pixel_once() {
        // A fan around a point, of a colour that would show where two overlap.
        let mut mesh = Mesh::with_texture(TextureId::default());
        let color = Color32::from_rgba_premultiplied(100, 0, 0, 0);
        let corners = [
            (1.3, 1.7),
            (13.1, 0.4),
            (14.6, 9.2),
            (8.0, 14.9),
            (0.2, 11.5),
        ];
        mesh.colored_vertex(pos2(6.37, 7.11), color);
        for (x, y) in corners {
            mesh.colored_vertex(pos2(x, y), color);
        }
        for ix in 0..5 {
            mesh.add_triangle(0, 1 + ix, 1 + (ix + 1) % 5);
        }
        let pixels = painted(vec![mesh], Rect::EVERYTHING, [16, 16]);
        let n_filled = pixels.iter().filter(|&&pixel| pixel == 0x0064_0080).count();
        let n_empty = pixels.iter().filter(|&&pixel| pixel == 0x80).count();
        assert_eq!(n_filled + n_empty, 256, "a pixel was filled twice");
        // The area by the shoelace formula is 155.6.
        assert!(n_filled.abs_diff(156) <= 5, "{n_filled}");
        // No hole inside.
        assert!((4..10).all(|y| (4..11).all(|x| pixels[16 * y + x] != 0x80)));
    }

    #[test]
    fn texels_lie_on_pixels_and_the_clip_holds() {
        let mut mesh = Mesh::with_texture(TextureId::User(2));
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let at = Rect::from_min_size(pos2(1.0, 1.0), vec2(2.0, 2.0));
        mesh.add_rect_with_uv(at, whole, Color32::WHITE);
        let pixels = painted(vec![mesh.clone()], Rect::EVERYTHING, [4, 3]);
        let wanted = [
            [0x80, 0x80, 0x80, 0x80],
            [0x80, 0x0a_0000, 0x14_0000, 0x80],
            [0x80, 0x1e_0000, 0x80, 0x80],
        ];
        assert_eq!(pixels, wanted.concat());
        let clip = Rect::from_min_max(pos2(0.0, 0.0), pos2(2.0, 2.0));
        let pixels = painted(vec![mesh], clip, [4, 3]);
        let n_painted = pixels.iter().filter(|&&pixel| pixel != 0x80).count();
        assert_eq!((n_painted, pixels[5]), (1, 0x0a_0000));
    }

    #[test]
    fn colours_are_interpolated_and_blended() {
        let mut mesh = Mesh::with_texture(TextureId::default());
        for (x, y, level) in [(0.0, 0.0, 0), (8.0, 0.0, 80), (8.0, 1.0, 80), (0.0, 1.0, 0)] {
            mesh.colored_vertex(
                pos2(x, y),
                Color32::from_rgba_premultiplied(level, 0, 0, 255),
            );
        }
        mesh.add_triangle(0, 1, 2);
        mesh.add_triangle(0, 2, 3);
        let pixels = painted(vec![mesh], Rect::EVERYTHING, [8, 1]);
        let levels: Vec<u32> = pixels.iter().map(|pixel| pixel >> 16).collect();
        assert_eq!(levels, [5, 15, 25, 35, 45, 55, 65, 75]);
        // Half of the blue behind is left.
        let mut pixel = 0x80;
        blend(&mut pixel, [10, 0, 0, 127]);
        assert_eq!(pixel, 0x0a_0040);
    }
}
