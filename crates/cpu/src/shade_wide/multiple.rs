//! Multiple scattering of eight lights at a point.

use glam::Vec3;
use strandlight_scattering::closed_form::{AxisDensities, TERM_GLOBAL, TERM_LOCAL, axis_densities};
use strandlight_scattering::multiple_tables::{AzimuthsOfLights, SeenLights};
use strandlight_scattering::wide::{
    Directions, LANES, Place, ShadowRecords, Simd, f32x8, forward_light, local_density, prelude::*,
    sample_forward,
};

use super::WideShader;
use super::eight_lights::{EightLights, Multiple};
use super::optics::PointOptics;

impl WideShader<'_> {
    /// What the hair around a point sends back along the axes, for [`local_density`].
    #[inline(always)]
    pub(super) fn around(&self, point: usize, optics: &impl PointOptics) -> AxisDensities {
        let position = Vec3::from_slice(&self.scene.strands.points[point]);
        self.axis_shares.map_or([[0.0; 6]; 3], |shares| {
            axis_densities(optics.layers(), &shares.at(position))
        })
    }

    /// Global, local and direct local scattering of up to eight lights, for an amplitude of 1 each, with the hair
    /// [`WideShader::around`] the point.
    #[inline(always)]
    pub(super) fn multiple<S: Simd>(
        &self,
        simd: S,
        lights: &EightLights,
        records: &[[f32; LANES]; 4],
        (place, optics): (&Place, &impl PointOptics),
        around: &AxisDensities,
    ) -> Multiple<S> {
        let bits = self.terms.bits;
        let [density_forward, density_back] = self.terms.densities;
        // Loops and no closures around vectors, which would be compiled without the instruction set.
        let zero = f32x8::splat(simd, 0.0);
        let [x, y, z] = &lights.direction;
        let x = f32x8::load_array_ref(simd, x);
        let y = f32x8::load_array_ref(simd, y);
        let z = f32x8::load_array_ref(simd, z);
        let lambda = f32x8::load_array_ref(simd, &lights.lambda);
        let solid_angle = f32x8::load_array_ref(simd, &lights.solid_angle);
        let mut rgb = [zero; 3];
        for (channel, numbers) in rgb.iter_mut().zip(&lights.rgb) {
            *channel = f32x8::load_array_ref(simd, numbers);
        }
        let mut numbers = [zero; 4];
        for (number, record) in numbers.iter_mut().zip(records) {
            *number = f32x8::load_array_ref(simd, record);
        }
        let [d_1, d_2, d_3, sine] = numbers;
        let mut along = [zero; 3];
        for (along, axis) in along.iter_mut().zip(&place.frame) {
            *along = x * axis[0] + y * axis[1] + z * axis[2];
        }
        let at = Directions::from_vectors(along);
        let view = &place.view;
        let record = ShadowRecords {
            depths: [d_1, d_2, d_3],
            sin_theta: sine,
        };
        let averages = sample_forward(optics.forward(), sine);
        let mut density = local_density(around, &[x, y, z]);
        for density in &mut density {
            *density *= density_back;
        }
        let behind = (optics.layers(), &density);
        let forward = forward_light(&record, &averages, &rgb, lambda, behind);
        let seen = SeenLights {
            theta: at.theta,
            n: lights.n,
            cos_theta: at.cos_theta,
            azimuths: AzimuthsOfLights::between([at.cos_phi, at.sin_phi], view),
            theta_o: view.theta,
        };
        let (global, local) = optics.at_lights(&seen, forward.sigma_f);
        let has_local = bits & TERM_LOCAL != 0;
        let mut direct = [zero; 3];
        if has_local {
            direct = optics.direct_at_lights(&seen, lambda);
        }
        let mut found = Multiple {
            direct,
            forward: [zero; 3],
        };
        for channel in 0..3 {
            let mut scattered = zero;
            let gained = forward.gained[channel] * density_forward;
            if bits & TERM_GLOBAL != 0 {
                scattered += forward.global[channel] * density_forward * global[channel];
            }
            if has_local {
                scattered += gained * local[channel] * density[channel];
            }
            found.direct[channel] = solid_angle * (direct[channel] * density[channel]);
            found.forward[channel] = solid_angle * scattered;
        }
        found
    }
}
