//! The environment as its lights make it, as a map: click a light, drag to turn those of the set, drag or add others.

use std::f32::consts::PI;

use egui::{
    Color32, ColorImage, Rect, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};
use glam::Vec3;
use strandlight_formats::{LightsSection, MAX_ADDED_LIGHTS, SrbfLight};
use strandlight_scene::background;
use strandlight_scene::tone::{self, ToneMap};
use strandlight_scene::volume;

use crate::ui::field::Changes;
use crate::ui::theme;

/// Texels of the map, a latitude-longitude map as OpenEXR has it.
const SIZE: [usize; 2] = [144, 72];

/// A click this near to the middle of a light, points, is for it.
const REACH: f32 = 12.0;

/// As wide as a digit, which a hyphen is not.
pub(super) const MINUS: &str = "\u{2212}";

/// The map that was drawn last.
#[derive(Default)]
pub struct LightMap {
    /// The lights it is of.
    lights: Vec<SrbfLight>,
    texture: Option<TextureHandle>,
    /// The light that is dragged, by its place among those that the scene adds.
    dragged: Option<usize>,
}

impl std::fmt::Debug for LightMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LightMap").finish_non_exhaustive()
    }
}

impl LightMap {
    /// Forgets its picture, which was on a device that is lost.
    pub fn forget_texture(&mut self) {
        self.texture = None;
    }

    /// Shows `lights`, those of the scene as they are lit and turned, `n_set` of them of the set; a click changes
    /// which one is `selected`, a drag turns those of the set or moves one that is added. Answers where a
    /// double click asks for another light.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        lights: &[SrbfLight],
        section: &mut LightsSection,
        n_set: usize,
        selected: &mut Option<u32>,
        changes: &mut Changes,
    ) -> Option<[f64; 3]> {
        let width = ui.available_width();
        let (rect, response) =
            ui.allocate_exact_size(vec2(width, 0.5 * width), Sense::click_and_drag());
        changes.place("Light map", &response);
        if !ui.is_rect_visible(rect) {
            return None;
        }
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(self.texture(ui, lights), rect, whole, Color32::WHITE);
        let places: Vec<egui::Pos2> = lights
            .iter()
            .map(|light| {
                let [u, v] = place(light.direction);
                rect.min + vec2(u * rect.width(), v * rect.height())
            })
            .collect();
        let near = |at: egui::Pos2| {
            (0..)
                .zip(&places)
                .map(|(ix, place): (u32, _)| (ix, place.distance(at)))
                .filter(|(_, distance)| *distance < REACH)
                .min_by(|(_, a), (_, b)| a.total_cmp(b))
                .map(|(ix, _)| ix)
        };
        let hovered = response.hover_pos().and_then(near);
        for (ix, (light, at)) in (0..).zip(lights.iter().zip(&places)) {
            let is_on = light.rgb != [0.0; 3];
            // A standard deviation of the light, on the equator.
            let sigma = light.lambda / std::f32::consts::SQRT_2;
            let radius = (sigma / (2.0 * PI) * rect.width()).clamp(2.5, 9.0);
            let (width, color) = match (*selected == Some(ix), hovered == Some(ix), is_on) {
                (true, _, _) => (2.0, theme::WARNING),
                (_, true, _) => (2.0, Color32::WHITE),
                (_, _, true) => (1.0, Color32::from_white_alpha(170)),
                (_, _, false) => (1.0, Color32::from_white_alpha(50)),
            };
            // Dark around it: seen on any map.
            painter.circle_stroke(
                *at,
                radius + 1.0,
                Stroke::new(1.0, Color32::from_black_alpha(120)),
            );
            painter.circle_stroke(*at, radius, Stroke::new(width, color));
            if ix as usize >= n_set {
                // It can be dragged by itself.
                painter.circle_filled(*at, 2.0, color);
            }
        }
        let on_map = |at: egui::Pos2| {
            let [u, v] = [at.x - rect.left(), at.y - rect.top()];
            let at = [u / rect.width().max(1.0), v / rect.height().max(1.0)];
            // Short of the poles, where there is no azimuth.
            let at = [at[0], at[1].clamp(0.001, 0.999)];
            direction(at).to_array().map(f64::from)
        };
        if response.drag_started() {
            let start = ui.input(|input| input.pointer.press_origin());
            let of_set = start.and_then(near).map(|ix| ix as usize);
            self.dragged = of_set.and_then(|ix| ix.checked_sub(n_set));
            if let Some(at) = self.dragged {
                *selected = Some((n_set + at) as u32);
            }
        }
        let dragged = self.dragged.and_then(|at| section.added.get_mut(at));
        if let (true, Some(light), Some(at)) =
            (response.dragged(), dragged, response.interact_pointer_pos())
        {
            let before = *light;
            light.point_to(on_map(at));
            if *light != before {
                changes.label = Some("Move light".to_owned());
            }
        } else if response.dragged() {
            let turn = -360.0 * response.drag_delta().x / rect.width().max(1.0);
            if turn != 0.0 {
                section.rotate_deg = turned(section.rotate_deg, f64::from(turn));
                changes.label = Some("Rotate".to_owned());
            }
        }
        changes.is_complete |= response.drag_stopped();
        let has_room = section.added.len() < MAX_ADDED_LIGHTS;
        let added = response
            .interact_pointer_pos()
            .filter(|_| response.double_clicked() && hovered.is_none() && has_room)
            .map(on_map);
        if response.clicked() && !response.double_clicked() {
            *selected = hovered.filter(|&ix| *selected != Some(ix));
        }
        response.on_hover_ui_at_pointer(|ui| {
            ui.label(match hovered {
                Some(ix) => says(ix, lights),
                None => "The lights around the hair, +Z in the middle, +X left of it. Click a light to change it \
                         alone; drag to turn those of the set about the vertical. Double click to add a light, \
                         which is dragged by itself."
                    .to_owned(),
            });
        });
        added
    }

    /// The map of `lights`, drawn if it is not that of the last frame.
    fn texture(&mut self, ui: &Ui, lights: &[SrbfLight]) -> egui::TextureId {
        if self.texture.is_none() || self.lights != lights {
            lights.clone_into(&mut self.lights);
            let image = ColorImage::new(SIZE, texels(lights));
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                none => {
                    *none = Some(
                        ui.ctx()
                            .load_texture("light map", image, TextureOptions::LINEAR),
                    )
                }
            }
        }
        self.texture
            .as_ref()
            .map(TextureHandle::id)
            .unwrap_or_default()
    }
}

