//! Lights as vectors, and what a point answers to them.

use super::single_scattering::Seen;

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

/// What a point sends to the eye of lights by single scattering: integrals of a light of amplitude 1
/// against S cos(theta_i), without shadow. One buffer serves many points.
#[derive(Clone, Debug, Default)]
pub struct Responses {
    /// One for each light and mode that is not 0.
    pub(super) entries: Vec<Response>,
    pub(super) seen: Seen,
}

/// Of one light, by one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Index of the light in the list.
    pub light: u32,
    /// 0, 1, 2: R, TT, TRT.
    pub mode: u32,
    /// Linear RGB.
    pub rgb: [f32; 3],
}

impl Responses {
    /// All of the last point.
    pub fn entries(&self) -> &[Response] {
        &self.entries
    }
}
