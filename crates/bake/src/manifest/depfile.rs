//! What outputs depend on, in the syntax of Make, which Ninja reads too.

use std::path::{Path, PathBuf};

use super::item::{Item, watched_folders};
use super::text::Manifest;

/// The rules of `items`: one for each item, or a single one of `target`. Names are as seen from the
/// current folder. Each depends on the manifest, its input, and the folders that patterns look into
/// (unless outputs or files of `beside`, such as the depfile, are written right there, which changes
/// them). Inputs have an empty rule of their own, so that Make goes on when one is gone.
///
/// # Errors
/// A name that the syntax cannot express.
pub fn depfile(
    manifest: &Manifest,
    items: &[Item],
    target: Option<&str>,
    beside: &[&Path],
) -> Result<String, String> {
    let mut common = Vec::new();
    // Standard input changes with every run.
    if manifest.path != Path::new("-") {
        common.push(manifest.path.clone());
    }
    let folders = watched_folders(manifest, items, beside);
    common.extend(
        folders
            .iter()
            .map(|folder| match manifest.folder.join(folder) {
                folder if folder.as_os_str().is_empty() => PathBuf::from("."),
                folder => folder,
            }),
    );
    let inputs = items.iter().filter_map(Item::input_path);
    let mut inputs: Vec<PathBuf> = inputs.collect();
    let mut text = String::new();
    let mut rule = |targets: &[String], needs: &[&PathBuf]| -> Result<(), String> {
        text += &format!("{}:", targets.join(" "));
        for path in needs {
            text += &format!(" \\\n  {}", escaped(path)?);
        }
        text += "\n";
        Ok(())
    };
    match target {
        Some(target) => {
            let needs: Vec<&PathBuf> = common.iter().chain(&inputs).collect();
            rule(&[escaped(Path::new(target))?], &needs)?;
        }
        None => {
            for item in items {
                let outputs = item.outputs.iter().map(|output| item.resolve(&output.path));
                let targets: Result<Vec<_>, _> = outputs.map(|path| escaped(&path)).collect();
                let input = item.input_path();
                let needs: Vec<&PathBuf> = common.iter().chain(&input).collect();
                rule(&targets?, &needs)?;
            }
        }
    }
    inputs.extend(common);
    inputs.sort();
    inputs.dedup();
    for input in &inputs {
        text += &format!("{}:\n", escaped(input)?);
    }
    Ok(text)
}

/// `path` as compilers write it for both programs.
fn escaped(path: &Path) -> Result<String, String> {
    let cannot = |what: &str| format!("{}: {what}, which a depfile cannot express", path.display());
    let text = path.to_str().ok_or_else(|| cannot("is not UTF-8"))?;
    if text.contains(['\n', '\r']) {
        return Err(cannot("its name has a line end"));
    }
    let mut escaped = String::new();
    let mut slashes = 0;
    for c in text.chars() {
        match c {
            // Backslashes before a space count twice.
            ' ' | '\t' => escaped += &"\\".repeat(slashes + 1),
            '#' | ':' => escaped.push('\\'),
            '$' => escaped.push('$'),
            _ => {}
        }
        slashes = if c == '\\' { slashes + 1 } else { 0 };
        escaped.push(c);
    }
    Ok(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_as_compilers_do() {
        for (name, expected) in [
            ("a/b.hdr", "a/b.hdr"),
            ("a b.hdr", "a\\ b.hdr"),
            ("a\\ b", "a\\\\\\ b"),
            ("$a#b", "$$a\\#b"),
            ("c:d", "c\\:d"),
        ] {
            assert_eq!(escaped(Path::new(name)).as_deref(), Ok(expected));
        }
        assert!(escaped(Path::new("a\nb")).is_err());
    }
}
