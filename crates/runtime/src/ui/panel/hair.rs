//! The fibres' optics.

use egui::{RichText, Ui};
use strandlight_formats::params::{Group, HAIR, Kind, Param, Word};
use strandlight_formats::{HairSection, Lobe, Melanin, Scene};
use strandlight_scattering::color::{reflectance_from_sigma_a, sigma_a_from_melanin};

use crate::ui::color::swatch;
use crate::ui::field::{Changes, Field, named, rounded, row};
use crate::ui::keys::Command;
use crate::ui::param::{Rows, help};
use crate::ui::presets::{Presets, SHIPPED, dressed, label_of};
use strandlight_scene::assets::Diameters;
use strandlight_scene::tone;

/// The ways to give the colour, as [`HairSection::COLOR_KEYS`] has them.
const COLORS: [(&str, &str); 3] = [
    (
        "Absorption",
        "How strongly the fibre swallows red, green and blue light, per fibre radius. More of a \
         channel makes the hair darker in it. This is what the physics uses.",
    ),
    (
        "Reflectance",
        "Colour of a full head of hair; the absorption is computed from it.",
    ),
    (
        "Melanin",
        "Pigments of natural hair; the absorption is computed from them.",
    ),
];

/// Preset, colour, shape of the fibre and the lobes of the modes. `own` are the groom's diameters.
pub fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    own: Option<Diameters>,
    presets: &mut Presets,
    changes: &mut Changes,
    commands: &mut Vec<Command>,
) {
    let hair = &mut scene.hair;
    preset(ui, hair, presets, changes, commands);
    // What a value is reset to: that of the preset, or that of every scene.
    let plain = (hair.preset.as_deref())
        .and_then(|name| HairSection::preset(name).ok())
        .unwrap_or_default();
    let mut rows = Rows {
        section: &HAIR,
        target: hair,
        plain: &plain,
        suffix: "",
    };
    color(ui, &mut rows, changes);
    ui.separator();
    let of_group = |group| {
        HAIR.params
            .iter()
            .filter(move |param| param.spec.group == group)
    };
    for param in of_group(Group::Main) {
        match param.spec.key {
            "diameter_cm" => diameter(ui, &mut rows, param, own, changes),
            _ => rows.show(ui, param, changes),
        }
    }
    ui.separator();
    for param in of_group(Group::Lobes) {
        if let Kind::Choices(words) = param.spec.kind {
            modes(ui, &mut rows, param, words, changes);
        }
    }
    for (ix, (lobe, help)) in LOBES.into_iter().enumerate() {
        ui.label(RichText::new(lobe).strong()).on_hover_text(help);
        for param in of_group(Group::Lobes) {
            let Some(numbers) = param.spec.numbers() else {
                continue;
            };
            let parts = numbers.shape.label_suffixes();
            if parts.len() == LOBES.len() {
                let label = format!("{}{}", param.spec.label, parts[ix]);
                rows.number(ui, param, ix, label, |field| field, changes);
            } else if param.spec.key.ends_with(INTENSITIES[ix]) {
                rows.show(ui, param, changes);
            }
        }
    }
}

/// The lobes in the trade's words, in the order of their letters.
const LOBES: [(&str, &str); 3] = [
    (
        "Primary highlight (R)",
        "Light reflected at the surface: the white highlight.",
    ),
    (
        "Transmission (TT)",
        "Light through the fibre: the glow of hair before a light.",
    ),
    (
        "Secondary highlight (TRT)",
        "Light reflected once inside the fibre: the coloured highlight and its glints.",
    ),
];

/// What keys of the lobes' intensities end in.
const INTENSITIES: [&str; 3] = ["_r", "_tt", "_trt"];

