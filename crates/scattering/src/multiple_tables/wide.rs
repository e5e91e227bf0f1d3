//! Look-ups for eight lights at a time, one view.
//!
//! Places of all lights at once; then, light by light, eight rows of the table, each two vectors; then
//! columns instead of rows, and azimuth for all lights at once again. 1e-5 of the scalar look-ups, tested.

use core::f32::consts::PI;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

use crate::closed_form::DirectionInFrame;
use crate::wide::LANES;
use crate::wide::half_circle::half_circle;
use crate::wide::math::{clamp, mul_add, polynomial};
use crate::wide::rows::transpose;

use super::axes::{Axes, LEAST_DIFFERENCE, SUM_MIDDLE};
use super::azimuth::Row;
use super::elliptic::{self, EllipticFunctions};
use super::lag::{LagFunctions, N_FUNCTIONS, N_HARMONICS};
use super::{ARC_COSINE, MultipleTables};

/// Azimuths of eight lights and a view: eight of [`super::Azimuths`].
#[derive(Clone, Copy, Debug)]
pub struct AzimuthsOfLights<S: Simd> {
    /// As there.
    pub cos_delta: f32x8<S>,
    /// As there.
    pub sin_delta: f32x8<S>,
    /// As there.
    pub cos_view: f32,
    /// As there.
    pub sin_view: f32,
}

impl<S: Simd> AzimuthsOfLights<S> {
    /// Those of lights whose azimuths have these cosines and sines.
    #[inline(always)]
    pub fn between([cos_phi, sin_phi]: [f32x8<S>; 2], view: &DirectionInFrame) -> Self {
        let cos_delta = cos_phi * view.cos_phi + sin_phi * view.sin_phi;
        AzimuthsOfLights {
            cos_delta: cos_delta.min(1.0).max(-1.0),
            sin_delta: sin_phi * view.cos_phi - cos_phi * view.sin_phi,
            cos_view: 1.0 - 2.0 * view.sin_phi * view.sin_phi,
            sin_view: 2.0 * view.sin_phi * view.cos_phi,
        }
    }
}

/// Up to eight lights in the frame of a point, and the view there.
#[derive(Clone, Copy, Debug)]
pub struct SeenLights<S: Simd> {
    /// Inclinations of the lights, radians.
    pub theta: f32x8<S>,
    /// Their cosines.
    pub cos_theta: f32x8<S>,
    /// How many of the eight there are; what is found of the others is of no use.
    pub n: usize,
    /// Azimuths.
    pub azimuths: AzimuthsOfLights<S>,
    /// Inclination of the view.
    pub theta_o: f32,
}

/// Cells of eight lights.
struct Places<S: Simd> {
    row: [i32; LANES],
    fraction: [f32x8<S>; 3],
}

impl Axes {
    /// [`Axes::place`].
    #[inline(always)]
    fn places<S: Simd>(&self, width: f32x8<S>, theta_j: f32x8<S>, theta_o: f32) -> Places<S> {
        let one = f32x8::splat(width.token(), 1.0);
        let (sum, difference) = (theta_j + theta_o, theta_j - theta_o);
        let size = sum.abs();
        let middle = (width * width + self.ridge_2).sqrt().sqrt() * SUM_MIDDLE;
        let p = sum * (middle * (1.0 / PI) + 1.0) / (middle + size);
        let most = (-size + PI).max(LEAST_DIFFERENCE);
        let rest = (one - difference.abs() / most).max(0.0);
        let q = (one - rest.sqrt()).copysign(difference);
        let half = self.count.map(|count| 0.5 * (count - 1) as f32);
        let along = [
            (width / (width + self.middle) - self.first) * self.scale,
            p * half[1] + half[1],
            q * half[2] + half[2],
        ];
        let mut fraction = along;
        let mut row = i32x8::splat(width.token(), 0);
        for (axis, count) in self.count.into_iter().enumerate() {
            let last = count as i32 - 1;
            let at = clamp(along[axis], 0.0, last as f32);
            let first = at.to_int::<i32x8<S>>().min(last - 1);
            fraction[axis] = at - first.to_float::<f32x8<S>>();
            row = row * count as i32 + first;
        }
        Places {
            row: row.into(),
            fraction,
        }
    }
}

/// [`super::arc_cosine`].
#[inline(always)]
fn arc_cosine<S: Simd>(x: f32x8<S>) -> f32x8<S> {
    let a = x.abs().min(1.0);
    let near = (-a + 1.0).sqrt() * polynomial(a, ARC_COSINE);
    x.simd_lt(0.0).select(-near + PI, near)
}

