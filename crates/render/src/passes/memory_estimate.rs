//! What a scene needs on a device, known before anything is made there.

use super::behind::seen;
use super::draw;
use super::multiple::multiple_bytes;
use super::painted::paint_bytes;
use super::pieces;
use super::shadows::STEP_BYTES;
use super::volume::AXIS_SHARES_BYTES;
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scene::RenderError;
use strandlight_scene::budget::LIGHT_BATCH;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::shadow_maps::{BYTES_ALONG, SHADOW_SIDE};
use strandlight_scene::volume::{CHANNELS, Grid};

/// One of the things that a scene needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DevicePart {
    /// What it is, in words.
    pub name: &'static str,
    /// Bytes of all its buffers and textures.
    pub bytes: u64,
    /// Bytes of the largest buffer, which is bound as a whole.
    pub largest: u64,
}

/// What a scene needs on a device, in [`ProgressiveRenderer`](crate::ProgressiveRenderer); a
/// [`ProgressiveRenderer::render_to_image`](crate::ProgressiveRenderer::render_to_image) needs one buffer of radiance less and nothing for the screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceBytes {
    /// By use.
    pub parts: Vec<DevicePart>,
}

impl DeviceBytes {
    /// What `scene` needs on a device for pictures of `size`.
    pub fn new(scene: &PreparedScene, size: [u32; 2]) -> DeviceBytes {
        let n_points = scene.strands.points.len() as u64;
        let n_segments = scene.strands.segments.len() as u64;
        let n_lights = scene.lights.len();
        let grid = Grid::around(&scene.strands);
        let n_voxels = grid.n_voxels() as u64;
        let a_light = n_voxels * size_of::<PackedRecord>() as u64;
        let in_batch = n_lights.min(LIGHT_BATCH) as u64;
        let records = match a_light * n_lights as u64 {
            all if all <= scene.record_budget => all,
            _ => a_light * in_batch,
        };
        let [x, y, z] = grid.dims.map(u64::from);
        let leaving = 2 * 16 * (x * y).max(y * z).max(z * x) * in_batch;
        let plan = scene.shadow_plan();
        let map = |side: u32| u64::from(side).pow(2) * 4;
        let maps = plan.views.iter().map(|view| map(view.side));
        let visibility = plan.n_words(n_points as usize) as u64 * 4;
        let answers = plan.n_answer_words(n_points as usize) as u64 * 4;
        let map = match plan.views.is_empty() {
            true => 0,
            false => maps.fold(map(SHADOW_SIDE), u64::max),
        };
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let corners = n_segments.min(u64::from(draw::SEGMENT_CHUNK)) * 24;
        let part = |name, bytes: &[u64]| DevicePart {
            name,
            bytes: bytes.iter().sum(),
            largest: bytes.iter().copied().max().unwrap_or(0),
        };
        let of_points = 16 * n_points;
        let sums = n_voxels * u64::from(CHANNELS) * 8;
        let along = match (0..plan.n_slots).all(|slot| plan.maps_along_segments(slot).is_empty()) {
            true => 0,
            false => BYTES_ALONG as u64 * n_points,
        };
        let radiance = part(
            "the light of the points",
            &[of_points, of_points, along, along],
        );
        let mut ribbons = part("the strands on the screen", &[of_points; 3]);
        ribbons.bytes += 24 * n_segments;
        ribbons.largest = ribbons.largest.max(corners);
        let view = view_uniform(&scene.camera, &scene.strands, size, 1.0);
        if scene.is_close_up(&view) {
            let pieces = pieces::bytes(n_segments);
            ribbons.bytes += pieces;
            ribbons.largest = ribbons.largest.max(pieces);
        }
        let mut volume = part("the shadow volume", &[sums, 32 * n_voxels]);
        volume.bytes += AXIS_SHARES_BYTES;
        let mut kept = part("the lights' records", &[a_light * in_batch]);
        kept.bytes = records + leaving + STEP_BYTES;
        let mut picture = part("the picture", &[16 * pixels; 2]);
        // Four samples of half floats and depth; the screen's eight bits; every 13th pixel twice.
        picture.bytes += pixels * (4 * (8 + 4) + 4) + 16 * pixels / 13;
        let mut bytes = DeviceBytes {
            parts: vec![
                part(
                    "the hair",
                    &[of_points, of_points, of_points, 4 * n_segments],
                ),
                volume,
                kept,
                part("shadow maps", &[visibility, answers, map, 4 * n_points]),
                radiance,
                ribbons,
                picture,
            ],
        };
        if let Some(source) = scene.multiple() {
            let [textures, rows] = multiple_bytes(source);
            bytes.parts.push(DevicePart {
                name: "the tables of multiple scattering",
                bytes: textures + rows + source.bytes() as u64,
                largest: rows,
            });
        }
        if let Some(behind) = seen(scene) {
            bytes.parts.push(DevicePart {
                name: "the map behind the hair",
                bytes: size_of_val(behind.map.texels()) as u64,
                largest: 0,
            });
        }
        if scene.paint().is_some() {
            // Textures, which no limit of buffers is about.
            bytes.parts.push(DevicePart {
                name: "the paint",
                bytes: paint_bytes(n_points) + scene.hair.optics().painted.bytes(),
                largest: 0,
            });
        }
        bytes
    }

    /// Bytes of all.
    pub fn total(&self) -> u64 {
        self.parts.iter().map(|part| part.bytes).sum()
    }

    /// `scene` as it fits a device of `limits`, in `budget` bytes, with pictures of `size`: where the records of all lights take too
    /// much, every shading finds them again, batch by batch.
    ///
    /// # Errors
    /// As [`DeviceBytes::check`].
    pub(crate) fn fit(
        mut scene: PreparedScene,
        size: [u32; 2],
        limits: &wgpu::Limits,
        budget: u64,
    ) -> Result<PreparedScene, RenderError> {
        let bytes = DeviceBytes::new(&scene, size);
        if bytes.check(limits, budget).is_err() {
            scene.record_budget = 0;
            DeviceBytes::new(&scene, size).check(limits, budget)?;
        }
        Ok(scene)
    }

    /// Refuses what does not fit a device of `limits`, or all of it into `budget` bytes.
    ///
    /// # Errors
    /// The part with the largest buffer beyond the limits, or the largest part.
    pub fn check(&self, limits: &wgpu::Limits, budget: u64) -> Result<(), RenderError> {
        let limit = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        for part in &self.parts {
            if part.largest > limit {
                return Err(RenderError::TooLarge {
                    what: format!("the device's buffers for {}", part.name),
                    bytes: part.largest,
                    limit,
                });
            }
        }
        let largest = self.parts.iter().max_by_key(|part| part.bytes);
        match largest {
            Some(part) if self.total() > budget => Err(RenderError::TooLarge {
                what: format!(
                    "the scene on the device, most of it ({} bytes) for {}",
                    part.bytes, part.name
                ),
                bytes: self.total(),
                limit: budget,
            }),
            _ => Ok(()),
        }
    }
}
