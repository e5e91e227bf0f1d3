//! Path tracing of the exact scattering function: unbiased, with any number of events.
//!
//! A path walks from the eye. At each crossing the environment is sampled directly and by
//! scattering, the two combined by the power heuristic (Veach 1997); after [`ROULETTE_FROM`]
//! events it goes on with a probability that follows what it carries.
//!
//! The exact S loses energy at every event: a white groom does not vanish in a furnace
//! ([`PathTracer::with_energy_of`] makes it).

use glam::Vec3;
use strandlight_runtime::strands::Strands;
use strandlight_scattering::exact::Bcsdf;

use super::film::CameraRay;
use super::{Environment, Fibres, Frame, Integrator, Layers};
use crate::random::SplitMix64;
use crate::rays::{Rays, Start};

/// Events before a path goes on only as often as what it carries.
pub const ROULETTE_FROM: u32 = 8;

/// Before that, a path that carries less than one over this is thinned too, to the carried share
/// times this: dark hair would trace seven more events that bring nothing.
const EARLY_ROULETTE: f64 = 4.0;

/// Events after which a path is given up; white hair needs some hundred.
pub const MAX_EVENTS: u32 = 4096;

/// How paths find the light. All give the same picture but for noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Both of the others, by multiple importance sampling.
    #[default]
    Both,
    /// Directions drawn by the light.
    Light,
    /// Directions drawn by the fibre.
    Fibre,
}

/// What one path brings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traced {
    /// Did it meet hair? All else is 0 if not.
    pub is_covered: bool,
    /// Radiance of light that met exactly one fibre and nothing else.
    pub single: [f64; 3],
    /// Radiance of light that every fibre but the seen one, at least one, sent forward: into the
    /// half circle of azimuths behind it, as dual scattering has it.
    pub forward: [f64; 3],
    /// Radiance of all light.
    pub total: [f64; 3],
    /// Scattering events.
    pub events: u32,
    /// Was it given up at [`MAX_EVENTS`]?
    pub is_capped: bool,
}

/// Traces paths through one groom.
pub struct PathTracer<'a> {
    strands: &'a Strands,
    rays: &'a Rays,
    fibres: Fibres<'a>,
    environment: &'a Environment,
    estimator: Estimator,
    /// What S is divided by, at theta_o spread evenly over +-pi/2.
    albedo: Option<Vec<f64>>,
}

/// Inclinations of the albedo that S is divided by.
const N_ALBEDOS: u32 = 2001;

