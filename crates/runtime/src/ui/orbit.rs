//! What mouse and keys do to a camera.
//!
//! The camera turns about the world's vertical and its own horizontal, and stops short of looking
//! straight up or down: hair is not turned upside down by the mouse. A camera that a scene holds
//! upside down stays so.

use glam::{Quat, Vec3};

use super::keys::Side;
use strandlight_scene::Camera;
use strandlight_scene::strands::Strands;

/// The sphere around the hair, cm.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Its centre.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
}

impl Bounds {
    /// That around `strands`.
    pub fn of(strands: &Strands) -> Bounds {
        Bounds {
            centre: strands.centre,
            radius: strands.radius,
        }
    }
}

/// Steepest view up or down that a drag leads to, radians.
const STEEPEST: f32 = 89.0 * std::f32::consts::PI / 180.0;

/// Nearest and farthest that the eye comes to its target, in radii of the hair.
const DISTANCES: [f32; 2] = [1e-3, 200.0];

/// Turns `camera` about its target: `yaw` about the world's vertical, then `pitch` about the
/// picture's horizontal, radians. Positive angles move the hair right and down.
pub fn orbit(camera: &Camera, yaw: f32, pitch: f32) -> Camera {
    let (_, up, forward) = camera.axes();
    // Upside down, the hair still follows the mouse.
    let yaw = if up.y < 0.0 { -yaw } else { yaw };
    let elevation = forward.y.clamp(-1.0, 1.0).asin();
    let pitch = match up.y < 0.0 {
        true => pitch,
        // From beyond there is a way back, and none farther.
        false => pitch.clamp(
            (elevation - STEEPEST).min(0.0),
            (elevation + STEEPEST).max(0.0),
        ),
    };
    let about_vertical = Quat::from_rotation_y(-yaw);
    let (right, up, forward) = {
        let (right, up, forward) = camera.axes();
        (
            about_vertical * right,
            about_vertical * up,
            about_vertical * forward,
        )
    };
    let about_horizontal = Quat::from_axis_angle(right.normalize(), -pitch);
    let forward = (about_horizontal * forward).normalize();
    let up = about_horizontal * up;
    let distance = camera.eye.distance(camera.target);
    Camera {
        eye: camera.target - distance * forward,
        up: tidy_up(right, up),
        ..*camera
    }
}

/// Moves eye and target so that the hair at the target moves by `right` and `up`, in heights of
/// the picture.
pub fn pan(camera: &Camera, right: f32, up: f32) -> Camera {
    let (axis_right, axis_up, _) = camera.axes();
    let distance = camera.eye.distance(camera.target);
    let height = 2.0 * distance * (0.5 * camera.fov_y).tan();
    let shift = -height * (right * axis_right + up * axis_up);
    Camera {
        eye: camera.eye + shift,
        target: camera.target + shift,
        ..*camera
    }
}

/// Brings the eye to `factor` times its distance; the hair has `radius` cm.
pub fn dolly(camera: &Camera, factor: f32, radius: f32) -> Camera {
    let from_target = camera.eye - camera.target;
    let distance = from_target.length();
    let [near, far] = DISTANCES.map(|share| share * radius.max(1e-2));
    let wanted = (distance * factor).clamp(near.min(distance), far.max(distance));
    let (_, _, forward) = camera.axes();
    Camera {
        eye: camera.target - wanted * forward,
        ..*camera
    }
}

/// Looks at the sphere `centre`, `radius` from the same side, so that it just fills a picture of
/// `aspect` (width over height).
pub fn frame(camera: &Camera, centre: Vec3, radius: f32, aspect: f32) -> Camera {
    let half_y = 0.5 * camera.fov_y;
    let half_x = (half_y.tan() * aspect.max(1e-3)).atan();
    let distance = 1.03 * radius.max(1e-3) / half_y.min(half_x).sin();
    let (_, _, forward) = camera.axes();
    Camera {
        eye: centre - distance * forward,
        target: centre,
        ..*camera
    }
}

/// Looks at all hair from a `side`, at a distance that fills a picture of `aspect`.
pub fn from_side(camera: &Camera, side: Side, bounds: Bounds, aspect: f32) -> Camera {
    let (from, up) = match side {
        Side::Front => (Vec3::Z, Vec3::Y),
        Side::Back => (Vec3::NEG_Z, Vec3::Y),
        Side::Right => (Vec3::X, Vec3::Y),
        Side::Left => (Vec3::NEG_X, Vec3::Y),
        // The face is below, as seen from the front.
        Side::Top => (Vec3::Y, Vec3::NEG_Z),
        Side::Bottom => (Vec3::NEG_Y, Vec3::Z),
    };
    let turned = Camera {
        eye: bounds.centre + from,
        target: bounds.centre,
        up,
        ..*camera
    };
    frame(&turned, bounds.centre, bounds.radius, aspect)
}

