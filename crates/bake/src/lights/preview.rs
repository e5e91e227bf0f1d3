//! A picture to judge a fit by eye.

use std::f64::consts::PI;

use rayon::prelude::*;
use strandlight_formats::{LightSet, SrbfLight};

use super::cells::radiance;
use super::sphere::dot;
use strandlight_images::{LatLong, Map};
use strandlight_scene::{png_file, tone::luminance};

/// Pixels across one of the four pictures of [`preview_png`].
const WIDTH: usize = 640;

/// Pixels across each of [`pictures`].
const PICTURE_WIDTH: usize = 512;

/// Pixels between them.
const GAP: usize = 4;

/// One picture, twice as wide as high, row by row.
type Panel<T> = Vec<[T; 3]>;

/// A PNG (8-bit sRGB) of four pictures at one exposure: the map, the light set; below them the
/// difference (red: the set is brighter, blue: the map is) and the lights over the dimmed map,
/// circles of radius lambda about their directions.
///
/// # Errors
/// What the PNG encoder says.
pub fn preview_png(set: &LightSet, map: &Map) -> Result<Vec<u8>, png::EncodingError> {
    let panels = Panels::new(set, None, map, WIDTH);
    let discs = discs(set, &panels.of_map, panels.exposure, panels.grid);
    let all = [
        panels.toned(&panels.of_map),
        panels.toned(&panels.of_set),
        panels.difference(),
        discs,
    ];
    encode_panels(&all, panels.grid)
}

/// A map, the light set, and the difference, at one exposure, as PNGs (8-bit sRGB).
#[derive(Clone, Debug)]
pub struct Pictures {
    /// The map.
    pub map: Vec<u8>,
    /// The residual map, if there is one.
    pub residual: Option<Vec<u8>>,
    /// The light set, and the residual.
    pub lights: Vec<u8>,
    /// Red where the set is brighter, blue where the map is, grey where they agree.
    pub difference: Vec<u8>,
    /// Width and height of each, pixels.
    pub size: [usize; 2],
}

/// Makes the pictures of a map, and of a set with the residual map that belongs to it, if one does.
///
/// # Errors
/// What the PNG encoder says.
pub fn pictures(
    set: &LightSet,
    residual: Option<&Map>,
    map: &Map,
) -> Result<Pictures, png::EncodingError> {
    let panels = Panels::new(set, residual, map, PICTURE_WIDTH);
    let residual = residual.map(|map| panels.toned(&shrink(map, panels.grid)));
    let LatLong { width, height } = panels.grid;
    let encode =
        |panel: Panel<u8>| png_file::encode([width, height].map(|side| side as u32), &panel, &[]);
    Ok(Pictures {
        map: encode(panels.toned(&panels.of_map))?,
        residual: residual.map(encode).transpose()?,
        lights: encode(panels.toned(&panels.of_set))?,
        difference: encode(panels.difference())?,
        size: [width, height],
    })
}

/// A map and a set at the same pixels.
struct Panels {
    grid: LatLong,
    of_map: Panel<f64>,
    of_set: Panel<f64>,
    exposure: f64,
}

impl Panels {
    fn new(set: &LightSet, residual: Option<&Map>, map: &Map, width: usize) -> Panels {
        let grid = LatLong {
            width,
            height: width / 2,
        };
        let of_map = shrink(map, grid);
        let mut of_set = reconstruct(set, grid);
        if let Some(residual) = residual {
            for (sum, rest) in of_set.iter_mut().zip(shrink(residual, grid)) {
                *sum = [0, 1, 2].map(|c| sum[c] + rest[c]);
            }
        }
        Panels {
            grid,
            of_set,
            exposure: exposure(&of_map),
            of_map,
        }
    }

    fn toned(&self, panel: &Panel<f64>) -> Panel<u8> {
        toned(panel, self.exposure)
    }

    fn difference(&self) -> Panel<u8> {
        let pairs = self.of_map.iter().zip(&self.of_set);
        let difference = pairs.map(|(map, set)| luminance(*set) - luminance(*map));
        difference.map(|x| heat(self.exposure * x)).collect()
    }
}

/// A PNG (8-bit sRGB) of a light set: what it looks like, and beside it the same dimmed with circles
/// of radius lambda about its lights.
///
/// # Errors
/// What the PNG encoder says.
pub fn light_set_png(set: &LightSet) -> Result<Vec<u8>, png::EncodingError> {
    let grid = LatLong {
        width: WIDTH,
        height: WIDTH / 2,
    };
    let of_set = reconstruct(set, grid);
    let exposure = exposure(&of_set);
    let panels = [
        toned(&of_set, exposure),
        discs(set, &of_set, exposure, grid),
    ];
    encode_panels(&panels, grid)
}

