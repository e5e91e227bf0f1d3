//! What a window asks of a renderer beyond [`Backend`].

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

#[cfg(not(target_arch = "wasm32"))]
use strandlight_cpu::BackgroundRenderer;
use strandlight_cpu::InteractiveRenderer;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_formats::Background;
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::Picture;
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::{Backend, PreparedScene, RenderError};

use crate::session::Session;

/// A renderer that works bit by bit and shows what it has.
pub trait InteractiveBackend: Backend {
    /// Works on the picture for about `budget`, one step at least; or waits as long for a thread that does.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], or whatever else the device refuses.
    fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError>;

    /// Learns of the document what setters do not tell; called before every [`InteractiveBackend::advance`].
    fn follow(&mut self, _: &Session) {}

    /// Is the picture worked on while nobody calls [`InteractiveBackend::advance`]?
    fn works_alone(&self) -> bool {
        false
    }

    /// What was done since the last edit.
    fn report(&self) -> &RenderReport;

    /// The last good picture, of the size that was set last from the first picture of that size on.
    fn display(&self) -> Display<'_>;

    /// The picture of the scene as it is, of `size`, linear, without anything behind it.
    ///
    /// # Errors
    /// As [`Backend::render`].
    #[cfg(not(target_arch = "wasm32"))]
    fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError>;

    /// Draws with samples from now on, where a visibility list took their place on a device.
    #[cfg(not(target_arch = "wasm32"))]
    fn draw_with_samples(&mut self) {}

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
    Pixels(strandlight_cpu::DisplayPixels<'a>),
}

impl Display<'_> {
    /// Another number for every other picture in memory.
    pub fn version(&self) -> u64 {
        match self {
            Display::Texture(_) => 0,
            Display::Pixels(pixels) => pixels.version,
        }
    }
}

/// A [`strandlight_cpu::DisplayPixels::version`] that no other picture has, of any viewer: no renderer's own comes
/// that far.
pub fn new_version() -> u64 {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    1 << 63 | COUNT.fetch_add(1, Ordering::Relaxed)
}

impl InteractiveBackend for ProgressiveRenderer {
    fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        self.advance(budget)
    }

    fn report(&self) -> &RenderReport {
        self.report()
    }

    fn display(&self) -> Display<'_> {
        Display::Texture(self.display())
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        let scene = self.scene();
        let (exposure, background) = (scene.exposure, scene.background);
        let display = scene.display.clone();
        let samples = scene.samples;
        self.set_grade(exposure, display.clone(), Background::None);
        let drawn = self.render(size, samples, &|_| ());
        self.set_grade(exposure, display, background);
        // What is shown has its background again before anybody sees it without.
        self.advance(Duration::ZERO)?;
        Ok(drawn?.0)
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn draw_with_samples(&mut self) {
        ProgressiveRenderer::draw_with_samples(self);
    }

    fn device(&self) -> Option<&Context> {
        Some(self.context())
    }

    fn set_device(&mut self, context: &Context, scene: PreparedScene) -> Result<(), RenderError> {
        self.move_to(context, scene)
    }
}

impl InteractiveBackend for InteractiveRenderer {
    fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        self.advance(budget)
    }

    fn report(&self) -> &RenderReport {
        self.report()
    }

    fn display(&self) -> Display<'_> {
        Display::Pixels(self.display())
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        self.over_nothing(size)
    }

    fn device(&self) -> Option<&Context> {
        None
    }

    fn set_device(&mut self, _: &Context, _: PreparedScene) -> Result<(), RenderError> {
        Ok(())
    }
}

#[cfg(not(target_arch = "wasm32"))]
impl InteractiveBackend for BackgroundRenderer {
    fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        self.advance(budget)
    }

    fn works_alone(&self) -> bool {
        true
    }

    fn report(&self) -> &RenderReport {
        self.report()
    }

    fn display(&self) -> Display<'_> {
        Display::Pixels(self.display())
    }

    fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        self.over_nothing(size)
    }

    fn device(&self) -> Option<&Context> {
        None
    }

    fn set_device(&mut self, _: &Context, _: PreparedScene) -> Result<(), RenderError> {
        Ok(())
    }
}
