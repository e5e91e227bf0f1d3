//! Elementary and special functions of eight numbers at a time.
//!
//! Errors are relative ones, measured against double precision over the whole domain by the tests
//! below. Nothing here branches; outside a domain answers are finite unless said otherwise, but
//! mean nothing.

use core::f32::consts::{FRAC_PI_2, LN_2, LOG2_E};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8, u32x8};

/// `a b + c`, of one rounding where the instruction set has that, else of two.
#[inline(always)]
pub(crate) fn mul_add<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
    a.mul_add(b, c)
}

/// The polynomial in `x` whose coefficients, of rising powers, are `c`.
#[inline(always)]
pub(crate) fn polynomial<S: Simd, const N: usize>(x: f32x8<S>, c: [f32; N]) -> f32x8<S> {
    let simd = x.token();
    let mut sum = f32x8::splat(simd, c[N - 1]);
    for c in c[..N - 1].iter().rev() {
        sum = mul_add(sum, x, f32x8::splat(simd, *c));
    }
    sum
}

/// `x` within `low..=high`.
#[inline(always)]
pub(crate) fn clamp<S: Simd>(x: f32x8<S>, low: f32, high: f32) -> f32x8<S> {
    x.max(low).min(high)
}

/// exp(x); error at most 3e-7, 0 below -87.7, and what exp(88) is above 88.
#[inline(always)]
pub fn exp<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    /// 1.5 * 2^23, next to which an ulp is 1, plus the bias of exponents.
    const ROUND: f32 = 12_582_912.0 + 127.0;
    /// ln 2, a number of few bits first so that its product with an exponent is exact.
    const LN_2_HIGH: f32 = 355.0 / 512.0;
    const LN_2_LOW: f32 = -2.121_944_4e-4;
    // At -88 the exponent is -127, whose bits are those of 0.
    let x = clamp(x, -88.0, 88.0);
    let rounded = x * LOG2_E + ROUND;
    let power: u32x8<S> = rounded.to_bits() << 23;
    let n = rounded - ROUND;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    // (exp(r) - 1 - r) / r^2 to 1e-7 of exp(r) for |r| up to ln(2) / 2.
    let rest = polynomial(r, [0.499_992_3, 0.166_671_16, 0.041_890_55, 0.008_312_48]);
    let value = mul_add(r * r, rest, r) + 1.0;
    value * power.bitcast::<f32x8<S>>()
}

/// ln(x) for normal `x` > 0; error at most 3e-7.
#[inline(always)]
pub fn ln<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    /// Bits of sqrt(1/2): mantissas are taken from there to sqrt(2).
    const ROOT_HALF: i32 = 0x3f35_04f3;
    let bits: i32x8<S> = x.bitcast();
    let exponent = (bits - ROOT_HALF) >> 23;
    let mantissa: i32x8<S> = bits - (exponent << 23);
    let f = mantissa.bitcast::<f32x8<S>>() - 1.0;
    // (ln(1 + f) - f + f^2 / 2) / f^3 to 3e-8 of the logarithm.
    let rest = polynomial(
        f,
        [
            0.333_339_1,
            -0.250_013_36,
            0.199_630_65,
            -0.165_775_9,
            0.149_147_59,
            -0.142_674_46,
            0.087_004_08,
        ],
    );
    let square = f * f;
    let near_1 = mul_add(square, mul_add(f, rest, f32x8::splat(x.token(), -0.5)), f);
    mul_add(
        exponent.to_float::<f32x8<S>>(),
        f32x8::splat(x.token(), LN_2),
        near_1,
    )
}

/// sin(x) for `x` within +-pi/2; error at most 2e-7.
#[inline(always)]
pub fn sin<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    let square = x * x;
    let rest = polynomial(
        square,
        [-0.166_666_6, 0.008_333_065, -1.980_947_5e-4, 2.605_481_6e-6],
    );
    mul_add(x * square, rest, x)
}

/// cos(x) for `x` within +-pi/2; error at most 2e-7, next to +-pi/2 too.
#[inline(always)]
pub fn cos<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    /// pi/2 less [`FRAC_PI_2`].
    const FRAC_PI_2_LOW: f32 = -4.371_139e-8;
    sin((f32x8::splat(x.token(), FRAC_PI_2) - x.abs()) + FRAC_PI_2_LOW)
}

