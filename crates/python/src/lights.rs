//! Light sets.

use std::path::PathBuf;

use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;
use strandlight_bake::lights::exchange::{lambda, sharpness};
use strandlight_bake::lights::{
    FitOptions, STEPS, evaluate, fit, light_set, light_set_png, preview_png, radiance, sort_lights,
    texel_means,
};
use strandlight_formats::{BakedFile, LightSet as Lights, LightSetInfo, SrbfLight};
use strandlight_images::{LatLong, Map, MapSelection};

use crate::arrays::{fresh, rows, shaped, values};
use crate::fault::{Fault, Outcome};
use crate::work;

/// Largest width and height of a map that is made.
const MAX_SIDE: usize = 32768;

/// A light set.
#[pyclass(frozen, module = "strandlight._native")]
pub struct LightSet(pub Lights);

/// A map: a file, or pixels of `(height, width, 3)`.
enum MapSource {
    File(PathBuf, MapSelection),
    Pixels([usize; 2], Vec<[f32; 3]>),
}

impl MapSource {
    fn new(
        path: Option<PathBuf>,
        pixels: Option<PyReadonlyArray3<'_, f32>>,
        selection: MapSelection,
    ) -> Outcome<MapSource> {
        match (path, pixels) {
            (Some(path), _) => Ok(MapSource::File(path, selection)),
            (None, Some(pixels)) => {
                let array = pixels.as_array();
                let size = [array.shape()[1], array.shape()[0]];
                let (pixels, _) = values(&pixels)?.as_chunks::<3>();
                Ok(MapSource::Pixels(size, pixels.to_vec()))
            }
            (None, None) => Err(Fault::value("a map is a path or an array")),
        }
    }

    fn read(self) -> Outcome<Map> {
        Ok(match self {
            MapSource::File(path, selection) => Map::read_selected(&path, &selection)?,
            MapSource::Pixels([width, height], pixels) => Map::new(width, height, pixels)?,
        })
    }
}

