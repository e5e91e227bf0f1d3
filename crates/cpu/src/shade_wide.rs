//! Scattering of all lights at visible points, eight lights at a time: what [`super::shade`] computes
//! one after the other, the same to rounding, and for multiple scattering, which comes from
//! tables of the fibre in place of the closed form.
//! Painted points, each with a fibre of its own, keep to the other way.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    DirectionInFrame, ForwardTable, Shading, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE, forward_table,
};
use strandlight_scattering::multiple_tables::MultipleTables;
use strandlight_scattering::wide::{
    Directions, LANES, Level, Peaks, Place, Responses, Roulette, ShadowRecords, Simd, WideLights,
    dispatch, f32x8, forward_light, prelude::*, sample_forward, single_scattering,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, THROUGH_SLOT};

use super::arriving::{Arriving, AtPoint};
use super::shade::{Counts, Terms};
use super::transmittance::mix;
use super::unblocked::{Unblocked, VisiblePoint};

/// Visible points that a thread shades at a time.
const CHUNK: usize = 64;

/// Shades unpainted points.
pub(super) struct WideShader<'a> {
    scene: &'a PreparedScene,
    view: &'a ViewUniform,
    /// Of the fibre.
    tables: &'a MultipleTables,
    arriving: &'a Arriving,
    through: Option<&'a Unblocked>,
    shading: Shading<'a>,
    forward: ForwardTable,
    terms: Terms,
    /// Of drafts, which leave to chance what hardly counts.
    peaks: Option<Peaks>,
    /// The lights that are not black.
    lights: Vec<Light>,
    /// The same for single scattering.
    wide: WideLights,
}

/// A light as shading reads it.
#[derive(Clone, Copy)]
struct Light {
    /// Its column in [`Arriving`].
    column: usize,
    direction: [f32; 3],
    lambda: f32,
    rgb: [f32; 3],
    solid_angle: f32,
    power: f32,
    has_map: bool,
    forward_weight: f32,
}

/// What a thread shades points in.
#[derive(Default)]
struct Scratch {
    responses: Responses,
    /// By light.
    unblocked: Vec<f32>,
    unblocked_tt: Vec<f32>,
    weights: Vec<f32>,
}

impl<'a> WideShader<'a> {
    /// For the `lights` that arrive, as `view` sees `scene`; with shares of the light through to the eye.
    /// By `peaks`, of drafts, what hardly counts is left to chance.
    pub fn new(
        scene: &'a PreparedScene,
        view: &'a ViewUniform,
        tables: &'a MultipleTables,
        (arriving, lights): (&'a Arriving, &[LightRecord]),
        through: Option<&'a Unblocked>,
        peaks: Option<Peaks>,
    ) -> WideShader<'a> {
        let light = |(column, &ix): (usize, &u32)| {
            let light = &lights[ix as usize];
            Light {
                column,
                direction: light.direction,
                lambda: light.lambda,
                rgb: light.rgb,
                solid_angle: light.solid_angle,
                power: light.power,
                has_map: light.shadow_index != NO_SLOT,
                forward_weight: light.forward_weight,
            }
        };
        let columns = arriving.lights.iter().enumerate();
        let lights = columns.map(light).filter(|light| light.power > 0.0);
        let lights: Vec<Light> = lights.collect();
        let directions: Vec<[f32; 3]> = lights.iter().map(|light| light.direction).collect();
        let lambdas: Vec<f32> = lights.iter().map(|light| light.lambda).collect();
        let shading = scene.hair.optics().shading(scene.tables.view());
        WideShader {
            scene,
            view,
            tables,
            arriving,
            through,
            forward: forward_table(scene.hair.averages()),
            terms: Terms::new(scene),
            peaks,
            shading,
            wide: WideLights::new(&directions, &lambdas),
            lights,
        }
    }