fn preset(
    ui: &mut Ui,
    hair: &mut HairSection,
    presets: &mut Presets,
    changes: &mut Changes,
    commands: &mut Vec<Command>,
) {
    let help = "Measured or published hair, and your own. A preset replaces colour, index, shifts and \
                widths.";
    let mut removed = None;
    named(ui, "Preset", help, |ui| {
        let current = hair.preset.clone();
        let is_changed = (current.as_deref())
            .is_some_and(|name| hair.with_preset(name).is_ok_and(|preset| preset != *hair));
        let own = presets.own().iter();
        let mine = own
            .clone()
            .find(|(_, preset)| dressed(hair, preset) == *hair);
        let shown = match (&current, mine) {
            (_, Some((name, _))) => name.clone(),
            (Some(name), None) if is_changed => format!("{} (changed)", label_of(name)),
            (Some(name), None) => label_of(name).to_owned(),
            (None, None) => "none".to_owned(),
        };
        let save = "Save ...";
        let room = ui.available_size_before_wrap().x - 70.0;
        let combo = egui::ComboBox::from_id_salt("preset")
            .width(room)
            .height(360.0)
            .truncate()
            .selected_text(shown)
            .show_ui(ui, |ui| {
                let mut chosen = None;
                for (name, preset) in own {
                    let dressed = dressed(hair, preset);
                    let is_current = mine.is_some_and(|(mine, _)| mine == name);
                    row(ui, |ui| {
                        let label = thumbnail(ui, &dressed, is_current, name, changes);
                        if label.on_hover_text("Your own").clicked() {
                            chosen = Some((name.clone(), dressed));
                        }
                        if ui.small_button("Remove").clicked() {
                            removed = Some(name.clone());
                        }
                    });
                }
                for (name, label, source) in SHIPPED {
                    let Ok(dressed) = hair.with_preset(name) else {
                        continue;
                    };
                    let is_current = current.as_deref() == Some(name) && !is_changed;
                    row(ui, |ui| {
                        let response = thumbnail(ui, &dressed, is_current, label, changes);
                        let text = format!("{source}\n{name}");
                        if response.on_hover_text(text).clicked() {
                            chosen = Some((label.to_owned(), dressed));
                        }
                    });
                }
                chosen
            });
        changes.place("Preset choice", &combo.response);
        if let Some((name, chosen)) = combo.inner.flatten() {
            *hair = chosen;
            changes.note(&format!("Preset {name}"));
        }
        let button = ui.button(save);
        changes.place("Save preset button", &button);
        if button
            .on_hover_text("Save this hair as a preset of your own")
            .clicked()
        {
            commands.push(Command::SavePreset);
        }
    });
    if let Some(name) = removed {
        presets.remove(&name);
    }
}

/// A row of the list of presets: what a head of such hair looks like, from the side that is lit to the
/// highlight, and its name.
fn thumbnail(
    ui: &mut Ui,
    hair: &HairSection,
    is_current: bool,
    name: &str,
    changes: &mut Changes,
) -> egui::Response {
    let params = hair.params();
    let rgb = reflectance_from_sigma_a(params.sigma_a, params.caustic_width);
    let (rect, _) = ui.allocate_exact_size(egui::vec2(36.0, 14.0), egui::Sense::hover());
    // Where the highlights are and how wide, along a strand that bends over 100 degrees.
    const STEPS: usize = 18;
    let lobe = |ix: usize, at: f64, strength: f64| {
        let (shift, width) = match ix {
            0 => (hair.shift_deg.r, hair.width_deg.r),
            _ => (hair.shift_deg.trt, hair.width_deg.trt),
        };
        let off = (at - 2.0 * shift) / (2.0 * width.max(1.0));
        strength * (-0.5 * off * off).exp() * (6.0 / width.max(2.0)).min(1.5)
    };
    for step in 0..STEPS {
        let at = 100.0 * (step as f64 / (STEPS - 1) as f64 - 0.5);
        let level = |color: f64| color * (0.5 + lobe(1, at, 0.9)) + lobe(0, at, 0.16);
        let shown = tone::display(rgb.map(|x| level(x) as f32), tone::ToneMap::None);
        let [r, g, b] = shown.map(|x| tone::level(x.clamp(0.0, 1.0), 0.0));
        let width = rect.width() / STEPS as f32;
        let left = rect.left() + step as f32 * width;
        let stripe = egui::Rect::from_min_size(
            egui::pos2(left, rect.top()),
            egui::vec2(width + 0.5, rect.height()),
        );
        ui.painter()
            .rect_filled(stripe, 0.0, egui::Color32::from_rgb(r, g, b));
    }
    let label = ui.selectable_label(is_current, name);
    changes.place(format!("Preset {name}"), &label);
    label
}

