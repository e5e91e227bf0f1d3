//! The points that a picture shows.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use strandlight_scene::strands::Strands;

use super::list::{Tile, VisibilityList};
use super::radiance::{Between, Radiance, RadianceBefore};

/// Shares of all weight: that of the points which make up nearly all of the picture, and of those among which the ones are
/// chosen that are shaded before all others.
const SHARES: [f64; 2] = [0.99, 0.9];

/// Of neighbours along a strand that have such weight, one in so many is chosen.
const STRIDE: usize = 3;

/// Products of a point of plain round hair and a light that a picture soon after an edit may cost. Where one point in [`STRIDE`] would
/// cost more, fewer of these do for it, down to one in so many of them.
const MOST_PRODUCTS: usize = 700_000;
const MOST_BETWEEN: usize = 3;

/// Share of the points with much weight that the view before must have shown, for its radiance to be carried over.
const CARRIED_SHARE: f32 = 0.75;

/// Both ends of every segment in a visibility list: what has to be lit and shaded.
#[derive(Clone, Debug, Default)]
pub(super) struct VisiblePoints {
    /// Indices of [`Strands::points`], growing.
    pub points: Vec<u32>,
    /// Places in `points`: first one in [`STRIDE`] of those with much weight, then the others that make up nearly
    /// all of the picture, then the rest.
    pub order: Vec<u32>,
    /// How many of `order` are one in so many.
    pub n_thinned: usize,
    /// How many of these do where it is known what the others were before an edit, see [`MOST_PRODUCTS`]; they come first. As many
    /// until [`VisiblePoints::thin_for`].
    pub n_fewest: usize,
    /// They are one in so many.
    one_in: usize,
    /// How many make up nearly all of the picture.
    pub n_first: usize,
    /// Places of one in [`STRIDE`] of those that make up nearly all of the picture, at which bounce light is found: first
    /// one in [`STRIDE`] of them, then the others.
    pub of_bounce: Vec<u32>,
    /// How many of `of_bounce` are one in so many: they do for a first picture.
    pub n_first_of_bounce: usize,
    /// By place: is the next one the other end of a segment?
    is_joined: Vec<bool>,
}

impl VisiblePoints {
    /// Those of `list`, whose entries then have the place of their first point among these; that of
    /// the second is the next.
    pub fn number(list: &mut VisibilityList, strands: &Strands) -> VisiblePoints {
        let n_points = strands.points.len();
        // Halves, however many threads there are: sums are the same.
        let (first, second) = list.tiles.split_at(list.tiles.len() / 2);
        let (mut weights, others) = rayon::join(
            || weights_of(first, n_points),
            || weights_of(second, n_points),
        );
        let mut points = Vec::new();
        let mut places = vec![0_u32; n_points];
        for (point, (weight, other)) in weights.iter_mut().zip(&others).enumerate() {
            if *weight >= 0.0 || *other >= 0.0 {
                *weight = weight.max(0.0) + other.max(0.0);
                places[point] = points.len() as u32;
                points.push(point as u32);
            }
        }
        let is_joined: Vec<AtomicBool> = points.iter().map(|_| AtomicBool::new(false)).collect();
        let number = |tile: &mut Tile| {
            for entry in &mut tile.entries {
                entry.first = places[entry.first as usize];
                is_joined[entry.first as usize].store(true, Ordering::Relaxed);
            }
        };
        let has_weight = || {
            let weights: Vec<f32> = points.iter().map(|ix| weights[*ix as usize]).collect();
            let has = |least| weights.iter().map(|weight| *weight >= least).collect();
            least_weights(weights.clone()).map(has)
        };
        let (has_weight, ()) = rayon::join(has_weight, || {
            list.tiles.par_iter_mut().for_each(number);
        });
        let is_joined = is_joined.into_iter().map(AtomicBool::into_inner).collect();
        VisiblePoints::in_order(points, &has_weight, is_joined)
    }

    /// By place: has it the weights of both [`SHARES`], and is the next one the other end of a segment?
    fn in_order(
        points: Vec<u32>,
        [has_weight, has_much]: &[Vec<bool>; 2],
        is_joined: Vec<bool>,
    ) -> VisiblePoints {
        let of_bounce =
            || first_thinned(&thinned(has_weight, &is_joined, STRIDE), &is_joined, STRIDE);
        let order = || {
            let is_thinned = thinned(has_much, &is_joined, STRIDE);
            let (mut order, others): (Vec<u32>, Vec<u32>) =
                (0..points.len() as u32).partition(|place| is_thinned[*place as usize]);
            let n_thinned = order.len();
            let (much, little): (Vec<u32>, Vec<u32>) =
                (others.into_iter()).partition(|place| has_weight[*place as usize]);
            order.extend(much);
            let n_first = order.len();
            order.extend(little);
            (order, [n_thinned, n_first])
        };
        let ((order, [n_thinned, n_first]), (of_bounce, n_first_of_bounce)) =
            rayon::join(order, of_bounce);
        VisiblePoints {
            points,
            order,
            n_fewest: n_thinned,
            one_in: 1,
            n_thinned,
            n_first,
            of_bounce,
            n_first_of_bounce,
            is_joined,
        }
    }

