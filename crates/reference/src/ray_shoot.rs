//! Dual scattering with what lies between fibre and light taken from rays (Zinke 2008, section
//! 4.1: the offline method), as published: without the renderer's factor on global scattering
//! ([`strandlight_scattering::closed_form::global_density`]), with layers without end behind a fibre
//! (no f_local), and with factors of a_f before it (no F).
//!
//! Per seen fibre and direction omega_d of the light, drawn from the environment:
//!
//! ```text
//! no crossing:  single = L S(omega_d, omega_o) cos(theta_d)
//!               local  = L d_b S_back(omega_d, omega_o) cos(theta_d)
//! n crossings:  T_f = prod a_f,  sigma_f^2 = sum beta_f^2     at the crossed fibres' inclinations
//!               global = L d_f T_f     Int psi_f S      cos(theta_i) d omega_i
//!               local  = L d_f T_f d_b Int psi_f S_back cos(theta_i) d omega_i
//! ```
//!
//! per channel; psi_f, of unit mass, is `1/pi` on the half circle around omega_d times
//! `g^u(theta_i; theta_d, sigma_f) / Z`. Its directions are drawn, so that no closed form enters:
//! theta_i in proportion to `g^u cos(theta_i)`, the azimuth evenly, and the integrals are the means
//! of `S cos(theta_i)` and, with the azimuths' overlap `(pi - Delta) / pi^2` for the azimuth,
//! of `S_back cos(theta_i)`.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use strandlight_scattering::Model;
use strandlight_scattering::exact::{BcsdfView, FisherLobe};
use strandlight_scene::proxy::ProxyRecord;
use strandlight_scene::strands::Strands;

use super::frame::{Frame, tangent};
use super::integrator::CameraRay;
use super::{Averages, AveragesAt, Environment, Fibres, Integrator, Layers, Met, Surface, World};
use crate::mesh_rays::MeshRays;
use crate::rays::{Rays, Start};
use strandlight_scattering::random::SplitMix64;

/// How much of dual scattering's multiply scattered light is taken (Zinke 2008, section 4.1.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Densities {
    /// d_f, of light that other fibres sent forward.
    pub forward: f64,
    /// d_b, of light that was sent back.
    pub back: f64,
}

/// [`super::Method::RayShoot`] at work.
pub struct RayShoot<'a> {
    /// The hair, which `rays` were made of.
    pub strands: &'a Strands,
    /// Its hierarchy.
    pub rays: &'a Rays,
    /// What stands beside it.
    pub proxies: &'a [ProxyRecord],
    /// Meshes beside it.
    pub meshes: &'a [MeshRays],
    /// How its fibres scatter.
    pub fibres: Fibres<'a>,
    /// What they do on average.
    pub averages: Averages<'a>,
    /// The light.
    pub environment: &'a Environment,
    /// Directions of the light drawn for each camera sample, at least 1.
    pub n_draws: u32,
    /// d_f and d_b.
    pub densities: Densities,
}

/// Draws that theta_i is looked for with before its mean is taken: directions along the fibre
/// bring nothing, so this is not seen.
const MAX_TRIES: u32 = 10_000;

/// What lies along a ray to the light.
struct Passage {
    n: u32,
    transmitted: [f64; 3],
    width_2: [f64; 3],
}

