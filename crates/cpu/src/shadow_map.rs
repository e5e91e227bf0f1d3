//! Shadow maps that resolve fibres. Twin of `shaders/pass/shadow_map.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{Vec3, Vec3Swizzles};
use rayon::prelude::*;
use strandlight_scattering::closed_form::through_kernel;
use strandlight_scene::beside::Beside;
use strandlight_scene::shadow_maps::{
    FIRST_OF_SLOT, LAST_OF_SLOT, MAPS_PER_WORD, Mixture, N_PLACES, ShadowPlan, ShadowView,
    share_place,
};
use strandlight_scene::strands::Strands;

/// A texel has the height of the highest segment over its name, the last bits of the number of its first point: so many.
pub(super) const NAME_BITS: u32 = 12;
/// Largest height that the other bits hold.
pub(super) const HEIGHT_UNITS: f32 = 1_048_575.0;
/// Segments so many points away along the strand are the point's own: no shadow.
pub(super) const OWN_POINTS: u32 = 3;
/// Other strands cast shadows from this many radii above on.
pub(super) const CLEAR_RADII: f32 = 0.5;

/// What shadow maps say of every point.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    /// Unblocked shares, `[shadow_index / 4][mode][point]`:
    /// [`strandlight_scene::shadow_maps::unblocked_share`] reads them.
    pub shares: Vec<u32>,
    /// Lit places, `[map_index / 4][point]`, eight bits a map.
    pub answers: Vec<u32>,
}

impl Visibility {
    /// Nothing yet of the maps of `plan` at `n_points` points.
    pub fn new(plan: &ShadowPlan, n_points: usize) -> Visibility {
        Visibility {
            shares: vec![0; plan.n_words(n_points)],
            answers: vec![0; plan.n_answer_words(n_points)],
        }
    }

    /// Which places about a point of `n_points` a map has lit, a bit each from the root on.
    pub fn answer(&self, n_points: usize, map: u32, point: usize) -> u8 {
        let word = self.answers[(map / MAPS_PER_WORD) as usize * n_points + point];
        (word >> (8 * (map % MAPS_PER_WORD))) as u8
    }
}

/// Unblocked shares of the lights with maps at every point, for an `eye` that looks along `forward`:
/// [`strandlight_scene::shadow_maps::unblocked_share`] reads them.
pub fn shadow_maps(
    strands: &Strands,
    plan: &ShadowPlan,
    (eye, forward): ([f32; 3], [f32; 3]),
) -> Vec<u32> {
    let mut visibility = Visibility::new(plan, strands.points.len());
    for views in [&plan.views, &plan.through(forward)] {
        draw_maps(strands, views, &Beside::none(), &mut visibility);
    }
    through_shares(strands, eye, &plan.mixture(forward), &mut visibility);
    visibility.shares
}

/// Draws maps and writes their rows, with proxies `beside` that block light.
/// Returns how many texels were drawn, those of every strand counted.
pub(super) fn draw_maps(
    strands: &Strands,
    views: &[ShadowView],
    beside: &Beside,
    visibility: &mut Visibility,
) -> u64 {
    let mut n_texels = 0;
    let n_points = strands.points.len();
    let mut map: Vec<AtomicU32> = Vec::new();
    let mut sums = vec![0.0; n_points];
    let places = beside.places(n_points, |ix| Vec3::from_slice(&strands.points[ix]));
    for view in views {
        let towards = beside.towards(Vec3::from(view.towards));
        map.clear();
        map.resize_with((view.side * view.side) as usize, AtomicU32::default);
        n_texels += strands
            .segments
            .par_iter()
            .with_min_len(1024)
            .map(|&first| cast_shadows(view, strands, first, &map))
            .sum::<u64>();
        let row = (view.map_index / MAPS_PER_WORD) as usize * n_points;
        let bit = 8 * (view.map_index % MAPS_PER_WORD);
        let answers = &mut visibility.answers[row..row + n_points];
        answers
            .par_iter_mut()
            .zip(&mut sums)
            .enumerate()
            .with_min_len(1024)
            .for_each(|(point, (answer, sum))| {
                let mut lit = receive_shadows(view, strands, point, &map);
                let position = Vec3::from_slice(&strands.points[point]);
                if towards.is_blocked(&places, point, position) {
                    lit = 0;
                }
                *answer = *answer & !(255 << bit) | lit << bit;
                let share = view.weight * lit.count_ones() as f32 / N_PLACES as f32;
                *sum = if view.ends & FIRST_OF_SLOT == 0 {
                    *sum + share
                } else {
                    share
                };
            });
        if view.ends & LAST_OF_SLOT != 0 {
            let (row, bit) = share_place(n_points, view.shadow_index, false, 0);
            write_shares(&mut visibility.shares[row..row + n_points], bit, &sums);
        }
    }
    n_texels
}

/// Writes a slot's shares of all points.
fn write_shares(words: &mut [u32], bit: u32, shares: &[f32]) {
    words.par_iter_mut().zip(shares).for_each(|(word, share)| {
        *word = *word & !(255 << bit) | ((share.min(1.0) * 255.0 + 0.5) as u32) << bit;
    });
}

