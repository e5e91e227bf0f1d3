//! The parameters of a fibre as the shaders hold them. Twin: `shaders/lib/fibre.wgsl`.

use std::f64::consts::PI;

use crate::exact::further_mass;
use crate::fresnel::Fresnel;
use crate::{HairParams, Lobe, Model, ParamError};

/// Bit of [`Fibre::modes`] that enables R.
pub const MODE_R: u32 = 1;
/// Bit of [`Fibre::modes`] that enables TT.
pub const MODE_TT: u32 = 2;
/// Bit of [`Fibre::modes`] that enables TRT.
pub const MODE_TRT: u32 = 4;

/// Bit of [`Fibre::modes`] of a fibre of [`Model::Energy`].
pub const MODEL_ENERGY: u32 = 8;
/// Bit of [`Fibre::modes`] of an elliptic fibre.
pub const ELLIPTIC: u32 = 16;
/// All bits of modes.
pub const ALL_MODES: u32 = MODE_R | MODE_TT | MODE_TRT;

/// Polynomials in [`Fibre::further`].
pub const N_FURTHER: usize = 10;

/// One fibre, byte for byte the uniform `Fibre` of the shaders (240 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Fibre {
    /// Absorption per fibre radius, linear RGB.
    pub sigma_a: [f32; 3],
    /// Index of refraction.
    pub eta: f32,
    /// Longitudinal shifts alpha of R, TT, TRT in the half angle, radians.
    pub alpha: [f32; 3],
    /// Width w_c of the TRT caustic, Xu's sense, radians.
    pub caustic_width: f32,
    /// Longitudinal widths beta of R, TT, TRT in the half angle, Xu's sense, radians.
    pub beta: [f32; 3],
    /// Segments m of the paper's outer integral, 2..=[`MAX_SEGMENTS`].
    pub segments: u32,
    /// Index of refraction of an elliptic fibre along its axes (Eq 24): mean of eta*_1, eta*_2.
    pub eta_mean: f32,
    /// (eta*_1 - eta*_2) / 2 of Eq 24; 0 for a circular fibre.
    pub eta_swing: f32,
    /// Enabled modes, a sum of [`MODE_R`], [`MODE_TT`], [`MODE_TRT`]; and [`MODEL_ENERGY`],
    /// [`ELLIPTIC`].
    pub modes: u32,
    /// Nodes of the outer integral a mode: R in bits 0..=3, TT in 4..=7, TRT in 8..=11, as
    /// [`pack_nodes`] packs them. The paper's scheme does not look at them.
    pub nodes: u32,
    /// Mass of the orders beyond TRT over the inclination, linear RGB and 0: factors of the Chebyshev
    /// polynomials, see [`super::further_orders`]. Zeros of model `marschner`.
    pub further: [[f32; 4]; N_FURTHER],
    /// Cosines below this are as many as those above in it.
    pub further_scale: f32,
    /// Fills the uniform; always 0.
    pub padding_0: u32,
    /// Fills the uniform; always 0.
    pub padding_1: u32,
    /// Fills the uniform; always 0.
    pub padding_2: u32,
}

crate::mirrors! {
    Fibre as "Fibre" in "lib/fibre" {
        sigma_a, eta, alpha, caustic_width, beta, segments, eta_mean, eta_swing, modes, nodes, further,
        further_scale, padding_0, padding_1, padding_2,
    }
}

/// Most segments of the paper's outer integral; more buy nothing and cost time.
pub const MAX_SEGMENTS: u32 = 64;

/// Segments m of the paper's outer integral, the default of Xu 2011.
pub const DEFAULT_SEGMENTS: u32 = 4;

/// Nodes of the outer integral that the renderer uses: 3 of R, 2 of TT, 3 of TRT.
pub const DEFAULT_NODES: u32 = pack_nodes([3, 2, 3]);

/// Those of model `energy`, whose M_t cos(theta_i) falls to 0 less smoothly at the ends: 3 of each.
pub const ENERGY_NODES: u32 = pack_nodes([3, 3, 3]);

/// [`Fibre::nodes`] of these counts for R, TT, TRT, each clamped to 1..=15.
pub const fn pack_nodes(counts: [u32; 3]) -> u32 {
    let mut packed = 0;
    let mut mode = 0;
    while mode < 3 {
        let count = counts[mode];
        let count = if count < 1 {
            1
        } else if count > 15 {
            15
        } else {
            count
        };
        packed |= count << (4 * mode);
        mode += 1;
    }
    packed
}

