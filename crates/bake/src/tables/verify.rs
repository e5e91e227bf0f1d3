//! Recomputing the tables by other methods than the baker's.
//!
//! | what | baked by | verified by |
//! |---|---|---|
//! | shares b_i at texel centres | Gauss-Legendre | tanh-sinh |
//! | C_k at texel centres and between | Gauss-Legendre | Bessel sums (even k), erf and Dawson or Fourier series (odd k); C_0 analytic |
//! | N_R between texel centres | the fit of the dielectric term in b_i | adaptive quadrature |
//! | H with the dielectric term | Gauss-Legendre | tanh-sinh in gamma |
//! | H with Schlick's term | Gauss-Legendre | finite sums of Beta functions |
//! | recorded errors | measured when baking | measured again on the texels of the file |
//! | shapes and shares of lobes | cosine moments | shares: finer quadrature; inner integrals through a sliced texture: adaptive quadrature in h |

use rayon::prelude::*;

use strandlight_formats::{Table, TableFile};
use strandlight_scattering::axis::Axis;
use strandlight_scattering::c_integrals::{c_closed_form, shares_tanh_sinh};
use strandlight_scattering::circular_gaussian::circular_gaussian_integral;
use strandlight_scattering::closed_form::{Lag, Reflectance, Tables, azimuthal_r, inclination};
use strandlight_scattering::exact::azimuthal;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::h_moments::{moments_tanh_sinh, schlick_moments};
use strandlight_scattering::table_layout::{
    C_CHANNELS as SHARES, C_FROM_B, h_column, theta_d_from_h_column,
};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::tables::{ShadingTables, is_lean};

use super::bake::H_THETA_D_MAX;
use super::check::{Check, Worst};
use super::layout::{TableError, find_table, fresnel_of};
use super::recorded::recorded_errors;
use super::verify_lobes::verify_lobes;

/// Relative tolerance at texel centres.
const CENTRE_TOLERANCE: f64 = 1e-6;
/// Tolerance of C_k between centres, of C_0.
const C_BETWEEN_TOLERANCE: f64 = 5e-4;
/// Absolute tolerance of H between centres.
const H_BETWEEN_TOLERANCE: f64 = 1e-3;
/// N_R with the dielectric Fresnel term, of its peak over phi: fit, table and rounding. What C may
/// be off by, 5e-4 of C_0, is 3e-2 of that peak at theta_d = 0.
const R_TOLERANCE: f64 = 1e-2;
/// Indices of refraction of that check, and the largest theta_d.
const R_ETAS: [f64; 6] = [1.3, 1.4, 1.5, 1.55, 1.65, 1.8];
const R_THETA_D_MAX: f64 = 1.55;
/// Random points between centres, per table.
const N_BETWEEN: u64 = 8192;

/// What [`verify_tables`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct TableReport {
    /// All checks, in order.
    pub checks: Vec<Check>,
}

impl TableReport {
    /// Did every check pass?
    pub fn passed(&self) -> bool {
        !self.checks.is_empty() && self.checks.iter().all(Check::passed)
    }
}

