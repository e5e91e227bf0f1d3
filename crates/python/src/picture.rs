//! Pictures: arrays `(height, width, 4)` of linear radiance, premultiplied.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArrayDyn, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use strandlight_formats::{Cube, Error, LutInput, ToneMap};
use strandlight_images::picture::exr_file;
use strandlight_scene::lut::Lut;
use strandlight_scene::{DisplayTransform, Picture};

use crate::arrays::{fresh, values};
use crate::fault::{Fault, Outcome};

fn picture(pixels: &PyReadonlyArray3<'_, f32>) -> Outcome<Picture> {
    let array = pixels.as_array();
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let (rgba, _) = values(pixels)?.as_chunks::<4>();
    let side = |n: usize| u32::try_from(n).ok().filter(|&n| n > 0);
    match (side(width), side(height)) {
        (Some(width), Some(height)) if rgba.len() == array.shape()[0] * array.shape()[1] => {
            let rgba = rgba.to_vec();
            Ok(Picture {
                width,
                height,
                rgba,
            })
        }
        _ => Err(Fault::value("a picture has pixels of 4 values")),
    }
}

/// A tone map by its name.
pub fn tone_map(name: &str) -> Outcome<ToneMap> {
    let found = ToneMap::ALL.into_iter().find(|it| it.name() == name);
    found.ok_or_else(|| {
        let names = ToneMap::ALL.map(ToneMap::name).join(" or ");
        Fault::value(format!("tone_map is {name:?}, must be {names}"))
    })
}

/// What shows pictures: the LUT at the path `lut`, or else the tone map.
fn display(tone_map: &str, lut: Option<PathBuf>, lut_input: &str) -> Outcome<DisplayTransform> {
    let tone_map = self::tone_map(tone_map)?;
    let Some(path) = lut else {
        return Ok(tone_map.into());
    };
    let input = LutInput::ALL.into_iter().find(|it| it.name() == lut_input);
    let input = input.ok_or_else(|| {
        let names = LutInput::ALL.map(LutInput::name).join(", ");
        Fault::value(format!(
            "lut_input is {lut_input:?}, must be one of {names}"
        ))
    })?;
    let cube = Arc::new(Cube::read(&path)?);
    Ok(DisplayTransform::Lut(Lut { cube, input }))
}

/// 8-bit sRGB with straight alpha, `(height, width, 4)`.
#[pyfunction]
pub fn to_srgb8<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'_, f32>,
    exposure: f32,
    tone_map: &str,
    lut: Option<PathBuf>,
    lut_input: &str,
) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let make = || {
        let display = display(tone_map, lut, lut_input)?;
        Ok((picture(&pixels)?, display))
    };
    let (picture, display) = make().map_err(|fault: Fault| fault.raise(py))?;
    let shape = [picture.height as usize, picture.width as usize, 4];
    let bytes = py.detach(|| picture.to_srgb8(exposure, &display));
    fresh(py, bytes.into_flattened(), &shape)
}

/// The bytes of a PNG file or, with `linear`, of an OpenEXR file.
#[pyfunction]
pub fn picture_file<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'_, f32>,
    linear: bool,
    exposure: f32,
    tone_map: &str,
    lut: Option<PathBuf>,
    lut_input: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let make = || {
        let display = display(tone_map, lut, lut_input)?;
        Ok((picture(&pixels)?, display))
    };
    let (picture, display) = make().map_err(|fault: Fault| fault.raise(py))?;
    let bytes = py.detach(|| match linear {
        true => exr_file(&picture).map_err(|error| Fault::new("render", error.to_string())),
        false => picture.to_png(exposure, &display).map_err(Fault::from),
    });
    let bytes = bytes.map_err(|fault| fault.raise(py))?;
    Ok(PyBytes::new(py, &bytes))
}

/// Writes a file, whole or not at all.
#[pyfunction]
pub fn write_file(py: Python<'_>, path: PathBuf, data: &[u8]) -> PyResult<()> {
    let written = py.detach(|| strandlight_formats::write_file(&path, data));
    written.map_err(|error| Fault::from(Error::from(error).in_file(&path)).raise(py))
}
