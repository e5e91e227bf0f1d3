//! Names of outputs, made from the names of inputs.

use std::path::Path;

/// What stands in braces in the name of an output.
pub const FIELDS: [&str; 3] = ["stem", "name", "dir"];

/// `pattern` with `{stem}` (name of the input without its last extension), `{name}` (its whole name)
/// and `{dir}` (its folder below the part of the pattern without wildcards) filled in.
///
/// # Errors
/// A field that is not known, or has no value because there is no input; a brace alone.
pub fn fill(pattern: &str, input: Option<(&Path, &Path)>) -> Result<String, String> {
    let mut filled = String::new();
    let mut rest = pattern;
    while let Some(at) = rest.find(['{', '}']) {
        let (before, from) = rest.split_at(at);
        let (field, after) = from
            .strip_prefix('{')
            .and_then(|from| from.split_once('}'))
            .ok_or_else(|| format!("{pattern}: a brace without its other half"))?;
        if !FIELDS.contains(&field) {
            let known = FIELDS.map(|field| format!("{{{field}}}")).join(", ");
            return Err(format!(
                "{pattern}: {{{field}}} is unknown; known are {known}"
            ));
        }
        let (path, below) = input
            .ok_or_else(|| format!("{pattern}: there is no input to take {{{field}}} from"))?;
        let value = match field {
            "stem" => path.file_stem(),
            "name" => path.file_name(),
            _ => Some(below.as_os_str()),
        };
        let value = value.unwrap_or_default().to_str();
        filled += before;
        // An empty folder does not make the name absolute.
        let is_nothing = value == Some("");
        filled += value.ok_or_else(|| format!("{}: its name is not UTF-8", path.display()))?;
        rest = match is_nothing && (filled.is_empty() || filled.ends_with('/')) {
            true => after.strip_prefix('/').unwrap_or(after),
            false => after,
        };
    }
    Ok(filled + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_filled_in() {
        let of = |pattern: &str, below: &str| {
            let path = Path::new("maps/day/sun.1k.hdr");
            fill(pattern, Some((path, Path::new(below))))
        };
        assert_eq!(of("o/{stem}.lights", "").as_deref(), Ok("o/sun.1k.lights"));
        assert_eq!(of("{name}.lights", "").as_deref(), Ok("sun.1k.hdr.lights"));
        assert_eq!(
            of("o/{dir}/{stem}.l", "day").as_deref(),
            Ok("o/day/sun.1k.l")
        );
        assert_eq!(of("o/{dir}/{stem}.l", "").as_deref(), Ok("o/sun.1k.l"));
        assert_eq!(of("{dir}/{stem}.l", "").as_deref(), Ok("sun.1k.l"));
        assert_eq!(of("plain", "").as_deref(), Ok("plain"));
        for pattern in ["{steam}", "{stem", "stem}", "{}"] {
            assert!(of(pattern, "").is_err(), "{pattern}");
        }
        assert!(fill("{stem}", None).is_err());
        assert_eq!(fill("a.tables", None).as_deref(), Ok("a.tables"));
    }
}
