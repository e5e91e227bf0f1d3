//! Absorption from what a person can name: a colour, or pigments.
//!
//! All absorptions are per fibre radius, as everywhere here: light that crosses a fibre of unit
//! radius along its diameter keeps `exp(-2 sigma_a)`.

use std::f64::consts::PI;

/// Largest absorption of the model, per fibre radius; what black asks for is cut off there.
pub const MAX_SIGMA_A: f64 = 50.0;

/// Absorption of eumelanin of concentration 1, linear RGB (d'Eon et al. 2011, as pbrt has them).
pub const EUMELANIN: [f64; 3] = [0.419, 0.697, 1.37];

/// Absorption of pheomelanin of concentration 1, likewise.
pub const PHEOMELANIN: [f64; 3] = [0.187, 0.4, 1.05];

/// Absorption of fibres with these concentrations of pigments.
pub fn sigma_a_from_melanin(eumelanin: f64, pheomelanin: f64) -> [f64; 3] {
    std::array::from_fn(|channel| {
        let sum = eumelanin * EUMELANIN[channel] + pheomelanin * PHEOMELANIN[channel];
        sum.min(MAX_SIGMA_A)
    })
}

/// Factors on the absorption (linear RGB) of melanin that is by so much redder:
/// `(P_c / E_c)^redness` over the geometric mean of the three, P pheomelanin's and E eumelanin's
/// absorption. 1 turns the spectrum of [`EUMELANIN`] into that of [`PHEOMELANIN`], -1 is as far the
/// other way, 0 leaves it. The geometric mean of absorption stays, so hair changes its hue and
/// keeps its darkness, about; other pigments, such as dyes, are turned the same way.
pub fn redness_factors(redness: f64) -> [f64; 3] {
    let ratio: [f64; 3] = std::array::from_fn(|c| (PHEOMELANIN[c] / EUMELANIN[c]).ln());
    let mean = ratio.iter().sum::<f64>() / 3.0;
    ratio.map(|ratio| (redness * (ratio - mean)).exp())
}

/// Chiang et al. 2016's azimuthal roughness beta_N, 0..=1, of lobes that are blurred as TRT is
/// here by `caustic_width` (Xu's w_c, radians).
///
/// Chiang et al. blur every lobe by a logistic distribution of scale
/// `s = sqrt(pi/8) (0.265 beta_N + 1.194 beta_N^2 + 5.372 beta_N^22)`, whose standard deviation
/// is `pi s / sqrt(3)`; ours is a circular Gaussian of standard deviation `w_c / sqrt(2)`. The
/// roughness is that of equal standard deviations. The term of degree 22 is left out: it counts
/// above beta_N 0.75, w_c 1.4 rad.
pub fn azimuthal_roughness(caustic_width: f64) -> f64 {
    let scale = caustic_width / std::f64::consts::SQRT_2 * 3.0_f64.sqrt() / PI;
    let sum = scale / (PI / 8.0).sqrt();
    // The root of 1.194 x^2 + 0.265 x = sum.
    let (a, b) = (1.194, 0.265);
    let root = 2.0 * sum / (b + (b * b + 4.0 * a * sum).sqrt());
    root.clamp(0.0, 1.0)
}

/// The root of absorption times this is the logarithm of 1 / reflectance: Chiang et al. 2016's
/// fit to whole heads of path-traced hair.
fn log_reflectance_slope(roughness: f64) -> f64 {
    let b = roughness;
    // 5.969 - 0.215 b + 2.532 b^2 - 10.73 b^3 + 5.574 b^4 + 0.245 b^5
    5.969 + b * (-0.215 + b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245))))
}

/// Absorption of fibres whose multiple scattering makes a head of hair of colour `reflectance`,
/// linear RGB, 0..=1: `sigma_a = (ln c / p(beta_N))^2` (Chiang et al. 2016, section 4.2), with the
/// roughness of [`azimuthal_roughness`]. Black would take an infinite absorption: at most
/// [`MAX_SIGMA_A`].
///
/// The fit was made to Chiang's lobes at one index and tilt; with Marschner's lobes and other
/// parameters the colour comes out near, not exactly.
pub fn sigma_a_from_reflectance(reflectance: [f64; 3], caustic_width: f64) -> [f64; 3] {
    let slope = log_reflectance_slope(azimuthal_roughness(caustic_width));
    reflectance.map(|c| {
        let root = c.clamp(0.0, 1.0).ln() / slope;
        (root * root).min(MAX_SIGMA_A)
    })
}

