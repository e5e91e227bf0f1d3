//! Environment maps drawn by formulas, for scenes that need no file from elsewhere.
//!
//! Three lightings that are hard in different ways: a bare sun ([`Sky::Sun`]), lamps with edges
//! ([`Sky::Studio`]), no edges at all ([`Sky::Soft`]). Layout and units are those of
//! [`Map`](strandlight_images::Map): linear Rec.709 radiance in units of the map.

use std::f64::consts::PI;

use exr::prelude::{Compression, Encoding, Layer, LayerAttributes, SpecificChannels, f16};

/// One of the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sky {
    /// Clear sky over grass with a hard sun 40 degrees high: three quarters of the irradiance
    /// come from a disc of 1.2 degrees (twice the real one, so that half floats hold it).
    Sun,
    /// A studio: warm key softbox, cool rim light, strip overhead, large weak fill, dim room.
    Studio,
    /// An overcast sky, a little brighter and warmer on one side, over a light floor.
    Soft,
}

impl Sky {
    /// All maps.
    pub const ALL: [Sky; 3] = [Sky::Sun, Sky::Studio, Sky::Soft];

    /// The name used for files: `sun`, `studio`, `soft`.
    pub const fn name(self) -> &'static str {
        match self {
            Sky::Sun => "sun",
            Sky::Studio => "studio",
            Sky::Soft => "soft",
        }
    }

    /// Radiance from the unit vector `omega`, +Y up.
    pub fn radiance(self, omega: [f64; 3]) -> [f64; 3] {
        match self {
            Sky::Sun => clear_sky(omega),
            Sky::Studio => studio(omega),
            Sky::Soft => overcast(omega),
        }
    }

    /// An OpenEXR file of `2 height` x `height` half-float pixels, scan lines, ZIP. The radiance
    /// is taken at pixel centres; of the sun's disc, which is about as large as a pixel, each
    /// pixel holds its share.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn exr_file(self, height: usize) -> exr::error::Result<Vec<u8>> {
        let (width, height) = (2 * height, height);
        let at = move |x: f64, y: f64| {
            let latitude = PI * (0.5 - y / height as f64);
            let longitude = PI - 2.0 * PI * x / width as f64;
            direction(longitude, latitude)
        };
        let disc_scale = self.disc_scale(width, height, &at);
        let channels = SpecificChannels::rgb(move |position: exr::math::Vec2<usize>| {
            let (x, y) = (position.x() as f64, position.y() as f64);
            let mut rgb = self.radiance(at(x + 0.5, y + 0.5));
            let share = disc_scale * disc_share(x, y, &at);
            if self == Sky::Sun && share > 0.0 {
                rgb = [0, 1, 2].map(|c: usize| rgb[c] + share * SUN_RADIANCE[c]);
            }
            let [r, g, b] = rgb.map(f16::from_f64);
            (r, g, b)
        });
        let encoding = Encoding {
            compression: Compression::ZIP16,
            ..Encoding::FAST_LOSSLESS
        };
        let layer = Layer::new(
            (width, height),
            LayerAttributes::named(self.name()),
            encoding,
            channels,
        );
        strandlight_images::exr_file::encode_layer(layer)
    }

    /// Factor on the sampled disc that makes its solid angle the exact one.
    fn disc_scale(self, width: usize, height: usize, at: &impl Fn(f64, f64) -> [f64; 3]) -> f64 {
        if self != Sky::Sun {
            return 0.0;
        }
        let mut sampled = 0.0;
        for y in 0..height {
            let latitude = PI * (0.5 - (y as f64 + 0.5) / height as f64);
            let pixel = latitude.cos() * (PI / height as f64) * (2.0 * PI / width as f64);
            for x in 0..width {
                sampled += pixel * disc_share(x as f64, y as f64, at);
            }
        }
        2.0 * PI * (1.0 - SUN_RADIUS.cos()) / sampled
    }
}

/// Angular radius of the sun's disc: 0.6 degrees.
const SUN_RADIUS: f64 = 0.6 * PI / 180.0;
/// Where it stands.
const SUN_LONGITUDE: f64 = 50.0 * PI / 180.0;
const SUN_LATITUDE: f64 = 40.0 * PI / 180.0;
/// Its radiance; below the largest half float.
const SUN_RADIANCE: [f64; 3] = [34_000.0, 30_500.0, 25_000.0];

