//! Rows of the panel: a name with its range, a slider, a number that is dragged or typed, and a
//! reset. What they change is noted for undo.

use std::cell::{Cell, RefCell};
use std::ops::RangeInclusive;

use egui::{Align, Color32, Layout, Rect, Response, RichText, Shape, Stroke, Ui, Vec2};
use strandlight_formats::params::Numbers;

use super::number::parse;
use super::theme;

/// What the controls of a frame changed.
#[derive(Debug, Default)]
pub struct Changes {
    /// What was changed, as undo names it.
    pub label: Option<String>,
    /// The change is complete: the next one is another step of undo.
    pub is_complete: bool,
    /// What was typed and not taken, and why.
    pub refused: Option<String>,
    /// Where controls are, points, for the log: tests click on them.
    pub places: Vec<(String, Rect)>,
}

impl Changes {
    /// Notes where the control `name` is.
    pub fn place(&mut self, name: impl Into<String>, response: &Response) {
        self.places.push((name.into(), response.rect));
    }

    /// Notes that a control changed `label` at once: a click, a choice, a typed value.
    pub fn note(&mut self, label: &str) {
        self.label = Some(label.to_owned());
        self.is_complete = true;
    }

    /// Notes what `response` says of the control for `label`, which may be in the middle of a drag.
    pub fn of(&mut self, label: &str, response: &Response) {
        if response.changed() {
            self.label = Some(label.to_owned());
            self.is_complete |= !response.dragged();
        }
        self.is_complete |= response.drag_stopped();
    }
}

/// Height of a row of the panel.
pub const ROW: f32 = 20.0;
/// Width of names and ranges.
const NAME: f32 = 150.0;
/// Width of numbers.
const NUMBER: f32 = 62.0;
/// Width of the reset.
const RESET: f32 = 20.0;

/// Width of a name and three long choices.
const CHOICES: f32 = 310.0;

/// One number of the scene.
pub struct Field {
    name: String,
    range: RangeInclusive<f64>,
    unit: String,
    default: f64,
    decimals: usize,
    help: String,
    key: String,
    is_logarithmic: bool,
    slider: Option<RangeInclusive<f64>>,
}

impl Field {
    /// A number called `name` in `range`, which is reset to `default`.
    pub fn new(name: impl Into<String>, range: RangeInclusive<f64>, default: f64) -> Self {
        Field {
            name: name.into(),
            range,
            unit: String::new(),
            default,
            decimals: 2,
            help: String::new(),
            key: String::new(),
            is_logarithmic: false,
            slider: None,
        }
    }

    /// One of the `numbers` of a parameter of the scene, whose key is `key` in scene files.
    pub fn of(name: impl Into<String>, key: &str, numbers: &Numbers, default: f64) -> Self {
        Field {
            unit: numbers.unit_suffix(),
            decimals: numbers.decimals,
            key: key.to_owned(),
            is_logarithmic: numbers.is_logarithmic,
            slider: numbers.slider.map(|[low, high]| low..=high),
            ..Field::new(name, numbers.min..=numbers.max, default)
        }
    }

    /// Takes no more than this part of its range.
    pub fn range(self, range: RangeInclusive<f64>) -> Self {
        Field { range, ..self }
    }

    /// Its unit, with a leading space where one belongs.
    pub fn unit(self, unit: impl Into<String>) -> Self {
        let unit = unit.into();
        Field { unit, ..self }
    }

    /// Digits after the point.
    pub fn decimals(self, decimals: usize) -> Self {
        Field { decimals, ..self }
    }

    /// What it is for, in words that need no paper.
    pub fn help(self, help: impl Into<String>) -> Self {
        let help = help.into();
        Field { help, ..self }
    }

    /// Its slider moves by factors.
    pub fn logarithmic(self) -> Self {
        Field {
            is_logarithmic: true,
            ..self
        }
    }

