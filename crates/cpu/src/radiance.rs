//! Radiance of the visible points: at them, and along the segments between them.

use super::along_segments::Along;

/// Radiance of the visible points.
#[derive(Clone)]
pub(super) struct Radiance {
    /// rgb times the view's radiance scale, and zero.
    pub at: Vec<[f32; 4]>,
    /// What single scattering of narrow lights adds to it along the segments; nothing where there are none such.
    pub along: Vec<Along>,
}

impl Radiance {
    /// Black, at `n_places`.
    pub fn black(n_places: usize, has_narrow: bool) -> Radiance {
        Radiance {
            at: vec![[0.0; 4]; n_places],
            along: match has_narrow {
                true => vec![Along::default(); n_places],
                false => Vec::new(),
            },
        }
    }

    /// Of narrow lights, about a place and the next.
    #[inline(always)]
    pub fn along_from(&self, first: usize) -> Option<[&Along; 2]> {
        Some([self.along.get(first)?, self.along.get(first + 1)?])
    }

    /// Makes a place black.
    pub fn clear(&mut self, place: usize) {
        self.at[place] = [0.0; 4];
        if let Some(along) = self.along.get_mut(place) {
            *along = Along::default();
        }
    }

    /// Adds what was found at some places.
    pub fn add(&mut self, places: &[u32], found: &Radiance) {
        for (&place, values) in places.iter().zip(&found.at) {
            let sum = &mut self.at[place as usize];
            for (sum, value) in sum.iter_mut().zip(values) {
                *sum += value;
            }
        }
        for (&place, values) in places.iter().zip(&found.along) {
            let sums = self.along[place as usize].as_flattened_mut();
            for (sum, value) in sums.iter_mut().zip(values.as_flattened()) {
                *sum += value;
            }
        }
    }

    /// Bytes of it.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.at[..]) + size_of_val(&self.along[..])) as u64
    }
}
