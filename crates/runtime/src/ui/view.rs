//! The picture, and the camera under the mouse.

use egui::{PointerButton, Rect, Sense, Ui};

use super::orbit::{self, Bounds};
use super::stroke_input::{self, Sample};
use super::theme;
use strandlight_scene::Camera;
use strandlight_scene::budget::{MAX_TARGET_PIXELS, MAX_TARGET_SIDE};

/// Radians of a turn for a drag over one point of the window.
const ORBIT_SPEED: f32 = 0.008;
/// Natural logarithm of the distance for a drag over one point, and for one point of the wheel.
const DOLLY_SPEED: f32 = 0.006;
const WHEEL_SPEED: f32 = 0.0025;

/// What happened to the picture in a frame.
#[derive(Clone, Debug, Default)]
pub struct ViewportInput {
    /// Width and height in pixels of the picture: those that it has room for, or fewer where these are more than are drawn at once.
    pub size: [u32; 2],
    /// Of these, for a point of the window.
    pub pixels_per_point: f32,
    /// Where it was clicked, pixels from its upper left.
    pub clicked: Option<[f32; 2]>,
    /// Where it was clicked twice.
    pub clicked_twice: Option<[f32; 2]>,
    /// Is it being dragged?
    pub is_dragged: bool,
    /// Where the mouse is over it.
    pub hover: Option<[f32; 2]>,
    /// Where the brush went while it was down; none where it is up.
    pub brush: Option<Vec<Sample>>,
    /// Where the mouse moved the camera to.
    pub camera: Option<Camera>,
    /// Degrees that it turned the lights by, counter-clockwise seen from above.
    pub turn_lights_deg: Option<f64>,
}

/// Shows `texture`, seen by `camera`, in all that is left of the window, over a checkerboard where it
/// `is_see_through`. Drags move the camera, or with `is_brush` the brush; those that begin at the edge of a panel that
/// `is_beside` are its own.
pub fn show(
    ui: &mut Ui,
    texture: Option<egui::TextureId>,
    camera: &Camera,
    bounds: Bounds,
    (is_brush, is_see_through, is_beside): (bool, bool, bool),
) -> (ViewportInput, egui::Response) {
    let scale = ui.ctx().pixels_per_point();
    let rect = whole_pixels(ui.available_rect_before_wrap(), scale);
    let room = [rect.width(), rect.height()].map(|side| side * scale);
    let shrink = shrink_to_target(room);
    let size = room.map(|side| (side * shrink).round().max(0.0) as u32);
    let pixels_per_point = scale * shrink;
    let mut reach = rect;
    if is_beside {
        // The panel's edge is dragged from either side of it.
        reach.max.x -= ui.style().interaction.resize_grab_radius_side;
    }
    let mut response = ui.allocate_rect(reach, Sense::click_and_drag());
    response.rect = rect;
    ui.painter().rect_filled(rect, 0.0, theme::BACKDROP);
    if is_see_through {
        checkerboard(ui, rect);
    }
    if let Some(texture) = texture {
        let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        ui.painter()
            .image(texture, rect, whole, egui::Color32::WHITE);
    }
    let pixel = |place: egui::Pos2| (pixels_per_point * (place - rect.min)).into();
    let at = |is_so: bool| response.interact_pointer_pos().filter(|_| is_so).map(pixel);
    // With Ctrl the mouse is the camera's even then, and two fingers always are.
    let is_camera = ui.input(|input| input.modifiers.command || input.multi_touch().is_some());
    let is_brush = is_brush && !is_camera;
    // Lights in front of the hair follow the mouse.
    let is_turning = ui.input(|input| input.modifiers.command && input.modifiers.shift)
        && response.dragged_by(PointerButton::Primary);
    let turn = f64::from((response.drag_delta().x * ORBIT_SPEED).to_degrees());
    let viewport = ViewportInput {
        size,
        pixels_per_point,
        clicked: at(response.clicked()),
        clicked_twice: at(response.double_clicked() && !is_brush),
        is_dragged: response.dragged(),
        hover: response.hover_pos().map(pixel),
        brush: at(is_brush && response.is_pointer_button_down_on() && primary_down(ui))
            .map(|last| ui.input(|input| stroke_input::path(&input.events, pixel, last))),
        camera: match is_turning {
            true => None,
            false => move_camera(ui, &response, camera, bounds, is_brush),
        },
        turn_lights_deg: (is_turning && turn != 0.0).then_some(turn),
    };
    (viewport, response)
}

