//! Error function, its complement, and Dawson's integral in f64.
//!
//! Series of positive terms where they converge, continued fractions in the tails; relative
//! error below 1e-14, tested against 30 digit values.

use std::f64::consts::PI;

const FRAC_2_SQRT_PI: f64 = std::f64::consts::FRAC_2_SQRT_PI;

/// `2/sqrt(pi) Int_0^x exp(-t^2) dt`.
pub fn erf(x: f64) -> f64 {
    let a = x.abs();
    if a > 6.0 {
        return 1.0f64.copysign(x);
    }
    if a > 2.5 {
        // Next to 1 fewer digits of the tail count the smaller it is.
        let levels = levels(a, 37.0 - a * a);
        return (1.0 - exp_minus_square(a) * erfcx_fraction(a, levels)).copysign(x);
    }
    // 2/sqrt(pi) e^(-x^2) sum 2^n x^(2n+1) / (2n+1)!! (DLMF 7.6.2)
    let square = a * a;
    let mut term = a;
    let mut sum = a;
    let mut n = 0.0;
    while term > sum * 1e-18 {
        n += 1.0;
        term *= 2.0 * square / (2.0 * n + 1.0);
        sum += term;
    }
    (FRAC_2_SQRT_PI * exp_minus_square(a) * sum).copysign(x)
}

/// `1 - erf(x)`, without cancellation in the right tail.
pub fn erfc(x: f64) -> f64 {
    if x.is_nan() {
        return x;
    }
    if x < 1.0 { 1.0 - erf(x) } else { erfc_tail(x) }
}

/// `exp(x^2) erfc(x)`; infinite below x = -26.6.
pub fn erfcx(x: f64) -> f64 {
    if x >= 1.0 {
        erfcx_tail(x)
    } else {
        erfc(x) / exp_minus_square(x)
    }
}

/// Dawson's integral `exp(-x^2) Int_0^x exp(t^2) dt`.
pub fn dawson(x: f64) -> f64 {
    let a = x.abs();
    let value = if a < 1e-4 {
        a * (1.0 - 2.0 / 3.0 * a * a)
    } else if a < 10.0 {
        rybicki(a)
    } else {
        // 1/(2x) sum (2n-1)!! / (2x^2)^n, smallest term e^(-x^2)
        let inverse = 0.5 / (a * a);
        let mut term = 1.0;
        let mut sum = 1.0;
        for n in 1..30 {
            term *= f64::from(2 * n - 1) * inverse;
            sum += term;
            if term < 1e-18 {
                break;
            }
        }
        0.5 / a * sum
    };
    value.copysign(x)
}

/// Rybicki 1989: `1/sqrt(pi) sum_{n odd} exp(-(x - n h)^2) / n`, error `exp(-(pi/2h)^2)`, here
/// 1e-26. The terms of n and -n are paired, so all are positive.
fn rybicki(a: f64) -> f64 {
    const STEP: f64 = 0.2;
    let mut sum = 0.0;
    let mut n = 1.0;
    loop {
        let centre = n * STEP;
        let near = (-(a - centre) * (a - centre)).exp();
        // exp(-(a-c)^2) - exp(-(a+c)^2) = exp(-(a-c)^2) (1 - exp(-4 a c))
        let term = -near * (-4.0 * a * centre).exp_m1() / n;
        sum += term;
        if centre > a && term < 1e-18 * sum {
            return sum / PI.sqrt();
        }
        n += 2.0;
    }
}

/// `exp(-x^2)` with the rounding of `x^2` made up for.
fn exp_minus_square(x: f64) -> f64 {
    let square = x * x;
    let rest = x.mul_add(x, -square);
    (-square).exp() * (1.0 - rest)
}

/// erfc for x >= 1.
fn erfc_tail(x: f64) -> f64 {
    if x > 28.0 {
        return 0.0;
    }
    exp_minus_square(x) * erfcx_tail(x)
}

/// exp(x^2) erfc(x) for x >= 1.
fn erfcx_tail(x: f64) -> f64 {
    erfcx_fraction(x, levels(x, 40.0))
}

/// Levels of [`erfcx_fraction`] that leave out no more than a few times `exp(-exponent)` of it: n leave out about
/// `exp(-2 x sqrt(2 n))`, and somewhat more where they are few.
fn levels(x: f64, exponent: f64) -> u32 {
    let exponent = exponent.max(0.0);
    (0.125 * (exponent / x).powi(2) + 0.3 * exponent) as u32 + 1
}

/// exp(x^2) erfc(x) for x >= 1: continued fraction `1/(x + (1/2)/(x + 1/(x + (3/2)/(x + ...` over
/// sqrt(pi) (DLMF 7.9.1), of so many levels.
fn erfcx_fraction(x: f64, levels: u32) -> f64 {
    let mut tail = x;
    for n in (1..=levels).rev() {
        tail = x + 0.5 * f64::from(n) / tail;
    }
    1.0 / (tail * PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::reference_values::ERF;

    #[test]
    fn thirty_digit_values() {
        assert!(ERF.len() > 20);
        let close = |got: f64, expected: f64, what: &str, x: f64| {
            let error = (got - expected).abs();
            assert!(
                error <= 1e-14 * expected.abs() + 1e-305,
                "{what}({x}) {got:e} {expected:e} {:e}",
                got / expected - 1.0
            );
        };
        for &(x, erf_x, erfc_x, dawson_x) in ERF {
            close(erf(x), erf_x, "erf", x);
            close(erf(-x), -erf_x, "erf", -x);
            close(erfc(x), erfc_x, "erfc", x);
            close(dawson(x), dawson_x, "dawson", x);
            close(dawson(-x), -dawson_x, "dawson", -x);
        }
    }

    #[test]
    fn identities() {
        for step in 0..400 {
            let x = f64::from(step) * 0.07 - 4.0;
            assert!((erf(x) + erfc(x) - 1.0).abs() < 1e-15);
            assert!((erfcx(x) * (-x * x).exp() / erfc(x) - 1.0).abs() < 1e-13 || x > 20.0);
            // Dawson's differential equation D' = 1 - 2 x D.
            let h = 1e-4;
            let slope = (dawson(x + h) - dawson(x - h)) / (2.0 * h);
            assert!((slope - (1.0 - 2.0 * x * dawson(x))).abs() < 2e-8);
        }
        assert_eq!(erf(f64::INFINITY), 1.0);
        assert_eq!(erfc(f64::INFINITY), 0.0);
        assert!(erf(f64::NAN).is_nan() && erfc(f64::NAN).is_nan());
    }
}