/// Averages the map's pixels (or repeats them) into the panel.
fn shrink(map: &Map, grid: LatLong) -> Panel<f64> {
    // The source pixels of a target pixel along one axis.
    let range = |i: usize, from: usize, to: usize| {
        let first = i * from / to;
        first..((i + 1) * from / to).max(first + 1)
    };
    (0..grid.height)
        .flat_map(|j| (0..grid.width).map(move |i| (i, j)))
        .map(|(i, j)| {
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for y in range(j, map.height(), grid.height) {
                for x in range(i, map.width(), grid.width) {
                    let pixel = map.pixels()[y * map.width() + x];
                    for c in 0..3 {
                        sum[c] += f64::from(pixel[c]);
                    }
                    count += 1.0;
                }
            }
            sum.map(|s| s / count)
        })
        .collect()
}

fn reconstruct(set: &LightSet, grid: LatLong) -> Panel<f64> {
    let lights: Vec<&SrbfLight> = set.lights.iter().collect();
    (0..grid.height)
        .into_par_iter()
        .flat_map_iter(|j| {
            let lights = &lights;
            (0..grid.width).map(move |i| {
                radiance(
                    lights.iter().copied(),
                    grid.direction(i as f64 + 0.5, j as f64 + 0.5),
                )
            })
        })
        .collect()
}

/// Puts the mean of the logarithms at a fifth of white, as photographers do; ignores black.
fn exposure(panel: &Panel<f64>) -> f64 {
    let logs: Vec<f64> = panel
        .iter()
        .map(|rgb| luminance(*rgb))
        .filter(|y| *y > 0.0)
        .map(f64::ln)
        .collect();
    if logs.is_empty() {
        return 1.0;
    }
    0.2 / (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

fn toned(panel: &Panel<f64>, exposure: f64) -> Panel<u8> {
    let exposed = panel.par_iter().map(|rgb| rgb.map(|x| x * exposure));
    exposed.map(tone).collect()
}

/// Extended Reinhard with white at 16, then sRGB.
fn tone(rgb: [f64; 3]) -> [u8; 3] {
    rgb.map(|x| srgb(x * (1.0 + x / 256.0) / (1.0 + x)))
}

fn srgb(x: f64) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let y = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * y).round() as u8
}

/// Grey for none, red for positive, blue for negative; half way at 0.5.
fn heat(x: f64) -> [u8; 3] {
    let strength = x.abs() / (0.5 + x.abs());
    let (own, other) = (0.22 + 0.78 * strength, 0.22 * (1.0 - strength));
    let warm = 0.22 + 0.4 * strength * strength - 0.15 * strength;
    let rgb = if x > 0.0 {
        [own, warm, other]
    } else {
        [other, warm, own]
    };
    rgb.map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8)
}

/// The dimmed map with a circle for each light, in its colour.
fn discs(set: &LightSet, map: &Panel<f64>, exposure: f64, grid: LatLong) -> Panel<u8> {
    let pixel = PI / grid.height as f64;
    let circles: Vec<Circle> = set
        .lights
        .iter()
        .map(|light| {
            let strongest = light.rgb.iter().fold(f32::MIN_POSITIVE, |m, x| m.max(*x));
            // Never smaller than what can be seen.
            let radius = f64::from(light.lambda).max(2.5 * pixel);
            Circle {
                axis: light.direction.map(f64::from),
                colour: light
                    .rgb
                    .map(|x| srgb(0.15 + 0.85 * f64::from(x / strongest))),
                radius,
                // A little less, for what rounding does.
                least_cosine: (radius + 0.6 * pixel).min(PI).cos() - 1e-9,
            }
        })
        .collect();
    let mut panel = toned(map, 0.25 * exposure);
    let rows = panel.par_chunks_mut(grid.width).enumerate();
    rows.for_each(|(j, row)| {
        for (i, rgb) in row.iter_mut().enumerate() {
            let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
            let is_on = |circle: &&Circle| {
                let cosine = dot(direction, circle.axis);
                if cosine < circle.least_cosine {
                    return false;
                }
                let angle = cosine.clamp(-1.0, 1.0).acos();
                (angle - circle.radius).abs() < 0.6 * pixel || angle < 1.2 * pixel
            };
            // Strong lights come first.
            if let Some(circle) = circles.iter().find(is_on) {
                *rgb = circle.colour;
            }
        }
    });
    panel
}

/// What shows a light.
struct Circle {
    axis: [f64; 3],
    colour: [u8; 3],
    /// Radians.
    radius: f64,
    /// Of the angle to the axis, on the circle.
    least_cosine: f64,
}

/// A PNG of panels, two in a row.
fn encode_panels(panels: &[Panel<u8>], grid: LatLong) -> Result<Vec<u8>, png::EncodingError> {
    let rows = panels.len().div_ceil(2);
    let (width, height) = (2 * grid.width + GAP, rows * (grid.height + GAP) - GAP);
    let mut pixels = vec![[0; 3]; width * height];
    for (k, panel) in panels.iter().enumerate() {
        let (x0, y0) = ((k % 2) * (grid.width + GAP), (k / 2) * (grid.height + GAP));
        for (j, row) in panel.chunks_exact(grid.width).enumerate() {
            pixels[(y0 + j) * width + x0..][..grid.width].copy_from_slice(row);
        }
    }
    png_file::encode([width, height].map(|side| side as u32), &pixels, &[])
}
