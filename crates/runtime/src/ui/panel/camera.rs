//! The view in numbers.

use egui::Ui;
use strandlight_formats::params::CAMERA;

use crate::ui::field::{Changes, Field, row};
use crate::ui::keys::{Command, Side};
use crate::ui::orbit;
use crate::ui::orbit::Bounds;
use strandlight_scene::Camera;

/// Heights of films and sensors, mm.
const FILMS: [(&str, f64); 4] = [
    ("Full frame 36x24", 24.0),
    ("Super 35 24.89x18.66", 18.66),
    ("APS-C 23.6x15.6", 15.6),
    ("65 mm 48.59x22.1", 22.1),
];

/// Most views that are kept.
const MOST_BOOKMARKS: usize = 64;

/// What the panel remembers of the view between frames.
#[derive(Debug)]
pub struct CameraState {
    /// Height of the film that the focal length is for, mm.
    film: f64,
    /// The mouse moves no camera.
    pub is_locked: bool,
    /// What the scene's picture will show is framed.
    pub has_frame: bool,
    /// Views that were kept while the window is open.
    bookmarks: Vec<Camera>,
}

impl Default for CameraState {
    fn default() -> Self {
        CameraState {
            film: FILMS[0].1,
            is_locked: false,
            has_frame: false,
            bookmarks: Vec::new(),
        }
    }
}

/// Angle of view, focal length and distance of `camera`, which is not that of the scene if it `is_moved`; `can_look`
/// says whether there are views before and after it. Answers
/// where it is moved to. Looking around is no edit of the scene; saving the view is.
pub fn show(
    ui: &mut Ui,
    (camera, bounds): (&Camera, Bounds),
    (is_moved, can_look): (bool, [bool; 2]),
    state: &mut CameraState,
    changes: &mut Changes,
    commands: &mut Vec<Command>,
) -> Option<Camera> {
    row(ui, |ui| {
        for (name, command, help) in [
            (
                "Save view",
                Command::SaveView,
                "Makes this view the scene's camera: V. Until then the scene keeps its own, also \
                 when it is saved.",
            ),
            (
                "Scene's camera",
                Command::Home,
                "Return to the scene's camera: Home",
            ),
        ] {
            let button = ui.add_enabled(is_moved, egui::Button::new(name));
            changes.place(format!("{name} button"), &button);
            let button = button.on_disabled_hover_text("The view matches the scene's camera.");
            if button.on_hover_text(help).clicked() {
                commands.push(command);
            }
        }
    });
    row(ui, |ui| {
        for (name, command, is_so, help) in [
            ("View before", Command::ViewBack, can_look[0], "Alt+Left"),
            ("View after", Command::ViewForward, can_look[1], "Alt+Right"),
        ] {
            let button = ui.add_enabled(is_so, egui::Button::new(name));
            changes.place(format!("{name} button"), &button);
            if button.on_hover_text(help).clicked() {
                commands.push(command);
            }
        }
    });
    row(ui, |ui| {
        for (side, name) in Side::ALL {
            let button = ui.button(name);
            changes.place(format!("{name} button"), &button);
            if button.clicked() {
                commands.push(Command::Look(side));
            }
        }
    });
    let kept = bookmarks(ui, camera, state, changes);
    row(ui, |ui| {
        for (name, value, help) in [
            (
                "Lock",
                &mut state.is_locked,
                "The mouse does not move the camera.",
            ),
            (
                "Picture frame",
                &mut state.has_frame,
                "Frames what the scene's picture shows, by the shape of its size, and nine tenths of that.",
            ),
        ] {
            let checkbox = ui.checkbox(value, name);
            changes.place(name, &checkbox);
            checkbox.on_hover_text(help);
        }
    });
    let mut of_view = Changes::default();
    let mut moved = kept.unwrap_or(*camera);
    let default = f64::from(strandlight_scene::camera::DEFAULT_FOV_Y)
        .to_degrees()
        .round();
    let mut fov_deg = (f64::from(camera.fov_y).to_degrees() * 1e4).round() / 1e4;
    let fov = CAMERA.param("fov_deg").map(|param| &param.spec);
    if let Some((fov, numbers)) = fov.and_then(|fov| Some((fov, fov.numbers()?)))
        && Field::of(fov.label, "camera.fov_deg", numbers, default)
            .help(fov.help)
            .show(ui, &mut fov_deg, &mut of_view)
    {
        moved.fov_y = fov_deg.to_radians() as f32;
    }
    row(ui, |ui| {
        let name = FILMS.iter().find(|(_, height)| *height == state.film);
        let combo = egui::ComboBox::from_id_salt("film")
            .width(170.0)
            .selected_text(name.map_or("", |(name, _)| name))
            .show_ui(ui, |ui| {
                for (name, height) in FILMS {
                    ui.selectable_value(&mut state.film, height, name);
                }
            });
        changes.place("Film", &combo.response);
        combo.response.on_hover_text(
            "The film or sensor that the focal length is for. The picture does not change.",
        );
    });
    let mut focal = (focal_length(camera.fov_y, state.film) * 100.0).round() / 100.0;
    let range = [179.0, 0.5].map(|fov: f64| focal_length(fov.to_radians() as f32, state.film));
    let default = focal_length(strandlight_scene::camera::DEFAULT_FOV_Y, state.film);
    if Field::new(
        "Focal length",
        range[0]..=range[1],
        (default * 10.0).round() / 10.0,
    )
    .unit(" mm")
    .slider(12.0..=300.0)
    .logarithmic()
    .help("Focal length of the lens, on this film; the same as the angle of view.")
    .show(ui, &mut focal, &mut of_view)
    {
        moved.fov_y = fov_y(focal, state.film);
    }
    let distance = f64::from(camera.eye.distance(camera.target));
    let mut wanted = (distance * 100.0).round() / 100.0;
    let framed = orbit::frame(camera, bounds.centre, bounds.radius, 1.5);
    let default = f64::from(framed.eye.distance(framed.target));
    if Field::new("Distance", 0.01..=1e5, (default * 100.0).round() / 100.0)
        .unit(" cm")
        .slider(0.1 * default..=5.0 * default)
        .logarithmic()
        .help("Distance from the camera to the orbit target.")
        .show(ui, &mut wanted, &mut of_view)
    {
        moved.eye = orbit::dolly(camera, (wanted / distance) as f32, bounds.radius).eye;
    }
    changes.places.append(&mut of_view.places);
    changes.refused = changes.refused.take().or(of_view.refused);
    (moved != *camera).then_some(moved)
}

