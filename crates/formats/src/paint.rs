//! Attributes of painted hair: their names, shapes and ranges.

use crate::error::{Error, Result};

/// Name of the dye: 4 components, absorption sigma_a (linear RGB, per fibre radius,
/// 0..=[`MAX_SIGMA_A`]) and weight (0..=1). A fibre has `mix(hair.sigma_a, dye, weight)`.
pub const DYE: &str = "dye";
/// Name of the factor of all longitudinal widths: 1 component,
/// [`MIN_SCALE`]..=[`MAX_SCALE`].
pub const WIDTH_SCALE: &str = "width_scale";
/// Name of the factor of all longitudinal shifts: 1 component,
/// [`MIN_SCALE`]..=[`MAX_SCALE`].
pub const SHIFT_SCALE: &str = "shift_scale";
/// Name of the mask, which protects paint from brushes and is no paint itself: 1 component, 0 (not at
/// all)..=1 (wholly). The name is a common one: an attribute of another shape or range is left to whoever wrote it.
pub const MASK: &str = "mask";
/// The attributes of paint and their numbers of components.
pub const PAINT_ATTRIBUTES: [(&str, u32); 3] = [(DYE, 4), (WIDTH_SCALE, 1), (SHIFT_SCALE, 1)];

/// Most absorption of a dye per fibre radius, as of a hair.
pub const MAX_SIGMA_A: f32 = 50.0;
/// Least factor of widths and shifts.
pub const MIN_SCALE: f32 = 0.05;
/// Largest factor of widths and shifts.
pub const MAX_SCALE: f32 = 20.0;

/// Checks an attribute if it has the name of one of paint.
pub(crate) fn check(name: &str, components: u32, data: &[f32]) -> Result<()> {
    let Some((_, expected)) = PAINT_ATTRIBUTES.iter().find(|(known, _)| *known == name) else {
        return Ok(());
    };
    if components != *expected {
        return Err(Error::value(
            format!("components of attribute {name}"),
            components,
            expected.to_string(),
        ));
    }
    for (ix, &value) in data.iter().enumerate() {
        let (min, max) = match (name, ix % 4) {
            (DYE, 3) => (0.0, 1.0),
            (DYE, _) => (0.0, MAX_SIGMA_A),
            _ => (MIN_SCALE, MAX_SCALE),
        };
        // `contains` is false for NaN.
        if !(min..=max).contains(&value) {
            return Err(Error::value(
                format!("attribute {name}[{ix}]"),
                value,
                format!("in {min}..={max}"),
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::groom::{Attribute, Domain, Groom};

    fn groom(name: &str, components: u32, data: &[f32]) -> Groom {
        Groom {
            points: vec![[0.0; 3], [0.0, 1.0, 0.0]],
            strand_offsets: vec![0, 2],
            attributes: vec![Attribute {
                name: name.to_owned(),
                domain: Domain::Point,
                components,
                data: data.to_vec(),
            }],
            ..Groom::default()
        }
    }

    #[test]
    fn values_outside_their_range_are_named() {
        let dye = [0.0, 50.0, 1.0, 1.0, 0.3, 0.2, 0.1, 0.0];
        assert!(groom(DYE, 4, &dye).validate().is_ok());
        assert!(groom(WIDTH_SCALE, 1, &[0.05, 20.0]).validate().is_ok());
        let refused = |name: &str, components: u32, data: &[f32], needle: &str| {
            let error = groom(name, components, data).validate().unwrap_err();
            assert!(error.to_string().contains(needle), "{error}");
        };
        for (ix, value) in [(3, 1.5), (7, -0.1), (1, 50.5), (4, -1e-9), (0, f32::NAN)] {
            let mut data = dye;
            data[ix] = value;
            refused(DYE, 4, &data, &format!("dye[{ix}]"));
        }
        refused(DYE, 3, &[0.1; 6], "components of attribute dye");
        refused(WIDTH_SCALE, 2, &[1.0; 4], "components of attribute width");
        refused(WIDTH_SCALE, 1, &[1.0, 0.0], "width_scale[1]");
        refused(SHIFT_SCALE, 1, &[21.0, 1.0], "shift_scale[0]");
    }
}
