//! What arrives of every light at the visible points, before the hair there scatters it.
//!
//! It depends on strands, lights and view, and not on the fibre: an edit of the hair finds it ready.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, ShadowRecord, unpack_record};
use strandlight_scattering::wide::{
    LANES, Level, MOST_DEPTH, Simd, depths_of_shares, dispatch, f32x8, prelude::*,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::NO_SLOT;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::through_shares::{Maps, Scratch, ThroughShares};
use super::transmittance::mix_all;
use super::unblocked::VisiblePoint;
use super::voxelise::{grid_position, voxel_index};

/// Rows that a thread works on at a time.
const CHUNK: usize = 64;

/// Rows for which the shadow volume is looked up at a time: some milliseconds if it is for all of them.
const ROWS_AT_ONCE: usize = 256 * CHUNK;

/// Places at which shares of shadow maps are taken at a time: some 3 ms on two cores.
const SHARES_AT_ONCE: usize = 1 << 13;

/// Numbers of a light at a point.
const N_NUMBERS: usize = 6;

/// What 1 is in a number.
const ONE: f32 = 65_535.0;

/// Most bytes of the numbers of one group of lights. Edits find ready what arrives where one group has all lights.
const MAX_BYTES: usize = 512 << 20;

/// Of a group of lights, at every visible point.
#[derive(Clone, Debug, Default)]
pub(super) struct Arriving {
    /// The lights of the group, indices in the scene's list: a column each.
    pub lights: Vec<u32>,
    /// By place: is it found what the shadow volume says there?
    is_found: Vec<bool>,
    n_found: usize,
    finding: Option<Finding>,
    /// Are there shares of shadow maps, at some places at least?
    pub has_shares: bool,
    /// By place: are there those of the maps as they are?
    has_share: Vec<bool>,
    n_with_shares: usize,
    /// Where they are being taken, and at how many of these places they are.
    taking: Option<(Vec<RowOf>, usize)>,
    /// By place: its row of numbers. Points keep theirs from view to view, so that nothing is moved.
    rows: Vec<u32>,
    /// `[row][number][column]`, whole vectors of columns, unorm16: the unblocked share of all modes but TT; that
    /// of TT; three depths, see [`ShadowRecords`](strandlight_scattering::wide::ShadowRecords), over [`MOST_DEPTH`]; the sine of
    /// the inclination of the hair that the light passes.
    numbers: Vec<u16>,
}

/// The row of numbers that a place has. Sorted by rows, what threads write lies together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct RowOf {
    row: u32,
    place: u32,
}

/// What the shadow volume says at some places, while it is being found.
#[derive(Clone, Debug)]
struct Finding {
    /// The places, by growing rows.
    places: Vec<RowOf>,
    /// Columns that are found at all of them.
    n_filled: usize,
    /// Rows from the first on, of all there are, at which the next eight columns are found.
    n_done: usize,
    /// `[column][voxel]` of these eight columns, unpacked.
    records: Vec<[f32; 4]>,
}

/// Eight columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    columns: [usize; LANES],
    /// One follows the other.
    is_row: bool,
}

impl Columns {
    /// At most eight columns; the last one takes the place of missing ones.
    pub fn new(columns: &[usize]) -> Columns {
        let last = columns.len().saturating_sub(1);
        Columns {
            columns: std::array::from_fn(|lane| {
                columns.get(lane.min(last)).copied().unwrap_or_default()
            }),
            is_row: columns.first().is_some_and(|first| first % LANES == 0)
                && columns.windows(2).all(|pair| pair[0] + 1 == pair[1]),
        }
    }
}

/// Of some `lights`, indices into `all` and a column each, those that are not black, with their columns.
pub(super) fn lit_columns<'a>(
    lights: &[u32],
    all: &'a [LightRecord],
) -> impl Iterator<Item = (usize, &'a LightRecord)> {
    let columns = (0..)
        .zip(lights)
        .map(|(column, &ix)| (column, &all[ix as usize]));
    columns.filter(|(_, light)| light.power > 0.0)
}

