//! The fibre's optics on the device.

use super::resources::uniform;
use crate::edit::{EditReport, HairTextures, Part};
use crate::error::RenderError;
use crate::gpu::Context;
use crate::optics::GpuOptics;
use crate::scene::PreparedScene;
use crate::tables::GpuTables;
use strandlight_scattering::closed_form::forward_table;

/// What the terms of scattering read: the hair's textures and the table C.
pub(super) struct Scattering {
    optics: GpuOptics,
    /// What [`forward_table`] answers.
    forward: wgpu::Buffer,
    tables: GpuTables,
}

impl Scattering {
    pub fn new(context: &Context, scene: &PreparedScene) -> Result<Self, RenderError> {
        let optics = GpuOptics::new(context, &[scene.hair.optics()]);
        Ok(Scattering {
            optics: optics.map_err(super::resources::failed)?,
            forward: uniform(context, "forward", &forward_table(scene.hair.averages())),
            tables: GpuTables::new(context, &scene.tables),
        })
    }

    /// Writes what an edit made anew. Answers whether a texture is another one, which puts bind
    /// groups out of date.
    pub fn update(&mut self, context: &Context, hair: &HairTextures, report: &EditReport) -> bool {
        let written = self.optics.update(context, hair.optics(), report);
        if report.is_rebuilt(Part::Averages) {
            let table = forward_table(hair.averages());
            let bytes = bytemuck::bytes_of(&table);
            context.queue.write_buffer(&self.forward, 0, bytes);
        }
        written.is_bound_anew
    }

    /// Bindings of the shading pass.
    pub fn bindings(&self) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        let view = wgpu::BindingResource::TextureView;
        vec![
            (3, self.optics.shading.as_entire_binding()),
            (11, self.tables.axes.as_entire_binding()),
            (12, view(&self.tables.c)),
            (13, view(&self.optics.tt)),
            (14, view(&self.optics.trt)),
            (15, view(&self.optics.averages)),
            (16, self.forward.as_entire_binding()),
        ]
    }
}