/// atan2(y, x) for `x` >= 0, so within +-pi/2; error at most 4e-7. 0 where both are 0.
#[inline(always)]
pub fn atan2<S: Simd>(y: f32x8<S>, x: f32x8<S>) -> f32x8<S> {
    let height = y.abs();
    let t = height.min(x) / height.max(x).max(f32::MIN_POSITIVE);
    let square = t * t;
    let rest = polynomial(
        square,
        [
            -0.333_323_9,
            0.199_742_12,
            -0.140_413_15,
            0.099_684_4,
            -0.060_202_67,
            0.024_733_746,
            -0.004_822_447,
        ],
    );
    let angle = mul_add(t * square, rest, t);
    let steep = height.simd_gt(x);
    let angle = steep.select(f32x8::splat(x.token(), FRAC_PI_2) - angle, angle);
    angle.copysign(y)
}

/// Numerator and denominator under the root of [`crate::closed_form::bessel_i0e_fast`], for callers
/// that have more to divide by.
#[inline(always)]
pub(crate) fn bessel_i0e_parts<S: Simd>(x: f32x8<S>) -> [f32x8<S>; 2] {
    [
        polynomial(
            x,
            [1.0, 0.343_181_3, 0.294_527_95, 0.070_811_33, 0.048_390_61],
        ),
        polynomial(
            x,
            [
                1.0,
                2.345_570_3,
                2.450_324_8,
                1.626_881_6,
                0.371_785_04,
                0.304_031_85,
            ],
        ),
    ]
}

/// [`crate::closed_form::bessel_i0e_fast`], to 1e-6.
#[inline(always)]
pub fn bessel_i0e_fast<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    let [above, below] = bessel_i0e_parts(x);
    (above / below).sqrt()
}

