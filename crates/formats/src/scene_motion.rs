//! How the hair moves.

use std::path::PathBuf;

use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

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
    #[serde(
        skip_serializing_if = "Vec::is_empty",
        deserialize_with = "files_or_numbered"
    )]
    pub frames: Vec<PathBuf>,
    /// Frames a second; [`MotionSection::DEFAULT_FPS`] if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
}

/// What `motion.frames` may be.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a list of files, or { files, first, last } with %04d or #### in files"
)]
enum Frames {
    Files(Vec<PathBuf>),
    Numbered(NumberedFiles),
}

/// Files whose names differ in a number.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NumberedFiles {
    /// With `%d`, `%04d` or `####` in it.
    files: String,
    first: u32,
    last: u32,
}

fn files_or_numbered<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<PathBuf>, D::Error> {
    match Frames::deserialize(from)? {
        Frames::Files(files) => Ok(files),
        Frames::Numbered(numbered) => numbered.paths().map_err(D::Error::custom),
    }
}

impl NumberedFiles {
    /// From the first to the last one.
    fn paths(&self) -> Result<Vec<PathBuf>, String> {
        let NumberedFiles { files, first, last } = self;
        let Some((before, width, after)) = split_at_number(files) else {
            return Err(format!(
                "motion.frames.files is {files:?}, must have %04d or #### in it"
            ));
        };
        match last.checked_sub(*first) {
            Some(n) if (n as usize) < MAX_FRAMES => Ok((*first..=*last)
                .map(|n| PathBuf::from(format!("{before}{n:0width$}{after}")))
                .collect()),
            Some(_) => Err(format!(
                "motion.frames has {first} to {last}, must be at most {MAX_FRAMES} files"
            )),
            None => Err(format!(
                "motion.frames.last is {last}, must be at least first, {first}"
            )),
        }
    }
}

/// What stands before the number in the name of a file of a sequence, its digits at least, and what stands after.
fn split_at_number(name: &str) -> Option<(&str, usize, &str)> {
    if let Some((before, rest)) = name.split_once('%') {
        let (digits, after) = rest.split_once('d')?;
        let is_width = digits.is_empty() || digits.starts_with('0') && digits.len() <= 3;
        let width = match digits {
            "" => 1,
            digits => digits.parse::<usize>().ok()?,
        };
        return (is_width && width <= 16).then_some((before, width, after));
    }
    let start = name.find('#')?;
    let after = name[start..].trim_start_matches('#');
    Some((&name[..start], name.len() - start - after.len(), after))
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
    fn numbered_files_are_all_from_first_to_last() {
        let read = |text: &str| {
            let scene = Scene::from_lines(&format!("[motion]\nframes = {text}\n"))?;
            let frames = scene.motion.expect("motion").frames;
            Ok::<Vec<String>, crate::Error>(
                frames
                    .iter()
                    .map(|frame| frame.display().to_string())
                    .collect(),
            )
        };
        for (text, expected) in [
            (
                "{ files = 'x/a.%04d.groom', first = 9, last = 10 }",
                ["x/a.0009.groom", "x/a.0010.groom"],
            ),
            (
                "{ files = 'a.##.groom', first = 99, last = 100 }",
                ["a.99.groom", "a.100.groom"],
            ),
            ("{ files = 'a%d', first = 0, last = 1 }", ["a0", "a1"]),
        ] {
            assert_eq!(read(text).expect(text), expected, "{text}");
        }
        for (text, said) in [
            (
                "{ files = 'a.groom', first = 1, last = 2 }",
                "motion.frames.files",
            ),
            (
                "{ files = 'a%xd', first = 1, last = 2 }",
                "motion.frames.files",
            ),
            (
                "{ files = 'a%9999d', first = 1, last = 2 }",
                "motion.frames.files",
            ),
            (
                "{ files = 'a##', first = 2, last = 1 }",
                "motion.frames.last",
            ),
            (
                "{ files = 'a##', first = 0, last = 4000000000 }",
                "at most 100000",
            ),
            ("{ files = 'a##', first = 1 }", "{ files, first, last }"),
            ("3", "{ files, first, last }"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
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
