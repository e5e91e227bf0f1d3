//! The files of a scene, read and checked, and what each part of a prepared scene is made of:
//! a part whose sources have not changed need not be made again.

use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_formats::{
    AddedLight, Attribute, CameraSection, Cube, Domain, Groom, HairSection, LightSet,
    LightsSection, Panorama, RenderSection, Scene, SrbfLight, TableFile, TableReader, WindSection,
};
use strandlight_scattering::Lobe;
use strandlight_scattering::closed_form::{DENSITY_BACK, DENSITY_FORWARD, Tables};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::table_names;
use strandlight_scattering::spherical_gaussian::solid_angle;

use crate::camera::{Camera, DEFAULT_FOV_Y};
use crate::display::DisplayTransform;
use crate::error::SceneError;
use crate::files::Files;
use crate::lut::Lut;
use crate::material::{HairMaterial, LobeTables};
use crate::mesh::MeshShape;
use crate::motion::wind;
use crate::panorama::TurnedPanorama;
use crate::proxy::Proxy;
use crate::strands::{Strands, extent};
use crate::tables::{ShadingTables, ShadingTablesError};
use crate::variation::ShapeVariation;
use crate::volume::power;

/// Segments m of the outer integral, as Xu 2011 published.
const SEGMENTS: u32 = 4;

/// Brightest amplitude: sums of thousands of such lights stay finite in f32.
const MAX_AMPLITUDE: f32 = 1e30;

/// What shading reads of a table file.
#[derive(Debug)]
pub struct SceneTables {
    /// Tables of the closed forms: C where R may be drawn.
    pub shading: ShadingTables,
    /// Baked lobes of TT and TRT where those may be drawn.
    pub lobes: Arc<LobeTables>,
    /// Fresnel term of the tables.
    pub fresnel: Fresnel,
}

/// The files that a scene names. Clones share them.
#[derive(Clone, Debug)]
pub struct Assets {
    /// The groom as its file has it.
    pub groom: Arc<Groom>,
    /// The light set.
    pub lights: Arc<LightSet>,
    /// Tables of the modes that were asked for.
    pub tables: Arc<SceneTables>,
    /// The meshes of proxies, by their paths.
    pub meshes: Arc<BTreeMap<PathBuf, Arc<MeshShape>>>,
    /// The LUT that pictures are shown by, where there is one.
    pub lut: Option<Arc<Cube>>,
    /// The map behind the hair, where the background is one.
    pub panorama: Option<Arc<Panorama>>,
    /// The groom's own fibre diameters; `None` where its file has none.
    pub diameters: Option<Diameters>,
}

/// Fibre diameters of a groom, cm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diameters {
    /// The thinnest.
    pub min: f32,
    /// Mean of all values of the file.
    pub mean: f32,
    /// The thickest.
    pub max: f32,
}

impl Diameters {
    /// Those that `groom` has, and is drawn with unless the scene has a diameter.
    pub fn of(groom: &Groom) -> Option<Diameters> {
        let data = &diameters(groom)?.data;
        let sum: f64 = data.iter().map(|&x| f64::from(x)).sum();
        Some(Diameters {
            min: data.iter().copied().reduce(f32::min)?,
            mean: (sum / data.len() as f64) as f32,
            max: data.iter().copied().reduce(f32::max)?,
        })
    }
}