/// Which of [`COLORS`] it is.
fn way_of(hair: &HairSection) -> usize {
    match (&hair.reflectance, &hair.melanin) {
        (Some(_), _) => 1,
        (_, Some(_)) => 2,
        _ => 0,
    }
}

fn color(ui: &mut Ui, rows: &mut Rows<HairSection>, changes: &mut Changes) {
    let way = way_of(rows.target);
    named(ui, "Colour by", COLORS[way].1, |ui| {
        for (ix, (name, help)) in COLORS.into_iter().enumerate() {
            let label = ui.selectable_label(way == ix, name).on_hover_text(help);
            if label.clicked() && way != ix {
                switch_color(rows.target, ix);
                changes.note(&format!("Colour by {}", name.to_lowercase()));
            }
        }
    });
    if let Some(rgb) = &mut rows.target.reflectance {
        let help = "Click to choose a colour";
        named(ui, "Colour", help, |ui| swatch(ui, "Colour", rgb, changes));
    }
    // To begin with, where the preset gives the colour in another way.
    let mut plain = rows.plain.clone();
    plain.reflectance.get_or_insert([0.5; 3]);
    plain.melanin.get_or_insert_default();
    let mut rows = Rows {
        section: rows.section,
        target: &mut *rows.target,
        plain: &plain,
        suffix: "",
    };
    let way = HairSection::COLOR_KEYS[way_of(rows.target)];
    let is_shown = |key: &str| key.split('.').next() == Some(way);
    for param in HAIR.params.iter().filter(|param| is_shown(param.spec.key)) {
        rows.numbers(ui, param, |field, _| field, changes);
    }
}

/// Gives the same colour in another way, as nearly as that can.
fn switch_color(hair: &mut HairSection, way: usize) {
    let params = hair.params();
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
fn diameter(
    ui: &mut Ui,
    rows: &mut Rows<HairSection>,
    param: &Param<HairSection>,
    own: Option<Diameters>,
    changes: &mut Changes,
) {
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
    let Some(numbers) = param.spec.numbers() else {
        return;
    };
    let [low, high] = [numbers.min, numbers.max].map(micrometres);
    let before = rows.target.diameter_cm.map(micrometres);
    let mut value = before;
    Field::of(
        param.spec.label,
        &rows.key(param),
        numbers,
        mean.clamp(low, high),
    )
    .range(low..=high)
    .unit(" µm")
    .slider(20.0..=f64::max(200.0, (2.0 * max).min(high)))
    .decimals(1)
    .help(param.spec.help)
    .show_override(ui, &mut value, &text, changes);
    if value != before {
        rows.target.diameter_cm = value.map(|micrometres| rounded(micrometres * 1e-4, 8));
    }
}

/// A box for each mode.
fn modes(
    ui: &mut Ui,
    rows: &mut Rows<HairSection>,
    param: &Param<HairSection>,
    words: &[Word],
    changes: &mut Changes,
) {
    let help = help(param.spec.help, &rows.key(param));
    let hair = &mut *rows.target;
    named(ui, param.spec.label, &help, |ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        for (mode, (_, name, help)) in Lobe::ALL.into_iter().zip(words) {
            let mut is_on = hair.modes.contains(&mode);
            let is_last = is_on && hair.modes.len() == 1;
            let response = ui
                .add_enabled(!is_last, egui::Checkbox::new(&mut is_on, *name))
                .on_hover_text(*help)
                .on_disabled_hover_text("At least one mode must be enabled.");
            if response.changed() {
                hair.modes = Lobe::ALL
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
            let before = hair.params().sigma_a;
            switch_color(&mut hair, way);
            let after = hair.params().sigma_a;
            for (a, b) in before.into_iter().zip(after) {
                assert!((a / b - 1.0).abs() < 0.02, "{way}: {before:?} {after:?}");
            }
        }
        let black = nearest_melanin([50.0; 3]);
        assert!(black.eumelanin <= 20.0 && black.pheomelanin >= 0.0);
    }
}