/// The map, its mean over the sphere a middle grey.
fn texels(lights: &[SrbfLight]) -> Vec<Color32> {
    let [width, height] = SIZE;
    let total: f64 = lights.iter().map(|light| f64::from(power(light))).sum();
    // `power` is an integral over the sphere, of three channels.
    let mean = (total / (3.0 * 4.0 * std::f64::consts::PI)) as f32;
    let scale = if mean > 0.0 { 0.18 / mean } else { 1.0 };
    let texel = |ix: usize| {
        let [u, v] = [ix % width, ix / width].map(|n| n as f32 + 0.5);
        let direction = direction([u / width as f32, v / height as f32]);
        let rgb = background::radiance(lights, direction).map(|x| scale * x);
        let [r, g, b] = tone::display(rgb, ToneMap::Filmic).map(|x| tone::level(x, 0.0));
        Color32::from_rgb(r, g, b)
    };
    (0..width * height).map(texel).collect()
}

/// What a tooltip says of a light.
fn says(ix: u32, lights: &[SrbfLight]) -> String {
    let light = &lights[ix as usize];
    let all: f32 = lights.iter().map(power).sum();
    let [x, y, z] = light.direction;
    let azimuth = x.atan2(z).to_degrees();
    let elevation = y.clamp(-1.0, 1.0).asin().to_degrees();
    let text = match power(light) {
        power if power > 0.0 => format!(
            "Light {ix}: {:.1} % of all power, from azimuth {azimuth:.0}°, elevation {elevation:.0}°",
            100.0 * power / all
        ),
        _ => format!("Light {ix}: off"),
    };
    text.replace('-', MINUS)
}

/// Power in all channels.
pub(super) fn power(light: &SrbfLight) -> f32 {
    volume::power(light).iter().sum::<f64>() as f32
}

/// Where a latitude-longitude map has a direction, 0..1 from its upper left: +Z in the middle, +X left of it.
fn place([x, y, z]: [f32; 3]) -> [f32; 2] {
    let longitude = x.atan2(z);
    let latitude = y.clamp(-1.0, 1.0).asin();
    [0.5 - longitude / (2.0 * PI), 0.5 - latitude / PI]
}

/// The unit vector that [`place`] puts there.
fn direction([u, v]: [f32; 2]) -> Vec3 {
    let (longitude, latitude) = ((0.5 - u) * 2.0 * PI, (0.5 - v) * PI);
    let (sin, cos) = longitude.sin_cos();
    Vec3::new(sin * latitude.cos(), latitude.sin(), cos * latitude.cos())
}

/// Degrees after a further turn, in -180..180, as the slider has them.
pub fn turned(rotate_deg: f64, turn: f64) -> f64 {
    let turned = (rotate_deg + turn + 180.0).rem_euclid(360.0) - 180.0;
    (10.0 * turned).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_openexr_s() {
        assert_eq!(place([0.0, 0.0, 1.0]), [0.5, 0.5]);
        assert_eq!(place([1.0, 0.0, 0.0]), [0.25, 0.5]);
        assert_eq!(place([0.0, 1.0, 0.0])[1], 0.0);
        for at in [[0.1, 0.3], [0.5, 0.5], [0.9, 0.8]] {
            let found = place(direction(at).to_array());
            assert!((0..2).all(|ix| (found[ix] - at[ix]).abs() < 1e-6), "{at:?}");
        }
    }

    /// A point that is dragged to the right comes from a lesser azimuth.
    #[test]
    fn lights_follow_the_drag() {
        let light = direction([0.4, 0.5]);
        // A tenth of the map to the right.
        let turn = turned(0.0, -36.0).to_radians() as f32;
        let after = glam::Quat::from_rotation_y(turn) * light;
        assert!((place(after.to_array())[0] - 0.5).abs() < 1e-6);
        assert_eq!(turned(-170.0, -20.0), 170.0);
    }

    #[test]
    fn the_map_is_bright_where_the_light_is() {
        let light = SrbfLight {
            direction: direction([0.25, 0.5]).to_array(),
            lambda: 0.2,
            rgb: [1.0; 3],
        };
        let texels = texels(&[light]);
        let at = |column: usize| texels[SIZE[0] * (SIZE[1] / 2) + column].r();
        assert!(at(SIZE[0] / 4) > 200 && at(3 * SIZE[0] / 4) == 0);
        assert!(texels.len() == SIZE[0] * SIZE[1]);
    }
}
