//! Differences as pictures.

use strandlight_scene::{png_file, tone};

use super::statistics::hair_mask;
use super::{CompareError, FlipMap, Layer};

/// A PNG of the signed difference of luminance, `a - b`: white where there is none, red where A
/// is brighter, blue where B is; full colour at `scale` and beyond.
///
/// # Errors
/// Different sizes, or what the encoder says.
pub fn signed_png(a: &Layer, b: &Layer, scale: f64) -> Result<Vec<u8>, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::DifferenceSizes);
    }
    let pixels: Vec<[u8; 3]> = a
        .rgb
        .iter()
        .zip(&b.rgb)
        .map(|(a, b)| signed_color((luminance(*a) - luminance(*b)) / scale))
        .collect();
    encode(a.width, a.height, &pixels)
}

/// The usual `scale` of [`signed_png`]: half of the root mean square of B's luminance over the
/// hair, so that pictures of unlike brightness have like colours. 1 where B is black.
pub fn heat_scale(a: &Layer, b: &Layer) -> f64 {
    let mask = hair_mask(a, b);
    let hair = b.rgb.iter().zip(&mask).filter(|(_, is_hair)| **is_hair);
    let squares: f64 = hair.map(|(rgb, _)| luminance(*rgb).powi(2)).sum();
    let count = mask.iter().filter(|is_hair| **is_hair).count().max(1);
    let scale = 0.5 * (squares / count as f64).sqrt();
    if scale > 0.0 { scale } else { 1.0 }
}

/// A PNG of a FLIP map: black, purple, orange, pale yellow with growing error (an approximation
/// of the usual "magma" colours).
///
/// # Errors
/// What the encoder says.
pub fn flip_png(map: &FlipMap) -> Result<Vec<u8>, CompareError> {
    let pixels: Vec<[u8; 3]> = map.errors.iter().map(|x| magma(f64::from(*x))).collect();
    encode(map.width, map.height, &pixels)
}

fn luminance(rgb: [f32; 3]) -> f64 {
    tone::luminance(rgb.map(f64::from))
}

/// -1 blue, 0 white, 1 red.
fn signed_color(x: f64) -> [u8; 3] {
    let x = x.clamp(-1.0, 1.0);
    // Half way to a dark end, so that large differences keep apart.
    let fade = |to: [f64; 3]| {
        [0, 1, 2].map(|c: usize| {
            let value = 1.0 + x.abs() * (to[c] - 1.0);
            (255.0 * value).round() as u8
        })
    };
    if x < 0.0 {
        fade([0.05, 0.2, 0.75])
    } else {
        fade([0.75, 0.08, 0.05])
    }
}

fn magma(x: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.02],
        [0.23, 0.06, 0.44],
        [0.55, 0.16, 0.51],
        [0.87, 0.29, 0.41],
        [1.0, 0.62, 0.43],
        [0.99, 0.99, 0.75],
    ];
    let at = x.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (at as usize).min(STOPS.len() - 2);
    let t = at - below as f64;
    [0, 1, 2].map(|c| {
        let value = STOPS[below][c] * (1.0 - t) + STOPS[below + 1][c] * t;
        (255.0 * value).round() as u8
    })
}

fn encode(width: usize, height: usize, pixels: &[[u8; 3]]) -> Result<Vec<u8>, CompareError> {
    Ok(png_file::encode(
        [width as u32, height as u32],
        pixels,
        &[],
    )?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_have_their_colours() {
        assert_eq!(signed_color(0.0), [255; 3]);
        let [r, _, b] = signed_color(0.7);
        assert!(r > b);
        let [r, _, b] = signed_color(-0.7);
        assert!(b > r);
        assert_eq!(signed_color(9.0), signed_color(1.0));
        let sum = |x: f64| magma(x).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!((1..=50).all(|k| sum(f64::from(k) / 50.0) > sum(f64::from(k - 1) / 50.0)));
    }
}
