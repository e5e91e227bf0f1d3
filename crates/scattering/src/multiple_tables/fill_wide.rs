//! Eight rows of the tables at a time, of model `marschner`. Twin: `fill.rs`, which explains the rows.

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{AverageTexel, COS_THETA_D_MIN, LN_CULL};
use crate::wide::half_circle::half_circle;
use crate::wide::local_scattering::{direct_local_scattering, local_scattering};
use crate::wide::math::{clamp, cos, exp, mul_add};
use crate::wide::mean_cosine::mean_cosine;
use crate::wide::outer_integral::{OuterRules, outer_bound, outer_rules};
use crate::wide::rows::{cells, transpose};
use crate::wide::{LANES, Level, dispatch};

use super::axes::Axes;
use super::azimuth::{GRAZING, LAST_NODE, Profiles, Row};
use super::fill::{ALL, DirectRow, MATCHED_COSINE, N_BISECTIONS, Source};

/// theta_j and theta_o of some rows in turn; missing lanes repeat the last one.
#[inline(always)]
fn inclinations<S: Simd>(
    simd: S,
    axes: &Axes,
    width: f32,
    first: usize,
    n: usize,
) -> [f32x8<S>; 2] {
    let (mut theta_j, mut theta_o) = ([0.0; LANES], [0.0; LANES]);
    for (lane, (theta_j, theta_o)) in theta_j.iter_mut().zip(&mut theta_o).enumerate() {
        [*theta_j, *theta_o] = axes.inclinations_of(width, first + lane.min(n - 1));
    }
    [
        f32x8::load_array_ref(simd, &theta_j),
        f32x8::load_array_ref(simd, &theta_o),
    ]
}

impl Source<'_> {
    /// [`Source::row`] of all rows of the layer of this width.
    pub fn rows_of_layer(
        &self,
        level: Level,
        axes: &Axes,
        width: f32,
        [rows, further]: [&mut [Row]; 2],
    ) {
        dispatch!(level, simd => {
            let mut further = further.chunks_mut(LANES);
            for (ix, rows) in rows.chunks_mut(LANES).enumerate() {
                let [theta_j, theta_o] = inclinations(simd, axes, width, LANES * ix, rows.len());
                let found = self.eight_rows(width, theta_j, theta_o);
                rows.copy_from_slice(&found[0][..rows.len()]);
                if let Some(further) = further.next() {
                    further.copy_from_slice(&found[1][..further.len()]);
                }
            }
        });
    }

    /// [`Source::direct_row`] of all rows of the layer of this width.
    pub fn direct_rows_of_layer(
        &self,
        level: Level,
        axes: &Axes,
        width: f32,
        rows: &mut [DirectRow],
    ) {
        let Some(averages) = self.averages else {
            return;
        };
        dispatch!(level, simd => {
            for (ix, rows) in rows.chunks_mut(LANES).enumerate() {
                let [theta_j, theta_o] = inclinations(simd, axes, width, LANES * ix, rows.len());
                let found = eight_direct_rows(width, theta_j, theta_o, averages);
                rows.copy_from_slice(&found[..rows.len()]);
            }
        });
    }

    #[inline(always)]
    fn eight_rows<S: Simd>(
        &self,
        sigma_f: f32,
        theta_j: f32x8<S>,
        theta_o: f32x8<S>,
    ) -> [[Row; LANES]; 2] {
        let mut halves = [[Row::default(); LANES]; 2];
        if let Some(profiles) = self.profiles {
            let halves = &mut halves[..profiles.n_halves()];
            self.add_global_of_eight(profiles, [theta_j, theta_o], sigma_f, halves);
        }
        if let Some(averages) = self.averages {
            let local = local_scattering(theta_j, theta_o, sigma_f, averages);
            for (channel, local) in local.into_iter().enumerate() {
                let local: [f32; LANES] = local.into();
                for (row, local) in halves[0].iter_mut().zip(local) {
                    row[4 * channel + 3] = local;
                }
            }
        }
        halves
    }

    /// Twin of [`Source::row`]'s global scattering.
    #[inline(always)]
    fn add_global_of_eight<S: Simd>(
        &self,
        profiles: &Profiles,
        [theta_j, theta_o]: [f32x8<S>; 2],
        sigma_f: f32,
        halves: &mut [[Row; LANES]],
    ) {
        let simd = theta_j.token();
        let zero = f32x8::splat(simd, 0.0);
        let fibre = self.fibre;
        let variance_j = f32x8::splat(simd, sigma_f * sigma_f);
        let cosine = mean_cosine(theta_j, cos(theta_j).max(0.0), sigma_f);
        let scale = f32x8::splat(simd, FRAC_1_PI / sigma_f) / cosine;
        for mode in 0..3 {
            if fibre.modes & (1 << mode) == 0 {
                continue;
            }
            let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
            let lobe = [f32x8::splat(simd, alpha), f32x8::splat(simd, beta)];
            let bound = outer_bound(theta_j, variance_j, theta_o, lobe);
            let is_near = bound.simd_le(-LN_CULL);
            if !is_near.any_true() {
                continue;
            }
            let rules = outer_rules(theta_j, variance_j, theta_o, lobe);
            let counts = OuterRules::<S>::node_counts(fibre.node_count(mode as u32));
            for ix in 0..rules.most_nodes(counts) {
                let place = rules.place(counts, ix);
                let lobe = (rules.to_lobe + place.step) * rules.inverse_width;
                let light = (rules.to_light + place.step) * (1.0 / sigma_f);
                let fall = exp(-(lobe * lobe) - light * light);
                let cos_i = cos(place.theta_i).max(0.0);
                let cos_d = cos((theta_o - place.theta_i) * 0.5).max(COS_THETA_D_MIN);
                let ratio = (cos_i / cos_d).min(2.0);
                let weight = place.weight * rules.inverse_width * fall;
                let factor = is_near.select(scale * weight * (ratio * ratio), zero);
                profiles.add_to_eight(mode, cos_d, factor, halves);
            }
        }
    }
}