    /// The slider covers less than the range; the rest can be typed.
    pub fn slider(self, range: RangeInclusive<f64>) -> Self {
        Field {
            slider: Some(range),
            ..self
        }
    }

    /// Shows the row; answers whether `value` changed.
    pub fn show(self, ui: &mut Ui, value: &mut f64, changes: &mut Changes) -> bool {
        let before = *value;
        let reset_to = (*value != self.default).then(|| self.text(self.default));
        if self.controls(ui, value, reset_to.as_deref(), changes) {
            *value = self.default;
        }
        *value != before
    }

    /// Shows the row of a value that the scene may leave to a file, which has `own` then. Without
    /// a value of the scene that is read only, and a button overrides it with the default; reset
    /// takes the scene's value away again.
    pub fn show_override(
        self,
        ui: &mut Ui,
        value: &mut Option<f64>,
        own: &str,
        changes: &mut Changes,
    ) {
        if let Some(number) = value {
            if self.controls(ui, number, Some(own), changes) {
                *value = None;
            }
            return;
        }
        row(ui, |ui| {
            let help = format!("{} Override applies one value to all hair.", self.help);
            let name = fixed(ui, 0.5 * NAME, |ui| ui.label(&self.name));
            name.on_hover_ui(|ui| {
                ui.label(help);
                self.show_key(ui);
            });
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.allocate_space(egui::vec2(RESET, ROW));
                let button = ui.add_sized([NUMBER, ROW - 2.0], egui::Button::new("Override"));
                changes.place(format!("{} override", self.name), &button);
                let text = format!(
                    "One value for all hair, initially {}",
                    self.text(self.default)
                );
                if button.on_hover_text(text).clicked() {
                    *value = Some(self.default);
                    changes.note(&self.name);
                }
                let own =
                    ui.add(egui::Label::new(RichText::new(own).color(theme::WEAK)).truncate());
                changes.place(format!("{} own", self.name), &own);
            });
        });
    }

    /// The row with a reset button where there is something to `reset_to`; answers whether that was
    /// clicked.
    fn controls(
        &self,
        ui: &mut Ui,
        value: &mut f64,
        reset_to: Option<&str>,
        changes: &mut Changes,
    ) -> bool {
        let mut is_reset = false;
        row(ui, |ui| {
            self.name(ui);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                is_reset = reset(ui, reset_to);
                if is_reset {
                    changes.note(&self.name);
                }
                let typed = Typed {
                    name: &self.name,
                    range: self.range.clone(),
                    unit: &self.unit,
                };
                let response = number(ui, NUMBER, value, &typed, changes, |number| {
                    number
                        .speed(self.speed())
                        .max_decimals(self.decimals)
                        .suffix(&self.unit)
                });
                changes.of(&self.name, &response);
                changes.place(format!("{} number", self.name), &response);
                response.on_hover_text("Drag, or click to type: 1.6, 1.6mm, 2*0.8");
                let slider = self.slider.clone().unwrap_or(self.range.clone());
                let mut at = self.on_slider(*value, &slider);
                ui.spacing_mut().slider_width = (ui.available_width() - 4.0).max(0.0);
                let slider = egui::Slider::new(&mut at, slider)
                    .show_value(false)
                    .logarithmic(self.is_logarithmic)
                    .smallest_positive(10f64.powi(-(self.decimals as i32)))
                    .clamping(egui::SliderClamping::Never);
                let response = ui.add(slider);
                if response.changed() {
                    *value = rounded(at, self.decimals);
                }
                changes.of(&self.name, &response);
                changes.place(format!("{} slider", self.name), &response);
            });
        });
        is_reset
    }

    /// Where the slider has `value`: an angle beyond a whole turn of it is where it points.
    fn on_slider(&self, value: f64, slider: &RangeInclusive<f64>) -> f64 {
        let (low, turn) = (*slider.start(), slider.end() - slider.start());
        match self.unit == "°" && turn == 360.0 && !slider.contains(&value) {
            true => low + (value - low).rem_euclid(turn),
            false => value,
        }
    }

    fn name(&self, ui: &mut Ui) {
        let (low, high) = (self.text(*self.range.start()), self.text(*self.range.end()));
        let response = fixed(ui, NAME, |ui| {
            let name = ui.label(&self.name);
            let [from, to] = match &self.slider {
                Some(slider) => [slider.start(), slider.end()]
                    .map(|&end| self.text(rounded(end, self.decimals))),
                None => [low.clone(), high.clone()],
            };
            let range = RichText::new(format!("{}..{to}", from.trim_end_matches(&self.unit)));
            name | ui.label(range.small().color(theme::WEAK))
        });
        response.on_hover_ui(|ui| {
            if !self.help.is_empty() {
                ui.label(&self.help);
            }
            let range = format!(
                "Range {low} to {high}, default {}.",
                self.text(self.default)
            );
            ui.label(RichText::new(range).color(theme::WEAK));
            self.show_key(ui);
        });
    }

    /// The key that scene files and `--set` have, where it is a parameter of the scene.
    fn show_key(&self, ui: &mut Ui) {
        if !self.key.is_empty() {
            ui.monospace(&self.key);
        }
    }

    fn text(&self, value: f64) -> String {
        let value = rounded(value, self.decimals.max(4));
        format!("{value}{}", self.unit)
    }

    fn speed(&self) -> f64 {
        let range = self.slider.as_ref().unwrap_or(&self.range);
        ((range.end() - range.start()) / 400.0).min(1.0)
    }
}