/// Checks `C`, `H_TT` and `H_TRT` at every texel centre and at 8192 random points between, and
/// the lobes: every share, and inner integrals and energies of random fibres.
///
/// Deterministic (`seed` picks the points) and independent of the number of threads. Tolerances:
/// 1e-6 relative at centres (but 5e-12 of C_0 for C_k and 1e-10 for H where that is more, since
/// the methods themselves cancel); between, sampled in single precision by the renderer's own
/// functions, 5e-4 of C_0 for C_k (C_0 itself as the renderer has it), 1e-2 of its peak over phi
/// for N_R with the dielectric Fresnel term, and 1e-3 absolute for H up to theta_d = 1.5.
///
/// What the file records of its own errors is measured again and must agree.
///
/// Files with neither H table, as [`lean`](super::lean) makes them, are whole too.
///
/// # Errors
/// [`TableError`] when a table is missing or laid out otherwise, or cannot be used for shading.
pub fn verify_tables(file: &TableFile, seed: u64) -> Result<TableReport, TableError> {
    let fresnel = fresnel_of(file)?;
    let c = find_table(file, "C", None)?;
    let mut h_tables = Vec::new();
    for which in [Moments::TT, Moments::TRT] {
        if !is_lean(file) {
            h_tables.push((find_table(file, which.name, Some(fresnel))?, which));
        }
    }
    let shading = ShadingTables::whole_or_lean(file)?;
    let sampled = shading.view();
    let mut checks = verify_c(c, &sampled, seed);
    for (table, which) in &h_tables {
        checks.extend(verify_h(table, &sampled, which, fresnel, seed));
    }
    checks.extend(verify_lobes(file, seed)?);
    let h: Vec<&Table> = h_tables.iter().map(|(table, _)| *table).collect();
    checks.extend(recorded_errors(file, fresnel, c, &h)?);
    Ok(TableReport { checks })
}

/// Which of the H tables.
struct Moments {
    name: &'static str,
    trt: bool,
}

impl Moments {
    const TT: Moments = Moments {
        name: "H_TT",
        trt: false,
    };
    const TRT: Moments = Moments {
        name: "H_TRT",
        trt: true,
    };
}

/// A comparison: what, found, expected, error.
struct Entry {
    error: f64,
    found: f64,
    expected: f64,
    label: Label,
}

#[derive(Clone, Copy)]
struct Label {
    channel: &'static str,
    row: f64,
    column: f64,
}

const POWERS: [&str; 7] = ["C_0", "C_1", "C_2", "C_3", "C_4", "C_5", "C_6"];
const MOMENTS: [&str; 4] = ["H_0", "H_2", "H_4", "H_6"];

/// Runs `compare` on points 0..n in parallel and keeps the worst, the first of equals.
fn worst_of(
    name: &'static str,
    table: &'static str,
    tolerance: f64,
    n: u64,
    compare: impl Fn(u64) -> Vec<Entry> + Sync,
) -> Check {
    let found: Vec<(u64, Option<Entry>)> = (0..n)
        .into_par_iter()
        .map(|ix| {
            let entries = compare(ix);
            let count = entries.len() as u64;
            (count, entries.into_iter().reduce(worse))
        })
        .collect();
    let n_values = found.iter().map(|(count, _)| count).sum();
    let worst = found
        .into_iter()
        .filter_map(|(_, entry)| entry)
        .reduce(worse)
        .map(|entry| Worst {
            entry: format!(
                "{} at row {:.6}, column {:.6}",
                entry.label.channel, entry.label.row, entry.label.column
            ),
            found: entry.found,
            expected: entry.expected,
            error: entry.error,
        })
        .unwrap_or_default();
    Check {
        name,
        table,
        n_values,
        tolerance,
        worst,
    }
}

fn worse(a: Entry, b: Entry) -> Entry {
    if b.error > a.error { b } else { a }
}

/// `error`, or infinity in place of NaN, so that a comparison cannot miss it.
fn entry(channel: &'static str, at: (f64, f64), found: f64, expected: f64, unit: f64) -> Entry {
    let error = (found - expected).abs() / unit;
    Entry {
        error: if error.is_nan() { f64::INFINITY } else { error },
        found,
        expected,
        label: Label {
            channel,
            row: at.0,
            column: at.1,
        },
    }
}

/// Values at the centres of texel `ix`, and where it is.
fn centre(rows: &Axis, columns: &Axis, ix: u64) -> (f64, f64) {
    let n_columns = u64::from(columns.count);
    (
        rows.value_at((ix / n_columns) as u32),
        columns.value_at((ix % n_columns) as u32),
    )
}

