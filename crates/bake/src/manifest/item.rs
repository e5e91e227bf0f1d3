//! What a manifest asks for, one item for each input.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

use strandlight_formats::{Error, Result, nearest};

use super::template::fill;
use super::text::{Entry, KindInfo, Manifest, Place, Setting};
use super::walk::{self, MAX_FILES, Match, is_pattern};

/// A file that an item writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Its key in the manifest: `out`, `preview`.
    pub role: &'static str,
    /// Its path, relative to the manifest's folder.
    pub path: PathBuf,
}

/// One thing to make.
#[derive(Clone, Debug)]
pub struct Item {
    /// Its kind.
    pub kind: KindInfo,
    /// Name of the entry that asks for it, `lights[0]`, and where that starts.
    pub entry: (String, Place),
    /// What it is made of, relative to the manifest's folder.
    pub input: Option<PathBuf>,
    /// What is written; the first one names the item.
    pub outputs: Vec<Output>,
    /// Its settings as the manifest has them.
    pub settings: Vec<Setting>,
    /// All parameters by name, with their defaults: what the outputs depend on besides the input.
    pub parameters: BTreeMap<String, String>,
    /// The manifest's folder.
    pub folder: PathBuf,
}

impl Item {
    /// The main output as the manifest names it.
    pub fn name(&self) -> String {
        self.output().to_string_lossy().replace('\\', "/")
    }

    /// The main output, relative to the manifest's folder.
    pub fn output(&self) -> &Path {
        &self.outputs[0].path
    }

    /// `path` as seen from the current folder.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }

    /// The input's path as seen from the current folder.
    pub fn input_path(&self) -> Option<PathBuf> {
        self.input.as_deref().map(|path| self.resolve(path))
    }
}

/// Parameters of a kind with these settings, or the key to blame (empty: none alone) and what is
/// wrong.
pub type Resolved = std::result::Result<BTreeMap<String, String>, (String, String)>;

/// The items of `manifest`, sorted by output; `resolve` answers the parameters of an entry. Inputs
/// are found and not opened.
///
/// # Errors
/// A pattern that matches nothing, an output of two items, an output that is an input: `Syntax`, with
/// the place in the manifest.
pub fn items(manifest: &Manifest, resolve: &dyn Fn(&Entry) -> Resolved) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    for entry in &manifest.entries {
        let parameters = resolve(entry).map_err(|(key, what)| {
            let mut settings = entry.settings.iter().chain(&entry.outputs);
            let (at, path) = match settings.find(|setting| setting.key == key) {
                Some(setting) => (setting.at, setting.path.clone()),
                None => (entry.at, key_path(entry, &key)),
            };
            manifest.error(at, format!("{path}: {what}"))
        })?;
        for input in inputs(manifest, entry)? {
            let item = item(manifest, entry, input, &parameters)?;
            items.push(item);
            if items.len() > MAX_FILES {
                let what = format!("{}: over {MAX_FILES} items", entry.name);
                return Err(manifest.error(entry.at, what));
            }
        }
    }
    // By bytes: the same everywhere.
    items.sort_by(|a, b| a.output().as_os_str().cmp(b.output().as_os_str()));
    check_names(manifest, &items)?;
    Ok(items)
}

fn key_path(entry: &Entry, key: &str) -> String {
    match key {
        "" => entry.name.clone(),
        key => format!("{}.{key}", entry.name),
    }
}

/// Says of a key that no kind knows what was meant.
pub fn unknown_key<'a>(key: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(key, known.clone()) {
        Some(name) => format!("unknown; did you mean {name}?"),
        None => format!(
            "unknown; known are {}",
            known.collect::<Vec<_>>().join(", ")
        ),
    }
}

/// The inputs of an entry, each once; `None` for an item that has none.
fn inputs(manifest: &Manifest, entry: &Entry) -> Result<Vec<Option<Match>>> {
    let Some(patterns) = &entry.inputs else {
        return Ok(vec![None]);
    };
    let error = |what: String| manifest.error(patterns.at, format!("{}: {what}", patterns.path));
    let mut all: Vec<Match> = Vec::new();
    for pattern in &patterns.values {
        let found = walk::matches(&manifest.folder, pattern).map_err(error)?;
        if found.is_empty() {
            return Err(error(format!("no file matches {pattern}")));
        }
        all.extend(found);
    }
    if all.is_empty() {
        return Err(error("names no file".to_owned()));
    }
    all.sort_by(|a, b| a.path.cmp(&b.path));
    all.dedup_by(|a, b| a.path == b.path);
    Ok(all.into_iter().map(Some).collect())
}

