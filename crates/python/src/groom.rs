//! Grooms, their arrays in the memory of NumPy.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use strandlight_bake::grooms::{GrowSpec, Style, generate};
use strandlight_formats::{Attribute, BakedFile, Domain, Groom as Hair, GroomSource};

use crate::arrays::{frozen, rows, shaped, values};
use crate::fault::{Fault, Outcome};
use crate::groom_file::{Target, Wishes, read, write};
use crate::work;

/// A groom.
#[pyclass(frozen, module = "strandlight._native")]
pub struct Groom {
    points: Py<PyArrayDyn<f32>>,
    offsets: Py<PyArray1<u32>>,
    attributes: Vec<Named>,
    source: GroomSource,
}

/// An attribute.
struct Named {
    name: String,
    domain: Domain,
    components: u32,
    /// `(elements,)`, or `(elements, components)` where there are several.
    data: Py<PyArrayDyn<f32>>,
}

/// An attribute from Python: name, domain, and values `(elements, components)`.
type Given<'py> = (String, String, PyReadonlyArray2<'py, f32>);

impl Groom {
    /// Moves the arrays of `groom` to NumPy.
    fn new(py: Python<'_>, groom: Hair) -> PyResult<Groom> {
        let n_points = groom.points.len();
        let points = shaped(py, groom.points.into_flattened(), &[n_points, 3])?;
        let attributes = groom.attributes.into_iter().map(|attribute| {
            let components = attribute.components;
            let n = attribute.data.len() / components.max(1) as usize;
            let data = match components {
                1 => shaped(py, attribute.data, &[n])?,
                _ => shaped(py, attribute.data, &[n, components as usize])?,
            };
            Ok(Named {
                name: attribute.name,
                domain: attribute.domain,
                components,
                data: data.unbind(),
            })
        });
        Ok(Groom {
            attributes: attributes.collect::<PyResult<_>>()?,
            points: points.unbind(),
            offsets: frozen(py, groom.strand_offsets)?.unbind(),
            source: groom.source,
        })
    }

    /// The groom in memory of its own, for work without Python.
    pub fn to_groom(&self, py: Python<'_>) -> PyResult<Hair> {
        let floats = |array: &Py<PyArrayDyn<f32>>| -> PyResult<Vec<f32>> {
            let array = array.bind(py).try_readonly()?;
            Ok(values(&array).map_err(|fault| fault.raise(py))?.to_vec())
        };
        let points = floats(&self.points)?;
        let attributes = self.attributes.iter().map(|named| {
            Ok(Attribute {
                name: named.name.clone(),
                domain: named.domain,
                components: named.components,
                data: floats(&named.data)?,
            })
        });
        let attributes = attributes.collect::<PyResult<_>>()?;
        let offsets = self.offsets.bind(py).try_readonly()?;
        let offsets = values(&offsets).map_err(|fault| fault.raise(py))?;
        Ok(Hair {
            points: points.as_chunks::<3>().0.to_vec(),
            strand_offsets: offsets.to_vec(),
            attributes,
            source: self.source.clone(),
        })
    }
}

fn attribute((name, domain, data): &Given<'_>) -> Outcome<Attribute> {
    let domain = [Domain::Groom, Domain::Strand, Domain::Point]
        .into_iter()
        .find(|it| it.name() == domain)
        .ok_or_else(|| Fault::value(format!("attribute {name}: no domain {domain:?}")))?;
    Ok(Attribute {
        name: name.clone(),
        domain,
        components: data.as_array().shape()[1] as u32,
        data: values(data)?.to_vec(),
    })
}

