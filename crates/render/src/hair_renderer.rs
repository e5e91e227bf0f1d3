//! Hair in the render pass of another program.

use glam::{Mat4, Vec3};

use crate::device_scene::{DeviceScene, Log, Stepped};
use crate::gpu::{Context, GpuError};
use crate::hair_options::HairOptions;
use crate::limits;
use crate::passes::clock::Clock;
use crate::passes::hosted::{Host, Hosted};
use crate::passes::lighting::POINT_CHUNK;
use crate::report::RenderReport;
use std::ops::Range;
use strandlight_formats::{Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::RenderError;
use strandlight_scene::camera::Camera;
use strandlight_scene::material::{EditError, EditReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::scene::PreparedScene;

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

/// Why hair cannot be prepared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HairError {
    /// The view.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The device cannot do what is needed, or failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene does not fit, or the device refuses it.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Not 1 or 4 samples.
    #[error("{0} samples a pixel: hair is drawn with 1 or 4")]
    Samples(u32),
}

/// How much of the shading a call of [`HairRenderer::prepare`] does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrepareBudget {
    /// All of it: the picture is that of the scene and view as set.
    #[default]
    Complete,
    /// At most so many steps: a shadow map, a direction of a batch of lights, or 32,768 points
    /// each. Hair keeps the shading of the last complete job meanwhile, and moves with the view.
    Steps(u32),
}

/// Draws hair in a host's render pass, on the host's device.
///
/// Nothing is submitted and no callback is set: commands go into the host's encoder and pass. The
/// order of a frame is [`HairRenderer::prepare`], then [`HairRenderer::draw`] in a pass recorded
/// later with the same encoder, then the host's submission. Proxies of the scene shade the hair and
/// are not drawn: the host draws its own meshes.
///
/// Besides the commands, setters and `prepare` write to buffers and textures through the queue,
/// which take effect when the host submits.
pub struct HairRenderer {
    context: Context,
    options: HairOptions,
    loaded: Option<Loaded>,
}

/// A scene that is on the device.
struct Loaded {
    core: DeviceScene,
    hosted: Hosted,
    clock: Clock,
    report: RenderReport,
    /// The view that the ribbons are projected for, and the scale of their radiance.
    projected: Option<(HairView, f32)>,
}

impl HairRenderer {
    /// A renderer on the host's device, without hair.
    ///
    /// # Errors
    /// Limits of the device that are too low: see [`required_limits`]. Samples other than 1 or 4.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        options: HairOptions,
    ) -> Result<HairRenderer, HairError> {
        if ![1, 4].contains(&options.sample_count) {
            return Err(HairError::Samples(options.sample_count));
        }
        required_limits(&device.limits())?;
        Ok(HairRenderer {
            context: Context::of_host(device, queue),
            options,
            loaded: None,
        })
    }

    /// Puts `scene` on the device, in place of what was there. Its camera, size and samples are the
    /// host's affair and are not used.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn set_scene(&mut self, scene: PreparedScene) -> Result<(), HairError> {
        self.loaded = None;
        let core = DeviceScene::new(&self.context, scene)?;
        let radiance = core.radiance();
        let hosted = Hosted::new(&self.context, &self.options, &core.ribbons, &radiance)?;
        self.loaded = Some(Loaded {
            hosted,
            core,
            clock: Clock::none(),
            report: RenderReport::default(),
            projected: None,
        });
        Ok(())
    }

    /// The scene as last set.
    pub fn scene(&self) -> Option<&PreparedScene> {
        self.loaded.as_ref().map(|loaded| &loaded.core.scene)
    }

    /// Is the hair that [`HairRenderer::draw`] draws lit as last set? If not, another
    /// [`HairRenderer::prepare`] goes on.
    pub fn is_complete(&self) -> bool {
        self.loaded
            .as_ref()
            .is_some_and(|loaded| loaded.core.is_lit())
    }

    /// What was made on the device; submissions stay 0.
    #[doc(hidden)]
    pub fn counts(&self) -> crate::gpu::ResourceCounts {
        self.context.counts()
    }

    /// Edits the hair's parameters and modes; recomputes only the tables that depend on what
    /// changed. Nothing happens without a scene.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    pub fn set_hair(
        &mut self,
        hair: &HairParams,
        modes: &[Lobe],
    ) -> Result<Option<EditReport>, EditError> {
        let loaded = self.loaded.as_mut();
        loaded
            .map(|loaded| loaded.core.set_hair(hair, modes))
            .transpose()
    }

    /// Replaces the lights: directions, bandwidths and amplitudes.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), HairError> {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_lights(lights)?;
        }
        Ok(())
    }

    /// Replaces the amplitudes of the lights, which keep their shadows.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), HairError> {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_light_colors(rgb)?;
        }
        Ok(())
    }

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::moved`](strandlight_scene::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), HairError> {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_points(points)?;
            loaded.projected = None;
        }
        Ok(())
    }

    /// Bends the strands in the wind, on the device.
    pub fn set_wind(&mut self, wind: Option<Wind>) {
        if let Some(loaded) = &mut self.loaded
            && loaded.core.set_wind(wind)
        {
            loaded.projected = None;
        }
    }

    /// Replaces the paint of the groom's points in `changed`.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`]; nothing is changed then.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), HairError> {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_paint(paint, changed)?;
        }
        Ok(())
    }

    /// Replaces what else stands in the light.
    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_proxies(proxies);
        }
    }

    /// Chooses the terms of scattering that are drawn.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        if let Some(loaded) = &mut self.loaded {
            loaded.core.set_scattering(scattering);
        }
    }

    /// Records into `encoder` what has to run before [`HairRenderer::draw`]: shadows and shading of
    /// what changed, at most as `budget` says, and the projection of the strands. Nothing is
    /// recorded where nothing changed.
    ///
    /// # Errors
    /// A view that hair cannot be drawn in, nothing being changed then; whatever the device
    /// refuses.
    pub fn prepare(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &HairView,
        budget: PrepareBudget,
    ) -> Result<(), HairError> {
        let camera = HostCamera::new(view)?;
        let Some(loaded) = &mut self.loaded else {
            return Ok(());
        };
        self.context.record(encoder, || {
            loaded.prepare(view, &camera, budget).map_err(Into::into)
        })
    }

    /// Draws the hair into `pass`, whose attachments are those of [`HairOptions`] and whose
    /// viewport is that of the last [`HairRenderer::prepare`]. Writes linear radiance and alpha 1
    /// to the samples that strands cover; sets pipeline, bind group 0 and index buffer.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        if let Some(loaded) = &self.loaded
            && loaded.projected.is_some()
        {
            let core = &loaded.core;
            loaded.hosted.draw(pass, &core.ribbons, core.front);
        }
    }
}

