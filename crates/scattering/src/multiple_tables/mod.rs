//! Multiple scattering by tables, made at each edit of a fibre.
//!
//! [`MultipleTables`] stand for [`global_scattering`], [`local_scattering`] and
//! [`direct_local_scattering`] of one fibre: they hold what does not depend on azimuth over the width of
//! the light and both inclinations, and a look-up costs a twentieth of the closed form or less.
//! They depend on the fibre alone, not on lights or view.
//!
//! - Global scattering is a constant and three functions of the lag Delta = phi_j - phi_o, found for each
//!   fibre; of an elliptic one a constant and seven functions of the lag and phi_o.
//! - Local scattering is proportional to the overlap pi - Delta of two half circles, exactly.
//! - Direct local scattering is the share of a circular Gaussian within a half circle, at one sharpness
//!   where the closed form has one at each of its nodes.
//!
//! Relative RMSE against the closed form over lights and views even over the sphere, every width, 50 fibres
//! of Marschner's ranges and any absorption: global 0.21 %, local 0.19 %, direct local 0.32 %; of the worst
//! of these fibres 0.4, 0.4 and 1.0 %; TRT alone 1.0 %. Global scattering of 30 elliptic fibres, a in 0.8..1.25, 0.25 %, of
//! the worst 0.4 %; of TRT alone, in which the closed form errs by 2.6 % itself, 3.1 and 19 %. `crates/scene/tests/multiple_tables.rs` has them, and
//! `crates/scene/examples/multiple_tables.rs` what filling and look-ups cost.
//!
//! A GPU fills and reads the same tables: [`MultipleSource`] is what it takes.
//!
//! [`PaintedTables`] serve painted points that differ from the scene's fibre in absorption alone. Other painted points
//! keep the closed form: [`MultipleTables::terms`] says what the tables serve.
//!
//! [`global_scattering`]: crate::closed_form::global_scattering()
//! [`local_scattering`]: crate::closed_form::local_scattering()
//! [`direct_local_scattering`]: crate::closed_form::direct_local_scattering()

mod axes;
mod azimuth;
mod elliptic;
mod fill;
mod fill_wide;
mod lag;
mod leading;
mod painted;
mod painted_wide;
mod source;
mod wide;

use core::f32::consts::PI;

use crate::closed_form::{
    ALL_MODES, AverageTexel, DirectionInFrame, Fibre, SampleLobes, Shading, TERM_GLOBAL,
    TERM_LOCAL, half_circle, sample_averages,
};
use crate::dual_scattering::N_INCLINATIONS;
use crate::jobs::Job;

use axes::Axes;
use azimuth::{Profiles, Row};
use elliptic::EllipticFunctions;
use fill::{DirectRow, Source};
use lag::LagFunctions;
pub use painted::{
    N_PACKS, PackPlace, Packs, PaintedPlaces, PaintedTables, packs_of, painted_forward_table,
};
pub(crate) use source::LAYOUTS;
pub use source::{MultipleAxes, MultipleLayout, MultipleSource};
pub use wide::{AzimuthsOfLights, SeenLights};

/// How many nodes tables have.
struct Nodes {
    /// Over the width of forward-scattered light.
    widths: usize,
    /// Over the width of light that comes straight, which is any.
    direct_widths: usize,
    /// Least and most over sum and difference of the inclinations each.
    inclined: [f32; 2],
}

/// Of tables of one fibre.
const NODES: Nodes = Nodes {
    widths: 14,
    direct_widths: 16,
    inclined: [41.0, 65.0],
};

/// Width of a ridge for which the least do; for others their number goes with the root of the width.
const RIDGE: f32 = 0.17;

/// Widths that the closed form takes.
const WIDTHS: [f32; 2] = [0.001, 10.0];

/// Half of the nodes of direct local scattering stand below this width of the light.
const DIRECT_MIDDLE: f32 = 0.5;

/// Global, local and direct local scattering of one fibre.
#[derive(Clone, Debug, PartialEq)]
pub struct MultipleTables {
    terms: u32,
    axes: Axes,
    functions: LagFunctions,
    /// Of an elliptic fibre, in place of those of the lag.
    elliptic: Option<Box<EllipticFunctions>>,
    /// Second halves are of elliptic fibres alone.
    rows: [Vec<Row>; 2],
    direct_axes: Axes,
    direct: Vec<DirectRow>,
}

