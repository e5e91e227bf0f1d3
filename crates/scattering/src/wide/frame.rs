//! Directions of eight lights in the frame of a fibre. Twin: `closed_form/frame.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::DirectionInFrame;

use super::math::atan2;

/// Where a fibre is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Axes (u, v, w) of the fibre in the world; u is the tangent.
    pub frame: [[f32; 3]; 3],
    /// Towards the eye.
    pub view: DirectionInFrame,
}

/// Eight of [`DirectionInFrame`].
#[derive(Clone, Copy, Debug)]
pub struct Directions<S: Simd> {
    /// Inclination to the normal plane, radians.
    pub theta: f32x8<S>,
    /// Cosine of the inclination, 0..=1.
    pub cos_theta: f32x8<S>,
    /// Cosine of the azimuth; 1 where the azimuth has no meaning.
    pub cos_phi: f32x8<S>,
    /// Sine of the azimuth.
    pub sin_phi: f32x8<S>,
}

/// Eight of [`crate::closed_form::Lag`], of one view, as round fibres and elliptic ones look at them.
#[derive(Clone, Copy)]
pub(super) struct Lags<S: Simd> {
    pub sin_half: f32x8<S>,
    pub cos_half: f32x8<S>,
    /// sin(phi_j - phi_o), of which elliptic fibres want the sign.
    pub turn: f32x8<S>,
}

impl<S: Simd> Directions<S> {
    /// [`DirectionInFrame::from_vector`] of the components along (u, v, w).
    #[inline(always)]
    pub fn from_vectors([u, v, w]: [f32x8<S>; 3]) -> Directions<S> {
        let simd = u.token();
        let radius_2 = v * v + w * w;
        let radius = radius_2.sqrt();
        // A zero for the azimuth, and not its inverse, where it has no meaning.
        let is_pole = radius.simd_lt(1e-12);
        let one = f32x8::splat(simd, 1.0);
        let zero = f32x8::splat(simd, 0.0);
        let inverse = one / is_pole.select(one, radius);
        let length = (u * u + radius_2).sqrt();
        Directions {
            theta: atan2(u, radius),
            cos_theta: is_pole.select(zero, radius / length),
            cos_phi: is_pole.select(one, v * inverse),
            sin_phi: is_pole.select(zero, w * inverse),
        }
    }
}

/// [`crate::closed_form::lag_between`] the view and these lights.
#[inline(always)]
pub(super) fn lags_between<S: Simd>(view: &DirectionInFrame, at: &Directions<S>) -> Lags<S> {
    let simd = at.theta.token();
    let cos_o = f32x8::splat(simd, view.cos_phi);
    let sin_o = f32x8::splat(simd, view.sin_phi);
    let (d_c, d_s) = (cos_o - at.cos_phi, sin_o - at.sin_phi);
    let (s_c, s_s) = (cos_o + at.cos_phi, sin_o + at.sin_phi);
    Lags {
        sin_half: ((d_c * d_c + d_s * d_s).sqrt() * 0.5).min(1.0),
        cos_half: ((s_c * s_c + s_s * s_s).sqrt() * 0.5).min(1.0),
        turn: cos_o * at.sin_phi - sin_o * at.cos_phi,
    }
}
