// Wind that bends strands. Twin: crates/scene/src/motion/wind.rs.
// #import lib/sampling

// Noise that travels with the wind.
struct Octave {
    // Part of a cell that it has travelled, and whole cells.
    fraction: vec3f,
    cells_per_cm: f32,
    cells: vec3i,
    seed: u32,
}

struct Wind {
    direction: vec3f,
    // m/s
    speed: f32,
    // Gusts, and turbulence.
    octaves: array<Octave, 2>,
    gust: f32,
    // cm
    stiffness: f32,
    n_strands: u32,
    pad: u32,
}

// Speed at which wind pulls as strongly as a fibre's weight, m/s.
const WEIGHT_SPEED: f32 = 6.0;
// Share of the pull that turbulence turns aside.
const ASIDE: f32 = 0.5;

// In -1..1 at a corner of the cells.
fn corner_value(corner: vec3i, seed: u32) -> f32 {
    let x = hash_u32(bitcast<u32>(corner.x) ^ seed);
    let y = hash_u32(x ^ bitcast<u32>(corner.y));
    let z = hash_u32(y ^ bitcast<u32>(corner.z));
    return f32(z >> 8u) * (1.0 / 8388608.0) - 1.0;
}

// Smooth in -1..1: values at the corners, mixed by quintic weights.
fn noise(octave: Octave, channel: u32, position: vec3f) -> f32 {
    let p = position * octave.cells_per_cm - octave.fraction;
    let low = floor(p);
    let f = p - low;
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let at = vec3i(low) - octave.cells;
    let seed = hash_u32(octave.seed + channel);
    let x00 = mix(corner_value(at, seed), corner_value(at + vec3i(1, 0, 0), seed), w.x);
    let x10 = mix(corner_value(at + vec3i(0, 1, 0), seed), corner_value(at + vec3i(1, 1, 0), seed), w.x);
    let x01 = mix(corner_value(at + vec3i(0, 0, 1), seed), corner_value(at + vec3i(1, 0, 1), seed), w.x);
    let x11 = mix(corner_value(at + vec3i(0, 1, 1), seed), corner_value(at + vec3i(1, 1, 1), seed), w.x);
    return mix(mix(x00, x10, w.y), mix(x01, x11, w.y), w.z);
}

// Pull at a place as a share of what holds a fibre in its direction, shorter than 1.
fn pull_at(wind: Wind, position: vec3f) -> vec3f {
    let speed = wind.speed * (1.0 + wind.gust * noise(wind.octaves[0], 0u, position));
    let drag = speed * speed / (WEIGHT_SPEED * WEIGHT_SPEED);
    let strength = drag / sqrt(1.0 + drag * drag);
    let aside = vec3f(
        noise(wind.octaves[1], 1u, position),
        noise(wind.octaves[1], 2u, position),
        noise(wind.octaves[1], 3u, position));
    let towards = wind.direction + ASIDE * wind.gust * aside;
    return towards * (0.95 * strength / max(length(towards), 1.0));
}

// How much of the pull acts at this length from the root.
fn flexibility(wind: Wind, length_cm: f32) -> f32 {
    let square = length_cm * length_cm;
    return square / (square + wind.stiffness * wind.stiffness);
}

// A piece of a strand bent by a pull: as long as it was.
fn bent(piece: vec3f, pull: vec3f) -> vec3f {
    let length_cm = length(piece);
    let pulled = piece + pull * length_cm;
    return pulled * (length_cm / max(length(pulled), 1e-20));
}
