//! Values of options that both programs have.

use serde_json::Value;
use strandlight_scene::budget::{FrameError, MAX_SECONDS, check_frame};
use strandlight_scene::keys::parse_value;

/// A value that an option does not take; the text does not name the option.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// Not a size.
    #[error("a size is two numbers like 720x480")]
    Size,
    /// A size that no picture has.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Not a time, or one out of range.
    #[error("a time is a number of seconds in 0..={MAX_SECONDS}")]
    Time,
    /// Not a key and a value.
    #[error("must be KEY=VALUE")]
    Key,
}

/// A size like 720x480, width first.
///
/// # Errors
/// No size, or one that no picture has.
pub fn parse_size(text: &str) -> Result<[u32; 2], OptionError> {
    let parsed = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let size = parsed.ok_or(OptionError::Size)?;
    check_frame(size, 1)?;
    Ok(size)
}

/// Seconds since the start of the motion.
///
/// # Errors
/// No number, or one that is out of range.
pub fn parse_time(text: &str) -> Result<f64, OptionError> {
    let parsed = text.parse().ok();
    let seconds = parsed.filter(|seconds| (0.0..=MAX_SECONDS).contains(seconds));
    seconds.ok_or(OptionError::Time)
}

/// A key of the scene file and its value, as `hair.eta=1.6`.
///
/// # Errors
/// There is no `=`.
pub fn parse_key(text: &str) -> Result<(String, Value), OptionError> {
    let (key, value) = text.split_once('=').ok_or(OptionError::Key)?;
    Ok((key.trim().to_owned(), parse_value(value)))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!(parse_size("20x10"), Ok([20, 10]));
        assert_eq!(parse_size("20X10"), Ok([20, 10]));
        for text in ["", "20", "x", "20x", "-4x3", "20x10x5", "1.5x2"] {
            assert_eq!(parse_size(text), Err(OptionError::Size), "{text}");
        }
        assert!(matches!(parse_size("0x3"), Err(OptionError::Frame(_))));
        assert_eq!(parse_time("1.5"), Ok(1.5));
        for text in ["", "-1", "1s", "nan", "inf", "1e7"] {
            assert_eq!(parse_time(text), Err(OptionError::Time), "{text}");
        }
        let read = parse_key(" hair.eta =1.6");
        assert_eq!(read, Ok(("hair.eta".to_owned(), json!(1.6))));
        assert_eq!(parse_key("hair.eta"), Err(OptionError::Key));
    }
}
