//! Whole pictures, read back: of the size that is shown, or of any other.

use std::time::Duration;

use super::{Drawn, Live, LiveReport};
use crate::passes::PartLimits;
use crate::passes::parts::{self, Tile};
use crate::passes::resources::read_back;
use crate::passes::target::Target;
use strandlight_scene::RenderError;
use strandlight_scene::budget::check_frame;
use strandlight_scene::picture::Picture;

impl Live {
    /// Draws `samples` a pixel to the end and reads the picture back: linear, as
    /// [`Renderer::render`](crate::Renderer::render) answers it.
    ///
    /// # Errors
    /// As [`check_frame`], and as [`Live::advance`].
    pub fn finish(&mut self, samples: u32) -> Result<Picture, RenderError> {
        check_frame(self.size, samples)?;
        let [width, height] = self.size;
        let rgba = self.finished(samples)?;
        Ok(Picture {
            width,
            height,
            rgba,
        })
    }

    /// A whole picture of any `size`, as [`Live::finish`] answers it; tile by tile where the device
    /// draws none so large at once. What is shown keeps its size.
    ///
    /// # Errors
    /// As [`Live::finish`].
    pub fn still(&mut self, size: [u32; 2], samples: u32) -> Result<Picture, RenderError> {
        check_frame(size, samples)?;
        let tiles = parts::tiles(size, &self.context.device.limits(), &self.parts);
        let before = self.size;
        let picture = match tiles.len() {
            1 => self.set_size(size).and_then(|()| self.finish(samples)),
            _ => self.tiled(size, &tiles, samples),
        };
        // Going back to the shown size starts another report.
        self.still_report = self.report.clone();
        self.set_size(before)?;
        picture
    }

    /// What the last [`Live::still`] did.
    pub fn still_report(&self) -> &LiveReport {
        &self.still_report
    }

    /// Draws in parts no larger than `limits`.
    #[doc(hidden)]
    pub fn set_parts(&mut self, limits: PartLimits) {
        self.parts = limits;
        self.picture = Drawn::default();
        self.noise.restart();
    }

    /// A picture of `tiles`; the light on the strands is found once for all of them. Leaves what is
    /// shown without a size.
    fn tiled(
        &mut self,
        size: [u32; 2],
        tiles: &[Tile],
        samples: u32,
    ) -> Result<Picture, RenderError> {
        let [width, height] = size;
        let mut rgba = vec![[0.0; 4]; width as usize * height as usize];
        self.set_size([0, 0])?;
        self.scene.size = size;
        self.wanted.view = true;
        let drawn = tiles.iter().try_for_each(|tile| {
            let (context, draw, ribbons) = (&self.context, &self.draw, &self.ribbons);
            let kept = self.target.take();
            self.target = kept.filter(|target| target.size() == tile.extent);
            if self.target.is_none() {
                let (lights, _) = self.lighting.lit();
                self.target = Some(Target::new(context, draw, ribbons, tile.extent, lights));
                self.noise.forget_target();
            }
            self.tile = Some(*tile);
            self.picture = Drawn::default();
            self.noise.restart();
            tile.place(&self.finished(samples)?, width, &mut rgba);
            Ok(())
        });
        (self.tile, self.target) = (None, None);
        self.noise.forget_target();
        drawn.map(|()| Picture {
            width,
            height,
            rgba,
        })
    }

    /// The pixels of the target, with `samples` each.
    fn finished(&mut self, samples: u32) -> Result<Vec<[f32; 4]>, RenderError> {
        let before = self.scene.samples;
        self.set_samples(samples);
        // Nobody sees it.
        self.has_first_look = false;
        while !self.advance(Duration::from_secs(1))?.is_done {}
        let [width, height] = self.size;
        let target = self.target.as_ref();
        let target = target.ok_or(RenderError::Size { width, height })?;
        let pixels = read_back(&self.context, "picture", target.picture())?;
        self.set_samples(before);
        Ok(pixels)
    }
}
