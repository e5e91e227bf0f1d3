//! Radiance of the visible points: at them, and along the segments between them.

use rayon::prelude::*;
use strandlight_scattering::wide::LANES;

use super::along_segments::{Along, PLACES};

/// Places that a thread interpolates at a time.
const PLACES_AT_ONCE: usize = 1 << 12;

/// Values that a thread adds up at a time.
const VALUES_AT_ONCE: usize = 1 << 14;

/// Radiance of the visible points.
#[derive(Clone, Debug)]
pub(super) struct Radiance {
    /// rgb times the view's radiance scale, and of single scattering of wide strands how much brighter its mean over
    /// the channels is at the right edge than in the middle; else zero.
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

    /// Runs of `n` places, and what they have along segments; nothing where none has.
    pub fn chunks_mut(
        &mut self,
        n: usize,
    ) -> impl Iterator<Item = (&mut [[f32; 4]], &mut [Along])> {
        let mut along = self.along.chunks_mut(n);
        let at = self.at.chunks_mut(n);
        at.map(move |at| (at, along.next().unwrap_or_default()))
    }

    /// Makes a place black.
    pub fn clear(&mut self, place: usize) {
        self.at[place] = [0.0; 4];
        if let Some(along) = self.along.get_mut(place) {
            *along = Along::default();
        }
    }

    /// At all places, what lies between those that are `done`, which keep what they have; where it is known what was there `before`, that, as
    /// much brighter or darker as the places about it have become: shadows stay where they were. What was not seen then is interpolated.
    pub fn filled(
        &self,
        done: &[u32],
        between: &[Between],
        before: Option<&RadianceBefore>,
    ) -> Radiance {
        match before {
            Some(before) => {
                let [of_at, of_along] = before.least;
                let was = &before.radiance;
                Radiance {
                    at: before.filled(&self.at, (done, between), (&was.at, of_at)),
                    along: before.filled(&self.along, (done, between), (&was.along, of_along)),
                }
            }
            None => Radiance {
                at: filled(&self.at, between, |place| mixed(&self.at, &between[place])),
                along: filled(&self.along, between, |place| {
                    mixed(&self.along, &between[place])
                }),
            },
        }
    }

    /// The same of that at one place.
    #[inline(always)]
    pub fn at_between(
        &self,
        place: usize,
        between: &[Between],
        before: Option<&RadianceBefore>,
    ) -> [f32; 4] {
        let between = &between[place];
        match before {
            Some(before) if before.has(place, between) => {
                let (was, least) = (&before.radiance.at[..], before.least[0]);
                let factors = |about: usize| factors(&self.at[about], &was[about], least);
                changed(
                    mixed(&self.at, between),
                    &was[place],
                    least,
                    between,
                    factors,
                )
            }
            _ => mixed(&self.at, between),
        }
    }

    /// Adds to that at a place.
    pub fn add_at(&mut self, place: u32, found: &[f32; 4]) {
        for (sum, value) in self.at[place as usize].iter_mut().zip(found) {
            *sum += value;
        }
    }