impl LagFunctions {
    /// [`LagFunctions::at`], without the constant.
    #[inline(always)]
    fn at_lights<S: Simd>(&self, cosine: f32x8<S>) -> [f32x8<S>; N_FUNCTIONS] {
        let simd = cosine.token();
        let twice = cosine * cosine * 4.0 - 2.0;
        let mut functions = [cosine; N_FUNCTIONS];
        for (f, function) in functions.iter_mut().enumerate() {
            let mut sums = [f32x8::splat(simd, 0.0); 2];
            for row in self.0[1..].iter().rev() {
                let factor = f32x8::splat(simd, row[f + 1]);
                sums = [mul_add(twice, sums[0], factor - sums[1]), sums[0]];
            }
            let factor = f32x8::splat(simd, self.0[0][f + 1]);
            *function = cosine * mul_add(twice - 1.0, sums[0], factor - sums[1]);
        }
        functions
    }
}

impl EllipticFunctions {
    /// [`EllipticFunctions::at`].
    #[inline(always)]
    fn at_lights<S: Simd>(
        &self,
        azimuths: &AzimuthsOfLights<S>,
    ) -> [f32x8<S>; elliptic::N_FUNCTIONS] {
        let AzimuthsOfLights {
            cos_delta: cos,
            sin_delta: sin,
            cos_view,
            sin_view,
        } = *azimuths;
        let simd = cos.token();
        let seen = self.seen_from(cos_view, sin_view);
        let mut functions = [cos; elliptic::N_FUNCTIONS];
        for (function, constant) in functions.iter_mut().zip(seen[0]) {
            *function = f32x8::splat(simd, constant);
        }
        let cos_2 = -(sin * sin * 2.0) + 1.0;
        let sin_2 = sin * cos * 2.0;
        let (mut cos_k, mut sin_k) = (cos, sin);
        for k in 0..N_HARMONICS {
            let (cosines, sines) = (&seen[1 + k], &seen[1 + N_HARMONICS + k]);
            for (f, function) in functions.iter_mut().enumerate() {
                let of_cosine = mul_add(f32x8::splat(simd, cosines[f]), cos_k, *function);
                *function = mul_add(f32x8::splat(simd, sines[f]), sin_k, of_cosine);
            }
            (cos_k, sin_k) = (cos_k * cos_2 - sin_k * sin_2, sin_k * cos_2 + cos_k * sin_2);
        }
        functions
    }
}

/// Where lights stand in tables of global and local scattering: tables that have the same axes share it.
#[derive(Clone, Copy)]
pub(super) struct Cells<S: Simd> {
    /// Rows at the lowest corners.
    row: [i32; LANES],
    /// Of the eight corners.
    weights: [[f32; LANES]; 8],
    /// How far half circles about light and view overlap.
    overlap: f32x8<S>,
    /// How many of the eight lights there are.
    n: usize,
}

impl<S: Simd> Cells<S> {
    /// In tables with these `axes`.
    #[inline(always)]
    pub fn new(axes: &Axes, seen: &SeenLights<S>, sigma_f: f32x8<S>) -> Cells<S> {
        let Places { row, fraction } = axes.places(sigma_f, seen.theta, seen.theta_o);
        let [w, p, q] = fraction;
        let of_corners = {
            let (w_q, p_q) = (w * q, p * q);
            let (upper, lower) = (w * p, p - w * p);
            let (upper_q, lower_q) = (upper * q, p_q - upper * q);
            let (front, front_q) = (w - upper, w_q - upper_q);
            let rest = -(w + lower) + 1.0;
            let rest_q = q - (w_q + lower_q);
            [
                rest - rest_q,
                rest_q,
                lower - lower_q,
                lower_q,
                front - front_q,
                front_q,
                upper - upper_q,
                upper_q,
            ]
        };
        let mut weights = [[0.0; LANES]; 8];
        for (weights, of_corner) in weights.iter_mut().zip(of_corners) {
            of_corner.store_array(weights);
        }
        Cells {
            row,
            weights,
            overlap: -arc_cosine(seen.azimuths.cos_delta) + PI,
            n: seen.n.min(LANES),
        }
    }
}

impl MultipleTables {
    /// [`MultipleTables::at`] of eight lights.
    #[inline(always)]
    pub fn at_lights<S: Simd>(
        &self,
        seen: &SeenLights<S>,
        sigma_f: f32x8<S>,
    ) -> ([f32x8<S>; 3], [f32x8<S>; 3]) {
        let cells = Cells::new(&self.axes, seen, sigma_f);
        self.in_cells(&cells, &seen.azimuths)
    }