/// Part of a pixel that the sun covers, by 16 x 16 samples.
fn disc_share(x: f64, y: f64, at: &impl Fn(f64, f64) -> [f64; 3]) -> f64 {
    const SIDE: u32 = 16;
    let sun = direction(SUN_LONGITUDE, SUN_LATITUDE);
    // Most pixels are far away.
    if dot(at(x + 0.5, y + 0.5), sun) < 0.98 {
        return 0.0;
    }
    let limit = SUN_RADIUS.cos();
    let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
    let inside = (0..SIDE * SIDE)
        .filter(|k| dot(at(x + offset(k % SIDE), y + offset(k / SIDE)), sun) > limit)
        .count();
    inside as f64 / f64::from(SIDE * SIDE)
}

/// The sky without the sun's disc.
fn clear_sky(omega: [f64; 3]) -> [f64; 3] {
    let sun = direction(SUN_LONGITUDE, SUN_LATITUDE);
    let cos = dot(omega, sun);
    let up = omega[1];
    // Bright and pale at the horizon, deep blue above; a glow around the sun.
    let pale = (-3.5 * up.max(0.0)).exp();
    let glow = 1.6 * (8.0 * (cos - 1.0)).exp() + 12.0 * (90.0 * (cos - 1.0)).exp();
    let sky = [
        0.22 + 0.75 * pale + 1.00 * glow,
        0.42 + 0.75 * pale + 0.93 * glow,
        0.95 + 0.45 * pale + 0.80 * glow,
    ];
    let grass = [0.62, 0.58, 0.36];
    let above = smooth_inside(-up, 0.04);
    [0, 1, 2].map(|c: usize| above * sky[c] + (1.0 - above) * grass[c])
}

/// After the CIE's standard overcast sky: three times as bright overhead as at the horizon.
fn overcast(omega: [f64; 3]) -> [f64; 3] {
    let [x, up, z] = omega;
    let sky = (1.0 + 2.0 * up.max(0.0)) / 3.0;
    // Towards where the sun would be.
    let side = 0.5 + 0.5 * (0.8 * x + 0.5 * up + 0.33 * z).clamp(-1.0, 1.0);
    let bright = sky * (0.55 + 1.1 * side * side);
    let floor = 0.28;
    let above = smooth_inside(-up, 0.25);
    let tint = [0.92 + 0.13 * side, 0.97 + 0.04 * side, 1.10 - 0.10 * side];
    tint.map(|tint| tint * (above * bright + (1.0 - above) * floor))
}

/// A lamp: a rounded rectangle in its own tangent plane.
struct Lamp {
    longitude_deg: f64,
    latitude_deg: f64,
    half_width: f64,
    half_height: f64,
    /// Softness of the edge, in the tangent plane.
    edge: f64,
    radiance: [f64; 3],
}

const LAMPS: [Lamp; 4] = [
    // Key: in front, to the right of the camera, high.
    Lamp {
        longitude_deg: 50.0,
        latitude_deg: 35.0,
        half_width: 0.35,
        half_height: 0.35,
        edge: 0.04,
        radiance: [13.0, 11.2, 9.0],
    },
    // Rim: a small, strong lamp behind to the left.
    Lamp {
        longitude_deg: -140.0,
        latitude_deg: 30.0,
        half_width: 0.09,
        half_height: 0.09,
        edge: 0.02,
        radiance: [120.0, 140.0, 170.0],
    },
    // Strip overhead, a little behind.
    Lamp {
        longitude_deg: 180.0,
        latitude_deg: 72.0,
        half_width: 0.6,
        half_height: 0.1,
        edge: 0.03,
        radiance: [7.0, 7.0, 7.0],
    },
    // Fill: large and weak, in front to the left.
    Lamp {
        longitude_deg: -60.0,
        latitude_deg: 5.0,
        half_width: 0.7,
        half_height: 0.9,
        edge: 0.2,
        radiance: [0.45, 0.5, 0.6],
    },
];

