//! How the hair moves.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Most frames of a sequence: an hour at 24 a second, and some.
pub const MAX_FRAMES: usize = 100_000;

/// `[motion]`: either wind, or a sequence of grooms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSection {
    /// Wind that bends the groom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindSection>,
    /// `.groom` files, one pose each, with the strands and points of `groom.file`; the first at
    /// time 0. Between two the hair moves straight; after the last it stays.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<PathBuf>,
    /// Frames a second; [`MotionSection::DEFAULT_FPS`] if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
}

/// Wind; ranges are those of [`params::WIND`](crate::params::WIND).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindSection {
    /// Mean speed, m/s; hanging hair bends by some 35 degrees at 6.
    pub speed: f64,
    /// How much gusts add to and take from it.
    pub gust: f64,
    /// Where it blows to, about +Y from +Z towards +X.
    pub direction_deg: f64,
    /// Another wind for every number.
    pub seed: u32,
    /// Length from the root at which half of the wind acts, cm: longer for stiffer
    /// hair.
    pub stiffness: f64,
}

impl Default for WindSection {
    /// A breeze from the left.
    fn default() -> Self {
        WindSection {
            speed: 3.0,
            gust: 0.5,
            direction_deg: 90.0,
            seed: 0,
            stiffness: 8.0,
        }
    }
}

impl MotionSection {
    /// Frames per second by default.
    pub const DEFAULT_FPS: f64 = 24.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn wind_and_frames_are_read_and_written_as_they_are() {
        let wind = Scene::from_lines("[motion]\nwind = { speed = 5.0, seed = 7 }\n").unwrap();
        let expected = WindSection {
            speed: 5.0,
            seed: 7,
            ..WindSection::default()
        };
        assert_eq!(wind.motion.clone().unwrap().wind, Some(expected));
        let frames =
            Scene::from_lines("[motion]\nframes = ['x/1.groom', 'x/2.groom']\nfps = 12\n").unwrap();
        assert_eq!(frames.motion.clone().unwrap().frames.len(), 2);
        for scene in [wind, frames] {
            let text = scene.to_toml_string().unwrap();
            assert_eq!(Scene::from_toml(&text).unwrap(), scene, "{text}");
        }
        assert!(
            !Scene::new("a", "b")
                .to_toml_string()
                .unwrap()
                .contains("motion")
        );
    }

    #[test]
    fn what_cannot_be_is_named() {
        for (text, key) in [
            ("wind = { speed = -1.0 }", "motion.wind.speed"),
            ("wind = { gust = 2.0 }", "motion.wind.gust"),
            ("wind = { stiffness = 0.0 }", "motion.wind.stiffness"),
            (
                "wind = { direction_deg = inf }",
                "motion.wind.direction_deg",
            ),
            ("frames = ['']", "motion.frames"),
            ("frames = ['a']\nfps = 0", "motion.fps"),
            ("wind = {}\nfps = 24", "motion.fps"),
            ("wind = {}\nframes = ['a']", "motion is"),
            ("", "motion is"),
        ] {
            let error = Scene::from_lines(&format!("[motion]\n{text}\n"))
                .unwrap_err()
                .to_string();
            assert!(error.contains(key), "{text}: {error}");
        }
    }
}
