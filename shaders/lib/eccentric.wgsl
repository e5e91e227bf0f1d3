// #import lib/constants
// #import lib/fibre
// #import lib/frame
// #import lib/lobes
// TRT of an elliptic fibre (Xu 2011 Eq 24 to 26): nodes in azimuth, each with an index of its own.
// Twin: crates/scattering/src/closed_form/eccentric.rs, which explains each step.

// Sharpness of the bump that stands for N_TRT where nodes in azimuth are placed.
const AZIMUTH_BUMP: f32 = 5.25;
// How far the nodes reach from their centre, over 1 / sqrt(kappa_3) of the product; at most pi.
const AZIMUTH_REACH: f32 = 3.62;
// The same of a half circle of light, radians.
const HALF_CIRCLE_REACH: f32 = 1.65;
// How much denser nodes in azimuth are in the middle.
const AZIMUTH_STRETCH: f32 = 2.3;
// kappa_3 times this is how much of that they are, under 1.
const AZIMUTH_STRETCHED: f32 = 0.75315;
// Lobes that a node looks at are wider by this share of the square of the step to the next one.
const AZIMUTH_BLUR: f32 = 0.05;
// By how much of AZIMUTH_STRETCH nodes are moved for an outer node at u = 1, and at most.
const AZIMUTH_SHEAR: f32 = 0.207;
const AZIMUTH_SHEAR_MAX: f32 = 0.2875;
// Sine of the lag from which on they are moved by all of that, under 1.
const AZIMUTH_SIDE: f32 = 4.0;
// The same of the shift alpha of TRT.
const AZIMUTH_TILT: f32 = 20.0;
// Nodes in azimuth: sinh(a t) / sinh(a), cosh(a t) / sinh(a).
const AZIMUTHS: array<vec2f, 8> = array<vec2f, 8>(
    vec2f(-0.74421734, 0.77128947),
    vec2f(-0.40233615, 0.4504469),
    vec2f(-0.19718306, 0.2826821),
    vec2f(-0.059039753, 0.21098271),
    vec2f(0.059039753, 0.21098271),
    vec2f(0.19718306, 0.2826821),
    vec2f(0.40233615, 0.4504469),
    vec2f(0.74421734, 0.77128947),
);
// Never written to; but of a constant naga copies the whole array at every use of a variable index.
var<private> azimuths: array<vec2f, 8> = AZIMUTHS;
// Smallest (or eta, if less) and largest index of an elliptic fibre.
const ETA_STAR_MIN: f32 = 1.05;
const ETA_STAR_MAX: f32 = 10.0;

// Azimuths that an elliptic fibre tells apart: sine and cosine of half of phi_j - phi_o, within
// +-pi, cosine and sine of 2 phi_o.
struct EllipticLag {
    sin_half: f32,
    cos_half: f32,
    cos_view: f32,
    sin_view: f32,
}

// The azimuths of view and light, lag apart.
fn elliptic_lag(view: DirectionInFrame, light: DirectionInFrame, lag: Lag) -> EllipticLag {
    let turn = view.cos_phi * light.sin_phi - view.sin_phi * light.cos_phi;
    return EllipticLag(
        select(lag.sin_half, -lag.sin_half, turn < 0.0),
        lag.cos_half,
        lag.cos_view,
        2.0 * view.sin_phi * view.cos_phi,
    );
}

// The index where cos(phi_o + phi_i) is this cosine.
fn eta_at(cosine: f32, fibre: Fibre) -> f32 {
    return clamp(
        fibre.eta_mean + fibre.eta_swing * cosine,
        min(fibre.eta, ETA_STAR_MIN),
        ETA_STAR_MAX,
    );
}

// Sine and cosine of half the angle, within +-pi, of a vector (x, y) of this length; the cosine is
// not negative.
fn half_angle(x: f32, y: f32, length: f32) -> vec2f {
    let large = sqrt(0.5 + 0.5 * (abs(x) / length));
    let small = 0.5 * y / (length * large);
    if x >= 0.0 {
        return vec2f(small, large);
    }
    return vec2f(select(large, -large, y < 0.0), abs(small));
}

// cosh and sinh of how far the nodes in azimuth are moved for the node of the outer integral at u;
// sin_lag = sin(phi_j - phi_o).
fn moved(u: f32, sin_lag: f32, fibre: Fibre) -> vec2f {
    let side = clamp(AZIMUTH_SIDE * sin_lag, -1.0, 1.0);
    let tilt = clamp(AZIMUTH_TILT * fibre.alpha.z, -1.0, 1.0);
    let growth = exp(clamp(
        AZIMUTH_SHEAR * u * side * tilt,
        -AZIMUTH_SHEAR_MAX,
        AZIMUTH_SHEAR_MAX,
    ));
    let cosh = 0.5 * (growth + 1.0 / growth);
    return vec2f(cosh, growth - cosh);
}

// Where node ix lies in azimuth, over the reach, and how far from the next one, over a quarter of it and
// AZIMUTH_STRETCH; stretched by a share of that, or even.
fn azimuth_node(ix: u32, by: vec2f, stretched: f32) -> vec2f {
    let node = azimuths[ix];
    let even = vec2f(0.25 * f32(ix) - 0.875, 1.0 / AZIMUTH_STRETCH);
    let moved = vec2f(node.x * by.x + node.y * by.y, node.y * by.x + node.x * by.y);
    return even + stretched * (moved - even);
}

// Circular Gaussian of sharpness kappa, sin_half of half the azimuth from its centre.
fn height(kappa: f32, sin_half: f32) -> f32 {
    return exp(-2.0 * kappa * (sin_half * sin_half));
}

// The index at psi, given by sin_half and cos_half of half of it.
fn eta_at_azimuth(lag: EllipticLag, sin_half: f32, cos_half: f32, fibre: Fibre) -> f32 {
    let cos_psi = 1.0 - 2.0 * sin_half * sin_half;
    let sin_psi = 2.0 * sin_half * cos_half;
    return eta_at(lag.cos_view * cos_psi - lag.sin_view * sin_psi, fibre);
}

// Sum over the lobes of amplitude times height, as a node sees them that is a step from the next one;
// sin_half and cos_half of half the azimuth from their common centre.
fn lobes_at_azimuth(lobes: Lobes, sin_half: f32, cos_half: f32, step: f32) -> vec3f {
    let angles = angles_to(lobes, sin_half, cos_half);
    let kappas = 2.0 / (lobes.lambda * lobes.lambda + AZIMUTH_BLUR * (step * step));
    let lower = lobes.lambda * sqrt(0.5 * kappas);
    let near = angles.near;
    let far = angles.far;
    let p_0 = lower.x * height(kappas.x, sin_half);
    let p_1 = lower.y * (height(kappas.y, near.x) + height(kappas.y, far.x));
    let p_2 = lower.z * (height(kappas.z, near.y) + height(kappas.z, far.y));
    return lobes.amplitude[0] * p_0 + lobes.amplitude[1] * p_1 + lobes.amplitude[2] * p_2;
}
