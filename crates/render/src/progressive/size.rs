//! The size of the picture that is shown.

use super::ProgressiveRenderer;
use crate::invalidation::Inputs;
use crate::passes::parts::fitting;
use crate::passes::screen::Screen;
use crate::passes::target::Target;
use strandlight_scene::RenderError;
use strandlight_scene::budget::check_target;

impl ProgressiveRenderer {
    /// Width and height of the picture; a side of zero: nothing is drawn.
    ///
    /// # Errors
    /// As [`check_target`], sides of zero excepted; what is too large for the device. Nothing is
    /// changed then.
    pub fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size == self.size {
            return Ok(());
        }
        self.hair.begin_report();
        if size.contains(&0) {
            self.target = None;
        } else {
            check_target(size)?;
            self.check_device(size)?;
            let (context, film, ribbons) = (&self.hair.context, &self.film, &self.hair.ribbons);
            // One at a time on the device.
            self.target = None;
            let (lights, _) = self.hair.lighting.lit();
            self.target = Some(Target::new(context, film, ribbons, size, lights));
            self.next_screen = Some(Screen::new(context, size));
            self.noise.forget_target();
            self.hair.set_size(size);
            self.hair.dirty.inputs |= Inputs::VIEW;
        }
        self.size = size;
        self.restart_picture();
        Ok(())
    }

    /// The size for [`ProgressiveRenderer::set_size`] that shows pictures of `size`: that itself,
    /// or the largest of the same shape, about.
    pub fn fitting(&self, size: [u32; 2]) -> [u32; 2] {
        fitting(size, &self.hair.context.device.limits())
    }

    /// Refuses pictures that the device is too small for.
    fn check_device(&self, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        let limits = self.hair.context.device.limits();
        let most = limits.max_texture_dimension_2d;
        if width.max(height) > most {
            return Err(RenderError::AdapterSize {
                width,
                height,
                most,
            });
        }
        let limit = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        let bytes = 16 * u64::from(width) * u64::from(height);
        if bytes > limit {
            return Err(RenderError::TooLarge {
                what: format!("a picture of {width}x{height}"),
                bytes,
                limit,
            });
        }
        Ok(())
    }
}