/// The strands of `groom`, which lie at `points`, as `hair` has them drawn: see [`Assets::strands`].
fn strands(groom: &Groom, points: &[[f32; 3]], hair: &HairSection) -> Result<Strands, SceneError> {
    let fallback = hair.diameter_cm.unwrap_or(HairSection::DEFAULT_DIAMETER_CM) as f32;
    let attribute = match hair.diameter_cm {
        Some(_) => None,
        None => diameters(groom),
    };
    let untapered = |strand: usize, point: usize| match attribute {
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
    let offsets = &groom.strand_offsets;
    let is_per_point = attribute.is_some_and(|a| a.domain == Domain::Point);
    if hair.taper == 0.0 || is_per_point {
        return Strands::new(points, offsets, untapered, true);
    }
    let (taper, along) = (hair.taper as f32, along_strands(groom));
    let diameter = |strand, point: usize| untapered(strand, point) * (1.0 - taper * along[point]);
    Strands::new(points, offsets, diameter, true)
}

/// How far along its strand each point of `groom` lies, as a share of the strand's length: 0 at the
/// root, 1 at the tip.
fn along_strands(groom: &Groom) -> Vec<f32> {
    let mut along = vec![0.0; groom.points.len()];
    for strand in 0..groom.n_strands() {
        let range = groom.strand(strand);
        let mut length = 0.0;
        let along = &mut along[range.clone()];
        for (pair, at) in groom.points[range].windows(2).zip(&mut along[1..]) {
            length += Vec3::from(pair[0]).distance(Vec3::from(pair[1]));
            *at = length;
        }
        if length > 0.0 {
            along.iter_mut().for_each(|at| *at /= length);
        }
    }
    along
}

/// The attribute of `groom` that gives its diameters.
fn diameters(groom: &Groom) -> Option<&Attribute> {
    groom.attribute("diameter").filter(|a| a.components == 1)
}

/// Which modes may be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModesToRead {
    /// Those of the scene.
    OfScene,
    /// All that the tables have, besides those of the scene: modes can be switched on later.
    All,
}

impl Assets {
    /// Reads what `scene` names.
    ///
    /// # Errors
    /// The first file that cannot be read, by name.
    pub fn read(scene: &Scene, files: &Files, modes: ModesToRead) -> Result<Self, SceneError> {
        let groom = files
            .groom(&scene.groom_path())
            .map_err(|error| error.at_key("groom.file"))?;
        let lights = files
            .lights(&scene.lights_path())
            .map_err(|error| SceneError::from(error).at_key("lights.file"))?;
        let assets = Assets {
            diameters: Diameters::of(&groom),
            groom: Arc::new(groom),
            lights: Arc::new(lights),
            tables: Arc::new(tables(scene, files, modes)?),
            meshes: Arc::new(meshes(scene, files, &BTreeMap::new())?),
            lut: lut(scene, files)?,
            panorama: panorama(scene, files)?,
        };
        check_lights_named(&scene.lights, &assets.lights)?;
        Ok(assets)
    }

    /// These files for `after`, of which those are read that `before` did not name; `self` are
    /// those of `before`.
    ///
    /// # Errors
    /// As [`Assets::read`].
    pub fn reread(&self, before: &Scene, after: &Scene, files: &Files) -> Result<Self, SceneError> {
        let mut assets = self.clone();
        if after.groom_path() != before.groom_path() {
            let groom = files.groom(&after.groom_path());
            let groom = groom.map_err(|error| error.at_key("groom.file"))?;
            assets.diameters = Diameters::of(&groom);
            assets.groom = Arc::new(groom);
        }
        if after.lights_path() != before.lights_path() {
            let lights = files.lights(&after.lights_path());
            let lights = lights.map_err(|error| SceneError::from(error).at_key("lights.file"))?;
            assets.lights = Arc::new(lights);
        }
        if after.tables_path() != before.tables_path() {
            assets.tables = Arc::new(tables(after, files, ModesToRead::All)?);
        }
        if after.mesh_paths() != before.mesh_paths() {
            assets.meshes = Arc::new(meshes(after, files, &self.meshes)?);
        }
        if after.lut_path() != before.lut_path() {
            assets.lut = lut(after, files)?;
        }
        if after.seen_panorama_path() != before.seen_panorama_path() {
            assets.panorama = panorama(after, files)?;
        }
        check_lights_named(&after.lights, &assets.lights)?;
        Ok(assets)
    }

