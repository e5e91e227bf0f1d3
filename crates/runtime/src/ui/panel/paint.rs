//! The brush.

use egui::Ui;
use strandlight_formats::{MAX_SCALE, MIN_SCALE, Scene};
use strandlight_scattering::color::sigma_a_from_reflectance;

use crate::ui::color::ColorField;
use crate::ui::field::{Changes, Field, named, row};
use crate::ui::keys::Command;
use crate::ui::photo::Photo;
use strandlight_scene::paint::{Brush, BrushEffect, BrushMask};

/// What the brush puts on hair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    Dye,
    Width,
    Shift,
    Erase,
    Blur,
    Smear,
}

/// The dye to begin with: red.
const DYE: [f64; 3] = [0.5, 0.06, 0.02];

/// The brush as the panel shows it, and where it is.
#[derive(Debug)]
pub struct PaintState {
    /// Drags over the picture paint.
    pub is_on: bool,
    /// Radius in pixels over the hair under the mouse, for the circle that is drawn there.
    pub radius_px: Option<f32>,
    /// The next click on the picture picks the colour of the hair there.
    pub is_picking: bool,
    /// A reference photo, and whether it is shown.
    pub photo: Option<Photo>,
    pub is_photo_open: bool,
    what: What,
    /// Colour of a whole head that is dyed so, linear RGB.
    reflectance: [f64; 3],
    width_scale: f64,
    shift_scale: f64,
    radius_cm: f64,
    strength: f64,
    softness: f64,
    along_cm: f64,
    is_symmetric: bool,
    mask: [f64; 3],
}

impl Default for PaintState {
    fn default() -> Self {
        let (brush, mask) = (Brush::default(), BrushMask::default());
        PaintState {
            is_on: false,
            radius_px: None,
            is_picking: false,
            photo: None,
            is_photo_open: false,
            what: What::Dye,
            reflectance: DYE,
            width_scale: 0.5,
            shift_scale: 1.5,
            radius_cm: brush.radius_cm.into(),
            strength: brush.strength.into(),
            softness: brush.softness.into(),
            along_cm: brush.along_cm.into(),
            is_symmetric: brush.is_symmetric,
            mask: [mask.from, mask.to, mask.soft].map(|x| (f64::from(x) * 1e3).round() / 1e3),
        }
    }
}

impl PaintState {
    /// The brush for the hair of `scene`.
    pub fn brush(&self, scene: &Scene) -> Brush {
        let caustic_width = scene.hair.params().caustic_width;
        let [from, to, soft] = self.mask.map(|x| x as f32);
        Brush {
            radius_cm: self.radius_cm as f32,
            strength: self.strength as f32,
            effect: match self.what {
                What::Dye => {
                    let sigma_a = sigma_a_from_reflectance(self.reflectance, caustic_width);
                    BrushEffect::Dye(sigma_a.map(|x| x as f32))
                }
                What::Width => BrushEffect::WidthScale(self.width_scale as f32),
                What::Shift => BrushEffect::ShiftScale(self.shift_scale as f32),
                What::Erase => BrushEffect::Erase,
                What::Blur => BrushEffect::Blur,
                What::Smear => BrushEffect::Smear,
            },
            softness: self.softness as f32,
            along_cm: self.along_cm as f32,
            is_symmetric: self.is_symmetric,
            mask: BrushMask { from, to, soft },
        }
    }
}

/// Parts of a strand: from, to.
const MASKS: [(&str, [f64; 2]); 4] = [
    ("Whole", [0.0, 1.0]),
    ("Root", [0.0, 0.3]),
    ("Middle", [0.35, 0.65]),
    ("Tip", [0.7, 1.0]),
];

/// The brush. Its settings are no edit of the scene; `places` hears where they are.
pub fn show(
    ui: &mut Ui,
    state: &mut PaintState,
    places: &mut Changes,
    commands: &mut Vec<Command>,
) {
    // Changes of the brush itself are not undone.
    let mut changes = Changes::default();
    row(ui, |ui| {
        let text = if state.is_on {
            "Painting: drag over the hair"
        } else {
            "Start painting"
        };
        let button = ui.add(egui::Button::new(text).selected(state.is_on));
        changes.place("Paint toggle", &button);
        let help = "Drags over the picture paint (B). Ctrl + drag orbits meanwhile; middle and \
                    right drag pan and dolly as ever.";
        if button.on_hover_text(help).clicked() {
            state.is_on = !state.is_on;
        }
    });
    let help = "Effect of the brush on the strands. Paint is saved with the groom.";
    brushes(ui, "Brush", help, &BRUSHES, state, &mut changes);
    let help = "Brushes for the paint that is there.";
    brushes(ui, "Blend", help, &BLENDING, state, &mut changes);
    let scale = f64::from(MIN_SCALE)..=f64::from(MAX_SCALE);
    match state.what {
        What::Dye => {
            ColorField::new("Dye", 1.0, DYE)
                .help("Colour of a full head of hair with this dye.")
                .show(ui, &mut state.reflectance, &mut changes);
            picking(ui, state, &mut changes);
        }
        What::Width => {
            Field::new("Width factor", scale, 1.0)
                .slider(0.25..=4.0)
                .logarithmic()
                .help("1 keeps the hair's width.")
                .show(ui, &mut state.width_scale, &mut changes);
        }
        What::Shift => {
            Field::new("Shift factor", scale, 1.0)
                .slider(0.25..=4.0)
                .logarithmic()
                .help("1 keeps the hair's shift.")
                .show(ui, &mut state.shift_scale, &mut changes);
        }
        What::Erase | What::Blur | What::Smear => {}
    }
    let plain = Brush::default();
    Field::new("Size", 0.01..=100.0, plain.radius_cm.into())
        .unit(" cm")
        .slider(0.1..=10.0)
        .logarithmic()
        .help("Brush radius. [ and ] decrease and increase it.")
        .show(ui, &mut state.radius_cm, &mut changes);
    Field::new("Strength", 0.0..=1.0, plain.strength.into())
        .help("Effect of one stroke. Passing over a point again in the same stroke adds nothing.")
        .show(ui, &mut state.strength, &mut changes);
    Field::new("Soft edge", 0.0..=1.0, plain.softness.into())
        .help("Fraction of the radius over which the brush fades.")
        .show(ui, &mut state.softness, &mut changes);
    Field::new("Along strand", 0.0..=100.0, 0.0)
        .unit(" cm")
        .slider(0.0..=20.0)
        .help("Distance beyond the brush over which paint fades along each strand.")
        .show(ui, &mut state.along_cm, &mut changes);
    let help = "Mirrors strokes to the other side of the head.";
    named(ui, "Symmetric", help, |ui| {
        ui.checkbox(&mut state.is_symmetric, "Mirror left and right");
    });
    mask(ui, state, &mut changes);
    row(ui, |ui| {
        let can_flood = state.what != What::Smear;
        let button = ui.add_enabled(can_flood, egui::Button::new("Flood"));
        changes.place("Flood button", &button);
        let help = "Paints all hair, within the part above and with the strength. Blur evens out along each strand.";
        if button.on_hover_text(help).clicked() {
            commands.push(Command::Flood);
        }
    });
    places.places.append(&mut changes.places);
    places.refused = places.refused.take().or(changes.refused);
}

