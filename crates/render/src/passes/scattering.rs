//! The fibre's optics on the device.

use std::ops::Range;

use super::multiple::{Fill, Multiple};
use super::painted::Painted;
use super::resources::uniform;
use super::stamp::Stamp;
use crate::gpu::Context;
use crate::gpu_optics::GpuOptics;
use crate::gpu_tables::GpuTables;
use strandlight_scattering::closed_form::{ForwardTable, HairLayers, forward_table, plain_layers};
use strandlight_scene::RenderError;
use strandlight_scene::material::{EditReport, HairMaterial, Part};
use strandlight_scene::paint::PaintedPoint;
use strandlight_scene::scene::PreparedScene;

/// Bindings that single scattering reads: fibre, paint, tables and lobes.
const SINGLE_BINDINGS: [u32; 6] = [3, 11, 12, 13, 14, 20];

/// What the terms of scattering read: the hair's textures and the table C.
pub(super) struct Scattering {
    optics: GpuOptics,
    /// [`HairAround`].
    around: wgpu::Buffer,
    tables: GpuTables,
    /// In the place of the fibre's optics where hair is painted.
    painted: Option<Painted>,
    /// Where tables stand for multiple scattering.
    multiple: Option<Multiple>,
    /// What fills them, once they were needed.
    fill: Option<Fill>,
}

/// What the hair around a point does to light, byte for byte the struct of `shaders/pass/shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct HairAround {
    /// In front of the point.
    forward: ForwardTable,
    /// Behind it.
    layers: HairLayers,
}

strandlight_scattering::mirrors! {
    HairAround as "HairAround" in "pass/shade" { forward, layers }
}

impl HairAround {
    fn of(hair: &HairMaterial) -> HairAround {
        HairAround {
            forward: forward_table(hair.averages()),
            layers: plain_layers(hair.averages()),
        }
    }
}

impl Scattering {
    pub fn new(context: &Context, scene: &PreparedScene) -> Result<Self, RenderError> {
        let optics = GpuOptics::new(context, &[scene.hair.optics()]);
        Ok(Scattering {
            optics: optics.map_err(super::resources::failed)?,
            around: uniform(context, "hair around", &HairAround::of(&scene.hair)),
            tables: GpuTables::new(context, &scene.tables),
            painted: scene
                .paint()
                .map(|points| Painted::new(context, &scene.hair, points)),
            multiple: None,
            fill: None,
        })
    }

    /// Makes room for the tables of multiple scattering, or writes what they are filled from if
    /// `report` says that it is another; takes them off where they do not serve the scene. Answers
    /// whether a texture is another one, which puts bind groups out of date.
    pub fn set_multiple(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        report: Option<&EditReport>,
    ) -> Result<bool, RenderError> {
        let Some(source) = scene.multiple() else {
            return Ok(self.multiple.take().is_some());
        };
        match &mut self.multiple {
            None => {
                if self.fill.is_none() {
                    self.fill = Some(Fill::new(context)?);
                }
                self.multiple = Some(Multiple::new(context, source));
                Ok(true)
            }
            Some(multiple) => {
                let is_other = report.is_some_and(|report| report.is_rebuilt(Part::Multiple));
                Ok(is_other && multiple.update(context, source))
            }
        }
    }

    /// Do the tables of multiple scattering have to be filled?
    pub fn has_stale_tables(&self) -> bool {
        self.multiple.as_ref().is_some_and(Multiple::is_stale)
    }

    /// Fills the tables of multiple scattering.
    pub fn fill_tables(&mut self, context: &Context, stamp: Stamp) {
        if let (Some(multiple), Some(fill)) = (&mut self.multiple, &self.fill) {
            multiple.fill(context, fill, &self.optics, stamp);
        }
    }

    /// Bytes of the tables of multiple scattering.
    pub fn table_bytes(&self) -> u64 {
        self.multiple.as_ref().map_or(0, Multiple::bytes)
    }

    /// Writes the paint of `changed` points. Answers whether a texture is another one.
    pub fn set_paint(
        &mut self,
        context: &Context,
        points: Option<&[PaintedPoint]>,
        hair: &HairMaterial,
        changed: Range<usize>,
    ) -> bool {
        let Some(points) = points else {
            return self.painted.take().is_some();
        };
        match &mut self.painted {
            Some(painted) => {
                painted.set_paint(context, points, changed);
                false
            }
            None => {
                self.painted = Some(Painted::new(context, hair, points));
                true
            }
        }
    }

    /// Writes what an edit recomputed. Answers whether a texture is another one, which puts bind
    /// groups out of date.
    pub fn update(&mut self, context: &Context, hair: &HairMaterial, report: &EditReport) -> bool {
        let written = self.optics.update(context, hair.optics(), report);
        if let Some(multiple) = self.multiple.as_mut().filter(|_| written.needs_rebind) {
            multiple.forget_groups();
        }
        if report.is_rebuilt(Part::Averages) {
            let around = HairAround::of(hair);
            context.write(&self.around, 0, bytemuck::bytes_of(&around));
        }
        let painted = self.painted.as_mut();
        let is_other = painted.is_some_and(|painted| painted.update(context, hair, report));
        written.needs_rebind || is_other
    }

    /// Bindings of single scattering alone.
    pub fn single_bindings(&self) -> impl Iterator<Item = (u32, wgpu::BindingResource<'_>)> {
        let bindings = self.bindings().into_iter();
        bindings.filter(|(binding, _)| SINGLE_BINDINGS.contains(binding))
    }

    /// Bindings of the shading pass.
    pub fn bindings(&self) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        let view = wgpu::BindingResource::TextureView;
        let mut bindings = vec![
            (11, self.tables.axes.as_entire_binding()),
            (12, view(&self.tables.c)),
        ];
        if let Some(painted) = &self.painted {
            bindings.extend(painted.bindings());
            return bindings;
        }
        bindings.extend([
            (3, self.optics.shading.as_entire_binding()),
            (13, view(&self.optics.tt)),
            (14, view(&self.optics.trt)),
            (16, self.around.as_entire_binding()),
        ]);
        match &self.multiple {
            Some(multiple) => bindings.extend(multiple.bindings()),
            None => bindings.push((15, view(&self.optics.averages))),
        }
        bindings
    }
}