    /// What clones share: the address of each part, and the bytes that it takes in memory, or nearly.
    pub fn parts(&self) -> Vec<(usize, usize)> {
        fn part<T>(shared: &Arc<T>, bytes: impl Fn(&T) -> usize) -> (usize, usize) {
            (Arc::as_ptr(shared).addr(), bytes(shared))
        }
        let of_groom = |groom: &Groom| {
            let attributes = groom.attributes.iter();
            let attributes: usize = attributes.map(|a| size_of_val(&a.data[..])).sum();
            attributes + size_of_val(&groom.points[..]) + size_of_val(&groom.strand_offsets[..])
        };
        let of_tables = |tables: &SceneTables| {
            let Tables { c, h_tt, h_trt, .. } = tables.shading.view();
            size_of_val(c) + size_of_val(h_tt) + size_of_val(h_trt)
        };
        let of_lobes = |lobes: &LobeTables| {
            let tables = [&lobes.tt, &lobes.trt].into_iter().flatten();
            let bytes = tables.map(|t| size_of_val(&t.shapes[..]) + size_of_val(&t.shares[..]));
            bytes.sum()
        };
        let of_lut = |lut: &Cube| {
            let tables = [&lut.curves, &lut.grid].into_iter().flatten();
            tables.map(|table| size_of_val(&table.samples[..])).sum()
        };
        let mut parts = vec![
            part(&self.groom, of_groom),
            part(&self.lights, |set| size_of_val(&set.lights[..])),
            part(&self.tables, of_tables),
            part(&self.tables.lobes, of_lobes),
        ];
        let meshes = self.meshes.values();
        parts.extend(meshes.map(|mesh| part(mesh, MeshShape::bytes)));
        parts.extend(self.lut.as_ref().map(|lut| part(lut, of_lut)));
        let of_map = |map: &Panorama| size_of_val(map.texels());
        parts.extend(self.panorama.as_ref().map(|map| part(map, of_map)));
        parts
    }

    /// The hair's textures as `section` asks for them, single scattering alone.
    ///
    /// # Errors
    /// A mode without its tables.
    pub fn textures(&self, section: &HairSection) -> Result<HairMaterial, SceneError> {
        let (hair, modes) = (section.params(), section.modes.clone());
        let SceneTables { lobes, fresnel, .. } = &*self.tables;
        let material = HairMaterial::new(lobes.clone(), *fresnel, &hair, &modes, SEGMENTS)?;
        Ok(material)
    }

    /// The groom's strands, in the shape that the scene's variation gives them, refined, with the scene's or the
    /// groom's fibre diameter.
    ///
    /// # Errors
    /// As [`Strands::new`].
    pub fn strands(&self, scene: &Scene) -> Result<Strands, SceneError> {
        let points = ShapeVariation::points(&scene.variation, &self.groom);
        strands(&self.groom, &points, &scene.hair)
    }

    /// The proxies of `scene`, whose meshes have been read.
    pub fn proxies(&self, scene: &Scene) -> Vec<Proxy> {
        let paths: BTreeMap<usize, PathBuf> = scene.mesh_paths().into_iter().collect();
        let proxies = scene.proxies.iter().enumerate();
        let of = proxies.filter_map(|(ix, section)| {
            let shape = paths.get(&ix).and_then(|path| self.meshes.get(path));
            Proxy::from_section(section, shape)
        });
        of.collect()
    }

    /// What pictures are shown by: the LUT, or else the tone map of `section`.
    pub fn display(&self, section: &RenderSection) -> DisplayTransform {
        match &self.lut {
            Some(cube) => DisplayTransform::Lut(Lut {
                cube: cube.clone(),
                input: section.lut_input,
            }),
            None => section.tone_map.into(),
        }
    }

    /// The map behind the hair, turned and multiplied as `section` says.
    pub fn turned_panorama(&self, section: &LightsSection) -> Option<TurnedPanorama> {
        let map = self.panorama.clone()?;
        Some(TurnedPanorama::new(map, section))
    }

