//! Fitting the lobes of TT and TRT, and how well they fit.

use rayon::prelude::*;
use strandlight_formats::{Axis as FileAxis, Table};
use strandlight_scattering::Lobe;
use strandlight_scattering::axis::Axis;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::fit::{ErrorNorm, LobeShape, mixed};
use strandlight_scattering::lobes::moments::{Section, section_rule};
use strandlight_scattering::lobes::{
    FIRST_ROW, LOBE_ETA, LobeAxes, LobeRow, LobeTable, SHAPE_AXIS_NAMES, SHAPE_CHANNELS,
    SHARE_AXIS_NAMES, SHARE_CHANNELS, alpha_from_cos_theta_d, fit_shapes, fit_shares, table_names,
};

use strandlight_scattering::random::SplitMix64;
use strandlight_scene::progress::Progress;

/// Steps of progress that [`bake_lobes`] makes.
pub(super) const N_LOBE_STEPS: u64 = 4 * LOBE_ETA.count as u64;

/// The modes that have lobes.
pub(super) const MODES: [Lobe; 2] = [Lobe::Tt, Lobe::Trt];

/// Widths lambda' of the light that errors are reported for.
pub const REPORT_WIDTHS: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];
/// Random fibres a mode and width of the report.
const N_REPORT: u64 = 300;

/// Where errors of the inner integral are counted.
pub const REPORT_RANGE: &str =
    "eta 1.3..1.8, theta_d 0..1.5, sigma_a 0.01..3, w_c 0.08..0.3, between texels";

/// A fibre seen at one inclination, one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Configuration {
    pub(super) eta: f64,
    pub(super) theta_d: f64,
    pub(super) sigma_a: f64,
    pub(super) caustic_width: f64,
}

impl Configuration {
    /// Number `ix` of those that `seed` gives in [`REPORT_RANGE`], log-uniform in sigma_a.
    pub(super) fn random(seed: u64, ix: u64) -> Configuration {
        let mut random = SplitMix64::of_item(seed, ix);
        Configuration {
            eta: random.uniform(1.3, 1.8),
            theta_d: random.uniform(0.0, 1.5),
            sigma_a: random.log_uniform(0.01, 3.0),
            caustic_width: random.uniform(0.08, 0.3),
        }
    }
}

impl std::fmt::Display for Configuration {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "eta {:.3}, theta_d {:.3}, sigma_a {:.3}, w_c {:.3}",
            self.eta, self.theta_d, self.sigma_a, self.caustic_width
        )
    }
}

/// Relative RMSE over phi of the inner integral of one mode for lights of one width, over random
/// fibres.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeErrors {
    /// The mode.
    pub lobe: Lobe,
    /// Width lambda' of the light.
    pub lambda_p: f64,
    /// Half of the fibres stay below.
    pub median: f64,
    /// 95 % of the fibres stay below.
    pub p95: f64,
    /// The largest.
    pub worst: f64,
    /// The fibre with the largest.
    pub place: String,
}

/// Fits the tables of both modes. Chains of rows and then all shares run in parallel; the result
/// does not depend on the number of threads.
pub(super) fn bake_lobes(fresnel: Fresnel, progress: &Progress) -> [LobeTable; 2] {
    let axes = LobeAxes::default();
    let fit = |lobe: Lobe| {
        let shapes = all_shapes(lobe, fresnel, &axes, progress);
        let rows: Vec<LobeRow> = shapes
            .into_par_iter()
            .enumerate()
            .map(|(row, shapes)| {
                let shares = fit_shares(lobe, fresnel, &axes, row as u32, &shapes);
                progress.advance(1);
                LobeRow { shapes, shares }
            })
            .collect();
        LobeTable::from_rows(lobe, fresnel, axes, &rows)
    };
    let (tt, trt) = rayon::join(|| fit(Lobe::Tt), || fit(Lobe::Trt));
    [tt, trt]
}

/// Shapes of every row: the first row, then from neighbour to neighbour both ways at once.
fn all_shapes(
    lobe: Lobe,
    fresnel: Fresnel,
    axes: &LobeAxes,
    progress: &Progress,
) -> Vec<Vec<LobeShape>> {
    let fit = |row: u32, from: Option<&[LobeShape]>| {
        let shapes = fit_shapes(lobe, fresnel, axes, row, from);
        progress.advance(1);
        shapes
    };
    let first = fit(FIRST_ROW, None);
    let chain = |rows: &mut dyn Iterator<Item = u32>| {
        let mut from = first.clone();
        rows.map(|row| {
            from = fit(row, Some(&from));
            from.clone()
        })
        .collect::<Vec<_>>()
    };
    let (mut below, above) = rayon::join(
        || chain(&mut (0..FIRST_ROW).rev()),
        || chain(&mut (FIRST_ROW + 1..axes.eta.count)),
    );
    below.reverse();
    below.push(first.clone());
    below.extend(above);
    below
}

