// Light on a matte surface. Twin: crates/scattering/src/closed_form/irradiance.rs.
// #import lib/special

// Of an SRBF light of amplitude 1, by the cosine of its direction and the normal; sr.
fn irradiance(cos_normal: f32, lambda: f32) -> f32 {
    let kappa = 2.0 / (lambda * lambda);
    let fall = exp(-kappa);
    let squared = kappa * kappa;
    var upper = (kappa - 1.0 + fall) / squared;
    var lower = fall * (1.0 - (1.0 + kappa) * fall) / squared;
    if kappa < 0.1 {
        upper = 0.5 - kappa * (0.16666667 - 0.04166667 * kappa);
        lower = 0.5 - kappa * (0.8333333 - 0.7083333 * kappa);
    }
    let blur = (squared + 0.33425 * kappa + 0.422157)
        / (squared + 1.084606 * kappa + 6.302895);
    let t = max(sqrt(0.5 * kappa * blur), 0.05);
    let least = blurred_ramp(-1.0, t);
    let share = (blurred_ramp(cos_normal, t) - least) / (blurred_ramp(1.0, t) - least);
    return 6.2831855 * (lower + (upper - lower) * clamp(share, 0.0, 1.0));
}

// Twice max(x, 0) blurred by a Gaussian.
fn blurred_ramp(x: f32, t: f32) -> f32 {
    let pair = erf_pair(t * x);
    return x * (1.0 + pair.erf) + pair.gauss * 0.5641896 / t;
}
