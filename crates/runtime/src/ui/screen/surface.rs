//! The surface of a window in memory.

use std::num::NonZeroU32;
use std::sync::Arc;

use softbuffer::SoftBufferError;
use winit::window::Window;

/// What is painted in memory and shown in a window.
pub struct Surface(softbuffer::Surface<Arc<Window>, Arc<Window>>);

impl Surface {
    /// The surface of `window`.
    ///
    /// # Errors
    /// A display that takes no pictures from memory.
    pub fn open(window: &Arc<Window>) -> Result<Surface, SoftBufferError> {
        let context = softbuffer::Context::new(window.clone())?;
        Ok(Surface(softbuffer::Surface::new(&context, window.clone())?))
    }

    /// Makes it `width` and `height` pixels large.
    ///
    /// # Errors
    /// What the display says.
    pub fn resize(&mut self, [width, height]: [NonZeroU32; 2]) -> Result<(), SoftBufferError> {
        self.0.resize(width, height)
    }

    /// Shows what `paint` makes of black pixels, 0x00RRGGBB row by row.
    ///
    /// # Errors
    /// What the display says.
    pub fn present(&mut self, paint: impl FnOnce(&mut [u32])) -> Result<(), SoftBufferError> {
        let mut pixels = self.0.buffer_mut()?;
        pixels.fill(0);
        paint(&mut pixels);
        pixels.present()
    }
}