    /// Adds to that at all places, one after the other.
    pub fn add_at_all(&mut self, found: &[[f32; 4]]) {
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

/// The same for any number of threads.
fn sum(values: &[f32]) -> f32 {
    let of_some = |some: &[f32]| {
        let mut sums = [0.0; LANES];
        let (eights, rest) = some.as_chunks::<LANES>();
        for eight in eights {
            for (sum, value) in sums.iter_mut().zip(eight) {
                *sum += value;
            }
        }
        sums.iter().chain(rest).sum()
    };
    let sums: Vec<f32> = values.par_chunks(VALUES_AT_ONCE).map(of_some).collect();
    sums.iter().sum()
}

/// Of the channels.
pub(super) fn mean([r, g, b]: [f32; 3]) -> f32 {
    (r + g + b) * (1.0 / 3.0)
}

/// Factors of the profile of a wide strand on radiance r, g, b whose side, [`Radiance::at`], this is, at places across
/// the strand that have such means of them and of their squares. `even` is that of the fibre.
#[inline(always)]
pub(super) fn profile_factors(
    rgb: [f32; 3],
    side: f32,
    even: &[f32; 4],
    [across, across_2]: [f32; 2],
) -> [f32; 3] {
    let side = (side / mean(rgb).max(f32::MIN_POSITIVE)).clamp(-1.0, 1.0);
    let second = 1.5 * across_2 - 0.5;
    [0, 1, 2].map(|channel: usize| 1.0 + side * across + even[channel] * second)
}

/// Radiance of the same points before an edit that left shadows as they were, or another view.
#[derive(Clone, Debug)]
pub(super) struct RadianceBefore {
    radiance: Radiance,
    /// By place: was it seen then? All were where there is none.
    was_seen: Option<Vec<bool>>,
    /// Radiance of which there is hardly more than noise: at the points, and along segments.
    least: [f32; 2],
}

impl RadianceBefore {
    /// Of a complete picture.
    pub fn new(radiance: Radiance) -> RadianceBefore {
        const LEAST: f32 = 0.02;
        let mean = |values: &[f32]| sum(values) / values.len().max(1) as f32;
        let at = mean(radiance.at.as_flattened());
        let along = mean(radiance.along.as_flattened().as_flattened());
        RadianceBefore {
            radiance,
            was_seen: None,
            least: [at, along].map(|mean| (LEAST * mean).max(f32::MIN_POSITIVE)),
        }
    }

    /// Of a picture that showed the points `seen`, at those that are `visible` now; indices that grow.
    pub fn of_view(seen: &[u32], radiance: &Radiance, visible: &[u32]) -> RadianceBefore {
        let mut found = Radiance::black(visible.len(), !radiance.along.is_empty());
        let mut was_seen = vec![false; visible.len()];
        let mut from = 0;
        for (place, point) in visible.iter().enumerate() {
            from += seen[from..].iter().take_while(|seen| *seen < point).count();
            if seen.get(from) == Some(point) {
                found.at[place] = radiance.at[from];
                if let Some(along) = found.along.get_mut(place) {
                    *along = radiance.along[from];
                }
                was_seen[place] = true;
            }
        }
        RadianceBefore {
            was_seen: Some(was_seen),
            ..RadianceBefore::new(found)
        }
    }

    /// Were all places seen then?
    pub fn is_of_all(&self) -> bool {
        self.was_seen.is_none()
    }

    /// Radiance of the view before at the places, black where it was not seen; and where it was.
    pub fn seen(&self) -> Option<(Radiance, &[bool])> {
        Some((self.radiance.clone(), self.was_seen.as_deref()?))
    }

    /// Were all of these places seen?
    fn has(&self, place: usize, Between { ends, beyond, .. }: &Between) -> bool {
        self.was_seen.as_ref().is_none_or(|was_seen| {
            let mut about = ends.iter().chain(beyond);
            was_seen[place] && about.all(|place| was_seen[*place as usize])
        })
    }

    /// `values` of the places that are `done`, and at the others what [`changed`] from before as these have; radiance up to `least` does not
    /// tell.
    fn filled<T: Numbers>(
        &self,
        values: &[T],
        (done, between): (&[u32], &[Between]),
        (was, least): (&[T], f32),
    ) -> Vec<T> {
        if values.is_empty() {
            return Vec::new();
        }
        // Each of these is beside many places.
        let mut rows = vec![0_u32; values.len()];
        for (row, place) in (0..).zip(done) {
            rows[*place as usize] = row;
        }
        let of_place =
            |place: &u32| factors(&values[*place as usize], &was[*place as usize], least);
        let some = done.par_iter().with_min_len(PLACES_AT_ONCE);
        let found: Vec<T> = some.map(of_place).collect();
        filled(values, between, |place| {
            let between = &between[place];
            let mixed = mixed(values, between);
            match self.has(place, between) {
                true => changed(mixed, &was[place], least, between, |about| {
                    found[rows[about] as usize]
                }),
                false => mixed,
            }
        })
    }

    /// Has it what `radiance` has, so that the one can be compared with the other?
    pub fn is_like(&self, radiance: &Radiance) -> bool {
        let of = |radiance: &Radiance| [radiance.at.len(), radiance.along.len()];
        of(&self.radiance) == of(radiance)
    }
}

/// Where a place lies among others of its strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Between {
    /// The nearest ones before and after it; twice itself if it is one of them.
    pub ends: [u32; 2],
    /// The next ones beyond these; an end itself where there is none.
    pub beyond: [u32; 2],
    /// How far it lies from the one end to the other, 0..1; outside where there is none on the other side.
    pub t: f32,
}

impl Between {
    /// Is it one of the others itself?
    pub fn is_at(&self, place: usize) -> bool {
        self.ends == [place as u32; 2]
    }

