//! The parameters of a fibre as the shaders hold them. Twin: `shaders/lib/fibre.wgsl`.

use crate::{HairParams, Lobe, ParamError};

use super::outer_integral::MAX_SEGMENTS;

/// Bit of [`Fibre::modes`] that enables R.
pub const MODE_R: u32 = 1;
/// Bit of [`Fibre::modes`] that enables TT.
pub const MODE_TT: u32 = 2;
/// Bit of [`Fibre::modes`] that enables TRT.
pub const MODE_TRT: u32 = 4;

/// One fibre, byte for byte the uniform `Fibre` of the shaders (64 bytes).
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
    /// Segments m of the outer integral, 2..=[`MAX_SEGMENTS`].
    pub segments: u32,
    /// Index of refraction of an elliptic fibre along its axes (Eq 24): mean of eta*_1, eta*_2.
    pub eta_mean: f32,
    /// (eta*_1 - eta*_2) / 2 of Eq 24; 0 for a circular fibre.
    pub eta_swing: f32,
    /// Enabled modes, a sum of [`MODE_R`], [`MODE_TT`], [`MODE_TRT`].
    pub modes: u32,
    /// Fills the uniform up to 16 bytes; always 0.
    pub padding: u32,
}

/// Segments m of the outer integral that the renderer uses, the default of Xu 2011.
pub const DEFAULT_SEGMENTS: u32 = 4;

impl Fibre {
    /// The fibre with these parameters, rounded to single precision.
    ///
    /// `modes` lists what is enabled; `segments` is clamped to 2..=[`MAX_SEGMENTS`].
    ///
    /// # Errors
    /// The first parameter outside its range ([`HairParams::validate`]).
    pub fn new(hair: &HairParams, modes: &[Lobe], segments: u32) -> Result<Fibre, ParamError> {
        hair.validate()?;
        let per_lobe = |value: &crate::PerLobe<f64>| Lobe::ALL.map(|lobe| value.get(lobe) as f32);
        let a_2 = hair.eccentricity * hair.eccentricity;
        let eta_1 = 2.0 * (hair.eta - 1.0) * a_2 - hair.eta + 2.0;
        let eta_2 = 2.0 * (hair.eta - 1.0) / a_2 - hair.eta + 2.0;
        Ok(Fibre {
            sigma_a: hair.sigma_a.map(|sigma_a| sigma_a as f32),
            eta: hair.eta as f32,
            alpha: per_lobe(&hair.shift),
            caustic_width: hair.caustic_width as f32,
            beta: per_lobe(&hair.width),
            segments: segments.clamp(2, MAX_SEGMENTS),
            eta_mean: (0.5 * (eta_1 + eta_2)) as f32,
            eta_swing: (0.5 * (eta_1 - eta_2)) as f32,
            modes: modes.iter().fold(0, |bits, lobe| bits | 1 << lobe.p()),
            padding: 0,
        })
    }

    /// The fibre with another absorption, as painted hair has.
    pub fn with_sigma_a(self, sigma_a: [f32; 3]) -> Fibre {
        Fibre { sigma_a, ..self }
    }
}