/// Weight of a draw of density `own` beside another way of density `other`.
fn power_heuristic(own: f64, other: f64) -> f64 {
    if own.is_infinite() {
        return 1.0;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl<'a> PathTracer<'a> {
    /// Paths among `strands`, which `rays` were made of, whose `fibres` these are.
    pub fn new(
        strands: &'a Strands,
        rays: &'a Rays,
        fibres: impl Into<Fibres<'a>>,
        environment: &'a Environment,
    ) -> Self {
        PathTracer {
            strands,
            rays,
            fibres: fibres.into(),
            environment,
            estimator: Estimator::default(),
            albedo: None,
        }
    }

    /// The same with another way of finding the light.
    pub fn with_estimator(self, estimator: Estimator) -> Self {
        PathTracer { estimator, ..self }
    }

    /// The same with S divided by the albedo that `white`, the same fibre without absorption, has
    /// at theta_o, so that a fibre without absorption returns exactly 1 (the "energy
    /// safe" model). Not the exact model, and not reciprocal: it shows what the model loses.
    pub fn with_energy_of(self, white: &Bcsdf) -> Self {
        let albedo = (0..N_ALBEDOS)
            .map(|ix| std::f64::consts::PI * (f64::from(ix) / f64::from(N_ALBEDOS - 1) - 0.5))
            .map(|theta| {
                let [r, g, b] = white.albedo(theta);
                // Nothing is scattered along the fibre by lobes that are all shifted beyond it.
                ((r + g + b) / 3.0).max(1e-6)
            })
            .collect();
        PathTracer {
            albedo: Some(albedo),
            ..self
        }
    }

    /// One path that leaves the eye at `start` towards the unit vector `direction`. `first` are
    /// numbers in 0..1 that draw the light of the first event, for those who spread them evenly.
    pub fn trace(
        &self,
        start: &Start,
        direction: Vec3,
        first: [f64; 3],
        random: &mut SplitMix64,
    ) -> Traced {
        let mut traced = Traced::default();
        let Some(mut crossing) = self.rays.nearest(start, direction) else {
            return traced;
        };
        traced.is_covered = true;
        let mut direction = direction;
        let mut carried = [1.0f64; 3];
        let mut has_turned = false;
        while traced.events < MAX_EVENTS {
            traced.events += 1;
            let frame = Frame::at(self.strands, &crossing);
            let omega_o = frame.to_fibre(-direction);
            let view = self.fibres.view(self.strands, &crossing, omega_o);
            // Only fibres beyond the seen one can turn light back.
            let is_beyond = traced.events > 1;
            let turns = |omega_i: [f64; 3]| {
                is_beyond && omega_o[1] * omega_i[1] + omega_o[2] * omega_i[2] > 0.0
            };
            let start = Start::inside(self.strands, crossing.segment, crossing.along);
            if let Some(albedo) = &self.albedo {
                let inverse = 1.0 / albedo_at(albedo, omega_o);
                carried = carried.map(|x| x * inverse);
            }

            // Light drawn by itself.
            if self.estimator != Estimator::Fibre
                && let Some(emitted) = match traced.events {
                    1 => self.environment.at(first),
                    _ => self.environment.sample(random),
                }
            {
                let omega_i = frame.to_fibre(emitted.direction);
                let scattered = view.evaluate(omega_i);
                let cos_i = omega_i[1].hypot(omega_i[2]);
                let pdf = f64::from(emitted.pdf);
                let weight = match self.estimator {
                    Estimator::Light => 1.0,
                    _ => power_heuristic(pdf, scattered.pdf),
                };
                let brought: [f64; 3] = std::array::from_fn(|c| {
                    let radiance = f64::from(emitted.radiance[c]);
                    carried[c] * scattered.s[c] * cos_i * radiance * weight / pdf
                });
                if brought.iter().any(|&x| x > 0.0)
                    && !self.rays.is_blocked(&start, emitted.direction)
                {
                    traced.add(brought, has_turned || turns(omega_i));
                }
            }

            // Light, or the next fibre, drawn by scattering.
            let Some(sample) = view.sample(&mut || random.uniform(0.0, 1.0)) else {
                return traced;
            };
            for (carried, weight) in carried.iter_mut().zip(sample.weight) {
                *carried *= weight;
            }
            direction = frame.to_world(sample.omega_i);
            has_turned |= turns(sample.omega_i);
            match self.rays.nearest(&start, direction) {
                Some(next) => crossing = next,
                None => {
                    let (radiance, pdf) = self.environment.radiance(direction);
                    let weight = match self.estimator {
                        Estimator::Both => power_heuristic(sample.pdf, f64::from(pdf)),
                        Estimator::Light => 0.0,
                        Estimator::Fibre => 1.0,
                    };
                    if weight > 0.0 {
                        let brought = |c: usize| carried[c] * weight * f64::from(radiance[c]);
                        traced.add(std::array::from_fn(brought), has_turned);
                    }
                    return traced;
                }
            }
            let mut stays = carried[0].max(carried[1]).max(carried[2]);
            if traced.events < ROULETTE_FROM {
                stays *= EARLY_ROULETTE;
            }
            if stays < 1.0 {
                if random.uniform(0.0, 1.0) >= stays {
                    return traced;
                }
                carried = carried.map(|x| x / stays);
            }
        }
        traced.is_capped = true;
        traced
    }
}

impl Integrator for PathTracer<'_> {
    /// What only fibres beyond the seen one sent forward is `global`, as in dual scattering, and
    /// the rest of what met more than one is `local`.
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers {
        let traced = self.trace(&ray.start, ray.direction, first_light(ray), random);
        Layers {
            is_covered: traced.is_covered,
            single: traced.single,
            global: traced.forward,
            local: std::array::from_fn(|c| traced.total[c] - traced.single[c] - traced.forward[c]),
        }
    }
}

/// Numbers of sample `ray` of its pixel that fill the unit cube evenly: the additive sequence of
/// 1/g, 1/g^2, 1/g^3, g^4 = g + 1, turned by the pixel's key.
fn first_light(ray: &CameraRay) -> [f64; 3] {
    const STEPS: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ];
    // Other numbers than those that turn the places in the pixel.
    let mut turn = SplitMix64::of_item(ray.pixel_key, u64::MAX);
    STEPS.map(|step| (turn.uniform(0.0, 1.0) + f64::from(ray.sample) * step).fract())
}

impl Traced {
    fn add(&mut self, brought: [f64; 3], has_turned: bool) {
        for (c, x) in brought.into_iter().enumerate() {
            self.total[c] += x;
            if self.events == 1 {
                self.single[c] += x;
            } else if !has_turned {
                self.forward[c] += x;
            }
        }
    }
}

/// `albedo` at the inclination of the unit vector `omega` in the fibre's frame.
fn albedo_at(albedo: &[f64], omega: [f64; 3]) -> f64 {
    let theta = omega[0].atan2(omega[1].hypot(omega[2]));
    let x = (theta / std::f64::consts::PI + 0.5) * (albedo.len() - 1) as f64;
    let ix = (x.max(0.0) as usize).min(albedo.len() - 2);
    let t = x - ix as f64;
    albedo[ix] * (1.0 - t) + albedo[ix + 1] * t
}

#[cfg(test)]
#[path = "path_tests.rs"]
mod tests;