    /// Finds which points do after an edit where one costs as many products as this.
    pub fn thin_for(&mut self, products_of_point: usize) {
        let products = self.n_thinned.saturating_mul(products_of_point);
        let one_in = products.div_ceil(MOST_PRODUCTS).clamp(1, MOST_BETWEEN);
        if one_in == self.one_in {
            return;
        }
        let mut is_thinned = vec![false; self.points.len()];
        for place in &self.order[..self.n_thinned] {
            is_thinned[*place as usize] = true;
        }
        let (first, n_fewest) = first_thinned(&is_thinned, &self.is_joined, one_in);
        self.order[..self.n_thinned].copy_from_slice(&first);
        (self.n_fewest, self.one_in) = (n_fewest, one_in);
    }

    /// Radiance that is found at the first `n_done` places of the order, interpolated at the others; where it is known what was there `before`,
    /// in its shadows.
    pub fn filled(
        &self,
        radiance: &Radiance,
        n_done: usize,
        before: Option<&RadianceBefore>,
    ) -> Radiance {
        if n_done == 0 || n_done == self.order.len() {
            return radiance.clone();
        }
        let done = &self.order[..n_done];
        radiance.filled(done, &self.between(done), before)
    }

    /// Bounce light at some `places`, interpolated from those at which it is found, `n_done` of them; where it is known what it was
    /// `before`, by how it has changed. Black where none is found.
    pub fn bounce_at(
        &self,
        found: &Radiance,
        n_done: usize,
        (places, before): (&[u32], Option<&RadianceBefore>),
    ) -> Vec<[f32; 4]> {
        if n_done == 0 {
            return vec![[0.0; 4]; places.len()];
        }
        let between = self.between(&self.of_bounce[..n_done]);
        let at = |place: &u32| {
            let place = *place as usize;
            match between[place].is_at(place) {
                true => found.at[place],
                false => found.at_between(place, &between, before),
            }
        };
        places.par_iter().with_min_len(1 << 12).map(at).collect()
    }

    /// Radiance of the view before, and along the strands between points that it showed; [`None`] where these are too few.
    pub fn carried(&self, before: &RadianceBefore) -> Option<Radiance> {
        let (radiance, was_seen) = before.seen()?;
        let first = &self.order[..self.n_first];
        let n_seen = first.iter().filter(|place| was_seen[**place as usize]);
        if (n_seen.count() as f32) < CARRIED_SHARE * first.len() as f32 {
            return None;
        }
        let between = between(was_seen, &self.is_joined);
        Some(radiance.filled(&[], &between, None))
    }

    /// By place: those about it of the places that are `done`.
    pub fn between(&self, done: &[u32]) -> Vec<Between> {
        let mut is_done = vec![false; self.points.len()];
        for &place in done {
            is_done[place as usize] = true;
        }
        between(&is_done, &self.is_joined)
    }
}

/// By place: is it one in `stride` of those with weight? They are the middles of neighbours along a strand, and ends that no
/// middle is beside.
fn thinned(has_weight: &[bool], is_joined: &[bool], stride: usize) -> Vec<bool> {
    let goes_on = |place: usize| {
        is_joined[place] && has_weight[place] && has_weight.get(place + 1) == Some(&true)
    };
    let mut position = 0;
    (0..has_weight.len())
        .map(|place| {
            position = match place > 0 && goes_on(place - 1) {
                true => (position + 1) % stride,
                false => 0,
            };
            let is_end = position < stride / 2 && !goes_on(place);
            has_weight[place] && (position == stride / 2 || is_end)
        })
        .collect()
}

/// Places that are `wanted`: first one in `stride` of those along a strand, then the others; and how many come first.
fn first_thinned(wanted: &[bool], is_joined: &[bool], stride: usize) -> (Vec<u32>, usize) {
    let places: Vec<u32> = (0..)
        .zip(wanted)
        .filter(|(_, is)| **is)
        .map(|(place, _)| place)
        .collect();
    let are_of_a_strand = |pair: &[u32]| {
        let [from, to] = [pair[0], pair[1]].map(|place| place as usize);
        is_joined[from..to].iter().all(|is_joined| *is_joined)
    };
    let mut goes_on: Vec<bool> = places.windows(2).map(are_of_a_strand).collect();
    goes_on.push(false);
    let is_first = thinned(&vec![true; places.len()], &goes_on, stride);
    let (mut first, others): (Vec<_>, Vec<_>) = places
        .into_iter()
        .zip(is_first)
        .partition(|(_, is_first)| *is_first);
    let n_first = first.len();
    first.extend(others);
    (first.into_iter().map(|(place, _)| place).collect(), n_first)
}