#[pymethods]
impl Groom {
    /// Strands of `points` `(n, 3)`, in centimetres with y up, that begin at `offsets`.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f32>,
        offsets: PyReadonlyArray1<'_, u32>,
        attributes: Vec<Given<'_>>,
    ) -> PyResult<Groom> {
        let make = || {
            let groom = Hair {
                points: rows::<f32, 3>(&points)?,
                strand_offsets: values(&offsets)?.to_vec(),
                attributes: attributes.iter().map(attribute).collect::<Outcome<_>>()?,
                source: GroomSource::default(),
            };
            groom.validate()?;
            Ok(groom)
        };
        let groom = make().map_err(|fault: Fault| fault.raise(py))?;
        Groom::new(py, groom)
    }

    #[staticmethod]
    #[allow(
        clippy::too_many_arguments,
        reason = "Python's keywords, which the package gives by position"
    )]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        unit: Option<String>,
        up: Option<String>,
        prim: Option<String>,
        samples_per_segment: Option<u32>,
        frame: u32,
        root: String,
        guides: String,
        color_from: Option<String>,
    ) -> PyResult<Groom> {
        let wishes = Wishes {
            unit,
            up,
            prim,
            samples_per_segment,
            frame,
            root,
            guides,
            color_from,
        };
        let groom = work::run(py, None, |_| read(&path, &wishes))?;
        Groom::new(py, groom)
    }

    /// Grows hair.
    #[staticmethod]
    fn generate(
        py: Python<'_>,
        style: &str,
        strands: u32,
        points_per_strand: u32,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Groom> {
        let groom = work::run(py, progress, |watch| {
            let found = Style::ALL.into_iter().find(|it| it.name() == style);
            let style = found.ok_or_else(|| {
                let names = Style::ALL.map(Style::name).join(", ");
                Fault::value(format!("style is {style:?}, must be one of {names}"))
            })?;
            let spec = GrowSpec {
                style,
                strands,
                points_per_strand,
                seed,
            };
            Ok(generate(&spec, &watch.steps(strands.into()))?)
        })?;
        Groom::new(py, groom)
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Groom> {
        let groom = py.detach(|| Hair::from_bytes(bytes));
        let groom = groom.map_err(|error| Fault::from(error).raise(py))?;
        Groom::new(py, groom)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let groom = self.to_groom(py)?;
        let bytes = py.detach(|| groom.to_bytes());
        let bytes = bytes.map_err(|error| Fault::from(error).raise(py))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Answers the attributes that the format cannot hold.
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        to: Option<String>,
        format: Option<String>,
        unit: Option<String>,
        up: Option<String>,
    ) -> PyResult<Vec<String>> {
        let groom = self.to_groom(py)?;
        let target = Target {
            to,
            format,
            unit,
            up,
        };
        work::run(py, None, |_| write(&groom, &path, &target))
    }

    /// `(n, 3)`, the same array at each call.
    fn points(&self, py: Python<'_>) -> Py<PyArrayDyn<f32>> {
        self.points.clone_ref(py)
    }

    /// `(strands + 1,)`, the same array at each call.
    fn offsets(&self, py: Python<'_>) -> Py<PyArray1<u32>> {
        self.offsets.clone_ref(py)
    }

    /// Name and domain of each attribute.
    fn attributes(&self) -> Vec<(String, &'static str)> {
        let of = |it: &Named| (it.name.clone(), it.domain.name());
        self.attributes.iter().map(of).collect()
    }

    /// Its values, the same array at each call.
    fn attribute(&self, py: Python<'_>, name: &str) -> Option<Py<PyArrayDyn<f32>>> {
        let found = self.attributes.iter().find(|it| it.name == name);
        found.map(|it| it.data.clone_ref(py))
    }

    /// Where it comes from.
    fn source<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let source = &self.source;
        let dict = PyDict::new(py);
        dict.set_item("cm_per_unit", source.cm_per_unit)?;
        dict.set_item("up", source.up.name())?;
        dict.set_item("hash", &source.hash)?;
        dict.set_item("tool_version", &source.tool_version)?;
        let format = source.original.as_ref().map(|it| it.format.clone());
        dict.set_item("format", format)?;
        Ok(dict)
    }
}
