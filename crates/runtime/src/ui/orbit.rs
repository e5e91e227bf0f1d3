//! What mouse and keys do to a camera.
//!
//! The camera turns about its target in its own frame, so nothing special happens above or below
//! the hair: it passes over the top and sees the hair upside down.

use glam::{Quat, Vec3};

use strandlight_scene::Camera;

/// Nearest and farthest that the eye comes to its target, in radii of the hair.
const DISTANCES: [f32; 2] = [1e-3, 200.0];

/// Turns `camera` about its target: `yaw` about the world's vertical, then `pitch` about the
/// picture's horizontal, radians. Positive angles move the hair right and down.
pub fn orbit(camera: &Camera, yaw: f32, pitch: f32) -> Camera {
    let (_, up, _) = camera.axes();
    // Upside down, the hair still follows the mouse.
    let yaw = if up.y < 0.0 { -yaw } else { yaw };
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
        // 200 steps over both poles: no jump in the view, and back where it began.
        let mut at = start;
        let step = std::f32::consts::TAU / 200.0;
        for _ in 0..200 {
            let next = orbit(&at, 0.0, step);
            let (r0, u0, f0) = at.axes();
            let (r1, u1, f1) = next.axes();
            for (a, b) in [(r0, r1), (u0, u1), (f0, f1)] {
                assert!((a - b).length() < 1.5 * step, "{a} to {b}");
            }
            assert!((next.eye.distance(next.target) / distance - 1.0).abs() < 1e-4);
            at = next;
        }
        assert!((at.eye - start.eye).length() < 1e-3 * distance);
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
