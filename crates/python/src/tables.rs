//! Baked tables.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use strandlight_bake::tables::{N_STEPS, bake_tables, lean};
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, Table, TableFile};
use strandlight_scattering::fresnel::UnknownFresnel;

use crate::arrays::{frozen, shaped};
use crate::fault::{Fault, Outcome};
use crate::work;

/// A file of tables.
#[pyclass(frozen, module = "strandlight._native")]
pub struct Tables(pub Arc<TableFile>);

impl Tables {
    fn new(file: TableFile) -> Tables {
        Tables(Arc::new(file))
    }

    fn table(&self, name: &str) -> Outcome<&Table> {
        let found = self.0.tables.iter().find(|table| table.name == name);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.0.tables.iter().map(|it| &*it.name).collect();
            let names = names.join(", ");
            Fault::value(format!("there is no table {name:?}, only {names}"))
        })
    }
}

#[pymethods]
impl Tables {
    /// Those that come with the program.
    #[staticmethod]
    fn bundled(py: Python<'_>) -> PyResult<Tables> {
        Tables::from_bytes(py, DEFAULT_TABLES)
    }

    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Tables> {
        let read = py.detach(|| TableFile::read(&path));
        read.map(Tables::new)
            .map_err(|error| Fault::from(error).raise(py))
    }

    #[staticmethod]
    fn bake(
        py: Python<'_>,
        fresnel: &str,
        is_lean: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Tables> {
        work::run(py, progress, |watch| {
            let term = (fresnel.parse())
                .map_err(|error: UnknownFresnel| Fault::value(error.to_string()))?;
            let file = bake_tables(term, &watch.steps(N_STEPS));
            Ok(Tables::new(if is_lean { lean(file) } else { file }))
        })
    }

    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Tables> {
        let read = py.detach(|| TableFile::from_bytes(bytes));
        read.map(Tables::new)
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

    fn names(&self) -> Vec<String> {
        self.0.tables.iter().map(|it| it.name.clone()).collect()
    }

    fn fresnel(&self) -> &str {
        &self.0.fresnel
    }

    /// Texels of a table, its axes and then its channels.
    fn values<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let table = self.table(name).map_err(|fault| fault.raise(py))?;
        let axes = table.axes.iter().map(|axis| axis.count as usize);
        let shape: Vec<usize> = axes.chain([table.channels.len()]).collect();
        shaped(py, table.data.clone(), &shape)
    }

    /// Of each axis of a table its name, its spacing and the values at texel centres.
    fn axes<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyList>> {
        let table = self.table(name).map_err(|fault| fault.raise(py))?;
        let list = PyList::empty(py);
        for axis in &table.axes {
            let dict = PyDict::new(py);
            let plain = axis.unnamed();
            let values: Vec<f64> = (0..axis.count).map(|ix| plain.value_at(ix)).collect();
            dict.set_item("name", &axis.name)?;
            dict.set_item("spacing", axis.spacing.name())?;
            dict.set_item("values", frozen(py, values)?)?;
            list.append(dict)?;
        }
        Ok(list)
    }

    fn channels(&self, py: Python<'_>, name: &str) -> PyResult<Vec<String>> {
        let table = self.table(name).map_err(|fault| fault.raise(py))?;
        Ok(table.channels.clone())
    }
}
