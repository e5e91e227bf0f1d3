//! Path tracing of the exact scattering function: unbiased, with any number of events.
//!
//! A path walks from the eye. At each crossing the environment is sampled directly, several times at the
//! first two, and by scattering, the two combined by the power heuristic (Veach 1997); after [`ROULETTE_FROM`]
//! events it goes on with a probability that follows what it carries.
//!
//! Proxies are further events: light by way of them counts as sent back.
//!
//! The exact S loses energy at every event: a white groom does not vanish in a furnace
//! ([`PathTracer::with_energy_of`] makes it).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use strandlight_formats::Scattering;
use strandlight_scattering::exact::{Bcsdf, BcsdfView};
use strandlight_scene::proxy::ProxyRecord;
use strandlight_scene::strands::Strands;

use super::integrator::CameraRay;
use super::{Environment, Fibres, Frame, Integrator, Layers, Met, Surface, World};
use crate::mesh_rays::MeshRays;
use crate::rays::{Rays, Start};
use strandlight_scattering::random::{R2, SplitMix64};

/// Events before a path goes on only as often as what it carries.
pub const ROULETTE_FROM: u32 = 8;

/// Before that, a path that carries less than one over this is thinned too, to the carried share
/// times this: dark hair would trace seven more events that bring nothing.
const EARLY_ROULETTE: f64 = 4.0;

/// Light that would add less than this share of what a path has brought so far is looked for only as often as
/// what it would add (measured: a twentieth less variance in the same time).
const LITTLE_LIGHT: f64 = 0.3;

/// Events after which a path is given up; white hair needs some hundred.
pub const MAX_EVENTS: u32 = 4096;

/// Directions drawn by the light at the first events of a path, and at all later ones. One more costs less
/// than the noise that it takes away as long as few events have passed (measured in docs/book/src/accuracy/accuracy.md).
const N_LIGHT_DRAWS: [u32; 3] = [4, 2, 1];

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
    /// Did it meet hair first?
    pub is_covered: bool,
    /// Did it meet a proxy first? If it met neither, all else is 0.
    pub is_matte: bool,
    /// Radiance of the proxy; that of hair is 0 then.
    pub matte: [f64; 3],
    /// Radiance of light that met exactly one fibre and nothing else.
    pub single: [f64; 3],
    /// Radiance of light that every fibre but the seen one, at least one, sent forward: into the
    /// half circle of azimuths behind it, as dual scattering has it.
    pub forward: [f64; 3],
    /// Radiance of all light that hair sends.
    pub total: [f64; 3],
    /// Scattering events.
    pub events: u32,
    /// Was it given up at [`MAX_EVENTS`]?
    pub is_capped: bool,
}

/// Traces paths through one groom.
pub struct PathTracer<'a> {
    strands: &'a Strands,
    world: World<'a>,
    fibres: Fibres<'a>,
    environment: &'a Environment,
    estimator: Estimator,
    /// Of the hair's light, what is wanted.
    scattering: Scattering,
    /// What S is divided by.
    albedo: Option<Albedo>,
}

/// Inclinations of the albedo that S is divided by.
const N_ALBEDOS: u32 = 2001;

/// Azimuths of that of an elliptic fibre, over a quarter turn.
const N_TURNS: u32 = 17;

/// Albedo, mean of the channels, at theta_o spread evenly over +-pi/2.
struct Albedo {
    /// Of an elliptic fibre at each of [`N_TURNS`] azimuths phi_o over 0..=pi/2; else one.
    turns: Vec<Vec<f64>>,
}

/// Directions drawn by the light at event number `event` of a path, 1 or more.
fn n_light_draws(event: u32) -> u32 {
    let ix = (event as usize - 1).min(N_LIGHT_DRAWS.len() - 1);
    N_LIGHT_DRAWS[ix]
}

/// Draw `ix` of the `n` that `first` begins: each in a stratum of the lights of its own, its place in the
/// light by an additive sequence.
fn spread(first: [f64; 3], ix: u32, n: u32) -> [f64; 3] {
    let steps = [1.0 / f64::from(n), R2[0], R2[1]];
    std::array::from_fn(|axis| (first[axis] + f64::from(ix) * steps[axis]).fract())
}