    /// Radiance of some visible points, rgb times the view's radiance scale and zero.
    pub fn shade(&self, places: &[u32], visible: &[u32]) -> (Vec<[f32; 4]>, Counts) {
        let mut radiance = vec![[0.0; 4]; places.len()];
        let level = Level::new();
        let counts = radiance
            .par_chunks_mut(CHUNK)
            .zip(places.par_chunks(CHUNK))
            .map_init(Scratch::default, |scratch, (radiance, places)| {
                let mut counts = Counts::default();
                dispatch!(level, simd => {
                    for (radiance, &place) in radiance.iter_mut().zip(places) {
                        let at = VisiblePoint {
                            place: place as usize,
                            point: visible[place as usize] as usize,
                        };
                        let sum = self.point(simd, at, scratch, &mut counts);
                        for (value, sum) in radiance.iter_mut().zip(sum) {
                            *value = sum * self.view.radiance_scale;
                        }
                    }
                });
                counts
            })
            .reduce(Counts::default, Counts::and);
        (radiance, counts)
    }

    /// What the eye sees at a point.
    #[inline(always)]
    fn point<S: Simd>(
        &self,
        simd: S,
        at: VisiblePoint,
        scratch: &mut Scratch,
        counts: &mut Counts,
    ) -> [f32; 3] {
        let strands = &self.scene.strands;
        let u = Vec3::from_slice(&strands.tangents[at.point]);
        let v = Vec3::from_slice(&strands.normals[at.point]);
        let w = u.cross(v);
        let towards = Vec3::from(self.view.eye) - Vec3::from_slice(&strands.points[at.point]);
        let place = Place {
            frame: [u, v, w].map(|axis: Vec3| axis.to_array()),
            view: DirectionInFrame::from_vector([u, v, w].map(|axis| axis.dot(towards))),
        };
        let arriving = self.arriving.at(at.place);
        let through = self.through.map(|through| through.share(THROUGH_SLOT, at));
        let Scratch {
            responses,
            unblocked,
            unblocked_tt,
            weights,
        } = scratch;
        unblocked.clear();
        unblocked_tt.clear();
        for light in &self.lights {
            let share = arriving.unblocked(light.column);
            let share_tt = match through {
                Some(through) if light.has_map => mix(share, through, light.forward_weight),
                _ => share,
            };
            unblocked.push(share);
            unblocked_tt.push(share_tt);
        }
        let terms = &self.terms;
        let mut sum = [0.0; 3];
        if terms.bits & TERM_SINGLE != 0 {
            weights.clear();
            let mut n = 0;
            for (ix, light) in self.lights.iter().enumerate() {
                let share = unblocked[ix].max(unblocked_tt[ix]);
                let is_wanted = share * light.power >= terms.min_power;
                n += u64::from(is_wanted);
                let brightest = light.rgb[0].max(light.rgb[1]).max(light.rgb[2]);
                weights.push(if is_wanted { share * brightest } else { 0.0 });
            }
            let roulette = self.peaks.map(|peaks| Roulette {
                tolerance: TOLERANCE,
                peaks,
                seed: at.point as u32,
            });
            let shading = &self.shading;
            single_scattering(
                simd, &self.wide, weights, &place, shading, roulette, responses,
            );
            for entry in responses.entries() {
                let ix = entry.light as usize;
                // TT alone comes through.
                let share = if entry.mode == 1 {
                    unblocked_tt[ix]
                } else {
                    unblocked[ix]
                };
                let light = &self.lights[ix];
                for (channel, sum) in sum.iter_mut().enumerate() {
                    *sum += light.rgb[channel] * share * entry.rgb[channel];
                }
            }
            counts.terms[0][0] += n;
            counts.terms[0][1] += self.lights.len() as u64 - n;
        }
        if terms.bits & (TERM_LOCAL | TERM_GLOBAL) != 0 {
            let mut sums = [f32x8::splat(simd, 0.0); 3];
            for (lights, unblocked) in self.lights.chunks(LANES).zip(unblocked.chunks(LANES)) {
                self.add_multiple(simd, lights, unblocked, &arriving, &place, &mut sums);
                for (term, bit) in [(1, TERM_LOCAL), (2, TERM_GLOBAL), (3, TERM_LOCAL)] {
                    if terms.bits & bit != 0 {
                        counts.terms[term][0] += lights.len() as u64;
                    }
                }
            }
            for (sum, sums) in sum.iter_mut().zip(sums) {
                let lanes: [f32; LANES] = sums.into();
                *sum += lanes.iter().sum::<f32>();
            }
        }
        sum
    }

