//! How scattered light is spread over the width of a strand that is wider than a pixel.
//!
//! The model averages over the offset h of a ray from the axis (Marschner 2003 section 4.2). Close up the strand's
//! sides differ: R shows a light on the light's side, TT on the other one. Here the profile over the place
//! `a` across the strand (-1 at its left edge, 1 at its right one, looking along the strand from the root) is
//!
//! `1 + even (3 a^2 - 1) / 2 + side a`
//!
//! the first Legendre polynomials. Its mean is 1, so a picture keeps its light, and a strand thinner than a pixel looks as
//! it did. `side` is that of each light and mode, `even` that of the fibre under even light.

use std::f32::consts::PI;

use bytemuck::{Pod, Zeroable};

use super::frame::{DirectionInFrame, LightInFrame};
use crate::exact::FibreSection;
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;

/// Azimuths between light and eye, 0..=pi.
const N_PROFILE_LAGS: usize = 33;

/// Widths of the light: its standard deviation in azimuth is [`LEAST_DEVIATION`], then twice the one before.
const N_PROFILE_WIDTHS: usize = 4;

/// Standard deviation of the narrowest light, rad.
const LEAST_DEVIATION: f32 = 0.125;

/// Profile of a fibre over its width. Twin of `WidthProfile` in `lib/width_profile`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WidthProfile {
    /// Factor of the second Legendre polynomial, r, g, b and zero; 0..=1.
    pub even: [f32; 4],
    /// Factors of the first one for light from the right, `[width][azimuth]`: R, TT, TRT and zero; -1..=1.
    pub sides: [[f32; 4]; N_PROFILE_LAGS * N_PROFILE_WIDTHS],
}

crate::mirrors! {
    WidthProfile as "WidthProfile" in "lib/width_profile" { even, sides }
}

impl WidthProfile {
    /// Of fibres without a profile.
    pub const FLAT: WidthProfile = WidthProfile {
        even: [0.0; 4],
        sides: [[0.0; 4]; N_PROFILE_LAGS * N_PROFILE_WIDTHS],
    };

    /// Of a round fibre seen across, theta_d = 0: the first moment of h over `A_t(h)` (Xu 2011 Eq 10) of the rays
    /// that a light sends to the eye, a Gaussian over the azimuth of their exit (Eq 8).
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> WidthProfile {
        let section = FibreSection::of(hair, hair.eta, 0.0, fresnel);
        let rule = GaussLegendre::new(48);
        // sin gamma = h, dense near grazing.
        let offsets: Vec<[f64; 3]> = [-1.0, 1.0]
            .into_iter()
            .flat_map(|side| {
                rule.on(0.0, 1.0).map(move |(s, weight)| {
                    let gamma = side * std::f64::consts::FRAC_PI_2 * (1.0 - s * s);
                    [gamma, gamma.sin(), weight * s * gamma.cos()]
                })
            })
            .collect();
        let mut profile = WidthProfile::FLAT;
        let (mut mass, mut second) = ([0.0; 3], [0.0; 3]);
        for (mode, lobe) in Lobe::ALL.into_iter().enumerate() {
            let rays: Vec<[f64; 3]> = offsets
                .iter()
                .map(|&[gamma, h, weight]| {
                    let kept = section.attenuation(lobe, h, gamma.cos());
                    for (channel, kept) in kept.into_iter().enumerate() {
                        mass[channel] += weight * kept;
                        second[channel] += weight * kept * (1.5 * h * h - 0.5);
                    }
                    let mean = kept.iter().sum::<f64>() / 3.0;
                    [section.exit_azimuth(lobe, gamma), h, weight * mean]
                })
                .collect();
            for width in 0..N_PROFILE_WIDTHS {
                let deviation = f64::from(LEAST_DEVIATION) * f64::from(1_u32 << width);
                for lag in 0..N_PROFILE_LAGS {
                    let azimuth = std::f64::consts::PI * lag as f64 / (N_PROFILE_LAGS - 1) as f64;
                    let (mut light, mut first) = (1e-12, 0.0);
                    for &[exit, h, kept] in &rays {
                        let nearness = (azimuth - exit).cos() - 1.0;
                        let share = kept * (nearness / (deviation * deviation)).exp();
                        light += share;
                        // h > 0 sends R to negative azimuths: that is the left side.
                        first -= share * h;
                    }
                    let side = (3.0 * first / light).clamp(-1.0, 1.0);
                    profile.sides[N_PROFILE_LAGS * width + lag][mode] = side as f32;
                }
            }
        }
        for channel in 0..3 {
            if mass[channel] > 0.0 {
                let even = 5.0 * second[channel] / mass[channel];
                profile.even[channel] = even.clamp(0.0, 1.0) as f32;
            }
        }
        profile
    }

    /// Factors of the first polynomial for R, TT and TRT of a light.
    pub fn sides(&self, light: &LightInFrame, view: &DirectionInFrame) -> [f32; 3] {
        let place = profile_place(light, view);
        let [here, wider] = [place.first, place.first + N_PROFILE_LAGS];
        let entries = [here, here + 1, wider, wider + 1].map(|at| &self.sides[at]);
        profile_sides(&place, entries)
    }
}

/// Where the factors of a light lie among [`WidthProfile::sides`].
#[derive(Clone, Copy, Debug)]
struct ProfilePlace {
    /// The entry of the lower azimuth and the lower width.
    first: usize,
    /// From it to the next azimuth, and to the next width, 0..=1.
    to_next: [f32; 2],
    /// Which side the light is on.
    sign: f32,
}

