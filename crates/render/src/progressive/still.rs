//! Whole pictures, read back: of the size that is shown, or of any other.

use std::time::Duration;

use super::ProgressiveRenderer;
use crate::hair_renderer::ListDrawn;
use crate::invalidation::Inputs;
use crate::passes::PartLimits;
use crate::passes::parts::{self, Tile};
use crate::passes::resources::{failed, guarded, read_back};
use crate::passes::target::Target;
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scene::Backend;
use strandlight_scene::RenderError;
use strandlight_scene::budget::{FrameError, check_frame};
use strandlight_scene::camera::Camera;
use strandlight_scene::picture::Picture;
use strandlight_scene::sampling::PASS_SAMPLES;
use strandlight_scene::stats::{LIGHTING_SHARE, Observer, Stats};

impl ProgressiveRenderer {
    /// Draws `samples` a pixel to the end and reads the picture back: linear radiance.
    ///
    /// # Errors
    /// As [`check_frame`], and as [`ProgressiveRenderer::advance`].
    pub fn finish(&mut self, samples: u32) -> Result<Picture, RenderError> {
        let by_list = std::mem::take(&mut self.by_list);
        if by_list {
            self.restart_samples();
        }
        self.hair.set_draws_by_list(false);
        let picture = self.finish_observed(samples, &|_| ());
        self.by_list = by_list;
        if by_list {
            self.restart_samples();
        }
        picture
    }

    fn finish_observed(
        &mut self,
        samples: u32,
        observer: Observer,
    ) -> Result<Picture, RenderError> {
        check_frame(self.size, samples)?;
        let [width, height] = self.size;
        let rgba = self.finished(samples, observer)?;
        Ok(Picture {
            width,
            height,
            rgba,
        })
    }

    /// The scene as `camera` sees it, a whole picture of `size`; no point outside it is lit.
    /// Answers what it cost as well.
    ///
    /// # Errors
    /// As [`ProgressiveRenderer::still`].
    pub fn render_to_image(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
        samples: u32,
    ) -> Result<(Picture, Stats), RenderError> {
        check_frame(size, samples)?;
        self.hair.begin_report();
        self.shade_view_only();
        self.set_camera(*camera);
        self.render(size, samples, &|_| ())
    }

    /// What the last still cost.
    pub(super) fn stats(&self, samples: u32) -> Stats {
        let report = &self.still_report;
        let lighting = self.hair.lighting.bytes();
        let drawing = self.still_bytes;
        let bytes = |name: &str| match name {
            "voxelise" => self.hair.volume.bytes(),
            "list" => self.hair.list_bytes(),
            "draw" => drawing[0],
            "composite" => drawing[1],
            _ => lighting
                .iter()
                .find(|(stage, _)| *stage == name)
                .map_or(0, |(_, bytes)| *bytes),
        };
        let mut stats = report.frame_stats(bytes);
        // Those that are not listed were skipped as well.
        if let Some(n) = self.hair.lighting.n_listed() {
            stats.points_skipped += stats.points as u64 - u64::from(n);
        }
        if !self.was_by_list {
            stats.samples = samples;
            stats.passes = samples.div_ceil(PASS_SAMPLES);
        }
        stats
    }

    /// Radiance of every point towards `camera`: rgb, and zero. Points outside a picture of `size`
    /// are black.
    ///
    /// # Errors
    /// A size out of range, or whatever the device refuses.
    pub fn point_radiance(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
    ) -> Result<Vec<[f32; 4]>, RenderError> {
        check_frame(size, 1)?;
        self.hair.set_draws_by_list(false);
        self.hair.set_margin(0.0);
        self.set_camera(*camera);
        let before = self.hair.scene.size;
        self.hair.set_size(size);
        self.hair.dirty.inputs |= Inputs::VIEW;
        self.hair
            .lighting
            .clear(&self.hair.context, 1 - self.hair.front);
        self.hair.lighting.narrow().are_along = false;
        let lit = self.light_whole(&|_| ());
        self.hair.lighting.narrow().are_along = true;
        let scale = self.hair.front_scale.unwrap_or(1.0);
        let radiance = self.hair.lighting.radiance(self.hair.front);
        let radiance = lit.and_then(|()| read_back(&self.hair.context, "radiance", radiance));
        self.hair.set_size(before);
        // Pictures have the light of narrow lights along segments.
        self.hair.dirty.inputs |= Inputs::VIEW;
        let mut radiance: Vec<[f32; 4]> = radiance?;
        for value in radiance.iter_mut().flatten() {
            *value /= scale;
        }
        Ok(radiance)
    }

