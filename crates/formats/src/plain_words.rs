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

/// What systems say of files, before the number of the error, in words of people.
const OF_SYSTEMS: [(&str, &str); 2] = [
    (
        ": Not a directory",
        ": a part of the path is a file, not a directory",
    ),
    (": Is a directory", ": is a directory"),
];

/// `text` with what systems say of files in words of people, and without their numbers of errors. Where no such number
/// follows, the words are those of a file name or of another program, and stay.
pub fn system_in_plain_words(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(" (os error ") {
        let number = after.split_once(')');
        let number = number.filter(|(number, _)| number.bytes().all(|byte| byte.is_ascii_digit()));
        match number {
            Some((_, after)) => {
                let mut said = OF_SYSTEMS.into_iter();
                let found =
                    said.find_map(|(said, plain)| Some((before.strip_suffix(said)?, plain)));
                let (before, said) = found.unwrap_or((before, ""));
                plain.push_str(before);
                plain.push_str(said);
                rest = after;
            }
            None => {
                plain.push_str(before);
                plain.push_str(" (os error ");
                rest = after;
            }
        }
    }
    plain.push_str(rest);
    plain
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
        "map with a single key" => "one key with its value",
        "path string" => "a path in quotes",
        _ => return of_several(kind),
    };
    Some(plain.to_owned())
}

/// The same of what is made of several values.
fn of_several(kind: &str) -> Option<String> {
    if let Some(length) = kind.strip_prefix("an array of length ") {
        return Some(format!("a list of {length}"));
    }
    let is_one_of_kinds = kind.starts_with("internally tagged enum ");
    if !is_one_of_kinds && !kind.starts_with("struct ") {
        return None;
    }
    let n_values = kind
        .strip_suffix(" elements")
        .or_else(|| kind.strip_suffix(" element"))
        .and_then(|kind| kind.rsplit_once(" with "));
    Some(match n_values {
        Some((_, n)) => format!("keys with values, or a list of {n}"),
        None => "keys with values".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_speak_plainly() {
        for (said, expected) in [
            (
                "a/b: Not a directory (os error 20)",
                "a/b: a part of the path is a file, not a directory",
            ),
            (
                "a: No such file or directory (os error 2); 3 left",
                "a: No such file or directory; 3 left",
            ),
            (
                "a: Is a directory (os error 21); b: Not a directory (os error 20)",
                "a: is a directory; b: a part of the path is a file, not a directory",
            ),
            // A file of that name, and what another program says.
            (
                "a: Not a directory.toml: Permission denied (os error 13)",
                "a: Not a directory.toml: Permission denied",
            ),
            (
                "b failed: cd: c: Not a directory",
                "b failed: cd: c: Not a directory",
            ),
            ("a (os error x): is it", "a (os error x): is it"),
        ] {
            assert_eq!(system_in_plain_words(said), expected);
        }
    }

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
            (
                "invalid type: integer `3`, expected struct HairFile",
                "invalid type: integer `3`, expected keys with values",
            ),
            (
                "invalid length 2, expected struct PerLobe with 3 elements",
                "invalid length 2, expected keys with values, or a list of 3",
            ),
            (
                "invalid type: integer `3`, expected internally tagged enum ProxySection",
                "invalid type: integer `3`, expected keys with values",
            ),
            (
                "invalid type: integer `3`, expected path string at line 2 column 8",
                "invalid type: integer `3`, expected a path in quotes at line 2 column 8",
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
