//! Edits of the scene. Each setter marks what is out of date and returns at once.

use std::ops::Range;

use super::HairRenderer;
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

impl HairRenderer {
    /// Sets the hair's parameters and the modes that are drawn; recomputes only the tables that
    /// depend on what changed.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    pub fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let before = self.scene.hair.optics().fibre.modes;
        let report = self.scene.hair.edit(hair, modes)?;
        if report.rebuilt().next().is_some() {
            self.dirty.add_hair(&report);
            // Modes and model: what the pipelines are compiled for.
            let are_other = before != self.scene.hair.optics().fibre.modes;
            self.dirty.mark(Inputs::TERMS, are_other);
            self.begin_report();
        }
        self.report.edit = Some(report.clone());
        Ok(report)
    }

    /// Chooses the terms of scattering that are drawn.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        if scattering == self.scene.scattering() {
            return;
        }
        if let Some(report) = self.scene.set_scattering(scattering) {
            self.dirty.add_hair(&report);
        }
        self.edited(Inputs::TERMS);
    }

    /// Sets d_f and d_b.
    pub fn set_densities(&mut self, densities: [f32; 2]) {
        if densities != self.scene.densities {
            self.scene.densities = densities;
            self.edited(Inputs::DENSITIES);
        }
    }

    /// Replaces the lights: directions, bandwidths and amplitudes. Their amplitudes share out the
    /// shadow maps; where some are black for the time being,
    /// [`set_light_colors`](HairRenderer::set_light_colors) says so afterwards.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
        check_lights(&lights)?;
        if lights != self.scene.lights {
            self.lighting.plan_for(&lights);
            self.scene.lights = lights;
            self.edited(Inputs::LIGHTS);
        }
        Ok(())
    }

    /// Sets the amplitudes of the lights, in their order; a black light is not shaded, and keeps
    /// its shadows.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        let before = self.scene.lights.clone();
        self.scene.set_light_colors(rgb)?;
        if before != self.scene.lights {
            self.edited(Inputs::LIGHT_COLORS);
        }
        Ok(())
    }

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    /// The wind ends.
    ///
    /// # Errors
    /// As [`Strands::moved`](strandlight_scene::strands::Strands::moved); nothing is changed then.
    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.moved(points)?.into();
        (self.wind, self.deform) = (None, None);
        self.edited(Inputs::POINTS);
        Ok(())
    }

    /// Sets the fibre radii in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::with_radii`](strandlight_scene::strands::Strands::with_radii); nothing is
    /// changed then.
    pub fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
        self.scene.strands = self.scene.strands.with_radii(radii)?.into();
        self.deform = None;
        self.edited(Inputs::POINTS);
        Ok(())
    }

    /// Bends the strands of the scene in the wind, on the device alone: [`HairRenderer::scene`] has
    /// them at rest, with room to move. Without wind they are at rest.
    pub fn set_wind(&mut self, wind: Option<Wind>) {
        if wind != self.wind {
            self.wind = wind;
            self.edited(Inputs::POINTS);
        }
    }

    /// Sets the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    /// What is uploaded are the rows of the texture of paint that are other than before; the first
    /// paint of all, and the first of widths or shifts, also takes tables and a pipeline.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`](strandlight_scene::PreparedScene::repaint); nothing is changed
    /// then.
    pub fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
        let (range, report) = self.scene.repaint(paint, changed)?;
        if range.is_empty() && report.is_none() {
            return Ok(());
        }
        self.dirty.add_paint(range);
        if let Some(report) = report {
            self.dirty.add_hair(&report);
            self.dirty.inputs |= Inputs::TERMS;
        }
        self.begin_report();
        Ok(())
    }

    /// Replaces the things beside the hair that stand in the light.
    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) {
        if proxies != self.scene.proxies {
            self.scene.proxies = proxies;
            self.edited(Inputs::PROXIES);
        }
    }

    /// Answers whether it is another.
    pub(crate) fn set_camera(&mut self, camera: Camera) -> bool {
        let is_other = self.scene.camera != camera;
        self.scene.camera = camera;
        self.dirty.mark(Inputs::VIEW, is_other);
        is_other
    }

    /// Width and height of the picture, neither of them zero.
    pub(crate) fn set_size(&mut self, size: [u32; 2]) {
        self.dirty.mark(Inputs::VIEW, self.scene.size != size);
        self.scene.size = size;
    }

    /// Points within this share of the longer side around the picture are lit too.
    pub(crate) fn set_margin(&mut self, margin: f32) {
        self.dirty.mark(Inputs::VIEW, self.margin != margin);
        self.margin = margin;
    }

    /// Marks `inputs` as others and starts the report of an edit.
    fn edited(&mut self, inputs: Inputs) {
        self.dirty.inputs |= inputs;
        self.begin_report();
    }

    /// Starts the report of an edit.
    pub(crate) fn begin_report(&mut self) {
        self.report.stages.clear();
        self.report.edit = None;
        self.counts_before = self.context.counts();
    }
}
