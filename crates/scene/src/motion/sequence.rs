//! An animation cache: one groom a frame, read when it is needed.

use std::path::{Path, PathBuf};

use strandlight_formats::{MotionSection, Scene, VariationSection};

use crate::error::SceneError;
use crate::files::Files;
use crate::strands::Strands;
use crate::variation::ShapeVariation;

/// The frames of a scene's motion. The two that the last time lay between are kept.
#[derive(Clone, Debug)]
pub struct Sequence {
    frames: Vec<PathBuf>,
    fps: f64,
    files: Files,
    /// By number of the frame: points of the groom.
    kept: Vec<(usize, Vec<[f32; 3]>)>,
    offsets: Option<Vec<u32>>,
    groom: PathBuf,
    variation: Box<VariationSection>,
    /// Bends the frames; known with `offsets`.
    shape: Option<Box<ShapeVariation>>,
}

impl Sequence {
    pub(super) fn new(scene: &Scene, files: &Files) -> Sequence {
        let fps = scene.motion.as_ref().and_then(|motion| motion.fps);
        Sequence {
            frames: scene.frame_paths(),
            fps: fps.unwrap_or(MotionSection::DEFAULT_FPS),
            files: files.clone(),
            kept: Vec::new(),
            offsets: None,
            groom: scene.groom_path(),
            variation: Box::new(scene.variation.clone()),
            shape: None,
        }
    }

    /// [`Strands::points`] at a time in seconds: straight between the frames around it, in the
    /// groom's own points, in the pieces of `rest`. Before the first frame and after the last the
    /// hair stays as it is there.
    ///
    /// # Errors
    /// A frame that cannot be read or has other strands, by name.
    pub fn points_at(&mut self, rest: &Strands, seconds: f64) -> Result<Vec<[f32; 4]>, SceneError> {
        let (wanted, fraction) = self.around(seconds);
        self.kept.retain(|(frame, _)| wanted.contains(frame));
        for frame in wanted {
            self.read(frame, rest)?;
        }
        let points = |frame| {
            let found = self.kept.iter().find(|(kept, _)| *kept == frame);
            found.map_or(&[][..], |(_, points)| points)
        };
        let (a, b) = (points(wanted[0]), points(wanted[1]));
        let resampled = |points: &[[f32; 3]]| match &self.shape {
            Some(shape) => rest.resampled(&shape.bend(points)?),
            None => rest.resampled(points),
        };
        if fraction == 0.0 {
            return resampled(a);
        }
        let mix = |(a, b): (&[f32; 3], &[f32; 3])| {
            [0, 1, 2].map(|axis: usize| a[axis] + fraction * (b[axis] - a[axis]))
        };
        let between: Vec<[f32; 3]> = a.iter().zip(b).map(mix).collect();
        resampled(&between)
    }

    /// The files of the frames around a time in seconds.
    pub(crate) fn files_at(&self, seconds: f64) -> [&Path; 2] {
        let (wanted, _) = self.around(seconds);
        wanted.map(|frame| &*self.frames[frame])
    }

    /// The frames around a time in seconds, and how far on from the first to the second it is.
    fn around(&self, seconds: f64) -> ([usize; 2], f32) {
        let last = self.frames.len().saturating_sub(1);
        let at = (seconds * self.fps).clamp(0.0, last as f64);
        let first = at.floor() as usize;
        ([first, (first + 1).min(last)], at.fract() as f32)
    }

    /// Has a frame in memory.
    fn read(&mut self, frame: usize, rest: &Strands) -> Result<(), SceneError> {
        if self.kept.iter().any(|(kept, _)| *kept == frame) {
            return Ok(());
        }
        let at_key = |error: SceneError| error.at_key(format!("motion.frames[{frame}]"));
        if self.offsets.is_none() {
            let groom = self.files.groom(&self.groom).map_err(at_key)?;
            self.shape = ShapeVariation::new(&self.variation, &groom).map(Box::new);
            self.offsets = Some(groom.strand_offsets);
        }
        let path = &self.frames[frame];
        let groom = self.files.groom(path).map_err(at_key)?;
        let is_same = self.offsets.as_ref() == Some(&groom.strand_offsets);
        if !is_same || groom.points.len() != rest.n_groom_points() {
            return Err(at_key(SceneError::FrameStrands.in_file(path)));
        }
        self.kept.push((frame, groom.points));
        Ok(())
    }
}
