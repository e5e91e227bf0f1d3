//! Rows of the panel for colours: a name, a button that opens a picker, three numbers, a reset.

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Align, Color32, Layout, Pos2, Rect, Response, Sense, Stroke, Ui, vec2};

use super::field::{Changes, ROW, Typed, fixed, number, reset, rounded, row};
use super::theme;
use strandlight_scene::tone;

/// Width of names.
const NAME: f32 = 84.0;
/// Width of a channel's number.
const NUMBER: f32 = 50.0;
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
        let name = format!("{} {channel}", self.name);
        let typed = Typed {
            name: &name,
            range: 0.0..=self.most,
            unit: "",
        };
        let response = number(ui, NUMBER, value, &typed, changes, |number| {
            number
                .speed(0.005)
                .max_decimals(DECIMALS)
                .prefix(format!("{initial} "))
        });
        changes.of(self.name, &response);
        changes.place(format!("{name} number"), &response);
        response.on_hover_text("Drag, or click to type");
    }
}

/// Hue, saturation and value, each 0..=1, of display colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Hsv {
    hue: f32,
    saturation: f32,
    value: f32,
}

impl Hsv {
    /// Of sRGB in 0..=1; a grey keeps the hue of `old`, and black its saturation too.
    fn of([r, g, b]: [f32; 3], old: Hsv) -> Hsv {
        let (most, least) = (r.max(g).max(b), r.min(g).min(b));
        let range = most - least;
        if most <= 0.0 {
            return Hsv { value: 0.0, ..old };
        }
        if range <= 1e-6 {
            return Hsv {
                saturation: 0.0,
                value: most,
                ..old
            };
        }
        let sixths = if most == r {
            ((g - b) / range).rem_euclid(6.0)
        } else if most == g {
            (b - r) / range + 2.0
        } else {
            (r - g) / range + 4.0
        };
        Hsv {
            hue: sixths / 6.0,
            saturation: range / most,
            value: most,
        }
    }

    fn srgb(self) -> [f32; 3] {
        let Hsv {
            hue,
            saturation,
            value,
        } = self;
        let channel = |shift: f32| {
            let k = (shift + 6.0 * hue).rem_euclid(6.0);
            value * (1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0))
        };
        [channel(5.0), channel(3.0), channel(1.0)]
    }
}

/// Linear to sRGB, 0..=1.
fn encoded(rgb: [f64; 3]) -> [f32; 3] {
    tone::display(rgb.map(|x| x as f32), tone::ToneMap::None).map(|x| x.clamp(0.0, 1.0))
}

/// sRGB to linear.
fn decoded(srgb: [f32; 3]) -> [f64; 3] {
    srgb.map(|x| {
        let x = f64::from(x);
        let linear = match x {
            x if x <= 0.04045 => x / 12.92,
            x => ((x + 0.055) / 1.055).powf(2.4),
        };
        rounded(linear, DECIMALS + 1)
    })
}