fn max([r, g, b]: [f64; 3]) -> f64 {
    r.max(g).max(b)
}

/// Weight of a draw of density `own`, that of one draw times their number, beside another way of density
/// `other` (Veach 1997).
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
            world: World {
                rays,
                proxies: &[],
                meshes: &[],
            },
            fibres: fibres.into(),
            environment,
            estimator: Estimator::default(),
            scattering: Scattering::Total,
            albedo: None,
        }
    }

    /// The same with proxies beside the hair, which scatter light as matte surfaces do, to the hair
    /// as well.
    pub fn with_proxies(mut self, proxies: &'a [ProxyRecord]) -> Self {
        self.world.proxies = proxies;
        self
    }

    /// The same with meshes beside the hair.
    pub fn with_meshes(mut self, meshes: &'a [MeshRays]) -> Self {
        self.world.meshes = meshes;
        self
    }

    /// The same with another way of finding the light.
    pub fn with_estimator(self, estimator: Estimator) -> Self {
        PathTracer { estimator, ..self }
    }

    /// The same for those who read of the hair's light only that by `scattering`: paths end where all that
    /// follows is another part.
    pub fn with_scattering(self, scattering: Scattering) -> Self {
        PathTracer { scattering, ..self }
    }

    /// The same with S divided by the albedo that `white`, the same fibre without absorption, has
    /// at theta_o, so that a fibre without absorption returns exactly 1 (the "energy
    /// safe" model). Not the exact model, and not reciprocal: it shows what the model loses.
    pub fn with_energy_of(self, white: &Bcsdf) -> Self {
        PathTracer {
            albedo: Some(Albedo::of(white)),
            ..self
        }
    }

    /// One path that leaves the eye at `start` towards the unit vector `direction`. `first` are
    /// numbers in 0..1 that draw the first light of the first event, for those who spread them evenly.
    pub fn trace(
        &self,
        start: &Start,
        direction: Vec3,
        first: [f64; 3],
        random: &mut SplitMix64,
    ) -> Traced {
        let mut traced = Traced::default();
        let mut met = self.world.seen(start, direction);
        match met {
            Met::Nothing => return traced,
            Met::Hair(_) => traced.is_covered = true,
            Met::Matte(_) => traced.is_matte = true,
        }
        let mut direction = direction;
        let mut carried = [1.0f64; 3];
        let mut has_turned = false;
        while traced.events < MAX_EVENTS {
            traced.events += 1;
            let Some(place) = self.place(&met, direction) else {
                return traced;
            };
            let start = place.start;
            if let (Some(albedo), Scatterer::Fibre { omega_o, .. }) = (&self.albedo, &place.by) {
                let inverse = 1.0 / albedo.at(*omega_o);
                carried = carried.map(|x| x * inverse);
            }

            // Light drawn by itself.
            let n_draws = n_light_draws(traced.events);
            if self.estimator != Estimator::Fibre {
                let first = match traced.events {
                    1 => first,
                    _ => std::array::from_fn(|_| random.uniform(0.0, 1.0)),
                };
                let draws = (first, n_draws);
                self.add_light(&mut traced, &place, draws, carried, has_turned, random);
            }

            // Light, or what comes next, drawn by scattering.
            let Some(drawn) = place.by.draw(random) else {
                return traced;
            };
            for (carried, weight) in carried.iter_mut().zip(drawn.weight) {
                *carried *= weight;
            }
            direction = drawn.direction;
            // Only what lies beyond the seen fibre can turn light back.
            has_turned |= traced.events > 1 && drawn.is_turned;
            // Proxies are seen in all light.
            let is_last = traced.is_covered
                && match self.scattering {
                    Scattering::Single => true,
                    Scattering::Global => has_turned,
                    Scattering::Local | Scattering::Total => false,
                };
            met = match is_last {
                false => self.world.met(&start, direction),
                // All that is wanted still is light.
                true if self.world.is_blocked(&start, direction) => return traced,
                true => Met::Nothing,
            };
            if met == Met::Nothing {
                let (radiance, pdf) = self.environment.radiance(direction);
                let weight = match self.estimator {
                    Estimator::Both => {
                        power_heuristic(drawn.pdf, f64::from(n_draws) * f64::from(pdf))
                    }
                    Estimator::Light => 0.0,
                    Estimator::Fibre => 1.0,
                };
                if weight > 0.0 {
                    let brought = |c: usize| carried[c] * weight * f64::from(radiance[c]);
                    traced.add(std::array::from_fn(brought), has_turned);
                }
                return traced;
            }
            let mut stays = max(carried);
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

    /// Adds light from as many directions as `draws` says, the first of which the environment has at its
    /// numbers, sent on at `place` by a path that has `carried` so much and has turned before or not.
    fn add_light(
        &self,
        traced: &mut Traced,
        place: &Place,
        (first, n_draws): ([f64; 3], u32),
        carried: [f64; 3],
        has_turned: bool,
        random: &mut SplitMix64,
    ) {
        // Only what lies beyond the seen fibre can turn light back.
        let is_beyond = traced.events > 1;
        let draws = (0..n_draws).map(|draw| spread(first, draw, n_draws));
        for emitted in draws.filter_map(|draw| self.environment.at(draw)) {
            let sent = place.by.sends(emitted.direction);
            let pdf = f64::from(n_draws) * f64::from(emitted.pdf);
            let weight = match self.estimator {
                Estimator::Light => 1.0,
                _ => power_heuristic(pdf, sent.pdf),
            };
            let brought: [f64; 3] = std::array::from_fn(|c| {
                let radiance = f64::from(emitted.radiance[c]);
                carried[c] * sent.share[c] * radiance * weight / pdf
            });
            // A ray costs as much for little light as for much.
            let much = LITTLE_LIGHT * max(traced.total);
            let share = if much > 0.0 {
                (max(brought) / much).min(1.0)
            } else {
                1.0
            };
            let is_traced = share >= 1.0 || random.uniform(0.0, 1.0) < share;
            if max(brought) > 0.0
                && is_traced
                && !self.world.is_blocked(&place.start, emitted.direction)
            {
                let brought = brought.map(|x| x / share);
                traced.add(brought, has_turned || (is_beyond && sent.is_turned));
            }
        }
    }

    /// What scatters at `met` on a path that comes along `direction`.
    fn place(&self, met: &Met, direction: Vec3) -> Option<Place<'a>> {
        match met {
            Met::Nothing => None,
            Met::Hair(crossing) => {
                let frame = Frame::at(self.strands, crossing);
                let omega_o = frame.to_fibre(-direction);
                Some(Place {
                    start: Start::inside(self.strands, crossing.segment, crossing.along),
                    by: Scatterer::Fibre {
                        view: self.fibres.view(self.strands, crossing, omega_o),
                        frame,
                        omega_o,
                    },
                })
            }
            Met::Matte(surface) => Some(Place {
                start: surface.start(),
                by: Scatterer::Matte(*surface),
            }),
        }
    }
}

