//! Records of each light at every voxel. Twin of `shaders/pass/transmittance.wgsl`.

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, ShadowRecord};
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{
    LANES, Level, RecordSums, Simd, Stretch, add_to_record, dispatch, f32x8, pack_records,
    transpose,
};
use strandlight_scene::beside::{Beside, HeightMaps, Places, Towards};
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::Grid;

/// In front of the first slice and beside the others all light is there.
const OPEN: [f32; 4] = [1.0, 1.0, 1.0, 0.0];

/// Records of a batch of lights, wherever they were found.
pub enum Shadows {
    /// `[light][voxel]`, to be interpolated; what [`transmittance`] answers.
    Volume(Vec<PackedRecord>),
    /// `[light][point]`, from [`ShadowSource::Points`](crate::ShadowSource::Points).
    Points(Vec<PackedRecord>),
}

impl Shadows {
    /// Bytes of the records.
    pub fn bytes(&self) -> u64 {
        let (Shadows::Volume(records) | Shadows::Points(records)) = self;
        size_of_val(&records[..]) as u64
    }
}

/// Packed records, `[light][voxel]`: means over each light's directions in `sweeps`; zeros for
/// black lights, which are never looked up. `volume` is what [`super::voxelise`] answers.
pub fn transmittance(
    grid: &Grid,
    volume: &[[f32; 8]],
    lights: &[LightRecord],
    sweeps: &[[f32; 4]],
) -> Vec<PackedRecord> {
    let beside = (&Beside::none(), &Places::default());
    transmittance_beside(grid, volume, lights, sweeps, beside).packed
}

/// What sweeps towards a batch of lights find.
pub(super) struct Swept {
    /// As [`transmittance`] answers them.
    pub packed: Vec<PackedRecord>,
    /// `[light][voxel]`: from how many directions of a light the proxies let it come; nothing where there are none.
    pub n_open: Vec<u8>,
}

/// [`transmittance`] with proxies that block light, and [`Beside::places_of_voxels`].
pub(super) fn transmittance_beside(
    grid: &Grid,
    volume: &[[f32; 8]],
    lights: &[LightRecord],
    sweeps: &[[f32; 4]],
    beside: (&Beside, &Places),
) -> Swept {
    let n_voxels = grid.n_voxels();
    let n_counted = match beside.0.is_empty() {
        true => 0,
        false => n_voxels,
    };
    let mut swept = Swept {
        packed: vec![[0; 2]; n_voxels * lights.len()],
        n_open: vec![0; n_counted * lights.len()],
    };
    // None of nothing is none.
    let mut open: Vec<&mut [u8]> = match n_counted {
        0 => lights.iter().map(|_| &mut [][..]).collect(),
        _ => swept.n_open.chunks_mut(n_counted).collect(),
    };
    swept
        .packed
        .par_chunks_mut(n_voxels)
        .zip(&mut open)
        .enumerate()
        .with_max_len(1)
        .filter(|(ix, _)| lights[*ix].power > 0.0)
        .for_each(|(ix, (out, open))| {
            let mut light = LightSweep::new(ix);
            while !light.sweep_next((grid, volume), (lights, sweeps), beside) {}
            light.pack(out, open);
        });
    swept
}

/// A light whose records are being found, one of its directions at a time.
#[derive(Default)]
pub(super) struct LightSweep {
    /// Its index among the lights.
    pub light_ix: usize,
    /// Directions that are swept.
    n_done: usize,
    sweeping: Sweeping,
    /// By direction, what stands beside the hair.
    pub maps: Vec<HeightMaps>,
}

impl LightSweep {
    /// Nothing yet.
    pub fn new(light_ix: usize) -> LightSweep {
        LightSweep {
            light_ix,
            ..LightSweep::default()
        }
    }

