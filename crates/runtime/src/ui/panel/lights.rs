//! The environment and its lights.

use egui::{Color32, RichText, Sense, Ui};
use strandlight_formats::params::{ADJUST, LIGHTS};
use strandlight_formats::{LightAdjust, Scene, SrbfLight};

use super::light_map::{LightMap, MINUS, power};
use crate::ui::field::{Changes, row};
use crate::ui::param::Rows;
use crate::ui::theme;
use strandlight_scene::tone;

/// What the panel remembers of the lights between frames.
#[derive(Debug, Default)]
pub struct LightsState {
    /// The light whose own values are shown.
    pub selected: Option<u32>,
    /// The next click in the picture asks which light shines there.
    pub is_picking: bool,
    /// What the last such click found.
    pub picked: Option<String>,
    /// The list follows the selection once.
    pub reveal: bool,
    /// The lights around the hair.
    map: LightMap,
}

impl LightsState {
    /// Forgets what was said of lights that are no longer there.
    pub fn forget(&mut self) {
        *self = LightsState::default();
    }
}

/// The map of the lights, rotation, strength and tint of all, the list, and the selected light. `lights` are those
/// of the light set's file, and as they are `lit` and turned in the picture.
pub fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    [lights, lit]: [&[SrbfLight]; 2],
    state: &mut LightsState,
    changes: &mut Changes,
) {
    let section = &mut scene.lights;
    let before = state.selected;
    let LightsState { map, selected, .. } = state;
    map.show(ui, lit, section, selected, changes);
    state.reveal |= state.selected != before;
    let plain = (LIGHTS.plain)();
    let mut rows = Rows {
        section: &LIGHTS,
        target: section,
        plain: &plain,
        suffix: "",
    };
    for param in LIGHTS.params {
        rows.show(ui, param, changes);
    }
    row(ui, |ui| {
        let text = if state.is_picking {
            "Click the highlight ..."
        } else {
            "Pick from picture"
        };
        let button = egui::Button::new(text).selected(state.is_picking);
        let help =
            "Click a highlight in the picture to identify the light that contributes most there.";
        let button = ui.add(button).on_hover_text(help);
        changes.place("Pick button", &button);
        if button.clicked() {
            state.is_picking = !state.is_picking;
        }
        let is_any = !section.solo.is_empty() || !section.muted.is_empty();
        if ui
            .add_enabled(is_any, egui::Button::new("All on"))
            .clicked()
        {
            section.solo.clear();
            section.muted.clear();
            changes.note("All lights on");
        }
    });
    if let Some(text) = &state.picked {
        ui.label(RichText::new(text).color(theme::WEAK));
    }
    row(ui, |ui| {
        ui.allocate_space(egui::vec2(19.0, 12.0));
        let head = ["No", "power", "azimuth", "elevation"].map(str::to_owned);
        let head = columns(ui, &head, theme::WEAK);
        ui.label(head);
    });
    list(ui, scene, lights, state, changes);
    if let Some(ix) = state.selected.filter(|&ix| (ix as usize) < lights.len()) {
        adjust(ui, scene, ix, changes);
    }
}

fn list(
    ui: &mut Ui,
    scene: &mut Scene,
    lights: &[SrbfLight],
    state: &mut LightsState,
    changes: &mut Changes,
) {
    let section = &mut scene.lights;
    let brightest = lights.iter().map(power).fold(f32::MIN_POSITIVE, f32::max);
    egui::ScrollArea::vertical()
        .id_salt("lights")
        .max_height(168.0)
        .auto_shrink([false, true])
        .show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            for ix in order(lights) {
                let light = &lights[ix as usize];
                row(ui, |ui| {
                    color_of(ui, light);
                    let is_selected = state.selected == Some(ix);
                    let share = 100.0 * power(light) / brightest;
                    let [azimuth, elevation] = place(light, section.rotate_deg);
                    let degrees = |x: f32| format!("{x:.0}°").replace('-', MINUS);
                    let cells = [
                        ix.to_string(),
                        format!("{share:.0} %"),
                        degrees(azimuth),
                        degrees(elevation),
                    ];
                    let color = match section.is_on(ix) {
                        _ if is_selected => Color32::WHITE,
                        true => ui.visuals().text_color(),
                        false => theme::WEAK,
                    };
                    let text = columns(ui, &cells, color);
                    let label = ui.selectable_label(is_selected, text).on_hover_text(
                        "Number, power against the strongest, where it comes from: azimuth (0 is +Z, \
                         90 is +X) and elevation above the horizon. Click to change it alone.",
                    );
                    changes.place(format!("Light {ix}"), &label);
                    if label.clicked() {
                        state.selected = (!is_selected).then_some(ix);
                    }
                    if is_selected && state.reveal {
                        label.scroll_to_me(Some(egui::Align::Center));
                        state.reveal = false;
                    }
                    let layout = egui::Layout::right_to_left(egui::Align::Center);
                    ui.with_layout(layout, |ui| {
                        toggle(ui, ix, "M", "Mute", &mut section.muted, changes);
                        toggle(ui, ix, "S", "Solo", &mut section.solo, changes);
                    });
                });
            }
        });
}