/// Where a path scatters.
struct Place<'a> {
    start: Start,
    by: Scatterer<'a>,
}

/// What it is scattered by.
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack")]
enum Scatterer<'a> {
    Fibre {
        view: BcsdfView<'a>,
        frame: Frame,
        omega_o: [f64; 3],
    },
    Matte(Surface),
}

/// What is sent on of light from a direction.
struct Sent {
    /// Scattering function times cosine.
    share: [f64; 3],
    /// Density with which the direction is drawn.
    pdf: f64,
    /// Does it leave to the side that it came from?
    is_turned: bool,
}

/// A direction drawn.
struct Drawn {
    direction: Vec3,
    /// Share over density.
    weight: [f64; 3],
    pdf: f64,
    is_turned: bool,
}

impl Scatterer<'_> {
    fn sends(&self, towards: Vec3) -> Sent {
        match self {
            Scatterer::Fibre {
                view,
                frame,
                omega_o,
            } => {
                let omega_i = frame.to_fibre(towards);
                let scattered = view.evaluate(omega_i);
                let cos_i = omega_i[1].hypot(omega_i[2]);
                Sent {
                    share: scattered.s.map(|s| s * cos_i),
                    pdf: scattered.pdf,
                    is_turned: is_turned(*omega_o, omega_i),
                }
            }
            Scatterer::Matte(surface) => {
                let (share, pdf) = surface.sends(towards);
                Sent {
                    share,
                    pdf,
                    is_turned: true,
                }
            }
        }
    }

    /// `None` where nothing is scattered.
    fn draw(&self, random: &mut SplitMix64) -> Option<Drawn> {
        match self {
            Scatterer::Fibre {
                view,
                frame,
                omega_o,
            } => {
                let sample = view.sample(&mut || random.uniform(0.0, 1.0))?;
                Some(Drawn {
                    direction: frame.to_world(sample.omega_i),
                    weight: sample.weight,
                    pdf: sample.pdf,
                    is_turned: is_turned(*omega_o, sample.omega_i),
                })
            }
            Scatterer::Matte(surface) => {
                let direction = surface.draw([0, 1].map(|_| random.uniform(0.0, 1.0)));
                let (_, pdf) = surface.sends(direction);
                (pdf > 0.0).then_some(Drawn {
                    direction,
                    weight: surface.albedo,
                    pdf,
                    is_turned: true,
                })
            }
        }
    }
}