    /// The same where they stand in cells of these axes.
    #[inline(always)]
    pub(super) fn in_cells<S: Simd>(
        &self,
        cells: &Cells<S>,
        azimuths: &AzimuthsOfLights<S>,
    ) -> ([f32x8<S>; 3], [f32x8<S>; 3]) {
        let simd = azimuths.cos_delta.token();
        let zero = f32x8::splat(simd, 0.0);
        let [rows, further] = &self.rows;
        if rows.is_empty() {
            return ([zero; 3], [zero; 3]);
        }
        let [low, high] = self.columns(rows, cells);
        let mut global = [zero; 3];
        match &self.elliptic {
            None => {
                let functions = self.functions.at_lights(azimuths.cos_delta);
                for (channel, global) in global.iter_mut().enumerate() {
                    let mut sum = low[channel];
                    sum = mul_add(functions[0], low[4 + channel], sum);
                    sum = mul_add(functions[1], high[channel], sum);
                    *global = mul_add(functions[2], high[4 + channel], sum);
                }
            }
            Some(functions) => {
                let functions = functions.at_lights(azimuths);
                let [low_2, high_2] = self.columns(further, cells);
                for (channel, global) in global.iter_mut().enumerate() {
                    let mut sum = low[channel];
                    sum = mul_add(functions[1], low[4 + channel], sum);
                    sum = mul_add(functions[2], high[channel], sum);
                    sum = mul_add(functions[3], high[4 + channel], sum);
                    sum = mul_add(functions[4], low_2[channel], sum);
                    sum = mul_add(functions[5], low_2[4 + channel], sum);
                    sum = mul_add(functions[6], high_2[channel], sum);
                    *global = mul_add(functions[7], high_2[4 + channel], sum);
                }
            }
        }
        for global in &mut global {
            *global = global.max(0.0);
        }
        let mut local = [low[3], low[7], high[3]];
        for local in &mut local {
            *local = cells.overlap * local.max(0.0);
        }
        (global, local)
    }

    /// The numbers of `rows` in the cells, the first eight and the others.
    #[inline(always)]
    fn columns<S: Simd>(&self, rows: &[Row], cells: &Cells<S>) -> [[f32x8<S>; LANES]; 2] {
        let simd = cells.overlap.token();
        let zero = f32x8::splat(simd, 0.0);
        let (layer, line) = (self.axes.layer(), self.axes.count[2]);
        let (mut low, mut high) = ([zero; LANES], [zero; LANES]);
        for lane in 0..cells.n {
            let first = cells.row[lane] as usize;
            let rows = &rows[first..first + layer + line + 2];
            let corners = [
                0,
                1,
                line,
                line + 1,
                layer,
                layer + 1,
                layer + line,
                layer + line + 1,
            ];
            for (at, weights) in corners.into_iter().zip(&cells.weights) {
                let weight = f32x8::splat(simd, weights[lane]);
                let [below, above] = rows[at].as_chunks().0 else {
                    continue;
                };
                low[lane] = mul_add(weight, f32x8::simd_from(simd, *below), low[lane]);
                high[lane] = mul_add(weight, f32x8::simd_from(simd, *above), high[lane]);
            }
        }
        [transpose(low), transpose(high)]
    }

