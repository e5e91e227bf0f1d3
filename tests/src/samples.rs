//! Files as other programs write them: made here, and real ones where a folder of them is named.

use std::io::Cursor;
use std::path::PathBuf;

use exr::prelude::{
    Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder, SpecificChannels,
    Vec2, WritableImage, f16,
};
use strandlight_bake::maps::Sky;

use crate::random::SplitMix64;

/// Folder of real files that tests check besides those that they make: environment maps in `env`,
/// hair in `hair`.
const FOLDER: &str = "STRANDLIGHT_SAMPLES";

/// A real file, where the environment variable `STRANDLIGHT_SAMPLES` names a folder of them.
///
/// # Panics
/// If it names a folder without that file: nothing is skipped in silence.
pub fn real_file(relative: &str) -> Option<PathBuf> {
    let path = PathBuf::from(std::env::var_os(FOLDER)?).join(relative);
    assert!(path.is_file(), "{FOLDER}: there is no {}", path.display());
    Some(path)
}

/// A `.hair` file of `n_strands` strands of `n_points` points each: a wig that hangs from a ball of
/// 9 cm, z up, in cm. As the models of Cem Yuksel it has points and colours, and the header's
/// number of segments for all strands.
pub fn hair_file(n_strands: u32, n_points: u32) -> Vec<u8> {
    const POINTS_AND_COLORS: u32 = 2 | 16;
    let mut bytes = b"HAIR".to_vec();
    for word in [
        n_strands,
        n_strands * n_points,
        POINTS_AND_COLORS,
        n_points - 1,
    ] {
        bytes.extend(word.to_le_bytes());
    }
    // Thickness, transparency, colour.
    for default in [0.03_f32, 0.4, 1.0, 0.9, 0.6] {
        bytes.extend(default.to_le_bytes());
    }
    let mut about = b"a wig made by a test".to_vec();
    about.resize(88, 0);
    bytes.extend(about);
    let mut random = SplitMix64(3);
    for _ in 0..n_strands {
        let (azimuth, height) = (random.uniform(-3.1, 3.1), random.uniform(0.0, 1.0));
        let out = (1.0 - height * height).sqrt();
        let (x, y) = (out * f64::cos(azimuth), out * f64::sin(azimuth));
        for ix in 0..n_points {
            let way = f64::from(ix) / f64::from(n_points - 1);
            let radius = 9.0 + 3.0 * way + 0.3 * (20.0 * way + azimuth).sin();
            let z = 9.0 * height - 22.0 * way * way;
            for value in [x * radius, y * radius, z] {
                bytes.extend((value as f32).to_le_bytes());
            }
        }
    }
    for _ in 0..n_strands * n_points {
        for value in [1.0_f32, 0.9, 0.6] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// An OpenEXR map of 64 x 32 pixels in half floats.
///
/// # Panics
/// If the encoder has no such compression.
pub fn exr_map(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let size = Vec2(64, 32);
    let pixel = |at: Vec2<usize>| {
        use std::f64::consts::PI;
        let latitude = PI * (0.5 - (at.1 as f64 + 0.5) / 32.0);
        let longitude = PI - PI * (at.0 as f64 + 0.5) / 32.0;
        let (sin, cos) = longitude.sin_cos();
        let direction = [latitude.cos() * sin, latitude.sin(), latitude.cos() * cos];
        let [r, g, b] = Sky::Studio.radiance(direction).map(f16::from_f64);
        (r, g, b)
    };
    let encoding = Encoding {
        compression,
        blocks,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(
        size,
        LayerAttributes::named("map"),
        encoding,
        SpecificChannels::rgb(pixel),
    );
    let mut bytes = Cursor::new(Vec::new());
    let written = Image::from_layer(layer).write().to_buffered(&mut bytes);
    written.expect("the exr crate writes this");
    bytes.into_inner()
}
