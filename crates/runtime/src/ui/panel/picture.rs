//! What is drawn of the light, and how radiance becomes a picture.

use std::path::PathBuf;

use egui::Ui;
use strandlight_formats::params::{Kind, Numbers, ParamSpec, RENDER, Shape, Word};
use strandlight_formats::{Background, RenderSection, Scene};

use crate::ui::color::ColorField;
use crate::ui::field::named;
use crate::ui::field::{Changes, rounded};
use crate::ui::param::{Rows, help};

/// Why there is no map to choose, and how to get one.
const NO_MAP: &str = "The scene has no panorama. Open or drop an HDR map, or a .panorama file that `strandlight \
                      lights --panorama` made of one.";

/// A colour behind the hair to begin with: middle grey.
const BACKDROP: [f32; 3] = [0.18; 3];

/// Scattering, grading, background, samples and shadow maps. `backdrop` is the last colour that was
/// behind the hair; `has_map` says whether the scene's panorama is there.
pub fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    (backdrop, has_map): (&mut Option<[f32; 3]>, bool),
    changes: &mut Changes,
) {
    let plain = RenderSection::default();
    let mut rows = Rows {
        section: &RENDER,
        target: &mut scene.render,
        plain: &plain,
        suffix: "",
    };
    for param in RENDER.params {
        match param.spec.kind {
            Kind::ChoiceOrColor(words, numbers) => {
                let help = help(param.spec.help, &rows.key(param));
                let named = (param.spec.label, help.as_str());
                background(
                    ui,
                    named,
                    words,
                    &numbers,
                    (&mut rows.target.background, backdrop, has_map),
                    changes,
                );
            }
            Kind::File => lut(
                ui,
                param.spec,
                &rows.key(param),
                &mut rows.target.lut,
                changes,
            ),
            // Of no effect without one.
            _ if param.spec.key == "lut_input" && rows.target.lut.is_none() => {}
            _ if param.spec.key == "tone_map" && rows.target.lut.is_some() => {}
            // The size is that of the window's picture.
            Kind::Numbers(numbers) if numbers.shape == Shape::Size => {}
            _ => rows.show(ui, param, changes),
        }
    }
}

/// The LUT in place of the tone map, and a button that takes it away.
fn lut(ui: &mut Ui, spec: ParamSpec, key: &str, file: &mut Option<PathBuf>, changes: &mut Changes) {
    named(ui, spec.label, &help(spec.help, key), |ui| {
        let Some(path) = &*file else {
            ui.weak("none; drop a .cube file");
            return;
        };
        let name = path.file_name().unwrap_or(path.as_os_str());
        let name = name.to_string_lossy();
        let label = egui::Label::new(&*name).truncate();
        ui.add(label).on_hover_text(path.display().to_string());
        let remove = ui.button("Remove").on_hover_text("Back to the tone map");
        changes.place(format!("{} remove", spec.label), &remove);
        if remove.clicked() {
            *file = None;
            changes.note("Remove LUT");
        }
    });
}

fn background(
    ui: &mut Ui,
    (label, help): (&str, &str),
    words: &[Word],
    numbers: &Numbers,
    (background, backdrop, has_map): (&mut Background, &mut Option<[f32; 3]>, bool),
    changes: &mut Changes,
) {
    if let Background::Color(rgb) = background {
        *backdrop = Some(*rgb);
    }
    let kind = match background {
        Background::Lights => 0,
        Background::Panorama => 1,
        Background::None => 2,
        Background::Color(_) => 3,
    };
    named(ui, label, help, |ui| {
        let words = words.iter().map(|(_, name, help)| (*name, *help));
        for (ix, (name, help)) in words.chain([("Colour", "A constant colour.")]).enumerate() {
            let button = egui::Button::selectable(kind == ix, name);
            let choice = ui.add_enabled(ix != 1 || kind == 1 || has_map, button);
            let choice = choice.on_hover_text(help).on_disabled_hover_text(NO_MAP);
            changes.place(format!("{label} {name}"), &choice);
            if choice.clicked() && kind != ix {
                *background = match ix {
                    0 => Background::Lights,
                    1 => Background::Panorama,
                    2 => Background::None,
                    _ => Background::Color(backdrop.unwrap_or(BACKDROP)),
                };
                changes.note(label);
            }
        }
    });
    if let Background::Color(rgb) = background {
        // Through the shortest decimal of the f32: it is what is shown.
        let mut shown = rgb.map(|x| rounded(f64::from(x), 6));
        let plain = BACKDROP.map(f64::from).map(|x| rounded(x, 3));
        let field = ColorField::new("Backdrop", numbers.max, plain).help("Background colour.");
        if field.show(ui, &mut shown, changes) {
            *rgb = shown.map(|x| x as f32);
        }
    }
}
