//! What pictures of the renderer's own are drawn and developed with, besides the strands.

use super::behind::Behind;
use super::draw::Ribbons;
use super::lighting::Lighting;
use super::proxies::DrawnProxies;
use super::resources::{compute, shader};
use crate::gpu::Context;
use strandlight_scene::{PreparedScene, RenderError};

/// Side of the viewport in pixels, with what is drawn in its middle: a power of two, so that
/// corners come out the same whatever it is. Software devices slow down wherever a triangle is
/// clipped; a device with smaller textures gets a smaller one.
pub(super) fn viewport_side(context: &Context) -> f32 {
    let most = context.device.limits().max_texture_dimension_2d;
    f32::from(
        1_u16
            << most
                .clamp(1, strandlight_scene::budget::MAX_TARGET_SIDE)
                .ilog2(),
    )
}

/// Draws proxies, and sums up and composes the samples.
pub(crate) struct Film {
    /// Drawn before the strands, if there are any.
    proxies: Option<DrawnProxies>,
    viewport: f32,
    pub(super) accumulate: wgpu::ComputePipeline,
    pub(super) composite: wgpu::ComputePipeline,
    /// The map behind the hair, while it is seen.
    pub(super) behind: Option<Behind>,
}

impl Film {
    /// A film without proxies.
    pub fn new(context: &Context) -> Result<Self, RenderError> {
        Ok(Film {
            proxies: None,
            viewport: viewport_side(context),
            accumulate: compute(context, &shader(context, "pass/accumulate")?, "accumulate"),
            composite: compute(context, &shader(context, "pass/composite")?, "composite"),
            behind: None,
        })
    }

    /// Takes the proxies as `lighting` has them.
    pub fn set_proxies(&mut self, context: &Context, ribbons: &Ribbons, lighting: &Lighting) {
        let proxies = lighting.proxies();
        let current = (ribbons.view(), ribbons.current());
        self.proxies = proxies.map(|proxies| proxies.drawn(context, current.0, current.1));
    }

    /// Takes the map that `scene` shows behind its hair, or gives it up.
    ///
    /// # Errors
    /// A map wider than the adapter's textures; none is there then.
    pub fn set_behind(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<(), RenderError> {
        self.behind = Behind::renewed(self.behind.take(), context, scene)?;
        Ok(())
    }

    /// Bytes of that map on the device.
    pub fn behind_bytes(&self) -> u64 {
        self.behind.as_ref().map_or(0, Behind::bytes)
    }

    /// Draws the proxies into a picture of `size`, lit by the radiance buffer `radiance`, and sets
    /// the viewport of the strands.
    pub fn draw(&self, pass: &mut wgpu::RenderPass, size: [u32; 2], radiance: usize) {
        if let Some(proxies) = &self.proxies {
            proxies.draw(pass, size, radiance);
        }
        let [left, top] = size.map(|n| 0.5 * (n as f32 - self.viewport));
        pass.set_viewport(left, top, self.viewport, self.viewport, 0.0, 1.0);
    }
}
