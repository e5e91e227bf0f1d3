//! Hair that moves: ranges of frames, and the names of their files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use serde_json::json;
use strandlight_formats::{Groom, counted};

use super::source::Source;
use super::target::Target;
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_outputs, note, print_line};

/// Most bytes of grooms in memory at once, for a file that holds all frames.
pub const MAX_BYTES: u64 = 16 << 30;

/// Frames from one to another, both included, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    first: u32,
    /// `None`: the last of the file.
    last: Option<u32>,
}

/// Parses `A..B` and `A..`.
pub fn parse_range(text: &str) -> Result<FrameRange, String> {
    let parsed = text.split_once("..").and_then(|(first, last)| {
        let first = match first {
            "" => 0,
            text => text.parse().ok()?,
        };
        let last = match last {
            "" => None,
            text => Some(text.parse().ok()?),
        };
        Some(FrameRange { first, last })
    });
    let is_rising = |range: &FrameRange| range.last.is_none_or(|last| last >= range.first);
    parsed
        .filter(is_rising)
        .ok_or_else(|| "must be A..B, both frames included, from 0; A.. to the last".to_owned())
}

impl FrameRange {
    /// One frame.
    pub fn one(frame: u32) -> Self {
        FrameRange {
            first: frame,
            last: Some(frame),
        }
    }

    /// The first frame.
    pub fn first(self) -> u32 {
        self.first
    }

    /// The frames, if the file with `n` of them at `path` has them all.
    pub fn of(self, n: usize, path: &Path) -> Result<Vec<u32>, Failure> {
        let end = u32::try_from(n).unwrap_or(u32::MAX);
        let last = self.last.unwrap_or(end.saturating_sub(1));
        if last < end && self.first <= last {
            return Ok((self.first..=last).collect());
        }
        let wanted = match self.last {
            Some(last) if last != self.first => format!("{}..{last}", self.first),
            _ => self.first.to_string(),
        };
        let what = match n {
            1 if wanted.contains("..") => {
                format!("it has no frames {wanted}: the hair does not move")
            }
            1 => format!("it has no frame {wanted}: the hair does not move"),
            _ => format!("it has frames 0..{}, not {wanted}", end - 1),
        };
        Err(Failure::file(path, what))
    }
}

/// `hair.%04d.groom` as the file of frame `frame`: `hair.0007.groom`. `None` where there is no place
/// for a number.
pub fn numbered(pattern: &Path, frame: u32) -> Option<PathBuf> {
    let name = pattern.file_name()?.to_str()?;
    let (before, rest) = name.split_once('%')?;
    let (width, after) = rest.split_once('d')?;
    let is_width = width.is_empty() || (width.len() <= 2 && width.starts_with('0'));
    let width: usize = match width {
        "" => 0,
        digits if is_width => digits.parse().ok()?,
        _ => return None,
    };
    let mut name = OsString::from(before);
    name.push(format!("{frame:0width$}{after}"));
    Some(pattern.with_file_name(name))
}

/// Writes frames of `source`: one file each by the pattern `output`, or one file that holds them all.
pub fn write_sequence(
    source: &Source<'_>,
    input: &Path,
    range: FrameRange,
    target: &Target,
    output: &Path,
) -> Outcome {
    let times = source.frame_times()?;
    let frames = range.of(times.len(), input)?;
    let names: Option<Vec<PathBuf>> = frames
        .iter()
        .map(|&frame| numbered(output, frame))
        .collect();
    let chosen: Vec<f64> = frames.iter().map(|&frame| times[frame as usize]).collect();
    let Some(names) = names else {
        if !target.holds_frames() {
            let what = "is one file for several frames; name it as hair.%04d.groom";
            return Err(Failure::file(output, what));
        }
        check_outputs(&[input], &[output])?;
        let grooms = read_all(source, input, &frames)?;
        return target.write_frames(&grooms, frames_per_second(&chosen), output);
    };
    let outputs: Vec<&Path> = names.iter().map(PathBuf::as_path).collect();
    check_outputs(&[input], &outputs)?;
    let progress = progress("frames", frames.len() as u64);
    let mut strands = None;
    for (&frame, name) in frames.iter().zip(&names) {
        let groom = source.groom(frame, strands.is_none())?;
        let strands = strands.get_or_insert_with(|| groom.strand_offsets.clone());
        check_strands(&groom, strands, frame, input)?;
        target.write(&groom, name)?;
        progress.advance(1);
    }
    progress.finish();
    // Scenes play grooms alone.
    if !target.is_groom() {
        return Ok(());
    }
    motion_lines(&names, frames_per_second(&chosen))
        .into_iter()
        .try_for_each(print_line)
}

fn read_all(source: &Source<'_>, input: &Path, frames: &[u32]) -> Result<Vec<Groom>, Failure> {
    let progress = progress("frames", frames.len() as u64);
    let mut grooms: Vec<Groom> = Vec::new();
    let mut n_bytes = 0;
    for &frame in frames {
        let groom = source.groom(frame, grooms.is_empty())?;
        if let Some(first) = grooms.first() {
            check_strands(&groom, &first.strand_offsets, frame, input)?;
        }
        n_bytes += bytes_of(&groom);
        check_bytes(n_bytes, input)?;
        grooms.push(groom);
        progress.advance(1);
    }
    progress.finish();
    Ok(grooms)
}