    /// Lights all points as last set, without drawing.
    fn light_whole(&mut self, observer: Observer) -> Result<(), RenderError> {
        self.waiting(|renderer| renderer.light_steps(observer))
    }

    /// Does `work` waiting for the device, as windows need not.
    fn waiting<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.hair.set_waiting(true);
        let done = work(self);
        self.hair.set_waiting(before);
        done
    }

    fn light_steps(&mut self, observer: Observer) -> Result<(), RenderError> {
        self.take_counters();
        let has_preview = std::mem::replace(&mut self.has_preview, false);
        while !self.hair.is_complete() {
            match &self.hair.job {
                None => self.begin()?,
                Some(job) => {
                    let left = job.steps.len() as f64 / job.n_steps.max(1) as f64;
                    observer(LIGHTING_SHARE * (1.0 - left));
                    self.light()?;
                }
            }
        }
        let report = &mut self.hair.report;
        self.pacer
            .flush(&self.hair.context, |(name, _, _, seconds)| {
                report.took(name, seconds);
            })?;
        self.has_preview = has_preview;
        self.hair.context.check("lighting").map_err(failed)
    }

    /// The shadow volume, two entries a voxel: (A, Qxx, Qyy, Qzz), (Qxy, Qxz, Qyz, 0), 1/cm.
    ///
    /// # Errors
    /// Whatever the device refuses.
    #[doc(hidden)]
    pub fn volume(&mut self) -> Result<Vec<[f32; 4]>, RenderError> {
        self.light_whole(&|_| ())?;
        let volume = &self.hair.volume;
        let mut voxels = read_back(&self.hair.context, "volume", volume.buffer())?;
        voxels.truncate(2 * volume.grid.n_voxels());
        Ok(voxels)
    }

    /// Packed records of the first lights, at most
    /// [`LIGHT_BATCH`](strandlight_scene::budget::LIGHT_BATCH), as `[light][voxel]`.
    ///
    /// # Errors
    /// Whatever the device refuses.
    #[doc(hidden)]
    pub fn records(&mut self) -> Result<Vec<PackedRecord>, RenderError> {
        self.light_whole(&|_| ())?;
        let hair = &self.hair;
        guarded(&hair.context, || {
            hair.lighting.first_records(&hair.context, &hair.volume)
        })
    }

    /// A whole picture of any `size`, as [`ProgressiveRenderer::finish`] answers it; tile by tile
    /// where the device draws none so large at once. What is shown keeps its size.
    ///
    /// # Errors
    /// As [`ProgressiveRenderer::finish`].
    pub fn still(&mut self, size: [u32; 2], samples: u32) -> Result<Picture, RenderError> {
        self.still_observed(size, samples, &|_| ())
    }

    pub(super) fn still_observed(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<Picture, RenderError> {
        check_frame(size, samples)?;
        let tiles = parts::tiles(size, &self.hair.context.device.limits(), &self.parts);
        let before = self.size;
        self.is_still = true;
        self.hair.set_draws_by_list(self.by_list);
        let picture = match tiles.len() {
            1 => self
                .set_size(size)
                .and_then(|()| self.finish_observed(samples, observer)),
            _ => self.tiled(size, &tiles, samples, observer),
        };
        self.is_still = false;
        // Going back to the shown size starts another report.
        self.still_report = self.hair.report.clone();
        self.still_bytes = match &self.target {
            Some(target) => [
                target.bytes() + self.hair.ribbons.bytes(),
                target.picture().size(),
            ],
            None => self.still_bytes,
        };
        self.set_size(before)?;
        picture
    }

    /// Draws in parts no larger than `limits`.
    #[doc(hidden)]
    pub fn set_parts(&mut self, limits: PartLimits) {
        self.parts = limits;
        self.hair.set_most_hits(limits.hits);
        self.restart_picture();
    }

    /// A picture of `tiles`; the light on the strands is found once for all of them. Leaves what is
    /// shown without a size.
    fn tiled(
        &mut self,
        size: [u32; 2],
        tiles: &[Tile],
        samples: u32,
        observer: Observer,
    ) -> Result<Picture, RenderError> {
        let [width, height] = size;
        let mut rgba = vec![[0.0; 4]; width as usize * height as usize];
        self.set_size([0, 0])?;
        self.hair.scene.size = size;
        self.hair.dirty.inputs |= Inputs::VIEW;
        let drawn = tiles.iter().enumerate().try_for_each(|(ix, tile)| {
            let observer = &|done: f64| {
                let drawn = (done - LIGHTING_SHARE).max(0.0) / (1.0 - LIGHTING_SHARE);
                let drawn = (ix as f64 + drawn) / tiles.len() as f64;
                observer(match ix {
                    0 if done < LIGHTING_SHARE => done,
                    _ => LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * drawn,
                });
            };
            let (context, film, ribbons) = (&self.hair.context, &self.film, &self.hair.ribbons);
            let kept = self.target.take();
            self.target = kept.filter(|target| target.size() == tile.extent);
            if self.target.is_none() {
                let (lights, _) = self.hair.lighting.lit();
                self.target = Some(Target::new(context, film, ribbons, tile.extent, lights));
                self.noise.forget_target();
            }
            self.tile = Some(*tile);
            self.restart_picture();
            tile.place(&self.finished(samples, observer)?, width, &mut rgba);
            if let Some(target) = &self.target {
                let bytes = target.bytes() + self.hair.ribbons.bytes();
                self.still_bytes = [bytes, target.picture().size()];
            }
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
    fn finished(&mut self, samples: u32, observer: Observer) -> Result<Vec<[f32; 4]>, RenderError> {
        let before = self.hair.scene.samples;
        self.set_samples(samples);
        self.has_preview = false;
        let finished = self.finish_target(observer);
        self.set_samples(before);
        finished
    }

    fn finish_target(&mut self, observer: Observer) -> Result<Vec<[f32; 4]>, RenderError> {
        self.light_whole(observer)?;
        let by_list = self.is_still && self.by_list;
        self.was_by_list = by_list && self.waiting(|renderer| renderer.finish_by_list(observer))?;
        if !self.was_by_list {
            self.picture.is_sampled = self.by_list;
            self.hair.set_draws_by_list(false);
        }
        let n_passes = self.total_samples().div_ceil(PASS_SAMPLES);
        while !self.was_by_list && !self.advance(Duration::from_secs(1))?.is_done {
            let drawn = f64::from(self.picture.passes) / f64::from(n_passes);
            observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * drawn);
        }
        self.flush()?;
        let [width, height] = self.size;
        let target = self.target.as_ref();
        let target = target.ok_or(FrameError::Size { width, height })?;
        let pixels = read_back(&self.hair.context, "picture", target.picture())?;
        self.take_counters();
        self.hair.take_seen();
        Ok(pixels)
    }

    /// Draws the target, whose light is there, from the visibility list. Answers whether there is one.
    fn finish_by_list(&mut self, observer: Observer) -> Result<bool, RenderError> {
        let mut observer = |done| observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
        let drawn = self.resolve(false, &mut observer)?;
        let is_drawn = matches!(drawn, ListDrawn::Of { .. });
        if is_drawn {
            self.compose(1)?;
        }
        Ok(is_drawn)
    }
}