/// Fits lights to the map at `path`, or of `pixels` `(height, width, 3)`.
#[pyfunction]
#[pyo3(signature = (path, pixels, count, seed, part, layer, report, progress))]
#[allow(
    clippy::too_many_arguments,
    reason = "Python's keywords, which the package gives by position"
)]
pub fn fit_lights(
    py: Python<'_>,
    path: Option<PathBuf>,
    pixels: Option<PyReadonlyArray3<'_, f32>>,
    count: usize,
    seed: u64,
    part: Option<String>,
    layer: Option<String>,
    report: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<LightSet> {
    let file = path.clone();
    let source = MapSource::new(path, pixels, MapSelection { part, layer });
    let source = source.map_err(|fault| fault.raise(py))?;
    work::run(py, progress, |watch| {
        let options = FitOptions { count, seed };
        // Reading before the steps of the fit, the report after them.
        let steps = watch.steps(STEPS + 2);
        let map = source.read()?;
        steps.advance(1);
        let fitted = fit(&map, options, &steps).map_err(|error| match &file {
            Some(path) => Fault::from(error).in_file(path),
            None => Fault::from(error),
        })?;
        let report = report.then(|| evaluate(&fitted.lights, &map));
        steps.advance(1);
        Ok(LightSet(light_set(options, &map, &fitted, report)))
    })
}

#[pymethods]
impl LightSet {
    /// Lights of `axes` `(n, 3)`, `sharpness` `(n,)` and `rgb` `(n, 3)`, sorted by falling energy.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        axes: PyReadonlyArray2<'_, f64>,
        sharpness: PyReadonlyArray1<'_, f64>,
        rgb: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<LightSet> {
        let make = || {
            let (axes, rgb) = (rows::<f64, 3>(&axes)?, rows::<f32, 3>(&rgb)?);
            let lights = axes
                .into_iter()
                .zip(values(&sharpness)?)
                .zip(rgb)
                .enumerate();
            let lights = lights.map(|(ix, ((axis, &sharpness), rgb))| {
                let at = |what: &str| Fault::value(format!("light {ix}: {what}"));
                let direction = unit(axis).ok_or_else(|| at("its axis has no direction"))?;
                if !(sharpness > 0.0 && sharpness.is_finite()) {
                    return Err(at(&format!("sharpness is {sharpness}, must be above 0")));
                }
                Ok(SrbfLight {
                    direction: direction.map(|x| x as f32),
                    lambda: lambda(sharpness) as f32,
                    rgb,
                })
            });
            let lights = lights.collect::<Outcome<Vec<SrbfLight>>>()?;
            let info = LightSetInfo {
                requested_count: lights.len() as u32,
                parameters: vec![("format".to_owned(), "arrays".to_owned())],
                ..LightSetInfo::default()
            };
            let mut set = Lights { lights, info };
            // In the order of the arrays, by which lights are named.
            set.validate()?;
            sort_lights(&mut set.lights);
            Ok(LightSet(set))
        };
        make().map_err(|fault: Fault| fault.raise(py))
    }

    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<LightSet> {
        let read = py.detach(|| Lights::read(&path));
        read.map(LightSet)
            .map_err(|error| Fault::from(error).raise(py))
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<LightSet> {
        Lights::from_bytes(bytes)
            .map(LightSet)
            .map_err(|error| Fault::from(error).raise(py))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.0.to_bytes();
        let bytes = bytes.map_err(|error| Fault::from(error).raise(py))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = py.detach(|| self.0.write(&path));
        written
            .map(drop)
            .map_err(|error| Fault::from(error).raise(py))
    }

    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let axes: Vec<f32> = self.0.lights.iter().flat_map(|it| it.direction).collect();
        shaped(py, axes, &[self.0.lights.len(), 3])
    }

    fn sharpness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let all: Vec<f64> = self
            .0
            .lights
            .iter()
            .map(|it| sharpness(it.lambda))
            .collect();
        let shape = [all.len()];
        shaped(py, all, &shape)
    }

    fn lambdas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let all: Vec<f32> = self.0.lights.iter().map(|it| it.lambda).collect();
        let shape = [all.len()];
        shaped(py, all, &shape)
    }

    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let rgb: Vec<f32> = self.0.lights.iter().flat_map(|it| it.rgb).collect();
        shaped(py, rgb, &[self.0.lights.len(), 3])
    }

    /// Figures of the fit, or `None`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(report) = self.0.info.report else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("rel_l2", report.rel_l2)?;
        dict.set_item("energy_ratio", report.energy_ratio)?;
        dict.set_item("irradiance_error", report.irradiance_error)?;
        dict.set_item("fibre_error", report.fibre_error)?;
        Ok(Some(dict))
    }

    /// What the file records about its making.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let info = &self.0.info;
        let dict = PyDict::new(py);
        dict.set_item("map_hash", &info.map_hash)?;
        dict.set_item("map_size", (info.map_size[0], info.map_size[1]))?;
        dict.set_item("requested_count", info.requested_count)?;
        dict.set_item("seed", info.seed)?;
        dict.set_item("tool_version", &info.tool_version)?;
        let parameters = PyDict::new(py);
        for (name, value) in &info.parameters {
            parameters.set_item(name, value)?;
        }
        dict.set_item("parameters", parameters)?;
        Ok(dict)
    }

    /// Radiance `(n, 3)` from `directions` `(n, 3)`, of whatever length.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        directions: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let rows = rows::<f64, 3>(&directions).map_err(|fault| fault.raise(py))?;
        let n = rows.len();
        let answer = work::run(py, None, |_| {
            let of = |(ix, &direction): (usize, &[f64; 3])| match unit(direction) {
                Some(direction) => Ok(radiance(&self.0.lights, direction)),
                None => Err(Fault::value(format!(
                    "direction {ix} is {direction:?}, must be finite and not 0"
                ))),
            };
            let rows = rows.par_iter().enumerate().map(of);
            rows.collect::<Outcome<Vec<[f64; 3]>>>()
        })?;
        fresh(py, answer.into_flattened(), &[n, 3])
    }

    /// The environment as a map `(height, width, 3)` of means over texels.
    fn map<'py>(
        &self,
        py: Python<'py>,
        height: usize,
        width: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let grid = LatLong { width, height };
        let pixels = work::run(py, None, |_| {
            if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
                let what = format!("a map of {width} x {height}: each must be in 1..={MAX_SIDE}");
                return Err(Fault::value(what));
            }
            Ok(texel_means(&self.0.lights, grid).into_flattened())
        })?;
        fresh(py, pixels, &[height, width, 3])
    }

    /// A PNG of the lights; with a map as for `fit_lights`, of the fit.
    #[pyo3(signature = (path=None, pixels=None))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        path: Option<PathBuf>,
        pixels: Option<PyReadonlyArray3<'_, f32>>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let map = match (&path, &pixels) {
            (None, None) => None,
            _ => {
                let source = MapSource::new(path, pixels, MapSelection::default());
                Some(source.map_err(|fault| fault.raise(py))?)
            }
        };
        let bytes = work::run(py, None, |_| {
            let bytes = match map {
                Some(map) => preview_png(&self.0, &map.read()?),
                None => light_set_png(&self.0),
            };
            bytes.map_err(|error| Fault::new("render", error.to_string()))
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __len__(&self) -> usize {
        self.0.lights.len()
    }
}

/// `vector` at length 1, if it has a direction.
fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let largest = vector.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let is_usable = vector.iter().all(|x| x.is_finite()) && largest > 0.0;
    let scaled = vector.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    is_usable.then(|| scaled.map(|x| x / length))
}
