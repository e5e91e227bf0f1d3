//! The files that a pattern matches.

use std::path::{Component, Path, PathBuf};

use glob::{MatchOptions, Pattern};
use walkdir::WalkDir;

/// Most files of a pattern.
pub const MAX_FILES: usize = 1_000_000;

/// A file that a pattern matches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Match {
    /// Its path, relative as the pattern is.
    pub path: PathBuf,
    /// Its folder below the part of the pattern that has no wildcards.
    pub below: PathBuf,
}

/// Does `pattern` have wildcards?
pub fn is_pattern(pattern: &str) -> bool {
    pattern.contains(['*', '?', '['])
}

/// The regular files below `folder` that `pattern` matches, by their paths: `*` and `?` within a
/// name, `**` any folders, `[abc]`. Links are followed; names that start with a dot are
/// left out. A pattern without wildcards is the file of that name, whether or not it is there.
///
/// # Errors
/// A pattern that is none; a folder that cannot be listed; too many files.
pub fn matches(folder: &Path, pattern: &str) -> Result<Vec<Match>, String> {
    if !is_pattern(pattern) {
        let path = PathBuf::from(pattern);
        let below = PathBuf::new();
        return Ok(vec![Match { path, below }]);
    }
    // Without `//` and `/./`, as paths are.
    let names: PathBuf = Path::new(pattern).components().collect();
    let glob = Pattern::new(&names.to_string_lossy())
        .map_err(|error| format!("{pattern}: {}", error.msg))?;
    let (base, depth) = split(pattern);
    let mut all: Vec<Match> = files(&folder.join(&base), depth)?
        .into_iter()
        .filter_map(|below| matched(&glob, &base, &below))
        .collect();
    all.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(all)
}

fn matched(glob: &Pattern, base: &Path, below: &Path) -> Option<Match> {
    let options = MatchOptions {
        require_literal_separator: true,
        ..MatchOptions::new()
    };
    let path = base.join(below);
    let below = below.parent().map(Path::to_owned).unwrap_or_default();
    // A name that is not UTF-8 matches nothing.
    let is_match = glob.matches_path_with(&path, options);
    is_match.then_some(Match { path, below })
}

/// The folder in which the names of `pattern` begin to have wildcards.
pub fn base_of(pattern: &str) -> PathBuf {
    split(pattern).0
}

/// The part of a pattern before the first name with wildcards, and how many names follow; `None`
/// where that is not bounded.
fn split(pattern: &str) -> (PathBuf, Option<usize>) {
    let names: Vec<Component> = Path::new(pattern).components().collect();
    let is_wild = |name: &Component| is_pattern(&name.as_os_str().to_string_lossy());
    let first = names.iter().position(is_wild).unwrap_or(names.len());
    let rest = &names[first..];
    let is_deep = rest.iter().any(|name| name.as_os_str() == "**");
    let base = names[..first].iter().collect();
    (base, (!is_deep).then_some(rest.len()))
}

/// Regular files below `base`, at most `depth` names deep.
fn files(base: &Path, depth: Option<usize>) -> Result<Vec<PathBuf>, String> {
    let root = match base.as_os_str().is_empty() {
        true => Path::new("."),
        false => base,
    };
    if !root.is_dir() {
        return Ok(Vec::new());
    }
    let is_hidden = |name: &std::ffi::OsStr| name.as_encoded_bytes().starts_with(b".");
    let walk = WalkDir::new(root)
        .follow_links(true)
        .max_depth(depth.unwrap_or(usize::MAX))
        .into_iter()
        .filter_entry(|entry| entry.depth() == 0 || !is_hidden(entry.file_name()));
    let mut found = Vec::new();
    for entry in walk {
        let entry = match entry {
            Ok(entry) => entry,
            // A link that leads back up, or nowhere.
            Err(error) if error.loop_ancestor().is_some() => continue,
            Err(error) if error.path().is_some_and(Path::is_symlink) => continue,
            Err(error) => return Err(error.to_string()),
        };
        if entry.file_type().is_file() {
            found.extend(entry.path().strip_prefix(root).map(Path::to_owned));
        }
        if found.len() > MAX_FILES {
            return Err(format!("{}: over {MAX_FILES} files", root.display()));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_files_and_not_folders() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        for path in [
            "maps/a.hdr",
            "maps/b.exr",
            "maps/day/c.hdr",
            "maps/.d.hdr",
            "e.hdr",
        ] {
            let path = at.join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, "").expect("written");
        }
        std::fs::create_dir(at.join("maps/f.hdr")).expect("made");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("..", at.join("maps/day/up")).expect("a link");
            std::os::unix::fs::symlink("nowhere", at.join("maps/z.hdr")).expect("a link");
        }
        for (pattern, expected) in [
            ("maps/*.hdr", vec![("maps/a.hdr", "")]),
            (
                "maps/**/*.hdr",
                vec![("maps/a.hdr", ""), ("maps/day/c.hdr", "day")],
            ),
            ("*/*/?.hdr", vec![("maps/day/c.hdr", "maps/day")]),
            ("*.hdr", vec![("e.hdr", "")]),
            ("maps//*.hdr", vec![("maps/a.hdr", "")]),
            ("maps/./day/.//*.hdr", vec![("maps/day/c.hdr", "")]),
            (
                "maps//**/./*.hdr",
                vec![("maps/a.hdr", ""), ("maps/day/c.hdr", "day")],
            ),
            ("./*//./a.hdr", vec![("./maps/a.hdr", "maps")]),
            ("maps/[ab].*", vec![("maps/a.hdr", ""), ("maps/b.exr", "")]),
            ("none/*.hdr", vec![]),
            ("none.hdr", vec![("none.hdr", "")]),
        ] {
            let found = matches(at, pattern).expect(pattern);
            let found: Vec<_> = found
                .iter()
                .map(|found| (found.path.to_str().unwrap(), found.below.to_str().unwrap()))
                .collect();
            assert_eq!(found, expected, "{pattern}");
        }
        for pattern in ["maps/[", "maps/a**b"] {
            assert!(matches(at, pattern).is_err(), "{pattern}");
        }
        assert_eq!(base_of("maps/day/*/x.hdr"), Path::new("maps/day"));
    }
}
