//! What a window asks of a renderer beyond [`Backend`].

use std::time::Duration;

use strandlight_cpu::InteractiveRenderer;
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_scene::interactive::{Progress, RenderReport};
use strandlight_scene::{Backend, PreparedScene, RenderError};

/// A renderer that works bit by bit and shows what it has.
pub trait InteractiveBackend: Backend {
    /// Works on the picture for about `budget`, one step at least.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], or whatever else the device refuses.
    fn advance(&mut self, budget: Duration) -> Result<Progress, RenderError>;

    /// What was done since the last edit.
    fn report(&self) -> &RenderReport;

    /// The last good picture, of the size that was set last from the first picture of that size on.
    fn display(&self) -> Display<'_>;

    /// The device that draws; none on the CPU.
    fn device(&self) -> Option<&Context>;

    /// Puts `scene` on another device. The CPU needs none and keeps its scene.
    ///
    /// # Errors
    /// Whatever the device refuses.
    fn set_device(&mut self, context: &Context, scene: PreparedScene) -> Result<(), RenderError>;
}

/// A picture as a screen shows it: sRGB times alpha.
#[derive(Clone, Copy, Debug)]
pub enum Display<'a> {
    /// On the device, `rgba8unorm`.
    Texture(&'a wgpu::TextureView),
    /// In memory.
    Pixels(strandlight_cpu::Display<'a>),
}

impl InteractiveBackend for ProgressiveRenderer {
    fn advance(&mut self, budget: Duration) -> Result<Progress, RenderError> {
        self.advance(budget)
    }

    fn report(&self) -> &RenderReport {
        self.report()
    }

    fn display(&self) -> Display<'_> {
        Display::Texture(self.display())
    }

    fn device(&self) -> Option<&Context> {
        Some(self.context())
    }

    fn set_device(&mut self, context: &Context, scene: PreparedScene) -> Result<(), RenderError> {
        *self = ProgressiveRenderer::new(context, scene)?;
        Ok(())
    }
}

impl InteractiveBackend for InteractiveRenderer {
    fn advance(&mut self, budget: Duration) -> Result<Progress, RenderError> {
        self.advance(budget)
    }

    fn report(&self) -> &RenderReport {
        self.report()
    }

    fn display(&self) -> Display<'_> {
        Display::Pixels(self.display())
    }

    fn device(&self) -> Option<&Context> {
        None
    }

    fn set_device(&mut self, _: &Context, _: PreparedScene) -> Result<(), RenderError> {
        Ok(())
    }
}