/// By how much the sides of a picture with room for so many pixels are multiplied, so that it can be drawn at once: 1 but for very
/// large windows.
fn shrink_to_target([width, height]: [f32; 2]) -> f32 {
    // Rounding to whole pixels makes sides longer by half of one.
    let most_pixels = (MAX_TARGET_PIXELS - 2 * MAX_TARGET_SIDE) as f32;
    let by_pixels = (most_pixels / (width * height).max(1.0)).sqrt();
    let by_side = MAX_TARGET_SIDE as f32 / width.max(height).max(1.0);
    let fits = width * height <= MAX_TARGET_PIXELS as f32;
    by_side.min(if fits { 1.0 } else { by_pixels }).min(1.0)
}

fn primary_down(ui: &Ui) -> bool {
    ui.input(|input| input.pointer.button_down(PointerButton::Primary))
}

/// Where `camera` goes if the mouse moves it in this frame.
fn move_camera(
    ui: &Ui,
    response: &egui::Response,
    camera: &Camera,
    bounds: Bounds,
    is_brush: bool,
) -> Option<Camera> {
    let height = response.rect.height().max(1.0);
    let drag = response.drag_delta();
    let shift = ui.input(|input| input.modifiers.shift);
    let dragged = |button| response.dragged_by(button) && drag != egui::Vec2::ZERO;
    let touch = ui.input(egui::InputState::multi_touch);
    let touch = touch.filter(|touch| response.rect.contains(touch.start_pos));
    let moved = if let Some(touch) = touch {
        let shift = touch.translation_delta / height;
        let panned = orbit::pan(camera, shift.x, -shift.y);
        orbit::dolly(&panned, 1.0 / touch.zoom_delta.max(1e-3), bounds.radius)
    } else if dragged(PointerButton::Middle)
        || (dragged(PointerButton::Primary) && shift && !is_brush)
    {
        orbit::pan(camera, drag.x / height, -drag.y / height)
    } else if dragged(PointerButton::Primary) && !is_brush {
        orbit::orbit(camera, drag.x * ORBIT_SPEED, drag.y * ORBIT_SPEED)
    } else if dragged(PointerButton::Secondary) {
        let factor = (DOLLY_SPEED * (drag.y - drag.x)).exp();
        orbit::dolly(camera, factor, bounds.radius)
    } else if response.hovered() {
        let (wheel, zoom) = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
        let factor = (-WHEEL_SPEED * wheel).exp() / zoom.max(1e-3);
        if factor == 1.0 {
            return None;
        }
        orbit::dolly(camera, factor, bounds.radius)
    } else {
        return None;
    };
    (moved != *camera).then_some(moved)
}

/// Side of a field of the checkerboard, points.
const FIELD: f32 = 12.0;

/// What is behind a picture that is seen through.
fn checkerboard(ui: &Ui, rect: Rect) {
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, egui::Color32::from_gray(102));
    let mut fields = egui::Mesh::default();
    let count = |length: f32| (length / FIELD).ceil().max(0.0) as u32;
    for y in 0..count(rect.height()) {
        for x in (y % 2..count(rect.width())).step_by(2) {
            let at = rect.min + FIELD * egui::vec2(x as f32, y as f32);
            let field = Rect::from_min_size(at, egui::Vec2::splat(FIELD));
            fields.add_colored_rect(field, egui::Color32::from_gray(153));
        }
    }
    painter.add(fields);
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
    use strandlight_scene::budget::check_target;

    use super::*;

    #[test]
    fn pictures_of_very_large_windows_are_as_large_as_can_be_drawn() {
        for room in [[640.0, 480.0], [3840.0, 2160.0], [8192.0, 1024.0]] {
            assert_eq!(shrink_to_target(room), 1.0, "{room:?}");
        }
        for room in [
            [5120.0, 2880.0],
            [5120.0, 2160.0],
            [16384.0, 300.0],
            [9000.0, 8000.0],
            [2897.0, 2897.0],
        ] {
            let shrink = shrink_to_target(room);
            let size = room.map(|side| (side * shrink).round() as u32);
            check_target(size).expect("it is drawn at once");
            let [width, height] = size.map(|side| side as f32);
            assert!(
                ((width * room[1]) / (height * room[0]) - 1.0).abs() < 0.003,
                "{size:?}"
            );
            let is_large = width * height > 0.99 * MAX_TARGET_PIXELS as f32;
            assert!(is_large || width == MAX_TARGET_SIDE as f32, "{size:?}");
        }
        assert_eq!(shrink_to_target([0.0, 0.0]), 1.0);
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
