//! Rows of the panel for colours: a name, a button that opens a picker, three numbers, a reset.

use egui::{Align, Layout, Ui};

use super::field::{Changes, fixed, number, reset, rounded, row};

/// Width of names.
const NAME: f32 = 84.0;
/// Width of a channel's number.
const NUMBER: f32 = 53.0;
/// Digits after the point that are kept.
const DECIMALS: usize = 3;

/// One colour of the scene, linear RGB.
pub struct ColorField<'a> {
    name: &'a str,
    most: f64,
    default: [f64; 3],
    help: &'a str,
    key: &'a str,
}

impl<'a> ColorField<'a> {
    /// A colour called `name` with channels of 0..=`most`, which is reset to `default`.
    pub fn new(name: &'a str, most: f64, default: [f64; 3]) -> Self {
        ColorField {
            name,
            most,
            default,
            help: "",
            key: "",
        }
    }

    /// Its key in scene files.
    pub fn key(self, key: &'a str) -> Self {
        ColorField { key, ..self }
    }

    /// What it is for.
    pub fn help(self, help: &'a str) -> Self {
        ColorField { help, ..self }
    }

    /// Shows the row; answers whether `rgb` changed.
    pub fn show(self, ui: &mut Ui, rgb: &mut [f64; 3], changes: &mut Changes) -> bool {
        let before = *rgb;
        row(ui, |ui| {
            let name = fixed(ui, NAME, |ui| ui.label(self.name));
            name.on_hover_ui(|ui| {
                if !self.help.is_empty() {
                    ui.label(self.help);
                }
                let most = self.most;
                ui.label(format!("Linear red, green and blue, 0 to {most}."));
                if !self.key.is_empty() {
                    ui.monospace(self.key);
                }
            });
            swatch(ui, self.name, rgb, changes);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let to = self.default.map(|x| x.to_string()).join(", ");
                if reset(ui, (*rgb != self.default).then_some(&to)) {
                    *rgb = self.default;
                    changes.note(self.name);
                }
                ui.spacing_mut().item_spacing.x = 3.0;
                for (ix, channel) in [(2, "blue"), (1, "green"), (0, "red")] {
                    self.number(ui, &mut rgb[ix], channel, changes);
                }
            });
        });
        *rgb != before
    }

    fn number(&self, ui: &mut Ui, value: &mut f64, channel: &str, changes: &mut Changes) {
        let initial = channel[..1].to_uppercase();
        let response = number(ui, NUMBER, value, |number| {
            number
                .range(0.0..=self.most)
                .speed(0.005)
                .max_decimals(DECIMALS)
                .prefix(format!("{initial} "))
        });
        changes.of(self.name, &response);
        changes.place(format!("{} {channel} number", self.name), &response);
        response.on_hover_text("Drag, or click to type");
    }
}

/// A button that opens a picker; `rgb` is linear.
pub fn swatch(ui: &mut Ui, name: &str, rgb: &mut [f64; 3], changes: &mut Changes) {
    let mut shown = rgb.map(|x| x as f32);
    let response = ui.color_edit_button_rgb(&mut shown);
    changes.place(format!("{name} swatch"), &response);
    if response.changed() {
        *rgb = shown.map(|x| rounded(f64::from(x), DECIMALS));
        // The picker stays open over many changes: they are one step until something else.
        changes.label = Some(name.to_owned());
    }
    response.on_hover_text("Click to choose a colour");
}