/// Azimuths of a light and the view. A round fibre looks at `cos_delta` alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Azimuths {
    /// Cosine of Delta = phi_j - phi_o, from the view to the light.
    pub cos_delta: f32,
    /// Its sine.
    pub sin_delta: f32,
    /// cos(2 phi_o).
    pub cos_view: f32,
    /// sin(2 phi_o).
    pub sin_view: f32,
}

impl Azimuths {
    /// Those of a light from this direction.
    pub fn between(light: &DirectionInFrame, view: &DirectionInFrame) -> Azimuths {
        let cos_delta = view.cos_phi * light.cos_phi + view.sin_phi * light.sin_phi;
        let sin_delta = view.cos_phi * light.sin_phi - view.sin_phi * light.cos_phi;
        Azimuths {
            cos_delta: cos_delta.clamp(-1.0, 1.0),
            sin_delta,
            cos_view: 1.0 - 2.0 * view.sin_phi * view.sin_phi,
            sin_view: 2.0 * view.sin_phi * view.cos_phi,
        }
    }
}

impl MultipleTables {
    /// Tables for `terms`, a sum of [`TERM_GLOBAL`] and [`TERM_LOCAL`], other bits being ignored. `averages`
    /// are those of the fibre. `run` has to run all jobs, in any order, on as many threads as it likes;
    /// the tables are the same to the bit.
    pub fn new(
        shading: &Shading<impl SampleLobes + Sync>,
        averages: &[AverageTexel],
        terms: u32,
        run: impl Fn(Vec<Job>),
    ) -> MultipleTables {
        let of = (shading, averages, terms);
        MultipleTables::with_nodes(&NODES, of, run)
    }

    /// The same at these nodes.
    fn with_nodes(
        nodes: &Nodes,
        (shading, averages, terms): (&Shading<impl SampleLobes + Sync>, &[AverageTexel], u32),
        run: impl Fn(Vec<Job>),
    ) -> MultipleTables {
        let plan = Plan::new(nodes, (shading, averages, terms), &run);
        let mut filling = Filling::of(plan);
        filling.fill(shading.fibre, averages, usize::MAX, run);
        filling.finish()
    }

    /// The terms that they serve, a sum of [`TERM_GLOBAL`] and [`TERM_LOCAL`].
    pub fn terms(&self) -> u32 {
        self.terms
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        let of_rows = self.rows.iter().map(|rows| size_of_val(&rows[..]));
        of_rows.sum::<usize>() + size_of_val(&self.direct[..])
    }

    /// M^G and M^L, linear RGB, >= 0, of light of width `sigma_f` at inclination `theta_j` seen from
    /// `theta_o`. A term that is not among
    /// [`MultipleTables::terms`] is 0. Widths below the least that one forward scattering makes of a light
    /// count as that, widths above 10 as 10.
    #[inline]
    pub fn at(
        &self,
        theta_j: f32,
        theta_o: f32,
        azimuths: &Azimuths,
        sigma_f: f32,
    ) -> ([f32; 3], [f32; 3]) {
        let [rows, further] = &self.rows;
        if rows.is_empty() {
            return ([0.0; 3], [0.0; 3]);
        }
        let Azimuths {
            cos_delta,
            sin_delta,
            cos_view,
            sin_view,
        } = *azimuths;
        let place = self.axes.place(sigma_f, theta_j, theta_o);
        let row = mix(rows, &self.axes, place);
        let mut sum = [row[0], row[1], row[2]];
        let mut add = |row: &Row, first: usize, factors: &[f32]| {
            for (k, factor) in factors.iter().enumerate().skip(first) {
                for channel in 0..3 {
                    sum[channel] += factor * row[4 * k + channel];
                }
            }
        };
        match &self.elliptic {
            None => add(&row, 1, &self.functions.at(cos_delta)),
            Some(functions) => {
                let functions = functions.at([cos_delta, sin_delta], [cos_view, sin_view]);
                add(&row, 1, &functions[..4]);
                add(&mix(further, &self.axes, place), 0, &functions[4..]);
            }
        }
        let overlap = PI - arc_cosine(cos_delta);
        let local = [3, 7, 11].map(|ix| overlap * row[ix].max(0.0));
        (sum.map(|value| value.max(0.0)), local)
    }

    /// M^{L,dir}, as [`MultipleTables::at`], of a light of width `lambda` whose inclination has this
    /// cosine; `cos_delta` is that of [`Azimuths`].
    #[inline]
    pub fn direct_at(
        &self,
        theta_j: f32,
        cos_theta_j: f32,
        theta_o: f32,
        cos_delta: f32,
        lambda: f32,
    ) -> [f32; 3] {
        if self.direct.is_empty() {
            return [0.0; 3];
        }
        let place = self.direct_axes.place(lambda, theta_j, theta_o);
        let [r, g, b, cosine] = mix(&self.direct, &self.direct_axes, place);
        let kappa = 2.0 * cos_theta_j * cosine.max(0.0) / (lambda * lambda);
        let share = half_circle(kappa, cos_delta);
        [r, g, b].map(|value| share * value.max(0.0))
    }
}

