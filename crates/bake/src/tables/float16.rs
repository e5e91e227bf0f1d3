//! What storing half floats would cost.

use half::f16;
use strandlight_formats::TableFile;
use strandlight_scattering::table_layout::C_FROM_B;

use super::layout::{TableError, find_table};

/// Relative errors of the azimuthal R lobe at normal incidence (eta 1.55, Schlick's Fresnel term)
/// over all texels of `C`, when texels are rounded to half floats; and of the stored values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Float16Cost {
    /// Largest `|error of C_k| / C_0`, k > 0, with the shares b_i rounded.
    pub shares_c: f64,
    /// Median relative error of N_R with the shares b_i rounded.
    pub shares_median: f64,
    /// 95th percentile of the same.
    pub shares_p95: f64,
    /// Largest of the same.
    pub shares_max: f64,
    /// Median relative error of N_R with `C_k / C_0` rounded: the functions as Xu 2011 stores
    /// them; its polynomial cancels some 200-fold at normal incidence.
    pub powers_median: f64,
    /// 95th percentile of the same.
    pub powers_p95: f64,
    /// Largest of the same.
    pub powers_max: f64,
    /// Largest absolute error of the H tables' values, rounded.
    pub moments: f64,
}

/// Measures [`Float16Cost`] on the tables of `file`.
///
/// # Errors
/// [`TableError`] when a table is missing or laid out otherwise.
pub fn float16_cost(file: &TableFile) -> Result<Float16Cost, TableError> {
    let fresnel = super::fresnel_of(file)?;
    let c = find_table(file, "C", None)?;
    let round = |value: f64| f64::from(f16::from_f64(value));
    let (mut by_shares, mut by_powers) = (Vec::new(), Vec::new());
    let mut shares_c = 0.0f64;
    for texel in c.data.chunks_exact(8) {
        let mut b = [0.0; 9];
        for (share, &stored) in b[1..].iter_mut().zip(texel) {
            *share = f64::from(stored);
        }
        let rounded = b.map(round);
        let powers = powers(&b);
        for (exact, rough) in powers.iter().zip(self::powers(&rounded)).skip(1) {
            shares_c = shares_c.max((exact - rough).abs());
        }
        let exact = lobe_from_shares(&b);
        if exact > 0.0 {
            by_shares.push((lobe_from_shares(&rounded) / exact - 1.0).abs());
            by_powers.push((lobe_from_powers(&powers.map(round)) / exact - 1.0).abs());
        }
    }
    let mut moments = 0.0f64;
    for name in ["H_TT", "H_TRT"] {
        for &value in &find_table(file, name, Some(fresnel))?.data {
            let value = f64::from(value);
            moments = moments.max((round(value) - value).abs());
        }
    }
    let [shares_median, shares_p95, shares_max] = percentiles(by_shares);
    let [powers_median, powers_p95, powers_max] = percentiles(by_powers);
    Ok(Float16Cost {
        shares_c,
        shares_median,
        shares_p95,
        shares_max,
        powers_median,
        powers_p95,
        powers_max,
        moments,
    })
}

fn powers(b: &[f64; 9]) -> [f64; 7] {
    C_FROM_B.map(|row| row.iter().zip(b).map(|(m, b)| m * b).sum())
}

/// Schlick's F_0 at eta = 1.55.
const F_0: f64 = (0.55 / 2.55) * (0.55 / 2.55);

/// `4 N_R / C_0` at theta_d = 0: `sum_{i=1..8} (i/8) F_i b_i`, F_i the Bernstein coefficients of
/// degree 7 of Schlick's `F_0 + (1 - F_0)(1 - c)^5`.
fn lobe_from_shares(b: &[f64; 9]) -> f64 {
    let sum: f64 = (1..9).map(|i| i as f64 / 8.0 * F_0 * b[i]).sum();
    let rising = b[1] + 2.0 * 2.0 / 7.0 * b[2] + 3.0 / 21.0 * b[3];
    sum + (1.0 - F_0) / 8.0 * rising
}

/// The same from the powers: `c [F_0 + (1 - F_0)(1 - c)^5]`, expanded.
fn lobe_from_powers(c: &[f64; 7]) -> f64 {
    let binomial_5 = [1.0, -5.0, 10.0, -10.0, 5.0, -1.0];
    let sum: f64 = (0..6).map(|j| binomial_5[j] * c[j + 1]).sum();
    F_0 * c[1] + (1.0 - F_0) * sum
}

/// Median, 95th percentile and maximum; zeros for no values.
fn percentiles(mut values: Vec<f64>) -> [f64; 3] {
    if values.is_empty() {
        return [0.0; 3];
    }
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    [0.5, 0.95, 1.0].map(|share| values[(share * last as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::bake_c_and_h;
    use strandlight_scattering::fresnel::Fresnel;
    use strandlight_scene::progress::Progress;

    #[test]
    fn shares_survive_half_precision_and_powers_do_not() {
        let file = bake_c_and_h(Fresnel::Dielectric, &Progress::silent());
        let cost = float16_cost(&file).unwrap();
        println!("{cost:?}");
        assert!(cost.shares_p95 < 5e-4 && cost.shares_c < 1e-3);
        assert!(cost.powers_p95 > 10.0 * cost.shares_p95);
        assert!(cost.moments < 1e-3);
    }

    #[test]
    fn both_expansions_are_one_function() {
        for c in [0.0f64, 0.2, 0.7, 1.0] {
            let binomial = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0];
            let b: [f64; 9] = std::array::from_fn(|i| {
                binomial[i] * c.powi(i as i32) * (1.0 - c).powi(8 - i as i32)
            });
            let expected = c * (F_0 + (1.0 - F_0) * (1.0 - c).powi(5));
            assert!((lobe_from_shares(&b) - expected).abs() < 1e-14);
            assert!((lobe_from_powers(&powers(&b)) - expected).abs() < 1e-13);
        }
    }
}
