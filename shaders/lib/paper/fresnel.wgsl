// Unpolarised Fresnel terms as the transmitted part 1 - F.
// Twin: crates/scattering/src/closed_form/paper/fresnel.rs.

// 1 - F of a dielectric at the true incidence cosine, cos(theta_d) sqrt(1 - h^2).
fn paper_transmittance_dielectric(eta: f32, cosine: f32) -> f32 {
    let c = cosine;
    let q = sqrt((eta - 1.0) * (eta + 1.0) + c * c);
    let n = eta * eta * c;
    let s = c + q;
    let p = n + q;
    return 2.0 * q * (c / (s * s) + n / (p * p));
}

// 1 - F by Schlick's approximation.
fn paper_transmittance_schlick(eta: f32, cosine: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    let g = 1.0 - cosine;
    let g_2 = g * g;
    return (1.0 - r * r) * (1.0 - g_2 * g_2 * g);
}
