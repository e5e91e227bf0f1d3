//! Maps for the background of pictures, and what is seen of them, computed anew.

use std::f64::consts::PI;

use strandlight_formats::Panorama;

/// A panorama of `width` whose texels are smooth stripes and a bright, narrow sun up to +X, different at any turn.
///
/// # Panics
/// If no panorama is of that width.
pub fn striped(width: u32) -> Panorama {
    let height = width / 2;
    let pixel = |ix: u32| {
        let lon = 2.0 * PI * (f64::from(ix % width) + 0.5) / f64::from(width);
        let lat = PI * (f64::from(ix / width) + 0.5) / f64::from(height);
        let stripe = 0.5 + 0.4 * (3.0 * lon).sin() * (2.0 * lat).cos();
        let slope = lat / PI;
        // A quarter from the left is +X.
        let sun = (-((lon - 0.5 * PI).powi(2) + (lat - 0.3 * PI).powi(2)) / 0.02).exp();
        [stripe + 40.0 * sun, slope + 30.0 * sun, 1.0 - stripe].map(|x| x as f32)
    };
    let pixels: Vec<[f32; 3]> = (0..width * height).map(pixel).collect();
    Panorama::from_pixels(width, &pixels).expect("a panorama")
}

/// Radiance of `panorama`, turned by `degrees`, from a direction: in double precision, by the convention of maps alone.
pub fn seen(panorama: &Panorama, degrees: f64, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = (-degrees).to_radians().sin_cos();
    let [x, z] = [cos * x + sin * z, cos * z - sin * x];
    let (width, height) = (i64::from(panorama.width()), i64::from(panorama.height()));
    let column = (PI - x.atan2(z)) / (2.0 * PI) * width as f64 - 0.5;
    let row = (0.5 - y.asin() / PI) * height as f64 - 0.5;
    let pixels = panorama.pixels();
    let texel = |i: i64, j: i64, c: usize| {
        let at = j.clamp(0, height - 1) * width + i.rem_euclid(width);
        f64::from(pixels[at as usize][c])
    };
    let (i, j) = (column.floor() as i64, row.floor() as i64);
    let (u, v) = (column - column.floor(), row - row.floor());
    std::array::from_fn(|c| {
        (1.0 - v) * ((1.0 - u) * texel(i, j, c) + u * texel(i + 1, j, c))
            + v * ((1.0 - u) * texel(i, j + 1, c) + u * texel(i + 1, j + 1, c))
    })
}

/// [`striped`] as a Radiance map, to the precision of that format.
///
/// # Panics
/// If no panorama is of that width.
pub fn striped_map(width: u32) -> Vec<u8> {
    let size = format!("-Y {} +X {width}\n", width / 2);
    let mut map = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}").into_bytes();
    for rgb in striped(width).pixels() {
        let largest = rgb.into_iter().fold(1e-3, f32::max);
        let exponent = largest.log2().floor() as i32 + 1;
        let scaled = rgb.map(|x| (256.0 * x / (exponent as f32).exp2()) as u8);
        map.extend(scaled);
        map.push((exponent + 128) as u8);
    }
    map
}
