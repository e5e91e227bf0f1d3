//! Brute force: the exact single scattering of many directional lights, each shadowed by a ray
//! (the references of Xu 2011 section 5, and Ren 2010's 1536 lights).

use glam::Vec3;
use strandlight_scene::proxy::ProxyRecord;
use strandlight_scene::strands::Strands;

use super::integrator::CameraRay;
use super::{Environment, Fibres, Frame, Integrator, Layers, Met, World};
use crate::mesh_rays::MeshRays;
use crate::rays::{Rays, Start};
use strandlight_scattering::random::{R2, SplitMix64};

/// Lights are taken in this many turns: a camera sample takes every 64th light, the next sample of
/// its pixel the lights after these, so that 64 samples have taken all.
const N_TURNS: u32 = 64;

/// A light at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Radiance times solid angle.
    pub power: [f64; 3],
}

/// `n` directional lights that share the environment's power evenly, in the mean of the channels;
/// none if there is none. Directions are stratified over the lights (or pixels) and inside each
/// lobe (or pixel) by inverse transform of a low-discrepancy sequence; over all seeds their sum
/// has the environment's mean.
pub fn directional_lights(environment: &Environment, n: u32, seed: u64) -> Vec<DirectionalLight> {
    let mut turn = SplitMix64(seed);
    let turns: [f64; 3] = std::array::from_fn(|_| turn.uniform(0.0, 1.0));
    (0..n)
        .filter_map(|ix| {
            let spread = |axis: usize| (turns[axis + 1] + f64::from(ix) * R2[axis]).fract();
            let stratum = (f64::from(ix) + turns[0]) / f64::from(n);
            let drawn = environment.at([stratum, spread(0), spread(1)])?;
            let share = 1.0 / (f64::from(n) * f64::from(drawn.pdf));
            Some(DirectionalLight {
                direction: drawn.direction,
                power: drawn.radiance.map(|x| f64::from(x) * share),
            })
        })
        .collect()
}

/// [`super::Method::Directional`] at work.
pub struct Directional<'a> {
    strands: &'a Strands,
    world: World<'a>,
    fibres: Fibres<'a>,
    lights: Vec<DirectionalLight>,
}

impl<'a> Directional<'a> {
    /// `n` lights of `environment` (see `directional_lights`) on `strands`, which `rays` were
    /// made of, whose `fibres` these are.
    pub fn new(
        strands: &'a Strands,
        rays: &'a Rays,
        fibres: impl Into<Fibres<'a>>,
        environment: &Environment,
        n: u32,
        seed: u64,
    ) -> Self {
        Directional {
            strands,
            world: World {
                rays,
                proxies: &[],
                meshes: &[],
            },
            fibres: fibres.into(),
            lights: directional_lights(environment, n, seed),
        }
    }

    /// The same with proxies beside the hair.
    pub fn with_proxies(mut self, proxies: &'a [ProxyRecord]) -> Self {
        self.world.proxies = proxies;
        self
    }

    /// The same with meshes beside the hair.
    pub fn with_meshes(mut self, meshes: &'a [MeshRays]) -> Self {
        self.world.meshes = meshes;
        self
    }
}

impl Integrator for Directional<'_> {
    fn sample(&self, ray: &CameraRay, _: &mut SplitMix64) -> Layers {
        let mut layers = Layers::default();
        let met = self.world.seen(&ray.start, ray.direction);
        // Radiance over that of a light in a direction, and where the ray to it starts.
        let sends: Box<dyn Fn(Vec3) -> [f64; 3]>;
        let start = match met {
            Met::Nothing => return layers,
            Met::Hair(crossing) => {
                layers.is_covered = true;
                let frame = Frame::at(self.strands, &crossing);
                let omega_o = frame.to_fibre(-ray.direction);
                let view = self.fibres.view(self.strands, &crossing, omega_o);
                sends = Box::new(move |direction| {
                    let omega_i = frame.to_fibre(direction);
                    let cos_i = omega_i[1].hypot(omega_i[2]);
                    view.evaluate(omega_i).s.map(|s| s * cos_i)
                });
                Start::inside(self.strands, crossing.segment, crossing.along)
            }
            Met::Matte(surface) => {
                layers.is_matte = true;
                sends = Box::new(move |direction| surface.sends(direction).0);
                surface.start()
            }
        };
        let sum = match layers.is_matte {
            true => &mut layers.matte,
            false => &mut layers.single,
        };
        // Every turn is as likely as any other, and taken lights stand for those left out.
        let n_turns = N_TURNS.min(self.lights.len().max(1) as u32);
        let turn = (ray.pixel_key as u32 % n_turns + ray.sample % n_turns) % n_turns;
        for light in self
            .lights
            .iter()
            .skip(turn as usize)
            .step_by(n_turns as usize)
        {
            let s = sends(light.direction);
            let sent: [f64; 3] =
                std::array::from_fn(|c| f64::from(n_turns) * light.power[c] * s[c]);
            if sent.iter().any(|&x| x > 0.0) && !self.world.is_blocked(&start, light.direction) {
                for (sum, sent) in sum.iter_mut().zip(sent) {
                    *sum += sent;
                }
            }
        }
        layers
    }
}
