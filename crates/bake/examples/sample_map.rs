//! Writes the environment map of the bundled sample, `data/sample/studio.exr`: a studio with a
//! warm key softbox, a cool rim light, a strip overhead and a dim room, drawn by formulas.
//!
//! ```text
//! cargo run -p strandlight-bake --example sample_map -- data/sample/studio.exr
//! ```

use std::f64::consts::PI;

use exr::prelude::{Compression, Encoding, Image, Layer, LayerAttributes, SpecificChannels};
use exr::prelude::{WritableImage, f16};

const WIDTH: usize = 256;
const HEIGHT: usize = 128;

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

fn radiance(omega: [f64; 3]) -> [f64; 3] {
    // A grey room, lighter above, with a slightly warm floor.
    let up = 0.5 + 0.5 * omega[1];
    let room = [0.10 + 0.10 * up, 0.10 + 0.11 * up, 0.09 + 0.14 * up];
    let mut sum = room;
    for lamp in &LAMPS {
        let weight = lamp.weight(omega);
        for (sum, radiance) in sum.iter_mut().zip(lamp.radiance) {
            *sum += weight * radiance;
        }
    }
    sum
}

fn main() {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: sample_map OUT.exr");
        std::process::exit(2);
    };
    let channels = SpecificChannels::rgb(|position: exr::math::Vec2<usize>| {
        let latitude = PI * (0.5 - (position.y() as f64 + 0.5) / HEIGHT as f64);
        let longitude = PI - 2.0 * PI * (position.x() as f64 + 0.5) / WIDTH as f64;
        let [r, g, b] = radiance(direction(longitude, latitude)).map(f16::from_f64);
        (r, g, b)
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        ..Encoding::FAST_LOSSLESS
    };
    let layer = Layer::new(
        (WIDTH, HEIGHT),
        LayerAttributes::named("studio"),
        encoding,
        channels,
    );
    if let Err(error) = Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_file(&path)
    {
        eprintln!("sample_map: {path}: {error}");
        std::process::exit(2);
    }
}
