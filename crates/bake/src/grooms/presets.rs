//! What other programs expect of files of hair.

use strandlight_formats::UpAxis;

/// A program that hair goes to. Points are root first and curves linear for all of them: cubic curves
/// are read in too many ways.
#[derive(Debug)]
pub struct Preset {
    /// Name, as the command line has it.
    pub name: &'static str,
    /// Formats that it takes by their names in the table of formats, the usual one first.
    pub formats: &'static [&'static str],
    /// Centimetres per unit.
    pub cm_per_unit: f64,
    /// Up axis.
    pub up: UpAxis,
    /// What it expects, for the help.
    pub expects: &'static str,
}

/// All of them.
pub static PRESETS: [Preset; 6] = [
    // Alembic stores neither unit nor axis, and Unreal takes numbers for centimetres; it reads the
    // groom_* schema alone, and draws strands 1 cm wide where no widths are written.
    Preset {
        name: "unreal",
        formats: &["alembic"],
        cm_per_unit: 1.0,
        up: UpAxis::Y,
        expects: "Alembic with Unreal's groom_* attributes, cm, Y up, widths as diameters",
    },
    // Blender's USD importer keeps values per strand and point, its Alembic importer drops them; its
    // scenes are in metres with Z up, and it halves widths to radii itself.
    Preset {
        name: "blender",
        formats: &["usd"],
        cm_per_unit: 100.0,
        up: UpAxis::Z,
        expects: "USD, metres, Z up, widths as diameters",
    },
    // Unity's hair package reads Alembic, whose importer takes numbers for cm (its scale factor is 0.01
    // unless it is changed); its USD importer reads BasisCurves, and the unit that the file states.
    Preset {
        name: "unity",
        formats: &["alembic", "usd"],
        cm_per_unit: 1.0,
        up: UpAxis::Y,
        expects: "Alembic or USD, cm, Y up, widths as diameters",
    },
    // What metersPerUnit and upAxis mean where they are not written.
    Preset {
        name: "usd",
        formats: &["usd"],
        cm_per_unit: 1.0,
        up: UpAxis::Y,
        expects: "USD, cm, Y up, widths as diameters",
    },
    Preset {
        name: "mitsuba",
        formats: &["mitsuba"],
        cm_per_unit: 1.0,
        up: UpAxis::Y,
        expects: "Mitsuba's text of curves, cm, Y up, widths as radii",
    },
    Preset {
        name: "pbrt",
        formats: &["pbrt"],
        cm_per_unit: 1.0,
        up: UpAxis::Y,
        expects: "pbrt's curve shapes, cm, Y up, widths as diameters at both ends",
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_formats::groom_format;

    /// Formats come one by one; once the large two are there, all must be.
    #[test]
    fn every_preset_writes_a_format_of_the_table() {
        let is_complete = groom_format("alembic").is_some() && groom_format("usd").is_some();
        let mut n_found = 0;
        for preset in &PRESETS {
            for name in preset.formats {
                match groom_format(name) {
                    Some(format) => {
                        assert!(format.info().can.writes, "--to {}: {name}", preset.name);
                        n_found += 1;
                    }
                    None => assert!(!is_complete, "--to {}: no format {name}", preset.name),
                }
            }
        }
        assert!(!is_complete || n_found == 7, "{n_found}");
    }
}
