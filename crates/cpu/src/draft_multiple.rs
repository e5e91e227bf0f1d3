//! Multiple scattering at the points of a draft, for a first picture in the shadows of shadow maps.
//!
//! It changes slowly along strands and hardly depends on those maps: only local scattering of light that comes straight does. So that
//! picture has single scattering found at every point, and this interpolated from the draft's points.

use strandlight_scattering::wide::LANES;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::NO_SLOT;

use super::arriving::lit_columns;
use super::halves::{n_numbers, whole};
use super::radiance::Between;

/// Most bytes of it.
const MAX_BYTES: usize = 256 << 20;

/// By place without a row.
const NO_ROW: u32 = u32::MAX;

/// Which light has which column.
#[derive(Clone, Debug, Default)]
pub(super) struct LightColumns {
    /// By column: the row of its shares among those of shadow maps, or [`NO_SLOT`].
    pub slots: Vec<u32>,
}

impl LightColumns {
    /// Of some lights of `all`, indices; those that are black have none.
    pub fn new(lights: &[u32], all: &[LightRecord]) -> LightColumns {
        let lit = lit_columns(lights, all);
        LightColumns {
            slots: lit.map(|(_, light)| light.shadow_index).collect(),
        }
    }

    /// Has the light of a column shadow maps?
    #[inline(always)]
    pub fn has_maps(&self, column: usize) -> bool {
        self.slots[column] != NO_SLOT
    }

    /// [`n_numbers`] of all.
    pub fn n_numbers(&self) -> usize {
        n_numbers(self.slots.len())
    }
}

/// What a point of a draft sends to the eye of lights with maps that its numbers and its rest are made of.
#[derive(Default)]
pub(super) struct DraftPoint {
    /// Single scattering, and its side.
    pub single: [f32; 4],
    /// Local scattering of light that comes straight, unblocked, for an amplitude of 1, by channel and light, whole vectors.
    pub direct: [Vec<[f32; LANES]>; 3],
}

impl DraftPoint {
    /// Nothing, of so many vectors of lights.
    #[inline(always)]
    pub fn clear(&mut self, n: usize) {
        self.single = [0.0; 4];
        for row in &mut self.direct {
            row.clear();
            row.resize(n, [0.0; LANES]);
        }
    }
}

/// At the points of a draft.
pub(super) struct DraftMultiple {
    pub columns: LightColumns,
    /// By place: its row, or [`NO_ROW`].
    row_of: Vec<u32>,
    /// Rows, once all are there.
    n_wanted: usize,
    /// `[row]`: local scattering of the straight light of lights with maps, unblocked, times the lights' colours and the view's
    /// radiance scale; see [`LightColumns::n_numbers`]. The upper halves of floats.
    numbers: Vec<u16>,
    /// `[row]`: what depends on no map, all scattering of lights without maps included, and their [side](super::radiance::Radiance::at).
    rest: Vec<[f32; 4]>,
}

impl DraftMultiple {
    /// Nothing yet of `lights`, indices into `all`, at `n_rows` of `n_places` visible points; none where no light has maps, or where
    /// it is too much.
    pub fn new(
        lights: &[u32],
        all: &[LightRecord],
        (n_rows, n_places): (usize, usize),
    ) -> Option<DraftMultiple> {
        let columns = LightColumns::new(lights, all);
        let has_maps = (0..columns.slots.len()).any(|column| columns.has_maps(column));
        let n = columns.n_numbers() * n_rows;
        (has_maps && size_of::<u16>() * n <= MAX_BYTES).then(|| DraftMultiple {
            columns,
            row_of: vec![NO_ROW; n_places],
            n_wanted: n_rows,
            numbers: Vec::with_capacity(n),
            rest: Vec::with_capacity(n_rows),
        })
    }

    /// Takes the numbers of some places, and their rest.
    pub fn take(&mut self, places: &[u32], numbers: &[u16], rest: &[[f32; 4]]) {
        for (row, place) in (self.rest.len() as u32..).zip(places) {
            self.row_of[*place as usize] = row;
        }
        self.numbers.extend_from_slice(numbers);
        self.rest.extend_from_slice(rest);
    }

    /// Are all rows there?
    pub fn is_whole(&self) -> bool {
        self.rest.len() == self.n_wanted
    }

