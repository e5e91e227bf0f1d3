//! The renderer as a [`Backend`].

use std::ops::Range;

use super::ProgressiveRenderer;
use crate::passes::target::PassSamples;
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::camera::Camera;
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::proxy::Proxy;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::stats::Observer;
use strandlight_scene::{Backend, DisplayTransform, PreparedScene, RenderError, SceneError};
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
        let context = self.context().clone();
        self.move_to(&context, scene)
    }

    fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<(), RenderError> {
        self.hair.set_hair(hair, modes).map_err(SceneError::from)?;
        Ok(())
    }

    fn set_scattering(&mut self, scattering: Scattering) {
        self.hair.set_scattering(scattering);
    }

    fn set_densities(&mut self, densities: [f32; 2]) {
        self.hair.set_densities(densities);
    }

    fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        self.hair.set_lights(lights)
    }

    fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        self.hair.set_light_colors(rgb)
    }

    fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.hair.set_points(points)
    }

    fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.hair.set_radii(radii)?;
        Ok(())
    }

    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError> {
        self.hair.set_wind(wind);
        Ok(())
    }

    fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        self.hair.set_paint(paint, changed)
    }

    fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        self.hair.set_proxies(proxies);
    }

    fn set_camera(&mut self, camera: Camera) {
        if self.hair.set_camera(camera) {
            self.hair.begin_report();
            self.restart_picture();
        }
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        self.set_size(self.fitting(size))
    }

    fn set_samples(&mut self, samples: u32) {
        if self.is_by_list() {
            self.hair.scene.samples = samples;
        } else if samples != self.hair.scene.samples {
            let total_samples = self.total_samples();
            let before = self.samples_of(self.picture.passes);
            self.hair.scene.samples = samples;
            // Samples that the last pass left out are not added later, nor are any taken back.
            let is_other = before != self.samples_of(self.picture.passes);
            let counts = |total_samples: u32| PassSamples::of(self.picture.passes, total_samples).n;
            let is_under_way = self.picture.bands > 0;
            if is_other || is_under_way && counts(total_samples) != counts(self.total_samples()) {
                self.restart_samples();
            }
        }
    }

    fn set_grade(&mut self, exposure: f32, display: DisplayTransform, background: Background) {
        let scene = &mut self.hair.scene;
        let before = (scene.exposure, &scene.display, scene.background);
        if before != (exposure, &display, background) {
            (scene.exposure, scene.display, scene.background) = (exposure, display, background);
            self.hair.begin_report();
            self.picture.shown = 0;
        }
    }

    fn set_panorama(&mut self, panorama: Option<TurnedPanorama>) {
        if self.hair.scene.panorama != panorama {
            self.hair.scene.panorama = panorama;
            self.hair.begin_report();
            self.picture.shown = 0;
        }
    }

    fn shade_view_only(&mut self) {
        self.hair.set_margin(0.0);
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