    /// Sweeps along the next of its directions, some milliseconds; answers whether it was the last. `volume` is what
    /// [`super::voxelise`] answers.
    pub fn sweep_next(
        &mut self,
        (grid, volume): (&Grid, &[[f32; 8]]),
        (lights, sweeps): (&[LightRecord], &[[f32; 4]]),
        (beside, places): (&Beside, &Places),
    ) -> bool {
        let light = &lights[self.light_ix];
        let first = light.first_sweep as usize;
        let directions = &sweeps[first..first + light.n_sweeps as usize];
        let sweeping = &mut self.sweeping;
        sweeping
            .sums
            .resize(grid.n_voxels(), ShadowRecord::default());
        if !beside.is_empty() {
            sweeping.n_open.resize(grid.n_voxels(), 0);
        }
        if let Some(&[x, y, z, _]) = directions.get(self.n_done) {
            let turn = [self.n_done, directions.len()].map(|n| n as f32);
            let d = [x, y, z];
            let towards = (!beside.is_empty()).then(|| beside.towards(Vec3::from(d)));
            let blocking = towards.as_ref().map(|towards| (towards, places));
            dispatch!(Level::new(), simd => {
                sweep(simd, (grid, volume), blocking, d, turn, sweeping);
            });
            self.maps
                .extend(towards.map(|towards| towards.maps().clone()));
            self.n_done += 1;
        }
        self.n_done == directions.len()
    }

    /// Writes the records, by voxel, and [from how many directions](Swept::n_open) light comes.
    pub fn pack(&self, out: &mut [PackedRecord], n_open: &mut [u8]) {
        dispatch!(Level::new(), simd => pack(simd, &self.sweeping.sums, out));
        n_open.copy_from_slice(&self.sweeping.n_open);
    }
}

/// What a light is swept in.
#[derive(Default)]
struct Sweeping {
    /// By voxel, the directions so far.
    sums: Vec<ShadowRecord>,
    /// By voxel, how many of them proxies let through, where there are some.
    n_open: Vec<u8>,
    /// What leaves the last slice, and what leaves this one.
    slices: [Slice; 2],
}

/// What leaves a slice of the grid: the three shares, and the integral of sin^2 over depth.
#[derive(Default)]
struct Slice {
    /// Numbers in a row.
    pitch: usize,
    numbers: [Vec<f32>; 4],
}

impl Slice {
    /// Voxels before the first of a row, and rows before the first, that all light reaches. After the last
    /// there is one more: light may come from there and is interpolated.
    const BORDER: usize = 1;

    /// Open everywhere.
    fn clear(&mut self, n_columns: usize, n_rows: usize) {
        self.pitch = n_columns.next_multiple_of(LANES) + 2 * Slice::BORDER + 1;
        for (numbers, open) in self.numbers.iter_mut().zip(OPEN) {
            numbers.clear();
            numbers.resize(self.pitch * (n_rows + 2 * Slice::BORDER + 1), open);
        }
    }

    /// Of a voxel of the slice or of its border.
    #[inline(always)]
    fn index(&self, column: i32, row: i32) -> usize {
        let border = Slice::BORDER as i32;
        (column + border) as usize + self.pitch * (row + border) as usize
    }
}