/// Whether a fibre sends light back into the half circle of azimuths that it came from.
fn is_turned(omega_o: [f64; 3], omega_i: [f64; 3]) -> bool {
    omega_o[1] * omega_i[1] + omega_o[2] * omega_i[2] > 0.0
}

impl Integrator for PathTracer<'_> {
    /// What only fibres beyond the seen one sent forward is `global`, as in dual scattering, and
    /// the rest of what met more than one, or a proxy, is `local`.
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers {
        let traced = self.trace(&ray.start, ray.direction, first_light(ray), random);
        Layers {
            is_covered: traced.is_covered,
            is_matte: traced.is_matte,
            matte: traced.matte,
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
            if self.is_matte {
                self.matte[c] += x;
                continue;
            }
            self.total[c] += x;
            if self.events == 1 {
                self.single[c] += x;
            } else if !has_turned {
                self.forward[c] += x;
            }
        }
    }
}

impl Albedo {
    fn of(fibre: &Bcsdf) -> Albedo {
        let n_turns = if fibre.has_roll() { N_TURNS } else { 1 };
        let of_turn = |turn: u32| {
            let phi_o = FRAC_PI_2 * f64::from(turn) / f64::from(N_TURNS - 1);
            let at = |ix: u32| {
                let theta_o = PI * (f64::from(ix) / f64::from(N_ALBEDOS - 1) - 0.5);
                let [r, g, b] = fibre.albedo_from(theta_o, phi_o);
                // Nothing is scattered along the fibre by lobes that are all shifted beyond it.
                ((r + g + b) / 3.0).max(1e-6)
            };
            (0..N_ALBEDOS).map(at).collect()
        };
        Albedo {
            turns: (0..n_turns).map(of_turn).collect(),
        }
    }

    /// Seen from the unit vector `omega_o` in the fibre's frame.
    fn at(&self, omega_o: [f64; 3]) -> f64 {
        let [u, v, w] = omega_o;
        let theta = u.atan2(v.hypot(w));
        let between = |albedo: &[f64]| {
            let x = (theta / PI + 0.5) * (albedo.len() - 1) as f64;
            let ix = (x.max(0.0) as usize).min(albedo.len() - 2);
            let t = x - ix as f64;
            albedo[ix] * (1.0 - t) + albedo[ix + 1] * t
        };
        if let [round] = &*self.turns {
            return between(round);
        }
        // The same at phi_o + pi and, the two axes being those of the section, at -phi_o.
        let x = w.abs().atan2(v.abs()) / FRAC_PI_2 * f64::from(N_TURNS - 1);
        let ix = (x as usize).min(self.turns.len() - 2);
        let t = x - ix as f64;
        between(&self.turns[ix]) * (1.0 - t) + between(&self.turns[ix + 1]) * t
    }
}

#[cfg(test)]
#[path = "path_tests.rs"]
mod tests;