/// TT's shares for an `eye`, once all maps of `mixture` are drawn. Twin of
/// `shaders/pass/through_shares.wgsl`.
pub(super) fn through_shares(
    strands: &Strands,
    eye: [f32; 3],
    mixture: &Mixture,
    visibility: &mut Visibility,
) {
    let n_points = strands.points.len();
    let n_maps = mixture.towards.len();
    for (slot, weights) in mixture.weights.chunks_exact(n_maps.max(1)).enumerate() {
        let share_at = |point: usize| {
            let [u, v, w] = strands.frame(point);
            let in_frame = |d: Vec3| [u.dot(d), v.dot(d), w.dot(d)];
            let position = Vec3::from_slice(&strands.points[point]);
            let eye = in_frame((Vec3::from(eye) - position).normalize_or_zero());
            let (mut unblocked, mut all) = (0.0, 0.0);
            for (ix, (weight, towards)) in weights.iter().zip(&mixture.towards).enumerate() {
                let lit = visibility.answer(n_points, ix as u32, point).count_ones();
                let weight = weight * through_kernel(in_frame(Vec3::from(*towards)), eye);
                all += weight;
                unblocked += weight * lit as f32;
            }
            unblocked / (all * N_PLACES as f32)
        };
        let shares: Vec<f32> = (0..n_points).into_par_iter().map(share_at).collect();
        let (row, bit) = share_place(n_points, slot as u32, true, 0);
        write_shares(&mut visibility.shares[row..row + n_points], bit, &shares);
    }
}

/// x and y in texels from the corner, z the height in cm.
#[inline(always)]
pub(super) fn map_position(view: &ShadowView, point: &[f32; 4]) -> Vec3 {
    let d = Vec3::new(point[0], point[1], point[2]) - Vec3::from(view.centre);
    let middle = 0.5 * view.side as f32;
    let x = d.dot(Vec3::from(view.right)) * view.texels_per_cm + middle;
    let y = d.dot(Vec3::from(view.up)) * view.texels_per_cm + middle;
    Vec3::new(x, y, d.dot(Vec3::from(view.towards)))
}

#[inline(always)]
pub(super) fn height_units(view: &ShadowView, height: f32) -> u32 {
    // By way of i32: vectorised for AVX-512, the compiler's direct cast gives wrong numbers.
    ((0.5 * height / view.reach + 0.5).clamp(0.0, 1.0) * HEIGHT_UNITS) as i32 as u32
}

#[inline(always)]
pub(super) fn name_of(point: u32) -> u32 {
    point & ((1 << NAME_BITS) - 1)
}

/// Draws the segment that starts at point `first`; the order of segments does not matter. Answers
/// its number of texels.
fn cast_shadows(view: &ShadowView, strands: &Strands, first: u32, map: &[AtomicU32]) -> u64 {
    let (from, to) = (
        &strands.points[first as usize],
        &strands.points[first as usize + 1],
    );
    let (mut a, mut b) = (map_position(view, from), map_position(view, to));
    let steep = (b.y - a.y).abs() > (b.x - a.x).abs();
    if steep {
        (a, b) = (a.yxz(), b.yxz());
    }
    if a.x > b.x {
        std::mem::swap(&mut a, &mut b);
    }
    let run = b.x - a.x;
    if run < 1e-6 {
        return 0;
    }
    let rise = (b.yz() - a.yz()) / run;
    let radius = 0.5 * (from[3] + to[3]) * view.texels_per_cm;
    let half_width = radius * (1.0 + rise.x * rise.x).sqrt();
    let side = view.side as i32;
    let name = name_of(first);
    let last = ((b.x - 0.5).ceil() as i32).min(side);
    let mut n_texels = 0;
    for column in ((a.x - 0.5).ceil() as i32).max(0)..last {
        let along = column as f32 + 0.5 - a.x;
        let y = a.y + rise.x * along;
        let top = ((y + half_width - 0.5).ceil() as i32).min(side);
        let bottom = ((y - half_width - 0.5).ceil() as i32).max(0);
        n_texels += u64::from(top.saturating_sub(bottom).max(0) as u32);
        for row in bottom..top {
            let cell = if steep {
                row + side * column
            } else {
                column + side * row
            };
            let height = height_units(view, a.z + rise.y * along);
            let cell = &map[cell as usize];
            let value = height << NAME_BITS | name;
            // Looking is cheaper than changing, and most of what is drawn is hidden.
            if cell.load(Ordering::Relaxed) < value {
                cell.fetch_max(value, Ordering::Relaxed);
            }
        }
    }
    n_texels
}

/// Which of [`N_PLACES`] places about a point are lit, a bit each from the root on.
fn receive_shadows(
    view: &ShadowView,
    strands: &Strands,
    point_ix: usize,
    map: &[AtomicU32],
) -> u32 {
    let point = &strands.points[point_ix];
    let (before, after) = (strands.tangents[point_ix][3], strands.normals[point_ix][3]);
    let middle = map_position(view, point);
    let mut from_before = middle;
    if before > 0.0 {
        from_before = map_position(view, &strands.points[point_ix - 1]);
    }
    let mut to_after = middle;
    if after > 0.0 {
        to_after = map_position(view, &strands.points[point_ix + 1]);
    }
    let mut lit = 0;
    for ix in 0..N_PLACES {
        let place = (ix as f32 + view.offset) / N_PLACES as f32 * (before + after) - before;
        let (mut end, mut share) = (to_after, 0.5 * place / after.max(1e-20));
        if place < 0.0 {
            (end, share) = (from_before, -0.5 * place / before);
        }
        let at = middle + (end - middle) * share;
        let last = view.side as i32 - 1;
        let [x, y] = [at.x, at.y].map(|x| (x.floor() as i32).clamp(0, last));
        let highest = map[(x + view.side as i32 * y) as usize].load(Ordering::Relaxed);
        let is_above = highest >> NAME_BITS > height_units(view, at.z + CLEAR_RADII * point[3]);
        let apart = name_of(
            highest
                .wrapping_sub(point_ix as u32)
                .wrapping_add(OWN_POINTS),
        );
        lit |= u32::from(!is_above || apart <= 2 * OWN_POINTS) << ix;
    }
    lit
}