/// Tables that are being filled, some widths at a time.
pub struct Filling {
    plan: Plan,
    rows: [Vec<Row>; 2],
    direct: Vec<DirectRow>,
    /// Widths of both that are filled.
    n_done: usize,
}

impl Filling {
    /// Of [`MultipleTables::new`], with no row yet.
    pub fn new(
        shading: &Shading<impl SampleLobes + Sync>,
        averages: &[AverageTexel],
        terms: u32,
        run: impl FnOnce(Vec<Job>),
    ) -> Filling {
        Filling::of(Plan::new(&NODES, (shading, averages, terms), run))
    }

    fn of(plan: Plan) -> Filling {
        let n_rows = |axes: &Axes, is_needed: bool| if is_needed { axes.n_rows() } else { 0 };
        let has_local = plan.terms & TERM_LOCAL != 0;
        let rows = |is_needed| vec![Row::default(); n_rows(&plan.axes, is_needed)];
        Filling {
            rows: [rows(plan.terms != 0), rows(plan.is_elliptic())],
            direct: vec![DirectRow::default(); n_rows(&plan.direct_axes, has_local)],
            n_done: 0,
            plan,
        }
    }

    /// Fills the rows of at most `most` further widths, for the fibre that [`Filling::new`] was given; answers whether
    /// all are filled.
    pub fn fill(
        &mut self,
        fibre: &Fibre,
        averages: &[AverageTexel],
        most: usize,
        run: impl FnOnce(Vec<Job>),
    ) -> bool {
        let source = &Source {
            fibre,
            profiles: self.plan.profiles.as_ref(),
            averages: (self.plan.terms & TERM_LOCAL != 0).then_some(averages),
        };
        let (axes, direct_axes) = (&self.plan.axes, &self.plan.direct_axes);
        let [rows, further] = &mut self.rows;
        let mut further = further.chunks_exact_mut(axes.layer());
        let mut jobs = jobs_of(axes, rows, move |_| {
            let further = further.next().unwrap_or_default();
            move |width, rows: &mut [Row]| source.fill_layer(axes, width, [rows, further])
        });
        jobs.extend(jobs_of(direct_axes, &mut self.direct, |_| {
            |width, rows: &mut [DirectRow]| source.fill_direct_layer(direct_axes, width, rows)
        }));
        let n = jobs.len();
        run(jobs.into_iter().skip(self.n_done).take(most).collect());
        self.n_done = self.n_done.saturating_add(most).min(n);
        self.n_done == n
    }

    /// The tables.
    pub fn finish(mut self) -> MultipleTables {
        let plan = self.plan;
        for rows in self.rows.iter_mut().filter(|rows| !rows.is_empty()) {
            plan.axes.balance(rows);
        }
        plan.direct_axes.balance(&mut self.direct);
        let functions = plan
            .profiles
            .map(|profiles| (profiles.functions, profiles.elliptic));
        let (functions, elliptic) = functions.unwrap_or_default();
        MultipleTables {
            terms: plan.terms,
            axes: plan.axes,
            functions,
            elliptic,
            rows: self.rows,
            direct_axes: plan.direct_axes,
            direct: self.direct,
        }
    }
}

/// What is known of tables before their rows are.
struct Plan {
    /// As [`MultipleTables::terms`].
    terms: u32,
    axes: Axes,
    direct_axes: Axes,
    /// For global scattering.
    profiles: Option<Profiles>,
}

