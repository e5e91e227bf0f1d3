//! Strandlight for Python: the module `strandlight._native`, which the package around it
//! (`python/strandlight`) makes the interface. Arrays arrive here with the type and layout that the
//! signatures name; the package sees to that.

mod arrays;
mod fault;
mod groom;
mod groom_file;
mod lights;
mod picture;
mod probe;
mod scene;
mod tables;
mod work;

use pyo3::prelude::*;

/// What is compiled.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<lights::LightSet>()?;
    module.add_class::<groom::Groom>()?;
    module.add_class::<tables::Tables>()?;
    module.add_function(wrap_pyfunction!(lights::fit_lights, module)?)?;
    module.add_function(wrap_pyfunction!(probe::probe, module)?)?;
    module.add_function(wrap_pyfunction!(scene::render, module)?)?;
    module.add_function(wrap_pyfunction!(picture::to_srgb8, module)?)?;
    module.add_function(wrap_pyfunction!(picture::picture_file, module)?)?;
    module.add_function(wrap_pyfunction!(picture::write_file, module)?)?;
    Ok(())
}