/// Marches slices from the light's side along the axis most along `d`, direction k of n, and adds
/// it to the sums; eight voxels of a row at a time.
#[inline(always)]
fn sweep<S: Simd>(
    simd: S,
    (grid, volume): (&Grid, &[[f32; 8]]),
    blocking: Option<(&Towards, &Places)>,
    d: [f32; 3],
    [k, n_directions]: [f32; 2],
    sweeping: &mut Sweeping,
) {
    let mut axis = 0;
    if d[1].abs() > d[axis].abs() {
        axis = 1;
    }
    if d[2].abs() > d[axis].abs() {
        axis = 2;
    }
    // Columns along x wherever slices have it: neighbours in memory.
    let axis_b = usize::from(axis == 0);
    let axis_c = 3 - axis - axis_b;
    let n = grid.dims[axis] as usize;
    let (n_b, n_c) = (grid.dims[axis_b] as usize, grid.dims[axis_c] as usize);
    let stride = [1, grid.dims[0], grid.dims[0] * grid.dims[1]].map(|stride| stride as usize);
    let slope = 1.0 / d[axis].abs();
    let (shift_b, shift_c) = (d[axis_b] * slope, d[axis_c] * slope);
    let (whole_b, whole_c) = (shift_b.floor(), shift_c.floor());
    let (f_b, f_c) = (shift_b - whole_b, shift_c - whole_c);
    let Sweeping {
        sums,
        n_open,
        slices: [leaving, next],
    } = sweeping;
    leaving.clear(n_b, n_c);
    next.clear(n_b, n_c);
    simd.vectorize(
        #[inline(always)]
        || {
            let (none, all_before) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, k));
            for slice_ix in 0..n {
                let slice = match d[axis] > 0.0 {
                    true => n - 1 - slice_ix,
                    false => slice_ix,
                };
                for c in 0..n_c {
                    for b in (0..n_b).step_by(LANES) {
                        let first = slice * stride[axis] + b * stride[axis_b] + c * stride[axis_c];
                        let n_lanes = LANES.min(n_b - b);
                        let voxel = |lane: usize| first + lane.min(n_lanes - 1) * stride[axis_b];
                        let corner =
                            leaving.index(b as i32 + whole_b as i32, c as i32 + whole_c as i32);
                        let at = |numbers: &[f32], corner: usize| {
                            let a = f32x8::from_slice(simd, &numbers[corner..corner + LANES]);
                            let b =
                                f32x8::from_slice(simd, &numbers[corner + 1..corner + 1 + LANES]);
                            a * (1.0 - f_b) + b * f_b
                        };
                        let mut entering = [f32x8::splat(simd, 0.0); 4];
                        for (entering, numbers) in entering.iter_mut().zip(&leaving.numbers) {
                            *entering = at(numbers, corner) * (1.0 - f_c)
                                + at(numbers, corner + leaving.pitch) * f_c;
                        }
                        let (sigma_t, sin_2) = extinction(simd, volume, voxel, d);
                        // Half a step from slice to slice before the voxel's centre and half behind it.
                        let half = Stretch::new(sigma_t * (0.5 * grid.h * slope), sin_2);
                        let here = half.pass_through(entering);
                        let through = half.pass_through(here);
                        let to = next.index(b as i32, c as i32);
                        for (numbers, through) in next.numbers.iter_mut().zip(through) {
                            let through = <[f32; LANES]>::from(through);
                            numbers[to..to + n_lanes].copy_from_slice(&through[..n_lanes]);
                        }
                        let mut blocked = 0;
                        if let Some((towards, places)) = blocking {
                            let mut indices = [0; LANES];
                            for (lane, index) in indices.iter_mut().enumerate() {
                                *index = voxel(lane);
                            }
                            let position = |lane: usize| {
                                let mut voxel = [0; 3];
                                voxel[axis] = slice as u32;
                                voxel[axis_b] = (b + lane) as u32;
                                voxel[axis_c] = c as u32;
                                grid.centre(voxel)
                            };
                            blocked = towards.are_blocked(simd, places, indices, position);
                        }
                        let sum = gather(simd, sums, voxel);
                        // Directions behind proxies say nothing of the hair's inclination.
                        let n_before = match blocking {
                            Some(_) => sum.shares[2].simd_gt(none).select(all_before, none),
                            None => all_before,
                        };
                        let sum = add_to_record(&sum, here, n_before, n_directions);
                        let [x, y, z] = sum.shares;
                        let (x, y) = (<[f32; LANES]>::from(x), <[f32; LANES]>::from(y));
                        let z = <[f32; LANES]>::from(z);
                        let sin_theta = <[f32; LANES]>::from(sum.sin_theta);
                        for lane in 0..n_lanes {
                            if blocked >> lane & 1 == 0 {
                                sums[voxel(lane)] = ShadowRecord {
                                    shares: [x[lane], y[lane], z[lane]],
                                    sin_theta: sin_theta[lane],
                                };
                                if let Some(n_open) = n_open.get_mut(voxel(lane)) {
                                    *n_open += 1;
                                }
                            }
                        }
                    }
                }
                std::mem::swap(leaving, next);
            }
        },
    );
}

/// [`strandlight_scene::volume::extinction`] of eight voxels.
#[inline(always)]
fn extinction<S: Simd>(
    simd: S,
    volume: &[[f32; 8]],
    voxel: impl Fn(usize) -> usize,
    d: [f32; 3],
) -> (f32x8<S>, f32x8<S>) {
    let mut rows = [f32x8::splat(simd, 0.0); LANES];
    for (lane, row) in rows.iter_mut().enumerate() {
        *row = f32x8::load_array_ref(simd, &volume[voxel(lane)]);
    }
    let [a, xx, yy, zz, xy, xz, yz, _] = transpose(rows);
    let along = xx * (d[0] * d[0])
        + yy * (d[1] * d[1])
        + zz * (d[2] * d[2])
        + (xy * (d[0] * d[1]) + xz * (d[0] * d[2]) + yz * (d[1] * d[2])) * 2.0;
    let sigma_t = (a * (a - along)).max(0.0).sqrt();
    (sigma_t, (along / a.max(1e-20)).max(0.0).min(1.0))
}

