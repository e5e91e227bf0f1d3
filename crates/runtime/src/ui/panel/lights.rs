//! The environment and its lights.

use egui::{Color32, RichText, Sense, Ui};
use glam::Vec3;
use strandlight_formats::params::{ADDED, ADJUST, LIGHTS};
use strandlight_formats::{
    AddedLight, LightAdjust, LightsSection, MAX_ADDED_LIGHTS, Scene, SrbfLight,
};

pub use super::light_map::turned;
use super::light_map::{LightMap, MINUS, power};
use crate::ui::field::{Changes, row};
use crate::ui::param::Rows;
use crate::ui::theme;
use strandlight_scene::{Camera, tone};

/// What the panel remembers of the lights between frames.
#[derive(Debug, Default)]
pub struct LightsState {
    /// The light whose own values are shown.
    pub selected: Option<u32>,
    /// The next click in the picture asks which light shines there.
    pub is_picking: bool,
    /// The next click in the picture says where the selected light, which the scene adds, makes its highlight.
    pub is_placing: bool,
    /// What the last such click found.
    pub picked: Option<String>,
    /// The list follows the selection once.
    pub reveal: bool,
    /// The lights around the hair.
    pub map: LightMap,
}

impl LightsState {
    /// Forgets what was said of lights that are no longer there.
    pub fn forget(&mut self) {
        *self = LightsState::default();
    }
}

/// The map of the lights, rotation, strength and tint of all, the list, and the selected light. `lights` are those
/// of the light set and those that the scene adds, turned, and as they are `lit` in the picture. A light that is added
/// comes from `key`.
pub fn show(
    ui: &mut Ui,
    scene: &mut Scene,
    [lights, lit]: [&[SrbfLight]; 2],
    key: [f64; 3],
    state: &mut LightsState,
    changes: &mut Changes,
) {
    let section = &mut scene.lights;
    let n_set = lights.len() - section.added.len();
    let before = state.selected;
    let LightsState { map, selected, .. } = state;
    let added = map.show(ui, lit, section, n_set, selected, changes);
    if let Some(direction) = added {
        add(section, direction, lights, selected, changes);
    }
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
            state.is_placing = false;
        }
        let help = "Adds a Gaussian light, half as strong as the set. Drag it on the map, or place its highlight.";
        let has_room = section.added.len() < MAX_ADDED_LIGHTS;
        let button = ui.add_enabled(has_room, egui::Button::new("Add light"));
        let button = button.on_hover_text(help);
        changes.place("Add light button", &button);
        if button.clicked() {
            add(section, key, lights, &mut state.selected, changes);
            state.reveal = true;
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
    let Some(ix) = state.selected else {
        return;
    };
    match (ix as usize).checked_sub(n_set) {
        None => adjust(ui, scene, ix, changes),
        Some(at) if at < scene.lights.added.len() => {
            added_light(ui, scene, [at, n_set], state, changes);
        }
        // It was added a moment ago, or taken away.
        Some(_) => {}
    }
}

/// Adds a light from `direction`, half as strong as all `lights` are, and selects it.
fn add(
    section: &mut LightsSection,
    direction: [f64; 3],
    lights: &[SrbfLight],
    selected: &mut Option<u32>,
    changes: &mut Changes,
) {
    let mut added = AddedLight::default();
    added.point_to(direction);
    let mean = lights
        .iter()
        .map(|light| f64::from(power(light)))
        .sum::<f64>()
        / 3.0;
    if mean > 0.0 {
        // Two digits.
        let unit = 10f64.powf(mean.log10().floor() - 1.0);
        added.intensity = ((0.5 * mean / unit).round() * unit).clamp(0.0, 1e6);
    }
    section.added.push(added);
    *selected = Some(lights.len() as u32);
    changes.note("Add light");
}

/// Rows of a light that the scene adds: number `at` of those, after `n_set` of the set.
fn added_light(
    ui: &mut Ui,
    scene: &mut Scene,
    [at, n_set]: [usize; 2],
    state: &mut LightsState,
    changes: &mut Changes,
) {
    let ix = n_set + at;
    let mut is_removed = false;
    row(ui, |ui| {
        ui.label(RichText::new(format!("Light {ix}, added")).strong());
        let text = match state.is_placing {
            true => "Click a strand ...",
            false => "Place highlight",
        };
        let button = egui::Button::new(text).selected(state.is_placing);
        let help = "Click a strand in the picture: the light comes from where the fibre reflects it to the eye.";
        let button = ui.add(button).on_hover_text(help);
        changes.place("Place highlight button", &button);
        if button.clicked() {
            state.is_placing = !state.is_placing;
            state.is_picking = false;
        }
        let button = ui.button("Remove");
        changes.place("Remove light button", &button);
        is_removed = button.clicked();
    });
    let plain = (ADDED.plain)();
    let mut rows = Rows {
        section: &ADDED,
        target: &mut scene.lights.added[at],
        plain: &plain,
        suffix: &format!(" of {ix}"),
    };
    for param in ADDED.params {
        rows.show(ui, param, changes);
    }
    if is_removed {
        scene.lights.remove_added(at, n_set);
        (state.selected, state.is_placing) = (None, false);
        changes.note("Remove light");
    }
}

/// Where a light that is added comes from at first: left of the eye and above, as photographers have it.
pub fn key_direction(camera: &Camera) -> [f64; 3] {
    let towards_eye = (camera.eye - camera.target).normalize_or(Vec3::Z);
    let right = camera.up.cross(towards_eye).normalize_or(Vec3::X);
    let up = towards_eye.cross(right);
    let direction = towards_eye - right + up;
    direction.normalize().to_array().map(f64::from)
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
                    let [azimuth, elevation] = place(light);
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

/// Azimuth and elevation in degrees.
fn place(light: &SrbfLight) -> [f32; 2] {
    let [x, y, z] = light.direction;
    let elevation = y.clamp(-1.0, 1.0).asin();
    [x.atan2(z).to_degrees(), elevation.to_degrees()]
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
