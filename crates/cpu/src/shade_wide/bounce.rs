//! Scattering of what proxies send back.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE};
use strandlight_scattering::wide::{
    LANES, Level, Responses, Simd, WideLights, depths_of_shares, dispatch, f32x8, prelude::*,
    single_scattering,
};
use strandlight_scene::bounce::N_LOBES;

use super::super::bounce::BounceLight;
use super::eight_lights::EightLights;
use super::optics::{LastPainted, PointOptics};
use super::{CHUNK, Multiple, WideShader, with_optics};

/// Which fibres scatter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Fibres {
    /// The scene's everywhere, so that it can be interpolated between points that have it.
    OfScene,
    /// Those of the points.
    OfPoints,
}

/// What a thread shades bounce light in.
#[derive(Default)]
struct Scratch {
    responses: Responses,
    lights: WideLights,
    last_painted: LastPainted,
}

impl WideShader<'_> {
    /// Bounce light at some visible points, scattered by these fibres: rgb times the view's radiance scale, and zero.
    pub fn shade_bounce(
        &self,
        bounce: &BounceLight,
        (places, visible): (&[u32], &[u32]),
        fibres: Fibres,
    ) -> Vec<[f32; 4]> {
        let of_chunk = |places: &[u32]| {
            let mut scratch = Scratch::default();
            let mut radiance = Vec::with_capacity(places.len());
            dispatch!(Level::new(), simd => {
                for &place in places {
                    let point = visible[place as usize] as usize;
                    let mut last = std::mem::take(&mut scratch.last_painted);
                    let rgb = match (fibres, &self.plain) {
                        (Fibres::OfScene, Some(optics)) => {
                            Some(self.bounce_at(simd, bounce, (point, optics), &mut scratch))
                        }
                        _ => with_optics!(self, point, &mut last, optics => {
                            self.bounce_at(simd, bounce, (point, optics), &mut scratch)
                        }),
                    };
                    scratch.last_painted = last;
                    let rgb = rgb.unwrap_or_default();
                    let [r, g, b] = rgb.map(|value| value * self.view.radiance_scale);
                    radiance.push([r, g, b, 0.0]);
                }
            });
            radiance
        };
        places.par_chunks(CHUNK).flat_map_iter(of_chunk).collect()
    }

    #[inline(always)]
    fn bounce_at<S: Simd>(
        &self,
        simd: S,
        bounce: &BounceLight,
        (point, optics): (usize, &impl PointOptics),
        Scratch {
            responses, lights, ..
        }: &mut Scratch,
    ) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let terms = &self.terms;
        let position = Vec3::from_slice(&self.scene.strands.points[point]);
        let found = bounce.lights_at(position, self.view.radiance_scale);
        if found.iter().all(|(light, _)| light.power < terms.min_power) {
            return sum;
        }
        let place = self.place(point);
        if terms.bits & TERM_SINGLE != 0 {
            let mut weights = [0.0; N_LOBES];
            for ((light, record), weight) in found.iter().zip(&mut weights) {
                let unblocked = record.shares[0];
                if unblocked * light.power >= terms.min_power {
                    *weight = unblocked * light.rgb[0].max(light.rgb[1]).max(light.rgb[2]);
                }
            }
            lights.take_pair(
                found.map(|(light, _)| light.direction),
                found.map(|(light, _)| light.lambda),
            );
            let shading = optics.shading();
            single_scattering(simd, lights, &weights, &place, shading, None, responses);
            for entry in responses.entries() {
                let (light, record) = &found[entry.light as usize];
                for (channel, sum) in sum.iter_mut().enumerate() {
                    *sum += record.shares[0] * light.rgb[channel] * entry.rgb[channel];
                }
            }
        }
        if terms.bits & (TERM_LOCAL | TERM_GLOBAL) != 0 {
            let columns = [0, 1].map(|lobe: usize| (lobe, &found[lobe].0));
            let eight = EightLights::new(&columns);
            let of_lobe = |lane: usize| &found[lane.min(N_LOBES - 1)].1;
            let shares = [0, 1, 2].map(|ix: usize| {
                let shares: [f32; LANES] = std::array::from_fn(|lane| of_lobe(lane).shares[ix]);
                f32x8::load_array_ref(simd, &shares)
            });
            let [a, b, c] = depths_of_shares(shares);
            let sines: [f32; LANES] = std::array::from_fn(|lane| of_lobe(lane).sin_theta);
            let records = [a.into(), b.into(), c.into(), sines];
            let around = self.around(point, optics);
            let Multiple { direct, forward } =
                self.multiple(simd, &eight, &records, (&place, optics), &around);
            for (channel, sum) in sum.iter_mut().enumerate() {
                let found: [f32; LANES] = (direct[channel] * shares[0] + forward[channel]).into();
                let lanes = eight.rgb[channel].iter().zip(found);
                for (rgb, found) in lanes.take(N_LOBES) {
                    *sum += rgb * found;
                }
            }
        }
        sum
    }
}