/// exp(-x^2) and erf(x) of [`crate::closed_form::erf_pair`], to 1e-6.
#[inline(always)]
pub fn erf_pair<S: Simd>(x: f32x8<S>) -> [f32x8<S>; 2] {
    let gauss = exp(-(x * x));
    let one = f32x8::splat(x.token(), 1.0);
    let t = one / (x.abs() * 0.47047 + 1.0);
    let tail = t * polynomial(t, [0.348_024_2, -0.095_879_8, 0.747_855_6]) * gauss;
    [gauss, (one - tail).copysign(x)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form;
    use crate::wide::{LANES, Level, dispatch, levels};

    /// A function of one vector; closures cannot be generic.
    trait Function {
        fn of<S: Simd>(&self, x: f32x8<S>) -> f32x8<S>;
    }

    /// Values of a function, eight at a time.
    fn values(level: Level, function: &impl Function, inputs: &[f32]) -> Vec<f32> {
        dispatch!(level, simd => inputs
            .chunks(LANES)
            .flat_map(|chunk| {
                let mut x = [1.0; LANES];
                x[..chunk.len()].copy_from_slice(chunk);
                let y = function.of(f32x8::simd_from(simd, x));
                <[f32; LANES]>::from(y).into_iter().take(chunk.len())
            })
            .collect())
    }

    macro_rules! function {
        ($name:ident, $x:ident => $body:expr) => {
            struct $name;
            impl Function for $name {
                #[inline(always)]
                fn of<S: Simd>(&self, $x: f32x8<S>) -> f32x8<S> {
                    $body
                }
            }
        };
    }

    function!(Exp, x => exp(x));
    function!(Ln, x => ln(x));
    function!(Sin, x => sin(x));
    function!(Cos, x => cos(x));
    function!(Bessel, x => bessel_i0e_fast(x));
    function!(Gauss, x => erf_pair(x)[0]);
    function!(Erf, x => erf_pair(x)[1]);

    /// Largest relative error at every level, `inputs` being more than some.
    fn check(
        function: impl Function,
        inputs: &[f32],
        exact: impl Fn(f64) -> f64,
        tolerance: f64,
        name: &str,
    ) {
        assert!(inputs.len() > 1000, "{name}");
        for (level_name, level) in levels() {
            let found = values(level, &function, inputs);
            assert_eq!(found.len(), inputs.len());
            let mut worst = (0.0, 0.0);
            for (x, found) in inputs.iter().zip(found) {
                let exact = exact(f64::from(*x));
                let error = (f64::from(found) - exact).abs() / exact.abs().max(1e-37);
                assert!(
                    error.is_finite(),
                    "{name} {level_name} {x}: {found} {exact}"
                );
                if error > worst.0 {
                    worst = (error, *x);
                }
            }
            println!("{name}, {level_name}: {:.2e} at {}", worst.0, worst.1);
            assert!(worst.0 < tolerance, "{name} {level_name} {worst:?}");
        }
    }

    /// `n` numbers evenly from `low` to `high`, both included.
    fn even(low: f64, high: f64, n: u32) -> Vec<f32> {
        let step = (high - low) / f64::from(n - 1);
        (0..n)
            .map(|ix| (low + step * f64::from(ix)) as f32)
            .collect()
    }

    /// Evenly in the logarithm.
    fn geometric(low: f64, high: f64, n: u32) -> Vec<f32> {
        let exponents = even(low.ln(), high.ln(), n);
        exponents
            .iter()
            .map(|x| f64::from(*x).exp() as f32)
            .collect()
    }

    #[test]
    fn exp_is_close_and_never_nan() {
        let mut inputs = even(-87.3, 87.9, 200_001);
        inputs.extend(geometric(1e-30, 1.0, 10_000));
        inputs.extend(geometric(1e-30, 1.0, 10_000).iter().map(|x| -x));
        check(Exp, &inputs, f64::exp, 3e-7, "exp");
        for (name, level) in levels() {
            let extremes = [0.0, -0.0, -88.0, -1e4, -1e30, f32::MIN, f32::NEG_INFINITY];
            let found = values(level, &Exp, &extremes);
            assert_eq!(found, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], "{name}");
            let [below, above] = values(level, &Exp, &[-87.6, f32::MAX])[..] else {
                unreachable!()
            };
            assert!((0.0..2e-38).contains(&below) && above.is_finite(), "{name}");
        }
    }

    #[test]
    fn ln_is_close() {
        let mut inputs = geometric(1.2e-38, 3.4e38, 200_001);
        inputs.extend(even(0.5, 2.0, 200_001));
        inputs.extend([f32::MIN_POSITIVE, f32::MAX]);
        check(Ln, &inputs, f64::ln, 3e-7, "ln");
        for (name, level) in levels() {
            let [one, zero] = values(level, &Ln, &[1.0, 0.0])[..] else {
                unreachable!()
            };
            assert!(one == 0.0 && zero < -87.0 && zero.is_finite(), "{name}");
        }
    }

    #[test]
    fn sine_and_cosine_are_close() {
        let half_pi = f64::from(FRAC_PI_2);
        let mut inputs = even(-half_pi, half_pi, 200_001);
        inputs.extend(geometric(1e-30, half_pi, 20_001));
        check(Sin, &inputs, f64::sin, 2.5e-7, "sin");
        inputs.extend(geometric(1e-7, 1.0, 20_001).iter().map(|x| FRAC_PI_2 - x));
        check(Cos, &inputs, f64::cos, 2.5e-7, "cos");
    }

    #[test]
    fn angles_are_close() {
        let lengths = geometric(1e-20, 1e18, 300);
        for (name, level) in levels() {
            let mut worst = 0.0f64;
            let mut check = |y: f32, x: f32| {
                let found: f32 = dispatch!(level, simd => {
                    atan2(f32x8::splat(simd, y), f32x8::splat(simd, x)).as_slice()[3]
                });
                let exact = f64::from(y).atan2(f64::from(x));
                let error = (f64::from(found) - exact).abs() / exact.abs().max(1e-37);
                worst = worst.max(error);
            };
            for y in &lengths {
                for x in &lengths {
                    check(*y, *x);
                    check(-*y, *x);
                }
                check(*y, 0.0);
                check(0.0, *y);
            }
            for t in even(0.0, 2.0, 20_001) {
                check(t, 1.0);
            }
            check(0.0, 0.0);
            println!("atan2, {name}: {worst:.2e}");
            assert!(worst < 4e-7, "{name} {worst}");
        }
    }

    #[test]
    fn special_functions_are_their_twins() {
        let positive = geometric(1e-6, 1e7, 100_001);
        let twin = |x| f64::from(closed_form::bessel_i0e_fast(x as f32));
        check(Bessel, &positive, twin, 2e-6, "bessel_i0e_fast");
        let mut inputs = even(-9.0, 9.0, 100_001);
        check(Gauss, &inputs, |x| (-x * x).exp(), 5e-6, "gauss");
        inputs.retain(|x| x.abs() > 0.05);
        let twin = |x| f64::from(closed_form::erf_pair(x as f32).erf);
        check(Erf, &inputs, twin, 5e-6, "erf_pair");
        for (name, level) in levels() {
            let ends = [-1e19, -1e6, 1e6, 1e19];
            assert_eq!(values(level, &Gauss, &ends), [0.0; 4], "{name}");
            assert_eq!(values(level, &Erf, &ends), [-1.0, -1.0, 1.0, 1.0], "{name}");
            assert_eq!(values(level, &Bessel, &[0.0]), [1.0], "{name}");
        }
    }

    /// The comparison can fail.
    #[test]
    #[should_panic(expected = "off")]
    fn an_error_is_seen() {
        let twice = |x: f64| 1.00001 * x.exp();
        check(Exp, &even(-1.0, 1.0, 2000), twice, 3e-7, "off");
    }
}
