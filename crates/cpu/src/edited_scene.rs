//! The scene as it was last set: the setters of [`Backend`](strandlight_scene::Backend), for all renderers of this crate. Each answers
//! what changed.

use std::ops::Range;
use std::sync::Arc;

use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::motion::Wind;
use strandlight_scene::motion::wind::bent_strands;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::scene::check_lights;
use strandlight_scene::strands::Strands;
use strandlight_scene::{Camera, DisplayTransform, PreparedScene, RenderError, SceneError};

use super::frame::Edit;

/// A scene that is edited.
#[derive(Clone)]
pub(super) struct EditedScene {
    pub scene: PreparedScene,
    /// Amplitudes of the lights when they were last set, without colours of later edits: see `Frame::planned`.
    pub planned: Vec<[f32; 3]>,
    /// The strands without wind, while there is some.
    rest: Option<Arc<Strands>>,
}

impl EditedScene {
    pub fn new(mut scene: PreparedScene) -> EditedScene {
        scene.hair.keep_plain();
        EditedScene {
            planned: scene.lights.iter().map(|light| light.rgb).collect(),
            scene,
            rest: None,
        }
    }

    pub fn set_hair(
        &mut self,
        hair: &HairParams,
        modes: &[Lobe],
    ) -> Result<Option<Edit>, RenderError> {
        if self.scene.hair.hair() == hair && self.scene.hair.modes() == modes {
            return Ok(None);
        }
        let edited = self.scene.hair.edit(hair, modes);
        edited.map_err(SceneError::from)?;
        Ok(Some(Edit::Hair))
    }

    pub fn set_scattering(&mut self, scattering: Scattering) -> Option<Edit> {
        if self.scene.scattering() == scattering {
            return None;
        }
        self.scene.set_scattering(scattering);
        Some(Edit::Terms)
    }

    pub fn set_densities(&mut self, densities: [f32; 2]) -> Edit {
        self.scene.densities = densities;
        Edit::Densities
    }

    pub fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<Edit, RenderError> {
        check_lights(&lights)?;
        self.planned = lights.iter().map(|light| light.rgb).collect();
        self.scene.lights = lights;
        Ok(Edit::Lights)
    }

    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<Edit, RenderError> {
        self.scene.set_light_colors(rgb)?;
        Ok(Edit::Colors)
    }

    pub fn set_points(&mut self, points: &[[f32; 4]]) -> Result<Edit, RenderError> {
        self.scene.strands = self.scene.strands.moved(points)?.into();
        self.rest = None;
        Ok(Edit::Points)
    }

    pub fn set_radii(&mut self, radii: &[f32]) -> Result<Edit, RenderError> {
        let rest = match &self.rest {
            Some(rest) => Some(Arc::new(rest.with_radii(radii)?)),
            None => None,
        };
        self.scene.strands = self.scene.strands.with_radii(radii)?.into();
        self.rest = rest;
        Ok(Edit::Points)
    }

    /// Nothing changes where there was no wind and is none.
    pub fn set_wind(&mut self, wind: Option<Wind>) -> Result<Option<Edit>, RenderError> {
        match wind {
            Some(wind) => {
                let rest = self.rest.as_ref().unwrap_or(&self.scene.strands);
                let bent = bent_strands(&wind, rest)?;
                let before = std::mem::replace(&mut self.scene.strands, bent.into());
                self.rest.get_or_insert(before);
                Ok(Some(Edit::Points))
            }
            None => Ok(self.rest.take().map(|rest| {
                self.scene.strands = rest;
                Edit::Points
            })),
        }
    }

    pub fn set_paint(
        &mut self,
        paint: &Paint,
        changed: Range<usize>,
    ) -> Result<Vec<Edit>, RenderError> {
        let (_, report) = self.scene.repaint(paint, changed)?;
        Ok(match report {
            // Other tables of painted hair.
            Some(_) => vec![Edit::Paint, Edit::PaintKinds],
            None => vec![Edit::Paint],
        })
    }

    pub fn set_proxies(&mut self, proxies: Vec<Proxy>) -> Edit {
        self.scene.proxies = proxies;
        Edit::Proxies
    }

    pub fn set_camera(&mut self, camera: Camera) -> Option<Edit> {
        if self.scene.camera == camera {
            return None;
        }
        self.scene.camera = camera;
        Some(Edit::View)
    }

    pub fn set_grade(
        &mut self,
        exposure: f32,
        display: DisplayTransform,
        background: Background,
    ) -> Edit {
        let scene = &mut self.scene;
        (scene.exposure, scene.display, scene.background) = (exposure, display, background);
        Edit::Background
    }

    pub fn set_panorama(&mut self, panorama: Option<TurnedPanorama>) -> Option<Edit> {
        if self.scene.panorama == panorama {
            return None;
        }
        self.scene.panorama = panorama;
        Some(Edit::Background)
    }
}

/// The setters of [`Backend`](strandlight_scene::Backend) that edit the scene, of a renderer that has its [`EditedScene`] at this path of fields and a
/// method `take` of what changed.
macro_rules! edit_setters {
    ($($edited:ident).+) => {
        fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<(), RenderError> {
            let edit = self.$($edited).+.set_hair(hair, modes)?;
            self.take(edit);
            Ok(())
        }

        fn set_scattering(&mut self, scattering: Scattering) {
            let edit = self.$($edited).+.set_scattering(scattering);
            self.take(edit);
        }

        fn set_densities(&mut self, densities: [f32; 2]) {
            let edit = self.$($edited).+.set_densities(densities);
            self.take([edit]);
        }

        fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError> {
            let edit = self.$($edited).+.set_lights(lights)?;
            self.take([edit]);
            Ok(())
        }

        fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
            let edit = self.$($edited).+.set_light_colors(rgb)?;
            self.take([edit]);
            Ok(())
        }

        fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError> {
            let edit = self.$($edited).+.set_points(points)?;
            self.take([edit]);
            Ok(())
        }

        fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError> {
            let edit = self.$($edited).+.set_radii(radii)?;
            self.take([edit]);
            Ok(())
        }

        fn set_wind(&mut self, wind: Option<Wind>) -> Result<bool, RenderError> {
            let edit = self.$($edited).+.set_wind(wind)?;
            self.take(edit);
            Ok(edit.is_some())
        }

        fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError> {
            let edits = self.$($edited).+.set_paint(paint, changed)?;
            self.take(edits);
            Ok(())
        }

        fn set_proxies(&mut self, proxies: Vec<Proxy>) {
            let edit = self.$($edited).+.set_proxies(proxies);
            self.take([edit]);
        }

        fn set_camera(&mut self, camera: Camera) {
            let edit = self.$($edited).+.set_camera(camera);
            self.take(edit);
        }

        fn set_grade(&mut self, exposure: f32, display: DisplayTransform, background: Background) {
            let edit = self.$($edited).+.set_grade(exposure, display, background);
            self.take([edit]);
        }

        fn set_panorama(&mut self, panorama: Option<TurnedPanorama>) {
            let edit = self.$($edited).+.set_panorama(panorama);
            self.take(edit);
        }
    };
}

pub(super) use edit_setters;
