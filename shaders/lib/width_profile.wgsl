// How scattered light is spread over the width of a strand that is wider than a pixel.
// Twin: crates/scattering/src/closed_form/width_profile.rs.
// #import lib/frame

// Azimuths between light and eye, 0..=pi.
const N_PROFILE_LAGS: u32 = 33u;

// Widths of the light.
const N_PROFILE_WIDTHS: u32 = 4u;

// Standard deviation in azimuth of the narrowest one, rad; the next one's is twice as large.
const LEAST_DEVIATION: f32 = 0.125;

struct WidthProfile {
    // Factor of the second Legendre polynomial, r, g, b and zero; 0..=1.
    even: vec4f,
    // Factors of the first one for light from the right, by width and azimuth: R, TT, TRT and zero; -1..=1.
    sides: array<vec4f, 132>,
}

// Where the factors of a light lie among `sides`.
struct ProfilePlace {
    // The entry of the lower azimuth and the lower width.
    first: u32,
    // From it to the next azimuth, and to the next width, 0..=1.
    to_next: vec2f,
    // Which side the light is on.
    sign: f32,
}

fn profile_place(light: LightInFrame, view: DirectionInFrame) -> ProfilePlace {
    let at = light.direction;
    let cos_lag = at.cos_phi * view.cos_phi + at.sin_phi * view.sin_phi;
    let sin_lag = at.sin_phi * view.cos_phi - at.cos_phi * view.sin_phi;
    let deviation = max(light.lambda * 0.70710678 / max(at.cos_theta, 0.1), LEAST_DEVIATION);
    let lag = atan2(abs(sin_lag), cos_lag) * (f32(N_PROFILE_LAGS - 1u) / 3.14159265);
    let width = log2(deviation / LEAST_DEVIATION);
    let first_lag = clamp(floor(lag), 0.0, f32(N_PROFILE_LAGS - 2u));
    let first_width = clamp(floor(width), 0.0, f32(N_PROFILE_WIDTHS - 2u));
    let to_next = clamp(vec2f(lag - first_lag, width - first_width), vec2f(0.0), vec2f(1.0));
    let first = N_PROFILE_LAGS * u32(first_width) + u32(first_lag);
    return ProfilePlace(first, to_next, select(-1.0, 1.0, sin_lag >= 0.0));
}

// Factors of R, TT and TRT between the entries of two azimuths, for the lower width and the next.
fn profile_sides(
    place: ProfilePlace,
    here: vec4f,
    next: vec4f,
    here_wider: vec4f,
    next_wider: vec4f,
) -> vec3f {
    let narrow = mix(here, next, place.to_next.x);
    let wide = mix(here_wider, next_wider, place.to_next.x);
    return place.sign * mix(narrow, wide, place.to_next.y).xyz;
}