    /// What it comes to between places that have rows, where such shares of the lights are unblocked, by column; of lights without
    /// maps any. Times the view's radiance scale.
    #[inline(always)]
    pub fn at(&self, between: &Between, unblocked: &[[f32; LANES]]) -> [f32; 4] {
        let [a, b] = between.ends.map(|end| self.row_of[end as usize]);
        if a == NO_ROW || b == NO_ROW {
            return [0.0; 4];
        }
        let first = self.of_row(a as usize, unblocked);
        if a == b {
            return first;
        }
        let second = self.of_row(b as usize, unblocked);
        let t = between.t.clamp(0.0, 1.0);
        [0, 1, 2, 3].map(|ix: usize| first[ix] + (second[ix] - first[ix]) * t)
    }

    #[inline(always)]
    fn of_row(&self, row: usize, unblocked: &[[f32; LANES]]) -> [f32; 4] {
        let n = self.columns.n_numbers();
        let numbers = &self.numbers[n * row..][..n];
        let mut found = self.rest[row];
        for (sum, numbers) in found.iter_mut().zip(numbers.chunks_exact((n / 3).max(1))) {
            let mut sums = [0.0; LANES];
            for (numbers, unblocked) in numbers.as_chunks::<LANES>().0.iter().zip(unblocked) {
                for lane in 0..LANES {
                    sums[lane] += whole(numbers[lane]) * unblocked[lane];
                }
            }
            *sum += sums.iter().sum::<f32>();
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::halves::half;
    use super::*;

    #[test]
    fn straight_light_has_the_shares_of_the_place_itself() {
        let light = |power: f32, shadow_index: u32| LightRecord {
            power,
            shadow_index,
            ..bytemuck::Zeroable::zeroed()
        };
        // The second is black, the fourth has no maps.
        let all = [
            light(1.0, 0),
            light(0.0, 1),
            light(1.0, 2),
            light(1.0, NO_SLOT),
        ];
        let mut draft = DraftMultiple::new(&[2, 1, 0, 3], &all, (2, 6)).expect("few bytes");
        assert_eq!(draft.columns.slots, [2, 0, NO_SLOT]);
        let n = draft.columns.n_numbers();
        let numbers = |of_lights: [f32; 2]| {
            let mut numbers = vec![0; n];
            for row in numbers.chunks_mut(n / 3) {
                row[..2].copy_from_slice(&of_lights.map(half));
            }
            numbers
        };
        draft.take(&[1], &numbers([8.0, 1.0]), &[[1.0, 2.0, 3.0, 4.0]]);
        assert!(!draft.is_whole());
        draft.take(&[5], &numbers([16.0, 3.0]), &[[5.0, 2.0, 3.0, 8.0]]);
        assert!(draft.is_whole());
        let mut unblocked = [0.0; LANES];
        (unblocked[0], unblocked[1]) = (0.5, 0.25);
        let at = |place: usize, ends: [u32; 2]| {
            let t = (place as f32 - ends[0] as f32) / 4.0;
            let between = Between {
                ends,
                beyond: ends,
                t,
            };
            draft.at(&between, &[unblocked])
        };
        assert_eq!(at(1, [1, 1]), [5.25, 6.25, 7.25, 4.0]);
        // A quarter of the one, three of the other.
        let [red, green, blue, side] = at(4, [1, 5]);
        assert_eq!(red, 0.25 * 5.25 + 0.75 * 13.75);
        assert_eq!(
            [green, blue],
            [2.0, 3.0].map(|rest| rest + 0.25 * 4.25 + 0.75 * 8.75)
        );
        assert_eq!(side, 7.0);
        assert_eq!(at(0, [0, 5]), [0.0; 4], "no row");
    }

    #[test]
    fn too_much_is_not_kept() {
        let all: [LightRecord; 1] = [bytemuck::Zeroable::zeroed()];
        assert!(DraftMultiple::new(&[0], &all, (1, 1)).is_none(), "black");
        let lit = [LightRecord {
            power: 1.0,
            ..all[0]
        }];
        assert!(DraftMultiple::new(&[0; 1000], &lit, (100_000, 100_000)).is_none());
        let without_maps = [LightRecord {
            shadow_index: NO_SLOT,
            ..lit[0]
        }];
        assert!(DraftMultiple::new(&[0], &without_maps, (1, 1)).is_none());
    }
}