/// The sums of eight voxels.
#[inline(always)]
fn gather<S: Simd>(
    simd: S,
    sums: &[ShadowRecord],
    voxel: impl Fn(usize) -> usize,
) -> RecordSums<S> {
    let mut numbers = [[0.0; LANES]; 4];
    for lane in 0..LANES {
        let sum = &sums[voxel(lane)];
        for (ix, share) in sum.shares.iter().enumerate() {
            numbers[ix][lane] = *share;
        }
        numbers[3][lane] = sum.sin_theta;
    }
    let of = |ix: usize| f32x8::load_array_ref(simd, &numbers[ix]);
    RecordSums {
        shares: [of(0), of(1), of(2)],
        sin_theta: of(3),
    }
}

/// Packs the records of all voxels.
#[inline(always)]
fn pack<S: Simd>(simd: S, sums: &[ShadowRecord], out: &mut [PackedRecord]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (sums, out) in sums.chunks(LANES).zip(out.chunks_mut(LANES)) {
                let words = pack_records(&gather(simd, sums, |lane| lane.min(sums.len() - 1)));
                let (low, high) = (words[0], words[1]);
                let (low, high) = (<[i32; LANES]>::from(low), <[i32; LANES]>::from(high));
                for (lane, packed) in out.iter_mut().enumerate() {
                    *packed = [low[lane] as u32, high[lane] as u32];
                }
            }
        },
    );
}