/// What arrives at one point, by column.
#[derive(Clone, Copy)]
pub(super) struct AtPoint<'a> {
    numbers: &'a [u16],
    /// Columns of a number, whole vectors.
    n: usize,
}

impl AtPoint<'_> {
    /// Unblocked shares of all modes but TT.
    #[inline(always)]
    pub fn unblocked(&self, columns: &Columns) -> [f32; LANES] {
        self.eight(0, columns, 1.0)
    }

    /// Unblocked shares of TT.
    #[inline(always)]
    pub fn unblocked_tt(&self, columns: &Columns) -> [f32; LANES] {
        self.eight(1, columns, 1.0)
    }

    /// Three depths, and the sine of the inclination.
    #[inline(always)]
    pub fn records(&self, columns: &Columns) -> [[f32; LANES]; 4] {
        [
            self.eight(2, columns, MOST_DEPTH),
            self.eight(3, columns, MOST_DEPTH),
            self.eight(4, columns, MOST_DEPTH),
            self.eight(5, columns, 1.0),
        ]
    }

    #[inline(always)]
    fn eight(&self, number: usize, columns: &Columns, one: f32) -> [f32; LANES] {
        let row = &self.numbers[number * self.n..][..self.n];
        let mut values = [0.0; LANES];
        if columns.is_row {
            let numbers = &row[columns.columns[0]..][..LANES];
            for (value, number) in values.iter_mut().zip(numbers) {
                *value = f32::from(*number) * (one / ONE);
            }
        } else {
            for (value, column) in values.iter_mut().zip(columns.columns) {
                *value = f32::from(row[column]) * (one / ONE);
            }
        }
        values
    }
}

impl Arriving {
    /// The groups of `lights`, indices, whose numbers at `n_places` points fit into memory.
    pub fn groups(lights: &[u32], n_places: usize) -> Vec<Range<usize>> {
        let bytes = size_of::<u16>() * N_NUMBERS * n_places.max(1);
        let n = (MAX_BYTES / bytes / LANES * LANES).max(LANES);
        (0..lights.len())
            .step_by(n)
            .map(|first| first..(first + n).min(lights.len()))
            .collect()
    }

    /// Nothing yet of some lights, indices, at `n_places` points.
    pub fn new(lights: &[u32], n_places: usize) -> Arriving {
        Arriving {
            lights: lights.to_vec(),
            is_found: vec![false; n_places],
            n_found: 0,
            finding: None,
            has_shares: false,
            has_share: vec![false; n_places],
            n_with_shares: 0,
            taking: None,
            rows: (0..n_places as u32).collect(),
            numbers: vec![0; N_NUMBERS * lights.len().next_multiple_of(LANES) * n_places],
        }
    }

    /// Columns of a number, whole vectors.
    fn n_columns(&self) -> usize {
        self.lights.len().next_multiple_of(LANES)
    }

    /// Numbers of a row.
    fn n_of_row(&self) -> usize {
        N_NUMBERS * self.n_columns()
    }

    /// The same of other visible points: what is found at those that were visible `before` is kept.
    pub fn of_view(mut self, before: &[u32], visible: &[u32]) -> Arriving {
        let mut was = (0..).zip(before).peekable();
        // The row of each, where it is found.
        let rows = visible.iter().map(|point| {
            while was.next_if(|(_, other)| *other < point).is_some() {}
            let (old, _): (usize, _) = was.next_if(|(_, other)| *other == point)?;
            self.is_found[old].then_some(self.rows[old])
        });
        let rows: Vec<Option<u32>> = rows.collect();
        let n_of_row = self.n_of_row();
        let n_rows = (self.numbers.len() / n_of_row.max(1)).max(visible.len());
        let mut is_free = vec![true; n_rows];
        for row in rows.iter().flatten() {
            is_free[*row as usize] = false;
        }
        let mut free = (0..n_rows as u32).filter(|row| is_free[*row as usize]);
        let is_found: Vec<bool> = rows.iter().map(Option::is_some).collect();
        self.rows = rows
            .into_iter()
            .filter_map(|row| row.or_else(|| free.next()))
            .collect();
        // Rows behind the last one that is needed go.
        let n_rows = self.rows.iter().max().map_or(0, |last| *last as usize + 1);
        let n = n_rows * n_of_row;
        self.numbers
            .reserve_exact(n.saturating_sub(self.numbers.len()));
        self.numbers.resize(n, 0);
        self.numbers.shrink_to(2 * n);
        self.n_found = is_found.iter().filter(|is_found| **is_found).count();
        self.is_found = is_found;
        self.has_share = vec![false; visible.len()];
        (self.n_with_shares, self.taking, self.finding) = (0, None, None);
        self
    }

