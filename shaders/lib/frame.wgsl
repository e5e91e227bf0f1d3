// Directions in the frame (u, v, w) of a fibre, u the tangent from root to tip, and the angles
// between them: a direction is
// (sin theta, cos theta cos phi, cos theta sin phi).
// Twin: crates/scattering/src/closed_form/frame.rs.

const COS_THETA_D_MIN: f32 = 1e-6;

// A direction away from the fibre.
struct DirectionInFrame {
    theta: f32,
    cos_theta: f32,
    cos_phi: f32,
    sin_phi: f32,
}

// A spherical Gaussian light of amplitude 1.
struct LightInFrame {
    direction: DirectionInFrame,
    lambda: f32,
}

// From the components along (u, v, w) of a vector of any length but 0.
fn direction_in_frame(vector: vec3f) -> DirectionInFrame {
    let radius = length(vector.yz);
    let theta = atan2(vector.x, radius);
    if radius < 1e-12 {
        return DirectionInFrame(theta, 0.0, 1.0, 0.0);
    }
    let cos_theta = radius / length(vec2f(vector.x, radius));
    return DirectionInFrame(theta, cos_theta, vector.y / radius, vector.z / radius);
}

// From the components along (u, v, w) of a vector of any length but 0.
fn light_in_frame(vector: vec3f, lambda: f32) -> LightInFrame {
    return LightInFrame(direction_in_frame(vector), lambda);
}

// The difference angle theta_d = (theta_o - theta_i) / 2.
struct Inclination {
    theta_d: f32,
    sin_theta_d: f32,
    cos_theta_d: f32,
}

// The azimuth between view and light, folded to 0..=pi.
struct Lag {
    sin_half: f32,
    cos_half: f32,
    cos_sum: f32,
    cos_view: f32,
}

// The inclination with this theta_d.
fn inclination(theta_d: f32) -> Inclination {
    return Inclination(theta_d, sin(theta_d), max(cos(theta_d), COS_THETA_D_MIN));
}

// The lag between two azimuths given as (cos, sin).
fn lag_between(cos_o: f32, sin_o: f32, cos_j: f32, sin_j: f32) -> Lag {
    let d_c = cos_o - cos_j;
    let d_s = sin_o - sin_j;
    let s_c = cos_o + cos_j;
    let s_s = sin_o + sin_j;
    let sin_half = min(0.5 * sqrt(d_c * d_c + d_s * d_s), 1.0);
    let cos_half = min(0.5 * sqrt(s_c * s_c + s_s * s_s), 1.0);
    return Lag(
        sin_half,
        cos_half,
        cos_o * cos_j - sin_o * sin_j,
        cos_o * cos_o - sin_o * sin_o,
    );
}