/// By place: those about it that are done. Where there are none on its strand, one of another.
fn between(is_done: &[bool], is_joined: &[bool]) -> Vec<Between> {
    // No place.
    const NONE: u32 = u32::MAX;
    let n = is_done.len();
    let mut before = vec![NONE; n];
    let mut after = vec![NONE; n];
    for place in 0..n {
        if is_done[place] {
            before[place] = place as u32;
        } else if place > 0 && is_joined[place - 1] {
            before[place] = before[place - 1];
        }
    }
    for place in (0..n).rev() {
        if is_done[place] {
            after[place] = place as u32;
        } else if is_joined[place] && place + 1 < n {
            after[place] = after[place + 1];
        }
    }
    // The next done one on the same strand, away from `place`; else itself.
    let beyond_before = |place: u32| match place {
        1.. if is_joined[place as usize - 1] && before[place as usize - 1] != NONE => {
            before[place as usize - 1]
        }
        _ => place,
    };
    let beyond_after = |place: u32| match after.get(place as usize + 1) {
        Some(&after) if is_joined[place as usize] && after != NONE => after,
        _ => place,
    };
    let mut last = is_done.iter().position(|is_done| *is_done).unwrap_or(0) as u32;
    (0..n)
        .map(|place| {
            let ends = match (before[place], after[place]) {
                (NONE, NONE) => [last, last],
                // Before the first one, or beyond the last.
                (NONE, b) => [b, beyond_after(b)],
                (a, NONE) => [beyond_before(a), a],
                // Both are the place itself if it is done.
                (a, b) => [a, b],
            };
            let [a, b] = ends;
            last = b;
            Between {
                ends,
                beyond: [beyond_before(a), beyond_after(b)],
                t: (place as f32 - a as f32) / (b - a).max(1) as f32,
            }
        })
        .collect()
}

/// By point: its weight in these tiles, below zero where they do not show it.
fn weights_of(tiles: &[Tile], n_points: usize) -> Vec<f32> {
    let mut weights = vec![-1.0_f32; n_points];
    for entry in tiles.iter().flat_map(|tile| &tile.entries) {
        let (first, t) = (entry.first as usize, entry.t());
        for (point, share) in [(first, 1.0 - t), (first + 1, t)] {
            weights[point] = weights[point].max(0.0) + share * entry.weight;
        }
    }
    weights
}