    /// Goes on finding what the shadow volume says, at all places or at `some`, of all lights and their packed records,
    /// `[light][voxel]`; answers whether all of it is there.
    pub fn find(
        &mut self,
        scene: &PreparedScene,
        grid: &Grid,
        lights: (&[LightRecord], &[PackedRecord]),
        (visible, some): (&[u32], Option<&[u32]>),
    ) -> bool {
        if self.n_found == visible.len() {
            return true;
        }
        let mut finding = match self.finding.take() {
            Some(finding) => finding,
            None => {
                let places = self.missing(&self.is_found, some);
                if places.is_empty() {
                    return true;
                }
                Finding {
                    places,
                    n_filled: 0,
                    n_done: 0,
                    records: Vec::new(),
                }
            }
        };
        if self.fill(&mut finding, scene, grid, lights, visible) {
            for of in &finding.places {
                self.is_found[of.place as usize] = true;
            }
            self.n_found += finding.places.len();
        } else {
            self.finding = Some(finding);
        }
        false
    }

    /// Finds the next eight columns at some more of the places; answers whether all columns are there at all of them.
    fn fill(
        &mut self,
        finding: &mut Finding,
        scene: &PreparedScene,
        grid: &Grid,
        (all, packed): (&[LightRecord], &[PackedRecord]),
        visible: &[u32],
    ) -> bool {
        let first = finding.n_filled;
        let n = self.lights.len();
        let columns = first..(first + LANES).min(n);
        let n_voxels = grid.n_voxels();
        let lights: Vec<usize> = columns.clone().map(|ix| self.lights[ix] as usize).collect();
        if finding.n_done == 0 {
            finding.records = unpacked(&lights, packed, n_voxels);
        }
        let lift = SELF_LIFT * grid.h;
        let lifts: Vec<Vec3> = lights
            .iter()
            .map(|&light| Vec3::from(all[light].direction) * lift)
            .collect();
        let points = &scene.strands.points;
        let lights = (&lifts[..], &finding.records[..]);
        let position = |point: u32| Vec3::from_slice(&points[point as usize]);
        let level = Level::new();
        let (n_columns, n_of_row) = (self.n_columns(), self.n_of_row());
        let n_rows = self.numbers.len() / n_of_row.max(1);
        let range = finding.n_done..(finding.n_done + ROWS_AT_ONCE).min(n_rows);
        let places = &finding.places[..];
        self.numbers[n_of_row * range.start..n_of_row * range.end]
            .par_chunks_mut((n_of_row * CHUNK).max(1))
            .enumerate()
            .for_each(|(chunk, numbers)| {
                let start = range.start + CHUNK * chunk;
                let places = of_chunk(places, start);
                dispatch!(level, simd => {
                    for RowOf { row, place } in places {
                        let found = records_at(grid, lights, position(visible[*place as usize]));
                        let packed = pack_row(simd, &found);
                        let numbers = &mut numbers[n_of_row * (*row as usize - start)..][..n_of_row];
                        for (numbers, packed) in numbers.chunks_exact_mut(n_columns).zip(packed) {
                            numbers[columns.clone()].copy_from_slice(&packed[..columns.len()]);
                        }
                    }
                });
            });
        finding.n_done = range.end;
        if range.end == n_rows {
            (finding.n_filled, finding.n_done) = (columns.end, 0);
            finding.records = Vec::new();
        }
        finding.n_filled == n
    }

