//! A scene made ready for rendering: the files it names read, checked and put into world space.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use strandlight_formats::{Background, MAX_PROXIES, RenderSection, Scattering, Scene, SrbfLight};
use strandlight_scattering::Lobe;
use strandlight_scattering::closed_form::{
    DENSITY_BACK, DENSITY_FORWARD, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE,
};

use crate::assets::{Assets, ModesToRead, camera, densities};
use crate::beside::Beside;
use crate::budget::LIGHT_BATCH;
use crate::camera::{Camera, ViewUniform, WIDE_PX};
use crate::display::DisplayTransform;
use crate::error::{RenderError, SceneError};
use crate::files::Files;
use crate::material::{EditReport, HairMaterial};
use crate::motion::Motion;
use crate::paint::{Paint, PaintKinds, PaintedPoint};
use crate::panorama::TurnedPanorama;
use crate::proxy::{Proxy, ProxyRecords};
use crate::shadow_maps::ShadowPlan;
use crate::stats::Stats;
use crate::strands::Strands;
use crate::tables::ShadingTables;
use crate::variation::varied_paint;
use crate::volume::{Grid, largest, power, sweep_directions};
use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scattering::multiple_tables::MultipleSource;
use strandlight_scattering::spherical_gaussian::solid_angle;

/// Everything a frame needs. Both backends draw from this, so they see the same numbers.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// The hair, world space, cm.
    pub strands: Arc<Strands>,
    /// All lights of the set in its order, turned and scaled as the scene says, then those that it adds; those that
    /// are off are black. So an index is the light's number, as in files, layers and the viewer.
    pub lights: Vec<SrbfLight>,
    /// The hair's parameters, the modes to draw, and the textures made of them.
    pub hair: HairMaterial,
    /// d_f and d_b: shares of the hair in front of and behind a fibre that scatter, 0..=1.
    pub densities: [f32; 2],
    /// Products of a point and a light are left out below this share of all lights' power;
    /// `NEGLIGIBLE_SHARE`.
    pub negligible_share: f32,
    /// Shadow maps to draw, about, shared out to the lights by power: see [`crate::shadow_maps`].
    pub shadow_maps: u32,
    /// Most bytes of the lights' records that a device keeps between frames; `RECORD_BUDGET`.
    /// Where they are more, every frame sweeps again, batch by batch.
    pub record_budget: u64,
    /// Amplitudes, one for each light, that shadow maps are shared out by and that negligible power
    /// is a share of; those of `lights` where there are none. Pictures of some lights or terms of
    /// a scene add up to that of all if these stay the same.
    pub reference_amplitudes: Option<Vec<[f32; 3]>>,
    /// Must pictures of single modes add up to that of all? Those of their tables of multiple scattering do to 0.1 %, so the closed
    /// form, which is slower, takes their place.
    pub modes_add_up: bool,
    scattering: Scattering,
    paint: Option<Arc<Vec<PaintedPoint>>>,
    /// Tables of the closed forms: C where R is drawn.
    pub tables: ShadingTables,
    /// The view.
    pub camera: Camera,
    /// What is seen between the strands.
    pub background: Background,
    /// The map behind the hair, where [`Background::Panorama`] shows it.
    pub panorama: Option<TurnedPanorama>,
    /// Stops: radiance is multiplied by `2^exposure` before the display transform.
    pub exposure: f32,
    /// Curve or LUT to the 8-bit picture.
    pub display: DisplayTransform,
    /// What else stands in the light and in the view; at most [`MAX_PROXIES`] count.
    pub proxies: Vec<Proxy>,
    /// Picture size that the scene asks for.
    pub size: [u32; 2],
    /// Samples a pixel that the scene asks for.
    pub samples: u32,
}

/// A light as the passes read it; mirrored by `Light` in `shaders/lib/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[doc(hidden)]
pub struct LightRecord {
    /// Unit vector towards the light.
    pub direction: [f32; 3],
    /// Xu's bandwidth.
    pub lambda: f32,
    /// Amplitude.
    pub rgb: [f32; 3],
    /// Largest channel times solid angle.
    pub power: f32,
    /// First entry of its directions in the list of sweeps.
    pub first_sweep: u32,
    /// Number of its directions.
    pub n_sweeps: u32,
    /// Solid angle, sr.
    pub solid_angle: f32,
    /// Its row in the answers of the shadow maps, or [`NO_SLOT`](crate::shadow_maps::NO_SLOT).
    pub shadow_index: u32,
    /// Its place among the records of its batch.
    pub record: u32,
    /// Of narrow lights, whose shadows are found along segments: the first of its maps, and how many; none of others.
    pub first_map: u32,
    /// See [`LightRecord::first_map`].
    pub n_maps: u32,
    /// Not used.
    pub pad: u32,
}

