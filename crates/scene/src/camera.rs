//! The camera: a pinhole looking from `eye` to `target`.

use glam::Vec3;

use crate::strands::Strands;

/// A pinhole camera in world space (cm, right-handed, +Y up).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the pinhole.
    pub eye: Vec3,
    /// A point on the optical axis.
    pub target: Vec3,
    /// Direction that is upwards in the picture.
    pub up: Vec3,
    /// Full vertical angle of view, radians, in (0, pi).
    pub fov_y: f32,
}

/// Default vertical angle of view: 30 degrees.
pub const DEFAULT_FOV_Y: f32 = 30.0 * std::f32::consts::PI / 180.0;

impl Camera {
    /// Frames the sphere `centre`, `radius` from +Z and a little above, in a picture of any aspect
    /// ratio not narrower than a square.
    pub fn framing(centre: Vec3, radius: f32, fov_y: f32) -> Self {
        // 12 degrees above the horizon; the sphere touches the upper and lower edges at 1.0.
        let towards_eye = Vec3::new(0.0, 0.208, 0.978).normalize();
        let distance = 1.03 * radius.max(1e-3) / (0.5 * fov_y).sin();
        Camera {
            eye: centre + towards_eye * distance,
            target: centre,
            up: Vec3::Y,
            fov_y,
        }
    }

    /// Distance of the image plane of a picture so many pixels high, px.
    pub fn focal_px(&self, height: f32) -> f32 {
        0.5 * height / (0.5 * self.fov_y).tan()
    }

    /// The orthonormal axes `(right, up, forward)`. Where `up` is parallel to the line of sight
    /// or the target is the eye, another axis takes its place.
    pub fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let forward = (self.target - self.eye)
            .try_normalize()
            .unwrap_or(Vec3::NEG_Z);
        let right = forward
            .cross(self.up)
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        (right, right.cross(forward), forward)
    }
}

/// What the passes know of the view; mirrored by `View` in `shaders/lib/view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[doc(hidden)]
pub struct ViewUniform {
    /// Camera position, cm.
    pub eye: [f32; 3],
    /// [`Camera::focal_px`].
    pub focal_px: f32,
    /// Unit vector to the right of the picture.
    pub right: [f32; 3],
    /// Depth of the near plane along `forward`, cm.
    pub near: f32,
    /// Unit vector upwards in the picture.
    pub up: [f32; 3],
    /// Depth of the far plane, cm.
    pub far: f32,
    /// Unit vector into the picture.
    pub forward: [f32; 3],
    /// Points are shaded if they lie within this many pixels around the picture; more of wide strands and of long
    /// segments, see [`shading_margin`].
    pub margin_px: f32,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Factor of all radiance inside the passes, a power of two; divided out at the end. It keeps
    /// half-float render targets in their range whatever the unit of the lights.
    pub radiance_scale: f32,
    /// Strand points, for the passes that run over them.
    pub n_points: u32,
    /// Upper left pixel of the part of the picture that is drawn.
    pub origin: [u32; 2],
    /// Width and height of that part.
    pub extent: [u32; 2],
}

strandlight_scattering::mirrors! {
    ViewUniform as "View" in "lib/view" {
        eye, focal_px, right, near, up, far, forward, margin_px, size, radiance_scale, n_points,
        origin, extent,
    }
}

/// Strands that are wider on the screen, px, have a profile over their width, and round tips.
#[doc(hidden)]
pub const WIDE_PX: f32 = 2.0;

/// Pixels around the picture in which points are shaded at least.
const LEAST_MARGIN_PX: f32 = 16.0;

/// Depth range and pixel frame of `camera` looking at `strands`.
#[doc(hidden)]
pub fn view_uniform(
    camera: &Camera,
    strands: &Strands,
    size: [u32; 2],
    radiance_scale: f32,
) -> ViewUniform {
    let (right, up, forward) = camera.axes();
    let centre_depth = (strands.centre - camera.eye).dot(forward);
    // A camera inside the groom still needs a near plane in front of it.
    // Refined curves swing out a little beyond the groom's points.
    let margin = 1.1 * strands.radius + 1e-3;
    let far = (centre_depth + margin).max(2e-3);
    let near = (centre_depth - margin).max(1e-3 * margin).min(0.5 * far);
    ViewUniform {
        eye: camera.eye.to_array(),
        focal_px: camera.focal_px(size[1] as f32),
        right: right.to_array(),
        near,
        up: up.to_array(),
        far,
        forward: forward.to_array(),
        margin_px: LEAST_MARGIN_PX,
        size,
        radiance_scale,
        n_points: strands.points.len() as u32,
        origin: [0, 0],
        extent: size,
    }
}

/// x to the right and y downwards in pixels, and the depth along the line of sight in cm.
#[doc(hidden)]
pub fn screen_position(view: &ViewUniform, position: Vec3) -> [f32; 3] {
    let from_eye = position - Vec3::from(view.eye);
    let depth = from_eye.dot(Vec3::from(view.forward));
    let scale = view.focal_px / depth.max(view.near);
    let x = 0.5 * view.size[0] as f32 + scale * from_eye.dot(Vec3::from(view.right));
    let y = 0.5 * view.size[1] as f32 - scale * from_eye.dot(Vec3::from(view.up));
    [x, y, depth]
}

/// How far from the picture, px, a point of this depth is shaded whose strand reaches `reach` cm from it: to the other
/// ends of its segments, and over its width. So both ends of what is seen of a segment are.
#[doc(hidden)]
pub fn shading_margin(view: &ViewUniform, depth: f32, reach: f32) -> f32 {
    let reach_px = reach * view.focal_px / (depth - reach).max(view.near);
    view.margin_px + (reach_px - LEAST_MARGIN_PX).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal_even_when_up_is_the_line_of_sight() {
        for (target, up) in [
            (Vec3::new(1.0, 2.0, -3.0), Vec3::Y),
            (Vec3::Y, Vec3::Y),
            (Vec3::ZERO, Vec3::Y),
            (Vec3::X, Vec3::ZERO),
        ] {
            let camera = Camera {
                eye: Vec3::ZERO,
                target,
                up,
                fov_y: 0.5,
            };
            let (r, u, f) = camera.axes();
            for v in [r, u, f] {
                assert!((v.length() - 1.0).abs() < 1e-5, "{target} {up}: {v}");
            }
            assert!(r.dot(u).abs() < 1e-5 && u.dot(f).abs() < 1e-5 && f.dot(r).abs() < 1e-5);
            assert!(
                (r.cross(u) + f).length() < 1e-5,
                "right-handed, looking along -z"
            );
        }
    }
}