fn item(
    manifest: &Manifest,
    entry: &Entry,
    input: Option<Match>,
    parameters: &BTreeMap<String, String>,
) -> Result<Item> {
    let mut outputs = Vec::new();
    for setting in &entry.outputs {
        let error = |what: String| manifest.error(setting.at, format!("{}: {what}", setting.path));
        let known = entry.kind.outputs.iter();
        let found = known.copied().find(|(role, _)| *role == setting.key);
        let (role, extension) = found.unwrap_or_default();
        let input = input.as_ref();
        let input = input.map(|found| (found.path.as_path(), found.below.as_path()));
        let name = fill(&setting.values[0], input).map_err(error)?;
        let path = PathBuf::from(&name);
        let end = path.extension().and_then(|end| end.to_str());
        if end.is_none_or(|end| !end.eq_ignore_ascii_case(extension)) {
            return Err(error(format!("{name} must end in .{extension}")));
        }
        outputs.push(Output { role, path });
    }
    Ok(Item {
        kind: entry.kind,
        entry: (entry.name.clone(), entry.at),
        input: input.map(|found| found.path),
        outputs,
        settings: entry.settings.clone(),
        parameters: parameters.clone(),
        folder: manifest.folder.clone(),
    })
}

/// Refuses a file that two items write, one that is both written and read, and the manifest as an output. Files whose names
/// differ by capitals alone count as one: on Windows and macOS they are.
fn check_names(manifest: &Manifest, items: &[Item]) -> Result<()> {
    let mut makers: HashMap<PathBuf, &Item> = HashMap::new();
    let mut in_small_letters: HashMap<String, (&Item, &Path)> = HashMap::new();
    let small = |path: &Path| path.to_str().map(str::to_lowercase);
    let same_as = |what: &str| {
        format!("is the same file as {what} on Windows and macOS, where capitals do not count")
    };
    let output_of = |(maker, path): (&Item, &Path)| {
        same_as(&format!(
            "{}, an output of {},",
            path.display(),
            maker.entry.0
        ))
    };
    let own = plain(&manifest.path);
    for item in items {
        for output in &item.outputs {
            let path = plain(&manifest.folder.join(&output.path));
            if path == own {
                return Err(clash(manifest, item, &output.path, "is the manifest"));
            }
            let lower = small(&path);
            if lower.is_some() && lower == small(&own) {
                let what = same_as(&format!("the manifest {}", manifest.path.display()));
                return Err(clash(manifest, item, &output.path, &what));
            }
            let Some(other) = makers.insert(path, item) else {
                let other =
                    lower.and_then(|lower| in_small_letters.insert(lower, (item, &output.path)));
                let Some(other) = other else { continue };
                return Err(clash(manifest, item, &output.path, &output_of(other)));
            };
            let of = |item: &Item| match &item.input {
                Some(input) => input.display().to_string(),
                None => item.entry.0.clone(),
            };
            let what = match std::ptr::eq(other, item) {
                true => "is named twice".to_owned(),
                false => format!(
                    "is the output of {} and of {}; {{dir}} or {{name}} in its name may tell them apart",
                    of(other),
                    of(item)
                ),
            };
            return Err(clash(manifest, item, &output.path, &what));
        }
    }
    for item in items {
        let Some(input) = &item.input else { continue };
        let path = plain(&manifest.folder.join(input));
        let what = match makers.get(&path) {
            Some(maker) if std::ptr::eq(*maker, item) => {
                "is both its input and its output".to_owned()
            }
            Some(maker) => format!(
                "is both an input and the output of {}; items have no order, so put the steps \
                 into two manifests",
                maker.entry.0
            ),
            None => {
                let other = small(&path).and_then(|path| in_small_letters.get(&path));
                let Some(other) = other else { continue };
                output_of(*other)
            }
        };
        return Err(clash(manifest, item, input, &what));
    }
    Ok(())
}

