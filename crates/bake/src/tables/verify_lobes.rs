//! Checking the lobes: shares recomputed, and what a renderer gets out of them against adaptive
//! quadrature of the exact model.

use rayon::prelude::*;
use strandlight_formats::TableFile;
use strandlight_scattering::closed_form::{Lag, azimuthal_trt, azimuthal_tt, sample_lobes};
use strandlight_scattering::exact::{azimuthal, energy};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::fit::{ErrorNorm, LobeShape, best_shares};
use strandlight_scattering::lobes::moments::Section;
use strandlight_scattering::lobes::{
    DEFAULT_LOBE_TEXELS, LobeTable, LobeTexture, sigma_from_absorption, slice_mode, table_names,
};
use strandlight_scattering::quadrature::GaussLegendre;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::tables::lobe_table;

use super::check::{Check, Worst};
use super::layout::TableError;
use super::lobes::{Configuration, MODES, REPORT_WIDTHS};
use strandlight_scattering::random::SplitMix64;

/// Shares differ by the quadrature of the moments alone: 256 nodes when baking.
const CHECK_NODES: usize = 400;
const SHARE_TOLERANCE: f64 = 2e-4;
/// Relative RMSE over phi of the inner integral, of any fibre and of all together.
const WORST_TOLERANCE: f64 = 0.04;
const POOLED_TOLERANCE: f64 = 0.008;
/// Relative error of an energy that exceeds 1e-6.
const ENERGY_TOLERANCE: f64 = 1e-2;
/// The same for Schlick's term: near eta = 1 and grazing angles, where it does not narrow and the
/// lobes change roles from texel to texel, energies between texels are off by 1.2 %.
const ENERGY_TOLERANCE_SCHLICK: f64 = 2e-2;
/// Random fibres and azimuths each.
const N_FIBRES: u64 = 105;
const N_AZIMUTHS: u32 = 16;
const N_ENERGIES: u64 = 4096;

/// All checks of the lobes of TT and TRT.
///
/// # Errors
/// A table is missing or laid out otherwise.
pub(super) fn verify_lobes(file: &TableFile, seed: u64) -> Result<Vec<Check>, TableError> {
    let mut checks = Vec::new();
    for mode in MODES {
        let lobes = lobe_table(file, mode)?;
        checks.push(verify_shares(&lobes));
        checks.extend(verify_inner_integrals(&lobes, seed));
        checks.push(verify_energies(&lobes, seed));
    }
    Ok(checks)
}

/// The worse of two, NaN worst of all, the first of equals.
fn worse(a: Worst, b: Worst) -> Worst {
    if b.error > a.error || (b.error.is_nan() && !a.error.is_nan()) {
        b
    } else {
        a
    }
}

fn worst(
    entry: impl FnOnce() -> String,
    found: f64,
    expected: f64,
    error: f64,
    before: Worst,
) -> Worst {
    let error = if error.is_nan() { f64::INFINITY } else { error };
    if error > before.error {
        Worst {
            entry: entry(),
            found,
            expected,
            error,
        }
    } else {
        before
    }
}

/// Every share against the best for the shape in the table.
fn verify_shares(lobes: &LobeTable) -> Check {
    let axes = &lobes.axes;
    let (n_alpha, n_layers) = (axes.alpha.count as usize, axes.absorption.count as usize);
    let layers: Vec<f64> = (0..axes.absorption.count)
        .map(|ix| axes.absorption.value_at(ix))
        .collect();
    let sigmas: Vec<f64> = layers.iter().map(|&t| sigma_from_absorption(t)).collect();
    let norm = ErrorNorm::fitting(lobes.lobe);
    let rule = GaussLegendre::new(CHECK_NODES);
    let found = lobes
        .shapes
        .par_iter()
        .enumerate()
        .map(|(ix, shape)| {
            let eta = axes.eta.value_at((ix / n_alpha) as u32);
            let alpha = axes.alpha.value_at((ix % n_alpha) as u32);
            let moments = LobeShape::from_array(shape.map(f64::from)).moments();
            let section = Section::new(lobes.lobe, lobes.fresnel, eta, alpha, &rule);
            let shares = &lobes.shares[ix * n_layers..][..n_layers];
            let mut found = Worst::default();
            for ((target, shares), t) in section.moments(&sigmas).iter().zip(shares).zip(&layers) {
                let best = best_shares(&moments, target, &norm.weights(target));
                for (channel, (&share, best)) in shares.iter().zip(&best[1..]).enumerate() {
                    let share = f64::from(share);
                    let name = strandlight_scattering::lobes::SHARE_CHANNELS[channel];
                    found = worst(
                        || format!("{name} at eta {eta:.4}, alpha {alpha:.4}, absorption {t:.4}"),
                        share,
                        *best,
                        (share - best).abs(),
                        found,
                    );
                }
            }
            found
        })
        .reduce(Worst::default, worse);
    Check {
        name: "shares at texel centres, absolute, against those of a finer quadrature",
        table: table_names(lobes.lobe)[1],
        n_values: 2 * lobes.shares.len() as u64,
        tolerance: SHARE_TOLERANCE,
        worst: found,
    }
}