impl Profiles {
    /// [`Profiles::add`], to a row each.
    #[inline(always)]
    fn add_to_eight<S: Simd>(
        &self,
        mode: usize,
        cos_theta_d: f32x8<S>,
        factor: f32x8<S>,
        halves: &mut [[Row; LANES]],
    ) {
        let simd = factor.token();
        let at = cos_theta_d * ((1.0 + GRAZING) * LAST_NODE) / (cos_theta_d + GRAZING);
        let (first, fraction) = cells(clamp(at, 0.0, LAST_NODE), LAST_NODE);
        let high = factor * fraction;
        let low: [f32; LANES] = (factor - high).into();
        let high: [f32; LANES] = high.into();
        for (ix, rows) in halves.iter_mut().enumerate() {
            let nodes = self.nodes(ix, mode);
            for (lane, row) in rows.iter_mut().enumerate() {
                let first = first[lane] as usize;
                let [below, above] = [&nodes[first], &nodes[first + 1]];
                let low = f32x8::splat(simd, low[lane]);
                let high = f32x8::splat(simd, high[lane]);
                let eights = row.as_chunks_mut().0.iter_mut();
                let of_nodes = below.as_chunks().0.iter().zip(above.as_chunks().0);
                for (eight, (below, above)) in eights.zip(of_nodes) {
                    let eight: &mut [f32; LANES] = eight;
                    let sum = f32x8::load_array_ref(simd, eight);
                    let sum = mul_add(low, f32x8::load_array_ref(simd, below), sum);
                    mul_add(high, f32x8::load_array_ref(simd, above), sum).store_array(eight);
                }
            }
        }
    }
}

/// [`Source::direct_row`] of eight pairs of inclinations.
#[inline(always)]
fn eight_direct_rows<S: Simd>(
    lambda: f32,
    theta_j: f32x8<S>,
    theta_o: f32x8<S>,
    averages: &[AverageTexel],
) -> [DirectRow; LANES] {
    let simd = theta_j.token();
    let found = direct_local_scattering(theta_j, theta_o, lambda, MATCHED_COSINE, averages);
    let [r, g, b] = found.whole;
    let share = found.within / (r + g + b).max(1e-30);
    let kappa = cos(theta_j).max(0.0) * (2.0 / (lambda * lambda));
    let of_mean = cos(clamp(found.mean, -FRAC_PI_2, FRAC_PI_2)).max(0.0);
    let is_matched = share.simd_lt(ALL);
    let cosine = is_matched.select(cosine_of_share(kappa, share), of_mean);
    let zero = f32x8::splat(simd, 0.0);
    let columns = transpose([r, g, b, cosine, zero, zero, zero, zero]);
    let mut rows = [DirectRow::default(); LANES];
    for (row, column) in rows.iter_mut().zip(columns) {
        let numbers: [f32; LANES] = column.into();
        row.copy_from_slice(&numbers[..4]);
    }
    rows
}