type NamedBrush = (What, &'static str, &'static str);

/// What puts something on hair, with what each does.
const BRUSHES: [NamedBrush; 4] = [
    (What::Dye, "Colour", "Dyes the hair."),
    (
        What::Width,
        "Gloss",
        "Scales the widths of all lobes; below 1 is glossier.",
    ),
    (
        What::Shift,
        "Shift",
        "Scales the shifts of the highlights along the strand.",
    ),
    (What::Erase, "Erase", "Removes all paint."),
];

/// What spreads what is there.
const BLENDING: [NamedBrush; 2] = [
    (What::Blur, "Blur", "Evens out the paint under the brush."),
    (What::Smear, "Smear", "Drags paint along the stroke."),
];

/// A row of brushes to choose from.
fn brushes(
    ui: &mut Ui,
    label: &str,
    help: &str,
    of: &[NamedBrush],
    state: &mut PaintState,
    changes: &mut Changes,
) {
    named(ui, label, help, |ui| {
        for &(what, name, help) in of {
            let label = ui.selectable_label(state.what == what, name);
            changes.place(format!("{name} brush"), &label);
            if label.on_hover_text(help).clicked() {
                state.what = what;
            }
        }
    });
}

/// Where the dye's colour may come from.
fn picking(ui: &mut Ui, state: &mut PaintState, changes: &mut Changes) {
    row(ui, |ui| {
        let text = match state.is_picking {
            true => "Click the hair ...",
            false => "Pick from hair",
        };
        let button = ui.add(egui::Button::new(text).selected(state.is_picking));
        changes.place("Pick colour button", &button);
        let help =
            "The dye takes the colour of the strand that is clicked, with its paint and variation.";
        if button.on_hover_text(help).clicked() {
            state.is_picking = !state.is_picking;
        }
        if state.photo.is_none() {
            ui.weak("or drop a PNG photo");
        } else if ui.selectable_label(state.is_photo_open, "Photo").clicked() {
            state.is_photo_open = !state.is_photo_open;
        }
    });
}

fn mask(ui: &mut Ui, state: &mut PaintState, changes: &mut Changes) {
    let help = "Part of each strand that receives paint";
    named(ui, "Part", help, |ui| {
        for (name, [from, to]) in MASKS {
            let is_chosen = state.mask[..2] == [from, to];
            if ui.selectable_label(is_chosen, name).clicked() {
                [state.mask[0], state.mask[1]] = [from, to];
            }
        }
    });
    let [from, to, soft] = &mut state.mask;
    Field::new("Part from", 0.0..=1.0, 0.0)
        .help("0 is the root, 1 the tip.")
        .show(ui, from, changes);
    Field::new("Part to", 0.0..=1.0, 1.0)
        .help("0 is the root, 1 the tip.")
        .show(ui, to, changes);
    *to = to.max(*from);
    Field::new("Part fades", 0.0..=1.0, 0.1)
        .help("Fraction of the strand over which paint fades beyond this part.")
        .show(ui, soft, changes);
}

impl PaintState {
    /// Dyes in this colour of a whole head from now on, linear RGB.
    pub fn dye(&mut self, reflectance: [f64; 3]) {
        self.what = What::Dye;
        self.reflectance = reflectance.map(|x| (x.clamp(0.0, 1.0) * 1e4).round() / 1e4);
    }

    /// Shows a reference photo.
    pub fn open_photo(&mut self, photo: Photo) {
        (self.photo, self.is_photo_open) = (Some(photo), true);
    }

    /// The photo in its window, if it is open.
    pub fn show_photo(&mut self, ctx: &egui::Context, changes: &mut Changes) {
        let mut is_open = self.is_photo_open;
        if let (true, Some(photo)) = (is_open, &mut self.photo) {
            let picked = photo.show(ctx, &mut is_open, changes);
            self.is_photo_open = is_open;
            if let Some(color) = picked {
                self.dye(color);
            }
        }
    }

    /// Makes the brush `factor` as large.
    pub fn scale(&mut self, factor: f64) {
        self.radius_cm = (self.radius_cm * factor * 1e3).round() * 1e-3;
        self.radius_cm = self.radius_cm.clamp(0.01, 100.0);
    }
}
