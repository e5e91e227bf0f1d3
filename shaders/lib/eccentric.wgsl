// #import lib/fibre
// #import lib/frame
// The index of an elliptic fibre (Xu 2011 Eq 24 to 26).
// Twin: crates/scattering/src/closed_form/eccentric.rs, which explains each step.

// Sharpness of the bump of N_TRT.
const BUMP_SHARPNESS: f32 = 12.0;
// Smallest (or eta, if less) and largest index of an elliptic fibre.
const ETA_STAR_MIN: f32 = 1.05;
const ETA_STAR_MAX: f32 = 10.0;

// Mean index of an elliptic fibre over the product of the light, of sharpness kappa, and the
// bump of TRT; fibre.eta for a circular one.
fn eta_star(kappa: f32, lag: Lag, fibre: Fibre) -> f32 {
    if fibre.eta_swing == 0.0 {
        return fibre.eta;
    }
    let sum = kappa + BUMP_SHARPNESS;
    let fall = 4.0 * kappa * BUMP_SHARPNESS * (lag.sin_half * lag.sin_half);
    let kappa_3 = sqrt(max(sum * sum - fall, 0.0));
    let ratio = 1.0 / (0.5 + sqrt(kappa_3 * kappa_3 + 2.25));
    let cosine = (kappa * lag.cos_sum + BUMP_SHARPNESS * lag.cos_view) * ratio;
    return clamp(
        fibre.eta_mean + fibre.eta_swing * cosine,
        min(fibre.eta, ETA_STAR_MIN),
        ETA_STAR_MAX,
    );
}
