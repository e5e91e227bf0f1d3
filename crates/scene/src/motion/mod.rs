//! Hair that moves: wind, or a sequence of grooms.
//!
//! [`Motion`] is what a scene says; [`Motion::strands_at`] is the hair at a time, on the CPU.
//! The GPU renderer bends it on the device.

mod sequence;
#[doc(hidden)]
pub mod wind;

use std::path::Path;

use strandlight_formats::{Scene, WindSection};

use crate::error::SceneError;
use crate::files::Files;
use crate::strands::Strands;

pub use sequence::Sequence;
pub use wind::Wind;

/// How the hair of a scene moves.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Wind.
    Wind(WindSection),
    /// A sequence of grooms.
    Sequence(Sequence),
}

impl Motion {
    /// That of `scene`, if its hair moves. Frames are not opened yet.
    pub fn new(scene: &Scene, files: &Files) -> Option<Motion> {
        let motion = scene.motion.as_ref()?;
        Some(match &motion.wind {
            Some(wind) => Motion::Wind(wind.clone()),
            None => Motion::Sequence(Sequence::new(scene, files)),
        })
    }

    /// The files of the sequence that the hair is made of at a time in seconds.
    pub(crate) fn files_at(&self, seconds: f64) -> Vec<&Path> {
        match self {
            Motion::Wind(_) => Vec::new(),
            Motion::Sequence(sequence) => sequence.files_at(seconds).to_vec(),
        }
    }

    /// The hair at a time in seconds; `rest` is that of a prepared scene, with room for the wind
    /// ([`wind::with_room`]).
    ///
    /// # Errors
    /// A frame that cannot be read or has other strands, by name.
    pub fn strands_at(&mut self, rest: &Strands, seconds: f64) -> Result<Strands, SceneError> {
        match self {
            Motion::Wind(section) => wind::strands_at(section, rest, seconds),
            Motion::Sequence(sequence) => rest.moved(&sequence.points_at(rest, seconds)?),
        }
    }
}
