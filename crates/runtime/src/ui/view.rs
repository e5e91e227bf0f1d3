//! The picture, and the camera under the mouse.

use egui::{PointerButton, Rect, Sense, Ui};
use glam::Vec3;
use strandlight_formats::{CameraSection, Scene};

use super::field::Changes;
use super::{orbit, theme};
use crate::Camera;
use crate::camera::DEFAULT_FOV_Y;

/// The sphere around the hair, cm.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
}

/// Radians of a turn for a drag over one point of the window.
const ORBIT_SPEED: f32 = 0.008;
/// Natural logarithm of the distance for a drag over one point, and for one point of the wheel.
const DOLLY_SPEED: f32 = 0.006;
const WHEEL_SPEED: f32 = 0.0025;

/// What happened to the picture in a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Width and height in pixels that the picture has room for.
    pub size: [u32; 2],
    /// Where it was clicked, pixels from its upper left.
    pub clicked: Option<[f32; 2]>,
    /// Where it was clicked twice.
    pub clicked_twice: Option<[f32; 2]>,
    /// Is it being dragged?
    pub is_dragged: bool,
    /// Where the mouse is over it.
    pub hover: Option<[f32; 2]>,
    /// Where the brush is down.
    pub brush: Option<[f32; 2]>,
}

/// The camera of `scene`: its own, or the one that frames all hair.
pub fn camera_of(scene: &Scene, bounds: Bounds) -> Camera {
    match &scene.camera {
        Some(section) => {
            let vec = |v: [f64; 3]| Vec3::from(v.map(|x| x as f32));
            Camera {
                eye: vec(section.position),
                target: vec(section.target),
                up: vec(section.up),
                fov_y: section.fov_deg.to_radians() as f32,
            }
        }
        None => Camera::framing(bounds.centre, bounds.radius, DEFAULT_FOV_Y),
    }
}

/// `camera` as a scene file has it.
pub fn section_of(camera: &Camera) -> CameraSection {
    // Through the shortest decimal of the f32, so that files read well.
    let plain = |x: f32| x.to_string().parse().unwrap_or(f64::from(x));
    let vec = |v: Vec3| v.to_array().map(plain);
    CameraSection {
        position: vec(camera.eye),
        target: vec(camera.target),
        up: vec(camera.up),
        fov_deg: plain((camera.fov_y.to_degrees() * 1e4).round() / 1e4),
    }
}

/// Shows `texture` in all that is left of the window and moves the camera of `scene`. Drags for
/// `brush` are not the camera's.
pub fn show(
    ui: &mut Ui,
    texture: Option<egui::TextureId>,
    scene: &mut Scene,
    bounds: Bounds,
    is_brush: bool,
    changes: &mut Changes,
) -> (Seen, egui::Response) {
    let scale = ui.ctx().pixels_per_point();
    let rect = whole_pixels(ui.available_rect_before_wrap(), scale);
    let size = [rect.width(), rect.height()].map(|side| (side * scale).round().max(0.0) as u32);
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    ui.painter().rect_filled(rect, 0.0, theme::BACKDROP);
    if let Some(texture) = texture {
        let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        ui.painter()
            .image(texture, rect, whole, egui::Color32::WHITE);
    }
    let pixel = |place: egui::Pos2| (scale * (place - rect.min)).into();
    let at = |is_so: bool| response.interact_pointer_pos().filter(|_| is_so).map(pixel);
    // With Ctrl the mouse is the camera's even then.
    let is_brush = is_brush && !ui.input(|input| input.modifiers.command);
    let seen = Seen {
        size,
        clicked: at(response.clicked()),
        clicked_twice: at(response.double_clicked() && !is_brush),
        is_dragged: response.dragged(),
        hover: response.hover_pos().map(pixel),
        brush: at(is_brush && response.is_pointer_button_down_on() && primary_down(ui)),
    };
    move_camera(ui, &response, scene, bounds, is_brush, changes);
    (seen, response)
}

