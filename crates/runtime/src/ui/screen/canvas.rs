//! The canvas of a page as a surface in memory.

use std::num::NonZeroU32;
use std::sync::Arc;

use wasm_bindgen::{Clamped, JsCast, JsValue};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, ImageData};
use winit::platform::web::WindowExtWebSys;
use winit::window::Window;

/// Why there is no picture in the canvas, in words.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct CanvasError(String);

/// What is painted in memory and put into a canvas.
pub struct Surface {
    canvas: HtmlCanvasElement,
    context: CanvasRenderingContext2d,
    /// 0x00RRGGBB.
    pixels: Vec<u32>,
    /// The same as the canvas takes it.
    rgba: Vec<[u8; 4]>,
}

fn refused(error: JsValue) -> CanvasError {
    CanvasError(crate::page::words(&error))
}

impl Surface {
    /// The canvas of `window`.
    ///
    /// # Errors
    /// One that another kind of pictures was asked for before.
    pub fn open(window: &Arc<Window>) -> Result<Surface, CanvasError> {
        let nothing = || CanvasError("the canvas takes no pictures from memory".to_owned());
        let canvas = window.canvas().ok_or_else(nothing)?;
        let context = canvas.get_context("2d").map_err(refused)?;
        let context = context.ok_or_else(nothing)?;
        Ok(Surface {
            context: context.dyn_into().map_err(|_| nothing())?,
            canvas,
            pixels: Vec::new(),
            rgba: Vec::new(),
        })
    }

    /// Makes the canvas `width` and `height` pixels large.
    ///
    /// # Errors
    /// None.
    pub fn resize(&mut self, [width, height]: [NonZeroU32; 2]) -> Result<(), CanvasError> {
        self.canvas.set_width(width.get());
        self.canvas.set_height(height.get());
        let n_pixels = width.get() as usize * height.get() as usize;
        self.pixels.resize(n_pixels, 0);
        self.rgba.resize(n_pixels, [0; 4]);
        Ok(())
    }

    /// Shows what `paint` makes of black pixels, 0x00RRGGBB row by row.
    ///
    /// # Errors
    /// What the browser says.
    pub fn present(&mut self, paint: impl FnOnce(&mut [u32])) -> Result<(), CanvasError> {
        self.pixels.fill(0);
        paint(&mut self.pixels);
        for (rgba, pixel) in self.rgba.iter_mut().zip(&self.pixels) {
            *rgba = (pixel.swap_bytes() >> 8 | 0xff00_0000).to_le_bytes();
        }
        let bytes = Clamped(self.rgba.as_flattened());
        let image = ImageData::new_with_u8_clamped_array(bytes, self.canvas.width());
        let image = image.map_err(refused)?;
        self.context
            .put_image_data(&image, 0.0, 0.0)
            .map_err(refused)
    }
}