/// Bytes of a groom in memory.
pub fn bytes_of(groom: &Groom) -> u64 {
    let floats = groom
        .attributes
        .iter()
        .map(|attribute| attribute.data.len());
    12 * groom.points.len() as u64
        + 4 * groom.strand_offsets.len() as u64
        + 4 * floats.sum::<usize>() as u64
}

/// Refuses more frames than fit into memory.
pub fn check_bytes(n_bytes: u64, path: &Path) -> Outcome {
    if n_bytes <= MAX_BYTES {
        return Ok(());
    }
    let gib = MAX_BYTES >> 30;
    let what = format!("the frames take more than {gib} GiB; write fewer to one file");
    Err(Failure::file(path, what))
}

fn check_strands(groom: &Groom, first: &[u32], frame: u32, path: &Path) -> Outcome {
    if groom.strand_offsets == first {
        return Ok(());
    }
    let what = format!(
        "frame {frame} has {} and {}, or other points in its strands, and the first \
         frame {} and {}; strands must not change while they move",
        counted(groom.n_strands(), "strand", "strands"),
        counted(groom.points.len(), "point", "points"),
        first.len() - 1,
        first[first.len() - 1]
    );
    Err(Failure::file(path, what))
}

/// Frames per second of these times; of a single one the usual 24.
fn frames_per_second(times: &[f64]) -> f64 {
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return strandlight_formats::MotionSection::DEFAULT_FPS;
    };
    let steps = (times.len() - 1) as f64;
    let step = (last - first) / steps;
    if !(step > 0.0 && step.is_finite()) {
        return strandlight_formats::MotionSection::DEFAULT_FPS;
    }
    let uneven = times
        .windows(2)
        .any(|pair| (pair[1] - pair[0] - step).abs() > 0.01 * step);
    if uneven {
        note!("the frames are not at equal times; they are played as if they were");
    }
    // To a thousandth, so that 1/24 in single precision is 24.
    (1000.0 / step).round() / 1000.0
}

/// The lines for a scene that plays these grooms.
fn motion_lines(names: &[PathBuf], fps: f64) -> Vec<String> {
    let names = names.iter().map(|name| name.to_string_lossy());
    let names: Vec<String> = names.map(|name| format!("  {},", json!(name))).collect();
    let mut lines = vec!["[motion]".to_owned(), "frames = [".to_owned()];
    lines.extend(names);
    lines.push("]".to_owned());
    lines.push(format!("fps = {fps:?}"));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_that_the_file_has() {
        let path = Path::new("a.abc");
        let range = |text| parse_range(text).unwrap();
        assert_eq!(range("2..4").of(5, path).unwrap(), [2, 3, 4]);
        assert_eq!(range("3..").of(5, path).unwrap(), [3, 4]);
        assert_eq!(range("..").of(2, path).unwrap(), [0, 1]);
        assert_eq!(FrameRange::one(0).of(1, path).unwrap(), [0]);
        for (range, n, needle) in [
            (range("0..5"), 5, "it has frames 0..4, not 0..5"),
            (range("7.."), 5, "it has frames 0..4, not 7"),
            (FrameRange::one(1), 1, "does not move"),
        ] {
            let error = range.of(n, path).unwrap_err().to_string();
            assert!(error.contains(needle), "{error}");
        }
        for text in ["", "3", "4..2", "a..b", "-1..2", "1...3", "1..2..3"] {
            assert!(parse_range(text).is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_go_where_the_pattern_has_them() {
        let of = |pattern: &str, frame| {
            let name = numbered(Path::new(pattern), frame);
            name.map(|name| name.display().to_string())
        };
        assert_eq!(
            of("a/hair.%04d.groom", 7).as_deref(),
            Some("a/hair.0007.groom")
        );
        assert_eq!(of("%d.groom", 123).as_deref(), Some("123.groom"));
        assert_eq!(of("x%02d", 123).as_deref(), Some("x123"));
        for pattern in [
            "hair.groom",
            "a%04d/hair.groom",
            "%s.groom",
            "%4d",
            "%0099d",
            "%",
        ] {
            assert_eq!(of(pattern, 1), None, "{pattern}");
        }
    }

    #[test]
    fn rates_are_found_and_lines_are_a_scene() {
        assert_eq!(frames_per_second(&[0.5, 0.5 + 1.0 / 24.0]), 24.0);
        assert_eq!(frames_per_second(&[3.0]), 24.0);
        assert_eq!(frames_per_second(&[]), 24.0);
        let third = f64::from(1.0f32 / 30.0);
        assert_eq!(frames_per_second(&[0.0, third, 2.0 * third]), 30.0);
        let names = [PathBuf::from("a \"b\".0.groom"), PathBuf::from("c.groom")];
        let text = motion_lines(&names, 12.5).join("\n");
        let files = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
        let scene = strandlight_formats::Scene::from_toml(&format!("{files}{text}\n")).unwrap();
        let motion = scene.motion.unwrap();
        assert_eq!(motion.frames, names);
        assert_eq!(motion.fps, Some(12.5));
    }
}
