//! What a file says of its own errors, measured again on its own texels: a figure that nothing
//! checks can be edited, or left over from other data.

use strandlight_formats::{Table, TableFile};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::table_names;
use strandlight_scene::tables::lobe_table;

use super::bake::measure_again;
use super::check::{Check, Worst};
use super::layout::TableError;
use super::lobes::{MODES, lobe_errors, parameters};

/// Relative difference between a recorded error and the same measured again: another system's
/// libm moves the worst cell by less.
const TOLERANCE: f64 = 1e-2;
/// Largest difference of figures in words, in their last printed place.
const PRINTED_TOLERANCE: f64 = 0.0101;

/// A check for each `max_interpolation_error` of the file, and for what its parameters say of the
/// lobes, where they say it.
pub(super) fn recorded_errors(
    file: &TableFile,
    fresnel: Fresnel,
    c: &Table,
    h: &[&Table],
) -> Result<Vec<Check>, TableError> {
    let measured = measure_again(fresnel, c, h);
    let names = ["C", "H_TT", "H_TRT"];
    let tables = std::iter::once(c).chain(h.iter().copied());
    let mut checks: Vec<Check> = tables
        .zip(names)
        .zip(measured)
        .map(|((table, name), error)| recorded(table, name, error))
        .collect();
    for mode in MODES {
        let errors = lobe_errors(&lobe_table(file, mode)?);
        let worst = errors.iter().map(|e| e.worst).fold(0.0, f64::max);
        for name in table_names(mode) {
            if let Some(table) = file.table(name) {
                checks.push(recorded(table, name, worst));
            }
        }
        checks.extend(recorded_parameters(
            file,
            table_names(mode)[0],
            &parameters(&errors),
        ));
    }
    Ok(checks)
}

/// What the parameters of `file` say, against `measured`; none where they say nothing of it.
fn recorded_parameters(
    file: &TableFile,
    table: &'static str,
    measured: &[(String, String)],
) -> Option<Check> {
    let (mut n_values, mut worst) = (0, Worst::default());
    for (key, measured) in measured {
        let mut recorded = file.info.parameters.iter();
        let Some((_, recorded)) = recorded.find(|(name, _)| name == key) else {
            continue;
        };
        n_values += 1;
        if worst.error == 0.0 && !same_figures(recorded, measured, PRINTED_TOLERANCE) {
            worst = Worst {
                entry: format!("{key:?} says {recorded:?}, measured again: {measured:?}"),
                found: f64::NAN,
                expected: f64::NAN,
                error: f64::INFINITY,
            };
        }
    }
    (n_values > 0).then_some(Check {
        name: "recorded parameters, against what is measured again",
        table,
        n_values,
        tolerance: 0.0,
        worst,
    })
}

fn recorded(table: &Table, name: &'static str, measured: f64) -> Check {
    let found = f64::from(table.max_interpolation_error);
    Check {
        name: "recorded max_interpolation_error, relative, against the error measured again",
        table: name,
        n_values: 1,
        tolerance: TOLERANCE,
        worst: Worst {
            entry: "max_interpolation_error".to_owned(),
            found,
            expected: measured,
            error: (found - measured).abs() / measured,
        },
    }
}

/// Do two texts say the same, number for number? Numbers may differ by `tolerance`, words not.
pub fn same_figures(a: &str, b: &str, tolerance: f64) -> bool {
    let words = |text: &str| -> Vec<String> {
        let words = text.split_whitespace();
        words
            .map(|word| word.trim_end_matches([',', ';']).to_owned())
            .collect()
    };
    let (a, b) = (words(a), words(b));
    a.len() == b.len()
        && a.iter()
            .zip(&b)
            .all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(a), Ok(b)) => (a - b).abs() <= tolerance,
                _ => a == b,
            })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_compared_and_words_too() {
        let text = "relative RMSE: median 0.33 %, worst 1.20 % at eta 1.5";
        let same = |other: &str| same_figures(text, other, 0.0101);
        assert!(same(text));
        assert!(same(
            "relative RMSE: median 0.34 %, worst 1.20 % at eta 1.5"
        ));
        assert!(!same(
            "relative RMSE: median 0.23 %, worst 1.20 % at eta 1.5"
        ));
        assert!(!same(
            "relative RMSE: median NaN %, worst 1.20 % at eta 1.5"
        ));
        assert!(!same("relative RMSE: mean 0.33 %, worst 1.20 % at eta 1.5"));
        assert!(!same("relative RMSE: median 0.33 %"));
    }
}
