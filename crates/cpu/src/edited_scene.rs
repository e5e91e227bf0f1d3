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
    wind: Option<Bending>,
}

/// Wind, and what it bends.
#[derive(Clone)]
struct Bending {
    wind: Wind,
    /// The strands without wind.
    rest: Arc<Strands>,
    /// Are those of the scene bent by this wind, or still as they were before?
    is_bent: bool,
}

/// Strands that wind has bent.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Clone)]
pub(super) struct BentStrands {
    wind: Wind,
    rest: Arc<Strands>,
    strands: Arc<Strands>,
}

impl EditedScene {
    pub fn new(mut scene: PreparedScene) -> EditedScene {
        scene.hair.keep_plain();
        EditedScene {
            planned: scene.lights.iter().map(|light| light.rgb).collect(),
            scene,
            wind: None,
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
        self.wind = None;
        Ok(Edit::Points)
    }

    pub fn set_radii(&mut self, radii: &[f32]) -> Result<Edit, RenderError> {
        let strands = self.scene.strands.with_radii(radii)?;
        if let Some(bending) = &mut self.wind {
            bending.rest = bending.rest.with_radii(radii)?.into();
        }
        self.scene.strands = strands.into();
        Ok(Edit::Points)
    }

    /// [`EditedScene::ask_for_wind`], and bends the strands at once.
    pub fn set_wind(&mut self, wind: Option<Wind>) -> Result<Option<Edit>, RenderError> {
        let before = self.wind.clone();
        let edit = self.ask_for_wind(wind);
        if let Err(error) = self.bend() {
            self.wind = before;
            return Err(error);
        }
        Ok(edit)
    }

    /// Wind in which [`EditedScene::bend`] bends the strands. Without wind they are at rest.
    pub fn ask_for_wind(&mut self, wind: Option<Wind>) -> Option<Edit> {
        match (wind, &mut self.wind) {
            (Some(wind), Some(bending)) if bending.wind == wind => return None,
            (Some(wind), Some(bending)) => (bending.wind, bending.is_bent) = (wind, false),
            (Some(wind), None) => {
                self.wind = Some(Bending {
                    wind,
                    rest: Arc::clone(&self.scene.strands),
                    is_bent: false,
                });
            }
            (None, _) => self.scene.strands = self.wind.take()?.rest,
        }
        Some(Edit::Points)
    }

    /// Bends the strands if they are not as the wind has them, some 40 ms for 480,000 points on two cores.
    ///
    /// # Errors
    /// As [`Strands::moved`]; nothing is changed then.
    pub fn bend(&mut self) -> Result<(), RenderError> {
        if let Some(bending) = self.wind.as_mut().filter(|bending| !bending.is_bent) {
            self.scene.strands = bent_strands(&bending.wind, &bending.rest)?.into();
            bending.is_bent = true;
        }
        Ok(())
    }

    /// What [`EditedScene::bend`] has made.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn bent(&self) -> Option<BentStrands> {
        let bending = self.wind.as_ref().filter(|bending| bending.is_bent)?;
        Some(BentStrands {
            wind: bending.wind,
            rest: Arc::clone(&bending.rest),
            strands: Arc::clone(&self.scene.strands),
        })
    }

    /// Takes strands that [`EditedScene::bend`] made elsewhere, if they are bent from those of this scene: by its wind, or by one before it.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn take_bent(&mut self, bent: &BentStrands) {
        if let Some(bending) = &mut self.wind
            && !bending.is_bent
            && Arc::ptr_eq(&bending.rest, &bent.rest)
        {
            self.scene.strands = Arc::clone(&bent.strands);
            bending.is_bent = bending.wind == bent.wind;
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
/// method `take` of what changed. All but `set_wind`, which not every renderer waits for.
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