    /// The shares are those of other maps, or of another eye.
    pub fn forget_shares(&mut self) {
        self.has_share.fill(false);
        (self.n_with_shares, self.taking) = (0, None);
    }

    /// Goes on taking the unblocked shares that shadow maps found, at all places or at `some`, of the lights of `all` that have some;
    /// answers whether all of them are there.
    pub fn take_shares(
        &mut self,
        scene: &PreparedScene,
        eye: [f32; 3],
        (all, maps): (&[LightRecord], Maps),
        (visible, some): (&[u32], Option<&[u32]>),
    ) -> bool {
        let columns: Vec<(usize, u32)> = self
            .lights
            .iter()
            .enumerate()
            .map(|(column, &light)| (column, all[light as usize].shadow_index))
            .filter(|(_, slot)| *slot != NO_SLOT)
            .collect();
        if columns.is_empty() || self.n_with_shares == visible.len() {
            return true;
        }
        let (places, n_done) = match self.taking.take() {
            Some(taking) => taking,
            None => (self.missing(&self.has_share, some), 0),
        };
        if places.is_empty() {
            return true;
        }
        self.has_shares = true;
        let end = (n_done + SHARES_AT_ONCE).min(places.len());
        self.take_shares_at(&places[n_done..end], &columns, scene, eye, maps, visible);
        self.n_with_shares += end - n_done;
        if end < places.len() {
            self.taking = Some((places, end));
        }
        false
    }

    /// Takes them at some places, by growing rows.
    fn take_shares_at(
        &mut self,
        places: &[RowOf],
        columns: &[(usize, u32)],
        scene: &PreparedScene,
        eye: [f32; 3],
        maps: Maps,
        visible: &[u32],
    ) {
        let (Some(&first), Some(&last)) = (places.first(), places.last()) else {
            return;
        };
        let range = first.row as usize..last.row as usize + 1;
        let (n_columns, n_of_row) = (self.n_columns(), self.n_of_row());
        let pack = |share: f32| (share * ONE + 0.5) as i32 as u16;
        let through = ThroughShares::new(&scene.strands, eye, maps);
        for of in places {
            self.has_share[of.place as usize] = true;
        }
        self.numbers[n_of_row * range.start..n_of_row * range.end]
            .par_chunks_mut(n_of_row * CHUNK)
            .enumerate()
            .for_each_init(Scratch::default, |scratch, (chunk, numbers)| {
                let start = range.start + CHUNK * chunk;
                let places = of_chunk(places, start);
                dispatch!(Level::new(), simd => {
                    for RowOf { row, place } in places {
                        let at = VisiblePoint {
                            place: *place as usize,
                            point: visible[*place as usize] as usize,
                        };
                        through.find(simd, at, scratch);
                        let numbers = &mut numbers[n_of_row * (*row as usize - start)..][..n_of_row];
                        for &(column, slot) in columns {
                            numbers[column] = pack(maps.of_lights.share(slot, at));
                            numbers[n_columns + column] = pack(scratch.shares[slot as usize]);
                        }
                    }
                });
            });
    }

    /// At a visible point.
    #[inline(always)]
    pub fn at(&self, place: usize) -> AtPoint<'_> {
        let n_of_row = self.n_of_row();
        AtPoint {
            numbers: &self.numbers[n_of_row * self.rows[place] as usize..][..n_of_row],
            n: self.n_columns(),
        }
    }

    /// Places at which something is not found, of all or of `some`, by growing rows.
    fn missing(&self, is_found: &[bool], some: Option<&[u32]>) -> Vec<RowOf> {
        let is_missing = |place: &u32| !is_found[*place as usize];
        let with_row = |place: u32| RowOf {
            row: self.rows[place as usize],
            place,
        };
        let mut places: Vec<RowOf> = match some {
            Some(some) => some
                .iter()
                .copied()
                .filter(is_missing)
                .map(with_row)
                .collect(),
            None => (0..is_found.len() as u32)
                .filter(is_missing)
                .map(with_row)
                .collect(),
        };
        places.sort_unstable();
        places
    }
}