impl Plan {
    fn new(
        nodes: &Nodes,
        (shading, averages, terms): (&Shading<impl SampleLobes + Sync>, &[AverageTexel], u32),
        run: impl FnOnce(Vec<Job>),
    ) -> Plan {
        let fibre = shading.fibre;
        let has_averages = averages.len() >= N_INCLINATIONS;
        let has_global = terms & TERM_GLOBAL != 0 && fibre.modes & ALL_MODES != 0;
        let has_local = terms & TERM_LOCAL != 0 && has_averages;
        let least = Least::of(if has_averages { averages } else { &[] });
        let widths = (0..3).filter(|mode| fibre.modes & (1 << mode) != 0);
        let narrowest = widths.map(|mode| 2.0 * fibre.beta[mode]);
        let ridge = match has_global {
            true => narrowest.fold(f32::INFINITY, f32::min),
            false => least.sigma_b,
        };
        let n = inclined_nodes(nodes.inclined, ridge);
        let of = |has: bool, term| if has { term } else { 0 };
        Plan {
            terms: of(has_global, TERM_GLOBAL) | of(has_local, TERM_LOCAL),
            axes: Axes::new([nodes.widths, n, n], [least.beta_f, WIDTHS[1]], 0.0, ridge),
            direct_axes: Axes::new(
                [nodes.direct_widths, n, n],
                WIDTHS,
                DIRECT_MIDDLE,
                least.sigma_b,
            ),
            profiles: has_global.then(|| Profiles::new(shading, run)),
        }
    }

    /// Have rows a second half?
    fn is_elliptic(&self) -> bool {
        self.profiles
            .as_ref()
            .is_some_and(|profiles| profiles.elliptic.is_some())
    }
}

/// Nodes along either inclined axis for a ridge of this width, of the least and most of them.
fn inclined_nodes([least, most]: [f32; 2], ridge: f32) -> usize {
    let nodes = (least * (RIDGE / ridge).sqrt()).clamp(least, most);
    // Odd, so that one stands where the sum is 0.
    2 * (0.5 * nodes) as usize + 1
}

/// The rows of a table, a job each width: `fill` of a layer fills it.
fn jobs_of<'a, T: Send, F: FnOnce(f32, &mut [T]) + Send + 'a>(
    axes: &Axes,
    rows: &'a mut [T],
    mut fill: impl FnMut(usize) -> F,
) -> Vec<Job<'a>> {
    let layers = rows.chunks_exact_mut(axes.layer()).enumerate();
    let job = |(layer, rows): (usize, &'a mut [T])| {
        let (width, fill) = (axes.width_of(layer), fill(layer));
        Job::new(move || fill(width, rows))
    };
    layers.map(job).collect()
}

/// The mean of eight rows.
#[inline(always)]
fn mix<const N: usize>(rows: &[[f32; N]], axes: &Axes, place: axes::Place) -> [f32; N] {
    let [w, p, q] = place.fraction;
    let (layer, line) = (axes.layer(), axes.count[2]);
    let rows = &rows[place.row..place.row + layer + line + 2];
    let lerp = |low: &[f32; N], high: &[f32; N], f: f32| -> [f32; N] {
        std::array::from_fn(|k| low[k] + (high[k] - low[k]) * f)
    };
    let along = |at: usize| lerp(&rows[at], &rows[at + 1], q);
    let plane = |at: usize| lerp(&along(at), &along(at + line), p);
    lerp(&plane(0), &plane(layer), w)
}

/// arccos(a) over sqrt(1 - a), by rising powers of a in 0..=1.
const ARC_COSINE: [f32; 4] = [1.570_728_8, -0.212_114_4, 0.074_261, -0.018_729_3];

/// arccos, absolute error at most 7e-5 (Abramowitz and Stegun 4.4.45).
#[inline(always)]
fn arc_cosine(x: f32) -> f32 {
    let a = x.abs().min(1.0);
    let [c_0, c_1, c_2, c_3] = ARC_COSINE;
    let polynomial = c_0 + a * (c_1 + a * (c_2 + a * c_3));
    let near = (1.0 - a).sqrt() * polynomial;
    if x < 0.0 { PI - near } else { near }
}

/// The least widths of the averages.
struct Least {
    beta_f: f32,
    sigma_b: f32,
}

impl Least {
    fn of(averages: &[AverageTexel]) -> Least {
        let mut least = [WIDTHS[1]; 2];
        for ix in 0..averages.len().min(N_INCLINATIONS) {
            let theta = PI * (ix as f32 / (N_INCLINATIONS - 1) as f32 - 0.5);
            let at = sample_averages(averages, theta);
            for channel in 0..3 {
                least[0] = least[0].min(at.beta_f_2[channel].sqrt());
                least[1] = least[1].min(at.width_b_2[channel].sqrt());
            }
        }
        let [beta_f, sigma_b] = least.map(|width| width.clamp(WIDTHS[0], 0.5 * WIDTHS[1]));
        Least { beta_f, sigma_b }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_cosines_are_within_their_bound() {
        for step in -1000..=1000 {
            let x = step as f32 / 1000.0;
            assert!((arc_cosine(x) - x.acos()).abs() < 7e-5, "{x}");
        }
        assert_eq!(arc_cosine(1.000_001), 0.0);
    }
}
