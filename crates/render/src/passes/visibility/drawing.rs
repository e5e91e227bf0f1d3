//! Pictures of a list.

use super::super::resources::{StrandBuffers, compute_pass, step, submit};
use super::super::stamp::Stamp;
use super::buffers::Buffers;
use super::pipelines::group;
use super::{ListedLight, ShownProxies, Use, VisibilityPass};
use crate::gpu::Context;
use strandlight_scene::RenderError;

impl VisibilityPass {
    /// Draws the picture that was listed of `strands` among `proxies` into `sums`, one sample a pixel, as `lit`. Tells
    /// `observer` the share that is done.
    pub fn draw(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        lit: ListedLight,
        (sums, stamp): (&wgpu::Buffer, Stamp),
        observer: &mut dyn FnMut(f64),
    ) -> Result<(), RenderError> {
        let (radiance, along) = lit.points;
        self.set_kind(context, proxies, along.is_some())?;
        let n_bands = if self.is_kept { 1 } else { self.bands.len() };
        for ix in 0..n_bands {
            let rows = match self.is_kept {
                true => 0..self.extent[1],
                false => {
                    self.list_band(context, strands, proxies, ix, false, Stamp::default())?;
                    self.bands[ix].clone()
                }
            };
            self.write_layout(context, rows.clone(), Use::Draws(lit.even, lit.is_draft));
            let Some(kind) = &self.kind else {
                return Ok(());
            };
            let Buffers {
                view,
                layout,
                pixels,
                hits,
                entries,
                ..
            } = &self.buffers;
            let listed = if self.is_kept { entries } else { hits };
            let mut resources = vec![(0, view), (1, layout), (8, pixels), (10, listed)];
            resources.extend([(14, radiance), (15, sums)]);
            resources.extend(along.map(|along| (16, along)));
            if let Some(proxies) = proxies {
                let light = [(17, proxies.records), (19, proxies.light)];
                resources.extend(light);
                resources.push((18, &self.buffers.behind));
                resources.extend(proxies.meshes.map(|_| (23, &self.buffers.triangles)));
            }
            let group = group(context, &kind.resolve, &resources);
            let stamp = match [ix == 0, ix + 1 == n_bands] {
                [true, true] => stamp.clone(),
                [true, false] => stamp.clone().first(),
                [false, true] => stamp.clone().last(),
                [false, false] => Stamp::default(),
            };
            submit(context, |encoder| {
                let mut pass = compute_pass(context, encoder, stamp);
                step(
                    &mut pass,
                    &kind.resolve,
                    &group,
                    self.groups_of_pixels(&rows),
                );
            });
            if n_bands > 1 {
                self.end_band(context)?;
            }
            observer((ix + 1) as f64 / n_bands as f64);
        }
        Ok(())
    }
}
