//! The fibres' optics.

use egui::Ui;
use strandlight_formats::{HairSection, Melanin, Mode, PerModeDeg, Scene, preset_names};
use strandlight_scattering::closed_form::{DENSITY_BACK, DENSITY_FORWARD};
use strandlight_scattering::color::{reflectance_from_sigma_a, sigma_a_from_melanin};

use crate::ui::color::swatch;
use crate::ui::field::{Changes, Field, named, rounded};
use strandlight_scene::assets::{Diameters, hair_params};

/// The ways to give the colour, as [`HairSection::COLOR_KEYS`] has them.
const COLORS: [(&str, &str); 3] = [
    (
        "Absorption",
        "How strongly the fibre swallows red, green and blue light, per fibre radius. More of a \
         channel makes the hair darker in it. This is what the physics uses.",
    ),
    (
        "Reflectance",
        "The colour that a whole head of such hair should have; the absorption is found from it.",
    ),
    (
        "Melanin",
        "The pigments of natural hair; the absorption is found from them.",
    ),
];

/// Preset, colour, shape of the fibre and the lobes of the modes. `own` are the groom's diameters.
pub fn show(ui: &mut Ui, scene: &mut Scene, own: Option<Diameters>, changes: &mut Changes) {
    let hair = &mut scene.hair;
    preset(ui, hair, changes);
    // What a value is reset to: that of the preset, or that of every scene.
    let plain = (hair.preset.as_deref())
        .and_then(|name| HairSection::preset(name).ok())
        .unwrap_or_default();
    color(ui, hair, &plain, changes);
    ui.separator();
    fibre(ui, hair, &plain, own, changes);
    ui.separator();
    lobes(ui, hair, &plain, changes);
}

fn preset(ui: &mut Ui, hair: &mut HairSection, changes: &mut Changes) {
    let help =
        "Measured or published hair. Choosing one replaces colour, index, shifts and widths.";
    named(ui, "Preset", help, |ui| {
        let current = hair.preset.clone();
        let is_changed = (current.as_deref())
            .is_some_and(|name| hair.with_preset(name).is_ok_and(|preset| preset != *hair));
        let mut shown = current.clone().unwrap_or_else(|| "none".to_owned());
        if is_changed {
            shown += " (changed)";
        }
        egui::ComboBox::from_id_salt("preset")
            .width(ui.available_width() - 8.0)
            .height(360.0)
            .selected_text(shown)
            .show_ui(ui, |ui| {
                for name in preset_names() {
                    let is_current = current.as_deref() == Some(name) && !is_changed;
                    if ui.selectable_label(is_current, name).clicked()
                        && let Ok(chosen) = hair.with_preset(name)
                    {
                        *hair = chosen;
                        changes.note(&format!("Preset {name}"));
                    }
                }
            });
    });
}

fn color(ui: &mut Ui, hair: &mut HairSection, plain: &HairSection, changes: &mut Changes) {
    let way = match (&hair.reflectance, &hair.melanin) {
        (Some(_), _) => 1,
        (_, Some(_)) => 2,
        _ => 0,
    };
    named(ui, "Colour by", COLORS[way].1, |ui| {
        for (ix, (name, help)) in COLORS.into_iter().enumerate() {
            let label = ui.selectable_label(way == ix, name).on_hover_text(help);
            if label.clicked() && way != ix {
                switch_color(hair, ix);
                changes.note(&format!("Colour by {}", name.to_lowercase()));
            }
        }
    });
    if let Some(rgb) = &mut hair.reflectance {
        let help = "Click to choose a colour";
        named(ui, "Colour", help, |ui| swatch(ui, "Colour", rgb, changes));
        let default = plain.reflectance.unwrap_or([0.5; 3]);
        for (ix, name) in ["Reflectance red", "Reflectance green", "Reflectance blue"]
            .into_iter()
            .enumerate()
        {
            let field = Field::new(name, 0.0..=1.0, default[ix]).decimals(4);
            field.help(COLORS[1].1).show(ui, &mut rgb[ix], changes);
        }
    } else if let Some(melanin) = &mut hair.melanin {
        let default = plain.melanin.unwrap_or_default();
        Field::new("Eumelanin", 0.0..=20.0, default.eumelanin)
            .slider(0.0..=8.0)
            .help("The brown to black pigment: 0.3 blond, 1.3 brown, 8 black.")
            .show(ui, &mut melanin.eumelanin, changes);
        Field::new("Pheomelanin", 0.0..=20.0, default.pheomelanin)
            .slider(0.0..=8.0)
            .help("The yellow to red pigment: 1 to 2 gives red hair.")
            .show(ui, &mut melanin.pheomelanin, changes);
    } else {
        let default = plain.sigma_a;
        for (ix, name) in ["Absorption red", "Absorption green", "Absorption blue"]
            .into_iter()
            .enumerate()
        {
            let field = Field::new(name, 0.0..=50.0, default[ix]).decimals(3);
            field
                .slider(0.0..=6.0)
                .help(COLORS[0].1)
                .show(ui, &mut hair.sigma_a[ix], changes);
        }
    }
}

