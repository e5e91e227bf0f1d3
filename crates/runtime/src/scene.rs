//! A scene made ready for rendering: the files it names read, checked and put into world space.

use std::io::{Read, Seek};
use std::path::Path;
use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_formats::{
    Background, Domain, Groom, HairSection, LightSet, Mode, Scattering, Scene, SrbfLight,
    TableFile, TableReader,
};
use strandlight_scattering::closed_form::{
    DENSITY_BACK, DENSITY_FORWARD, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::table_names;
use strandlight_scattering::{HairParams, Lobe, PerLobe};

use crate::camera::{Camera, DEFAULT_FOV_Y};
use crate::edit::{HairTextures, LobeTables};
use crate::error::SceneError;
use crate::shadow_maps::{DEFAULT_SHADOW_MAPS, ShadowPlan, through_weight};
use crate::stats::Stats;
use crate::strands::Strands;
use crate::tables::{BUNDLED, ShadingTables};
use crate::tone::ToneMap;
use crate::volume::{Grid, solid_angle, sweep_directions};

/// Everything a frame needs. Both backends draw from this, so they see the same numbers.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// The hair, world space, cm.
    pub strands: Strands,
    /// Lights, turned and scaled as the scene says; black ones left out.
    pub lights: Vec<SrbfLight>,
    /// The hair's parameters, the modes to draw, and the textures made of them.
    pub hair: HairTextures,
    /// d_f and d_b: shares of the hair in front of and behind a fibre that scatter, 0..=1.
    pub densities: [f32; 2],
    /// Products of a point and a light are left out below this share of all lights' power;
    /// [`NEGLIGIBLE_SHARE`].
    pub negligible_share: f32,
    /// Shadow maps to draw, about, shared out to the lights by power: see [`crate::shadow_maps`].
    pub shadow_maps: u32,
    /// Most bytes of the lights' records that a device keeps between frames; [`RECORD_BUDGET`].
    /// Where they are more, every frame sweeps again, batch by batch.
    pub record_budget: u64,
    scattering: Scattering,
    /// Tables of the closed forms: C where R is drawn.
    pub tables: ShadingTables,
    /// The view.
    pub camera: Camera,
    /// What is seen between the strands.
    pub background: Background,
    /// Stops: radiance is multiplied by `2^exposure` before the tone map.
    pub exposure: f32,
    /// Curve to the 8-bit picture.
    pub tone_map: ToneMap,
    /// Picture size that the scene asks for.
    pub size: [u32; 2],
    /// Samples a pixel that the scene asks for.
    pub samples: u32,
}

/// A light as the passes read it; mirrored by `Light` in `shaders/lib/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
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
    pub slot: u32,
    /// How much of TT's unblocked share is that of the light through to the eye.
    pub through: f32,
    /// Not used.
    pub pad: [u32; 3],
}

/// A term of scattering is left out for a point and a light where the power that the term starts
/// from is below this share of all lights' power: with 40 lights each term lacks at most 4e-4 of
/// what a lit fibre has. Pictures of brown and black wigs, all terms drawn, differ by a relative
/// RMSE of 1.4e-5 and 3e-6.
///
/// That power is T times the light's for single scattering, d_f (T_f - T) times it for global, and
/// either of them times d_b and the largest A_b for local.
pub const NEGLIGIBLE_SHARE: f32 = 1e-5;

/// Records of 256 lights at the largest grid.
pub const RECORD_BUDGET: u64 = 512 << 20;

