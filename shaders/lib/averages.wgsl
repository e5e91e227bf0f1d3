// #import lib/constants
// The averages of dual scattering over the incident inclination: rgba32float, four texels along x
// an inclination, fibres along y, read by textureLoad and mixed by hand.
// Twin: crates/scattering/src/closed_form/averages.rs, which explains the layout.

// What many events send back and one sends on, at one inclination.
struct Averages {
    a_f: vec3f,
    beta_f_2: vec3f,
    attenuation_b: vec3f,
    shift_b: vec3f,
    width_b_2: vec3f,
    // 1 where that light is a lobe of model energy.
    energy: f32,
}

// Which fibre's.
alias AverageRow = u32;

// Inclinations less one, the index of the last.
const LAST_INCLINATION: f32 = 127.0;

// The averages of the fibre in this row at incident inclination theta.
fn sample_averages(averages: texture_2d<f32>, row: AverageRow, theta: f32) -> Averages {
    let at = min(max((theta + HALF_PI) * (LAST_INCLINATION / PI), 0.0), LAST_INCLINATION);
    let first = min(floor(at), LAST_INCLINATION - 1.0);
    let fraction = at - first;
    let texel = vec2u(4u * u32(first), row);
    let low_0 = textureLoad(averages, texel, 0);
    let low_1 = textureLoad(averages, texel + vec2u(1u, 0u), 0);
    let low_2 = textureLoad(averages, texel + vec2u(2u, 0u), 0);
    let low_3 = textureLoad(averages, texel + vec2u(3u, 0u), 0);
    let high_0 = textureLoad(averages, texel + vec2u(4u, 0u), 0);
    let high_1 = textureLoad(averages, texel + vec2u(5u, 0u), 0);
    let high_2 = textureLoad(averages, texel + vec2u(6u, 0u), 0);
    let high_3 = textureLoad(averages, texel + vec2u(7u, 0u), 0);
    let x_0 = low_0 + (high_0 - low_0) * fraction;
    let x_1 = low_1 + (high_1 - low_1) * fraction;
    let x_2 = low_2 + (high_2 - low_2) * fraction;
    let x_3 = low_3 + (high_3 - low_3) * fraction;
    return Averages(vec3f(x_0.w, x_1.w, x_2.w), x_3.xyz, x_0.xyz, x_1.xyz, x_2.xyz, x_3.w);
}