fn profile_place(light: &LightInFrame, view: &DirectionInFrame) -> ProfilePlace {
    let at = &light.direction;
    let cos_lag = at.cos_phi * view.cos_phi + at.sin_phi * view.sin_phi;
    let sin_lag = at.sin_phi * view.cos_phi - at.cos_phi * view.sin_phi;
    let deviation = light.lambda * std::f32::consts::FRAC_1_SQRT_2 / at.cos_theta.max(0.1);
    let lag = sin_lag.abs().atan2(cos_lag) * ((N_PROFILE_LAGS - 1) as f32 / PI);
    let width = (deviation.max(LEAST_DEVIATION) / LEAST_DEVIATION).log2();
    let first_lag = lag.floor().clamp(0.0, (N_PROFILE_LAGS - 2) as f32);
    let first_width = width.floor().clamp(0.0, (N_PROFILE_WIDTHS - 2) as f32);
    let to_next = [lag - first_lag, width - first_width];
    ProfilePlace {
        first: N_PROFILE_LAGS * first_width as usize + first_lag as usize,
        to_next: to_next.map(|x| x.clamp(0.0, 1.0)),
        sign: if sin_lag >= 0.0 { 1.0 } else { -1.0 },
    }
}

/// Factors of R, TT and TRT between the entries of two azimuths, for the lower width and the next.
fn profile_sides(place: &ProfilePlace, entries: [&[f32; 4]; 4]) -> [f32; 3] {
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    [0, 1, 2].map(|mode: usize| {
        let [here, next, here_wider, next_wider] = entries.map(|entry| entry[mode]);
        let narrow = mix(here, next, place.to_next[0]);
        let wide = mix(here_wider, next_wider, place.to_next[0]);
        place.sign * mix(narrow, wide, place.to_next[1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Factors for a light across the strand, `lag` rad beyond the eye, of such a standard deviation.
    fn sides(profile: &WidthProfile, lag: f32, deviation: f32) -> [f32; 3] {
        let light = LightInFrame::from_angles(0.0, lag, deviation * std::f32::consts::SQRT_2);
        profile.sides(&light, &DirectionInFrame::from_angles(0.0, 0.0))
    }

    fn profile(sigma_a: f64) -> WidthProfile {
        let hair = HairParams {
            sigma_a: [sigma_a; 3],
            ..HairParams::default()
        };
        WidthProfile::new(&hair, Fresnel::Dielectric)
    }

    #[test]
    fn r_shows_a_light_on_its_side_and_tt_on_the_other() {
        let profile = profile(0.3);
        // A light to the right: R at h = sin(lag / 2), here within what a line can follow.
        let lag = 0.3_f32;
        let [r, _, _] = sides(&profile, lag, 0.125);
        assert!((r - 3.0 * (0.5 * lag).sin()).abs() < 0.02, "{r}");
        let [r, _, _] = sides(&profile, 0.5 * PI, 0.125);
        assert_eq!(r, 1.0);
        // Behind and a little to the right.
        let lag = PI - 0.15;
        let [_, tt, _] = sides(&profile, lag, 0.125);
        assert!((-0.8..-0.2).contains(&tt), "{tt}");
        let mirrored = sides(&profile, -lag, 0.125);
        assert_eq!(mirrored[1], -tt);
    }

    /// Rays through a glass cylinder, refracted by Snell's law at its surface: no formula for azimuths.
    #[test]
    fn tt_is_where_rays_through_a_cylinder_leave() {
        let eta = HairParams::default().eta;
        let refract = |d: [f64; 2], n: [f64; 2], ratio: f64| {
            let cos = -(d[0] * n[0] + d[1] * n[1]);
            let k = (1.0 - ratio * ratio * (1.0 - cos * cos)).sqrt();
            [0, 1].map(|ix: usize| ratio * d[ix] + (ratio * cos - k) * n[ix])
        };
        let profile = profile(0.0);
        for a in [-0.25_f64, 0.1, 0.3] {
            // From the eye at +y down to the place a to the right (+x); root to tip towards the eye's upside, so
            // azimuths about it grow from the eye (+y) over the right (+x).
            let entry = [a, (1.0 - a * a).sqrt()];
            let inside = refract([0.0, -1.0], entry, 1.0 / eta);
            let way = -2.0 * (entry[0] * inside[0] + entry[1] * inside[1]);
            let exit = [0, 1].map(|ix: usize| entry[ix] + way * inside[ix]);
            let out = refract(inside, exit.map(|x| -x), eta);
            let lag = out[0].atan2(out[1]) as f32;
            let [_, tt, _] = sides(&profile, lag, 0.125);
            assert!(
                (f64::from(tt) - 3.0 * a).abs() < 0.12,
                "{a}: {tt} for a light at {lag}"
            );
        }
    }

    #[test]
    fn profiles_are_never_dark_and_have_the_mean_one() {
        for sigma_a in [0.0, 0.3, 2.0, 50.0] {
            let profile = profile(sigma_a);
            assert!((0.0..=1.0).contains(&profile.even[0]), "{sigma_a}");
            for lag in 0..40 {
                for side in sides(&profile, 0.2 * lag as f32, 0.3) {
                    let at = |a: f32| 1.0 + profile.even[0] * (1.5 * a * a - 0.5) + side * a;
                    let places = (0..200).map(|ix| (ix as f32 + 0.5) / 100.0 - 1.0);
                    assert!(places.clone().all(|a| at(a) >= 0.0));
                    let mean = places.map(at).sum::<f32>() / 200.0;
                    assert!((mean - 1.0).abs() < 1e-4, "{mean}");
                }
            }
        }
        // The surface's reflection, strong at grazing angles, is all that black hair sends.
        assert!(profile(50.0).even[0] > profile(0.0).even[0] + 0.3);
    }
}
