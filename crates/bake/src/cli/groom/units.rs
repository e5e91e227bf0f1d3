//! Units and axes on the command line.

use clap::ValueEnum;
use strandlight_formats::{LengthUnit, UpAxis};

/// Centimetres per unit, or to be found out.
#[derive(Clone, Copy)]
pub enum Unit {
    /// By the file's word, or else guessed.
    Auto,
    /// So many centimetres.
    Cm(f64),
}

/// An up axis, or to be found out.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Up {
    X,
    Y,
    Z,
    Auto,
}

impl Up {
    /// The axis; `None` where it is to be found out.
    pub fn axis(self) -> Option<UpAxis> {
        match self {
            Up::X => Some(UpAxis::X),
            Up::Y => Some(UpAxis::Y),
            Up::Z => Some(UpAxis::Z),
            Up::Auto => None,
        }
    }
}

/// An axis.
#[derive(Clone, Copy, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl From<Axis> for UpAxis {
    fn from(axis: Axis) -> UpAxis {
        match axis {
            Axis::X => UpAxis::X,
            Axis::Y => UpAxis::Y,
            Axis::Z => UpAxis::Z,
        }
    }
}

/// Parses `--unit` of a file that is read.
pub fn parse_unit(text: &str) -> Result<Unit, String> {
    match text {
        "auto" => Ok(Unit::Auto),
        _ => match cm_of(text) {
            Some(cm) => Ok(Unit::Cm(cm)),
            None => Err(format!(
                "must be {}, a number of centimetres in 1e-6..=1e6, or auto",
                unit_names()
            )),
        },
    }
}

/// Parses a unit that is not asked of the file, as centimetres.
pub fn parse_cm(text: &str) -> Result<f64, String> {
    cm_of(text).ok_or_else(|| {
        let names = unit_names();
        format!("must be {names}, or a number of centimetres in 1e-6..=1e6")
    })
}

fn cm_of(text: &str) -> Option<f64> {
    let named = LengthUnit::from_name(text).map(LengthUnit::cm);
    let cm = named.or_else(|| text.parse().ok())?;
    (1e-6..=1e6).contains(&cm).then_some(cm)
}

/// The names of units.
pub fn unit_names() -> String {
    LengthUnit::ALL.map(LengthUnit::name).join(", ")
}

/// A unit of so many centimetres, in words.
pub fn unit_text(cm: f64) -> String {
    let is_named = |unit: &LengthUnit| (unit.cm() / cm - 1.0).abs() < 1e-9;
    match LengthUnit::ALL.into_iter().find(is_named) {
        Some(unit) => unit.name().to_owned(),
        None => format!("{cm} cm"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_names_or_numbers() {
        for (text, cm) in [("mm", 0.1), ("m", 100.0), ("2.5", 2.5), ("1e-6", 1e-6)] {
            assert_eq!(parse_cm(text), Ok(cm));
            assert!(matches!(parse_unit(text), Ok(Unit::Cm(found)) if found == cm));
        }
        assert!(matches!(parse_unit("auto"), Ok(Unit::Auto)));
        for text in ["auto", "furlong", "0", "-1", "nan", "inf", "1e9", ""] {
            assert!(parse_cm(text).is_err(), "{text}");
        }
        assert_eq!(unit_text(100.0), "m");
        assert_eq!(unit_text(10.0), "10 cm");
    }
}