impl Integrator for RayShoot<'_> {
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers {
        let mut layers = Layers::default();
        let world = World {
            rays: self.rays,
            proxies: self.proxies,
            meshes: self.meshes,
        };
        let crossing = match world.seen(&ray.start, ray.direction) {
            Met::Nothing => return layers,
            Met::Matte(surface) => {
                layers.is_matte = true;
                layers.matte = self.matte(&world, &surface, random);
                return layers;
            }
            Met::Hair(crossing) => crossing,
        };
        layers.is_covered = true;
        let frame = Frame::at(self.strands, &crossing);
        let omega_o = frame.to_fibre(-ray.direction);
        let seen = Seen {
            view: self.fibres.view(self.strands, &crossing, omega_o),
            averages: self.averages.at(self.strands, &crossing),
            theta_o: angles(omega_o).0,
            phi_o: angles(omega_o).1,
        };
        let start = Start::inside(self.strands, crossing.segment, crossing.along);
        let share = 1.0 / f64::from(self.n_draws);
        for draw in 0..self.n_draws {
            let Some(drawn) = self.environment.sample_stratum(draw, share, random) else {
                continue;
            };
            let power = drawn
                .radiance
                .map(|x| f64::from(x) / f64::from(drawn.pdf) * share);
            let omega_d = frame.to_fibre(drawn.direction);
            if world.is_blocked_beside(&start, drawn.direction) {
                continue;
            }
            let passage = self.passage(&start, drawn.direction);
            if passage.n == 0 {
                let direct = seen.direct(omega_d);
                add(&mut layers.single, power, direct.scattered);
                let power = power.map(|x| x * self.densities.back);
                add(&mut layers.local, power, direct.sent_back);
                continue;
            }
            let forward = seen.forward(omega_d, &passage.width_2, random);
            let power: [f64; 3] =
                std::array::from_fn(|c| power[c] * self.densities.forward * passage.transmitted[c]);
            add(&mut layers.global, power, forward.scattered);
            let power = power.map(|x| x * self.densities.back);
            add(&mut layers.local, power, forward.sent_back);
        }
        layers
    }
}

impl RayShoot<'_> {
    /// Radiance of a proxy, lit where nothing stands before the light.
    fn matte(&self, world: &World, surface: &Surface, random: &mut SplitMix64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let share = 1.0 / f64::from(self.n_draws);
        for draw in 0..self.n_draws {
            let Some(drawn) = self.environment.sample_stratum(draw, share, random) else {
                continue;
            };
            let (sent, density) = surface.sends(drawn.direction);
            if density > 0.0 && !world.is_blocked(&surface.start(), drawn.direction) {
                let scale = share / f64::from(drawn.pdf);
                let power = drawn.radiance.map(|x| f64::from(x) * scale);
                add(&mut sum, power, sent);
            }
        }
        sum
    }

    fn passage(&self, start: &Start, direction: glam::Vec3) -> Passage {
        let mut passage = Passage {
            n: 0,
            transmitted: [1.0; 3],
            width_2: [0.0; 3],
        };
        self.rays.crossings(start, direction, |crossing| {
            passage.n += 1;
            let u = tangent(self.strands, &crossing).normalize_or_zero();
            let theta = u.dot(direction).clamp(-1.0, 1.0).asin();
            let averages = self.averages.at(self.strands, &crossing);
            let [a_f, beta_f_2] = averages.forward(theta);
            for c in 0..3 {
                passage.transmitted[c] *= f64::from(a_f[c]);
                passage.width_2[c] += f64::from(beta_f_2[c]);
            }
        });
        passage
    }
}

/// `sum += power sent`, per channel.
fn add(sum: &mut [f64; 3], power: [f64; 3], sent: [f64; 3]) {
    for (sum, (power, sent)) in sum.iter_mut().zip(power.into_iter().zip(sent)) {
        *sum += power * sent;
    }
}

/// A fibre as the eye sees it.
struct Seen<'a> {
    view: BcsdfView<'a>,
    averages: AveragesAt<'a>,
    theta_o: f64,
    phi_o: f64,
}

/// `S cos(theta_i)` and `S_back cos(theta_i)`, or means of them.
struct Sent {
    scattered: [f64; 3],
    sent_back: [f64; 3],
}

