//! Writing a changed scene over the text that it was read from, so that comments and layout stay.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::error::Result;
use crate::scene::Scene;

impl Scene {
    /// The text of a scene file, made of `text` by changing the lines of those keys that differ:
    /// comments, order and blanks stay. Where that is not possible, as in
    /// [`Scene::to_toml_string`].
    ///
    /// # Errors
    /// As there.
    pub fn to_toml_over(&self, text: &str) -> Result<String> {
        let plain = self.to_toml_string()?;
        let kept = Scene::from_toml(text).ok().and_then(|old| {
            let old: Table = old.to_toml_string().ok()?.parse().ok()?;
            let changed = changed_text(text, &old, &plain.parse().ok()?)?;
            let mut again = Scene::from_toml(&changed).ok()?;
            again.folder.clone_from(&self.folder);
            (again == *self).then_some(changed)
        });
        Ok(kept.unwrap_or(plain))
    }
}

/// A value as scene files have it after `=`, of one line.
pub fn inline_value<T: DeserializeOwned>(text: &str) -> Option<T> {
    #[derive(Deserialize)]
    struct Line<T> {
        value: T,
    }
    if text.contains(['\n', '\r']) {
        return None;
    }
    let line: Line<T> = toml::from_str(&format!("value = {text}")).ok()?;
    Some(line.value)
}

/// `text` with the keys of sections changed from `old` to `new`; `None` where it is more than that.
fn changed_text(text: &str, old: &Table, new: &Table) -> Option<String> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let none = Table::new();
    let mut names: Vec<&String> = old.keys().chain(new.keys()).collect();
    names.sort();
    names.dedup();
    for name in names {
        let (before, after) = (old.get(name), new.get(name));
        if before == after {
            continue;
        }
        // A section that is gone, a list of sections, or `version`.
        let before = before.map_or(Some(&none), Value::as_table)?;
        let after = after.and_then(Value::as_table)?;
        for (key, value) in after {
            if before.get(key) != Some(value) {
                set(&mut lines, name, key, value)?;
            }
        }
        for key in before.keys().filter(|key| !after.contains_key(*key)) {
            // A key of the preset has no line of its own.
            let Some(line) = line_of(&lines, name, key) else {
                continue;
            };
            comment_start(&lines[line])?;
            lines.remove(line);
        }
    }
    Some(lines.join("\n") + "\n")
}

/// Gives `key` of `section` its value, in its own line or in a new one.
fn set(lines: &mut Vec<String>, section: &str, key: &str, value: &Value) -> Option<()> {
    let is_list = value
        .as_array()
        .is_some_and(|list| list.iter().any(Value::is_table));
    if is_list {
        return None;
    }
    if let Some(line) = line_of(lines, section, key) {
        let (head, rest) = lines[line].split_once('=')?;
        let comment = comment_start(&lines[line])?;
        let comment = &lines[line][comment..];
        let gap = if comment.is_empty() { "" } else { " " };
        // Comments stay in their column where there is room.
        let blanks =
            rest.len() - rest[..rest.len() - comment.len()].trim_end().len() - comment.len();
        let old = rest[..rest.len() - comment.len()].trim().len();
        let written = value.to_string();
        let pad = (old + blanks).saturating_sub(written.len()).max(gap.len());
        let pad = if comment.is_empty() { 0 } else { pad };
        let changed = format!("{}= {written}{}{comment}", head, " ".repeat(pad));
        lines[line] = changed;
        return Some(());
    }
    let written = format!("{key} = {value}");
    match body_of(lines, section) {
        Some((start, end)) => {
            let last = (start..end).rev().find(|&ix| !is_idle(&lines[ix]));
            lines.insert(last.map_or(start, |last| last + 1), written);
        }
        None => lines.extend([String::new(), format!("[{section}]"), written]),
    }
    Some(())
}

/// Nothing or a comment.
fn is_idle(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with('#')
}