impl PreparedScene {
    /// Reads what `scene` names and prepares it.
    ///
    /// # Errors
    /// The first file that cannot be read or value that cannot be used, by name.
    pub fn load(scene: &Scene) -> Result<Self, SceneError> {
        scene
            .validate()
            .map_err(|error| SceneError::File(error.to_string()))?;
        let groom = in_file("groom.file", &scene.groom_path(), Groom::read)?;
        let lights = in_file("lights.file", &scene.lights_path(), LightSet::read)?;
        let modes: Vec<Lobe> = scene.hair.modes.iter().map(|&mode| lobe(mode)).collect();
        let tables = match scene.tables_path() {
            Some(path) => {
                let reader = in_file("tables.file", &path, TableFile::open)?;
                read_tables(reader, &path.display().to_string(), &modes)?
            }
            None => TableReader::from_static(BUNDLED)
                .map_err(|error| SceneError::File(format!("bundled tables: {error}")))
                .and_then(|reader| read_tables(reader, "bundled tables", &modes))?,
        };
        let hair = hair_params(&scene.hair);
        let hair = HairTextures::new(tables.lobes, tables.fresnel, &hair, &modes, SEGMENTS)
            .map_err(|error| SceneError::File(error.to_string()))?;
        let density = |of_scene: Option<f64>, default| of_scene.map_or(default, |d| d as f32);
        let densities = [
            density(scene.hair.density_forward, DENSITY_FORWARD),
            density(scene.hair.density_back, DENSITY_BACK),
        ];
        let strands = prepare_groom(&groom, &scene.hair)?;
        let turn = Quat::from_rotation_y(scene.lights.rotate_deg.to_radians() as f32);
        let intensity = scene.lights.intensity as f32;
        let lights = lights
            .lights
            .iter()
            .map(|light| SrbfLight {
                direction: (turn * Vec3::from(light.direction)).normalize().to_array(),
                lambda: light.lambda,
                rgb: light.rgb.map(|x| (x * intensity).min(MAX_AMPLITUDE)),
            })
            .filter(|light| light.rgb.iter().any(|&x| x > 0.0))
            .collect();
        let camera = match &scene.camera {
            Some(section) => Camera {
                eye: Vec3::from(section.position.map(|x| x as f32)),
                target: Vec3::from(section.target.map(|x| x as f32)),
                up: Vec3::from(section.up.map(|x| x as f32)),
                fov_y: section.fov_deg.to_radians() as f32,
            },
            None => Camera::framing(strands.centre, strands.radius, DEFAULT_FOV_Y),
        };
        let mut prepared = PreparedScene {
            strands,
            lights,
            hair,
            densities,
            negligible_share: NEGLIGIBLE_SHARE,
            shadow_maps: scene.render.shadow_maps,
            record_budget: RECORD_BUDGET,
            scattering: scene.render.scattering,
            tables: tables.shading,
            camera,
            background: scene.render.background,
            exposure: scene.render.exposure as f32,
            tone_map: scene.render.tone_map,
            size: scene.render.size,
            samples: scene.render.samples,
        };
        prepared.set_scattering(scene.render.scattering);
        Ok(prepared)
    }

