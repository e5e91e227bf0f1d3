//! The text of a manifest: entries with patterns, output names and settings, and where each stands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use strandlight_formats::{Error, FileName, Result, nearest, read_file};
use toml::de::{DeTable, DeValue};

/// A kind of item, as its [`Bakery`](super::Bakery) declares it.
#[derive(Clone, Copy, Debug)]
pub struct KindInfo {
    /// Name of its entries: `lights` for `[[lights]]`.
    pub name: &'static str,
    /// Key of the input's pattern; `None` for what is made of nothing.
    pub input: Option<&'static str>,
    /// Keys of outputs, with the extensions that their names must have; the first one is always
    /// written, the others if asked for.
    pub outputs: &'static [(&'static str, &'static str)],
    /// Raised when the same input gives other bytes while the program's version stays.
    pub revision: u32,
}

impl KindInfo {
    /// Keys of files: the input, if there is one, and the outputs.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        let outputs = self.outputs.iter().map(|(key, _)| *key);
        self.input.into_iter().chain(outputs)
    }

    fn is_name(&self, key: &str) -> bool {
        self.names().any(|name| name == key)
    }
}

/// Where in a manifest something stands, from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

/// A key and its value as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The key.
    pub key: String,
    /// Its value; several of a list.
    pub values: Vec<String>,
    /// Where the value stands, in the entry or in the defaults.
    pub at: Place,
    /// The same as keys, for messages: `lights[0].count`, `defaults.lights.count`.
    pub path: String,
}

/// `[[lights]]` and what is below it, with the defaults of its kind.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its kind.
    pub kind: KindInfo,
    /// `lights[0]`.
    pub name: String,
    /// Where it starts.
    pub at: Place,
    /// Patterns of inputs.
    pub inputs: Option<Setting>,
    /// Output names by their keys, in the order of the kind.
    pub outputs: Vec<Setting>,
    /// Everything else.
    pub settings: Vec<Setting>,
}

/// A manifest that was read.
#[derive(Clone, Debug)]
pub struct Manifest {
    /// As it was named.
    pub path: PathBuf,
    /// Folder that the names in it are relative to.
    pub folder: PathBuf,
    /// Its entries in their order.
    pub entries: Vec<Entry>,
}

/// What a key of a table is told by: its name, its value, and where both stand.
type Pair<'a> = (&'a str, &'a DeValue<'a>, Place, Place);

impl Manifest {
    /// Newest version of the format.
    pub const VERSION: i64 = 1;

    /// Longest text that is read, bytes.
    pub const MAX_BYTES: u64 = 16 << 20;

    /// Reads the manifest at `path`, with entries of `kinds`. The files it names are not looked for.
    ///
    /// # Errors
    /// `Io`; `Syntax` with line and column, also for keys and values that no kind knows.
    pub fn read(path: &Path, kinds: &[KindInfo]) -> Result<Manifest> {
        let bytes = read_file(path, Manifest::MAX_BYTES)?;
        let entries = std::str::from_utf8(&bytes)
            .map_err(|error| Text::default().error(error.valid_up_to(), "not UTF-8 text"))
            .and_then(|text| Text(text).entries(kinds));
        Ok(Manifest {
            entries: entries.map_err(|error| error.in_file(path))?,
            path: path.to_owned(),
            folder: folder_of(path),
        })
    }

    /// An error about something at `at`.
    pub fn error(&self, at: Place, what: impl Into<String>) -> Error {
        syntax_error(at, what).in_file(&self.path)
    }
}

/// Folder that names in the file at `path` are relative to; of what is no regular file the current
/// one.
fn folder_of(path: &Path) -> PathBuf {
    match ["/dev", "/proc"].iter().any(|root| path.starts_with(root)) {
        true => PathBuf::new(),
        false => path.parent().map(Path::to_owned).unwrap_or_default(),
    }
}

fn syntax_error(at: Place, what: impl Into<String>) -> Error {
    Error::Syntax {
        file: FileName::default(),
        line: at.line,
        column: at.column,
        what: what.into(),
    }
}