/// The lines after the header of `section`, up to the next header.
fn body_of(lines: &[String], section: &str) -> Option<(usize, usize)> {
    let header = |line: &str| {
        Some(
            line.trim()
                .strip_prefix('[')?
                .split(']')
                .next()?
                .trim()
                .to_owned(),
        )
    };
    let start = lines
        .iter()
        .position(|line| header(line).is_some_and(|name| name == section))?;
    let body = &lines[start + 1..];
    let length = body
        .iter()
        .position(|line| line.trim_start().starts_with('['));
    Some((start + 1, start + 1 + length.unwrap_or(body.len())))
}

/// The line of `key` in `section`.
fn line_of(lines: &[String], section: &str, key: &str) -> Option<usize> {
    let (start, end) = body_of(lines, section)?;
    (start..end).find(|&ix| {
        let name = lines[ix].split_once('=').map(|(name, _)| name.trim());
        name == Some(key)
    })
}

/// Where the comment of a line begins, or its end; `None` if the value goes on in the next line.
fn comment_start(line: &str) -> Option<usize> {
    let is_whole = |text: &str| text.parse::<Table>().is_ok();
    if let Some(at) = line
        .match_indices('#')
        .map(|(at, _)| at)
        .find(|&at| is_whole(&line[..at]))
    {
        return Some(at);
    }
    is_whole(line).then_some(line.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# A head of hair.
version = 1

[groom]
file = 'a#b.groom'  # not a comment in the name

[lights]
file = \"b.lights\"
intensity = 1.0                    # factor

[hair]
preset = \"blond\"
eta = 1.5   # index
shift_deg = { r = -5.0, tt = 2.5, trt = 7.5 }
# The end.
";

    fn over(change: impl FnOnce(&mut Scene)) -> (Scene, String) {
        let mut scene = Scene::from_toml(TEXT).expect("valid");
        change(&mut scene);
        let text = scene.to_toml_over(TEXT).expect("valid");
        assert_eq!(Scene::from_toml(&text).expect("valid"), scene, "{text}");
        (scene, text)
    }

    #[test]
    fn only_lines_of_changed_keys_change() {
        assert_eq!(over(|_| ()).1, TEXT);
        let (_, text) = over(|scene| {
            scene.hair.eta = 1.625;
            scene.lights.intensity = 2.0;
        });
        let expected = TEXT
            .replace("eta = 1.5   # index", "eta = 1.625 # index")
            .replace("intensity = 1.0 ", "intensity = 2.0 ");
        assert_eq!(text, expected);
    }

    #[test]
    fn keys_come_and_go() {
        let (_, text) = over(|scene| {
            scene.lights.rotate_deg = 30.0;
            scene.render.exposure = 1.0;
            scene.hair.reflectance = Some([0.5, 0.4, 0.3]);
            scene.groom.file = "c.groom".into();
        });
        for line in [
            "# A head of hair.",
            "rotate_deg = 30.0",
            "[render]\nexposure = 1.0",
            "reflectance = [0.5, 0.4, 0.3]",
            "# not a comment in the name",
            "# The end.",
        ] {
            assert!(text.contains(line), "{line}: {text}");
        }
        assert!(
            !text.contains("width_deg"),
            "what did not change is not written: {text}"
        );
        let mut scene = Scene::from_toml(&text).expect("valid");
        scene.hair.reflectance = None;
        scene.hair.sigma_a = [1.0, 2.0, 3.0];
        let again = scene.to_toml_over(&text).expect("valid");
        assert!(
            !again.contains("reflectance") && again.contains("# The end."),
            "{again}"
        );
    }

    #[test]
    fn what_cannot_be_kept_is_written_anew() {
        let (scene, text) = over(|scene| scene.lights.adjust_mut(1).intensity = 2.0);
        assert_eq!(text, scene.to_toml_string().expect("valid"));
        for text in [
            "",
            "lights.file = 'b'\nversion = 1\n[groom]\nfile = 'a'\n[hair]\nsigma_a = [1,\n2,\n3]",
        ] {
            let mut scene = Scene::new("a", "b");
            scene.hair.sigma_a = [3.0, 2.0, 1.0];
            let over = scene.to_toml_over(text).expect("valid");
            assert_eq!(over, scene.to_toml_string().expect("valid"));
        }
    }
}
