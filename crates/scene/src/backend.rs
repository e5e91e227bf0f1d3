//! What renders a prepared scene: the GPU, or the CPU where there is none.

use std::ops::Range;

use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};

use crate::camera::Camera;
use crate::display::DisplayTransform;
use crate::error::RenderError;
use crate::motion::Wind;
use crate::paint::Paint;
use crate::panorama::TurnedPanorama;
#[cfg(not(target_arch = "wasm32"))]
use crate::picture::Picture;
use crate::proxy::Proxy;
use crate::scene::PreparedScene;
#[cfg(not(target_arch = "wasm32"))]
use crate::stats::{Observer, Stats};

/// A renderer with a scene on it. Setters edit the scene, [`Backend::render`] draws it as last set.
///
/// Implemented by `ProgressiveRenderer` of `strandlight-render` and `CpuRenderer` of `strandlight-cpu`. Both
/// recompute only what an edit makes stale. Their pictures agree up to the noise of samples.
pub trait Backend {
    /// Name of the device, as pictures and reports have it: `cpu`, or `gpu: adapter (API)`.
    fn name(&self) -> String;

    /// The scene as last set.
    fn scene(&self) -> &PreparedScene;

    /// Replaces the scene.
    ///
    /// # Errors
    /// A scene that does not fit the device; nothing is changed then.
    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError>;

    /// Sets the hair's parameters and the modes that are drawn.
    ///
    /// # Errors
    /// The first parameter outside its range, or a mode whose lobes were not loaded; nothing is
    /// changed then.
    fn set_hair(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<(), RenderError>;

    /// Chooses the terms of scattering that are drawn.
    fn set_scattering(&mut self, scattering: Scattering);

    /// Sets d_f and d_b.
    fn set_densities(&mut self, densities: [f32; 2]);

    /// Replaces the lights: directions, bandwidths and amplitudes.
    ///
    /// # Errors
    /// The first light with a value outside its range; nothing is changed then.
    fn set_lights(&mut self, lights: Vec<SrbfLight>) -> Result<(), RenderError>;

    /// Sets the amplitudes of the lights, in their order; a black light is off.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError>;

    /// Moves the hair: x, y, z and fibre radius in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::moved`](crate::strands::Strands::moved); nothing is changed then.
    fn set_points(&mut self, points: &[[f32; 4]]) -> Result<(), RenderError>;

    /// Sets the fibre radii in cm, one for each point of the scene's strands.
    ///
    /// # Errors
    /// As [`Strands::with_radii`](crate::strands::Strands::with_radii); nothing is changed then.
    fn set_radii(&mut self, radii: &[f32]) -> Result<(), RenderError>;

    /// Bends the strands in the wind, or lets them hang without. Those of [`Backend::scene`] stay at rest where a
    /// device alone bends them, and follow later where a thread does.
    ///
    /// # Errors
    /// As [`Strands::moved`](crate::strands::Strands::moved); the strands stay as they are then. Where a thread bends them it is told later.
    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError>;

    /// Sets the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    ///
    /// # Errors
    /// As [`PreparedScene::repaint`]; nothing is changed then.
    fn set_paint(&mut self, paint: &Paint, changed: Range<usize>) -> Result<(), RenderError>;

    /// Replaces the things beside the hair that stand in the light and in the view.
    fn set_proxies(&mut self, proxies: Vec<Proxy>);

    /// Sets the camera.
    fn set_camera(&mut self, camera: Camera);

    /// Width and height of most pictures to come: what those are drawn into is kept between them.
    /// [`Backend::render`] draws any size.
    ///
    /// # Errors
    /// What is too large for the device; nothing is changed then.
    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError>;

    /// Samples a pixel that the scene asks for.
    fn set_samples(&mut self, samples: u32);

    /// Sets how radiance becomes a picture on a screen, and what is seen between the strands.
    fn set_grade(&mut self, exposure: f32, display: DisplayTransform, background: Background);

    /// Sets the map that [`Background::Panorama`] shows.
    fn set_panorama(&mut self, panorama: Option<TurnedPanorama>);

    /// Shades only the strands in the view, for a single picture. Otherwise a device may shade some
    /// around it, so that the camera can turn.
    fn shade_view_only(&mut self);

    /// Draws the whole scene in `size`, width and height, with `samples` a pixel, or without any where
    /// a visibility list takes their place ([`Stats::samples`]): linear radiance, and what that took. `observer` receives the progress.
    ///
    /// # Errors
    /// A size or number of samples out of range; whatever the device refuses.
    // A page cannot wait for a picture.
    #[cfg(not(target_arch = "wasm32"))]
    fn render(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError>;
}