    /// A scene put together by hand, with the defaults of a scene file for the rest.
    ///
    /// # Errors
    /// The first light with a value outside its range.
    pub fn from_parts(
        strands: Strands,
        lights: Vec<SrbfLight>,
        hair: HairTextures,
        tables: ShadingTables,
        camera: Camera,
        background: Background,
    ) -> Result<Self, SceneError> {
        check_lights(&lights)?;
        let mut scene = PreparedScene {
            strands,
            lights,
            hair,
            densities: [DENSITY_FORWARD, DENSITY_BACK],
            negligible_share: NEGLIGIBLE_SHARE,
            shadow_maps: DEFAULT_SHADOW_MAPS,
            record_budget: RECORD_BUDGET,
            scattering: Scattering::Total,
            tables,
            camera,
            background,
            exposure: 0.0,
            tone_map: ToneMap::Filmic,
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

    /// Chooses the terms that are drawn. The averages of multiple scattering come or go.
    pub fn set_scattering(&mut self, scattering: Scattering) {
        self.scattering = scattering;
        if self.hair.is_multiple() != (scattering != Scattering::Single) {
            self.hair.enable_multiple(scattering != Scattering::Single);
        }
    }

    /// The terms that are drawn as bits: [`TERM_SINGLE`], [`TERM_LOCAL`], [`TERM_GLOBAL`].
    pub fn terms(&self) -> u32 {
        match self.scattering {
            Scattering::Single => TERM_SINGLE,
            Scattering::Global => TERM_GLOBAL,
            Scattering::Local => TERM_LOCAL,
            Scattering::Total => TERM_SINGLE | TERM_LOCAL | TERM_GLOBAL,
        }
    }

    /// What local scattering makes of power at most: d_b times the largest A_b of `hair`.
    pub fn most_local(&self, hair: &HairTextures) -> f32 {
        let largest = hair.averages().iter().flat_map(|texel| &texel[..3]);
        self.densities[1] * largest.fold(0.0, |a, &b| f32::max(a, b))
    }

    /// The shadow maps of the lights.
    pub fn shadow_plan(&self) -> ShadowPlan {
        ShadowPlan::new(&self.lights, &self.strands, self.shadow_maps)
    }

    /// The lights as the passes read them, and all sweep directions (fourth float zero).
    pub fn light_records(&self) -> (Vec<LightRecord>, Vec<[f32; 4]>) {
        let mut sweeps = Vec::new();
        let records = self
            .lights
            .iter()
            .zip(self.shadow_plan().slots)
            .map(|(light, slot)| {
                let first_sweep = sweeps.len() as u32;
                sweeps.extend(
                    sweep_directions(light)
                        .iter()
                        .map(|&[x, y, z]| [x, y, z, 0.0]),
                );
                let brightest = light.rgb.iter().copied().fold(0.0, f32::max);
                let solid_angle = solid_angle(light.lambda);
                LightRecord {
                    direction: light.direction,
                    lambda: light.lambda,
                    rgb: light.rgb,
                    power: brightest * solid_angle,
                    first_sweep,
                    n_sweeps: sweeps.len() as u32 - first_sweep,
                    solid_angle,
                    slot,
                    through: through_weight(light.lambda),
                    pad: [0; 3],
                }
            })
            .collect();
        (records, sweeps)
    }

    /// The counts of a frame's statistics that the scene alone decides.
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
    fn skipped(&self) -> Vec<String> {
        let mut skipped = Vec::new();
        for lobe in Lobe::ALL {
            if !self.hair.modes().contains(&lobe) {
                skipped.push(format!("mode {}: not enabled", lobe.name()));
            }
        }
        if self.hair.hair().eccentricity == 1.0 && self.hair.modes().contains(&Lobe::Trt) {
            skipped.push("rows of TRT over the index: the fibre is round".to_owned());
        }
        if self.scattering == Scattering::Single {
            skipped.push("averages of multiple scattering: single scattering alone".to_owned());
        }
        skipped
    }

    /// Power below which a light, weakened by hair, is not shaded.
    pub fn min_power(&self) -> f32 {
        let total: f32 = self.light_records().0.iter().map(|light| light.power).sum();
        (total * self.negligible_share).min(f32::MAX)
    }

    /// A power of two that brings radiance in this scene near 1: half-float targets keep three
    /// digits from 2^-14 to 2^16 around it.
    pub fn radiance_scale(&self) -> f32 {
        let total: f32 = self.light_records().0.iter().map(|light| light.power).sum();
        if !(total > 0.0 && total.is_finite()) {
            return 1.0;
        }
        // A fibre sends on some 3 % of all power into each steradian.
        (-(0.03 * total).log2()).round().clamp(-100.0, 100.0).exp2()
    }
}

/// Refuses the first light with a value outside its range.
pub(crate) fn check_lights(lights: &[SrbfLight]) -> Result<(), SceneError> {
    for (ix, light) in lights.iter().enumerate() {
        light
            .validate()
            .map_err(|error| SceneError::File(format!("lights[{ix}]: {error}")))?;
    }
    Ok(())
}

/// What shading reads of a file.
struct SceneTables {
    shading: ShadingTables,
    lobes: Arc<LobeTables>,
    fresnel: Fresnel,
}

/// Names of the tables that drawing `mode` reads.
fn names_of(mode: Lobe) -> Vec<&'static str> {
    match mode {
        Lobe::R => vec!["C"],
        Lobe::Tt | Lobe::Trt => table_names(mode).to_vec(),
    }
}

/// Reads the tables that shading with `modes` samples, and no other; `name` is the file's.
fn read_tables<R: Read + Seek>(
    mut reader: TableReader<R>,
    name: &str,
    modes: &[Lobe],
) -> Result<SceneTables, SceneError> {
    let mut file = TableFile {
        fresnel: reader.fresnel().to_owned(),
        ..TableFile::default()
    };
    for table in modes.iter().flat_map(|&mode| names_of(mode)) {
        if reader.headers().iter().any(|header| header.name == table) {
            let table = reader.read_table(table);
            file.tables
                .push(table.map_err(|error| SceneError::File(error.to_string()))?);
        }
    }
    // H_TT and H_TRT are for the paper's scheme.
    let mut of_tables = modes.to_vec();
    of_tables.retain(|&mode| mode == Lobe::R);
    let failed = |error: &dyn std::fmt::Display| SceneError::File(format!("{name}: {error}"));
    Ok(SceneTables {
        shading: ShadingTables::for_modes(&file, &of_tables).map_err(|error| failed(&error))?,
        lobes: Arc::new(LobeTables::from_file(&file, modes).map_err(|error| failed(&error))?),
        fresnel: Fresnel::from_name(&file.fresnel)
            .ok_or_else(|| failed(&format_args!("unknown fresnel {:?}", file.fresnel)))?,
    })
}

/// Segments m of the outer integral, as Xu 2011 published.
const SEGMENTS: u32 = 4;

/// Brightest amplitude: sums of thousands of such lights stay finite in f32.
const MAX_AMPLITUDE: f32 = 1e30;

/// Reads what the scene names under `key`.
fn in_file<T>(
    key: &str,
    path: &Path,
    read: impl FnOnce(&Path) -> Result<T, strandlight_formats::Error>,
) -> Result<T, SceneError> {
    read(path).map_err(|error| SceneError::File(format!("{key}: {error}")))
}

/// Strands of `groom`, refined, with the scene's or the groom's fibre diameter.
fn prepare_groom(groom: &Groom, hair: &HairSection) -> Result<Strands, SceneError> {
    let fallback = hair.diameter_cm.unwrap_or(HairSection::DEFAULT_DIAMETER_CM) as f32;
    let attribute = match hair.diameter_cm {
        Some(_) => None,
        None => groom.attribute("diameter").filter(|a| a.components == 1),
    };
    let diameter = |strand: usize, point: usize| match attribute {
        Some(a) => {
            let ix = match a.domain {
                Domain::Groom => 0,
                Domain::Strand => strand,
                Domain::Point => point,
            };
            a.data.get(ix).copied().unwrap_or(fallback)
        }
        None => fallback,
    };
    Strands::new(&groom.points, &groom.strand_offsets, diameter, true)
}

fn lobe(mode: Mode) -> Lobe {
    match mode {
        Mode::R => Lobe::R,
        Mode::Tt => Lobe::Tt,
        Mode::Trt => Lobe::Trt,
    }
}

/// The scene's degrees and standard deviations as radians and Xu's widths.
fn hair_params(section: &HairSection) -> HairParams {
    let width = |deg: f64| deg.to_radians() * std::f64::consts::SQRT_2;
    HairParams {
        eta: section.eta,
        sigma_a: section.sigma_a,
        shift: PerLobe {
            r: section.shift_deg.r.to_radians(),
            tt: section.shift_deg.tt.to_radians(),
            trt: section.shift_deg.trt.to_radians(),
        },
        width: PerLobe {
            r: width(section.width_deg.r),
            tt: width(section.width_deg.tt),
            trt: width(section.width_deg.trt),
        },
        caustic_width: width(section.caustic_width_deg),
        eccentricity: section.eccentricity,
    }
}
