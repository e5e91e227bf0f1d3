//! Special functions in single precision. Twin: `shaders/lib/special.wgsl`.

/// exp(-x^2) and erf(x), which share the exponential.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErfPair {
    /// exp(-x^2).
    pub gauss: f32,
    /// erf(x).
    pub erf: f32,
}

/// erf by Abramowitz and Stegun 7.1.25 (Xu 2011, preprint App E), odd-extended; absolute error
/// at most 2.5e-5 for every finite x.
pub fn erf_pair(x: f32) -> ErfPair {
    let gauss = (-x * x).exp();
    let t = 1.0 / (1.0 + 0.47047 * x.abs());
    let tail = t * (0.348_024_2 + t * (-0.095_879_8 + t * 0.747_855_6)) * gauss;
    ErfPair {
        gauss,
        erf: if x >= 0.0 { 1.0 - tail } else { tail - 1.0 },
    }
}

/// exp(-x) I_0(x) for x >= 0: Abramowitz and Stegun 9.8.1 and 9.8.2; relative error at most 5e-7.
#[allow(clippy::excessive_precision, reason = "coefficients as published")]
pub fn bessel_i0e(x: f32) -> f32 {
    if x < 3.75 {
        let t = x / 3.75;
        let y = t * t;
        return (-x).exp()
            * (1.0
                + y * (3.5156229
                    + y * (3.0899424
                        + y * (1.2067492 + y * (0.2659732 + y * (0.0360768 + y * 0.0045813))))));
    }
    let y = 3.75 / x;
    (0.39894228
        + y * (0.01328592
            + y * (0.00225319
                + y * (-0.00157565
                    + y * (0.00916281
                        + y * (-0.02057706
                            + y * (0.02635537 + y * (-0.01647633 + y * 0.00392377))))))))
        / x.sqrt()
}

/// exp(-x) I_0(x) for 0 <= x <= 1e7 without exp or branch, as the root of a rational function
/// that keeps the asymptote 1 / sqrt(2 pi x); relative error at most 3e-5.
pub fn bessel_i0e_fast(x: f32) -> f32 {
    let above =
        1.0 + x * (0.343_181_3 + x * (0.294_527_95 + x * (0.070_811_33 + x * 0.048_390_61)));
    let below = 1.0
        + x * (2.345_570_3
            + x * (2.450_324_8 + x * (1.626_881_6 + x * (0.371_785_04 + x * 0.304_031_85))));
    (above / below).sqrt()
}

/// exp(-x) I_1(x) for x >= 0: Abramowitz and Stegun 9.8.3 and 9.8.4; relative error at most 5e-7.
#[allow(clippy::excessive_precision, reason = "coefficients as published")]
pub fn bessel_i1e(x: f32) -> f32 {
    if x < 3.75 {
        let t = x / 3.75;
        let y = t * t;
        return (-x).exp()
            * x
            * (0.5
                + y * (0.87890594
                    + y * (0.51498869
                        + y * (0.15084934
                            + y * (0.02658733 + y * (0.00301532 + y * 0.00032411))))));
    }
    let y = 3.75 / x;
    (0.39894228
        + y * (-0.03988024
            + y * (-0.00362018
                + y * (0.00163801
                    + y * (-0.01031555
                        + y * (0.02282967
                            + y * (-0.02895312 + y * (0.01787654 - y * 0.00420059))))))))
        / x.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// I_n by its power series times exp(-x), in double precision; exact for x <= 60.
    fn ine(n: u32, x: f64) -> f64 {
        let mut term = (1..=n).fold(1.0, |t, i| t * x / 2.0 / f64::from(i));
        let mut sum = 0.0;
        for k in 1..200u32 {
            sum += term;
            term *= x * x / 4.0 / f64::from(k) / f64::from(k + n);
        }
        sum * (-x).exp()
    }

    #[test]
    fn bessel_functions_match_their_series() {
        for i in 0..=600 {
            let x = f64::from(i) * 0.1;
            for (value, exact) in [
                (bessel_i0e(x as f32), ine(0, x)),
                (bessel_i1e(x as f32), ine(1, x)),
            ] {
                // 6 ulp of single precision on top of the published bound.
                let tolerance = 1.2e-6 * exact + 1e-12;
                assert!(
                    (f64::from(value) - exact).abs() < tolerance,
                    "{x} {value} {exact}"
                );
            }
        }
        for i in -60..=140 {
            let x = 10f64.powf(f64::from(i) * 0.05) as f32;
            let ratio = bessel_i0e_fast(x) / bessel_i0e(x);
            assert!((ratio - 1.0).abs() < 3e-5, "{x} {ratio}");
        }
        assert_eq!(bessel_i0e_fast(0.0), 1.0);
        // Asymptote 1/sqrt(2 pi x) (1 + 1/(8x)).
        let x = 2e6f32;
        let limit = 1.0 / (2.0 * std::f32::consts::PI * x).sqrt();
        assert!((bessel_i0e(x) / limit - 1.0).abs() < 1e-6);
    }

    #[test]
    fn erf_is_odd_and_within_its_bound() {
        // erf(0.5), erf(1), erf(2) to ten digits.
        for (x, exact) in [
            (0.0, 0.0),
            (0.5, 0.520_499_877_8),
            (1.0, 0.842_700_792_9),
            (2.0, 0.995_322_265_0),
            (9.0, 1.0f64),
        ] {
            assert!((f64::from(erf_pair(x as f32).erf) - exact).abs() < 2.6e-5);
            assert!((f64::from(erf_pair(-x as f32).erf) + exact).abs() < 2.6e-5);
        }
        assert_eq!(
            erf_pair(-1e6),
            ErfPair {
                gauss: 0.0,
                erf: -1.0
            }
        );
    }
}
