// #import lib/constants
// #import lib/special
// #import lib/frame
// #import lib/lobes
// #import lib/azimuthal_r
// N_t^G: N_t averaged over the light of one half circle of azimuths (Xu 2011 Eq 28).
// Twin: crates/scattering/src/closed_form/half_circle.rs, which explains the formulas.

// Integrals of B_1..B_4 and B_5..B_8 of |cos(phi/2)| over the half circle at lag up to pi/2, over
// 2 pi^2: factors of sin^2j(lag/2), j = 0..=5.
const HALF_CIRCLE_BASIS = array<vec4f, 12>(
    vec4f(2.37680851e-05, 0.000113737905, 0.000784299427, 0.00322054623),
    vec4f(0.00948560333, 0.0210465016, 0.0387481807, 0.0857360896),
    vec4f(0.00011461574, 0.0128068718, 0.0384927921, 0.0738587125),
    vec4f(0.0566103044, -0.0356910235, -0.096222466, -0.0506605918),
    vec4f(0.0594127551, 0.0489091384, 0.0815874598, -0.160312959),
    vec4f(-0.235666472, 0.133864532, 0.183518863, -0.101321183),
    vec4f(-0.170419835, 0.268792718, -0.427094774, 0.00224187527),
    vec4f(0.486848749, -0.243648562, -0.100287974, 0.067547455),
    vec4f(0.878373022, -1.10789101, 0.434528481, 0.373840054),
    vec4f(-0.497531678, 0.211381833, -0.0301974047, 0.0),
    vec4f(-1.18172966, 0.924449329, -0.0516372956, -0.327356086),
    vec4f(0.200442947, -0.0674858642, 0.00964083776, 0.0),
);

// The same over the whole circle.
const WHOLE_CIRCLE_FIRST = vec4f(0.0232020947, 0.0239788025, 0.0251701564, 0.0269740456);
const WHOLE_CIRCLE_SECOND = vec4f(0.0297966869, 0.0346269677, 0.04478921, 0.0870378595);

// Share of a circular Gaussian of sharpness kappa within the half circle whose middle is apart
// from its centre by an angle of this cosine; error at most 1.3e-3.
fn half_circle(kappa: f32, cosine: f32) -> f32 {
    let above = 1.0 + kappa * (0.45485764 + kappa * (0.169984 + kappa * 0.08894385));
    let below = PI + kappa * (1.4169838 + kappa * (1.1307576 + kappa * (0.38074627
        + kappa * 0.1778877)));
    let slope = kappa * sqrt(above / below);
    let square = kappa * kappa;
    let t_1 = square / (8.0 * square + 12.5801 * kappa + 7.89707);
    let t_2 = square * square
        / (square * (8.41351 * square - 18.46045 * kappa + 44.11974) + 46.940235);
    let c_2 = cosine * cosine;
    return 0.5 + 0.5 * erf_pair(slope * cosine * (1.0 + c_2 * (t_1 + t_2 * c_2))).erf;
}

// Integrals of B_1..B_8 over the half circle at this lag, over 2 pi^2.
fn half_circle_basis(lag: Lag) -> CShares {
    let near = min(lag.sin_half, lag.cos_half);
    let w = near * near;
    let first = ((((HALF_CIRCLE_BASIS[10] * w + HALF_CIRCLE_BASIS[8]) * w
        + HALF_CIRCLE_BASIS[6]) * w + HALF_CIRCLE_BASIS[4]) * w + HALF_CIRCLE_BASIS[2]) * w
        + HALF_CIRCLE_BASIS[0];
    let second = ((((HALF_CIRCLE_BASIS[11] * w + HALF_CIRCLE_BASIS[9]) * w
        + HALF_CIRCLE_BASIS[7]) * w + HALF_CIRCLE_BASIS[5]) * w + HALF_CIRCLE_BASIS[3]) * w
        + HALF_CIRCLE_BASIS[1];
    let is_behind = lag.sin_half > lag.cos_half;
    return CShares(
        select(first, WHOLE_CIRCLE_FIRST - first, is_behind),
        select(second, WHOLE_CIRCLE_SECOND - second, is_behind),
    );
}

// N_R^G of a dielectric, for the integrals b of half_circle_basis; >= 0.
fn half_circle_r(b: CShares, at: Inclination, reflectance: Reflectance) -> f32 {
    return reflected(b, at, reflectance);
}

// Sum over the lobes of amplitude times share within the half circle; sin_half and cos_half of
// half the azimuth from the lobes' common centre to the middle of the half circle.
fn half_circle_lobes(sin_half: f32, cos_half: f32, lobes: Lobes) -> vec3f {
    let angles = angles_to(lobes, sin_half, cos_half);
    let kappas = angles.kappa;
    let near = angles.near;
    let far = angles.far;
    let p_0 = bessel_i0e_fast(kappas.x) * half_circle(kappas.x, 1.0 - 2.0 * sin_half * sin_half);
    let p_1 = bessel_i0e_fast(kappas.y)
        * (half_circle(kappas.y, 1.0 - 2.0 * near.x * near.x)
            + half_circle(kappas.y, 1.0 - 2.0 * far.x * far.x));
    let p_2 = bessel_i0e_fast(kappas.z)
        * (half_circle(kappas.z, 1.0 - 2.0 * near.y * near.y)
            + half_circle(kappas.z, 1.0 - 2.0 * far.y * far.y));
    return (1.0 / PI)
        * (lobes.amplitude[0] * p_0 + lobes.amplitude[1] * p_1 + lobes.amplitude[2] * p_2);
}

// N_TT^G.
fn half_circle_tt(lag: Lag, lobes: Lobes) -> vec3f {
    return half_circle_lobes(lag.cos_half, lag.sin_half, lobes);
}

// N_TRT^G, blurred by w_c.
fn half_circle_trt(lag: Lag, lobes: Lobes) -> vec3f {
    return half_circle_lobes(lag.sin_half, lag.cos_half, lobes);
}
