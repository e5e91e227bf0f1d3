//! Lights as vectors, and what a point answers to them.

use super::LANES;

/// Spherical Gaussian lights, laid out for eight at a time: narrow ones first, so that the lanes of
/// a vector ask for as many nodes. Lights are called by their index in the list that they were made
/// of.
#[derive(Clone, Debug, Default)]
pub struct WideLights {
    /// Direction in the world and lambda.
    pub(super) lights: Vec<[f32; 4]>,
    /// Index of each in the list.
    pub(super) order: Vec<u32>,
}

impl WideLights {
    /// Of lights in these world `directions`, unit vectors from the fibre, with bandwidths `lambdas`,
    /// 0.001..=10.
    pub fn new(directions: &[[f32; 3]], lambdas: &[f32]) -> WideLights {
        let mut order: Vec<u32> = (0..directions.len().min(lambdas.len()) as u32).collect();
        order.sort_by(|a, b| lambdas[*a as usize].total_cmp(&lambdas[*b as usize]));
        let light = |ix: &u32| {
            let [x, y, z] = directions[*ix as usize];
            [x, y, z, lambdas[*ix as usize]]
        };
        WideLights {
            lights: order.iter().map(light).collect(),
            order,
        }
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }
}

/// What a point sends to the eye of each light by single scattering: integrals of lights of amplitude 1
/// against S cos(theta_i), without shadow. One buffer serves many points.
#[derive(Clone, Debug, Default)]
pub struct Responses {
    /// R; TT and TRT in linear RGB; each by light.
    values: [Vec<f32>; 7],
    /// Places in [`WideLights`] that are asked for.
    pub(super) wanted: Vec<u32>,
}

impl Responses {
    /// R by light.
    pub fn r(&self) -> &[f32] {
        &self.values[0]
    }

    /// TT by light, linear RGB.
    pub fn tt(&self) -> [&[f32]; 3] {
        [1, 2, 3].map(|ix| &self.values[ix][..])
    }

    /// TRT by light, linear RGB.
    pub fn trt(&self) -> [&[f32]; 3] {
        [4, 5, 6].map(|ix| &self.values[ix][..])
    }

    /// Makes all of `n` lights 0.
    pub(super) fn clear(&mut self, n: usize) {
        for values in &mut self.values {
            values.clear();
            values.resize(n, 0.0);
        }
        self.wanted.clear();
    }

    /// Writes the values of the lights `order[places]`.
    #[inline(always)]
    pub(super) fn put(&mut self, order: &[u32], places: &[u32], rows: &[[f32; LANES]; 7]) {
        for (values, row) in self.values.iter_mut().zip(rows) {
            for (place, value) in places.iter().zip(row) {
                values[order[*place as usize] as usize] = *value;
            }
        }
    }
}
