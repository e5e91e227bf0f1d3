//! What is to be drawn: setters that write it down and return at once.

use std::ops::Range;

use super::{Drawn, ProgressiveRenderer};
use crate::invalidation::Inputs;
use crate::passes::parts::{Spread, fitting};
use crate::passes::screen::Screen;
use crate::passes::target::{PassSamples, Target};
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::RenderError;
use strandlight_scene::budget::check_target;
use strandlight_scene::camera::Camera;
use strandlight_scene::material::{EditError, EditReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::tone::ToneMap;

impl ProgressiveRenderer {
    /// Looks from elsewhere.
    pub fn set_camera(&mut self, camera: Camera) {
        if self.core.set_camera(camera) {
            self.edited();
            self.picture = Drawn::default();
            self.noise.restart();
        }
    }

    /// Width and height of the picture; a side of zero: nothing is drawn.
    ///
    /// # Errors
    /// As [`check_target`], sides of zero excepted; what is too large for the device. Nothing is
    /// changed then.
    pub fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size == self.size {
            return Ok(());
        }
        self.edited();
        if size.contains(&0) {
            self.target = None;
        } else {
            check_target(size)?;
            self.check_device(size)?;
            let (context, draw, ribbons) = (&self.core.context, &self.draw, &self.core.ribbons);
            // One at a time on the device.
            self.target = None;
            let (lights, _) = self.core.lighting.lit();
            self.target = Some(Target::new(context, draw, ribbons, size, lights));
            self.next_screen = Some(Screen::new(context, size));
            self.noise.forget_target();
            self.core.set_size(size);
            self.core.dirty.inputs |= Inputs::VIEW;
        }
        self.size = size;
        self.picture = Drawn::default();
        Ok(())
    }

    /// The size for [`ProgressiveRenderer::set_size`] that shows pictures of `size`: that itself,
    /// or the largest of the same shape, about.
    pub fn fitting(&self, size: [u32; 2]) -> [u32; 2] {
        fitting(size, &self.core.context.device.limits())
    }

    /// Refuses pictures that the device is too small for.
    fn check_device(&self, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        let limits = self.core.context.device.limits();
        let most = limits.max_texture_dimension_2d;
        if width.max(height) > most {
            return Err(RenderError::AdapterSize {
                width,
                height,
                most,
            });
        }
        let limit = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        let bytes = 16 * u64::from(width) * u64::from(height);
        if bytes > limit {
            return Err(RenderError::TooLarge {
                what: format!("a picture of {width}x{height}"),
                bytes,
                limit,
            });
        }
        Ok(())
    }

    /// How radiance becomes a picture on the screen.
    pub fn set_grade(&mut self, exposure: f32, tone_map: ToneMap, background: Background) {
        let scene = &mut self.core.scene;
        let before = (scene.exposure, scene.tone_map, scene.background);
        if before == (exposure, tone_map, background) {
            return;
        }
        (scene.exposure, scene.tone_map, scene.background) = (exposure, tone_map, background);
        self.edited();
        self.picture.shown = 0;
    }

    /// Other hair, other modes.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    pub fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let report = self.core.set_hair(hair, modes)?;
        if report.rebuilt().next().is_some() {
            self.edited();
        }
        self.report.edit = Some(report.clone());
        Ok(report)
    }

    /// The terms of scattering that are drawn.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        if self.core.set_scattering(scattering) {
            self.edited();
        }
    }

    /// d_f and d_b.
    pub fn set_densities(&mut self, densities: [f32; 2]) {
        if self.core.set_densities(densities) {
            self.edited();
        }
    }

    /// Other lights. Their amplitudes share out the shadow maps; where some are to be black for the
    /// time being, [`ProgressiveRenderer::set_light_colors`] says so afterwards.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        if self.core.set_lights(lights)? {
            self.edited();
        }
        Ok(())
    }

    /// Other amplitudes of the lights there are, in their order; a black light is not shaded, and
    /// keeps its shadows.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        if self.core.set_light_colors(rgb)? {
            self.edited();
        }
        Ok(())
    }

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::moved`](strandlight_scene::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.core.set_points(points)?;
        self.spread = Spread::of(&self.core.scene.strands);
        self.edited();
        Ok(())
    }

    /// Other fibre radii in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::with_radii`](strandlight_scene::strands::Strands::with_radii); nothing is
    /// changed then.
    pub fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.core.set_radii(radii)?;
        self.spread = Spread::of(&self.core.scene.strands);
        self.edited();
        Ok(())
    }

    /// Takes the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    /// What is uploaded are the rows of the texture of paint that are other than before; the first
    /// paint of all, and the first of widths or shifts, also takes tables and a pipeline.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`](strandlight_scene::PreparedScene::repaint); nothing is changed
    /// then.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        if self.core.set_paint(paint, changed)? {
            self.edited();
        }
        Ok(())
    }

    /// Bends the strands of the scene in the wind, on the device alone:
    /// [`ProgressiveRenderer::scene`] has them at rest, with room to move. Without wind they are at
    /// rest.
    pub fn set_wind(&mut self, wind: Option<Wind>) {
        if self.core.set_wind(wind) {
            self.edited();
        }
    }

    /// Other things in the light and in the view.
    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        if self.core.set_proxies(proxies) {
            self.edited();
        }
    }

    /// Samples a pixel that the picture gets at rest.
    pub fn set_samples(&mut self, samples: u32) {
        if samples != self.core.scene.samples {
            let of_samples = self.of_samples();
            let before = self.samples_of(self.picture.passes);
            self.core.scene.samples = samples;
            // Samples that the last pass left out are not added later, nor are any taken back.
            let is_other = before != self.samples_of(self.picture.passes);
            let counts = |of_samples: u32| PassSamples::of(self.picture.passes, of_samples).n;
            let is_under_way = self.picture.bands > 0;
            if is_other || is_under_way && counts(of_samples) != counts(self.of_samples()) {
                self.restart_samples();
            }
        }
    }

    /// Starts the report of an edit.
    pub(super) fn edited(&mut self) {
        self.report.stages.clear();
        self.report.edit = None;
        self.counts = self.core.context.counts();
    }
}
