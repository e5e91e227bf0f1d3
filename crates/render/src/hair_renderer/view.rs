//! The view of a host, and as the passes see it.

use glam::{Mat4, Vec3};

use strandlight_scene::camera::Camera;

/// The host's view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairView {
    /// From the world of the scene (right-handed, +Y up, cm) to the camera, which looks along -Z: a
    /// rotation, a translation and a uniform scale, by columns. A host in metres whose hair hangs
    /// at `model` gives `view * model * Mat4::from_scale(Vec3::splat(0.01))`; the lights turn with
    /// the hair.
    pub view_from_scene: [[f32; 4]; 4],
    /// From the camera to clip space, as wgpu has it: perspective, depth 0 to 1, in either
    /// direction and with or without a far plane; off-centre if need be. By columns.
    pub clip_from_view: [[f32; 4]; 4],
    /// Upper left corner of the viewport that the host sets, pixels.
    pub origin: [u32; 2],
    /// Width and height of the viewport, pixels.
    pub size: [u32; 2],
    /// Chooses which samples strands thinner than a pixel cover. Constant for a still picture; a
    /// host that blends frames over time counts it up.
    pub frame: u32,
}

/// A view that hair cannot be drawn in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// A side of the viewport is zero.
    #[error("the viewport has a side of zero pixels")]
    Empty,
    /// Not a rotation, a translation and a uniform scale.
    #[error("view_from_scene is not a rotation, a translation and a uniform scale")]
    View,
    /// Not a perspective with square pixels.
    #[error("clip_from_view is not a perspective projection with square pixels")]
    Projection,
}

/// The host's view as the passes see it.
pub(super) struct HostCamera {
    pub camera: Camera,
    /// As [`Host::depth`](crate::passes::strand_pass::Host).
    pub depth: [f32; 2],
    /// As [`Host::shift`](crate::passes::strand_pass::Host).
    pub shift: [f32; 2],
}

impl HostCamera {
    pub fn new(view: &HairView) -> Result<HostCamera, ViewError> {
        if view.size.contains(&0) {
            return Err(ViewError::Empty);
        }
        let matrix = Mat4::from_cols_array_2d(&view.view_from_scene);
        let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.truncate());
        let scale = axes[0].length();
        let is_affine = matrix.row(3) == glam::Vec4::W && matrix.is_finite();
        let is_similar = axes
            .iter()
            .all(|axis| (axis.length() / scale - 1.0).abs() < 1e-3)
            && axes[0].dot(axes[1]).abs() < 1e-3 * scale * scale
            && axes[0].cross(axes[1]).dot(axes[2]) > (1.0 - 1e-3) * scale.powi(3);
        if !is_affine || !is_similar || scale <= 0.0 {
            return Err(ViewError::View);
        }
        let inverse = matrix.inverse();
        let eye = inverse.transform_point3(Vec3::ZERO);
        let direction = |v: Vec3| inverse.transform_vector3(v).normalize();
        let clip = Mat4::from_cols_array_2d(&view.clip_from_view);
        let [m00, m11] = [clip.x_axis.x, clip.y_axis.y];
        let [width, height] = view.size.map(|n| n as f32);
        let others = [
            clip.x_axis.y,
            clip.x_axis.z,
            clip.x_axis.w,
            clip.y_axis.x,
            clip.y_axis.z,
            clip.y_axis.w,
            clip.w_axis.x,
            clip.w_axis.y,
            clip.w_axis.w,
        ];
        let is_perspective = others.iter().all(|x| x.abs() < 1e-6)
            && (clip.z_axis.w + 1.0).abs() < 1e-6
            && m11 > 0.0
            && clip.is_finite();
        let is_square = (m00 * width / (m11 * height) - 1.0).abs() < 1e-3;
        if !is_perspective || !is_square {
            return Err(ViewError::Projection);
        }
        Ok(HostCamera {
            camera: Camera {
                eye,
                target: eye + direction(Vec3::NEG_Z),
                up: direction(Vec3::Y),
                fov_y: 2.0 * (1.0 / m11).atan(),
            },
            // Depth in the scene's cm is `scale` times less than in the host's unit.
            depth: [-clip.z_axis.z, clip.w_axis.z / scale],
            shift: [-clip.z_axis.x, -clip.z_axis.y],
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Mat3;
    use glam::camera::rh::proj::directx::{
        orthographic, perspective, perspective_infinite_reverse,
    };
    use glam::camera::rh::view::look_at_mat4;

    use super::*;

    fn view() -> HairView {
        HairView {
            view_from_scene: look_at_mat4(Vec3::new(3.0, 4.0, 50.0), Vec3::ZERO, Vec3::Y)
                .to_cols_array_2d(),
            clip_from_view: perspective(0.6, 1.5, 0.1, 500.0).to_cols_array_2d(),
            origin: [0, 0],
            size: [300, 200],
            frame: 0,
        }
    }

    #[test]
    fn cameras_and_depths_are_those_of_the_matrices() {
        let point = Vec3::new(1.0, -2.0, 3.0);
        for projection in [
            perspective(0.6, 1.5, 0.1, 500.0),
            perspective_infinite_reverse(0.6, 1.5, 0.1),
        ] {
            for unit in [1.0, 0.01] {
                let matrix = Mat4::from_cols_array_2d(&view().view_from_scene);
                let matrix = Mat4::from_scale(Vec3::splat(unit)) * matrix;
                let view = HairView {
                    clip_from_view: projection.to_cols_array_2d(),
                    view_from_scene: matrix.to_cols_array_2d(),
                    ..view()
                };
                let clip = projection * matrix * point.extend(1.0);
                let camera = HostCamera::new(&view).unwrap();
                let (_, _, forward) = camera.camera.axes();
                let depth = (point - camera.camera.eye).dot(forward);
                let found = camera.depth[0] + camera.depth[1] / depth;
                assert!((found - clip.z / clip.w).abs() < 1e-5, "{found} {clip}");
                assert!((camera.camera.fov_y - 0.6).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn views_that_cannot_be_drawn_are_refused() {
        let refused = |view: &HairView| HostCamera::new(view).err();
        assert_eq!(refused(&view()), None);
        let empty = HairView {
            size: [0, 5],
            ..view()
        };
        assert_eq!(refused(&empty), Some(ViewError::Empty));
        for matrix in [
            Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0)),
            Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
            // Sheared, its axes of equal length.
            Mat4::from_mat3(Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.6, 0.0, 0.8))),
            Mat4::ZERO,
            Mat4::from_scale(Vec3::splat(f32::NAN)),
        ] {
            let view = HairView {
                view_from_scene: matrix.to_cols_array_2d(),
                ..view()
            };
            assert_eq!(refused(&view), Some(ViewError::View), "{matrix}");
        }
        for matrix in [
            orthographic(-1.0, 1.0, -1.0, 1.0, 0.1, 10.0),
            perspective(0.6, 1.0, 0.1, 500.0),
            Mat4::ZERO,
        ] {
            let view = HairView {
                clip_from_view: matrix.to_cols_array_2d(),
                ..view()
            };
            assert_eq!(refused(&view), Some(ViewError::Projection), "{matrix}");
        }
    }
}
