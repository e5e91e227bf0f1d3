//! Names of the frames of a turntable.

use std::path::{Path, PathBuf};

/// Digits of a number where a name does not say how many.
const DIGITS: usize = 4;

/// Most digits.
const MOST_DIGITS: usize = 9;

/// The file of a frame: the `%04d` or `####` of `path` is its number; without one the number stands before the
/// extension.
pub fn file_of(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (before, digits, after) = match placeholder(&name) {
        Some((start, end, digits)) => (&name[..start], digits, &name[end..]),
        None => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().len();
            let (stem, extension) = name.split_at(stem);
            return path.with_file_name(format!("{stem}.{frame:0DIGITS$}{extension}"));
        }
    };
    path.with_file_name(format!("{before}{frame:0digits$}{after}"))
}

/// Where the number stands in a name, and how many digits it has.
fn placeholder(name: &str) -> Option<(usize, usize, usize)> {
    if let Some(start) = name.find('#') {
        let digits = name[start..].bytes().take_while(|b| *b == b'#').count();
        return Some((start, start + digits, digits.min(MOST_DIGITS)));
    }
    let start = name.find('%')?;
    let width: String = name[start + 1..]
        .chars()
        .take_while(char::is_ascii_digit)
        .collect();
    let end = start + 1 + width.len();
    if !name[end..].starts_with('d') {
        return None;
    }
    let digits = width.parse().unwrap_or(1).clamp(1, MOST_DIGITS);
    Some((start, end + 1, digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_where_the_name_says() {
        let file = |name: &str| file_of(Path::new(name), 7).display().to_string();
        assert_eq!(file("a/turn.%04d.png"), "a/turn.0007.png");
        assert_eq!(file("turn_%d.exr"), "turn_7.exr");
        assert_eq!(file("turn-###.png"), "turn-007.png");
        assert_eq!(file("turn.png"), "turn.0007.png");
        // Neither is a number.
        assert_eq!(file("50%.png"), "50%.0007.png");
        assert_eq!(file("ä%x.png"), "ä%x.0007.png");
        assert_eq!(file("%99999999999999999999d.png"), "7.png");
    }
}
