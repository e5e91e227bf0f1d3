//! The map itself, smaller, for the background of pictures.

use std::f64::consts::PI;
use std::ops::Range;

use rayon::prelude::*;
use strandlight_formats::{Error, Panorama, PanoramaSource, Result};
use strandlight_images::Map;

/// A panorama of `map`, `width` texels wide, or as wide as the map where that is less: each texel is the mean radiance of
/// the part of the sphere that it covers, so that the energy stays. Equal maps give equal panoramas.
///
/// # Errors
/// `Value`: a width that is odd, or that no panorama has.
pub fn panorama(map: &Map, width: u32) -> Result<Panorama> {
    if !width.is_multiple_of(2) {
        return Err(Error::Value {
            file: Default::default(),
            line: None,
            key: "width of the panorama".to_owned(),
            value: width.to_string(),
            range: "even".to_owned(),
        });
    }
    // At most 32768: fits.
    let width = width.min(map.width() as u32);
    let pixels = match width as usize == map.width() {
        true => map.pixels().to_vec(),
        false => means(map, width as usize),
    };
    let mut panorama = Panorama::from_pixels(width, &pixels)?;
    panorama.source = PanoramaSource {
        map_hash: map.source().hash.clone(),
        map_size: [map.width() as u32, map.height() as u32],
        parameters: map.parameters(),
        ..PanoramaSource::default()
    };
    Ok(panorama)
}

/// Means of `map` over the texels of a smaller one.
fn means(map: &Map, width: usize) -> Vec<[f32; 3]> {
    let height = width / 2;
    let columns: Vec<_> = (0..width).map(|i| part(i, width, map.width())).collect();
    let rows = (0..height).into_par_iter().flat_map_iter(|j| {
        let (from, to) = part(j, height, map.height());
        let mut sums = vec![[0.0; 3]; width];
        let mut whole = 0.0;
        for row in cells(from, to) {
            let weight = band(from.max(row as f64), to.min((row + 1) as f64), map.height());
            whole += weight;
            let pixels = map.row(row);
            for (sum, &(left, right)) in sums.iter_mut().zip(&columns) {
                for column in cells(left, right) {
                    let share = right.min((column + 1) as f64) - left.max(column as f64);
                    for (sum, x) in sum.iter_mut().zip(pixels[column]) {
                        *sum += weight * share * f64::from(x);
                    }
                }
            }
        }
        let area = whole * (map.width() as f64 / width as f64);
        sums.into_iter()
            .map(move |sum| sum.map(|x| (x / area) as f32))
    });
    rows.collect()
}

/// Where part `ix` of `n` equal ones of `length` starts and ends.
fn part(ix: usize, n: usize, length: usize) -> (f64, f64) {
    let at = |ix: usize| (ix * length) as f64 / n as f64;
    (at(ix), at(ix + 1))
}

/// The pixels that `from..to` touches.
fn cells(from: f64, to: f64) -> Range<usize> {
    from.floor() as usize..to.ceil() as usize
}

/// What the rows `from..to` of `height` have of the sphere, in proportion: the difference of the sines of their
/// latitudes, by the product formula.
fn band(from: f64, to: f64, height: usize) -> f64 {
    let step = PI / height as f64;
    let middle = PI / 2.0 - step * 0.5 * (from + to);
    2.0 * middle.cos() * (0.5 * step * (to - from)).sin()
}

#[cfg(test)]
mod tests {
    use strandlight_formats::BakedFile;
    use strandlight_images::LatLong;

    use super::*;

    /// A map of 12 x 6 whose pixels all differ.
    fn map() -> Map {
        let pixel = |ix: usize| [ix as f32 + 1.0, (ix * ix % 17) as f32, 0.25];
        Map::new(12, 6, (0..72).map(pixel).collect()).expect("a map")
    }

    #[test]
    fn texels_are_means_over_what_they_cover() {
        let map = map();
        let small = panorama(&map, 4).expect("valid");
        assert_eq!((small.width(), small.height()), (4, 2));
        let grid = map.grid();
        let mut n_checked = 0;
        for j in 0..2 {
            for i in 0..4 {
                // Three by three pixels each.
                let (mut sum, mut area) = ([0.0; 3], 0.0);
                for row in 3 * j..3 * j + 3 {
                    for pixel in &map.row(row)[3 * i..3 * i + 3] {
                        let weight = grid.solid_angle(row);
                        area += weight;
                        for (sum, x) in sum.iter_mut().zip(pixel) {
                            *sum += weight * f64::from(*x);
                        }
                    }
                }
                let found = small.pixels()[4 * j + i].map(f64::from);
                let wanted = sum.map(|x| x / area);
                let largest = wanted.into_iter().fold(0.0, f64::max);
                for (found, wanted) in found.into_iter().zip(wanted) {
                    assert!((found - wanted).abs() <= largest / 512.0, "{i}, {j}");
                    n_checked += 1;
                }
            }
        }
        assert_eq!(n_checked, 24);
    }

    #[test]
    fn energies_stay_where_texels_cut_pixels() {
        let map = map();
        let wanted = map.energy();
        for width in [4, 6, 8, 10, 12] {
            let pixels = match width {
                12 => map.pixels().to_vec(),
                _ => means(&map, width),
            };
            let grid = LatLong {
                width,
                height: width / 2,
            };
            let found = grid.energy(pixels.chunks_exact(width));
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found / wanted - 1.0).abs() < 1e-6, "{width}: {found}");
            }
        }
    }

    #[test]
    fn up_is_up_and_left_is_left() {
        // One bright pixel, up and to +X of the middle, which is +Z.
        let mut pixels = vec![[0.0; 3]; 64 * 32];
        pixels[8 * 64 + 16] = [9.0; 3];
        let map = Map::new(64, 32, pixels).expect("a map");
        let small = panorama(&map, 32).expect("valid");
        let texels = small.pixels();
        let bright = texels.iter().position(|rgb| rgb[0] > 0.0);
        assert_eq!(bright, Some(4 * 32 + 8));
        let grid = LatLong {
            width: 32,
            height: 16,
        };
        let [x, y, z] = grid.direction(8.5, 4.5);
        assert!(x > 0.5 && y > 0.5 && z.abs() < 0.2, "{x} {y} {z}");
        assert_eq!(texels.iter().filter(|rgb| rgb[0] > 0.0).count(), 1);
    }

    #[test]
    fn maps_do_not_grow_and_equal_maps_give_equal_files() {
        let map = map();
        let whole = panorama(&map, 2048).expect("valid");
        assert_eq!(whole.width(), 12);
        assert_eq!(whole.source.map_hash, map.source().hash);
        assert_eq!(whole.source.map_size, [12, 6]);
        let bytes = || panorama(&map, 8).expect("valid").to_bytes().expect("valid");
        assert!(bytes() == bytes());
        for width in [5, 2, 0] {
            assert!(panorama(&map, width).is_err(), "{width}");
        }
    }
}
