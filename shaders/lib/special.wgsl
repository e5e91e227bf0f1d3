// Special functions in single precision. Twin: crates/scattering/src/closed_form/special.rs.

// exp(-x^2) and erf(x), which share the exponential.
struct ErfPair {
    gauss: f32,
    erf: f32,
}

// erf by Abramowitz and Stegun 7.1.25 (Xu 2011, preprint App E), odd-extended; error <= 2.5e-5.
fn erf_pair(x: f32) -> ErfPair {
    let gauss = exp(-x * x);
    let t = 1.0 / (1.0 + 0.47047 * abs(x));
    let tail = t * (0.3480242 + t * (-0.0958798 + t * 0.7478556)) * gauss;
    return ErfPair(gauss, select(tail - 1.0, 1.0 - tail, x >= 0.0));
}

// exp(-x) I_0(x) for x >= 0: Abramowitz and Stegun 9.8.1, 9.8.2; relative error <= 5e-7.
fn bessel_i0e(x: f32) -> f32 {
    if x < 3.75 {
        let t = x / 3.75;
        let y = t * t;
        return exp(-x) * (1.0 + y * (3.5156229 + y * (3.0899424 + y * (1.2067492
            + y * (0.2659732 + y * (0.0360768 + y * 0.0045813))))));
    }
    let y = 3.75 / x;
    return (0.39894228 + y * (0.01328592 + y * (0.00225319 + y * (-0.00157565
        + y * (0.00916281 + y * (-0.02057706 + y * (0.02635537 + y * (-0.01647633
        + y * 0.00392377)))))))) * inverseSqrt(x);
}

// exp(-x) I_0(x) for 0 <= x <= 1e7 without exp or branch; relative error <= 3e-5.
fn bessel_i0e_fast(x: f32) -> f32 {
    let above = 1.0 + x * (0.3431813 + x * (0.29452795 + x * (0.07081133 + x * 0.04839061)));
    let below = 1.0 + x * (2.3455703 + x * (2.4503248 + x * (1.6268816 + x * (0.37178504
        + x * 0.30403185))));
    return sqrt(above / below);
}

// exp(-x) I_1(x) for x >= 0: Abramowitz and Stegun 9.8.3, 9.8.4; relative error <= 5e-7.
fn bessel_i1e(x: f32) -> f32 {
    if x < 3.75 {
        let t = x / 3.75;
        let y = t * t;
        return exp(-x) * x * (0.5 + y * (0.87890594 + y * (0.51498869 + y * (0.15084934
            + y * (0.02658733 + y * (0.00301532 + y * 0.00032411))))));
    }
    let y = 3.75 / x;
    return (0.39894228 + y * (-0.03988024 + y * (-0.00362018 + y * (0.00163801
        + y * (-0.01031555 + y * (0.02282967 + y * (-0.02895312 + y * (0.01787654
        - y * 0.00420059)))))))) * inverseSqrt(x);
}
