//! Lights as vectors.

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
