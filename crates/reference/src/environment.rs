//! The light from outside, for tracing paths: its radiance, and directions drawn by it.

mod cumulative;
mod map_sampler;

use std::f64::consts::PI;

use glam::Vec3;
use strandlight_formats::{LightsSection, SrbfLight};
use strandlight_scene::LatLong;
use strandlight_scene::volume::power;

use strandlight_scattering::random::SplitMix64;
use strandlight_scattering::wide::math::exp;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{LANES, Level, Simd, dispatch, f32x8};

use cumulative::{Cumulative, mean};

pub use map_sampler::MapSampler;

/// Light from infinitely far.
pub enum Environment {
    /// A sum of spherical Gaussians.
    Lights(LightSampler),
    /// A map, constant over each pixel.
    Map(MapSampler),
    /// Both at once: a map, and lights that a scene adds.
    MapAndLights(MapSampler, LightSampler),
}

/// A direction drawn from an [`Environment`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitted {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Radiance from there.
    pub radiance: [f32; 3],
    /// Density of the draw per solid angle, the one [`Environment::radiance`] gives.
    pub pdf: f32,
}

impl Environment {
    /// The light of a map with these `pixels`, the top row first, turned and multiplied as `section` says. Of the
    /// `lights` of a scene, which are those of its set and then those that `section` adds, the latter shine too.
    pub fn of_map(
        grid: LatLong,
        pixels: &[[f32; 3]],
        section: &LightsSection,
        lights: &[SrbfLight],
    ) -> Environment {
        let turn = section.rotate_deg.to_radians() as f32;
        let factor = section.tint.map(|tint| (tint * section.intensity) as f32);
        let map = MapSampler::new(grid, pixels, turn, factor);
        match &lights[lights.len().saturating_sub(section.added.len())..] {
            [] => Environment::Map(map),
            added => Environment::MapAndLights(map, LightSampler::new(added)),
        }
    }

    /// Radiance from the unit vector `omega`, and the density with which [`Environment::sample`]
    /// draws it: proportional to the mean of the channels, 0 where there is no light at all.
    pub fn radiance(&self, omega: Vec3) -> ([f32; 3], f32) {
        match self {
            Environment::Lights(lights) => lights.radiance(omega),
            Environment::Map(map) => map.radiance(omega),
            Environment::MapAndLights(map, lights) => {
                let (of_map, of_lights) = (map.radiance(omega), lights.radiance(omega));
                let share = map_share(map, lights);
                let sum = [0, 1, 2].map(|c: usize| of_map.0[c] + of_lights.0[c]);
                let pdf = share * f64::from(of_map.1) + (1.0 - share) * f64::from(of_lights.1);
                (sum, pdf as f32)
            }
        }
    }

    /// Draws a direction by radiance; `None` if there is no light.
    pub fn sample(&self, random: &mut SplitMix64) -> Option<Emitted> {
        self.at(std::array::from_fn(|_| random.uniform(0.0, 1.0)))
    }

    /// [`Environment::sample`] in stratum `ix` of the lights or pixels, each of which is `share` of
    /// the whole.
    pub(crate) fn sample_stratum(
        &self,
        ix: u32,
        share: f64,
        random: &mut SplitMix64,
    ) -> Option<Emitted> {
        let mut u: [f64; 3] = std::array::from_fn(|_| random.uniform(0.0, 1.0));
        u[0] = (f64::from(ix) + u[0]) * share;
        self.at(u)
    }

    /// [`Environment::sample`] by inverse transform of the numbers `u` in 0..1: the light or
    /// pixel, then two for the place in it.
    pub fn at(&self, u: [f64; 3]) -> Option<Emitted> {
        let direction = match self {
            Environment::Lights(lights) => lights.direction_at(u)?,
            Environment::Map(map) => map.direction_at(u)?,
            Environment::MapAndLights(map, lights) => {
                let share = map_share(map, lights);
                match u[0] < share {
                    true => map.direction_at([u[0] / share, u[1], u[2]])?,
                    false => lights.direction_at([(u[0] - share) / (1.0 - share), u[1], u[2]])?,
                }
            }
        };
        let (radiance, pdf) = self.radiance(direction);
        Some(Emitted {
            direction,
            radiance,
            pdf,
        })
    }
}

