//! The tables that methods are compared on.

use strandlight_bake::tables::bake_c_and_h;
use strandlight_lab::bench::MethodTables;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::progress::Progress;

use crate::cli::Failure;

/// The tables of all methods; those of the paper are baked now, some 0.3 s of two cores.
pub fn method_tables() -> Result<MethodTables, Failure> {
    let schlick = bake_c_and_h(Fresnel::Schlick, &Progress::silent());
    MethodTables::new(&schlick).map_err(Failure::input)
}