/// Random point `ix`, uniform in texels.
fn between(rows: &Axis, columns: &Axis, seed: u64, ix: u64) -> (f64, f64) {
    let unit = |which: u64| {
        let bits = splitmix64(seed ^ splitmix64(2 * ix + which));
        (bits >> 11) as f64 / (1u64 << 53) as f64
    };
    (
        rows.value_from_unit(unit(0)),
        columns.value_from_unit(unit(1)),
    )
}

/// Steele et al. 2014.
fn splitmix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn powers_from_shares(b: &[f64; 9]) -> [f64; 7] {
    C_FROM_B.map(|row| row.iter().zip(b).map(|(m, b)| m * b).sum())
}

/// b_0..b_8 of a texel of `C`, b_0 what the others leave of 1.
fn shares(texel: &[f32]) -> [f64; 9] {
    let rest: f64 = texel.iter().map(|&share| f64::from(share)).sum();
    std::array::from_fn(|i| match i {
        0 => 1.0 - rest,
        i => f64::from(texel[i - 1]),
    })
}

fn verify_c(table: &Table, sampled: &Tables<'_>, seed: u64) -> Vec<Check> {
    let (rows, columns) = (table.axes[0].unnamed(), table.axes[1].unnamed());
    let n_texels = u64::from(rows.count) * u64::from(columns.count);
    let texel = |ix: u64| &table.data[8 * ix as usize..8 * ix as usize + 8];
    let over_c_0 = |kappa: f64, cos_half_phi: f64| {
        let phi = 2.0 * cos_half_phi.clamp(0.0, 1.0).acos();
        let c = c_closed_form(kappa, phi);
        c.map(|value| value / c[0])
    };
    let by_quadrature = worst_of(
        "shares b_i at texel centres, relative, against tanh-sinh quadrature",
        "C",
        CENTRE_TOLERANCE,
        n_texels,
        |ix| {
            let at = centre(&rows, &columns, ix);
            let expected = shares_tanh_sinh(at.0, at.1);
            let found = shares(texel(ix));
            (1..9)
                .map(|i| {
                    // Below 1e-30 single precision runs out of exponent.
                    let unit = expected[i].abs().max(1e-30);
                    entry(SHARES[i - 1], at, found[i], expected[i], unit)
                })
                .collect()
        },
    );
    let analytic = worst_of(
        "C_k / C_0 at texel centres, relative, against closed forms",
        "C",
        CENTRE_TOLERANCE,
        n_texels,
        |ix| {
            let at = centre(&rows, &columns, ix);
            let expected = over_c_0(at.0, at.1);
            let found = powers_from_shares(&shares(texel(ix)));
            (0..7)
                .map(|k| {
                    // The closed forms are exact to 5e-15 of C_0, so to 1e-3 of this unit.
                    let unit = expected[k].abs().max(5e-6);
                    entry(POWERS[k], at, found[k], expected[k], unit)
                })
                .collect()
        },
    );
    let interpolated = worst_of(
        "C_k between texel centres, of C_0, against closed forms",
        "C",
        C_BETWEEN_TOLERANCE,
        N_BETWEEN,
        |ix| {
            let (kappa, cos_half_phi) = between(&rows, &columns, seed, ix);
            // The arguments of the renderer, rounded as it has them.
            let lambda_p = (2.0 / kappa).sqrt() as f32;
            let phi = 2.0 * cos_half_phi.clamp(0.0, 1.0).acos();
            let phi = phi as f32;
            let kappa = 2.0 / f64::from(lambda_p).powi(2);
            let expected = c_closed_form(kappa, f64::from(phi));
            let at = (kappa, cos_half_phi);
            (0..7)
                .map(|k| {
                    let found = f64::from(sampled.c_k(k as u32, lambda_p, phi));
                    entry(POWERS[k], at, found, expected[k], expected[0])
                })
                .collect()
        },
    );
    let reflectance: Vec<Reflectance> = R_ETAS
        .map(|eta| Reflectance::new(Fresnel::Dielectric, eta))
        .to_vec();
    let r = worst_of(
        "N_R of degree 8 for eta 1.3..1.8 between texel centres, of its peak over phi",
        "C",
        R_TOLERANCE,
        N_BETWEEN,
        |ix| {
            let (kappa, cos_half_phi) = between(&rows, &columns, seed, ix);
            let which = ix as usize % R_ETAS.len();
            let theta_d = R_THETA_D_MAX * (ix as f64 + 0.5) / N_BETWEEN as f64;
            let at = inclination(theta_d as f32);
            let lag = Lag {
                sin_half: (1.0 - cos_half_phi * cos_half_phi).max(0.0).sqrt() as f32,
                cos_half: cos_half_phi as f32,
                cos_sum: 1.0,
                cos_view: 1.0,
            };
            let found = azimuthal_r(kappa as f32, &lag, &at, &reflectance[which], sampled);
            let c_0 = circular_gaussian_integral(kappa);
            let found = f64::from(found) / c_0;
            let hair = HairParams {
                eta: R_ETAS[which],
                ..HairParams::default()
            };
            let n_r = |lambda_p: f64, phi| {
                azimuthal(Lobe::R, lambda_p, phi, theta_d, &hair, Fresnel::Dielectric)[0]
            };
            let phi = 2.0 * cos_half_phi.clamp(0.0, 1.0).acos();
            let expected = n_r((2.0 / kappa).sqrt(), phi) / c_0;
            let x = theta_d.cos();
            let peak = (1..=16)
                .map(|step| f64::from(step) / 16.0)
                .map(|c| 0.25 * c * Fresnel::Dielectric.reflectance(R_ETAS[which], x * c))
                .fold(0.0, f64::max);
            let at = (kappa, cos_half_phi);
            vec![entry("N_R / C_0", at, found, expected, peak)]
        },
    );
    vec![by_quadrature, analytic, interpolated, r]
}

