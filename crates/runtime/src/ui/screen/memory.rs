//! A window's surface in memory, for machines without a GPU.

use std::num::NonZeroU32;
use std::sync::Arc;

use winit::window::Window;

#[cfg(target_arch = "wasm32")]
use super::canvas::{CanvasError as SurfaceError, Surface};

use super::painted::Painted;
use super::painter::{Frame, Painter};
#[cfg(not(target_arch = "wasm32"))]
use super::surface::Surface;
use crate::choice::CpuReason;
use crate::interactive::Display;
#[cfg(not(target_arch = "wasm32"))]
use softbuffer::SoftBufferError as SurfaceError;

/// Longest side of a texture.
pub const MAX_SIDE: u32 = 16384;

/// The picture among egui's textures.
const PICTURE: egui::TextureId = egui::TextureId::User(0);

/// A surface, and what paints on it.
pub struct MemoryScreen {
    window: Arc<Window>,
    surface: Surface,
    size: Option<[NonZeroU32; 2]>,
    painter: Painter,
    /// Version of the picture that the painter has.
    version: Option<u64>,
    reason: CpuReason,
}

impl MemoryScreen {
    /// Opens the surface of `window`, which is painted by the CPU for `reason`.
    ///
    /// # Errors
    /// A display that takes no pictures from memory.
    pub fn open(window: Arc<Window>, reason: CpuReason) -> Result<MemoryScreen, SurfaceError> {
        Ok(MemoryScreen {
            surface: Surface::open(&window)?,
            window,
            size: None,
            painter: Painter::default(),
            version: None,
            reason,
        })
    }

    /// Why there is no device.
    pub fn reason(&self) -> &CpuReason {
        &self.reason
    }

    /// The texture that egui draws the picture by.
    pub fn picture(&mut self, display: Display<'_>) -> egui::TextureId {
        // Textures are a device's, and there is none.
        if let Display::Pixels(picture) = display
            && self.version != Some(picture.version)
        {
            self.painter
                .set_picture(PICTURE, picture.size, picture.pixels);
            self.version = Some(picture.version);
        }
        PICTURE
    }

    /// Puts a frame of egui on screen.
    pub fn paint(
        &mut self,
        egui: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        pixels_per_point: f32,
        textures: &mut egui::TexturesDelta,
    ) -> Painted {
        for (id, deltas) in textures.set.drain() {
            for delta in deltas {
                self.painter.set(id, &delta);
            }
        }
        let jobs = egui.tessellate(shapes, pixels_per_point);
        let painted = self.present(&jobs, pixels_per_point);
        for id in textures.free.drain() {
            self.painter.free(id);
        }
        // A display that does not take a frame may take the next.
        painted.unwrap_or(Painted::Hidden)
    }

    fn present(
        &mut self,
        jobs: &[egui::ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<Painted, SurfaceError> {
        let size = self.window.inner_size();
        let sides = [size.width, size.height].map(|side| NonZeroU32::new(side.min(MAX_SIDE)));
        let [Some(width), Some(height)] = sides else {
            return Ok(Painted::Hidden);
        };
        if self.size != Some([width, height]) {
            self.surface.resize([width, height])?;
            self.size = Some([width, height]);
        }
        let (painter, window) = (&self.painter, &self.window);
        self.surface.present(|pixels| {
            let mut frame = Frame {
                pixels,
                size: [width.get() as usize, height.get() as usize],
            };
            painter.paint(&mut frame, jobs, pixels_per_point);
            window.pre_present_notify();
        })?;
        Ok(Painted::Presented)
    }
}