#[derive(Clone, Copy, Default)]
struct Text<'a>(&'a str);

impl<'a> Text<'a> {
    fn place(self, offset: usize) -> Place {
        let before = &self.0.as_bytes()[..offset.min(self.0.len())];
        let line_start = before.iter().rposition(|&byte| byte == b'\n');
        let line = &before[line_start.map_or(0, |at| at + 1)..];
        Place {
            line: before.iter().filter(|&&byte| byte == b'\n').count() + 1,
            column: String::from_utf8_lossy(line).chars().count() + 1,
        }
    }

    fn error(self, offset: usize, what: impl Into<String>) -> Error {
        syntax_error(self.place(offset), what)
    }

    /// The entries of a table, in the order of the text.
    fn pairs<'b>(self, table: &'b DeTable<'a>) -> Vec<Pair<'b>> {
        let mut pairs: Vec<_> = table.iter().collect();
        pairs.sort_by_key(|(key, _)| key.span().start);
        let pair = pairs.into_iter().map(|(key, value)| {
            let at = [key.span(), value.span()].map(|span| self.place(span.start));
            (&**key.get_ref(), value.get_ref(), at[0], at[1])
        });
        pair.collect()
    }

    fn entries(self, kinds: &[KindInfo]) -> Result<Vec<Entry>> {
        let root = DeTable::parse(self.0).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            self.error(start, error.message().replace('\n', " "))
        })?;
        let pairs = self.pairs(root.get_ref());
        let find = |name: &str| pairs.iter().find(|pair| pair.0 == name);
        self.check_version(find("version"))?;
        let defaults = match find("defaults") {
            Some((_, value, _, at)) => self.defaults(value, *at, kinds)?,
            None => BTreeMap::new(),
        };
        let mut entries = Vec::new();
        for &(key, value, at, value_at) in &pairs {
            if ["version", "defaults"].contains(&key) {
                continue;
            }
            let kind = find_kind("", key, at, kinds, &["version", "defaults"])?;
            let DeValue::Array(list) = value else {
                let what = format!("{key}: must be written as [[{key}]]");
                return Err(syntax_error(value_at, what));
            };
            for (ix, item) in list.iter().enumerate() {
                let name = format!("{key}[{ix}]");
                let at = self.place(item.span().start);
                let DeValue::Table(table) = item.get_ref() else {
                    let what = format!("{name}: must be written as [[{key}]]");
                    return Err(syntax_error(at, what));
                };
                let defaults = defaults.get(key).map_or(&[][..], Vec::as_slice);
                entries.push(self.entry(*kind, name, at, table, defaults)?);
            }
        }
        Ok(entries)
    }

    fn check_version(self, pair: Option<&Pair<'_>>) -> Result<()> {
        let Some((_, value, _, at)) = pair else {
            let what = format!("version is missing: version = {}", Manifest::VERSION);
            return Err(self.error(0, what));
        };
        match scalar(value).and_then(|text| text.parse().ok()) {
            Some(Manifest::VERSION) => Ok(()),
            Some(found) if found > Manifest::VERSION => Err(Error::UnsupportedVersion {
                file: FileName::default(),
                kind: "manifest",
                found: found.to_string(),
                known: Manifest::VERSION as u16,
            }),
            _ => {
                let what = format!("version: must be {}", Manifest::VERSION);
                Err(syntax_error(*at, what))
            }
        }
    }

    /// Settings of `[defaults.KIND]` by kind.
    fn defaults(
        self,
        value: &DeValue<'a>,
        at: Place,
        kinds: &[KindInfo],
    ) -> Result<BTreeMap<&'static str, Vec<Setting>>> {
        let DeValue::Table(table) = value else {
            return Err(syntax_error(at, "defaults: must be tables by kind"));
        };
        let mut all = BTreeMap::new();
        for (key, value, at, value_at) in self.pairs(table) {
            let kind = find_kind("defaults.", key, at, kinds, &[])?;
            let DeValue::Table(table) = value else {
                let what = format!("defaults.{key}: must be a table");
                return Err(syntax_error(value_at, what));
            };
            let settings = self.settings(&format!("defaults.{key}"), kind, table)?;
            let input = settings
                .iter()
                .find(|setting| Some(setting.key.as_str()) == kind.input);
            if let Some(Setting { key, at, .. }) = input {
                let what = format!("defaults.{}.{key}: belongs in [[{0}]]", kind.name);
                return Err(syntax_error(*at, what));
            }
            all.insert(kind.name, settings);
        }
        Ok(all)
    }

    fn settings(self, name: &str, kind: &KindInfo, table: &DeTable<'a>) -> Result<Vec<Setting>> {
        let settings = self.pairs(table).into_iter().map(|(key, value, _, at)| {
            if let Some(other) = kind.is_name(key).then(|| no_name(value)).flatten() {
                let what = format!("{name}.{key}: is {other}, must be a name in quotes");
                return Err(syntax_error(at, what));
            }
            let values = match value {
                DeValue::Array(list) => list.iter().map(|item| scalar(item.get_ref())).collect(),
                value => scalar(value).map(|value| vec![value]),
            };
            let what = || format!("{name}.{key}: must be a text, a number, a boolean or a list");
            Ok(Setting {
                key: key.to_owned(),
                values: values.ok_or_else(|| syntax_error(at, what()))?,
                at,
                path: format!("{name}.{key}"),
            })
        });
        settings.collect()
    }

    fn entry(
        self,
        kind: KindInfo,
        name: String,
        at: Place,
        table: &DeTable<'a>,
        defaults: &[Setting],
    ) -> Result<Entry> {
        let mut settings = self.settings(&name, &kind, table)?;
        let own: Vec<String> = settings.iter().map(|setting| setting.key.clone()).collect();
        let others = defaults.iter().filter(|other| !own.contains(&other.key));
        settings.extend(others.cloned());
        let mut take = |key: &str| {
            let ix = settings.iter().position(|setting| setting.key == key);
            ix.map(|ix| settings.remove(ix))
        };
        let missing = |key: &str| syntax_error(at, format!("{name}: {key} is missing"));
        let inputs = match kind.input {
            Some(key) => Some(take(key).ok_or_else(|| missing(key))?),
            None => None,
        };
        let mut outputs = Vec::new();
        for (ix, (key, _)) in kind.outputs.iter().enumerate() {
            match take(key) {
                Some(setting) if setting.values.len() == 1 => outputs.push(setting),
                Some(setting) => {
                    let what = format!("{}: must be one name", setting.path);
                    return Err(syntax_error(setting.at, what));
                }
                None if ix == 0 => return Err(missing(key)),
                None => {}
            }
        }
        Ok(Entry {
            kind,
            name,
            at,
            inputs,
            outputs,
            settings,
        })
    }
}