/// Share of the map in the power of both; 1 where there is none at all.
fn map_share(map: &MapSampler, lights: &LightSampler) -> f64 {
    let (of_map, of_lights) = (map.total(), lights.powers.total());
    match of_lights > 0.0 {
        true => of_map / (of_map + of_lights),
        false => 1.0,
    }
}

/// Lights, drawn by power, and directions from their von Mises-Fisher lobes.
pub struct LightSampler {
    lights: Vec<SrbfLight>,
    powers: Cumulative,
    /// All lights, with dark ones in the lanes that are left.
    eights: Vec<EightLights>,
    /// Instructions of this machine.
    level: Level,
}

/// Lights, one in each lane.
#[derive(Clone, Copy)]
struct EightLights {
    direction: [[f32; LANES]; 3],
    /// -1 / lambda^2
    falloff: [f32; LANES],
    rgb: [[f32; LANES]; 3],
}

impl EightLights {
    /// Up to eight lights.
    fn new(lights: &[SrbfLight]) -> EightLights {
        let mut eight = EightLights {
            direction: [[0.0; LANES]; 3],
            falloff: [0.0; LANES],
            rgb: [[0.0; LANES]; 3],
        };
        for (lane, light) in lights.iter().enumerate() {
            eight.falloff[lane] = -1.0 / (light.lambda * light.lambda);
            for axis in 0..3 {
                eight.direction[axis][lane] = light.direction[axis];
                eight.rgb[axis][lane] = light.rgb[axis];
            }
        }
        eight
    }

    /// Adds the radiance from `omega` to `sum`, lane by lane.
    #[inline(always)]
    fn add_radiance<S: Simd>(&self, simd: S, omega: Vec3, sum: &mut [f32x8<S>; 3]) {
        let mut square = f32x8::splat(simd, 0.0);
        for axis in 0..3 {
            // Without the cancellation of omega . omega_j - 1.
            let off = f32x8::simd_from(simd, self.direction[axis]) - omega[axis];
            square = off * off + square;
        }
        let value = exp(square * f32x8::simd_from(simd, self.falloff));
        for (sum, rgb) in sum.iter_mut().zip(self.rgb) {
            *sum = value * f32x8::simd_from(simd, rgb) + *sum;
        }
    }
}

impl LightSampler {
    /// The light set `lights`.
    pub fn new(lights: &[SrbfLight]) -> Self {
        let mean_power = |light: &SrbfLight| power(light).iter().sum::<f64>() / 3.0;
        LightSampler {
            powers: Cumulative::new(lights.iter().map(mean_power)),
            lights: lights.to_vec(),
            eights: lights.chunks(LANES).map(EightLights::new).collect(),
            level: Level::new(),
        }
    }

    fn radiance(&self, omega: Vec3) -> ([f32; 3], f32) {
        let sum = dispatch!(self.level, simd => {
            let mut sum = [f32x8::splat(simd, 0.0); 3];
            for eight in &self.eights {
                eight.add_radiance(simd, omega, &mut sum);
            }
            let mut rgb = [0.0f32; 3];
            for (rgb, sum) in rgb.iter_mut().zip(sum) {
                *rgb = sum.reduce_sum();
            }
            rgb
        });
        // sum_j p_j G_j / Omega_j with p_j by power: the mean radiance over all power.
        let total = self.powers.total();
        let pdf = if total > 0.0 { mean(sum) / total } else { 0.0 };
        (sum, pdf as f32)
    }

    fn direction_at(&self, u: [f64; 3]) -> Option<Vec3> {
        let total = self.powers.total();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let light = &self.lights[self.powers.pick(u[0])];
        let kappa = 2.0 / f64::from(light.lambda).powi(2);
        // 1 - cos of the angle to the axis: -ln(1 - u (1 - e^(-2 kappa))) / kappa.
        let down = (-(u[1] * (-2.0 * kappa).exp_m1()).ln_1p() / kappa).clamp(0.0, 2.0);
        let sin = (down * (2.0 - down)).sqrt() as f32;
        let (turn_sin, turn_cos) = (2.0 * PI * u[2]).sin_cos();
        let axis = Vec3::from(light.direction);
        let (a, b) = axis.any_orthonormal_pair();
        let direction =
            axis * (1.0 - down) as f32 + (a * turn_cos as f32 + b * turn_sin as f32) * sin;
        Some(direction.normalize())
    }
}