impl LightRecord {
    /// Are its shadows found along segments?
    pub fn is_narrow(&self) -> bool {
        self.n_maps > 0
    }
}

strandlight_scattering::mirrors! {
    LightRecord as "Light" in "lib/light" {
        direction, lambda, rgb, power, first_sweep, n_sweeps, solid_angle, shadow_index, record,
        first_map, n_maps, pad,
    }
}

/// A term of scattering is left out for a point and a light where the power that the term starts
/// from is below this share of all lights' power: with 40 lights each term lacks at most 4e-4 of
/// what a lit fibre has. Pictures of brown and black wigs, all terms drawn, differ by a relative
/// RMSE of 1.4e-5 and 3e-6.
///
/// That power is T times the light's for single scattering, d_f (f_global (T_f - T_vol) + T_b) times it for
/// global, and T or d_f (T_f - T_vol + T_b) times it, times d_b and the largest A_b, for local.
pub(crate) const NEGLIGIBLE_SHARE: f32 = 1e-5;

/// Records of 256 lights at the largest grid.
pub(crate) const RECORD_BUDGET: u64 = 512 << 20;

impl PreparedScene {
    /// Reads what `scene` names and prepares it.
    ///
    /// # Errors
    /// The first file that cannot be read or value that cannot be used, by name.
    pub fn load(scene: &Scene) -> Result<Self, SceneError> {
        PreparedScene::load_at(scene, 0.0)
    }

    /// [`PreparedScene::load`], the hair being where it is at a time in seconds.
    ///
    /// # Errors
    /// As there; a frame of the motion that cannot be read.
    pub fn load_at(scene: &Scene, seconds: f64) -> Result<Self, SceneError> {
        scene.validate()?;
        let assets = Assets::read(scene, &Files::Disk, ModesToRead::OfScene)?;
        let mut prepared = PreparedScene::new(scene, &assets)?;
        prepared.move_hair(scene, &Files::Disk, seconds)?;
        Ok(prepared)
    }

    /// Moves the hair of `scene`, which [`PreparedScene::new`] has at rest, to where it is at a
    /// time in seconds.
    ///
    /// # Errors
    /// A frame of the motion that cannot be read.
    pub fn move_hair(
        &mut self,
        scene: &Scene,
        files: &Files,
        seconds: f64,
    ) -> Result<(), SceneError> {
        if let Some(mut motion) = Motion::new(scene, files) {
            self.strands = Arc::new(motion.strands_at(&self.strands, seconds)?);
        }
        Ok(())
    }

    /// Prepares `scene` from the files it names, its hair at rest.
    ///
    /// # Errors
    /// What cannot be drawn, by name.
    pub fn new(scene: &Scene, assets: &Assets) -> Result<Self, SceneError> {
        let paint = Paint::from_groom(&assets.groom);
        let paint = paint.map_err(|error| SceneError::from(error).at_key("groom.file"))?;
        PreparedScene::with_paint(scene, assets, paint.as_ref())
    }

    /// [`PreparedScene::new`] with `paint` in place of the groom's own, over the variation of the
    /// strands.
    ///
    /// # Errors
    /// As there; not one entry for each point of the groom.
    pub fn with_paint(
        scene: &Scene,
        assets: &Assets,
        paint: Option<&Paint>,
    ) -> Result<Self, SceneError> {
        let strands = assets.strands_in_room(scene)?;
        let mut lights = assets.turned_lights(&scene.lights);
        for (light, rgb) in lights.iter_mut().zip(assets.light_colors(&scene.lights)) {
            light.rgb = rgb;
        }
        let camera = camera(scene.camera.as_ref(), strands.centre, strands.radius);
        let mut prepared = PreparedScene {
            strands: Arc::new(strands),
            lights,
            hair: assets.textures(&scene.hair)?,
            densities: densities(&scene.hair),
            negligible_share: NEGLIGIBLE_SHARE,
            shadow_maps: scene.render.shadow_maps,
            record_budget: RECORD_BUDGET,
            reference_amplitudes: None,
            modes_add_up: false,
            scattering: scene.render.scattering,
            paint: None,
            tables: assets.tables.shading.clone(),
            camera,
            background: scene.render.background,
            panorama: assets.turned_panorama(&scene.lights),
            exposure: scene.render.exposure as f32,
            display: assets.display(&scene.render),
            proxies: assets.proxies(scene),
            size: scene.render.size,
            samples: scene.render.samples,
        };
        prepared.set_scattering(scene.render.scattering);
        if let Some(paint) = varied_paint(scene, &assets.groom, paint)? {
            prepared.set_paint(Some(&paint))?;
        }
        Ok(prepared)
    }