/// The two tables of a file for `lobes`; `error` is recorded with both.
pub(super) fn file_tables(lobes: &LobeTable, error: f64) -> [Table; 2] {
    let LobeAxes {
        eta,
        alpha,
        absorption,
    } = &lobes.axes;
    let [shapes, shares] = table_names(lobes.lobe);
    let table = |name: &str, axes: &[(&Axis, &str)], channels: &[&str], data: &[f32]| Table {
        name: name.to_owned(),
        axes: axes
            .iter()
            .map(|(axis, name)| FileAxis::new(*name, axis))
            .collect(),
        channels: channels.iter().map(|&name| name.to_owned()).collect(),
        data: data.to_vec(),
        max_interpolation_error: error as f32,
    };
    let [eta_name, alpha_name, absorption_name] = SHARE_AXIS_NAMES;
    debug_assert_eq!(SHAPE_AXIS_NAMES, [eta_name, alpha_name]);
    [
        table(
            shapes,
            &[(eta, eta_name), (alpha, alpha_name)],
            &SHAPE_CHANNELS,
            lobes.shapes.as_flattened(),
        ),
        table(
            shares,
            &[
                (eta, eta_name),
                (alpha, alpha_name),
                (absorption, absorption_name),
            ],
            &SHARE_CHANNELS,
            lobes.shares.as_flattened(),
        ),
    ]
}

/// Errors of the inner integral of `lobes` against cosine moments of the exact N_t, one entry a
/// width of [`REPORT_WIDTHS`], in [`REPORT_RANGE`].
pub fn lobe_errors(lobes: &LobeTable) -> Vec<LobeErrors> {
    let rule = section_rule();
    let errors: Vec<(Configuration, [f64; REPORT_WIDTHS.len()])> = (0..N_REPORT)
        .into_par_iter()
        .map(|ix| {
            let at = Configuration::random(1, ix);
            let cos = at.theta_d.cos();
            let alpha = alpha_from_cos_theta_d(at.eta, cos);
            let sigma = at.sigma_a / (1.0 - (1.0 - cos * cos) / (at.eta * at.eta)).sqrt();
            let section = Section::new(lobes.lobe, lobes.fresnel, at.eta, alpha, &rule);
            let target = section.moments(&[sigma])[0];
            let table = lobes.at_eta(at.eta);
            let stencil = table.stencil(alpha);
            let moments = table.shape(&stencil, 0.0).moments();
            let found = mixed(&moments, table.shares(&stencil, sigma));
            let errors = REPORT_WIDTHS.map(|lambda_p| {
                ErrorNorm::single(lobes.lobe, lambda_p, at.caustic_width).error(&target, &found)
            });
            (at, errors)
        })
        .collect();
    let width = |(ix, lambda_p): (usize, f64)| {
        let mut sorted: Vec<_> = errors.iter().map(|(at, e)| (e[ix], at)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let quantile = |part: f64| sorted[((sorted.len() - 1) as f64 * part) as usize].0;
        LobeErrors {
            lobe: lobes.lobe,
            lambda_p,
            median: quantile(0.5),
            p95: quantile(0.95),
            worst: quantile(1.0),
            place: sorted[sorted.len() - 1].1.to_string(),
        }
    };
    REPORT_WIDTHS.into_iter().enumerate().map(width).collect()
}

/// The errors as parameters of a file.
pub(super) fn parameters(errors: &[LobeErrors]) -> Vec<(String, String)> {
    errors
        .iter()
        .map(|e| {
            let percent = |x: f64| format!("{:.2} %", 100.0 * x);
            (
                format!("lobes_{} lambda' {}", e.lobe.name(), e.lambda_p),
                format!(
                    "inner integral, relative RMSE over phi: median {}, 95 % below {}, worst {} at {}",
                    percent(e.median),
                    percent(e.p95),
                    percent(e.worst),
                    e.place
                ),
            )
        })
        .collect()
}