impl Fibre {
    /// The fibre with these parameters, rounded to single precision.
    ///
    /// `modes` lists what is enabled; the orders beyond TRT are those of a dielectric; `segments` is clamped to 2..=[`MAX_SEGMENTS`]; `nodes` are
    /// [`DEFAULT_NODES`] or [`ENERGY_NODES`].
    ///
    /// # Errors
    /// The first parameter outside its range ([`HairParams::validate`]).
    pub fn new(hair: &HairParams, modes: &[Lobe], segments: u32) -> Result<Fibre, ParamError> {
        hair.validate()?;
        let per_lobe = |value: &crate::PerLobe<f64>| Lobe::ALL.map(|lobe| value.get(lobe) as f32);
        let [eta_1, eta_2] = hair.elliptic_indices();
        let (model, nodes) = match hair.model {
            Model::Marschner => (0, DEFAULT_NODES),
            Model::Energy => (MODEL_ENERGY, ENERGY_NODES),
        };
        let (further, further_scale) = further_orders_of(hair);
        let eta_swing = (0.5 * (eta_1 - eta_2)) as f32;
        let shape = if eta_swing == 0.0 { 0 } else { ELLIPTIC };
        Ok(Fibre {
            sigma_a: hair.sigma_a.map(|sigma_a| sigma_a as f32),
            eta: hair.eta as f32,
            alpha: per_lobe(&hair.shift),
            caustic_width: hair.caustic_width as f32,
            beta: per_lobe(&hair.width),
            segments: segments.clamp(2, MAX_SEGMENTS),
            eta_mean: (0.5 * (eta_1 + eta_2)) as f32,
            eta_swing,
            modes: modes
                .iter()
                .fold(model | shape, |bits, lobe| bits | 1 << lobe.p()),
            nodes,
            further,
            further_scale,
            padding_0: 0,
            padding_1: 0,
            padding_2: 0,
        })
    }

    /// Is it of [`Model::Energy`]?
    pub fn is_energy(&self) -> bool {
        self.modes & MODEL_ENERGY != 0
    }

    /// Does TRT see another index at every azimuth?
    pub fn is_elliptic(&self) -> bool {
        self.modes & ELLIPTIC != 0
    }

    /// Nodes of the outer integral for `mode` 0 (R), 1 (TT), 2 (TRT).
    pub fn node_count(&self, mode: u32) -> u32 {
        (self.nodes >> (4 * mode)) & 15
    }

    /// The fibre with these node counts for R, TT, TRT, each clamped to 1..=15.
    pub fn with_nodes(self, counts: [u32; 3]) -> Fibre {
        Fibre {
            nodes: pack_nodes(counts),
            ..self
        }
    }
}

/// Scale of [`Fibre::further`] over sqrt(eta^2 - 1): what many reflections keep of next to no absorption
/// changes fastest at grazing angles.
const FURTHER_SCALE: f64 = 0.2;

/// The orders beyond TRT of a dielectric of model `energy`, interpolated at Chebyshev's points, and their
/// scale; zeros and 1 of other models.
fn further_orders_of(hair: &HairParams) -> ([[f32; 4]; N_FURTHER], f32) {
    if hair.model != Model::Energy {
        return ([[0.0; 4]; N_FURTHER], 1.0);
    }
    let mut factors = [[0.0f64; 4]; N_FURTHER];
    let scale = FURTHER_SCALE * ((hair.eta - 1.0) * (hair.eta + 1.0)).sqrt();
    let n = N_FURTHER as f64;
    for k in 0..N_FURTHER {
        let at = PI * (k as f64 + 0.5) / n;
        let y = 0.5 * (at.cos() + 1.0);
        let cos_theta = scale * (1.0 - y) / (scale + y);
        let mass = further_mass(hair, cos_theta, Fresnel::Dielectric);
        for (j, factor) in factors.iter_mut().enumerate() {
            let share = if j == 0 { 1.0 } else { 2.0 } / n * (j as f64 * at).cos();
            for c in 0..3 {
                factor[c] += share * mass[c] / (1.0 - y);
            }
        }
    }
    (factors.map(|row| row.map(|x| x as f32)), scale as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_counts_come_back() {
        let fibre = Fibre::new(&HairParams::default(), &Lobe::ALL, 4).unwrap();
        assert_eq!([0, 1, 2].map(|mode| fibre.node_count(mode)), [3, 2, 3]);
        let fibre = fibre.with_nodes([0, 99, 15]);
        assert_eq!([0, 1, 2].map(|mode| fibre.node_count(mode)), [1, 15, 15]);
        assert_eq!(size_of::<Fibre>(), 240);
    }
}