/// The least weights of those that add up to [`SHARES`] of all.
fn least_weights(mut weights: Vec<f32>) -> [f32; 2] {
    weights.sort_unstable_by(|a, b| b.total_cmp(a));
    let all: f64 = weights.iter().map(|w| f64::from(*w)).sum();
    let mut sum = 0.0;
    let mut least = [0.0; 2];
    for weight in weights.into_iter().rev() {
        // How much those have that are not less.
        let share = (all - sum) / all;
        for (least, wanted) in least.iter_mut().zip(SHARES) {
            if share >= wanted {
                *least = weight;
            }
        }
        sum += f64::from(weight);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_have_nearly_all_of_the_weight() {
        let [nearly_all, much] = least_weights(vec![0.5, 0.001, 0.36, 0.02, 0.1, 0.017, 0.002]);
        assert_eq!([nearly_all, much], [0.017, 0.1]);
        assert_eq!(least_weights(Vec::new()), [0.0; 2]);
    }

    /// Two strands and, on the first, two points of little weight; before these and at its end, points of not much.
    fn visible() -> VisiblePoints {
        let has_weight = [
            true, true, true, true, true, false, false, true, true, true, true,
        ];
        let mut has_much = has_weight;
        (has_much[4], has_much[10]) = (false, false);
        let mut is_joined = [true; 11];
        (is_joined[6], is_joined[10]) = (false, false);
        VisiblePoints::in_order(
            (0..11).collect(),
            &[has_weight.to_vec(), has_much.to_vec()],
            is_joined.to_vec(),
        )
    }

    #[test]
    fn one_neighbour_in_some_is_the_first() {
        let visible = visible();
        assert_eq!(visible.order, [1, 3, 8, 0, 2, 4, 7, 9, 10, 5, 6]);
        assert_eq!((visible.n_thinned, visible.n_first), (3, 9));
        assert_eq!(visible.n_fewest, 3);
        assert_eq!(visible.of_bounce, [4, 10, 1, 8]);
        assert_eq!(visible.n_first_of_bounce, 2);
    }

    #[test]
    fn costly_points_are_shaded_at_fewer_places_first() {
        let mut visible = visible();
        let mut by = |products: usize| {
            visible.thin_for(products);
            assert_eq!((visible.n_thinned, visible.n_first), (3, 9));
            assert_eq!(visible.order[3..], [0, 2, 4, 7, 9, 10, 5, 6]);
            (visible.n_fewest, visible.order[..3].to_vec())
        };
        // Places 1 and 3 are on one strand, 8 is alone on its own.
        let all = MOST_PRODUCTS / 3;
        assert_eq!(by(all), (3, vec![1, 3, 8]));
        assert_eq!(by(all + 1), (2, vec![3, 8, 1]));
        assert_eq!(by(usize::MAX), (2, vec![3, 8, 1]));
        // Cheaper again, as where paint was taken away.
        assert_eq!(by(all), (3, vec![1, 3, 8]));
    }

    #[test]
    fn others_are_interpolated_along_their_strand() {
        let visible = visible();
        let mut radiance = Radiance::black(11, true);
        for place in [0, 1, 2, 3, 8] {
            radiance.at[place] = [place as f32, 0.0, 0.0, 0.0];
            radiance.along[place] = [[place as f32; 3]; _];
        }
        let radiance = visible.filled(&radiance, visible.n_thinned + 2, None);
        let expected = [0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 8.0, 8.0, 8.0, 8.0];
        for (place, expected) in expected.into_iter().enumerate() {
            assert!((radiance.at[place][0] - expected).abs() < 1e-5, "{place}");
            assert!(
                (radiance.along[place][0][2] - expected).abs() < 1e-5,
                "{place}"
            );
        }
    }

    #[test]
    fn bounce_light_is_interpolated_from_where_it_is_found() {
        let visible = visible();
        let mut bounced = Radiance::black(11, false);
        for &place in &visible.of_bounce {
            bounced.at[place as usize] = [place as f32; 4];
        }
        let of_all = [1.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0, 8.0, 8.0, 9.0, 10.0];
        let of_first = [4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 10.0, 10.0, 10.0, 10.0];
        let mut before = Radiance::black(11, false);
        for (at, of_all) in before.at.iter_mut().zip(of_all) {
            *at = [0.5 * of_all; 4];
        }
        let before = RadianceBefore::new(before);
        for (n_done, before, expected, tolerance) in [
            (4, None, of_all, 1e-5),
            (2, None, of_first, 1e-5),
            // Twice of what it was, but for what is taken for noise.
            (2, Some(&before), of_all, 0.04),
        ] {
            let places: Vec<u32> = (0..11).collect();
            let found = visible.bounce_at(&bounced, n_done, (&places, before));
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found[0] - expected).abs() < tolerance,
                    "{found:?} {expected}"
                );
            }
        }
        assert_eq!(visible.bounce_at(&bounced, 0, (&[4], None)), [[0.0; 4]]);
    }

    #[test]
    fn the_view_before_is_carried_over_if_it_showed_most() {
        let visible = visible();
        let of = |seen: &[u32]| {
            let mut radiance = Radiance::black(seen.len(), false);
            for (at, point) in radiance.at.iter_mut().zip(seen) {
                *at = [1.0 + *point as f32; 4];
            }
            visible.carried(&RadianceBefore::of_view(seen, &radiance, &visible.points))
        };
        // All but one of the nine points with much weight: it lies between two others.
        let carried = of(&[0, 1, 3, 4, 7, 8, 9, 10]).expect("enough");
        let found: Vec<f32> = carried.at.iter().map(|at| at[0]).collect();
        assert_eq!(
            found,
            [1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 8.0, 9.0, 10.0, 11.0]
        );
        // The second strand alone.
        assert!(of(&[7, 8, 9, 10]).is_none());
        assert!(of(&[]).is_none());
    }

    #[test]
    fn a_strand_without_first_places_has_what_another_has() {
        let visible = VisiblePoints::in_order(
            (0..4).collect(),
            &[
                vec![false, true, false, false],
                vec![false, true, false, false],
            ],
            vec![false, false, true, false],
        );
        let mut radiance = Radiance::black(4, false);
        radiance.at[1] = [1.0; 4];
        let radiance = visible.filled(&radiance, visible.n_thinned, None);
        assert_eq!(radiance.at, [[1.0; 4]; 4]);
        let radiance = VisiblePoints::default().filled(&radiance, 0, None);
        assert_eq!(radiance.at, [[1.0; 4]; 4]);
    }
}