#[cfg(all(test, feature = "files"))]
mod tests {
    use super::*;

    use strandlight_formats::AddedLight;
    use strandlight_images::Map;

    use crate::rays::levels;

    fn lights() -> Environment {
        let light = |direction: [f32; 3], lambda, rgb| SrbfLight {
            direction: Vec3::from(direction).normalize().to_array(),
            lambda,
            rgb,
        };
        Environment::Lights(LightSampler::new(&[
            light([0.0, 1.0, 0.2], 0.005, [9e4, 8e4, 6e4]),
            light([1.0, 0.1, -0.3], 0.4, [2.0, 1.0, 0.5]),
            light([0.0, 1.0, 0.0], 2.0, [0.3, 0.4, 0.7]),
        ]))
    }

    fn map() -> (Map, Environment) {
        let (width, height) = (64, 32);
        let mut random = SplitMix64(3);
        let pixels = (0..width * height)
            .map(|ix| {
                let scale = if ix == 500 { 1000.0 } else { 1.0 };
                [0, 1, 2].map(|_| scale * random.uniform(0.0, 1.0) as f32)
            })
            .collect();
        let map = Map::new(width, height, pixels).unwrap();
        let sampler = MapSampler::new(map.grid(), map.pixels(), 0.7, [2.0; 3]);
        (map, Environment::Map(sampler))
    }

    /// Mean over draws of `f(direction) radiance / pdf`, and its standard error.
    fn integral(environment: &Environment, f: impl Fn(Vec3) -> f32) -> [(f64, f64); 3] {
        let mut random = SplitMix64(7);
        let n = 200_000;
        let (mut sum, mut squares) = ([0.0f64; 3], [0.0f64; 3]);
        for _ in 0..n {
            let drawn = environment.sample(&mut random).unwrap();
            assert!((drawn.direction.length() - 1.0).abs() < 1e-5 && drawn.pdf > 0.0);
            for c in 0..3 {
                let x = f64::from(f(drawn.direction) * drawn.radiance[c] / drawn.pdf);
                sum[c] += x;
                squares[c] += x * x;
            }
        }
        std::array::from_fn(|c| {
            let mean = sum[c] / f64::from(n);
            let variance = squares[c] / f64::from(n) - mean * mean;
            (mean, (variance.max(0.0) / f64::from(n)).sqrt())
        })
    }

