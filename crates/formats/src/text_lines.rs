//! Lines, words and numbers of text files, with their places.

use crate::error::{Error, Result};

/// A line of a text file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line<'a> {
    /// Where it starts, in bytes.
    pub offset: u64,
    /// Its bytes, without the line end.
    pub bytes: &'a [u8],
}

/// The lines of a text; they end in `\n`, `\r\n` or with the file.
pub(crate) fn lines(text: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut offset = 0;
    text.split_inclusive(|&byte| byte == b'\n')
        .map(move |line| {
            let start = offset;
            offset += line.len() as u64;
            Line {
                offset: start,
                bytes: line.trim_ascii_end(),
            }
        })
}

impl<'a> Line<'a> {
    /// The words between blanks.
    pub fn words(self) -> impl Iterator<Item = &'a [u8]> {
        self.bytes
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty())
    }

    /// Exactly `N` finite numbers.
    ///
    /// # Errors
    /// `Invalid`, naming the line and that it should hold `what`.
    pub fn numbers<const N: usize>(self, what: &str) -> Result<[f32; N]> {
        numbers(self.words()).ok_or_else(|| self.is_not(what))
    }

    /// The error that this line is not `what`.
    pub fn is_not(self, what: &str) -> Error {
        let shown: String = String::from_utf8_lossy(self.bytes)
            .chars()
            .take(60)
            .collect();
        Error::invalid(format!("{shown:?} is not {what}"), self.offset)
    }
}

/// Exactly `N` finite numbers.
pub(crate) fn numbers<'a, const N: usize>(
    mut words: impl Iterator<Item = &'a [u8]>,
) -> Option<[f32; N]> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = number(words.next()?)?;
    }
    words.next().is_none().then_some(values)
}

/// A finite number.
pub(crate) fn number(word: &[u8]) -> Option<f32> {
    // `parse` knows `inf`, `nan` and `infinity` as well.
    let value: f32 = std::str::from_utf8(word).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// A finite number in double precision.
pub(crate) fn double(word: &[u8]) -> Option<f64> {
    let value: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// A count.
pub(crate) fn count(word: &[u8]) -> Option<u32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_know_their_places() {
        let text = b"a b\r\n\n  1 .5 -2e1\nend";
        let all: Vec<_> = lines(text).map(|line| (line.offset, line.bytes)).collect();
        let expected: [(u64, &[u8]); 4] =
            [(0, b"a b"), (5, b""), (6, b"  1 .5 -2e1"), (18, b"end")];
        assert_eq!(all, expected);
        let third = lines(text).nth(2).unwrap();
        assert_eq!(third.numbers::<3>("a point").unwrap(), [1.0, 0.5, -20.0]);
        let message = third.numbers::<2>("a pair").unwrap_err().to_string();
        assert_eq!(message, "\"  1 .5 -2e1\" is not a pair (at byte 6)");
        for word in ["inf", "nan", "1e99", "", "x", "1,5"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        assert_eq!(
            (count(b"12"), count(b"-1"), count(b"1.0")),
            (Some(12), None, None)
        );
    }
}