fn clash(manifest: &Manifest, item: &Item, path: &Path, what: &str) -> Error {
    let (entry, at) = &item.entry;
    manifest.error(*at, format!("{entry}: {} {what}", path.display()))
}

/// `path` without `.` and with `..` taken back where a name stands before it.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(plain.components().next_back(), Some(Component::Normal(_))) =>
            {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

/// Folders that patterns of `manifest` look into: they change when a file comes or goes. Those are
/// left out in which an output lies, or a file of `beside`, as seen from the current folder: every
/// run would change them. A folder below is made once, before the outputs in it.
pub fn watched_folders(manifest: &Manifest, items: &[Item], beside: &[&Path]) -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = items
        .iter()
        .filter_map(|item| item.input.as_deref().and_then(Path::parent))
        .map(Path::to_owned)
        .collect();
    let entries = manifest.entries.iter();
    let patterns = entries.flat_map(|entry| entry.inputs.iter().flat_map(|list| &list.values));
    let wild: Vec<&String> = patterns.filter(|pattern| is_pattern(pattern)).collect();
    let bases: Vec<PathBuf> = wild.iter().map(|pattern| walk::base_of(pattern)).collect();
    folders.retain(|folder| bases.iter().any(|base| folder.starts_with(base)));
    folders.extend(bases);
    folders.sort();
    folders.dedup();
    let outputs = items.iter().flat_map(|item| &item.outputs);
    let outputs = outputs.map(|output| manifest.folder.join(&output.path));
    let beside = beside.iter().map(|path| path.to_path_buf());
    let written: HashSet<PathBuf> = outputs
        .chain(beside)
        .filter_map(|path| path.parent().map(whole))
        .collect();
    folders.retain(|folder| !written.contains(&whole(&manifest.folder.join(folder))));
    folders
}