    /// Adds global, local and direct local scattering of up to eight lights.
    #[inline(always)]
    fn add_multiple<S: Simd>(
        &self,
        simd: S,
        lights: &[Light],
        unblocked: &[f32],
        arriving: &AtPoint,
        place: &Place,
        sums: &mut [f32x8<S>; 3],
    ) {
        let bits = self.terms.bits;
        let [density_forward, density_back] = self.terms.densities;
        // Missing lanes repeat the last light, and give nothing.
        let mut columns = [[0.0; LANES]; 13];
        for lane in 0..LANES {
            let ix = lane.min(lights.len() - 1);
            let light = &lights[ix];
            let [x, y, z] = light.direction;
            let [r, g, b] = light.rgb;
            let solid_angle = if lane == ix { light.solid_angle } else { 0.0 };
            let [d_1, d_2, d_3, sine] = arriving.record(light.column);
            let numbers = [
                x,
                y,
                z,
                light.lambda,
                r,
                g,
                b,
                solid_angle,
                unblocked[ix],
                d_1,
                d_2,
                d_3,
                sine,
            ];
            for (column, number) in columns.iter_mut().zip(numbers) {
                column[lane] = number;
            }
        }
        // Loops and no closures around vectors, which would be compiled without the instruction set.
        let zero = f32x8::splat(simd, 0.0);
        let mut numbers = [zero; 13];
        for (number, column) in numbers.iter_mut().zip(&columns) {
            *number = f32x8::load_array_ref(simd, column);
        }
        let [
            x,
            y,
            z,
            lambda,
            r,
            g,
            b,
            solid_angle,
            unblocked,
            d_1,
            d_2,
            d_3,
            sine,
        ] = numbers;
        let mut along = [zero; 3];
        for (along, axis) in along.iter_mut().zip(&place.frame) {
            *along = x * axis[0] + y * axis[1] + z * axis[2];
        }
        let at = Directions::from_vectors(along);
        let view = &place.view;
        let cos_delta = at.cos_phi * view.cos_phi + at.sin_phi * view.sin_phi;
        let cos_delta = cos_delta.min(1.0).max(-1.0);
        let rgb = [r, g, b];
        let record = ShadowRecords {
            depths: [d_1, d_2, d_3],
            sin_theta: sine,
        };
        let averages = sample_forward(&self.forward, sine);
        let forward = forward_light(&record, unblocked, &averages, &rgb, lambda);
        let (global, local) =
            self.tables
                .at_lights(at.theta, view.theta, cos_delta, forward.sigma_f);
        let has_local = bits & TERM_LOCAL != 0;
        let mut direct = [zero; 3];
        if has_local {
            direct =
                self.tables
                    .direct_at_lights(at.theta, at.cos_theta, view.theta, cos_delta, lambda);
        }
        for channel in 0..3 {
            let mut scattered = direct[channel] * unblocked * density_back;
            let gained = forward.gained[channel] * density_forward;
            if bits & TERM_GLOBAL != 0 {
                scattered += gained * global[channel];
            }
            if has_local {
                scattered += gained * local[channel] * density_back;
            }
            sums[channel] += rgb[channel] * solid_angle * scattered;
        }
    }
}

/// Modes of lights that are expected to be less than this share of a point's single scattering are left
/// to chance.
const TOLERANCE: f32 = 2e-3;
