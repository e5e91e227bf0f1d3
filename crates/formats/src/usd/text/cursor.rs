//! Reading a text from left to right.

use std::ops::Range;

use crate::error::{Error, FileName, Result};

/// Brackets within brackets in one value: more is refused.
const MAX_BRACKETS: usize = 256;

/// A place in a text.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    /// The whole text.
    pub bytes: &'a [u8],
    /// Offset of the next byte.
    pub at: usize,
}

/// May `byte` stand in a name? Namespaces are parted by `:`, fields by `.`.
fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b':' | b'.') || byte >= 0x80
}

/// Bytes that end a number or a bare word.
fn ends_word(byte: u8) -> bool {
    byte.is_ascii_whitespace() || b",;:()[]{}=<>@\"'#".contains(&byte)
}

/// Bytes with a meaning inside of brackets.
static INTERESTING: [bool; 256] = {
    let mut table = [false; 256];
    let mut ix = 0;
    let bytes = b"()[]{}<@\"'#/";
    while ix < bytes.len() {
        table[bytes[ix] as usize] = true;
        ix += 1;
    }
    table
};

impl<'a> Cursor<'a> {
    /// At the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Cursor { bytes, at: 0 }
    }

    /// What is wrong here.
    pub fn fault<T>(&self, what: impl Into<String>) -> Result<T> {
        let before = &self.bytes[..self.at.min(self.bytes.len())];
        let line_start = before
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |n| n + 1);
        let line = String::from_utf8_lossy(&before[line_start..]);
        Err(Error::Syntax {
            file: FileName::default(),
            line: 1 + before.iter().filter(|&&b| b == b'\n').count(),
            column: 1 + line.chars().count(),
            what: what.into(),
        })
    }

    /// The next byte.
    pub fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn starts_with(&self, start: &[u8]) -> bool {
        self.bytes[self.at..].starts_with(start)
    }

    /// Passes blanks, line ends, `;` and comments.
    pub fn skip_blank(&mut self) {
        while let Some(byte) = self.peek() {
            match byte {
                b';' => self.at += 1,
                b'#' => self.skip_line(),
                b'/' if self.starts_with(b"//") => self.skip_line(),
                b'/' if self.starts_with(b"/*") => self.skip_comment(),
                _ if byte.is_ascii_whitespace() => self.at += 1,
                _ => return,
            }
        }
    }

    fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
    }

    fn skip_comment(&mut self) {
        let rest = &self.bytes[self.at..];
        let end = rest.windows(2).position(|pair| pair == b"*/");
        self.at += end.map_or(rest.len(), |end| end + 2);
    }

    /// Takes `byte` if it comes next, but for blanks.
    pub fn eat(&mut self, byte: u8) -> bool {
        self.skip_blank();
        let is_next = self.peek() == Some(byte);
        self.at += usize::from(is_next);
        is_next
    }

    /// `byte` must come next.
    pub fn expect(&mut self, byte: u8, what: &str) -> Result<()> {
        match self.eat(byte) {
            true => Ok(()),
            false => self.fault(format!("`{}` is missing {what}", char::from(byte))),
        }
    }

    /// The name that comes next, empty if there is none.
    pub fn name(&mut self) -> &'a str {
        self.skip_blank();
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| !is_name(b)).unwrap_or(rest.len());
        self.at += end;
        std::str::from_utf8(&rest[..end]).unwrap_or_default()
    }

    /// The string in quotes that comes next.
    pub fn string(&mut self) -> Result<String> {
        self.skip_blank();
        let range = self.skip_string()?;
        Ok(unquoted(&self.bytes[range]))
    }

    /// Passes a string; answers what is within its quotes.
    fn skip_string(&mut self) -> Result<Range<usize>> {
        let Some(quote @ (b'"' | b'\'')) = self.peek() else {
            return self.fault("a string in quotes is missing");
        };
        let is_long = self.starts_with(&[quote; 3]);
        let length = if is_long { 3 } else { 1 };
        let start = self.at + length;
        let mut at = start;
        while let Some(&byte) = self.bytes.get(at) {
            if byte == b'\\' {
                at += 2;
            } else if byte == quote && (!is_long || self.bytes[at..].starts_with(&[quote; 3])) {
                self.at = at + length;
                return Ok(start..at);
            } else if byte == b'\n' && !is_long {
                break;
            } else {
                at += 1;
            }
        }
        self.fault("this string does not end")
    }

    /// Passes `@file@`; answers the name of the file.
    pub fn skip_asset(&mut self) -> Result<Range<usize>> {
        let mark: &[u8] = match self.starts_with(b"@@@") {
            true => b"@@@",
            false => b"@",
        };
        let start = self.at + mark.len();
        let rest = self.bytes.get(start..).unwrap_or_default();
        let end = rest.windows(mark.len()).position(|found| found == mark);
        let Some(end) = end else {
            return self.fault("the name of this file does not end");
        };
        self.at = start + end + mark.len();
        Ok(start..start + end)
    }

    /// Passes `</path>`, which must come next; answers it with its brackets.
    pub fn skip_path(&mut self) -> Result<Range<usize>> {
        let rest = &self.bytes[self.at..];
        match rest.iter().position(|&b| b == b'>' || b == b'\n') {
            Some(end) if rest[end] == b'>' => {
                let start = self.at;
                self.at += end + 1;
                Ok(start..self.at)
            }
            _ => self.fault("this path does not end"),
        }
    }

    /// Passes a value of any type; answers where it stands.
    pub fn skip_value(&mut self) -> Result<Range<usize>> {
        self.skip_blank();
        let start = self.at;
        match self.peek() {
            Some(b'"' | b'\'') => {
                self.skip_string()?;
            }
            Some(b'@') => {
                self.skip_asset()?;
            }
            Some(b'<') => {
                self.skip_path()?;
            }
            Some(b'(' | b'[' | b'{') => self.skip_brackets()?,
            _ => {
                let rest = &self.bytes[start..];
                self.at += rest
                    .iter()
                    .position(|&b| ends_word(b))
                    .unwrap_or(rest.len());
                if self.at == start {
                    return self.fault("a value is missing");
                }
            }
        }
        Ok(start..self.at)
    }

    fn skip_brackets(&mut self) -> Result<()> {
        let start = self.clone();
        let mut closing = Vec::new();
        loop {
            let rest = &self.bytes[self.at..];
            let Some(next) = rest.iter().position(|&b| INTERESTING[usize::from(b)]) else {
                return start.fault("this bracket is not closed");
            };
            self.at += next;
            match rest[next] {
                open @ (b'(' | b'[' | b'{') => {
                    if closing.len() == MAX_BRACKETS {
                        return self
                            .fault(format!("more than {MAX_BRACKETS} brackets in brackets"));
                    }
                    // Distance to the closing one in ASCII.
                    closing.push(if open == b'(' { b')' } else { open + 2 });
                    self.at += 1;
                }
                close @ (b')' | b']' | b'}') => {
                    if closing.pop() != Some(close) {
                        return self.fault("this bracket closes none, or another one");
                    }
                    self.at += 1;
                    if closing.is_empty() {
                        return Ok(());
                    }
                }
                b'"' | b'\'' => {
                    self.skip_string()?;
                }
                b'@' => {
                    self.skip_asset()?;
                }
                b'<' => {
                    self.skip_path()?;
                }
                _ => {
                    let before = self.at;
                    self.skip_blank();
                    // A stroke that starts no comment.
                    self.at += usize::from(self.at == before);
                }
            }
        }
    }
}

/// A string without its quotes, escapes resolved.
fn unquoted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    if !text.contains('\\') {
        return text.into_owned();
    }
    let mut plain = String::with_capacity(text.len());
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        plain.push(match letter {
            '\\' => match letters.next() {
                Some('n') => '\n',
                Some('r') => '\r',
                Some('t') => '\t',
                Some(other) => other,
                None => break,
            },
            other => other,
        });
    }
    plain
}