/// Gives the same colour in another way, as nearly as that can.
fn switch_color(hair: &mut HairSection, way: usize) {
    let params = hair_params(hair);
    hair.sigma_a = params.sigma_a.map(|x| (x * 1e4).round() / 1e4);
    hair.reflectance = None;
    hair.melanin = None;
    match way {
        1 => {
            let rgb = reflectance_from_sigma_a(params.sigma_a, params.caustic_width);
            // Dark hair sends back a thousandth and less of blue.
            hair.reflectance = Some(rgb.map(|x| (x * 1e6).round() / 1e6));
        }
        2 => hair.melanin = Some(nearest_melanin(params.sigma_a)),
        _ => {}
    }
}

/// Pigments whose absorption is nearest to `sigma_a` in the sense of least squares.
fn nearest_melanin(sigma_a: [f64; 3]) -> Melanin {
    let (e, p) = (
        sigma_a_from_melanin(1.0, 0.0),
        sigma_a_from_melanin(0.0, 1.0),
    );
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (ee, pp, ep) = (dot(e, e), dot(p, p), dot(e, p));
    let (es, ps) = (dot(e, sigma_a), dot(p, sigma_a));
    let determinant = ee * pp - ep * ep;
    let mut found = [
        (es * pp - ps * ep) / determinant,
        (ps * ee - es * ep) / determinant,
    ];
    if found[0] < 0.0 {
        found = [0.0, ps / pp];
    } else if found[1] < 0.0 {
        found = [es / ee, 0.0];
    }
    let [eumelanin, pheomelanin] = found.map(|x| (x.clamp(0.0, 20.0) * 1e3).round() / 1e3);
    Melanin {
        eumelanin,
        pheomelanin,
    }
}

/// Thickness: the groom's own unless the scene has one for all fibres.
fn diameter(ui: &mut Ui, hair: &mut HairSection, own: Option<Diameters>, changes: &mut Changes) {
    let micrometres = |cm: f64| rounded(cm * 1e4, 1);
    let (text, mean, max) = match own {
        Some(own) => {
            let [min, mean, max] = [own.min, own.mean, own.max].map(|cm| micrometres(cm.into()));
            let text = match min == max {
                true => format!("{max} µm (groom)"),
                false => format!("{min}..{max} µm (groom)"),
            };
            (text, mean, max)
        }
        None => {
            let default = micrometres(HairSection::DEFAULT_DIAMETER_CM);
            (format!("{default} µm (default)"), default, default)
        }
    };
    let before = hair.diameter_cm.map(micrometres);
    let mut value = before;
    Field::new("Diameter", 0.1..=1e5, mean.clamp(0.1, 1e5))
        .unit(" µm")
        .slider(20.0..=f64::max(200.0, (2.0 * max).min(1e5)))
        .decimals(1)
        .help("Thickness of a fibre. Human hair has 50 to 100 micrometres.")
        .show_override(ui, &mut value, &text, changes);
    if value != before {
        hair.diameter_cm = value.map(|micrometres| rounded(micrometres * 1e-4, 8));
    }
}