    /// A scene put together by hand, with the defaults of a scene file for the rest.
    ///
    /// # Errors
    /// The first light with a value outside its range.
    pub fn from_parts(
        strands: Strands,
        lights: Vec<SrbfLight>,
        hair: HairMaterial,
        tables: ShadingTables,
        camera: Camera,
        background: Background,
    ) -> Result<Self, SceneError> {
        check_lights(&lights)?;
        let mut scene = PreparedScene {
            strands: Arc::new(strands),
            lights,
            hair,
            densities: [DENSITY_FORWARD, DENSITY_BACK],
            negligible_share: NEGLIGIBLE_SHARE,
            shadow_maps: RenderSection::default().shadow_maps,
            record_budget: RECORD_BUDGET,
            reference_amplitudes: None,
            modes_add_up: false,
            scattering: Scattering::Total,
            paint: None,
            tables,
            camera,
            background,
            panorama: None,
            exposure: 0.0,
            display: DisplayTransform::default(),
            proxies: Vec::new(),
            size: [720, 480],
            samples: 64,
        };
        scene.set_scattering(Scattering::Total);
        Ok(scene)
    }

    /// The terms that are drawn.
    pub fn scattering(&self) -> Scattering {
        self.scattering
    }

    /// Chooses the terms that are drawn. The averages of multiple scattering come or go: then
    /// what that recomputed.
    pub fn set_scattering(&mut self, scattering: Scattering) -> Option<EditReport> {
        self.scattering = scattering;
        let is_multiple = scattering != Scattering::Single;
        (self.hair.is_multiple() != is_multiple).then(|| self.hair.enable_multiple(is_multiple))
    }

    /// The terms that are drawn as bits: [`TERM_SINGLE`], [`TERM_LOCAL`], [`TERM_GLOBAL`].
    #[doc(hidden)]
    pub fn terms(&self) -> u32 {
        match self.scattering {
            Scattering::Single => TERM_SINGLE,
            Scattering::Global => TERM_GLOBAL,
            Scattering::Local => TERM_LOCAL,
            Scattering::Total => TERM_SINGLE | TERM_LOCAL | TERM_GLOBAL,
        }
    }

    /// Do tables of one fibre serve all points? Not where each has a fibre of its own, nor where [modes add
    /// up](PreparedScene::modes_add_up).
    #[doc(hidden)]
    pub fn has_one_fibre(&self) -> bool {
        self.paint.is_none() && !self.modes_add_up
    }

    /// What the tables are filled from that stand for multiple scattering, if they serve all points
    /// and terms that are drawn.
    #[doc(hidden)]
    pub fn multiple(&self) -> Option<&MultipleSource> {
        let wanted = self.terms() & (TERM_GLOBAL | TERM_LOCAL);
        let source = self.hair.optics().multiple.as_ref();
        source.filter(|source| self.has_one_fibre() && wanted & !source.terms() == 0 && wanted != 0)
    }

    /// Sets the amplitudes of the lights, in their order.
    ///
    /// # Errors
    /// Not one for each light, or one outside its range; nothing is changed then.
    pub fn set_light_colors(&mut self, rgb: &[[f32; 3]]) -> Result<(), RenderError> {
        if rgb.len() != self.lights.len() {
            return Err(RenderError::Colors {
                colors: rgb.len(),
                lights: self.lights.len(),
            });
        }
        let mut lights = self.lights.clone();
        for (light, &rgb) in lights.iter_mut().zip(rgb) {
            light.rgb = rgb;
        }
        check_lights(&lights)?;
        self.lights = lights;
        Ok(())
    }

    /// The paint of [`Strands::points`]; [`None`] where the hair is not painted.
    pub fn paint(&self) -> Option<&[PaintedPoint]> {
        self.paint.as_ref().map(|paint| &paint[..])
    }

    /// The same, shared.
    #[doc(hidden)]
    pub fn shared_paint(&self) -> Option<&Arc<Vec<PaintedPoint>>> {
        self.paint.as_ref()
    }