/// What the renderer evaluates.
fn sampled(texture: &LobeTexture, mode: Lobe, lambda_p: f64, dphi: f64, theta_d: f64) -> [f64; 3] {
    let lobes = sample_lobes(&texture.view(), 0.0, theta_d.cos() as f32);
    let lag = Lag {
        sin_half: (0.5 * dphi).sin().abs() as f32,
        cos_half: (0.5 * dphi).cos().abs() as f32,
        cos_sum: dphi.cos() as f32,
        cos_view: 1.0,
    };
    let kappa = (2.0 / (lambda_p * lambda_p)) as f32;
    let value = match mode {
        Lobe::Trt => azimuthal_trt(kappa, &lag, &lobes),
        _ => azimuthal_tt(kappa, &lag, &lobes),
    };
    value.map(f64::from)
}

fn texture(lobes: &LobeTable, hair: &HairParams) -> LobeTexture {
    slice_mode(lobes, hair, DEFAULT_LOBE_TEXELS)
}

/// Inner integrals through a sliced texture in single precision against adaptive quadrature in h.
fn verify_inner_integrals(lobes: &LobeTable, seed: u64) -> [Check; 2] {
    let mode = lobes.lobe;
    let per_fibre: Vec<(f64, f64, Worst)> = (0..N_FIBRES)
        .into_par_iter()
        .map(|ix| {
            let at = Configuration::random(seed, ix);
            let lambda_p = REPORT_WIDTHS[ix as usize % REPORT_WIDTHS.len()];
            let hair = HairParams {
                eta: at.eta,
                sigma_a: [at.sigma_a; 3],
                caustic_width: at.caustic_width,
                ..HairParams::default()
            };
            let texture = texture(lobes, &hair);
            let (mut error, mut norm) = (0.0, 0.0);
            let mut furthest = Worst::default();
            for step in 0..N_AZIMUTHS {
                let dphi = (f64::from(step) + 0.5) / f64::from(N_AZIMUTHS) * std::f64::consts::PI;
                let found = sampled(&texture, mode, lambda_p, dphi, at.theta_d)[0];
                let exact = azimuthal(mode, lambda_p, dphi, at.theta_d, &hair, lobes.fresnel)[0];
                error += (found - exact).powi(2);
                norm += exact * exact;
                furthest = worst(
                    || format!("inner integral at lambda' {lambda_p}, phi {dphi:.3}, {at}"),
                    found,
                    exact,
                    (found - exact).abs(),
                    furthest,
                );
            }
            furthest.error = (error / norm).sqrt();
            // Fibres and widths weigh alike.
            (error / norm, 1.0, furthest)
        })
        .collect();
    let table = table_names(mode)[0];
    let (error, norm) = per_fibre
        .iter()
        .fold((0.0, 0.0), |(error, norm), (e, n, _)| (error + e, norm + n));
    let n_values = N_FIBRES * u64::from(N_AZIMUTHS);
    let found = per_fibre
        .into_iter()
        .map(|(.., worst)| worst)
        .reduce(worse)
        .unwrap_or_default();
    let pooled = Worst {
        entry: format!("of {N_FIBRES} fibres; root mean square"),
        found: (error / norm).sqrt(),
        expected: 0.0,
        error: (error / norm).sqrt(),
    };
    let check = |name, tolerance, worst| Check {
        name,
        table,
        n_values,
        tolerance,
        worst,
    };
    [
        check(
            "inner integrals of one fibre, relative RMSE over phi, against adaptive quadrature",
            WORST_TOLERANCE,
            found,
        ),
        check(
            "inner integrals of all fibres, relative RMSE, against adaptive quadrature",
            POOLED_TOLERANCE,
            pooled,
        ),
    ]
}