/// A row of controls of the panel's height.
pub fn row<R>(ui: &mut Ui, controls: impl FnOnce(&mut Ui) -> R) -> R {
    let size = egui::vec2(ui.available_width(), ROW);
    let layout = Layout::left_to_right(Align::Center);
    ui.allocate_ui_with_layout(size, layout, controls).inner
}

/// A row with `name` before its controls, which go on below where the panel is too narrow.
pub fn named<R>(ui: &mut Ui, name: &str, help: &str, controls: impl FnOnce(&mut Ui) -> R) -> R {
    let size = egui::vec2(ui.available_width(), ROW);
    let layout = Layout::left_to_right(Align::Center).with_main_wrap(size.x < CHOICES);
    let named = ui.allocate_ui_with_layout(size, layout, |ui| {
        fixed(ui, NAME - 60.0, |ui| ui.label(name)).on_hover_text(help);
        ui.spacing_mut().item_spacing.x = 2.0;
        controls(ui)
    });
    named.inner
}

/// The reset button at the end of a row; a space where there is nothing to reset `to`.
pub fn reset(ui: &mut Ui, to: Option<&str>) -> bool {
    let Some(to) = to else {
        ui.allocate_space(egui::vec2(RESET, ROW));
        return false;
    };
    let (rect, response) = ui.allocate_exact_size(egui::vec2(RESET, ROW), egui::Sense::click());
    let color = match response.hovered() {
        true => Color32::WHITE,
        false => theme::WEAK,
    };
    // An arrow that turns back; no font has it at this size.
    let (centre, radius) = (rect.center(), 4.5);
    let on_circle = |angle: f32| centre + radius * Vec2::angled(angle);
    let arc = (0..=16).map(|step| on_circle(-2.3 + 0.3 * step as f32));
    let painter = ui.painter();
    painter.add(Shape::line(arc.collect(), Stroke::new(1.4, color)));
    let (tip, at) = (on_circle(-2.95), on_circle(-2.3));
    let out = 3.0 * (at - centre).normalized();
    let head = vec![tip, at + out, at - out];
    painter.add(Shape::convex_polygon(head, color, Stroke::NONE));
    response.on_hover_text(format!("Reset to {to}")).clicked()
}

/// What is typed into a number.
pub struct Typed<'a> {
    /// Of the number.
    pub name: &'a str,
    /// What it may be.
    pub range: RangeInclusive<f64>,
    /// What plain numbers are in.
    pub unit: &'a str,
}