/// As WGSL's `mix`.
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// [`mix`] of vectors.
#[inline(always)]
pub(super) fn mix_all(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    (Vec4::from(a) * (1.0 - t) + Vec4::from(b) * t).into()
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use strandlight_scattering::closed_form::{add_to_record, pass_through};
    use strandlight_scattering::random::SplitMix64;
    use strandlight_scene::proxy::Proxy;
    use strandlight_scene::strands::Strands;

    use super::super::voxelise::voxel_index;
    use super::*;

    /// [`sweep`] as the shader has it, a voxel at a time.
    fn sweep_by_voxels(
        (grid, volume): (&Grid, &[[f32; 8]]),
        (beside, places): (&Beside, &Places),
        d: [f32; 3],
        [k, n_directions]: [f32; 2],
        sums: &mut [ShadowRecord],
    ) {
        let mut axis = 0;
        if d[1].abs() > d[axis].abs() {
            axis = 1;
        }
        if d[2].abs() > d[axis].abs() {
            axis = 2;
        }
        let (axis_b, axis_c) = ((axis + 1) % 3, (axis + 2) % 3);
        let n = grid.dims[axis];
        let (n_b, n_c) = (grid.dims[axis_b], grid.dims[axis_c]);
        let slope = 1.0 / d[axis].abs();
        let (shift_b, shift_c) = (d[axis_b] * slope, d[axis_c] * slope);
        let is_beside = !beside.is_empty();
        let towards = beside.towards(Vec3::from(d));
        let mut leaving = vec![OPEN; (n_b * n_c) as usize];
        let mut next = leaving.clone();
        for slice_ix in 0..n {
            let slice = if d[axis] > 0.0 {
                n - 1 - slice_ix
            } else {
                slice_ix
            };
            let at = |b: i32, c: i32| {
                if b < 0 || c < 0 || b >= n_b as i32 || c >= n_c as i32 {
                    OPEN
                } else {
                    leaving[(b + n_b as i32 * c) as usize]
                }
            };
            for c in 0..n_c {
                for b in 0..n_b {
                    let mut entering = OPEN;
                    if slice_ix > 0 {
                        let (x, y) = (b as f32 + shift_b, c as f32 + shift_c);
                        let (x0, y0) = (x.floor(), y.floor());
                        let (fx, fy) = (x - x0, y - y0);
                        let (ix, iy) = (x0 as i32, y0 as i32);
                        let row_0 = mix_all(at(ix, iy), at(ix + 1, iy), fx);
                        let row_1 = mix_all(at(ix, iy + 1), at(ix + 1, iy + 1), fx);
                        entering = mix_all(row_0, row_1, fy);
                    }
                    let mut voxel = [0; 3];
                    voxel[axis] = slice;
                    voxel[axis_b] = b;
                    voxel[axis_c] = c;
                    let index = voxel_index(grid, voxel);
                    let [sigma_t, sin_2] =
                        strandlight_scene::volume::extinction(&volume[index], Vec3::from(d));
                    // Half a step from slice to slice before the voxel's centre and half behind it.
                    let depth = 0.5 * grid.h * slope * sigma_t;
                    let here = pass_through(entering, depth, sin_2);
                    next[(b + n_b * c) as usize] = pass_through(here, depth, sin_2);
                    let sum = sums[index];
                    let mut n_before = k;
                    if is_beside {
                        if towards.is_blocked(places, index, grid.centre(voxel)) {
                            continue;
                        }
                        // Directions behind proxies say nothing of the hair's inclination.
                        if sum.shares[2] <= 0.0 {
                            n_before = 0.0;
                        }
                    }
                    sums[index] = add_to_record(&sum, here, n_before, n_directions);
                }
            }
            std::mem::swap(&mut leaving, &mut next);
        }
    }

    #[test]
    fn sweeps_are_those_of_one_voxel_after_the_other() {
        let mut random = SplitMix64(5);
        let points = [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]];
        let strands = Strands::new(&points, &[0, 2], |_, _| 0.01, true).expect("valid");
        let ball = Proxy::Ellipsoid {
            centre: Vec3::new(0.2, 0.0, -0.1),
            radii: Vec3::splat(0.4),
            turn: Quat::IDENTITY,
            albedo: [0.5; 3],
        };
        for (round, dims) in [[11, 5, 9], [8, 16, 3], [1, 2, 17]].into_iter().enumerate() {
            let grid = Grid {
                origin: [-1.0; 3],
                h: 0.2,
                dims,
                ..Grid::around(&strands)
            };
            let volume: Vec<[f32; 8]> = (0..grid.n_voxels())
                .map(|_| {
                    let area = random.uniform(-2.0, 8.0).max(0.0) as f32;
                    let [x, y, z] = [0.5, 0.3, 0.2].map(|share| share * area);
                    [area, x, y, z, 0.1 * area, -0.1 * area, 0.05 * area, 0.0]
                })
                .collect();
            for proxies in [&[][..], std::slice::from_ref(&ball)] {
                let beside = Beside::new(proxies, &strands);
                let places = beside.places_of_voxels(&grid);
                let mut found = Sweeping::default();
                found.sums.resize(grid.n_voxels(), ShadowRecord::default());
                if !beside.is_empty() {
                    found.n_open.resize(grid.n_voxels(), 0);
                }
                let mut n_open = found.n_open.clone();
                let mut exact = found.sums.clone();
                // Along each axis both ways, straight and as far off it as it gets.
                let directions = [
                    [1.0, 0.0, 0.0],
                    [-0.8, 0.6, 0.1],
                    [0.1, -0.9, 0.3],
                    [-0.5, 0.7, -0.7],
                    [0.3, -0.2, 0.9],
                    [1.0, 1.0, -1.0],
                ];
                for (k, d) in directions.into_iter().enumerate() {
                    let d = Vec3::from(d).normalize().to_array();
                    let turn = [k as f32, directions.len() as f32];
                    let scene = (&grid, &volume[..]);
                    sweep_by_voxels(scene, (&beside, &places), d, turn, &mut exact);
                    let towards = beside.towards(Vec3::from(d));
                    for (ix, n_open) in n_open.iter_mut().enumerate() {
                        let voxel = ix as u32;
                        let [x, y, _] = dims;
                        let voxel = [voxel % x, voxel / x % y, voxel / (x * y)];
                        let is_blocked = towards.is_blocked(&places, ix, grid.centre(voxel));
                        *n_open += u8::from(!is_blocked);
                    }
                    let blocking = (!beside.is_empty()).then_some((&towards, &places));
                    dispatch!(Level::new(), simd => sweep(simd, scene, blocking, d, turn, &mut found));
                }
                assert_eq!(found.n_open, n_open);
                let mut darkest = 1.0_f32;
                for (found, exact) in found.sums.iter().zip(&exact) {
                    let pairs = found.shares.into_iter().zip(exact.shares);
                    for (found, exact) in pairs.chain([(found.sin_theta, exact.sin_theta)]) {
                        assert!((found - exact).abs() < 2e-5, "{round}: {found} {exact}");
                    }
                    darkest = darkest.min(exact.shares[0]);
                }
                assert!(darkest < 0.5, "{darkest}");
            }
        }
    }
}