fn verify_h(
    table: &Table,
    sampled: &Tables<'_>,
    which: &Moments,
    fresnel: Fresnel,
    seed: u64,
) -> [Check; 2] {
    let (rows, columns) = (table.axes[0].unnamed(), table.axes[1].unnamed());
    let n_texels = u64::from(rows.count) * u64::from(columns.count);
    let dielectric = fresnel == Fresnel::Dielectric;
    let exact = |(eta, column): (f64, f64)| {
        let moments = if dielectric {
            moments_tanh_sinh(fresnel, eta, column)
        } else {
            schlick_moments(eta, column)
        };
        if which.trt { moments.trt } else { moments.tt }
    };
    let at_centres = worst_of(
        "H_k at texel centres, relative, against Beta sums or tanh-sinh quadrature",
        which.name,
        CENTRE_TOLERANCE,
        n_texels,
        |ix| {
            let at = centre(&rows, &columns, ix);
            let expected = exact(at);
            (0..4)
                .map(|i| {
                    let found = f64::from(table.data[4 * ix as usize + i]);
                    // The Beta sums are exact to 1e-11, so to 1e-1 of this unit.
                    let unit = expected[i].abs().max(1e-4);
                    entry(MOMENTS[i], at, found, expected[i], unit)
                })
                .collect()
        },
    );
    let interpolated = worst_of(
        "H_k between texel centres, absolute, theta_d <= 1.5",
        which.name,
        H_BETWEEN_TOLERANCE,
        N_BETWEEN,
        |ix| {
            let (eta, column) = between(&rows, &columns, seed, ix);
            // The arguments of the renderer, rounded as it has them.
            let theta_d = theta_d_from_h_column(eta, column, dielectric) as f32;
            if f64::from(theta_d) > H_THETA_D_MAX {
                return Vec::new();
            }
            let eta = eta as f32;
            let cos_theta_d = f64::from(theta_d).cos();
            let at = (
                f64::from(eta),
                h_column(f64::from(eta), cos_theta_d, dielectric),
            );
            let (found, expected) = (sampled.h(which.trt, eta, theta_d), exact(at));
            (0..4)
                .map(|i| entry(MOMENTS[i], at, f64::from(found[i]), expected[i], 1.0))
                .collect()
        },
    );
    [at_centres, interpolated]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{bake_c_and_h, bake_tables};
    use strandlight_scene::progress::Progress;

    #[test]
    fn slow_baked_tables_pass() {
        for fresnel in Fresnel::ALL {
            let file = bake_tables(fresnel, &Progress::silent());
            let report = verify_tables(&file, 0).unwrap();
            for check in &report.checks {
                println!("{} {}: {:?}", check.table, check.name, check.worst);
            }
            assert_eq!(report.checks.len(), 25);
            assert!(report.passed());
        }
    }

    #[test]
    fn slow_any_damaged_value_is_found() {
        let file = bake_c_and_h(Fresnel::Dielectric, &Progress::silent());
        let c = |value_ix: usize, factor: f32| {
            let mut file = file.clone();
            file.tables[0].data[value_ix] *= factor;
            let shading = ShadingTables::from_file(&file).unwrap();
            verify_c(&file.tables[0], &shading.view(), 0)
        };
        let h = |which: &Moments, value_ix: usize, factor: f32| {
            let mut file = file.clone();
            let table_ix = 1 + usize::from(which.trt);
            file.tables[table_ix].data[value_ix] *= factor;
            let shading = ShadingTables::from_file(&file).unwrap();
            let table = &file.tables[table_ix];
            verify_h(table, &shading.view(), which, Fresnel::Dielectric, 0).to_vec()
        };
        let factor = 1.0 + 1e-5;
        for (table, checks) in [
            ("C", c(8 * 128 * 20 + 8 * 64 + 3, factor)),
            ("C", c(8 * 128 * 40 + 8 * 100 + 6, factor)),
            ("C", c(5, f32::NAN)),
            ("H_TT", h(&Moments::TT, 4 * 128 * 20 + 4 * 90 + 1, factor)),
            ("H_TRT", h(&Moments::TRT, 4 * 128 * 20 + 4 * 90 + 3, factor)),
        ] {
            let failed: Vec<&Check> = checks.iter().filter(|c| !c.passed()).collect();
            assert!(!failed.is_empty() && failed.iter().all(|c| c.table == table));
            println!("{table}: {:?}", failed[0].worst);
        }
        let undamaged = h(&Moments::TT, 0, 1.0);
        assert!(undamaged.iter().all(Check::passed));
    }

    #[test]
    fn a_coarser_grid_misses_the_tolerance_between() {
        // Every third column: exact at its centres, too coarse between.
        let mut file = bake_c_and_h(Fresnel::Dielectric, &Progress::silent());
        let table = &mut file.tables[0];
        let data = table.data.chunks_exact(8).collect::<Vec<_>>();
        let coarse: Vec<f32> = data
            .chunks_exact(128)
            .flat_map(|row| row[..127].iter().step_by(3).copied().flatten().copied())
            .collect();
        table.data = coarse;
        table.axes[1].count = 43;
        let shading = ShadingTables::from_file(&file).unwrap();
        let checks = verify_c(&file.tables[0], &shading.view(), 0);
        let failed: Vec<&str> = checks
            .iter()
            .filter(|check| !check.passed())
            .map(|check| check.name)
            .collect();
        assert!(failed.contains(&"C_k between texel centres, of C_0, against closed forms"));
    }

    #[test]
    fn what_is_not_there_is_named() {
        let mut file = bake_c_and_h(Fresnel::Schlick, &Progress::silent());
        let error = verify_tables(&file, 0).unwrap_err().to_string();
        assert!(error.contains("lobes_TT_shapes"), "{error}");
        file.tables[1].channels[0] = "H1".to_owned();
        let error = verify_tables(&file, 0).unwrap_err().to_string();
        assert!(error.contains("H_TT") && error.contains("H1"), "{error}");
        file.tables.remove(1);
        let error = verify_tables(&file, 0).unwrap_err();
        assert_eq!(error, TableError::Missing { name: "H_TT" });
    }
}