    /// [`Assets::strands`] at rest, in the space that they take in the wind of `scene`, where it has one.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn strands_in_room(&self, scene: &Scene) -> Result<Strands, SceneError> {
        let strands = self.strands(scene)?;
        Ok(match wind_of(scene) {
            Some(section) => wind::with_room(section, strands),
            None => strands,
        })
    }

    /// The view of `scene` where it says none: all of the hair, as it is drawn.
    pub fn framing(&self, scene: &Scene) -> Camera {
        let in_wind = wind_of(scene).and_then(|_| self.strands_in_room(scene).ok());
        let (centre, radius) = match in_wind {
            Some(strands) => (strands.centre, strands.radius),
            // Nothing else of the strands is needed, which take longer to make.
            None => {
                let points = ShapeVariation::points(&scene.variation, &self.groom);
                let (_, centre, radius) = extent(&points);
                (centre, radius)
            }
        };
        Camera::framing(centre, radius, DEFAULT_FOV_Y)
    }

    /// All lights of the set, turned as `section` says, with the amplitudes of the set; then those that `section`
    /// adds.
    pub fn turned_lights(&self, section: &LightsSection) -> Vec<SrbfLight> {
        let turn = Quat::from_rotation_y(section.rotate_deg.to_radians() as f32);
        let turned = |light: &SrbfLight| SrbfLight {
            direction: (turn * Vec3::from(light.direction)).normalize().to_array(),
            ..*light
        };
        let of_set = self.lights.lights.iter().map(turned);
        of_set
            .chain(section.added.iter().map(AddedLight::light))
            .collect()
    }

    /// The same, with the amplitudes that shadow maps are shared out by while `section` is edited: a light that it adds
    /// counts as half the set, whatever its intensity, so that no picture depends on the edits before it.
    pub fn planned_lights(&self, section: &LightsSection) -> Vec<SrbfLight> {
        let mut lights = self.turned_lights(section);
        let (of_set, added) = lights.split_at_mut(self.lights.lights.len());
        let sum: f64 = of_set.iter().flat_map(power).sum();
        for light in added {
            let amplitude = 0.5 * sum / 3.0 / solid_angle(f64::from(light.lambda));
            light.rgb = [(amplitude as f32).min(MAX_AMPLITUDE); 3];
        }
        lights
    }

    /// Amplitudes of all these lights as `section` changes them; black where they are off.
    pub fn light_colors(&self, section: &LightsSection) -> Vec<[f32; 3]> {
        let factors = (0..).map(|ix| section.factor(ix).map(|x| x as f32));
        let of_set = self.lights.lights.iter().zip(factors);
        let of_set = of_set.map(|(light, factor)| {
            let colored = |channel| light.rgb[channel] * factor[channel];
            std::array::from_fn(|channel| f32::min(colored(channel), MAX_AMPLITUDE))
        });
        let numbers = self.lights.lights.len() as u32..;
        let added = numbers.zip(&section.added);
        let added = added.map(|(ix, light)| match section.is_on(ix) {
            true => light.light().rgb,
            false => [0.0; 3],
        });
        of_set.chain(added).collect()
    }
}

/// The wind of `scene`.
fn wind_of(scene: &Scene) -> Option<&WindSection> {
    scene.motion.as_ref()?.wind.as_ref()
}

/// Reads the LUT that `scene` names.
fn lut(scene: &Scene, files: &Files) -> Result<Option<Arc<Cube>>, SceneError> {
    let Some(path) = scene.lut_path() else {
        return Ok(None);
    };
    let cube = files.cube(&path);
    let cube = cube.map_err(|error| SceneError::from(error).at_key("render.lut"))?;
    Ok(Some(Arc::new(cube)))
}