    /// Weights of what is before, both ends, and after in a cubic through the ends, whose slopes there are those
    /// between the places on either side; in a line outside.
    fn weights(&self) -> [f32; 4] {
        let Between { ends, beyond, t } = *self;
        let [a, b] = ends.map(|place| place as f32);
        let [before, after] = beyond.map(|place| place as f32);
        let way = b - a;
        if way <= 0.0 {
            return [0.0, 1.0, 0.0, 0.0];
        }
        if !(0.0..=1.0).contains(&t) {
            return [0.0, 1.0 - t, t, 0.0];
        }
        let (rest, rest_of_t) = (1.0 - t, t * (1.0 - t));
        let [from_a, from_b] = [rest_of_t * rest, -rest_of_t * t];
        let [slope_a, slope_b] = [way / (b - before), way / (after - a)];
        let of_b = t * t * (3.0 - 2.0 * t);
        [
            -from_a * slope_a,
            1.0 - of_b - from_b * slope_b,
            of_b + from_a * slope_a,
            from_b * slope_b,
        ]
    }
}

/// Interpolates.
#[inline(always)]
fn mixed<T: Numbers>(values: &[T], Between { ends, t, .. }: &Between) -> T {
    let ([mut a, b], t) = (ends.map(|end| values[end as usize]), t.clamp(0.0, 1.0));
    for (a, b) in a.numbers_mut().iter_mut().zip(b.numbers()) {
        *a += (b - *a) * t;
    }
    a
}

/// `values` of the places that they are known at, and at the others what `at` says.
fn filled<T: Numbers>(values: &[T], between: &[Between], at: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let of_place = |(place, value): (usize, &T)| match between[place].is_at(place) {
        true => *value,
        false => at(place),
    };
    let places = values.par_iter().with_min_len(PLACES_AT_ONCE);
    places.enumerate().map(of_place).collect()
}

/// By how much what is radiance of a place has changed; of radiance up to `least` there is no telling.
#[inline(always)]
fn factors<T: Numbers>(is: &T, was: &T, least: f32) -> T {
    let mut factors = *is;
    let numbers = factors.numbers_mut().iter_mut().take(T::N_RADIANCE);
    for (is, was) in numbers.zip(was.numbers()) {
        *is = (*is + least) / (was + least);
    }
    factors
}

/// Multiplies what a place had before, `was`, by the interpolated [`factors`] of those about it, in place of what is
/// interpolated, `found`.
#[inline(always)]
fn changed<T: Numbers>(
    mut found: T,
    was: &T,
    least: f32,
    between: &Between,
    factors: impl Fn(usize) -> T,
) -> T {
    let weights = between.weights();
    let Between { ends, beyond, .. } = between;
    let about = [beyond[0], ends[0], ends[1], beyond[1]].map(|place| factors(place as usize));
    // What may be negative has no factors.
    let radiance = found.numbers_mut().iter_mut().take(T::N_RADIANCE);
    for (ix, value) in radiance.enumerate() {
        let [_, a, b, _] = [0, 1, 2, 3].map(|k: usize| about[k].numbers()[ix]);
        let factor: f32 = weights
            .iter()
            .zip(&about)
            .map(|(w, about)| w * about.numbers()[ix])
            .sum();
        // A cubic swings beyond its ends.
        let factor = factor.clamp(0.5 * a.min(b), 2.0 * a.max(b));
        *value = ((was.numbers()[ix] + least) * factor - least).max(0.0);
    }
    found
}

/// Numbers of a place.
pub(super) trait Numbers: Copy + Send + Sync {
    /// How many of them, the first ones, are radiance: none is negative.
    const N_RADIANCE: usize;
    fn numbers(&self) -> &[f32];
    fn numbers_mut(&mut self) -> &mut [f32];
}

impl Numbers for [f32; 4] {
    const N_RADIANCE: usize = 3;

