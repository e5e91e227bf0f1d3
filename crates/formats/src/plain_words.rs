//! What serde expects, in words of people who write scenes and not Rust.

use std::fmt::Display;

/// What parsers say after what they expected: where that is.
const PLACE: &str = " at line ";

/// `message` of a parser with a plain name of what it expected: `a number` for `f64`. Everything else
/// stays as it is.
pub fn in_plain_words(message: impl Display) -> String {
    let message = message.to_string();
    let is_of_type = |start: &&str| message.contains(*start);
    let starts = ["invalid type: ", "invalid value: ", "invalid length "];
    if !starts.iter().any(is_of_type) {
        return message;
    }
    // The last: what was found is quoted before, and may say so, too.
    let Some((found, expected)) = message.rsplit_once(", expected ") else {
        return message;
    };
    let end = expected.find(PLACE).unwrap_or(expected.len());
    let (kind, place) = expected.split_at(end);
    match plain(kind) {
        Some(plain) => format!("{found}, expected {plain}{place}"),
        None => message,
    }
}

/// What people call the type `kind`, where serde's name is another.
fn plain(kind: &str) -> Option<String> {
    let up_to = |most: u64| format!("a whole number in 0..={most}");
    let plain = match kind {
        "f32" | "f64" => "a number",
        "u8" => return Some(up_to(u8::MAX.into())),
        "u16" => return Some(up_to(u16::MAX.into())),
        "u32" => return Some(up_to(u32::MAX.into())),
        "u64" | "u128" | "usize" => "a whole number that is not negative",
        "i8" | "i16" | "i32" | "i64" | "i128" | "isize" => "a whole number",
        "bool" | "a boolean" => "true or false",
        "a string" | "string" | "str" => "text in quotes",
        "a sequence" | "sequence" => "a list",
        "a map" | "map" => "keys with values",
        _ => {
            let length = kind.strip_prefix("an array of length ")?;
            return Some(format!("a list of {length}"));
        }
    };
    Some(plain.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_of_rust_get_plain_names() {
        for (message, expected) in [
            (
                "invalid type: string \"abc\", expected f64",
                "invalid type: string \"abc\", expected a number",
            ),
            (
                "invalid type: string \"a, expected f64\", expected bool at line 1 column 3",
                "invalid type: string \"a, expected f64\", expected true or false at line 1 column 3",
            ),
            (
                "invalid value: integer `-1`, expected u16",
                "invalid value: integer `-1`, expected a whole number in 0..=65535",
            ),
            (
                "invalid value: integer `-1`, expected usize",
                "invalid value: integer `-1`, expected a whole number that is not negative",
            ),
            (
                "invalid type: map, expected a sequence",
                "invalid type: map, expected a list",
            ),
            (
                "invalid length 2, expected an array of length 3",
                "invalid length 2, expected a list of 3",
            ),
        ] {
            assert_eq!(in_plain_words(message), expected);
        }
        for message in [
            "unknown field `f64`, expected f64",
            "invalid type: integer `3`, expected `none`, `lights` or a colour",
            "missing field `light`",
            "",
        ] {
            assert_eq!(in_plain_words(message), message);
        }
    }
}
