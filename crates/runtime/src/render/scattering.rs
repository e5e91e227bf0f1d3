//! The fibre's optics on the device.

use super::resources::uniform;
use crate::gpu::Context;
use crate::scene::PreparedScene;
use crate::tables::GpuTables;

/// What `single_scattering` reads: the fibre and the tables.
pub(super) struct Scattering {
    fibre: wgpu::Buffer,
    tables: GpuTables,
}

impl Scattering {
    pub fn new(context: &Context, scene: &PreparedScene) -> Self {
        Scattering {
            fibre: uniform(context, "fibre", &scene.fibre),
            tables: GpuTables::new(context, &scene.tables),
        }
    }

    /// Bindings of the shading pass.
    pub fn bindings(&self) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        let mut bindings = vec![(3, self.fibre.as_entire_binding())];
        let tables = self.tables.entries(11);
        bindings.extend(
            tables
                .into_iter()
                .map(|entry| (entry.binding, entry.resource)),
        );
        bindings
    }
}
