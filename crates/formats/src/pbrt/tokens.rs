//! The words of a pbrt file.

use crate::error::{Error, Result};

/// A word of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// A directive, a number, or `true` and `false`.
    Word(&'a [u8]),
    /// Between quotes.
    Text(&'a [u8]),
    Open,
    Close,
}

/// The words of a file with their places; comments are left out.
#[derive(Clone, Debug)]
pub(super) struct Tokens<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Tokens<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Tokens { bytes, at: 0 }
    }

    /// Where the next word is looked for.
    pub fn offset(&self) -> u64 {
        self.at as u64
    }

    /// The next word and its place; `None` at the end.
    ///
    /// # Errors
    /// `Invalid` where a quote is not closed.
    pub fn next(&mut self) -> Result<Option<(u64, Token<'a>)>> {
        loop {
            let rest = &self.bytes[self.at..];
            let Some(blanks) = rest.iter().position(|byte| !byte.is_ascii_whitespace()) else {
                self.at = self.bytes.len();
                return Ok(None);
            };
            self.at += blanks;
            let rest = &rest[blanks..];
            let start = self.at as u64;
            let (token, length) = match rest[0] {
                b'#' => {
                    let line = rest.iter().position(|&byte| byte == b'\n');
                    self.at += line.unwrap_or(rest.len());
                    continue;
                }
                b'[' => (Token::Open, 1),
                b']' => (Token::Close, 1),
                b'"' => {
                    let end = rest[1..]
                        .iter()
                        .position(|&byte| matches!(byte, b'"' | b'\n'));
                    let end = end.filter(|&end| rest[1 + end] == b'"');
                    let Some(end) = end else {
                        return Err(Error::invalid("a quote is not closed on its line", start));
                    };
                    (Token::Text(&rest[1..1 + end]), end + 2)
                }
                _ => {
                    let is_end = |byte: &u8| byte.is_ascii_whitespace() || b"[]\"#".contains(byte);
                    let end = rest.iter().position(is_end).unwrap_or(rest.len());
                    (Token::Word(&rest[..end]), end)
                }
            };
            self.at += length;
            return Ok(Some((start, token)));
        }
    }

    /// The next word, which stays the next.
    pub fn peek(&self) -> Result<Option<(u64, Token<'a>)>> {
        self.clone().next()
    }
}

/// Is there a curve in `start`, which may be cut?
pub(super) fn has_curve(start: &[u8]) -> bool {
    let mut tokens = Tokens::new(start);
    let mut is_shape = false;
    while let Ok(Some((_, token))) = tokens.next() {
        if is_shape && token == Token::Text(b"curve") {
            return true;
        }
        is_shape = token == Token::Word(b"Shape");
    }
    false
}