/// Reads the panorama that `scene` names, where it is the background.
fn panorama(scene: &Scene, files: &Files) -> Result<Option<Arc<Panorama>>, SceneError> {
    let Some(path) = scene.seen_panorama_path() else {
        return Ok(None);
    };
    let panorama = files.panorama(&path);
    let panorama = panorama.map_err(|error| SceneError::from(error).at_key("lights.panorama"))?;
    Ok(Some(Arc::new(panorama)))
}

/// Reads the meshes that `scene` names and that are not among those `known`.
fn meshes(
    scene: &Scene,
    files: &Files,
    known: &BTreeMap<PathBuf, Arc<MeshShape>>,
) -> Result<BTreeMap<PathBuf, Arc<MeshShape>>, SceneError> {
    let mut meshes = BTreeMap::new();
    for (ix, path) in scene.mesh_paths() {
        if meshes.contains_key(&path) {
            continue;
        }
        let shape = match known.get(&path) {
            Some(shape) => Arc::clone(shape),
            None => {
                let mesh = files.mesh(&path);
                let at_key = |error| SceneError::from(error).at_key(format!("proxy[{ix}].mesh"));
                Arc::new(MeshShape::new(mesh.map_err(at_key)?))
            }
        };
        meshes.insert(path, shape);
    }
    Ok(meshes)
}

/// Refuses keys that name a light which is not there.
fn check_lights_named(section: &LightsSection, set: &LightSet) -> Result<(), SceneError> {
    match section.missing_light(set.lights.len()) {
        Some((key, light)) => Err(SceneError::NoLight {
            key,
            light,
            last: set.lights.len() - 1,
        }),
        None => Ok(()),
    }
}

/// Reads the tables that the scene names.
fn tables(scene: &Scene, files: &Files, wanted: ModesToRead) -> Result<SceneTables, SceneError> {
    let of_scene = scene.hair.modes.clone();
    match scene.tables_path() {
        Some(path) => {
            let reader = files
                .tables(&path)
                .map_err(|error| SceneError::from(error).at_key("tables.file"))?;
            read_tables(reader, &of_scene, wanted).map_err(|error| error.in_file(&path))
        }
        // A third of a page's bytes, and many scenes bring their own: a file beside the program.
        #[cfg(target_arch = "wasm32")]
        None => files
            .tables(crate::tables::DEFAULT_FILE.as_ref())
            .map_err(SceneError::from)
            .and_then(|reader| {
                let read = read_tables(reader, &of_scene, wanted);
                read.map_err(|error| built_in("default tables", error))
            }),
        #[cfg(not(target_arch = "wasm32"))]
        None => TableReader::from_static(strandlight_data::LEAN_TABLES)
            .map_err(SceneError::from)
            .and_then(|reader| read_tables(reader, &of_scene, wanted))
            .map_err(|error| built_in("bundled tables", error)),
    }
}

fn built_in(name: &'static str, error: SceneError) -> SceneError {
    SceneError::BuiltIn {
        name,
        source: Box::new(error),
    }
}

/// Names of the tables that drawing `mode` reads.
fn names_of(mode: Lobe) -> Vec<&'static str> {
    match mode {
        Lobe::R => vec!["C"],
        Lobe::Tt | Lobe::Trt => table_names(mode).to_vec(),
    }
}

