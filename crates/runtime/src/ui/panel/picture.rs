//! What is drawn of the light, and how radiance becomes a picture.

use egui::Ui;
use strandlight_formats::{Background, RenderSection, Scattering, Scene, ToneMap};

use crate::ui::color::ColorField;
use crate::ui::field::{Changes, Field, named, rounded};

/// Terms of scattering with what they are to the eye.
const TERMS: [(Scattering, &str, &str); 4] = [
    (Scattering::Total, "Total", "All light."),
    (
        Scattering::Single,
        "Single",
        "Light that reaches a fibre unblocked and is scattered once: highlights and hard shadows.",
    ),
    (
        Scattering::Global,
        "Global",
        "Light that hair in front scattered on: the soft glow inside blond hair.",
    ),
    (
        Scattering::Local,
        "Local",
        "Light that comes back from the hair around a fibre: saturated colour.",
    ),
];

/// A colour behind the hair to begin with: middle grey.
const BACKDROP: [f32; 3] = [0.18; 3];

/// Scattering, grading, background, samples and shadow maps.
pub fn show(ui: &mut Ui, scene: &mut Scene, changes: &mut Changes) {
    let render = &mut scene.render;
    let plain = RenderSection::default();
    named(ui, "Scattering", "Which light is drawn", |ui| {
        for (term, name, help) in TERMS {
            let label = ui.selectable_label(render.scattering == term, name);
            if label.on_hover_text(help).clicked() && render.scattering != term {
                render.scattering = term;
                changes.note(&format!("Scattering {}", name.to_lowercase()));
            }
        }
    });
    Field::new("Exposure", -32.0..=32.0, plain.exposure)
        .unit(" stops")
        .slider(-6.0..=6.0)
        .help("Brightness of the picture: one stop more doubles it.")
        .show(ui, &mut render.exposure, changes);
    named(ui, "Tone map", "How bright light fits a screen", |ui| {
        for (tone_map, name, help) in [
            (ToneMap::Filmic, "Filmic", "Highlights roll off as on film."),
            (ToneMap::None, "None", "Clipped at white: for measuring."),
        ] {
            let label = ui.selectable_label(render.tone_map == tone_map, name);
            if label.on_hover_text(help).clicked() && render.tone_map != tone_map {
                render.tone_map = tone_map;
                changes.note("Tone map");
            }
        }
    });
    background(ui, &mut render.background, changes);
    let mut samples = f64::from(render.samples);
    if Field::new("Samples", 1.0..=65536.0, f64::from(plain.samples))
        .slider(4.0..=1024.0)
        .decimals(0)
        .logarithmic()
        .help(
            "Samples a pixel of the finished picture. More give smoother strands and take longer.",
        )
        .show(ui, &mut samples, changes)
    {
        render.samples = samples.round().clamp(1.0, 65536.0) as u32;
    }
    let mut maps = f64::from(render.shadow_maps);
    if Field::new("Shadow maps", 0.0..=4096.0, f64::from(plain.shadow_maps))
        .slider(0.0..=256.0)
        .decimals(0)
        .help(
            "Sharp shadows, shared out among all lights; 0 leaves the soft ones. More cost memory \
             and time when the hair or the lights move.",
        )
        .show(ui, &mut maps, changes)
    {
        render.shadow_maps = maps.round().clamp(0.0, 4096.0) as u32;
    }
}

fn background(ui: &mut Ui, background: &mut Background, changes: &mut Changes) {
    let kind = match background {
        Background::Lights => 0,
        Background::None => 1,
        Background::Color(_) => 2,
    };
    let help = "What is seen between the strands";
    named(ui, "Background", help, |ui| {
        for (ix, (name, help)) in [
            ("Lights", "The environment that lights the hair."),
            ("None", "See-through in saved pictures."),
            ("Colour", "One colour."),
        ]
        .into_iter()
        .enumerate()
        {
            let label = ui.selectable_label(kind == ix, name).on_hover_text(help);
            if label.clicked() && kind != ix {
                *background = match ix {
                    0 => Background::Lights,
                    1 => Background::None,
                    _ => Background::Color(BACKDROP),
                };
                changes.note("Background");
            }
        }
    });
    if let Background::Color(rgb) = background {
        // Through the shortest decimal of the f32: it is what is shown.
        let mut shown = rgb.map(|x| rounded(f64::from(x), 6));
        let plain = BACKDROP.map(f64::from).map(|x| rounded(x, 3));
        let field = ColorField::new("Backdrop", 1e6, plain).help("The colour between the strands.");
        if field.show(ui, &mut shown, changes) {
            *rgb = shown.map(|x| x as f32);
        }
    }
}