impl Typed<'_> {
    /// What `text` says, held to the range; `refused` hears of what is not taken as it is.
    fn parse(&self, text: &str, refused: &RefCell<Option<String>>) -> Option<f64> {
        let Typed { name, range, unit } = self;
        let (low, high) = (range.start(), range.end());
        match parse(text, unit) {
            Ok(value) if range.contains(&value) => Some(value),
            Ok(value) => {
                let taken = value.clamp(*low, *high);
                *refused.borrow_mut() = Some(format!(
                    "{name}: {} is outside {low} to {high}{unit}; {taken}{unit} is taken",
                    text.trim()
                ));
                Some(taken)
            }
            Err(why) => {
                *refused.borrow_mut() = Some(format!("{name}: {}: {why}", text.trim()));
                None
            }
        }
    }
}

/// A number that is dragged or typed, of `width`, as `dress` has it.
pub fn number(
    ui: &mut Ui,
    width: f32,
    value: &mut f64,
    typed: &Typed<'_>,
    changes: &mut Changes,
    dress: impl FnOnce(egui::DragValue<'_>) -> egui::DragValue<'_>,
) -> Response {
    let before = *value;
    let refused = RefCell::new(None);
    let (shown, is_left) = (RefCell::new(String::new()), Cell::new(false));
    let formatter = ui.style().number_formatter.clone();
    let number = egui::DragValue::new(value)
        .range(typed.range.clone())
        .clamp_existing_to_range(false)
        .update_while_editing(false)
        .custom_formatter(|value, decimals| {
            let text = formatter.format(value, decimals);
            shown.borrow_mut().clone_from(&text);
            text
        })
        .custom_parser(|text| {
            // What is shown is rounded: a number that is clicked and left keeps the digits behind.
            is_left.set(text == *shown.borrow());
            match is_left.get() {
                true => Some(before),
                false => typed.parse(text, &refused),
            }
        });
    let response = ui.add_sized([width, ROW - 2.0], dress(number));
    if is_left.get() {
        *value = before;
    }
    // In the frame after that of Escape egui takes up what was typed all the same.
    let id = response.id.with("escaped");
    let is_escaped = ui.data_mut(|data| data.remove_temp::<bool>(id)).is_some();
    if is_escaped {
        *value = before;
    }
    if response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Escape)) {
        ui.data_mut(|data| data.insert_temp(id, true));
    } else if let (Some(refused), false) = (refused.into_inner(), is_escaped) {
        changes.refused = Some(refused);
    }
    response
}

/// Controls in a piece of a row of `width`.
pub fn fixed(ui: &mut Ui, width: f32, add: impl FnOnce(&mut Ui) -> Response) -> Response {
    let layout = Layout::left_to_right(Align::Center);
    ui.allocate_ui_with_layout(egui::vec2(width, ROW), layout, |ui| {
        ui.set_min_width(width);
        ui.spacing_mut().item_spacing.x = 5.0;
        add(ui)
    })
    .inner
}

/// `value` to so many digits after the point: what is shown is what is kept.
pub fn rounded(value: f64, decimals: usize) -> f64 {
    let scale = 10f64.powi(decimals as i32);
    let rounded = (value * scale).round() / scale;
    if rounded.is_finite() { rounded } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_beyond_a_turn_are_shown_where_they_point() {
        let field = |unit: &str| Field::new("Rotate", -3600.0..=3600.0, 0.0).unit(unit);
        let whole = -180.0..=180.0;
        for (value, at) in [
            (300.0, -60.0),
            (-190.0, 170.0),
            (725.0, 5.0),
            (180.0, 180.0),
        ] {
            assert_eq!(field("°").on_slider(value, &whole), at, "{value}");
        }
        // What is no turn is beyond the end.
        assert_eq!(field("°").on_slider(95.0, &(-90.0..=90.0)), 95.0);
        assert_eq!(field(" cm").on_slider(300.0, &whole), 300.0);
    }
}
