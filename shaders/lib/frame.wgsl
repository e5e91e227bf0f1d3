// Directions in the frame (u, v, w) of a fibre, u the tangent from root to tip:
// (sin theta, cos theta cos phi, cos theta sin phi).
// Twin: crates/scattering/src/closed_form/frame.rs.

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