fn direction(longitude: f64, latitude: f64) -> [f64; 3] {
    let (sin_lon, cos_lon) = longitude.sin_cos();
    let (sin_lat, cos_lat) = latitude.sin_cos();
    [cos_lat * sin_lon, sin_lat, cos_lat * cos_lon]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// 1 well inside an edge, 0 well outside, smooth over the width `edge`.
fn smooth_inside(distance_outside: f64, edge: f64) -> f64 {
    let t = (0.5 - distance_outside / edge).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Lamp {
    fn weight(&self, omega: [f64; 3]) -> f64 {
        let (lon, lat) = (
            self.longitude_deg.to_radians(),
            self.latitude_deg.to_radians(),
        );
        let depth = dot(omega, direction(lon, lat));
        if depth <= 0.0 {
            return 0.0;
        }
        // Tangent plane: x along growing longitude, y along growing latitude.
        let x = dot(omega, [lon.cos(), 0.0, -lon.sin()]) / depth;
        let y = dot(omega, direction(lon, lat + PI / 2.0)) / depth;
        smooth_inside(x.abs() - self.half_width, self.edge)
            * smooth_inside(y.abs() - self.half_height, self.edge)
    }
}

/// A grey room, lighter above, with a slightly warm floor, and the lamps.
fn studio(omega: [f64; 3]) -> [f64; 3] {
    let up = 0.5 + 0.5 * omega[1];
    let mut sum = [0.10 + 0.10 * up, 0.10 + 0.11 * up, 0.09 + 0.14 * up];
    for lamp in &LAMPS {
        let weight = lamp.weight(omega);
        for (sum, radiance) in sum.iter_mut().zip(lamp.radiance) {
            *sum += weight * radiance;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_images::Map;

    #[test]
    fn maps_are_readable_and_clean() {
        for sky in Sky::ALL {
            let bytes = sky.exr_file(64).expect("an OpenEXR file");
            assert_eq!(bytes, sky.exr_file(64).expect("an OpenEXR file"));
            let map = Map::decode(&bytes).expect("a map");
            assert_eq!((map.width(), map.height()), (128, 64));
            assert!(map.faults().is_clean(), "{}", sky.name());
            let energy = map.energy();
            assert!(energy.iter().all(|e| *e > 1.0), "{energy:?}");
        }
    }

    /// The disc's energy does not depend on where pixels fall, and is most of the sunlight.
    #[test]
    fn the_sun_has_its_solid_angle_at_every_size() {
        let solid_angle = 2.0 * PI * (1.0 - SUN_RADIUS.cos());
        let exact = SUN_RADIANCE[0] * solid_angle;
        let energy = |height| {
            let bytes = Sky::Sun.exr_file(height).expect("an OpenEXR file");
            Map::decode(&bytes).expect("a map").energy()[0]
        };
        let sky = {
            let mut sum = 0.0;
            let height = 256;
            for y in 0..height {
                let latitude = PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height));
                for x in 0..2 * height {
                    let longitude = PI - PI * (f64::from(x) + 0.5) / f64::from(height);
                    let pixel = latitude.cos() * (PI / f64::from(height)).powi(2);
                    sum += pixel * clear_sky(direction(longitude, latitude))[0];
                }
            }
            sum
        };
        for height in [96, 256] {
            let found = energy(height) - sky;
            assert!(
                (found / exact - 1.0).abs() < 0.01,
                "{height}: {found} {exact}"
            );
        }
        assert!(exact > sky, "the sun outshines the sky: {exact} {sky}");
    }

    #[test]
    fn the_samples_map_is_the_studio() {
        let sample = strandlight_data::SAMPLE_MAP;
        let sample = Map::decode(sample).expect("part of the project");
        let drawn = Sky::Studio.exr_file(128).expect("an OpenEXR file");
        let drawn = Map::decode(&drawn).expect("a map");
        for (a, b) in sample.pixels().iter().zip(drawn.pixels()) {
            for c in 0..3 {
                // Half a unit in the last place of a half float, where libraries' sines differ.
                assert!((a[c] - b[c]).abs() <= 1e-3 * a[c], "{a:?} {b:?}");
            }
        }
    }
}
