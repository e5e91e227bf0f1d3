//! Numbers that say how far a picture is from its reference.

use serde::Serialize;

use super::{CompareError, Layer};

/// How picture A differs from its reference B.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width and height in pixels (blocks, where blocks were averaged).
    pub size: [usize; 2],
    /// Over pixels where A or B has alpha above 0, of those of the two that are not opaque
    /// everywhere: a background hides where the hair is. All pixels where both are.
    pub hair: Region,
    /// Over all pixels.
    pub whole: Region,
    /// The largest difference of one channel of one pixel.
    pub max: Worst,
}

/// Statistics over a set of pixels. Colours are linear with alpha multiplied in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Region {
    /// Number of pixels.
    pub pixels: usize,
    /// `sqrt(mean (a - b)^2 / mean b^2)` over pixels and channels.
    pub relative_rmse: f64,
    /// `mean a / mean b` per channel; null where B is black.
    pub mean_ratio: [Option<f64>; 3],
    /// `mean (a - b)` per channel.
    pub bias: [f64; 3],
    /// `mean (a - b) / mean b` over all channels; null where B is black.
    pub relative_bias: Option<f64>,
    /// The relative RMSE that the variance layers (of B, and of A where it has one) explain:
    /// `sqrt(mean variance / mean b^2)`. Null without a variance layer.
    pub relative_rmse_noise: Option<f64>,
    /// `sqrt(relative_rmse^2 - relative_rmse_noise^2)`, 0 if noise explains everything: an
    /// estimate of what would remain with noiseless pictures.
    pub relative_rmse_without_noise: Option<f64>,
}

/// One channel of one pixel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Column, from the left.
    pub x: usize,
    /// Row, from the top.
    pub y: usize,
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Value of A.
    pub a: f32,
    /// Value of B.
    pub b: f32,
}

/// Compares `a` with the reference `b`.
///
/// # Errors
/// Different sizes; a linear picture and one that is tone mapped already; a black reference,
/// which nothing can be relative to.
pub fn compare(a: &Layer, b: &Layer) -> Result<Comparison, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::Sizes {
            a: [a.width, a.height],
            b: [b.width, b.height],
        });
    }
    if a.is_display != b.is_display {
        return Err(CompareError::Kinds);
    }
    if b.rgb.iter().all(|rgb| *rgb == [0.0; 3]) {
        return Err(CompareError::BlackReference);
    }
    let mask = hair_mask(a, b);
    Ok(Comparison {
        size: [a.width, a.height],
        hair: region(a, b, |ix| mask[ix]),
        whole: region(a, b, |_| true),
        max: worst(a, b),
    })
}

/// See [`Comparison::hair`].
pub(super) fn hair_mask(a: &Layer, b: &Layer) -> Vec<bool> {
    let telling: Vec<&[f32]> = [a, b]
        .into_iter()
        .map(|layer| layer.alpha.as_slice())
        .filter(|alpha| alpha.iter().any(|x| *x < 1.0))
        .collect();
    (0..a.alpha.len())
        .map(|ix| telling.is_empty() || telling.iter().any(|alpha| alpha[ix] > 0.0))
        .collect()
}

fn region(a: &Layer, b: &Layer, contains: impl Fn(usize) -> bool) -> Region {
    let mut pixels = 0;
    let (mut sum_a, mut sum_b) = ([0.0; 3], [0.0; 3]);
    let (mut square, mut norm, mut variance) = (0.0, 0.0, 0.0);
    let variances = [&a.variance, &b.variance];
    for ix in (0..a.rgb.len()).filter(|ix| contains(*ix)) {
        pixels += 1;
        for c in 0..3 {
            let (x, y) = (f64::from(a.rgb[ix][c]), f64::from(b.rgb[ix][c]));
            sum_a[c] += x;
            sum_b[c] += y;
            square += (x - y) * (x - y);
            norm += y * y;
            for of_picture in variances.into_iter().flatten() {
                variance += f64::from(of_picture[ix][c]);
            }
        }
    }
    let count = f64::from(u32::try_from(pixels.max(1)).unwrap_or(u32::MAX));
    let ratio = |over: f64, under: f64| (under != 0.0).then(|| over / under);
    // Without a pixel nothing differs; where B is black and A is not, the ratio is infinite.
    let relative = |square: f64| if square > 0.0 { square / norm } else { 0.0 };
    let squared = relative(square);
    let noise = b.variance.is_some().then(|| relative(variance));
    let all = |sums: [f64; 3]| sums.iter().sum::<f64>();
    Region {
        pixels,
        relative_rmse: squared.sqrt(),
        mean_ratio: [0, 1, 2].map(|c| ratio(sum_a[c], sum_b[c])),
        bias: [0, 1, 2].map(|c| (sum_a[c] - sum_b[c]) / count),
        relative_bias: ratio(all(sum_a) - all(sum_b), all(sum_b)),
        relative_rmse_noise: noise.map(f64::sqrt),
        relative_rmse_without_noise: noise.map(|noise| (squared - noise).max(0.0).sqrt()),
    }
}