/// The [`plain`] path from the root, so that names from different folders compare.
fn whole(path: &Path) -> PathBuf {
    let path = Path::new(".").join(path);
    plain(&std::path::absolute(&path).unwrap_or(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHTS: KindInfo = KindInfo {
        name: "lights",
        input: Some("map"),
        outputs: &[("out", "lights"), ("preview", "png")],
        revision: 1,
    };

    fn found(folder: &Path, text: &str) -> Result<Vec<Item>> {
        let path = folder.join("bake.toml");
        std::fs::write(&path, format!("version = 1\n{text}")).expect("written");
        let manifest = Manifest::read(&path, &[LIGHTS])?;
        items(&manifest, &|_| Ok(BTreeMap::new()))
    }

    #[test]
    fn items_are_sorted_and_each_input_is_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        for name in ["b.hdr", "a.hdr", "a.exr"] {
            std::fs::write(at.join(name), "").expect("written");
        }
        let text =
            "[[lights]]\nmap = ['*.hdr', 'a.*']\nout = 'o/{name}.lights'\npreview = 'p/{name}.png'";
        let all = found(at, text).expect("items");
        let names: Vec<String> = all.iter().map(Item::name).collect();
        assert_eq!(
            names,
            ["o/a.exr.lights", "o/a.hdr.lights", "o/b.hdr.lights"]
        );
        assert_eq!(all[0].outputs[1].path, Path::new("p/a.exr.png"));
        assert_eq!(all[0].input.as_deref(), Some(Path::new("a.exr")));
        let manifest = Manifest::read(&at.join("bake.toml"), &[LIGHTS]).expect("read");
        assert_eq!(watched_folders(&manifest, &all, &[]), [Path::new("")]);
    }

    #[test]
    fn folders_are_watched_unless_a_file_is_written_right_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        std::fs::create_dir(at.join("maps")).expect("made");
        for name in ["a.hdr", "maps/b.hdr"] {
            std::fs::write(at.join(name), "").expect("written");
        }
        for (map, out, beside, expected) in [
            ("*.hdr", "out/{stem}.lights", "out/bake.d", &[""][..]),
            ("*.hdr", "out/{stem}.lights", "bake.d", &[]),
            ("*.hdr", "{stem}.lights", "out/bake.d", &[]),
            ("maps/*.hdr", "maps/out/{stem}.lights", "bake.d", &["maps"]),
            (
                "maps/*.hdr",
                "out/{stem}.lights",
                "maps/../bake.d",
                &["maps"],
            ),
            ("maps/*.hdr", "out/{stem}.lights", "maps/bake.d", &[]),
            ("maps/*.hdr", "maps/{stem}.lights", "bake.d", &[]),
            ("maps/*.hdr", "out/../maps/{stem}.lights", "bake.d", &[]),
        ] {
            let text = format!("[[lights]]\nmap = '{map}'\nout = '{out}'");
            let all = found(at, &text).expect("items");
            let manifest = Manifest::read(&at.join("bake.toml"), &[LIGHTS]).expect("read");
            let watched = watched_folders(&manifest, &all, &[&at.join(beside)]);
            let expected: Vec<PathBuf> = expected.iter().map(PathBuf::from).collect();
            assert_eq!(watched, expected, "{map} {out} {beside}");
        }
        // Names as seen from the current folder.
        let here = std::path::absolute(".").expect("a folder");
        assert_eq!(whole(Path::new("")), here);
        assert_eq!(whole(Path::new("a/../b")), here.join("b"));
    }

    #[test]
    fn clashes_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        for name in ["a.hdr", "a.exr", "x.lights"] {
            std::fs::write(at.join(name), "").expect("written");
        }
        for (text, needle) in [
            (
                "[[lights]]\nmap = 'a.*'\nout = '{stem}.lights'",
                "lights[0]: a.lights is the output of a.exr and of a.hdr",
            ),
            (
                "[[lights]]\nmap = 'a.hdr'\nout = 'o/../b.lights'\n[[lights]]\nmap = 'a.hdr'\nout = './b.lights'",
                "b.lights is the output of",
            ),
            (
                "[[lights]]\nmap = 'a.hdr'\nout = 'O/b.lights'\n[[lights]]\nmap = 'a.hdr'\nout = 'o/B.lights'",
                "lights[1]: o/B.lights is the same file as O/b.lights, an output of lights[0], on Windows and macOS",
            ),
            (
                "[[lights]]\nmap = 'x.lights'\nout = 'o/../X.lights'",
                "lights[0]: x.lights is the same file as o/../X.lights, an output of lights[0], on Windows",
            ),
            (
                "[[lights]]\nmap = 'a.hdr'\nout = 'X.lights'\n[[lights]]\nmap = 'x.lights'\nout = 'y.lights'",
                "lights[1]: x.lights is the same file as X.lights, an output of lights[0], on Windows",
            ),
            (
                "[[lights]]\nmap = 'x.lights'\nout = 'y/../x.lights'",
                "is both its input and its output",
            ),
            (
                "[[lights]]\nmap = 'y.lights'\nout = 'x.lights'\n[[lights]]\nmap = 'x.lights'\nout = 'y.lights'",
                "is both an input and the output of",
            ),
            (
                "[[lights]]\nmap = 'q*.hdr'\nout = 'a.lights'",
                "lights[0].map: no file matches q*.hdr",
            ),
            ("[[lights]]\nmap = []\nout = 'a.lights'", "names no file"),
            (
                "[[lights]]\nmap = 'a.hdr'\nout = 'a.groom'",
                "a.groom must end in .lights",
            ),
            (
                "[[lights]]\nmap = 'a.hdr'\nout = '{x}.lights'",
                "{x} is unknown",
            ),
        ] {
            let error = found(at, text).expect_err(text).to_string();
            assert!(
                error.contains(needle) && error.contains("bake.toml:"),
                "{text}: {error}"
            );
        }
    }

    #[test]
    fn an_output_is_not_the_manifest_by_other_capitals() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        std::fs::write(at.join("a.hdr"), "").expect("written");
        let path = at.join("bake.lights");
        for (out, needle) in [
            ("bake.lights", "lights[0]: bake.lights is the manifest"),
            (
                "Bake.lights",
                "lights[0]: Bake.lights is the same file as the manifest",
            ),
        ] {
            let text = format!("version = 1\n[[lights]]\nmap = 'a.hdr'\nout = '{out}'");
            std::fs::write(&path, text).expect("written");
            let manifest = Manifest::read(&path, &[LIGHTS]).expect("read");
            let error = items(&manifest, &|_| Ok(BTreeMap::new())).expect_err(out);
            assert!(error.to_string().contains(needle), "{error}");
        }
    }
}