    /// [`MultipleTables::direct_at`] of eight lights.
    #[inline(always)]
    pub fn direct_at_lights<S: Simd>(
        &self,
        seen: &SeenLights<S>,
        lambda: f32x8<S>,
    ) -> [f32x8<S>; 3] {
        let simd = lambda.token();
        let zero = f32x8::splat(simd, 0.0);
        if self.direct.is_empty() {
            return [zero; 3];
        }
        let (layer, line) = (self.direct_axes.layer(), self.direct_axes.count[2]);
        let places = (self.direct_axes).places(lambda, seen.theta, seen.theta_o);
        let [w, p, q] = places.fraction;
        let upper = w * p;
        let (lower, front) = (p - upper, w - upper);
        let of_corners = [-(w + lower) + 1.0, lower, front, upper];
        let mut weights = [[0.0; LANES]; 4];
        for (weights, of_corner) in weights.iter_mut().zip(of_corners) {
            of_corner.store_array(weights);
        }
        // Two neighbouring rows are one vector.
        let mut pairs = [zero; LANES];
        for (lane, pair) in pairs.iter_mut().enumerate().take(seen.n) {
            let first = places.row[lane] as usize;
            let rows = self.direct[first..first + layer + line + 2].as_flattened();
            for (corner, at) in [0, line, layer, layer + line].into_iter().enumerate() {
                let numbers: &[f32; LANES] = rows[4 * at..4 * at + LANES]
                    .as_array()
                    .expect("as long as it says");
                let weight = f32x8::splat(simd, weights[corner][lane]);
                *pair = mul_add(weight, f32x8::simd_from(simd, *numbers), *pair);
            }
        }
        let columns = transpose(pairs);
        let mut between = [zero; 4];
        for (k, between) in between.iter_mut().enumerate() {
            *between = mul_add(q, columns[k + 4] - columns[k], columns[k]).max(0.0);
        }
        let [r, g, b, cosine] = between;
        let kappa = seen.cos_theta * cosine * 2.0 / (lambda * lambda);
        let share = half_circle(kappa, seen.azimuths.cos_delta);
        [share * r, share * g, share * b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multiple_tables::Azimuths;
    use crate::random::SplitMix64;
    use crate::wide::{Level, dispatch, levels};

    /// Tables of smooth numbers.
    fn tables(is_elliptic: bool) -> MultipleTables {
        let axes = Axes::new([5, 7, 9], [0.1, 10.0], 0.0, 0.1);
        let direct_axes = Axes::new([4, 9, 7], [0.001, 10.0], 0.5, 0.4);
        let number = |ix: usize, k: usize| (0.03 * (ix * 16 + 5 * k) as f32).sin().abs();
        let rows = |first: usize| -> Vec<Row> {
            let row = |ix| std::array::from_fn(|k| number(ix, first + k));
            (0..axes.n_rows()).map(row).collect()
        };
        let direct = (0..direct_axes.n_rows()).map(|ix| std::array::from_fn(|k| number(ix, k)));
        let factors = std::array::from_fn(|k| [0.0, 0.7, 0.2, -0.5].map(|f| f / (k + 1) as f32));
        let vectors: [_; elliptic::N_FUNCTIONS - 1] = std::array::from_fn(|f| {
            std::array::from_fn(|part| f64::from(number(part, f)) / (part + 1) as f64)
        });
        MultipleTables {
            terms: 0,
            functions: LagFunctions(factors),
            elliptic: is_elliptic.then(|| Box::new(EllipticFunctions::new(&vectors))),
            rows: [rows(0), if is_elliptic { rows(7) } else { Vec::new() }],
            axes,
            direct_axes,
            direct: direct.collect(),
        }
    }

    fn check(tables: &MultipleTables, name: &str, level: Level) {
        let mut worst = 0.0f32;
        for ix in 0..400 {
            let mut random = SplitMix64::of_item(2, ix);
            let mut eight = |low, high| -> [f32; LANES] {
                std::array::from_fn(|_| random.uniform(low, high) as f32)
            };
            let theta_j = eight(-1.57, 1.57);
            let phi_j = eight(-3.0, 3.0);
            let width = eight(-4.0, 2.0).map(f32::exp);
            let [theta_o, phi_o, ..] = eight(-1.57, 1.57);
            let cos_j = theta_j.map(f32::cos);
            let view = DirectionInFrame::from_angles(theta_o, 2.0 * phi_o);
            let [cos_phi, sin_phi] = [phi_j.map(f32::cos), phi_j.map(f32::sin)];
            let found: [[[f32; LANES]; 3]; 3] = dispatch!(level, simd => {
                let [t, ct, w, c, s] = [theta_j, cos_j, width, cos_phi, sin_phi]
                    .map(|x| f32x8::simd_from(simd, x));
                let seen = SeenLights {
                    theta: t,
                    cos_theta: ct,
                    n: LANES,
                    azimuths: AzimuthsOfLights::between([c, s], &view),
                    theta_o,
                };
                let (global, local) = tables.at_lights(&seen, w);
                let direct = tables.direct_at_lights(&seen, w);
                [global, local, direct].map(|rgb| rgb.map(Into::into))
            });
            for lane in 0..LANES {
                let (t, w) = (theta_j[lane], width[lane]);
                let light = DirectionInFrame::from_angles(t, phi_j[lane]);
                let azimuths = Azimuths::between(&light, &view);
                let (global, local) = tables.at(t, theta_o, &azimuths, w);
                let direct = tables.direct_at(t, cos_j[lane], theta_o, azimuths.cos_delta, w);
                for (found, one) in found.iter().zip([global, local, direct]) {
                    for (found, one) in found.iter().zip(one) {
                        worst = worst.max((found[lane] - one).abs() / (1.0 + one));
                    }
                }
            }
        }
        assert!(worst < 2e-5 && worst > 0.0, "{name}: {worst}");
    }

    #[test]
    fn eight_lights_are_as_one_by_one() {
        for is_elliptic in [false, true] {
            let tables = tables(is_elliptic);
            for (name, level) in levels() {
                check(&tables, &format!("{name}, elliptic: {is_elliptic}"), level);
            }
        }
    }
}