/// Those of places by growing rows whose rows lie in the chunk that starts at one.
fn of_chunk(places: &[RowOf], start: usize) -> &[RowOf] {
    let [from, to] =
        [start, start + CHUNK].map(|end| places.partition_point(|of| (of.row as usize) < end));
    &places[from..to]
}

/// `[light][voxel]` of these lights.
fn unpacked(lights: &[usize], packed: &[PackedRecord], n_voxels: usize) -> Vec<[f32; 4]> {
    let mut records = vec![[0.0; 4]; n_voxels * lights.len()];
    records
        .par_chunks_mut(n_voxels)
        .zip(lights)
        .for_each(|(records, light)| {
            let packed = &packed[light * n_voxels..][..n_voxels];
            for (record, packed) in records.iter_mut().zip(packed) {
                let ShadowRecord {
                    shares: [a, b, c],
                    sin_theta,
                } = unpack_record(packed);
                *record = [a, b, c, sin_theta];
            }
        });
    records
}

/// The numbers of eight lights: the volume's shares at three exponents, and the sine.
#[inline(always)]
fn pack_row<S: Simd>(simd: S, [a, b, c, sine]: &[[f32; LANES]; 4]) -> [[u16; LANES]; N_NUMBERS] {
    let shares = [
        f32x8::load_array_ref(simd, a),
        f32x8::load_array_ref(simd, b),
        f32x8::load_array_ref(simd, c),
    ];
    let depths = depths_of_shares(shares);
    let all = [
        shares[0],
        shares[0],
        depths[0] * (1.0 / MOST_DEPTH),
        depths[1] * (1.0 / MOST_DEPTH),
        depths[2] * (1.0 / MOST_DEPTH),
        f32x8::load_array_ref(simd, sine),
    ];
    let mut numbers = [[0; LANES]; N_NUMBERS];
    for (numbers, values) in numbers.iter_mut().zip(all) {
        let values = <[f32; LANES]>::from(values.max(0.0).min(1.0) * ONE + 0.5);
        for (number, value) in numbers.iter_mut().zip(values) {
            *number = value as i32 as u16;
        }
    }
    numbers
}

/// Numbers of up to eight lights at a position: how far it is lifted toward each, and their unpacked records.
#[inline(always)]
fn records_at(
    grid: &Grid,
    (lifts, records): (&[Vec3], &[[f32; 4]]),
    position: Vec3,
) -> [[f32; LANES]; 4] {
    let mut found = [[0.0; LANES]; 4];
    let of_lights = records.chunks_exact(grid.n_voxels());
    for (lane, (lift, records)) in lifts.iter().zip(of_lights).enumerate() {
        let record = record_at(grid, records, grid_position(grid, position + *lift));
        for (found, number) in found.iter_mut().zip(record) {
            found[lane] = number;
        }
    }
    found
}

