//! Radiance of the visible points: at them, and along the segments between them.

use super::along_segments::Along;

/// Radiance of the visible points.
#[derive(Clone, Debug)]
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

    /// Gives a place what lies at share `t` of the way between two others.
    pub fn mix(&mut self, place: usize, ends: [usize; 2], t: f32) {
        mix(&mut self.at, place, ends, t);
        if !self.along.is_empty() {
            mix(&mut self.along, place, ends, t);
        }
    }

    /// The same, and as much brighter or darker than the ends as `before` was: shadows stay where they were.
    pub fn mix_as(&mut self, place: usize, ends: [usize; 2], t: f32, before: &RadianceBefore) {
        self.mix(place, ends, t);
        contrast(
            &mut self.at,
            &before.radiance.at,
            (place, ends, t),
            before.least[0],
        );
        if !self.along.is_empty() {
            contrast(
                &mut self.along,
                &before.radiance.along,
                (place, ends, t),
                before.least[1],
            );
        }
    }

    /// Adds to that at the places, one after the other.
    pub fn add_at(&mut self, found: &[[f32; 4]]) {
        for (sum, value) in self
            .at
            .as_flattened_mut()
            .iter_mut()
            .zip(found.as_flattened())
        {
            *sum += value;
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

/// Radiance of the same points before an edit that left shadows as they were.
#[derive(Clone, Debug)]
pub(super) struct RadianceBefore {
    radiance: Radiance,
    /// Radiance of which there is hardly more than noise: at the points, and along segments.
    least: [f32; 2],
}

impl RadianceBefore {
    /// Of a complete picture.
    pub fn new(radiance: Radiance) -> RadianceBefore {
        const LEAST: f32 = 0.02;
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len().max(1) as f32;
        let at = mean(radiance.at.as_flattened());
        let along = mean(radiance.along.as_flattened().as_flattened());
        RadianceBefore {
            radiance,
            least: [at, along].map(|mean| (LEAST * mean).max(f32::MIN_POSITIVE)),
        }
    }

    /// Has it what `radiance` has, so that the one can be compared with the other?
    pub fn is_like(&self, radiance: &Radiance) -> bool {
        let of = |radiance: &Radiance| [radiance.at.len(), radiance.along.len()];
        of(&self.radiance) == of(radiance)
    }
}

/// What lies at share `t` of the way from `a` to `b`.
#[inline(always)]
fn between(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Interpolates a place.
#[inline(always)]
fn mix<T: Numbers>(values: &mut [T], place: usize, [a, b]: [usize; 2], t: f32) {
    let (a, b) = (values[a], values[b]);
    let ends = a.numbers().iter().zip(b.numbers());
    for (value, (a, b)) in values[place].numbers_mut().iter_mut().zip(ends) {
        *value = between(*a, *b, t);
    }
}

/// Multiplies an interpolated place by what it was over what was interpolated there.
#[inline(always)]
fn contrast<T: Numbers>(
    values: &mut [T],
    before: &[T],
    (place, [a, b], t): (usize, [usize; 2], f32),
    least: f32,
) {
    const MOST: f32 = 8.0;
    let (was, a, b) = (before[place], before[a], before[b]);
    let ends = a.numbers().iter().zip(b.numbers());
    let was = was.numbers().iter().zip(ends);
    for (value, (was, (a, b))) in values[place].numbers_mut().iter_mut().zip(was) {
        *value *= ((was + least) / (between(*a, *b, t) + least)).min(MOST);
    }
}

/// Numbers of a place.
trait Numbers: Copy {
    fn numbers(&self) -> &[f32];
    fn numbers_mut(&mut self) -> &mut [f32];
}

impl Numbers for [f32; 4] {
    fn numbers(&self) -> &[f32] {
        self
    }
    fn numbers_mut(&mut self) -> &mut [f32] {
        self
    }
}

impl Numbers for Along {
    fn numbers(&self) -> &[f32] {
        self.as_flattened()
    }
    fn numbers_mut(&mut self) -> &mut [f32] {
        self.as_flattened_mut()
    }
}