fn color32(srgb: [f32; 3]) -> Color32 {
    let [r, g, b] = srgb.map(|x| (255.0 * x).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// `#c08040`, as other programs have colours.
fn hex_of(rgb: [f64; 3]) -> String {
    let [r, g, b] = encoded(rgb).map(|x| (255.0 * x).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Linear RGB of `#c08040`, `c08040` or `#c84`.
fn from_hex(text: &str) -> Option<[f64; 3]> {
    let digits = text.trim().trim_start_matches('#');
    if !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let channels: Vec<f32> = match digits.len() {
        3 => (0..3)
            .map(|ix| u8::from_str_radix(&digits[ix..=ix], 16).map(|x| f32::from(17 * x)))
            .collect::<Result<_, _>>()
            .ok()?,
        6 => (0..3)
            .map(|ix| u8::from_str_radix(&digits[2 * ix..2 * ix + 2], 16).map(f32::from))
            .collect::<Result<_, _>>()
            .ok()?,
        _ => return None,
    };
    Some(decoded(
        [channels[0], channels[1], channels[2]].map(|x| x / 255.0),
    ))
}

/// A button that opens a picker; `rgb` is linear.
pub fn swatch(ui: &mut Ui, name: &str, rgb: &mut [f64; 3], changes: &mut Changes) {
    let (rect, response) = ui.allocate_exact_size(vec2(28.0, ROW - 4.0), Sense::click());
    ui.painter().rect_filled(rect, 2.0, color32(encoded(*rgb)));
    let edge = if response.hovered() { 200 } else { 96 };
    let stroke = Stroke::new(1.0, Color32::from_gray(edge));
    ui.painter()
        .rect_stroke(rect, 2.0, stroke, egui::StrokeKind::Inside);
    changes.place(format!("{name} swatch"), &response);
    let response = response.on_hover_text("Click to choose a colour");
    let before = *rgb;
    egui::Popup::menu(&response)
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| picker(ui, name, rgb, changes));
    if *rgb != before {
        // The picker stays open over many changes: they are one step until something else.
        changes.label = Some(name.to_owned());
    }
}

/// Side of the square of saturation and value, points.
const SQUARE: f32 = 180.0;

/// A square of saturation and value, a bar of hues, the colour as other programs write it, and numbers.
fn picker(ui: &mut Ui, name: &str, rgb: &mut [f64; 3], changes: &mut Changes) {
    ui.spacing_mut().item_spacing.y = 6.0;
    let id = ui.scope_id().with("hsv");
    let old: Hsv = ui.data(|data| data.get_temp(id)).unwrap_or_default();
    let mut hsv = Hsv::of(encoded(*rgb), old);
    let before = hsv;
    let (rect, response) = ui.allocate_exact_size(vec2(SQUARE, SQUARE), Sense::click_and_drag());
    changes.place(format!("{name} picker"), &response);
    if let Some(at) = held(&response) {
        hsv.saturation = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        hsv.value = 1.0 - ((at.y - rect.top()) / rect.height()).clamp(0.0, 1.0);
    }
    gradient(ui, rect, |x, y| Hsv {
        saturation: x,
        value: 1.0 - y,
        ..hsv
    });
    let at = rect.min + vec2(hsv.saturation, 1.0 - hsv.value) * rect.size();
    ring(ui, at);
    let (bar, response) = ui.allocate_exact_size(vec2(SQUARE, 16.0), Sense::click_and_drag());
    changes.place(format!("{name} hues"), &response);
    if let Some(at) = held(&response) {
        hsv.hue = ((at.x - bar.left()) / bar.width()).clamp(0.0, 0.999);
    }
    gradient(ui, bar, |x, _| Hsv {
        hue: x,
        saturation: 1.0,
        value: 1.0,
    });
    ring(
        ui,
        egui::pos2(bar.left() + hsv.hue * bar.width(), bar.center().y),
    );
    row(ui, |ui| {
        ui.label("Hex");
        hex_field(ui, name, rgb, changes);
    });
    row(ui, |ui| {
        let parts = [&mut hsv.hue, &mut hsv.saturation, &mut hsv.value];
        let scales = [
            ("H", "hue", 360.0),
            ("S", "saturation", 100.0),
            ("V", "value", 100.0),
        ];
        for (part, (letter, word, scale)) in parts.into_iter().zip(scales) {
            let mut shown = rounded(f64::from(*part) * scale, 0);
            let old = shown;
            let typed = Typed {
                name: word,
                range: 0.0..=scale,
                unit: "",
            };
            number(ui, 56.0, &mut shown, &typed, changes, |number| {
                number
                    .speed(0.5)
                    .max_decimals(0)
                    .prefix(format!("{letter} "))
            });
            if shown != old {
                *part = (shown / scale).min(if letter == "H" { 0.999 } else { 1.0 }) as f32;
            }
        }
    });
    if hsv != before {
        *rgb = decoded(hsv.srgb());
    }
    ui.data_mut(|data| data.insert_temp(id, hsv));
}

fn hex_field(ui: &mut Ui, name: &str, rgb: &mut [f64; 3], changes: &mut Changes) {
    let id = ui.scope_id().with("hex");
    let typing: Option<String> = ui.data_mut(|data| data.remove_temp(id));
    let mut text = typing.unwrap_or_else(|| hex_of(*rgb));
    let field = ui.add(egui::TextEdit::singleline(&mut text).desired_width(90.0));
    changes.place(format!("{name} hex"), &field);
    if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
    } else if field.lost_focus() && !ui.input(|input| input.key_pressed(egui::Key::Escape)) {
        match from_hex(&text) {
            Some(_) if text == hex_of(*rgb) => {}
            Some(found) => *rgb = found,
            None => {
                let refused = format!("{name}: {text}: a colour is written as #c08040");
                changes.refused = Some(refused);
            }
        }
    }
}

/// Where the mouse holds something.
fn held(response: &Response) -> Option<Pos2> {
    let is_held = response.dragged() || response.clicked() || response.is_pointer_button_down_on();
    response.interact_pointer_pos().filter(|_| is_held)
}

/// Fills `rect` with colours of its places, 0..=1 across and down.
fn gradient(ui: &Ui, rect: Rect, color: impl Fn(f32, f32) -> Hsv) {
    const STEPS: u32 = 24;
    let mut mesh = Mesh::default();
    for y in 0..=STEPS {
        for x in 0..=STEPS {
            let [u, v] = [x, y].map(|step| step as f32 / STEPS as f32);
            mesh.vertices.push(Vertex {
                pos: rect.min + vec2(u, v) * rect.size(),
                uv: WHITE_UV,
                color: color32(color(u, v).srgb()),
            });
        }
    }
    for y in 0..STEPS {
        for x in 0..STEPS {
            let at = y * (STEPS + 1) + x;
            mesh.add_triangle(at, at + 1, at + STEPS + 1);
            mesh.add_triangle(at + 1, at + STEPS + 2, at + STEPS + 1);
        }
    }
    ui.painter().add(mesh);
}

fn ring(ui: &Ui, at: Pos2) {
    let painter = ui.painter();
    painter.circle_stroke(at, 5.0, Stroke::new(3.0, theme::BACKDROP));
    painter.circle_stroke(at, 5.0, Stroke::new(1.5, Color32::WHITE));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read_as_other_programs_write_them() {
        for (text, hex) in [
            ("#c08040", "#c08040"),
            ("C08040", "#c08040"),
            (" #c84 ", "#cc8844"),
            ("#000000", "#000000"),
            ("#ffffff", "#ffffff"),
        ] {
            let rgb = from_hex(text).expect(text);
            assert_eq!(hex_of(rgb), hex, "{rgb:?}");
        }
        for bad in ["", "#12", "#12345", "#gggggg", "red", "#1234567", "é12345"] {
            assert_eq!(from_hex(bad), None, "{bad}");
        }
    }

    #[test]
    fn hues_come_back_and_greys_keep_theirs() {
        for step in 0..20 {
            let hsv = Hsv {
                hue: step as f32 / 20.0,
                saturation: 0.6,
                value: 0.8,
            };
            let back = Hsv::of(hsv.srgb(), Hsv::default());
            let off = [back.hue - hsv.hue, back.saturation - 0.6, back.value - 0.8];
            assert!(off.iter().all(|x| x.abs() < 1e-4), "{hsv:?} {back:?}");
        }
        let old = Hsv {
            hue: 0.3,
            saturation: 0.5,
            value: 0.5,
        };
        assert_eq!(Hsv::of([0.4; 3], old).hue, 0.3);
        let black = Hsv::of([0.0; 3], old);
        assert_eq!((black.hue, black.saturation), (0.3, 0.5));
    }
}