/// Views that were kept, to return to; answers which one was clicked.
fn bookmarks(
    ui: &mut Ui,
    camera: &Camera,
    state: &mut CameraState,
    changes: &mut Changes,
) -> Option<Camera> {
    let mut clicked = None;
    row(ui, |ui| {
        let is_known = state.bookmarks.contains(camera);
        let can_keep = !is_known && state.bookmarks.len() < MOST_BOOKMARKS;
        let button = ui.add_enabled(can_keep, egui::Button::new("Keep view"));
        changes.place("Keep view button", &button);
        let help = "Keeps this view while the window is open.";
        if button.on_hover_text(help).clicked() {
            state.bookmarks.push(*camera);
        }
        let button = ui.add_enabled(is_known, egui::Button::new("Drop"));
        changes.place("Drop view button", &button);
        if button.on_hover_text("Forgets this kept view.").clicked() {
            state.bookmarks.retain(|kept| kept != camera);
        }
    });
    ui.horizontal_wrapped(|ui| {
        for (ix, kept) in state.bookmarks.iter().enumerate() {
            let name = format!("View {}", ix + 1);
            let label = ui.selectable_label(kept == camera, &name);
            changes.place(name, &label);
            if label.clicked() {
                clicked = Some(*kept);
            }
        }
    });
    clicked
}

/// Focal length on a film of this height, of which a picture as high is taken; both mm.
fn focal_length(fov_y: f32, film: f64) -> f64 {
    0.5 * film / f64::from(0.5 * fov_y).tan()
}

/// The angle of view, radians, of a focal length on a film of this height, mm.
fn fov_y(focal_length: f64, film: f64) -> f32 {
    (2.0 * (0.5 * film / focal_length).atan()) as f32
}

/// Draws what the picture of a scene shows, of `size`, over the view in `rect`, which is as high.
pub fn frame(ui: &Ui, rect: egui::Rect, [width, height]: [u32; 2]) {
    let painter = ui.painter().with_clip_rect(rect);
    let shape = egui::vec2(
        rect.height() * width as f32 / height.max(1) as f32,
        rect.height(),
    );
    let whole = egui::Rect::from_center_size(rect.center(), shape);
    let shade = egui::Color32::from_black_alpha(110);
    for (left, right) in [(rect.left(), whole.left()), (whole.right(), rect.right())] {
        if right > left {
            let beside = egui::Rect::from_x_y_ranges(left..=right, rect.y_range());
            painter.rect_filled(beside, 0.0, shade);
        }
    }
    let inside = egui::StrokeKind::Inside;
    for (frame, alpha) in [(whole, 200), (whole.scale_from_center(0.9), 90)] {
        let stroke = egui::Stroke::new(1.0, egui::Color32::from_white_alpha(alpha));
        painter.rect_stroke(frame, 0.0, stroke, inside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn focal_lengths_are_angles_of_view() {
        // A 50 mm lens on full frame sees 26.99 degrees from top to bottom.
        let fov = fov_y(50.0, 24.0);
        assert!((f64::from(fov).to_degrees() - 26.991).abs() < 1e-3, "{fov}");
        assert!((focal_length(fov, 24.0) - 50.0).abs() < 1e-4);
    }
}
