//! The renderer as a [`Backend`].

use std::ops::Range;

use super::ProgressiveRenderer;
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::camera::Camera;
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::proxy::Proxy;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::stats::Observer;
use strandlight_scene::tone::ToneMap;
use strandlight_scene::{Backend, PreparedScene, RenderError, SceneError};
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::{Picture, Stats};

impl Backend for ProgressiveRenderer {
    fn name(&self) -> String {
        self.context().name()
    }

    fn scene(&self) -> &PreparedScene {
        self.scene()
    }

    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        *self = ProgressiveRenderer::new(self.context(), scene)?;
        Ok(())
    }

    fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<(), RenderError> {
        self.set_hair(hair, modes).map_err(SceneError::from)?;
        Ok(())
    }

    fn set_scattering(&mut self, scattering: Scattering) {
        self.set_scattering(scattering);
    }

    fn set_densities(&mut self, densities: [f32; 2]) {
        self.set_densities(densities);
    }

    fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        self.set_lights(lights)
    }

    fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        self.set_light_colors(rgb)
    }

    fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.set_points(points)
    }

    fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.set_radii(radii)
    }

    fn set_wind(&mut self, wind: Option<Wind>) -> Result<bool, RenderError> {
        self.set_wind(wind);
        Ok(false)
    }

    fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        self.set_paint(paint, changed)
    }

    fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        self.set_proxies(proxies);
    }

    fn set_camera(&mut self, camera: Camera) {
        self.set_camera(camera);
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        self.set_size(self.fitting(size))
    }

    fn set_samples(&mut self, samples: u32) {
        self.set_samples(samples);
    }

    fn set_grade(&mut self, exposure: f32, tone_map: ToneMap, background: Background) {
        self.set_grade(exposure, tone_map, background);
    }

    fn shade_view_only(&mut self) {
        self.core.set_margin(0.0);
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn render(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        let picture = self.still_observed(size, samples, observer)?;
        Ok((picture, self.stats(samples)))
    }
}
