//! The brush.

use egui::Ui;
use strandlight_formats::{MAX_SCALE, MIN_SCALE, Scene};
use strandlight_scattering::color::sigma_a_from_reflectance;

use crate::ui::color::ColorField;
use crate::ui::field::{Changes, Field, named, row};
use crate::ui::keys::Command;
use crate::ui::mask_layer::MaskLayer;
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
    Mask,
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
    /// The mask over the picture.
    pub mask_layer: MaskLayer,
    what: What,
    /// The mask brush releases hair in place of protecting it.
    is_releasing: bool,
    /// The mask is hidden even while its brush is chosen.
    is_mask_hidden: bool,
    /// Colour of a whole head that is dyed so, linear RGB.
    reflectance: [f64; 3],
    width_scale: f64,
    shift_scale: f64,
    radius_cm: f64,
    strength: f64,
    softness: f64,
    along_cm: f64,
    is_symmetric: bool,
    /// Part of each strand: from, to, and how softly it ends.
    part: [f64; 3],
}

impl Default for PaintState {
    fn default() -> Self {
        let (brush, part) = (Brush::default(), BrushMask::default());
        PaintState {
            is_on: false,
            radius_px: None,
            is_picking: false,
            photo: None,
            is_photo_open: false,
            mask_layer: MaskLayer::default(),
            is_releasing: false,
            is_mask_hidden: false,
            what: What::Dye,
            reflectance: DYE,
            width_scale: 0.5,
            shift_scale: 1.5,
            radius_cm: brush.radius_cm.into(),
            strength: brush.strength.into(),
            softness: brush.softness.into(),
            along_cm: brush.along_cm.into(),
            is_symmetric: brush.is_symmetric,
            part: [part.from, part.to, part.soft].map(|x| (f64::from(x) * 1e3).round() / 1e3),
        }
    }
}

impl PaintState {
    /// The brush for the hair of `scene`.
    pub fn brush(&self, scene: &Scene) -> Brush {
        let caustic_width = scene.hair.params().caustic_width;
        let [from, to, soft] = self.part.map(|x| x as f32);
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
                What::Mask if self.is_releasing => BrushEffect::Protect(0.0),
                What::Mask => BrushEffect::Protect(1.0),
            },
            softness: self.softness as f32,
            along_cm: self.along_cm as f32,
            is_symmetric: self.is_symmetric,
            mask: BrushMask { from, to, soft },
        }
    }

    /// What the brush does with Shift: for the mask the opposite.
    pub fn other(&self, effect: BrushEffect) -> BrushEffect {
        match effect {
            BrushEffect::Protect(protect) => BrushEffect::Protect(1.0 - protect),
            _ => effect,
        }
    }

    /// Is the mask shown over the picture?
    pub fn is_mask_shown(&self) -> bool {
        self.what == What::Mask && !self.is_mask_hidden
    }
}

/// Parts of a strand: from, to.
const PARTS: [(&str, [f64; 2]); 4] = [
    ("Whole", [0.0, 1.0]),
    ("Root", [0.0, 0.3]),
    ("Middle", [0.35, 0.65]),
    ("Tip", [0.7, 1.0]),
];

/// The brush. Its settings are no edit of the scene; `places` hears where they are. `is_masked` tells of hair that is
/// protected.
pub fn show(
    ui: &mut Ui,
    state: &mut PaintState,
    is_masked: bool,
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
    let help = "Hair that is masked is left alone by all other brushes, as far as it is masked.";
    brushes(ui, "Protect", help, &PROTECTING, state, &mut changes);
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
        What::Mask => protecting(ui, state, &mut changes),
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
    part(ui, state, &mut changes);
    row(ui, |ui| {
        let can_flood = state.what != What::Smear;
        let button = ui.add_enabled(can_flood, egui::Button::new("Flood"));
        changes.place("Flood button", &button);
        let help = "Paints or masks all hair, within the part above and with the strength. Blur evens out along each strand.";
        if button.on_hover_text(help).clicked() {
            commands.push(Command::Flood);
        }
    });
    mask(ui, is_masked, &mut changes, commands);
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

/// What keeps the others off.
const PROTECTING: [NamedBrush; 1] = [(
    What::Mask,
    "Mask",
    "Protects hair from the other brushes; Shift + drag releases it. Masks change no picture and are saved with the groom.",
)];

/// What the mask brush does.
fn protecting(ui: &mut Ui, state: &mut PaintState, changes: &mut Changes) {
    let help = "Protect hair from brushes, or release it. Shift while dragging does the other.";
    named(ui, "Mask brush", help, |ui| {
        for (name, is_releasing) in [("Protect", false), ("Release", true)] {
            let label = ui.selectable_label(state.is_releasing == is_releasing, name);
            changes.place(format!("{name} choice"), &label);
            if label.clicked() {
                state.is_releasing = is_releasing;
            }
        }
    });
    let help = "Tints masked hair blue while this brush is chosen.";
    named(ui, "Overlay", help, |ui| {
        let mut is_shown = !state.is_mask_hidden;
        let shown = ui.checkbox(&mut is_shown, "Show the mask");
        changes.place("Show mask", &shown);
        state.is_mask_hidden = !is_shown;
    });
}

/// Whether hair is masked, and what is done to the mask as a whole.
fn mask(ui: &mut Ui, is_masked: bool, changes: &mut Changes, commands: &mut Vec<Command>) {
    let help = "Masked hair is left alone by brushes.";
    named(ui, "Mask", help, |ui| {
        for (text, is_enabled, command, help) in [
            (
                "Invert",
                true,
                Command::InvertMask,
                "Masks what is not masked, and releases the rest.",
            ),
            ("Clear", is_masked, Command::ClearMask, "Releases all hair."),
        ] {
            let button = ui.add_enabled(is_enabled, egui::Button::new(text));
            changes.place(format!("{text} mask button"), &button);
            if button.on_hover_text(help).clicked() {
                commands.push(command);
            }
        }
        ui.weak(if is_masked { "in use" } else { "none" });
    });
}

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
            ui.weak("or drop a photo (PNG, JPEG)");
        } else if ui.selectable_label(state.is_photo_open, "Photo").clicked() {
            state.is_photo_open = !state.is_photo_open;
        }
    });
}

fn part(ui: &mut Ui, state: &mut PaintState, changes: &mut Changes) {
    let help = "Part of each strand that receives paint";
    named(ui, "Part", help, |ui| {
        for (name, [from, to]) in PARTS {
            let is_chosen = state.part[..2] == [from, to];
            if ui.selectable_label(is_chosen, name).clicked() {
                [state.part[0], state.part[1]] = [from, to];
            }
        }
    });
    let [from, to, soft] = &mut state.part;
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
    pub fn show_photo(&mut self, ctx: &egui::Context, picture: egui::Rect, changes: &mut Changes) {
        let mut is_open = self.is_photo_open;
        if let (true, Some(photo)) = (is_open, &mut self.photo) {
            let picked = photo.show(ctx, picture, &mut is_open, changes);
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