/// Where the columns of the list end, points.
const COLUMNS: [f32; 4] = [20.0, 70.0, 132.0, 196.0];

/// One line, each cell flush right with its column.
fn columns(ui: &Ui, cells: &[String; 4], color: egui::Color32) -> egui::text::LayoutJob {
    let font = egui::TextStyle::Body.resolve(ui.style());
    let mut job = egui::text::LayoutJob::default();
    let mut x = 0.0;
    for (cell, right) in cells.iter().zip(COLUMNS) {
        let laid_out = ui
            .painter()
            .layout_no_wrap(cell.clone(), font.clone(), color);
        let format = egui::TextFormat::simple(font.clone(), color);
        job.append(cell, f32::max(right - laid_out.size().x - x, 0.0), format);
        x = right;
    }
    job
}

/// The lights, strongest first.
fn order(lights: &[SrbfLight]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..lights.len() as u32).collect();
    order.sort_by(|&a, &b| {
        let [a, b] = [a, b].map(|ix| power(&lights[ix as usize]));
        b.total_cmp(&a)
    });
    order
}

/// Azimuth and elevation in degrees, turned as the scene says.
fn place(light: &SrbfLight, rotate_deg: f64) -> [f32; 2] {
    let [x, y, z] = light.direction;
    let azimuth = x.atan2(z).to_degrees() + rotate_deg as f32;
    let azimuth = (azimuth + 180.0).rem_euclid(360.0) - 180.0;
    [azimuth, y.clamp(-1.0, 1.0).asin().to_degrees()]
}

fn color_of(ui: &mut Ui, light: &SrbfLight) {
    let brightest = light.rgb.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let rgb = tone::display(light.rgb.map(|x| x / brightest), tone::ToneMap::None);
    let [r, g, b] = rgb.map(|x| tone::level(x, 0.0));
    let (rect, _) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), Sense::hover());
    ui.painter()
        .rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
}

fn toggle(
    ui: &mut Ui,
    ix: u32,
    text: &str,
    name: &str,
    chosen: &mut Vec<u32>,
    changes: &mut Changes,
) {
    let at = chosen.iter().position(|&other| other == ix);
    let button = egui::Button::new(RichText::new(text).small()).selected(at.is_some());
    let button = ui.add(button).on_hover_text(name);
    changes.place(format!("{name} {ix}"), &button);
    if button.clicked() {
        match at {
            Some(at) => drop(chosen.remove(at)),
            None => chosen.push(ix),
        }
        chosen.sort_unstable();
        changes.note(&format!("{name} light {ix}"));
    }
}

fn adjust(ui: &mut Ui, scene: &mut Scene, ix: u32, changes: &mut Changes) {
    let section = &mut scene.lights;
    let own = section.adjust.iter().find(|own| own.light == ix);
    let plain = LightAdjust::new(ix);
    let before = own.copied().unwrap_or(plain);
    let mut changed = before;
    ui.label(RichText::new(format!("Light {ix}")).strong());
    let mut rows = Rows {
        section: &ADJUST,
        target: &mut changed,
        plain: &plain,
        suffix: &format!(" of {ix}"),
    };
    for param in ADJUST
        .params
        .iter()
        .filter(|param| param.spec.key != "light")
    {
        rows.show(ui, param, changes);
    }
    if changed != before {
        *section.adjust_mut(ix) = changed;
        section
            .adjust
            .retain(|own| *own != LightAdjust::new(own.light));
    }
}