/// [`super::fill::cosine_of_share`].
#[inline(always)]
fn cosine_of_share<S: Simd>(kappa: f32x8<S>, share: f32x8<S>) -> f32x8<S> {
    let simd = kappa.token();
    let matched = f32x8::splat(simd, MATCHED_COSINE);
    let mut low = f32x8::splat(simd, 0.0);
    let mut high = f32x8::splat(simd, 1.0);
    for _ in 0..N_BISECTIONS {
        let middle = (low + high) * 0.5;
        let is_below = half_circle(kappa * middle, matched).simd_lt(share);
        low = is_below.select(middle, low);
        high = is_below.select(high, middle);
    }
    (low + high) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{self, TERM_GLOBAL, TERM_LOCAL, pack_averages};
    use crate::dual_scattering::AverageTable;
    use crate::fresnel::Fresnel;
    use crate::jobs::in_turn;
    use crate::multiple_tables::fill::each_row;
    use crate::multiple_tables::{NODES, Plan};
    use crate::random::SplitMix64;
    use crate::wide::fixture::{Fixture, params};
    use crate::wide::levels;

    /// How far rows are from those that are found one by one, over the largest number of their column.
    fn worst<const N: usize>(found: &[[f32; N]], one_by_one: &[[f32; N]]) -> f32 {
        let mut worst = 0.0f32;
        for column in 0..N {
            let of = |row: &[f32; N]| row[column];
            let sizes = one_by_one.iter().map(|row| of(row).abs());
            let largest = sizes.fold(1e-30, f32::max);
            for (found, one) in found.iter().zip(one_by_one) {
                assert!(of(found).is_finite());
                worst = worst.max((of(found) - of(one)).abs() / largest);
            }
        }
        worst
    }

    /// Inclinations are rounded to 1e-7, which narrow light tells.
    fn tolerance(width: f32) -> f32 {
        2e-5 + 1e-7 / width
    }

    fn check_rows(source: &Source, level: Level, axes: &Axes, name: &str) {
        for layer in 0..axes.count[0] {
            let width = axes.width_of(layer);
            let n_halves = source.profiles.map_or(1, Profiles::n_halves);
            let mut rows = vec![[Row::default(); 2]; axes.layer()];
            each_row(axes, width, &mut rows, |j, o| source.row(width, j, o));
            let mut found = [0, 1].map(|half| match half < n_halves {
                true => vec![Row::default(); axes.layer()],
                false => Vec::new(),
            });
            let halves = found.each_mut().map(|rows| &mut rows[..]);
            source.rows_of_layer(level, axes, width, halves);
            for (half, found) in found.iter().enumerate().take(n_halves) {
                let rows: Vec<Row> = rows.iter().map(|halves| halves[half]).collect();
                let worst = worst(found, &rows);
                let name = format!("{name}, width {width}, half {half}");
                assert!(worst < tolerance(width), "{name}: {worst}");
            }
        }
    }

    fn check_direct_rows(source: &Source, level: Level, axes: &Axes, name: &str) {
        for layer in 0..axes.count[0] {
            let width = axes.width_of(layer);
            let mut rows = vec![DirectRow::default(); axes.layer()];
            let mut found = rows.clone();
            each_row(axes, width, &mut rows, |j, o| {
                source.direct_row(width, j, o)
            });
            source.direct_rows_of_layer(level, axes, width, &mut found);
            let rgb = |row: &DirectRow| [row[0], row[1], row[2]];
            let of_eight: Vec<[f32; 3]> = found.iter().map(rgb).collect();
            let of_one: Vec<[f32; 3]> = rows.iter().map(rgb).collect();
            let worst = worst(&of_eight, &of_one);
            assert!(worst < tolerance(width), "{name}, width {width}: {worst}");
            // Halvings may end beside each other; and where any sharpness does, cosines may be any. A share of
            // just about ALL may be taken for more or less.
            let mut n_others = 0;
            for (at, (found, one)) in found.iter().zip(&rows).enumerate() {
                let theta_j = axes.inclinations_of(width, at)[0];
                let kappa = 2.0 * theta_j.cos() / (width * width);
                let share =
                    |row: &DirectRow| closed_form::half_circle(kappa * row[3], MATCHED_COSINE);
                let is_beside = (found[3] - one[3]).abs() < 1.1 / (1 << N_BISECTIONS) as f32;
                let off = (share(found) - share(one)).abs();
                assert!(is_beside || off < 2e-3, "{name}: {found:?} {one:?}");
                n_others += usize::from(!is_beside && off > 1e-4);
            }
            let n = rows.len();
            assert!(
                n_others < n / 500,
                "{name}, width {width}: {n_others} of {n}"
            );
        }
    }

    #[test]
    fn eight_rows_are_as_one_by_one() {
        let fixture = Fixture::new();
        // All terms once where vectors are arrays, which takes long.
        let n = if cfg!(feature = "fallback") { 3 } else { 8 };
        for ix in 0..n {
            // One of three with global scattering is elliptic.
            let hair = params(&mut SplitMix64::of_item(5, ix), ix % 6 == 1);
            let averages = pack_averages(&AverageTable::new(&hair, Fresnel::Dielectric));
            let of_fibre = fixture.hair_of(&hair);
            let shading = of_fibre.shading(&fixture);
            let terms = [TERM_GLOBAL | TERM_LOCAL, TERM_GLOBAL, TERM_LOCAL][ix as usize % 3];
            let plan = Plan::new(&NODES, (&shading, &averages[..], terms), in_turn);
            let has_local = terms & TERM_LOCAL != 0;
            let source = Source {
                fibre: shading.fibre,
                profiles: plan.profiles.as_ref(),
                averages: has_local.then_some(&averages),
            };
            for (level_name, level) in levels() {
                let name = format!("{ix}, {level_name}");
                check_rows(&source, level, &plan.axes, &name);
                if has_local {
                    check_direct_rows(&source, level, &plan.direct_axes, &name);
                }
            }
        }
    }
}