/// Energies through a sliced texture against quadrature: eta 1.001..3, sigma_a 0.001..20, all
/// theta_d.
fn verify_energies(lobes: &LobeTable, seed: u64) -> Check {
    let found: Vec<Option<Worst>> = (0..N_ENERGIES / 16)
        .into_par_iter()
        .flat_map_iter(|fibre| {
            let mut random = SplitMix64::of_item(!seed, fibre);
            let hair = HairParams {
                eta: 1.0 + random.log_uniform(1e-3, 2.0),
                sigma_a: [(); 3].map(|()| random.log_uniform(1e-3, 20.0)),
                caustic_width: random.log_uniform(0.01, 1.0),
                ..HairParams::default()
            };
            let texture = texture(lobes, &hair);
            let points: Vec<Option<Worst>> = (0..16)
                .map(|_| {
                    let theta_d = random.uniform(0.0, std::f64::consts::FRAC_PI_2);
                    let exact = energy(lobes.lobe, theta_d, &hair, lobes.fresnel);
                    let found = sampled(&texture, lobes.lobe, 1e4, 0.0, theta_d);
                    (0..3)
                        .filter(|&channel| exact[channel] > 1e-6)
                        .map(|channel| Worst {
                            entry: format!(
                                "energy at eta {:.4}, theta_d {theta_d:.4}, sigma_a {:.4}, w_c {:.3}",
                                hair.eta, hair.sigma_a[channel], hair.caustic_width
                            ),
                            found: found[channel],
                            expected: exact[channel],
                            error: (found[channel] / exact[channel] - 1.0).abs(),
                        })
                        .reduce(worse)
                })
                .collect();
            points
        })
        .collect();
    Check {
        name: "energies above 1e-6, relative, against quadrature",
        table: table_names(lobes.lobe)[1],
        n_values: 3 * N_ENERGIES,
        tolerance: match lobes.fresnel {
            Fresnel::Dielectric => ENERGY_TOLERANCE,
            Fresnel::Schlick => ENERGY_TOLERANCE_SCHLICK,
        },
        worst: found
            .into_iter()
            .flatten()
            .reduce(worse)
            .unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_data::DEFAULT_TABLES;
    use strandlight_formats::BakedFile;

    fn failed(damage: impl FnOnce(&mut TableFile)) -> Vec<(&'static str, String)> {
        let mut file = TableFile::from_bytes(DEFAULT_TABLES).unwrap();
        damage(&mut file);
        verify_lobes(&file, 0)
            .unwrap()
            .into_iter()
            .filter(|check| !check.passed())
            .map(|check| (check.table, check.worst.entry))
            .collect()
    }

    fn data<'a>(file: &'a mut TableFile, name: &str) -> &'a mut [f32] {
        let table = file.tables.iter_mut().find(|table| table.name == name);
        &mut table.unwrap().data
    }

    #[test]
    fn damaged_lobes_are_found() {
        assert_eq!(failed(|_| ()), []);
        let share =
            failed(|file| data(file, "lobes_TRT_shares")[2 * (16 * (128 * 3 + 40) + 5)] += 1e-3);
        assert_eq!(share.len(), 1);
        assert!(share[0].0 == "lobes_TRT_shares" && share[0].1.starts_with("share_1"));
        // Pairs a fifth further out: shares no longer fit, nor do inner integrals.
        let shape = failed(|file| {
            let shapes = data(file, "lobes_TT_shapes").chunks_exact_mut(5);
            shapes.for_each(|shape| shape[2] *= 1.2);
        });
        assert!(shape.iter().any(|(table, _)| *table == "lobes_TT_shapes"));
    }
}
