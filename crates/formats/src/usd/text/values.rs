//! Values of a text, decoded where they are needed.

use std::ops::Range;

use super::cursor::Cursor;
use crate::error::Result;
use crate::usd::model::{Numbers, Real};

/// The numbers of the value at `range`.
pub(crate) fn numbers<T: Real>(bytes: &[u8], range: Range<usize>) -> Result<Option<Numbers<T>>> {
    let mut cursor = Cursor {
        bytes: &bytes[..range.end],
        at: range.start,
    };
    let mut data: Vec<T> = Vec::new();
    // Numbers of a tuple, and where the one that is open starts.
    let mut width = None;
    let mut tuple = 0;
    let mut depth = 0usize;
    loop {
        cursor.skip_blank();
        let start = cursor.clone();
        match cursor.peek() {
            None => break,
            Some(b',' | b'[' | b']') => cursor.at += 1,
            Some(b'(') => {
                if depth == 0 {
                    tuple = data.len();
                }
                depth += 1;
                cursor.at += 1;
            }
            Some(b')') => {
                depth = depth.saturating_sub(1);
                cursor.at += 1;
                let length = data.len() - tuple;
                if depth == 0 && *width.get_or_insert(length) != length {
                    return start.fault(format!("a tuple of {length} numbers after others"));
                }
            }
            Some(_) => {
                let word = cursor.skip_value()?;
                match number(&bytes[word]) {
                    Some(number) => data.push(number),
                    // One word of another type, or none of it.
                    None if data.is_empty() => return Ok(None),
                    None => return start.fault("not a number"),
                }
                if depth == 0 && *width.get_or_insert(1) != 1 {
                    return start.fault("a number among tuples");
                }
            }
        }
    }
    let width = width.unwrap_or(1);
    if width == 0 || !data.len().is_multiple_of(width) {
        return cursor.fault("an empty tuple");
    }
    Ok(Some(Numbers { width, data }))
}

/// `1`, `-.5`, `7.`, `1e3`, `inf`, `nan`, `true`.
fn number<T: Real>(word: &[u8]) -> Option<T> {
    match word {
        b"true" => return Some(T::from_f64(1.0)),
        b"false" => return Some(T::from_f64(0.0)),
        _ => {}
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Strings and words of the value at `range`; of a dictionary key and value in turns.
pub(crate) fn strings(bytes: &[u8], range: Range<usize>) -> Result<Vec<String>> {
    let mut cursor = Cursor {
        bytes: &bytes[..range.end],
        at: range.start,
    };
    let mut strings = Vec::new();
    loop {
        cursor.skip_blank();
        match cursor.peek() {
            None => return Ok(strings),
            Some(b'"' | b'\'') => strings.push(cursor.string()?),
            Some(b'=') => {
                // The key is the word before, that before it the type.
                let key = strings.pop();
                strings.pop();
                strings.extend(key);
                cursor.at += 1;
            }
            Some(b',' | b'[' | b']' | b'{' | b'}' | b'(' | b')' | b':' | b'>') => cursor.at += 1,
            Some(_) => {
                let word = cursor.skip_value()?;
                strings.push(String::from_utf8_lossy(&bytes[word]).into_owned());
            }
        }
    }
}

/// Files and paths that the value at `range` names.
pub(crate) fn assets(bytes: &[u8], range: Range<usize>) -> Result<Vec<String>> {
    let mut cursor = Cursor {
        bytes: &bytes[..range.end],
        at: range.start,
    };
    let mut assets = Vec::new();
    loop {
        cursor.skip_blank();
        let text = |range: Range<usize>| String::from_utf8_lossy(&bytes[range]).into_owned();
        match cursor.peek() {
            None => return Ok(assets),
            Some(b'@') => {
                let file = cursor.skip_asset()?;
                cursor.skip_blank();
                if cursor.peek() == Some(b'<') {
                    cursor.skip_path()?;
                }
                match file.is_empty() {
                    true => {}
                    false => assets.push(format!("@{}@", text(file))),
                }
            }
            Some(b'<') => assets.push(text(cursor.skip_path()?)),
            Some(b'(') => {
                cursor.skip_value()?;
            }
            Some(b',' | b'[' | b']') => cursor.at += 1,
            // `None`, or nothing that a list of files has.
            Some(_) => return Ok(assets),
        }
    }
}