fn worst(a: &Layer, b: &Layer) -> Worst {
    let mut place = (0, 0);
    let mut largest = -1.0;
    for (ix, (x, y)) in a.rgb.iter().zip(&b.rgb).enumerate() {
        for c in 0..3 {
            let difference = (x[c] - y[c]).abs();
            if difference > largest {
                largest = difference;
                place = (ix, c);
            }
        }
    }
    let (ix, channel) = place;
    Worst {
        x: ix % a.width,
        y: ix / a.width,
        channel,
        a: a.rgb[ix][channel],
        b: b.rgb[ix][channel],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(rgb: &[[f32; 3]], alpha: &[f32]) -> Layer {
        Layer::new(rgb.len(), 1, rgb.to_vec(), alpha.to_vec())
    }

    #[test]
    fn numbers_by_hand() {
        let b = layer(&[[1.0, 2.0, 2.0], [0.0; 3], [0.5; 3]], &[1.0, 0.0, 0.0]);
        let a = layer(&[[1.0, 2.0, 2.9], [0.0; 3], [0.5; 3]], &[1.0, 0.0, 0.0]);
        let result = compare(&a, &b).expect("comparable");
        assert_eq!((result.hair.pixels, result.whole.pixels), (1, 3));
        // 0.9 / sqrt(1 + 4 + 4)
        assert!((result.hair.relative_rmse - 0.3).abs() < 1e-6);
        assert!((result.whole.relative_rmse - 0.9 / 9.75_f64.sqrt()).abs() < 1e-6);
        assert_eq!(result.hair.mean_ratio[0], Some(1.0));
        assert!((result.hair.mean_ratio[2].expect("not black") - 1.45).abs() < 1e-6);
        assert!((result.whole.bias[2] - 0.3).abs() < 1e-6);
        assert!((result.hair.relative_bias.expect("not black") - 0.18).abs() < 1e-6);
        assert_eq!(result.hair.relative_rmse_noise, None);
        let max = &result.max;
        assert_eq!(
            (max.x, max.y, max.channel, max.a, max.b),
            (0, 0, 2, 2.9, 2.0)
        );
    }

    #[test]
    fn a_background_does_not_count_as_hair_where_one_picture_knows_better() {
        let b = layer(&[[1.0; 3], [0.5; 3]], &[0.3, 0.0]);
        let opaque = layer(&[[1.0; 3], [9.0; 3]], &[1.0, 1.0]);
        let pixels = |a: &Layer, b: &Layer| compare(a, b).expect("comparable").hair.pixels;
        assert_eq!(pixels(&opaque, &b), 1);
        assert_eq!(pixels(&b, &opaque), 1);
        assert_eq!(pixels(&opaque, &opaque), 2);
    }

    #[test]
    fn noise_is_subtracted() {
        // A constant against itself plus noise of known variance.
        let n = 10_000;
        let noise = |ix: usize| 0.1 * if ix.is_multiple_of(2) { 1.0_f32 } else { -1.0 };
        let a = Layer::new(n, 1, vec![[1.2; 3]; n], vec![1.0; n]);
        let rgb = (0..n).map(|ix| [1.0 + noise(ix); 3]).collect();
        let mut b = Layer::new(n, 1, rgb, vec![1.0; n]);
        b.variance = Some(vec![[0.01; 3]; n]);
        let hair = compare(&a, &b).expect("comparable").hair;
        let norm = 1.01_f64.sqrt();
        let close = |x: Option<f64>, y: f64| (x.expect("there") - y).abs() < 1e-5;
        assert!((hair.relative_rmse - 0.05_f64.sqrt() / norm).abs() < 1e-5);
        assert!(close(hair.relative_rmse_noise, 0.1 / norm));
        assert!(
            close(hair.relative_rmse_without_noise, 0.2 / norm),
            "{hair:?}"
        );
        // Averaging pairs leaves no noise; the variance layer says half.
        let hair = compare(&a.boxed(2), &b.boxed(2)).expect("comparable").hair;
        assert!((hair.relative_rmse - 0.2).abs() < 1e-5, "{hair:?}");
        assert!(close(hair.relative_rmse_noise, 0.005_f64.sqrt()));
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let one = layer(&[[1.0; 3]], &[1.0]);
        let black = layer(&[[0.0; 3]], &[1.0]);
        let two = layer(&[[1.0; 3]; 2], &[1.0; 2]);
        let mut display = one.clone();
        display.is_display = true;
        for (a, b) in [(&one, &black), (&one, &two), (&one, &display)] {
            assert!(compare(a, b).is_err());
        }
        assert!(compare(&black, &one).is_ok());
    }
}