/// [`super::shade::record_at`] of unpacked records.
#[inline(always)]
fn record_at(grid: &Grid, records: &[[f32; 4]], g: Vec3) -> [f32; 4] {
    let (x, y, z) = (g.x as i32, g.y as i32, g.z as i32);
    let (fx, fy, fz) = (g.x - x as f32, g.y - y as f32, g.z - z as f32);
    let corner = voxel_index(grid, [x as u32, y as u32, z as u32]);
    let row = grid.dims[0] as usize;
    let above = corner + row * grid.dims[1] as usize;
    let along_x = |at: usize| mix_all(records[at], records[at + 1], fx);
    mix_all(
        mix_all(along_x(corner), along_x(corner + row), fy),
        mix_all(along_x(above), along_x(above + row), fy),
        fz,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_view_keeps_what_is_known() {
        let mut arriving = Arriving::new(&[4, 2], 3);
        arriving.is_found = vec![true, false, true];
        for (ix, number) in arriving.numbers.iter_mut().enumerate() {
            *number = ix as u16;
        }
        let before = arriving.clone();
        let other = arriving.of_view(&[3, 7, 9], &[1, 3, 7, 9, 12]);
        assert_eq!(other.is_found, [false, true, false, true, false]);
        assert_eq!(other.at(1).numbers, before.at(0).numbers);
        assert_eq!(other.at(3).numbers, before.at(2).numbers);
        assert_eq!(other.n_found, 2);
        // Six numbers of eight columns each; no two places have the same.
        assert_eq!(other.numbers.len(), 5 * 48);
        let mut rows = other.rows.clone();
        rows.sort_unstable();
        assert_eq!(rows, [0, 1, 2, 3, 4]);
        // Fewer points need no more room, and more of them find what is left.
        let few = other.of_view(&[1, 3, 7, 9, 12], &[9]);
        assert_eq!(few.at(0).numbers, before.at(2).numbers);
        let again = few.of_view(&[9], &[8, 9, 10]);
        assert_eq!(again.at(1).numbers, before.at(2).numbers);
        assert_eq!((again.n_found, again.rows.len()), (1, 3));
    }

    /// Those of the paper's densest scene keep all of it from edit to edit; more than fits comes in groups of whole vectors.
    #[test]
    fn lights_come_in_as_few_groups_as_fit() {
        assert_eq!(Arriving::groups(&[0; 41], 365_000), vec![0..41]);
        let groups = Arriving::groups(&[0; 41], 2_000_000);
        assert_eq!(groups, [0..16, 16..32, 32..41]);
        let bytes = |n_lights: usize| size_of::<u16>() * N_NUMBERS * n_lights * 2_000_000;
        assert!(bytes(16) <= MAX_BYTES && bytes(24) > MAX_BYTES);
        // One vector at least, and no light has no group.
        assert_eq!(Arriving::groups(&[0; 9], usize::MAX / 100), [0..8, 8..9]);
        assert!(Arriving::groups(&[], 7).is_empty());
    }

    #[test]
    fn places_are_looked_for_where_they_are_wanted() {
        let mut arriving = Arriving::new(&[0], 4);
        arriving.rows = vec![2, 0, 3, 1];
        let is_found = [false, true, false, false];
        let places = |some| -> Vec<u32> {
            let missing = arriving.missing(&is_found, some);
            missing.iter().map(|of| of.place).collect()
        };
        assert_eq!(places(None), [3, 0, 2]);
        assert_eq!(places(Some(&[3, 1, 2])), [3, 2]);
        let first = CHUNK as u32;
        let places = [first - 1, first, first + 3, 2 * first].map(|row| RowOf { row, place: 7 });
        assert_eq!(of_chunk(&places, CHUNK), &places[1..3]);
        assert!(of_chunk(&places, 3 * CHUNK).is_empty());
    }

    #[test]
    fn columns_are_the_same_in_a_row_and_one_by_one() {
        let mut arriving = Arriving::new(&[0; 11], 2);
        for (ix, number) in arriving.numbers.iter_mut().enumerate() {
            *number = 7 * ix as u16;
        }
        let at = arriving.at(1);
        for columns in [&[0, 1, 2, 3, 4, 5, 6, 7][..], &[8, 9, 10]] {
            let row = Columns::new(columns);
            let apart = Columns {
                is_row: false,
                ..row
            };
            assert!(row.is_row);
            let n = columns.len();
            assert_eq!(at.unblocked(&row)[..n], at.unblocked(&apart)[..n]);
            for (row, apart) in at.records(&row).iter().zip(at.records(&apart)) {
                assert_eq!(row[..n], apart[..n]);
            }
        }
        assert!(!Columns::new(&[0, 2, 3]).is_row && !Columns::new(&[3, 4]).is_row);
    }
}
