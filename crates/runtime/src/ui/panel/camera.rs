//! The view in numbers.

use egui::Ui;
use strandlight_formats::params::CAMERA;

use crate::ui::field::{Changes, Field, row};
use crate::ui::keys::{Command, Side};
use crate::ui::orbit;
use crate::ui::orbit::Bounds;
use strandlight_scene::Camera;

/// Angle of view and distance of `camera`, which is not that of the scene if it `is_moved`; `can_look`
/// says whether there are views before and after it. Answers
/// where it is moved to. Looking around is no edit of the scene; saving the view is.
pub fn show(
    ui: &mut Ui,
    camera: &Camera,
    is_moved: bool,
    can_look: [bool; 2],
    bounds: Bounds,
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
    let mut of_view = Changes::default();
    let mut moved = *camera;
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
