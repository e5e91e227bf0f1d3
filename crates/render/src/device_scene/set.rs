//! Edits of the scene. Each setter marks what is out of date and answers whether anything changed.

use std::ops::Range;

use super::DeviceScene;
use crate::invalidation::Inputs;
use strandlight_formats::{Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::RenderError;
use strandlight_scene::camera::Camera;
use strandlight_scene::material::{EditError, EditReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::scene::check_lights;

impl DeviceScene {
    pub fn set_camera(&mut self, camera: Camera) -> bool {
        let is_other = self.scene.camera != camera;
        self.scene.camera = camera;
        self.dirty.mark(Inputs::VIEW, is_other);
        is_other
    }

    /// Width and height of the picture, neither of them zero.
    pub fn set_size(&mut self, size: [u32; 2]) {
        self.dirty.mark(Inputs::VIEW, self.scene.size != size);
        self.scene.size = size;
    }

    /// Points within this share of the longer side around the picture are lit too.
    pub fn set_margin(&mut self, margin: f32) {
        self.dirty.mark(Inputs::VIEW, self.margin != margin);
        self.margin = margin;
    }

    /// # Errors
    /// As [`HairMaterial::edit`](strandlight_scene::material::HairMaterial::edit).
    pub fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let before = self.scene.hair.modes().to_vec();
        let report = self.scene.hair.edit(hair, modes)?;
        if report.rebuilt().next().is_some() {
            self.dirty.add_hair(&report);
            self.dirty
                .mark(Inputs::TERMS, before != self.scene.hair.modes());
        }
        Ok(report)
    }

    pub fn set_scattering(&mut self, scattering: Scattering) -> bool {
        if scattering == self.scene.scattering() {
            return false;
        }
        if let Some(report) = self.scene.set_scattering(scattering) {
            self.dirty.add_hair(&report);
        }
        self.dirty.inputs |= Inputs::TERMS;
        true
    }

    pub fn set_densities(&mut self, densities: [f32; 2]) -> bool {
        let is_other = densities != self.scene.densities;
        self.scene.densities = densities;
        self.dirty.mark(Inputs::DENSITIES, is_other);
        is_other
    }

    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<bool, RenderError> {
        check_lights(&lights)?;
        if lights == self.scene.lights {
            return Ok(false);
        }
        self.lighting.plan_for(&lights);
        self.scene.lights = lights;
        self.dirty.inputs |= Inputs::LIGHTS;
        Ok(true)
    }

    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<bool, RenderError> {
        let before = self.scene.lights.clone();
        self.scene.set_light_colors(rgb)?;
        let is_other = before != self.scene.lights;
        self.dirty.mark(Inputs::LIGHT_COLORS, is_other);
        Ok(is_other)
    }

    /// # Errors
    /// As [`Strands::moved`](strandlight_scene::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.moved(points)?;
        (self.wind, self.deform) = (None, None);
        self.dirty.inputs |= Inputs::POINTS;
        Ok(())
    }

    /// # Errors
    /// As [`Strands::with_radii`](strandlight_scene::strands::Strands::with_radii); nothing is
    /// changed then.
    pub fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.with_radii(radii)?;
        self.deform = None;
        self.dirty.inputs |= Inputs::POINTS;
        Ok(())
    }

    /// # Errors
    /// As [`PreparedScene::repaint`](strandlight_scene::PreparedScene::repaint); nothing is changed
    /// then.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<bool, RenderError> {
        let (range, report) = self.scene.repaint(paint, changed)?;
        if range.is_empty() && report.is_none() {
            return Ok(false);
        }
        self.dirty.add_paint(range);
        if let Some(report) = report {
            self.dirty.add_hair(&report);
            self.dirty.inputs |= Inputs::TERMS;
        }
        Ok(true)
    }

    pub fn set_wind(&mut self, wind: Option<Wind>) -> bool {
        let is_other = wind != self.wind;
        self.wind = wind;
        self.dirty.mark(Inputs::POINTS, is_other);
        is_other
    }

    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) -> bool {
        let is_other = proxies != self.scene.proxies;
        self.scene.proxies = proxies;
        self.dirty.mark(Inputs::PROXIES, is_other);
        is_other
    }
}