impl Loaded {
    fn prepare(
        &mut self,
        view: &HairView,
        camera: &HostCamera,
        budget: PrepareBudget,
    ) -> Result<(), RenderError> {
        self.core.set_camera(camera.camera);
        self.core.set_size(view.size);
        let log = &mut Log {
            clock: &mut self.clock,
            report: &mut self.report,
        };
        let mut left = match budget {
            PrepareBudget::Complete => u32::MAX,
            PrepareBudget::Steps(steps) => steps.max(1),
        };
        while left > 0 && !self.core.is_lit() {
            if self.core.job.is_none() {
                if self
                    .core
                    .begin(Default::default(), false, POINT_CHUNK, log)?
                {
                    self.projected = None;
                }
                if self.core.front_scale.is_none() && budget != PrepareBudget::Complete {
                    self.core.preview(log)?;
                }
            }
            match self.core.step(POINT_CHUNK, log)? {
                Some(Stepped::Ran(..)) => left -= 1,
                Some(Stepped::Restarted | Stepped::Done(_)) | None => {}
            }
        }
        let Some(scale) = self.core.front_scale else {
            return Ok(());
        };
        if self.projected == Some((*view, scale)) {
            return Ok(());
        }
        let core = &self.core;
        let uniform = core.view();
        core.ribbons.set_view(&core.context, &uniform);
        core.ribbons.set_frame(&core.context, view.frame);
        let is_same = self.projected.is_some_and(|(before, _)| {
            HairView {
                frame: view.frame,
                ..before
            } == *view
        });
        if !is_same {
            core.ribbons
                .project(&core.context, &core.projection, Default::default());
        }
        let host = Host {
            depth: camera.depth,
            shift: camera.shift,
            corner: view.origin.map(|x| x as f32),
            scale: 1.0 / scale,
            pad: 0.0,
        };
        self.hosted.set_host(&core.context, &host);
        self.projected = Some((*view, scale));
        Ok(())
    }
}

/// The host's view as the passes see it.
struct HostCamera {
    camera: Camera,
    depth: [f32; 2],
    shift: [f32; 2],
}

impl HostCamera {
    fn new(view: &HairView) -> Result<HostCamera, ViewError> {
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
            && axes[0].cross(axes[1]).dot(axes[2]) > 0.0;
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

/// The limits that a host asks its adapter for, which offers `offered`: WebGPU's defaults, or less
/// where the adapter has less and hair needs no more.
///
/// # Errors
/// The first limit that is too low for hair.
pub fn required_limits(offered: &wgpu::Limits) -> Result<wgpu::Limits, GpuError> {
    limits::to_ask_for(offered, limits::Demand::Least).map_err(|reason| GpuError::Unsuitable {
        adapter: "of the host".to_owned(),
        reason,
    })
}

#[cfg(test)]
mod tests {
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
