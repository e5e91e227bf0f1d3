//! Checks that several kinds of file share.

use std::fmt::Display;

use crate::error::{Error, Result};

/// `value` must be a number in `min..=max`; NaN is outside every range.
pub(crate) fn in_range(key: impl Into<String>, value: f64, min: f64, max: f64) -> Result<()> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(Error::value(key, value, format!("in {min}..={max}")))
    }
}

/// `value` must be finite; `key` is only called when it is not.
pub(crate) fn finite<K: Into<String>>(key: impl FnOnce() -> K, value: f32) -> Result<()> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(Error::value(key(), value, "finite"))
    }
}

/// `text` must be printable ASCII of 1 to 64 characters.
pub(crate) fn short_name(key: impl Into<String>, text: impl AsRef<str> + Display) -> Result<()> {
    let name = text.as_ref();
    if (1..=64).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_graphic()) {
        Ok(())
    } else {
        Err(Error::value(
            key,
            format!("{name:?}"),
            "1 to 64 printable ASCII characters without blanks",
        ))
    }
}
