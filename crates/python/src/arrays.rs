//! Arrays: what Python may look at and not change, and what was computed for it alone.

use numpy::ndarray::Dimension;
use numpy::{Element, IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray};
use pyo3::prelude::*;

use crate::fault::{Fault, Outcome};

/// `data` as an array of its own memory, not writable.
pub fn frozen<T: Element>(py: Python<'_>, data: Vec<T>) -> PyResult<Bound<'_, PyArray1<T>>> {
    let array = data.into_pyarray(py);
    // Nobody else has seen it.
    Ok(array
        .try_readwrite()?
        .make_nonwriteable()
        .as_any()
        .clone()
        .cast_into()?)
}

/// `data` as an array of this shape, of its own memory, not writable.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    frozen(py, data)?.reshape(shape.to_vec())
}

/// `data`, made for whoever asked and no one else, as an array of this shape that may be written to.
pub fn fresh<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    data.into_pyarray(py).reshape(shape.to_vec())
}

/// All values of an array, which the package has made contiguous.
pub fn values<'a, T: Element, D: Dimension>(
    array: &'a PyReadonlyArray<'_, T, D>,
) -> Outcome<&'a [T]> {
    array
        .as_slice()
        .map_err(|_| Fault::value("an array is not contiguous"))
}

/// Rows of `N` values.
pub fn rows<T: Element + Copy, const N: usize>(
    array: &PyReadonlyArray<'_, T, numpy::Ix2>,
) -> Outcome<Vec<[T; N]>> {
    let (rows, rest) = values(array)?.as_chunks::<N>();
    match rest.is_empty() {
        true => Ok(rows.to_vec()),
        false => Err(Fault::value(format!("rows of {N} values are wanted"))),
    }
}
