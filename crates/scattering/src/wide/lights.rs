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

    /// Takes two lights of any width for those there were, without new memory.
    pub fn take_pair(&mut self, directions: [[f32; 3]; 2], lambdas: [f32; 2]) {
        let order = match lambdas[1] < lambdas[0] {
            true => [1, 0],
            false => [0, 1],
        };
        self.lights.clear();
        self.order.clear();
        for ix in order {
            let [x, y, z] = directions[ix];
            self.lights.push([x, y, z, lambdas[ix]]);
            self.order.push(ix as u32);
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
