//! The error of a picture against a truth that is noisy itself.
//!
//! Of the truth `T` two independent estimates `A` and `B` are at hand. Their noise does not count on
//! average: a picture `P` has `|P - T|^2 = E (P - A)(P - B)` and the truth `|T|^2 = E A B`.

use strandlight_reference::compare::Layer;
use strandlight_scene::Picture;

/// Side in pixels of the blocks whose means are compared.
pub(super) const BLOCK: usize = 4;

/// Means of a picture over blocks.
pub(super) fn blocks(picture: &Picture) -> Layer {
    let (rgb, alpha) = picture
        .rgba
        .iter()
        .map(|&[r, g, b, a]| ([r, g, b], a))
        .unzip();
    Layer::new(picture.width as usize, picture.height as usize, rgb, alpha).boxed(BLOCK)
}

/// The truth by two independent estimates.
pub(super) struct Truth<'a> {
    halves: &'a [Layer; 2],
    /// Sum of the truth's squares.
    square: f64,
}

impl<'a> Truth<'a> {
    /// None if it is black.
    pub fn new(halves: &'a [Layer; 2]) -> Option<Self> {
        let [a, b] = halves;
        let square = sum(a, b, |a, b| a * b);
        (square > 0.0).then_some(Truth { halves, square })
    }

    /// Error of `picture`; none if noise hides it.
    pub fn relative_rmse(&self, picture: &Layer) -> Option<f64> {
        let square = self.mean_square(picture);
        (square > 0.0).then(|| square.sqrt())
    }

    /// The square of that; negative where noise says so, for those who add up.
    pub fn mean_square(&self, picture: &Layer) -> f64 {
        let [a, b] = self.halves;
        let off = |half: &Layer| -> Vec<[f32; 3]> {
            let pairs = picture.rgb.iter().zip(&half.rgb);
            pairs
                .map(|(p, h)| std::array::from_fn(|c| p[c] - h[c]))
                .collect()
        };
        let (off_a, off_b) = (off(a), off(b));
        let pairs = off_a.iter().flatten().zip(off_b.iter().flatten());
        let square: f64 = pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
        square / self.square
    }

    /// Relative RMSE of the mean of both.
    pub fn noise(&self) -> f64 {
        let [a, b] = self.halves;
        (sum(a, b, |a, b| (0.5 * (a - b)).powi(2)) / self.square).sqrt()
    }
}

/// Sum of `term` over the channels of two layers.
fn sum(a: &Layer, b: &Layer, term: impl Fn(f64, f64) -> f64) -> f64 {
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.map(|(a, b)| term(f64::from(*a), f64::from(*b))).sum()
}

#[cfg(test)]
mod tests {
    use strandlight_scattering::random::SplitMix64;

    use super::*;

    /// Two noisy estimates of a truth tell the error of a picture without their noise.
    #[test]
    fn noise_of_the_truth_does_not_count() {
        let n = 20_000;
        let layer = |value: &mut dyn FnMut() -> f32| {
            let rgb = (0..n).map(|_| [value(), value(), value()]).collect();
            Layer::new(n, 1, rgb, vec![1.0; n])
        };
        let mut random = SplitMix64(5);
        let mut noisy = || 1.0 + random.uniform(-0.3, 0.3) as f32;
        let halves = [layer(&mut noisy), layer(&mut noisy)];
        let picture = layer(&mut || 1.05);
        let truth = Truth::new(&halves).expect("not black");
        let error = truth.relative_rmse(&picture).expect("less noise");
        assert!((error - 0.05).abs() < 5e-3, "{error}");
        // Of either half 0.3 / sqrt(3), of their mean less by sqrt(2).
        let noise = 0.3 / 6.0_f64.sqrt();
        assert!((truth.noise() - noise).abs() < 2e-3, "{}", truth.noise());
        // Against one half alone the error would be that half's noise.
        let alone = sum(&picture, &halves[0], |a, b| (a - b).powi(2)) / truth.square;
        assert!(alone.sqrt() > 0.15);
        let black = [layer(&mut || 0.0), layer(&mut || 0.0)];
        assert!(Truth::new(&black).is_none());
    }
}
