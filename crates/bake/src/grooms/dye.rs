//! Colours that other programs gave to strands, as dye.

use strandlight_formats::{Attribute, DYE, Groom, HairSection, MAX_SIGMA_A};
use strandlight_scattering::color::sigma_a_from_reflectance;

use super::edit::EditError;

/// What [`dye_from_color`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dyed {
    /// Colours that were read.
    pub n_values: usize,
    /// Of these, colours outside 0..=1, which were clamped.
    pub n_clamped: usize,
    /// There was a dye, which is replaced.
    pub replaces_dye: bool,
}

/// Adds the attribute `dye` whose absorption makes a whole head of hair look like the colours of the
/// attribute `name` (3 components, linear RGB, 0..=1), for the same domain, with weight 1: see
/// [`sigma_a_from_reflectance`] (Chiang et al. 2016), at the default width of the caustic.
///
/// # Errors
/// No such attribute, or one of other than three components.
pub fn dye_from_color(groom: &mut Groom, name: &str) -> Result<Dyed, EditError> {
    // Its names elsewhere are as good as ours.
    let plain = match name {
        "Cd" | "displayColor" | "groom_color" => "color",
        _ => name,
    };
    let color = groom.attribute(name).or_else(|| groom.attribute(plain));
    let Some(color) = color.filter(|color| color.components == 3) else {
        let named = |attribute: &&Attribute| attribute.components == 3;
        let names: Vec<&str> = groom
            .attributes
            .iter()
            .filter(named)
            .map(|attribute| &*attribute.name)
            .collect();
        let list = match names.is_empty() {
            true => "there is no attribute of 3 components".to_owned(),
            false => format!("those of 3 components: {}", names.join(", ")),
        };
        let what = format!("the hair has no colour called {name} ({list})");
        return Err(EditError::Missing(what));
    };
    let caustic_width = HairSection::default().params().caustic_width;
    let mut n_clamped = 0;
    let mut data = Vec::with_capacity(color.data.len() / 3 * 4);
    for rgb in color.data.chunks_exact(3) {
        let rgb = [rgb[0], rgb[1], rgb[2]].map(f64::from);
        n_clamped += usize::from(rgb.iter().any(|c| !(0.0..=1.0).contains(c)));
        let sigma_a = sigma_a_from_reflectance(rgb, caustic_width);
        data.extend(sigma_a.map(|sigma| (sigma as f32).min(MAX_SIGMA_A)));
        data.push(1.0);
    }
    let dye = Attribute {
        name: DYE.to_owned(),
        domain: color.domain,
        components: 4,
        data,
    };
    let n_before = groom.attributes.len();
    groom.attributes.retain(|attribute| attribute.name != DYE);
    let dyed = Dyed {
        n_values: dye.data.len() / 4,
        n_clamped,
        replaces_dye: groom.attributes.len() < n_before,
    };
    groom.attributes.push(dye);
    groom.validate()?;
    Ok(dyed)
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head};
    use super::*;
    use strandlight_formats::Domain;
    use strandlight_scattering::color::reflectance_from_sigma_a;

    #[test]
    fn colours_come_back_from_the_dye() {
        let mut groom = head(3);
        let colors = vec![0.8, 0.5, 0.2, 1.0, 1.0, 1.0, 0.05, 1.5, -0.1];
        groom
            .attributes
            .push(attribute("color", Domain::Strand, 3, colors));
        for name in ["color", "groom_color", "Cd"] {
            let is_again = groom.attribute(DYE).is_some();
            let dyed = dye_from_color(&mut groom, name).unwrap();
            let expected = Dyed {
                n_values: 3,
                n_clamped: 1,
                replaces_dye: is_again,
            };
            assert_eq!(dyed, expected);
        }
        let dye = groom.attribute(DYE).unwrap();
        assert_eq!((dye.domain, dye.components), (Domain::Strand, 4));
        let width = HairSection::default().params().caustic_width;
        let sigma = [0, 1, 2].map(|ix: usize| f64::from(dye.data[ix]));
        let back = reflectance_from_sigma_a(sigma, width);
        for (found, expected) in back.into_iter().zip([0.8, 0.5, 0.2]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
        // White absorbs nothing; black as much as there is.
        assert_eq!(dye.data[4..8], [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(dye.data[9..12], [0.0, MAX_SIGMA_A, 1.0]);
    }

    #[test]
    fn a_missing_colour_is_named() {
        let mut groom = head(3);
        let values = vec![0.5; 9];
        groom
            .attributes
            .push(attribute("tint", Domain::Strand, 3, values));
        let error = dye_from_color(&mut groom, "color").unwrap_err().to_string();
        assert!(error.contains("color") && error.contains("tint"), "{error}");
    }
}