/// Inverse of [`sigma_a_from_reflectance`], below its limit.
pub fn reflectance_from_sigma_a(sigma_a: [f64; 3], caustic_width: f64) -> [f64; 3] {
    let slope = log_reflectance_slope(azimuthal_roughness(caustic_width));
    sigma_a.map(|sigma| (-slope * sigma.max(0.0).sqrt()).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn redness_leads_from_eumelanin_to_pheomelanin() {
        let mean = |rgb: [f64; 3]| rgb.iter().product::<f64>().cbrt();
        let factors = redness_factors(1.0);
        let turned: [f64; 3] = std::array::from_fn(|c| EUMELANIN[c] * factors[c]);
        for c in 0..3 {
            let expected = PHEOMELANIN[c] / mean(PHEOMELANIN);
            assert!((turned[c] / mean(turned) - expected).abs() < 1e-12);
        }
        assert_eq!(redness_factors(0.0), [1.0; 3]);
        for redness in [-2.0, -0.5, 0.3, 4.0] {
            let factors = redness_factors(redness);
            assert!((mean(factors) - 1.0).abs() < 1e-12);
            // Less in red, more in blue: redder.
            assert_eq!(factors[0] < 1.0 && factors[2] > 1.0, redness > 0.0);
        }
    }

    #[test]
    fn melanin_is_that_of_the_presets() {
        // data/presets/{blond,brown,black}.toml, four digits.
        for (eumelanin, expected) in [
            (0.3, [0.1257, 0.2091, 0.411]),
            (1.3, [0.5447, 0.9061, 1.781]),
            (8.0, [3.352, 5.576, 10.96]),
        ] {
            let found = sigma_a_from_melanin(eumelanin, 0.0);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
        let red = sigma_a_from_melanin(0.1, 0.9);
        assert!((red[2] - (0.137 + 0.945)).abs() < 1e-12);
        assert_eq!(sigma_a_from_melanin(100.0, 100.0), [MAX_SIGMA_A; 3]);
    }

    #[test]
    fn roughness_has_the_standard_deviation_of_the_caustic() {
        for step in 0..=60 {
            let width = 0.01 + 0.02 * f64::from(step);
            let b = azimuthal_roughness(width);
            let scale = (PI / 8.0).sqrt() * (0.265 * b + 1.194 * b * b);
            let deviation = PI * scale / 3.0_f64.sqrt();
            let expected = width / 2.0_f64.sqrt();
            assert!((deviation - expected).abs() < 1e-12, "{width}: {b}");
            // What the term of degree 22 would add.
            assert!(5.372 * b.powi(22) < 0.04, "{width}: {b}");
        }
    }

    #[test]
    fn reflectance_falls_with_absorption_and_comes_back() {
        for width in [0.01, 0.08, 0.15, 0.4, 1.0, 1.5] {
            let mut before = f64::INFINITY;
            for step in 0..=200 {
                let c = f64::from(step) / 200.0;
                let [sigma, ..] = sigma_a_from_reflectance([c; 3], width);
                assert!(sigma.is_finite() && sigma < before, "{width} {c}: {sigma}");
                before = sigma;
                let [back, ..] = reflectance_from_sigma_a([sigma; 3], width);
                assert!(c == 0.0 || (back - c).abs() < 1e-12, "{width} {c}: {back}");
            }
            assert_eq!(before, 0.0, "white absorbs nothing");
            assert_eq!(sigma_a_from_reflectance([0.0; 3], width), [MAX_SIGMA_A; 3]);
        }
    }

    /// Worked by hand from the published polynomial.
    #[test]
    fn golden_values() {
        for (b, slope) in [
            (0.0, 5.969),
            (0.3, 5.888_414_75),
            (0.5, 5.509281_25),
            (1.0, 3.375),
        ] {
            let found = log_reflectance_slope(b);
            assert!((found - slope).abs() < 1e-6, "{b}: {found}");
        }
        // Default caustic: 6 degrees.
        let width = 6.0_f64.to_radians() * 2.0_f64.sqrt();
        let b = azimuthal_roughness(width);
        assert!((b - 0.188_155).abs() < 1e-5, "{b}");
        let sigma = sigma_a_from_reflectance([0.5, 0.2, 0.05], width);
        for (found, expected) in sigma.into_iter().zip([0.013_554, 0.073_075, 0.253_177]) {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
    }
}