fn find_kind<'k>(
    within: &str,
    key: &str,
    at: Place,
    kinds: &'k [KindInfo],
    others: &[&'static str],
) -> Result<&'k KindInfo> {
    let found = kinds.iter().find(|kind| kind.name == key);
    found.ok_or_else(|| {
        let known = || kinds.iter().map(|kind| kind.name).chain(others.to_vec());
        let hint = match nearest(key, known()) {
            Some(name) => format!("; did you mean {within}{name}?"),
            None => format!("; known are {}", known().collect::<Vec<_>>().join(", ")),
        };
        syntax_error(at, format!("{within}{key}: unknown{hint}"))
    })
}

/// The first number or boolean in what must be names.
fn no_name(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::String(_) => None,
        DeValue::Array(list) => list.iter().find_map(|item| no_name(item.get_ref())),
        value => scalar(value),
    }
}

/// A value as it is written on a command line.
fn scalar(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::String(text) => Some(text.clone().into_owned()),
        // Decimal, whatever it was written in.
        DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
            .ok()
            .map(|number| number.to_string()),
        DeValue::Float(number) => Some(number.as_str().replace('_', "")),
        DeValue::Boolean(value) => Some(value.to_string()),
        DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [KindInfo; 2] = [
        KindInfo {
            name: "lights",
            input: Some("map"),
            outputs: &[("out", "lights"), ("preview", "png")],
            revision: 1,
        },
        KindInfo {
            name: "tables",
            input: None,
            outputs: &[("out", "tables")],
            revision: 1,
        },
    ];

    fn entries(text: &str) -> Result<Vec<Entry>> {
        Text(text).entries(&KINDS)
    }

    #[test]
    fn entries_have_the_defaults_of_their_kind() {
        let text = "version = 1\n[defaults.lights]\ncount = 0x28\nseed = 3\n\
                    [[lights]]\nmap = ['a/*.hdr', 'b.exr']\nout = 'o/{stem}.lights'\ncount = 64\n\
                    fine = 1_0.5\nno_report = true\n[[tables]]\nout = 't.tables'\n";
        let entries = entries(text).expect("a manifest");
        assert_eq!(entries.len(), 2);
        let lights = &entries[0];
        assert_eq!(lights.name, "lights[0]");
        let inputs = lights.inputs.as_ref().expect("a pattern");
        assert_eq!(inputs.values, ["a/*.hdr", "b.exr"]);
        assert_eq!(lights.outputs.len(), 1);
        let settings: Vec<_> = lights
            .settings
            .iter()
            .map(|setting| {
                (
                    setting.key.as_str(),
                    setting.values[0].as_str(),
                    setting.at.line,
                )
            })
            .collect();
        let expected = [
            ("count", "64", 8),
            ("fine", "10.5", 9),
            ("no_report", "true", 10),
            ("seed", "3", 4),
        ];
        assert_eq!(settings, expected);
        assert!(entries[1].inputs.is_none());
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        for (text, needle) in [
            ("", "line 1, column 1: version is missing"),
            ("version = 2", "manifest format version 2 is newer"),
            ("version = 'x'", "line 1, column 11: version: must be 1"),
            (
                "version = 1\n[[lihgts]]",
                "line 2, column 3: lihgts: unknown; did you mean lights?",
            ),
            (
                "version = 1\nfrizz = 2",
                "known are lights, tables, version, defaults",
            ),
            (
                "version = 1\n[lights]",
                "lights: must be written as [[lights]]",
            ),
            (
                "version = 1\nlights = [1]",
                "lights[0]: must be written as [[lights]]",
            ),
            (
                "version = 1\n[[lights]]\nmap = ['a', 5]\nout = 'a'",
                "line 3, column 7: lights[0].map: is 5, must be a name in quotes",
            ),
            (
                "version = 1\n[defaults.lights]\npreview = true",
                "defaults.lights.preview: is true, must be a name in quotes",
            ),
            (
                "version = 1\n[[lights]]\nout = 'a'",
                "line 2, column 1: lights[0]: map is missing",
            ),
            (
                "version = 1\n[[lights]]\nmap = 'a'",
                "lights[0]: out is missing",
            ),
            (
                "version = 1\n[[lights]]\nmap = 'a'\nout = ['b', 'c']",
                "line 4, column 7: lights[0].out: must be one name",
            ),
            (
                "version = 1\n[[lights]]\nmap = 'a'\nout = 'b'\ncount = { a = 1 }",
                "line 5, column 9: lights[0].count: must be a text",
            ),
            (
                "version = 1\n[defaults.lights]\nmap = 'a'",
                "defaults.lights.map: belongs in [[lights]]",
            ),
            (
                "version = 1\n[defaults.light]\ncount = 3",
                "defaults.light: unknown; did you mean defaults.lights?",
            ),
            (
                "version = 1\ndefaults = 3",
                "defaults: must be tables by kind",
            ),
            ("version = 1\n[[lights]\n", "line 2, column"),
            ("version = 1\nversion = 1", "duplicate key"),
        ] {
            let error = entries(text).expect_err(text).to_string();
            assert!(error.contains(needle), "{text}: {error}");
        }
    }
}