    #[test]
    fn draws_integrate_the_lights() {
        let environment = lights();
        let Environment::Lights(sampler) = &environment else {
            unreachable!()
        };
        for (c, (mean, error)) in integral(&environment, |_| 1.0).into_iter().enumerate() {
            let expected: f64 = sampler
                .lights
                .iter()
                .map(|light| {
                    let square = f64::from(light.lambda).powi(2);
                    f64::from(light.rgb[c]) * PI * square * (1.0 - (-4.0 / square).exp())
                })
                .sum();
            assert!(
                (mean - expected).abs() < 4.0 * error + 1e-4 * expected,
                "{c}: {mean} {expected} {error}"
            );
        }
        // Evenly drawn directions see the same density, narrow light left out.
        let broad = Environment::Lights(LightSampler::new(&sampler.lights[1..]));
        let mut random = SplitMix64(9);
        let mass: f64 = (0..200_000)
            .map(|_| {
                let z = random.uniform(-1.0, 1.0);
                let (sin, cos) = random.uniform(0.0, 2.0 * PI).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let omega = Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32);
                f64::from(broad.radiance(omega).1) * 4.0 * PI / 2e5
            })
            .sum();
        assert!((mass - 1.0).abs() < 0.02, "{mass}");
    }

    /// Of one light, a full vector, one more, and many.
    #[test]
    fn radiance_is_the_sum_of_the_lights() {
        let mut random = SplitMix64(21);
        for n in [1, 8, 9, 40] {
            let lights: Vec<SrbfLight> = (0..n)
                .map(|ix| {
                    let mut within = || random.uniform(-1.0, 1.0) as f32;
                    SrbfLight {
                        direction: Vec3::new(within(), within(), within())
                            .normalize()
                            .to_array(),
                        lambda: [0.01, 0.2, 0.7, 2.0][ix % 4],
                        rgb: [1.5, 1.0, 0.5].map(|x| x * (1.1 + within())),
                    }
                })
                .collect();
            let mut sampler = LightSampler::new(&lights);
            let directions: Vec<Vec3> = (lights.iter().map(|light| Vec3::from(light.direction)))
                .chain((0..200).map(|_| {
                    let mut within = || random.uniform(-1.0, 1.0) as f32;
                    Vec3::new(within(), within(), within()).normalize()
                }))
                .collect();
            for level in levels() {
                sampler.level = level;
                for &omega in &directions {
                    let (found, _) = sampler.radiance(omega);
                    for c in 0..3 {
                        let expected: f64 = lights
                            .iter()
                            .map(|light| {
                                let off = (omega - Vec3::from(light.direction)).as_dvec3();
                                let lambda = f64::from(light.lambda);
                                let value = (-off.length_squared() / (lambda * lambda)).exp();
                                f64::from(light.rgb[c]) * value
                            })
                            .sum();
                        let error = (f64::from(found[c]) - expected).abs();
                        assert!(
                            error < 1e-5 * expected + 1e-9,
                            "{n}: {omega} {found:?} {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn draws_integrate_the_map() {
        let (map, environment) = map();
        let energy = map.energy();
        for (c, (mean, error)) in integral(&environment, |_| 1.0).into_iter().enumerate() {
            let expected = 2.0 * energy[c];
            // Draws on the edge of a pixel may round into its neighbour.
            assert!(
                (mean - expected).abs() < 4.0 * error + 1e-3 * expected,
                "{c}: {mean} {expected} {error}"
            );
        }
    }

    #[test]
    fn draws_integrate_a_map_and_lights() {
        let (map, _) = map();
        let key = SrbfLight {
            direction: [0.0, 0.6, 0.8],
            lambda: 0.3,
            rgb: [40.0, 20.0, 0.0],
        };
        let mut section = LightsSection::new("a.lights");
        (section.rotate_deg, section.intensity) = (40.0, 2.0);
        section.added = vec![AddedLight::default()];
        // The first is of the set, and fitted to the map.
        let lights = [
            SrbfLight {
                rgb: [1e6; 3],
                ..key
            },
            key,
        ];
        let both = Environment::of_map(map.grid(), map.pixels(), &section, &lights);
        let angle = PI * 0.09 * (1.0 - (-4.0f64 / 0.09).exp());
        for (c, (mean, error)) in integral(&both, |_| 1.0).into_iter().enumerate() {
            let expected = 2.0 * map.energy()[c] + f64::from(key.rgb[c]) * angle;
            assert!(
                (mean - expected).abs() < 4.0 * error + 1e-3 * expected,
                "{c}: {mean} {expected} {error}"
            );
        }
    }

    #[test]
    fn the_turn_is_that_of_light_sets() {
        let (map, environment) = map();
        let turned = glam::Quat::from_rotation_y(0.7);
        for ix in [3usize, 500, 1200, 2047] {
            let (i, j) = (ix % 64, ix / 64);
            let [x, y, z] = map.grid().direction(i as f64 + 0.5, j as f64 + 0.5);
            let omega = turned * Vec3::new(x as f32, y as f32, z as f32);
            let expected = map.pixels()[ix].map(|x| 2.0 * x);
            assert_eq!(environment.radiance(omega).0, expected);
        }
    }

    #[test]
    fn darkness_has_no_direction() {
        let dark = Environment::Lights(LightSampler::new(&[]));
        assert_eq!(dark.radiance(Vec3::X), ([0.0; 3], 0.0));
        assert_eq!(dark.sample(&mut SplitMix64(1)), None);
    }
}