/// Reads the tables that shading with `modes` samples, and no other unless all that are there are
/// `wanted`.
fn read_tables<R: Read + Seek>(
    mut reader: TableReader<R>,
    modes: &[Lobe],
    wanted: ModesToRead,
) -> Result<SceneTables, SceneError> {
    let mut file = TableFile {
        fresnel: reader.fresnel().to_owned(),
        ..TableFile::default()
    };
    let has = |table: &str| reader.headers().iter().any(|header| header.name == table);
    let is_there = |mode: &Lobe| names_of(*mode).into_iter().all(has);
    let mut modes = modes.to_vec();
    if wanted == ModesToRead::All {
        let more = Lobe::ALL.into_iter().filter(is_there);
        let more: Vec<Lobe> = more.filter(|mode| !modes.contains(mode)).collect();
        modes.extend(more);
    }
    for table in modes.iter().flat_map(|&mode| names_of(mode)) {
        if reader.headers().iter().any(|header| header.name == table) {
            file.tables.push(reader.read_table(table)?);
        }
    }
    // H_TT and H_TRT are for the paper's scheme.
    let mut of_tables = modes.clone();
    of_tables.retain(|&mode| mode == Lobe::R);
    Ok(SceneTables {
        shading: ShadingTables::for_modes(&file, &of_tables)?,
        lobes: Arc::new(LobeTables::from_file(&file, &modes)?),
        fresnel: file.fresnel.parse().map_err(ShadingTablesError::from)?,
    })
}

/// d_f and d_b: the scene's, or else the renderer's.
pub fn densities(section: &HairSection) -> [f32; 2] {
    let density = |of_scene: Option<f64>, default| of_scene.map_or(default, |d| d as f32);
    [
        density(section.density_forward, DENSITY_FORWARD),
        density(section.density_back, DENSITY_BACK),
    ]
}

/// The scene's view, or one that frames all of the hair: a sphere about `centre`, cm.
pub fn camera(section: Option<&CameraSection>, centre: Vec3, radius: f32) -> Camera {
    match section {
        Some(section) => Camera {
            eye: Vec3::from(section.position.map(|x| x as f32)),
            target: Vec3::from(section.target.map(|x| x as f32)),
            up: Vec3::from(section.up.map(|x| x as f32)),
            fov_y: section.fov_deg.to_radians() as f32,
        },
        None => Camera::framing(centre, radius, DEFAULT_FOV_Y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Diameters at which the points of a bent strand and of a short one are drawn.
    fn drawn(domain: Domain, values: &[f32], hair: &HairSection) -> Vec<f32> {
        let groom = Groom {
            points: vec![
                [0.0, 0.0, 0.0],
                [0.0, -1.0, 0.0],
                [3.0, -1.0, 0.0],
                [9.0, 0.0, 0.0],
                [9.0, -1.0, 0.0],
            ],
            strand_offsets: vec![0, 3, 5],
            attributes: vec![Attribute {
                name: "diameter".to_owned(),
                domain,
                components: 1,
                data: values.to_vec(),
            }],
            ..Groom::default()
        };
        let strands = strands(&groom, &groom.points, hair).expect("valid");
        let at = |at: [f32; 3]| {
            let point = strands.points.iter().find(|p| p[..3] == at);
            2.0 * point.expect("knots are kept")[3]
        };
        groom.points.iter().map(|&point| at(point)).collect()
    }

    #[test]
    fn strands_taper_by_their_length() {
        let half = HairSection {
            taper: 0.5,
            ..HairSection::default()
        };
        // A quarter of the first strand's length lies before its bend.
        let shares = [1.0, 0.875, 0.5, 1.0, 0.5];
        let thick = shares.map(|share| 0.02 * share);
        assert_eq!(drawn(Domain::Groom, &[0.02], &half), thick);
        let strand = drawn(Domain::Strand, &[0.02, 0.04], &half);
        assert_eq!(strand[..3], thick[..3]);
        assert_eq!(strand[3..], [0.04, 0.02]);
        let scene = HairSection {
            diameter_cm: Some(0.02),
            ..half.clone()
        };
        assert_eq!(drawn(Domain::Groom, &[0.5], &scene), thick);
        // A diameter per point says it all.
        let own = [0.03, 0.02, 0.01, 0.03, 0.02];
        assert_eq!(drawn(Domain::Point, &own, &half), own);
        let plain = HairSection::default();
        assert_eq!(drawn(Domain::Groom, &[0.02], &plain), [0.02; 5]);
    }
}
