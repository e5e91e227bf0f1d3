// The parameters of one fibre. Twin: crates/scattering/src/closed_form/fibre.rs, same layout
// (240 bytes, usable in a uniform or a storage buffer); angles in radians, widths Xu's.

const MODE_R: u32 = 1u;
const MODE_TT: u32 = 2u;
const MODE_TRT: u32 = 4u;
// Beside the modes: the fibre is of model energy.
const MODEL_ENERGY: u32 = 8u;
// And: it is elliptic.
const ELLIPTIC: u32 = 16u;
// Polynomials in Fibre::further.
const N_FURTHER: u32 = 10u;

// Modes, the model, and whether elliptic: what the pipeline can draw. The others are not part of it,
// whatever the fibre says.
override MODES: u32 = 31u;

struct Fibre {
    sigma_a: vec3f,
    eta: f32,
    alpha: vec3f,
    caustic_width: f32,
    beta: vec3f,
    segments: u32,
    eta_mean: f32,
    eta_swing: f32,
    modes: u32,
    // Nodes of the outer integral: R in bits 0..=3, TT in 4..=7, TRT in 8..=11.
    nodes: u32,
    // Mass of the orders beyond TRT over the inclination: factors of Chebyshev polynomials.
    further: array<vec4f, N_FURTHER>,
    further_scale: f32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

fn is_energy(fibre: Fibre) -> bool {
    return (fibre.modes & MODES & MODEL_ENERGY) != 0u;
}

// Does TRT see another index at every azimuth?
fn is_elliptic(fibre: Fibre) -> bool {
    return (fibre.modes & MODES & ELLIPTIC) != 0u;
}
