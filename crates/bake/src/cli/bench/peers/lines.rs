//! Lines of the tables of `bench peers`.

use crate::cli::{Outcome, print_line};

/// Above [`line()`]s.
pub fn head() -> Outcome {
    print_line(format_args!(
        "  {:40} {:>9} {:>9} {:>9}",
        "", "samples", "error", "core-s"
    ))
}

/// What was measured of `name`.
pub fn line(name: &str, samples: Option<f64>, error: Option<f64>, seconds: Option<f64>) -> Outcome {
    let shown = |value: Option<f64>, digits: usize, unit: &str| match value {
        Some(value) => format!("{value:.digits$}{unit}"),
        None => "-".to_owned(),
    };
    // Numbers of samples are whole, except where they are read off a fit.
    let digits = match samples.is_some_and(|samples| samples.fract() == 0.0) {
        true => 0,
        false => 3,
    };
    print_line(format_args!(
        "  {name:40} {:>9} {:>9} {:>9}",
        shown(samples, digits, ""),
        shown(error.map(|error| 100.0 * error), 2, " %"),
        shown(seconds, 3, ""),
    ))
}