/// `up`, or exactly +Y where that gives the same picture: files stay readable.
fn tidy_up(right: Vec3, up: Vec3) -> Vec3 {
    if right.y.abs() < 1e-6 && up.y > 0.05 {
        Vec3::Y
    } else {
        up.normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::framing(Vec3::new(1.0, 2.0, 3.0), 10.0, 0.5)
    }

    #[test]
    fn orbit_keeps_target_and_distance_and_returns() {
        let start = camera();
        let distance = start.eye.distance(start.target);
        let turned = orbit(&orbit(&start, 0.7, 0.0), -0.7, 0.0);
        assert!((turned.eye - start.eye).length() < 1e-4 * distance);
        assert_eq!(turned.up, Vec3::Y);
        // Up to the pole and no farther, without a jump on the way, and back.
        for sign in [1.0, -1.0] {
            let mut at = start;
            let step = sign * std::f32::consts::TAU / 200.0;
            for _ in 0..200 {
                let next = orbit(&at, 0.0, step);
                let (r0, u0, f0) = at.axes();
                let (r1, u1, f1) = next.axes();
                for (a, b) in [(r0, r1), (u0, u1), (f0, f1)] {
                    assert!((a - b).length() < 1.5 * step.abs(), "{a} to {b}");
                }
                assert!((next.eye.distance(next.target) / distance - 1.0).abs() < 1e-4);
                assert!(u1.y > 0.0, "upside down");
                at = next;
            }
            let (_, _, forward) = at.axes();
            assert!(
                (forward.y.asin().abs() - STEEPEST).abs() < 1e-3,
                "{forward}"
            );
            let back = orbit(&at, 0.0, -step);
            assert!(back.axes().1.y > at.axes().1.y);
        }
    }

    #[test]
    fn sides_show_all_hair_and_are_left_without_a_jump() {
        let bounds = Bounds {
            centre: Vec3::new(1.0, 2.0, 3.0),
            radius: 10.0,
        };
        for (side, name) in Side::ALL {
            let view = from_side(&camera(), side, bounds, 1.5);
            let framed = frame(&view, bounds.centre, bounds.radius, 1.5);
            assert!((framed.eye - view.eye).length() < 1e-3, "{name}");
            assert_eq!(view.target, bounds.centre, "{name}");
            let turned = orbit(&view, 0.01, 0.0);
            let (_, _, forward) = view.axes();
            assert!((turned.axes().2 - forward).length() < 0.02, "{name}");
        }
        let front = from_side(&camera(), Side::Front, bounds, 1.5);
        assert!(front.eye.z > 3.0 && (front.eye.x - 1.0).abs() < 1e-4);
        let top = from_side(&camera(), Side::Top, bounds, 1.5);
        let (right, up, _) = top.axes();
        assert!(right.x > 0.99 && up.z < -0.99);
        // And a drag down the picture cannot pass over the pole from there.
        assert!(orbit(&top, 0.0, 0.5).axes().1.y >= -1e-3);
    }

    #[test]
    fn the_hair_follows_the_mouse() {
        let start = camera();
        let (right, up, _) = start.axes();
        // A point in front of the target moves right when dragged right, and down when down.
        let front = start.target + 0.1 * (start.eye - start.target).normalize();
        let place = |camera: &Camera| {
            let (r, u, _) = camera.axes();
            let offset = front - camera.eye;
            (offset.dot(r), offset.dot(u))
        };
        let (x, y) = place(&start);
        let (turned, _) = place(&orbit(&start, 0.2, 0.0));
        assert!(turned > x + 1e-3);
        let (_, turned) = place(&orbit(&start, 0.0, 0.2));
        assert!(turned < y - 1e-3);
        // Panning by a whole picture moves the target out of it by just that.
        let panned = pan(&start, 1.0, 0.0);
        let height = 2.0 * start.eye.distance(start.target) * (0.5 * start.fov_y).tan();
        assert!(((panned.target - start.target).dot(right) + height).abs() < 1e-3);
        assert!((panned.target - start.target).dot(up).abs() < 1e-4);
    }

    #[test]
    fn dolly_stays_in_range_and_frame_fills_the_picture() {
        let start = camera();
        let distance = start.eye.distance(start.target);
        let near = dolly(&start, 0.5, 10.0);
        assert!((near.eye.distance(near.target) - 0.5 * distance).abs() < 1e-3);
        let nearest = dolly(&start, 0.0, 10.0);
        assert!((nearest.eye.distance(nearest.target) - 0.01).abs() < 1e-3);
        let framed = frame(&pan(&near, 0.3, 0.2), start.target, 10.0, 2.0);
        assert!((framed.eye - start.eye).length() < 1e-3 * distance);
        // A tall picture needs more distance.
        let tall = frame(&start, start.target, 10.0, 0.5);
        assert!(tall.eye.distance(tall.target) > 1.8 * distance);
    }
}
