//! The renderer as a state machine, for windows and pages.
//!
//! [`Live`] owns a scene and its picture. Setters say what is to be drawn and return at once;
//! [`Live::advance`] works on it for about as long as it is told, and [`Live::display`] is the last
//! good picture meanwhile.

mod report;

use std::time::Duration;

use web_time::Instant;

use crate::camera::{Camera, view_uniform};
use crate::edit::{EditError, EditReport};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::picture::Picture;
use crate::render::{Parts, check_frame, whole_passes};
use crate::scene::{PreparedScene, check_lights};
use crate::tone::ToneMap;
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};

pub use report::{LiveReport, StageReport};

/// How far the picture has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Samples a pixel in the picture that is shown.
    pub samples: u32,
    /// Samples a pixel that it will have.
    pub of_samples: u32,
    /// The light of all points is that of the scene and view as they were last set; if not, the
    /// picture is a draft.
    pub is_shaded: bool,
    /// Nothing is left to do.
    pub is_done: bool,
    /// Estimate of the noise left in the picture: root mean square of the error over root mean
    /// square of the radiance. Unknown before there are two passes.
    pub noise: Option<f32>,
}

/// A scene on a device, drawn bit by bit.
pub struct Live {
    context: Context,
    scene: PreparedScene,
    parts: Parts,
    size: [u32; 2],
    display: (wgpu::Texture, wgpu::TextureView),
    progress: Progress,
    report: LiveReport,
    picture: Option<Picture>,
}

impl Live {
    /// Puts `scene` on the device; the first picture is made by [`Live::advance`], in the scene's
    /// size until [`Live::set_size`] says another.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn new(context: &Context, scene: PreparedScene) -> Result<Live, RenderError> {
        let mut report = LiveReport::default();
        let parts = Parts::new(context, &scene, &mut report.stats)?;
        let size = scene.size;
        let mut live = Live {
            context: context.clone(),
            parts,
            display: display_target(context, size),
            size,
            progress: Progress::default(),
            report,
            picture: None,
            scene,
        };
        live.restart();
        Ok(live)
    }

    /// The scene as it was last set.
    pub fn scene(&self) -> &PreparedScene {
        &self.scene
    }

    /// Looks from elsewhere.
    pub fn set_camera(&mut self, camera: Camera) {
        if self.scene.camera != camera {
            self.scene.camera = camera;
            self.restart();
        }
    }

    /// Width and height of the picture; a side of zero: nothing is drawn.
    ///
    /// # Errors
    /// As [`check_frame`], sides of zero excepted; nothing is changed then.
    pub fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size == self.size {
            return Ok(());
        }
        if !size.contains(&0) {
            check_frame(size, 4)?;
            self.display = display_target(&self.context, size);
        }
        self.size = size;
        self.restart();
        Ok(())
    }

    /// How radiance becomes a picture on the screen.
    pub fn set_grade(&mut self, exposure: f32, tone_map: ToneMap, background: Background) {
        self.scene.exposure = exposure;
        self.scene.tone_map = tone_map;
        self.scene.background = background;
        self.restart();
    }

    /// Other hair, other modes.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    pub fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let report = self.scene.hair.edit(hair, modes)?;
        self.parts.update(&self.context, &self.scene, &report);
        self.report.edit = Some(report.clone());
        self.restart();
        Ok(report)
    }

    /// The terms of scattering that are drawn.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        self.scene.set_scattering(scattering);
        self.rebuild();
    }

    /// d_f and d_b.
    pub fn set_densities(&mut self, densities: [f32; 2]) {
        self.scene.densities = densities;
        self.rebuild();
    }

    /// Other lights.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        check_lights(&lights)?;
        self.scene.lights = lights;
        self.rebuild();
        Ok(())
    }

    /// Other amplitudes of the lights there are, in their order; a black light is not shaded.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        let mut lights = self.scene.lights.clone();
        if rgb.len() != lights.len() {
            return Err(RenderError::Colors {
                colors: rgb.len(),
                lights: lights.len(),
            });
        }
        for (light, &rgb) in lights.iter_mut().zip(rgb) {
            light.rgb = rgb;
        }
        self.set_lights(lights)
    }

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::moved`](crate::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.moved(points)?;
        self.rebuild();
        Ok(())
    }

    /// Samples a pixel that the picture gets at rest, rounded up to whole passes of four.
    pub fn set_samples(&mut self, samples: u32) {
        self.scene.samples = samples;
        self.restart();
    }

    /// Works at most about `budget` on the device.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], after which a new context and a new `Live` are needed, or
    /// whatever else the device refuses.
    pub fn advance(&mut self, budget: Duration) -> Result<Progress, RenderError> {
        let start = Instant::now();
        self.context
            .check("advance")
            .map_err(crate::render::resources::failed)?;
        while !self.progress.is_done {
            let next = (2 * self.progress.samples).clamp(4, self.progress.of_samples);
            let picture = self.draw(next)?;
            self.show(&picture);
            self.picture = Some(picture);
            self.progress.samples = next;
            self.progress.is_shaded = true;
            self.progress.is_done = next == self.progress.of_samples;
            if start.elapsed() >= budget {
                break;
            }
        }
        Ok(self.progress)
    }

    /// The picture on the screen: tone-mapped, encoded in sRGB, multiplied by alpha, `rgba8unorm`
    /// of the size that was set last (and not zero).
    pub fn display(&self) -> &wgpu::TextureView {
        &self.display.1
    }

    /// What the device did since the last edit.
    pub fn report(&self) -> &LiveReport {
        &self.report
    }

    /// Draws `samples` a pixel to the end and reads the picture back: linear, as
    /// [`Renderer::render`](crate::Renderer::render) answers it.
    ///
    /// # Errors
    /// As [`check_frame`], and as [`Live::advance`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn finish(&mut self, samples: u32) -> Result<Picture, RenderError> {
        check_frame(self.size, samples)?;
        self.draw(samples)
    }

    fn draw(&mut self, samples: u32) -> Result<Picture, RenderError> {
        let scale = self.scene.radiance_scale();
        let view = view_uniform(&self.scene.camera, &self.scene.strands, self.size, scale);
        let mut stats = self.report.stats.clone();
        self.parts
            .draw(&self.context, &self.scene, &view, samples, &mut stats)
    }

    fn show(&self, picture: &Picture) {
        let mut texels = picture.to_srgb8(self.scene.exposure, self.scene.tone_map);
        for [r, g, b, a] in &mut texels {
            for x in [r, g, b] {
                *x = (u16::from(*x) * u16::from(*a) / 255) as u8;
            }
        }
        self.context.queue.write_texture(
            self.display.0.as_image_copy(),
            bytemuck::cast_slice(&texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * picture.width),
                rows_per_image: None,
            },
            self.display.0.size(),
        );
    }

    /// Nothing is drawn yet of what is wanted now.
    fn restart(&mut self) {
        self.progress = Progress {
            of_samples: whole_passes(self.scene.samples),
            is_done: self.size.contains(&0),
            ..Progress::default()
        };
    }

    fn rebuild(&mut self) {
        let mut stats = Default::default();
        if let Ok(parts) = Parts::new(&self.context, &self.scene, &mut stats) {
            self.parts = parts;
        }
        self.report.stats = stats;
        self.restart();
    }
}

fn display_target(
    context: &Context,
    [width, height]: [u32; 2],
) -> (wgpu::Texture, wgpu::TextureView) {
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("display"),
        size: wgpu::Extent3d {
            width: width.max(1),
            height: height.max(1),
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let view = texture.create_view(&Default::default());
    (texture, view)
}