impl Seen<'_> {
    /// Of light from `omega_i`.
    fn direct(&self, omega_i: [f64; 3]) -> Sent {
        let (theta_i, phi_i) = angles(omega_i);
        let (s, cos_i) = (self.view.evaluate(omega_i).s, theta_i.cos());
        let is_on_this_side = (phi_i - self.phi_o).cos() > 0.0;
        let azimuth = if is_on_this_side { FRAC_1_PI } else { 0.0 };
        Sent {
            scattered: s.map(|s| s * cos_i),
            sent_back: std::array::from_fn(|c| azimuth * self.back(theta_i, c)),
        }
    }

    /// Of one draw from psi_f around `omega_d` for each channel, `width_2` its sigma_f^2.
    fn forward(&self, omega_d: [f64; 3], width_2: &[f64; 3], random: &mut SplitMix64) -> Sent {
        let (theta_d, phi_d) = angles(omega_d);
        let phi_i = phi_d + random.uniform(-FRAC_PI_2, FRAC_PI_2);
        let lag = (phi_d - self.phi_o).cos().clamp(-1.0, 1.0).acos();
        let overlap = (PI - lag) / (PI * PI);
        // The same numbers for all channels, whose widths are much alike: less noise in colour.
        let numbers = random.next_u64();
        let mut sent = Sent {
            scattered: [0.0; 3],
            sent_back: [0.0; 3],
        };
        for (c, width_2) in width_2.iter().enumerate() {
            let theta_i = draw_inclination(theta_d, width_2.sqrt(), &mut SplitMix64(numbers));
            let (sin, cos) = theta_i.sin_cos();
            let omega_i = [sin, cos * phi_i.cos(), cos * phi_i.sin()];
            sent.scattered[c] = self.view.evaluate(omega_i).s[c] * cos;
            sent.sent_back[c] = overlap * self.back(theta_i, c);
        }
        sent
    }

    /// `A_b / cos^2(theta_d) g^u(theta_i; Delta_b - theta_o, sigma_b) cos(theta_i)` of channel `c`:
    /// S_back (Xu 2011 Eq 31) without its azimuth and without the factor 2, times the cosine; of model
    /// `energy` `A_b M`.
    fn back(&self, theta_i: f64, c: usize) -> f64 {
        let incident = 0.5 * (theta_i - self.theta_o);
        let averages = self.averages.backward(incident as f32);
        let [many, shift, width] = averages.map(|average| f64::from(average[c]));
        // Where nothing is sent back no width is known either.
        if !(many > 0.0 && width > 0.0) {
            return 0.0;
        }
        if self.averages.model() == Model::Energy {
            let lobe = FisherLobe::new(shift - self.theta_o, width);
            return many * lobe.density(theta_i) / theta_i.cos().max(1e-6);
        }
        let z = (theta_i + self.theta_o - shift) / width;
        let cos_d = incident.cos().max(1e-6);
        many * (-z * z).exp() / (PI.sqrt() * width) * theta_i.cos() / (cos_d * cos_d)
    }
}

/// theta_i in +-pi/2 with density in proportion to `g^u(theta_i; theta, width) cos(theta_i)`.
fn draw_inclination(theta: f64, width: f64, random: &mut SplitMix64) -> f64 {
    for _ in 0..MAX_TRIES {
        // Box and Muller; Xu's width is sqrt(2) standard deviations.
        let radius = (-(1.0 - random.uniform(0.0, 1.0)).ln()).sqrt();
        let normal = radius * (2.0 * PI * random.uniform(0.0, 1.0)).cos();
        let theta_i = theta + width * normal;
        if theta_i.abs() < FRAC_PI_2 && random.uniform(0.0, 1.0) < theta_i.cos() {
            return theta_i;
        }
    }
    theta.clamp(-FRAC_PI_2, FRAC_PI_2)
}

/// Inclination and azimuth of a unit vector in the fibre's frame.
fn angles([u, v, w]: [f64; 3]) -> (f64, f64) {
    (u.atan2(v.hypot(w)), w.atan2(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inclinations_have_the_density_of_the_cone() {
        // Mean and second moment against sums over a fine grid.
        for (theta, width) in [(0.0, 0.3), (0.8, 0.5), (-1.4, 0.2), (1.55, 1.5)] {
            let grid = 4000;
            let mut expected = [0.0; 3];
            for i in 0..grid {
                let x = PI * ((f64::from(i) + 0.5) / f64::from(grid) - 0.5);
                let weight = (-((x - theta) / width).powi(2)).exp() * x.cos();
                for (moment, power) in expected.iter_mut().zip(0..) {
                    *moment += weight * x.powi(power);
                }
            }
            let mut random = SplitMix64(3);
            let n = 100_000;
            let mut found = [0.0; 3];
            for _ in 0..n {
                let x = draw_inclination(theta, width, &mut random);
                for (moment, power) in found.iter_mut().zip(0..) {
                    *moment += x.powi(power) / f64::from(n);
                }
            }
            for ix in 1..3 {
                let expected = expected[ix] / expected[0];
                let error = 5.0 * width.min(1.0) / f64::from(n).sqrt() * 1.5;
                assert!(
                    (found[ix] - expected).abs() < error,
                    "{theta} {width} {ix}: {} {expected}",
                    found[ix]
                );
            }
        }
    }
}