    /// Takes the paint of the groom's points, or takes all paint off: the hair's tables of painted
    /// fibres come or go.
    ///
    /// # Errors
    /// Not one entry for each point of the groom; elliptic fibres, of which there are no painted
    /// ones. Nothing is changed then.
    pub fn set_paint(&mut self, paint: Option<&Paint>) -> Result<EditReport, SceneError> {
        let points = paint.map(|paint| paint.spread(&self.strands)).transpose()?;
        let kinds = points.as_deref().map(PaintKinds::of);
        let report = self.hair.enable_paint(kinds)?;
        self.paint = points.map(Arc::new);
        Ok(report)
    }

    /// Takes the paint of the groom's points in `changed`; of the others `paint` must be as it was.
    /// Answers which of [`Strands::points`] that touches, and what it recomputed if it is paint of
    /// a kind that was not there before.
    ///
    /// # Errors
    /// As [`PreparedScene::set_paint`].
    pub fn repaint(
        &mut self,
        paint: &Paint,
        changed: Range<usize>,
    ) -> Result<(Range<usize>, Option<EditReport>), SceneError> {
        let Some(points) = &mut self.paint else {
            let report = self.set_paint(Some(paint))?;
            return Ok((0..self.strands.points.len(), Some(report)));
        };
        let points = Arc::make_mut(points);
        let range = paint.spread_range(&self.strands, changed, points)?;
        let before = self.hair.paint().unwrap_or_default();
        let kinds = before.or(PaintKinds::of(&points[range.clone()]));
        if kinds == before {
            return Ok((range, None));
        }
        let report = self.hair.enable_paint(Some(kinds))?;
        Ok((range, Some(report)))
    }

    /// What local scattering makes of power at most: d_b times the largest A_b of `hair`.
    #[doc(hidden)]
    pub fn max_local(&self, hair: &HairMaterial) -> f32 {
        self.densities[1] * hair.largest_local()
    }

    /// Do proxies send light back?
    #[doc(hidden)]
    pub fn has_bounce(&self) -> bool {
        let mut proxies = self.proxies.iter().take(MAX_PROXIES);
        proxies.any(|proxy| proxy.albedo() != [0.0; 3])
    }

    /// Do proxies light each other?
    #[doc(hidden)]
    pub fn has_interreflection(&self) -> bool {
        let proxies = self.proxies.iter().take(MAX_PROXIES);
        let n = proxies.filter(|proxy| proxy.albedo() != [0.0; 3]).count();
        n > 1
    }

    /// The proxies as the passes on the CPU ask about them.
    #[doc(hidden)]
    pub fn beside(&self) -> Beside {
        Beside::new(&self.proxies, &self.strands)
    }

    /// The proxies that are no meshes, as the passes read them.
    #[doc(hidden)]
    pub fn proxy_records(&self) -> ProxyRecords {
        ProxyRecords::new(&self.proxies, &self.strands)
    }

    /// The shadow maps of the lights.
    #[doc(hidden)]
    pub fn shadow_plan(&self) -> ShadowPlan {
        ShadowPlan::new(&self.measured_lights(), &self.strands, self.shadow_maps)
    }

