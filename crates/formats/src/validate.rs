//! Checks that several kinds of file share.

use std::fmt::Display;

use crate::error::{Error, Result};

/// `value` must be a number in `min..=max`; NaN is outside every range.
pub(crate) fn in_range(key: impl Into<String>, value: f64, min: f64, max: f64) -> Result<()> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        let range = format!("in {}..={}", shown(min), shown(max));
        Err(Error::value(key, shown(value), range))
    }
}

/// A number as it was given: fractions of 32 bits would have 17 digits as one of 64, of which half say nothing.
fn shown(value: f64) -> String {
    let short = value as f32;
    match value.fract() != 0.0 && f64::from(short) == value {
        true => short.to_string(),
        false => value.to_string(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_32_bits_are_said_as_short_as_they_were_given() {
        let said = |value: f64| in_range("x", value, 1.0, 2.0).unwrap_err().to_string();
        assert_eq!(said(f64::from(0.1_f32)), "x is 0.1, must be in 1..=2");
        assert_eq!(said(0.1), "x is 0.1, must be in 1..=2");
        assert_eq!(said(1e300), format!("x is {}, must be in 1..=2", 1e300));
        assert_eq!(said(2147483648.0), "x is 2147483648, must be in 1..=2");
        assert_eq!(said(f64::INFINITY), "x is inf, must be in 1..=2");
        assert!(said(f64::NAN).starts_with("x is NaN, "));
        let least = f64::from(0.001_f32);
        let said = in_range("x", 0.0, least, 1.0).unwrap_err().to_string();
        assert_eq!(said, "x is 0, must be in 0.001..=1");
    }
}
