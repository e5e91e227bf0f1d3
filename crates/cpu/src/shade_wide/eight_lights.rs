//! Lights in vectors of eight, and what comes of them.

use strandlight_scattering::wide::{LANES, Simd, f32x8};
use strandlight_scene::scene::LightRecord;

use super::super::arriving::Columns;

/// Up to eight lights as shading reads them; missing lanes repeat the last one, and give nothing.
#[derive(Clone, Copy)]
pub(super) struct EightLights {
    pub n: usize,
    pub columns: Columns,
    /// Towards them: x, y, z.
    pub direction: [[f32; LANES]; 3],
    pub lambda: [f32; LANES],
    pub rgb: [[f32; LANES]; 3],
    pub brightest: [f32; LANES],
    pub solid_angle: [f32; LANES],
    pub power: [f32; LANES],
}

impl EightLights {
    /// Of at most eight lights and their columns.
    #[inline(always)]
    pub fn new(lights: &[(usize, &LightRecord)]) -> EightLights {
        let last = lights.len() - 1;
        let columns: [usize; LANES] = std::array::from_fn(|lane| lights[lane.min(last)].0);
        let mut eight = EightLights {
            n: lights.len(),
            columns: Columns::new(&columns[..lights.len()]),
            direction: [[0.0; LANES]; 3],
            lambda: [0.0; LANES],
            rgb: [[0.0; LANES]; 3],
            brightest: [0.0; LANES],
            solid_angle: [0.0; LANES],
            power: [0.0; LANES],
        };
        for lane in 0..LANES {
            let (_, light) = lights[lane.min(last)];
            for axis in 0..3 {
                eight.direction[axis][lane] = light.direction[axis];
                eight.rgb[axis][lane] = light.rgb[axis];
            }
            eight.lambda[lane] = light.lambda;
            eight.brightest[lane] = light.rgb[0].max(light.rgb[1]).max(light.rgb[2]);
            eight.power[lane] = light.power;
        }
        for (solid_angle, (_, light)) in eight.solid_angle.iter_mut().zip(lights) {
            *solid_angle = light.solid_angle;
        }
        eight
    }
}

/// Multiple scattering of eight lights, for an amplitude of 1 each.
pub(super) struct Multiple<S: Simd> {
    /// Local scattering of light that comes straight, unblocked.
    pub direct: [f32x8<S>; 3],
    /// Global and local scattering of what the hair sends on forward.
    pub forward: [f32x8<S>; 3],
}