    fn numbers(&self) -> &[f32] {
        self
    }
    fn numbers_mut(&mut self) -> &mut [f32] {
        self
    }
}

impl Numbers for Along {
    const N_RADIANCE: usize = 3 * PLACES;

    fn numbers(&self) -> &[f32] {
        self.as_flattened()
    }
    fn numbers_mut(&mut self) -> &mut [f32] {
        self.as_flattened_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places 1, 4, 6 and 9 on a strand.
    fn at(place: usize) -> Between {
        let (ends, beyond) = ([4, 6], [1, 9]);
        let t = (place as f32 - 4.0) / 2.0;
        Between { ends, beyond, t }
    }

    #[test]
    fn weights_are_exact_on_lines_and_go_through_the_ends() {
        for place in [4, 5, 6, 7] {
            let weights = at(place).weights();
            let values = [1.0, 4.0, 6.0, 9.0];
            let found: f32 = weights.iter().zip(values).map(|(w, x)| w * x).sum();
            assert!((found - place as f32).abs() < 1e-5, "{place}: {found}");
        }
        assert_eq!(at(4).weights(), [0.0, 1.0, 0.0, 0.0]);
        let alone = Between {
            ends: [3, 3],
            beyond: [3, 3],
            t: 2.0,
        };
        assert_eq!(alone.weights(), [0.0, 1.0, 0.0, 0.0]);
    }

    /// Radiance with a shadow at place 5 that doubles towards one end, cubically.
    #[test]
    fn shadows_stay_where_they_were() {
        let shadow = |place: usize| if place == 5 { 0.25 } else { 1.0 };
        let factor = |place: usize| 1.0 + (place as f32 / 9.0).powi(2);
        let mut before = Radiance::black(10, false);
        let mut now = before.clone();
        for place in 0..10 {
            before.at[place] = [100.0 * shadow(place); 4];
            if [1, 4, 6, 9].contains(&place) {
                now.at[place] = [before.at[place][0] * factor(place); 4];
            }
        }
        let done = [1, 4, 6, 9];
        let itself = |place: u32| Between {
            ends: [place; 2],
            beyond: [place; 2],
            t: 0.0,
        };
        let between: Vec<Between> = (0..10)
            .map(|place| match done.contains(&place) {
                true => itself(place),
                false => at(place as usize),
            })
            .collect();
        let now = now.filled(&done, &between, Some(&RadianceBefore::new(before)));
        let expected = 25.0 * factor(5);
        assert!(
            (now.at[5][0] / expected - 1.0).abs() < 0.01,
            "{} {expected}",
            now.at[5][0]
        );
    }
    #[test]
    fn another_view_has_what_was_seen_before() {
        let mut radiance = Radiance::black(4, false);
        for (place, at) in radiance.at.iter_mut().enumerate() {
            *at = [place as f32; 4];
        }
        let before = RadianceBefore::of_view(&[2, 3, 5, 9], &radiance, &[0, 3, 4, 5, 6, 9]);
        let found: Vec<f32> = before.radiance.at.iter().map(|at| at[0]).collect();
        assert_eq!(found, [0.0, 1.0, 0.0, 2.0, 0.0, 3.0]);
        let seen = [false, true, false, true, false, true];
        assert_eq!(before.was_seen.as_deref(), Some(&seen[..]));
        let between = |ends| Between {
            ends,
            beyond: ends,
            t: 0.5,
        };
        assert!(before.has(3, &between([1, 5])) && !before.has(2, &between([1, 3])));
        assert!(!before.has(3, &between([1, 4])));
    }
}