fn primary_down(ui: &Ui) -> bool {
    ui.input(|input| input.pointer.button_down(PointerButton::Primary))
}

fn move_camera(
    ui: &Ui,
    response: &egui::Response,
    scene: &mut Scene,
    bounds: Bounds,
    is_brush: bool,
    changes: &mut Changes,
) {
    let camera = camera_of(scene, bounds);
    let height = response.rect.height().max(1.0);
    let drag = response.drag_delta();
    let shift = ui.input(|input| input.modifiers.shift);
    let dragged = |button| response.dragged_by(button) && drag != egui::Vec2::ZERO;
    let (label, moved) = if dragged(PointerButton::Middle)
        || (dragged(PointerButton::Primary) && shift && !is_brush)
    {
        (
            "Pan",
            orbit::pan(&camera, drag.x / height, -drag.y / height),
        )
    } else if dragged(PointerButton::Primary) && !is_brush {
        let turned = orbit::orbit(&camera, drag.x * ORBIT_SPEED, drag.y * ORBIT_SPEED);
        ("Orbit", turned)
    } else if dragged(PointerButton::Secondary) {
        let factor = (DOLLY_SPEED * (drag.y - drag.x)).exp();
        ("Dolly", orbit::dolly(&camera, factor, bounds.radius))
    } else if response.hovered() {
        let (wheel, zoom) = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
        let factor = (-WHEEL_SPEED * wheel).exp() / zoom.max(1e-3);
        if factor == 1.0 {
            return;
        }
        ("Dolly", orbit::dolly(&camera, factor, bounds.radius))
    } else {
        (("Camera"), camera)
    };
    changes.is_complete |= response.drag_stopped();
    if moved != camera {
        set_camera(scene, &moved, label, changes);
    }
}

/// Puts `camera` into the scene.
pub fn set_camera(scene: &mut Scene, camera: &Camera, label: &str, changes: &mut Changes) {
    scene.camera = Some(section_of(camera));
    changes.label = Some(label.to_owned());
}

/// The largest rectangle of whole pixels in `rect`: texels fall on pixels.
fn whole_pixels(rect: Rect, scale: f32) -> Rect {
    let up = |x: f32| (x * scale - 1e-3).ceil() / scale;
    let down = |x: f32| (x * scale + 1e-3).floor() / scale;
    let min = egui::pos2(up(rect.left()), up(rect.top()));
    let max = egui::pos2(
        down(rect.right()).max(min.x),
        down(rect.bottom()).max(min.y),
    );
    Rect::from_min_max(min, max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_survives_the_scene_file() {
        let camera = Camera {
            eye: Vec3::new(0.1, 2.7, 81.3),
            target: Vec3::new(1.5, -0.3, 1e-3),
            up: Vec3::Y,
            fov_y: 0.5,
        };
        let bounds = Bounds {
            centre: Vec3::ZERO,
            radius: 1.0,
        };
        let mut scene = Scene::new("a", "b");
        let framing = camera_of(&scene, bounds);
        assert_eq!(framing.target, Vec3::ZERO);
        set_camera(&mut scene, &camera, "Orbit", &mut Changes::default());
        let again = camera_of(&scene, bounds);
        assert_eq!((again.eye, again.target), (camera.eye, camera.target));
        assert!((again.fov_y - camera.fov_y).abs() < 1e-5);
        assert_eq!(scene.camera.map(|c| c.position[0]), Some(0.1));
    }

    #[test]
    fn the_picture_covers_whole_pixels() {
        let rect = Rect::from_min_max(egui::pos2(0.3, 0.0), egui::pos2(100.2, 50.0));
        let whole = whole_pixels(rect, 1.5);
        assert!((whole.left() * 1.5).fract() < 1e-4);
        assert!(rect.contains_rect(whole.shrink(1e-3)));
        let nothing = Rect::from_min_max(egui::pos2(5.3, 0.0), egui::pos2(5.4, 1.0));
        assert!(whole_pixels(nothing, 1.0).width() == 0.0);
    }
}