fn fibre(
    ui: &mut Ui,
    hair: &mut HairSection,
    plain: &HairSection,
    own: Option<Diameters>,
    changes: &mut Changes,
) {
    Field::new("Index eta", 1.0001..=3.0, plain.eta)
        .slider(1.2..=2.0)
        .decimals(3)
        .help(
            "Index of refraction. Higher makes the white highlight stronger and moves the \
             coloured one. Human hair has 1.55.",
        )
        .show(ui, &mut hair.eta, changes);
    Field::new("Caustic width", 0.5..=60.0, plain.caustic_width_deg)
        .unit("°")
        .slider(0.5..=30.0)
        .help(
            "Blur around the fibre of light that was reflected inside it. Small values give \
             glints, large ones an even coloured sheen.",
        )
        .show(ui, &mut hair.caustic_width_deg, changes);
    Field::new("Eccentricity", 0.5..=2.0, plain.eccentricity)
        .help("Cross section: 1 is round, otherwise elliptic, which brightens or dims the glints.")
        .show(ui, &mut hair.eccentricity, changes);
    diameter(ui, hair, own, changes);
    for (name, value, default, help) in [
        (
            "Density forward",
            &mut hair.density_forward,
            DENSITY_FORWARD,
            "d_f: share of the light blocked by hair in front that is scattered on. Lower is darker \
             inside the hair.",
        ),
        (
            "Density back",
            &mut hair.density_back,
            DENSITY_BACK,
            "d_b: share of the hair behind a fibre that sends light back to it. Lower is darker \
             and less saturated.",
        ),
    ] {
        let default = f64::from(default);
        let mut shown = value.unwrap_or(default);
        if Field::new(name, 0.0..=1.0, default)
            .help(help)
            .show(ui, &mut shown, changes)
        {
            *value = (shown != default).then_some(shown);
        }
    }
}

/// The modes with what each is to the eye.
const MODES: [(Mode, &str, &str); 3] = [
    (
        Mode::R,
        "R",
        "Reflected off the surface: the white highlight.",
    ),
    (
        Mode::Tt,
        "TT",
        "Through the fibre: the glow of light from behind.",
    ),
    (
        Mode::Trt,
        "TRT",
        "In, off the far wall, and out again: the second, coloured highlight and its glints.",
    ),
];

fn lobes(ui: &mut Ui, hair: &mut HairSection, plain: &HairSection, changes: &mut Changes) {
    let help = "Paths of light through a fibre: switch them off to see what each adds.";
    named(ui, "Modes", help, |ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        for (mode, name, help) in MODES {
            let mut is_on = hair.modes.contains(&mode);
            let is_last = is_on && hair.modes.len() == 1;
            let response = ui
                .add_enabled(!is_last, egui::Checkbox::new(&mut is_on, name))
                .on_hover_text(help)
                .on_disabled_hover_text("At least one mode is drawn.");
            if response.changed() {
                let order = [Mode::R, Mode::Tt, Mode::Trt];
                hair.modes = order
                    .into_iter()
                    .filter(|other| {
                        if *other == mode {
                            is_on
                        } else {
                            hair.modes.contains(other)
                        }
                    })
                    .collect();
                changes.note(&format!("Mode {name}"));
            }
        }
    });
    per_mode(
        ui,
        "Shift",
        &mut hair.shift_deg,
        plain.shift_deg,
        -28.0..=28.0,
        changes,
    );
    per_mode(
        ui,
        "Width",
        &mut hair.width_deg,
        plain.width_deg,
        0.05..=60.0,
        changes,
    );
}

/// A row of three numbers, one for each mode.
fn per_mode(
    ui: &mut Ui,
    name: &str,
    value: &mut PerModeDeg,
    plain: PerModeDeg,
    range: std::ops::RangeInclusive<f64>,
    changes: &mut Changes,
) {
    let help = match name {
        "Shift" => {
            "How far the tilted scales of the fibre move the highlight of a mode along the strand, \
             towards root or tip. Human hair: R -5 to -10 degrees, TT half and TRT one and a half \
             times that the other way."
        }
        _ => {
            "Roughness along the strand: standard deviation of a mode's highlight. Small is glossy, \
             large is matt."
        }
    };
    let (low, high) = (*range.start(), *range.end());
    let slider = if low < 0.0 { -20.0..=20.0 } else { 0.5..=40.0 };
    for (mode, value, plain) in [
        ("R", &mut value.r, plain.r),
        ("TT", &mut value.tt, plain.tt),
        ("TRT", &mut value.trt, plain.trt),
    ] {
        Field::new(&format!("{name} {mode}"), low..=high, plain)
            .unit("°")
            .slider(slider.clone())
            .help(help)
            .show(ui, value, changes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_survives_another_way_to_give_it() {
        for way in 0..3 {
            let mut hair = HairSection {
                sigma_a: sigma_a_from_melanin(1.3, 0.4),
                ..HairSection::default()
            };
            let before = hair_params(&hair).sigma_a;
            switch_color(&mut hair, way);
            let after = hair_params(&hair).sigma_a;
            for (a, b) in before.into_iter().zip(after) {
                assert!((a / b - 1.0).abs() < 0.02, "{way}: {before:?} {after:?}");
            }
        }
        let black = nearest_melanin([50.0; 3]);
        assert!(black.eumelanin <= 20.0 && black.pheomelanin >= 0.0);
    }
}