    /// The lights with the amplitudes of `reference_amplitudes`.
    fn measured_lights(&self) -> Cow<'_, [SrbfLight]> {
        match &self.reference_amplitudes {
            Some(colors) if colors.len() == self.lights.len() => {
                let lights = self.lights.iter().zip(colors);
                lights
                    .map(|(light, &rgb)| SrbfLight { rgb, ..*light })
                    .collect()
            }
            _ => Cow::Borrowed(&self.lights),
        }
    }

    /// The lights as the passes read them, and all sweep directions (fourth float zero).
    #[doc(hidden)]
    pub fn light_records(&self) -> (Vec<LightRecord>, Vec<[f32; 4]>) {
        self.records_with(&self.shadow_plan())
    }

    /// [`PreparedScene::light_records`] with the maps of `plan`, which may be that of other
    /// colours.
    #[doc(hidden)]
    pub fn records_with(&self, plan: &ShadowPlan) -> (Vec<LightRecord>, Vec<[f32; 4]>) {
        let mut sweeps = Vec::new();
        let records = self
            .lights
            .iter()
            .zip(&plan.slots)
            .enumerate()
            .map(|(ix, (light, &shadow_index))| {
                let first_sweep = sweeps.len() as u32;
                sweeps.extend(
                    sweep_directions(light)
                        .iter()
                        .map(|&[x, y, z]| [x, y, z, 0.0]),
                );
                let maps = plan.maps_along_segments(shadow_index);
                LightRecord {
                    direction: light.direction,
                    lambda: light.lambda,
                    rgb: light.rgb,
                    power: largest(power(light)),
                    first_sweep,
                    n_sweeps: sweeps.len() as u32 - first_sweep,
                    solid_angle: solid_angle(light.lambda.into()) as f32,
                    shadow_index,
                    record: (ix % LIGHT_BATCH) as u32,
                    first_map: maps.start,
                    n_maps: maps.len() as u32,
                    pad: 0,
                }
            })
            .collect();
        (records, sweeps)
    }

    /// The counts of a frame's statistics that the scene alone decides.
    #[doc(hidden)]
    pub fn counts(&self, backend: String) -> Stats {
        Stats {
            backend,
            strands: self.strands.n_strands,
            degenerate_strands: self.strands.n_degenerate,
            points: self.strands.points.len(),
            segments: self.strands.segments.len(),
            voxels: Grid::around(&self.strands).n_voxels(),
            lights: self.lights.len(),
            sweeps: self.light_records().1.len(),
            shadow_maps: self.shadow_plan().views.len(),
            scattering: self.scattering.name(),
            skipped: self.skipped(),
            ..Stats::default()
        }
    }

    /// What no frame of the scene needs, in words.
    #[doc(hidden)]
    pub fn skipped(&self) -> Vec<String> {
        let mut skipped = Vec::new();
        for lobe in Lobe::ALL {
            if !self.hair.modes().contains(&lobe) {
                skipped.push(format!("mode {}: not enabled", lobe.name()));
            }
        }
        if self.hair.hair().eccentricity == 1.0 && self.hair.modes().contains(&Lobe::Trt) {
            skipped.push("rows of TRT over the index: the fibre is round".to_owned());
        }
        if self.paint.is_none() {
            skipped.push("paint: no point has any".to_owned());
        }
        if !self.has_bounce() {
            skipped.push("bounce light: no proxy sends light back".to_owned());
        } else if !self.has_interreflection() {
            skipped.push("light between proxies: only one sends light back".to_owned());
        }
        if self.scattering == Scattering::Single {
            skipped.push("averages of multiple scattering: single scattering alone".to_owned());
        }
        skipped
    }

    /// Power below which a light, weakened by hair, is not shaded.
    #[doc(hidden)]
    pub fn min_power(&self) -> f32 {
        let lights = self.measured_lights();
        let total: f32 = lights.iter().map(|light| largest(power(light))).sum();
        (total * self.negligible_share).min(f32::MAX)
    }

    /// How light is spread over the width of a strand, where `view` may show some that are wider than [`WIDE_PX`].
    /// Pictures of parts of the light, which must add up to that of all, have none. `kept` may be that of another view, if
    /// the hair was not edited since.
    #[doc(hidden)]
    pub fn width_profile(
        &self,
        view: &ViewUniform,
        kept: Option<WidthProfile>,
    ) -> Option<WidthProfile> {
        if self.reference_amplitudes.is_some() {
            return None;
        }
        let find = || WidthProfile::new(self.hair.hair(), self.hair.fresnel());
        self.is_close_up(view).then(|| kept.unwrap_or_else(find))
    }

    /// May strands be wider than [`WIDE_PX`] somewhere in `view`?
    #[doc(hidden)]
    pub fn is_close_up(&self, view: &ViewUniform) -> bool {
        self.strands.max_diameter * view.focal_px / view.near > WIDE_PX
    }

    /// A power of two that brings radiance in this scene near 1: half-float targets keep three
    /// digits from 2^-14 to 2^16 around it.
    #[doc(hidden)]
    pub fn radiance_scale(&self) -> f32 {
        let lights = self.lights.iter();
        let total: f32 = lights.map(|light| largest(power(light))).sum();
        if !(total > 0.0 && total.is_finite()) {
            return 1.0;
        }
        // A fibre sends on some 3 % of all power into each steradian.
        (-(0.03 * total).log2()).round().clamp(-100.0, 100.0).exp2()
    }
}

/// Refuses the first light with a value outside its range.
#[doc(hidden)]
pub fn check_lights(lights: &[SrbfLight]) -> Result<(), SceneError> {
    for (ix, light) in lights.iter().enumerate() {
        light
            .validate()
            .map_err(|error| SceneError::from(error).at_key(format!("lights[{ix}]")))?;
    }
    Ok(())
}
