//! The view in numbers.

use egui::Ui;
use strandlight_formats::Scene;

use crate::Camera;
use crate::ui::field::{Changes, Field};
use crate::ui::orbit;
use crate::ui::view::{Bounds, camera_of, section_of};

/// Angle of view and place of the eye.
pub fn show(ui: &mut Ui, scene: &mut Scene, bounds: Bounds, changes: &mut Changes) {
    let camera = camera_of(scene, bounds);
    let mut section = section_of(&camera);
    let mut is_changed = false;
    let default = f64::from(crate::camera::DEFAULT_FOV_Y).to_degrees().round();
    is_changed |= Field::new("Field of view", 1.0..=170.0, default)
        .unit("°")
        .slider(5.0..=90.0)
        .decimals(1)
        .help("Vertical angle of view. Small is a long lens from afar.")
        .show(ui, &mut section.fov_deg, changes);
    let distance = f64::from(camera.eye.distance(camera.target));
    let mut wanted = (distance * 100.0).round() / 100.0;
    let framed = orbit::frame(&camera, bounds.centre, bounds.radius, 1.5);
    let default = f64::from(framed.eye.distance(framed.target));
    let moved = Field::new("Distance", 0.01..=1e5, (default * 100.0).round() / 100.0)
        .unit(" cm")
        .slider(0.1 * default..=5.0 * default)
        .logarithmic()
        .help("From the eye to the point that it turns about.")
        .show(ui, &mut wanted, changes);
    if moved {
        let camera: Camera = orbit::dolly(&camera, (wanted / distance) as f32, bounds.radius);
        section.position = section_of(&camera).position;
        is_changed = true;
    }
    if is_changed {
        scene.camera = Some(section);
    }
}
