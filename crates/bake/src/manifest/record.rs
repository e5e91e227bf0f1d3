//! What is known of an item that was made: the file beside its output.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use strandlight_formats::{Error, content_hash, file_hash, read_file, tool_version, write_file};

use super::failure::Failure;
use super::item::Item;

/// A file that an item was made of, or that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Key of the manifest: `map`, `out`.
    pub role: String,
    /// Its name without folders; for messages.
    pub file: String,
    /// Its length.
    pub bytes: u64,
    /// xxh3-64 of its bytes, 16 hexadecimal digits.
    pub hash: String,
}

impl FileRecord {
    /// Of bytes.
    pub fn of_bytes(role: &str, path: &Path, bytes: &[u8]) -> Self {
        FileRecord {
            role: role.to_owned(),
            file: file_name(path),
            bytes: bytes.len() as u64,
            hash: content_hash(bytes),
        }
    }

    /// Of the file at `path`.
    ///
    /// # Errors
    /// `Io`; the path is named.
    pub fn of_file(role: &str, path: &Path) -> Result<Self, Error> {
        let metadata = fs::metadata(path).map_err(|error| Error::from(error).in_file(path))?;
        if !metadata.is_file() {
            let error = std::io::Error::new(std::io::ErrorKind::InvalidInput, "is no regular file");
            return Err(Error::from(error).in_file(path));
        }
        Ok(FileRecord {
            role: role.to_owned(),
            file: file_name(path),
            bytes: metadata.len(),
            hash: file_hash(path)?,
        })
    }
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// All that the bytes of an item's outputs depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// `lights`.
    pub kind: String,
    /// Program and revision of the kind.
    pub made_by: String,
    /// What it was made of.
    pub inputs: Vec<FileRecord>,
    /// Parameters by name, with their defaults.
    pub parameters: BTreeMap<String, String>,
    /// Roles of what is written.
    pub roles: Vec<String>,
    /// Names of the input and the outputs as the manifest has them, where a page tells them; otherwise empty: nothing else
    /// that is written depends on them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
}

/// Role of an output that tells the names of the files.
const PAGE: &str = "page";

impl Fingerprint {
    /// Of `item` as its input is now.
    ///
    /// # Errors
    /// The input cannot be read.
    pub fn of(item: &Item) -> Result<Self, Failure> {
        let role = item.kind.input.unwrap_or_default();
        let inputs = item
            .input_path()
            .map(|path| FileRecord::of_file(role, &path));
        let inputs: Result<Vec<_>, _> = inputs.into_iter().collect();
        Ok(Fingerprint {
            kind: item.kind.name.to_owned(),
            made_by: format!(
                "{}, {} {}",
                tool_version(),
                item.kind.name,
                item.kind.revision
            ),
            inputs: inputs.map_err(|error| Failure::reading(&error))?,
            parameters: item.parameters.clone(),
            roles: item
                .outputs
                .iter()
                .map(|output| output.role.to_owned())
                .collect(),
            names: names_told(item),
        })
    }

    /// The content key: equal for equal inputs, parameters and programs, wherever the files are; with a page, where their names
    /// are equal too.
    pub fn key(&self) -> String {
        let mut words = vec![self.kind.as_str(), &self.made_by];
        words.extend(self.roles.iter().map(String::as_str));
        words.push("");
        let lengths: Vec<String> = self
            .inputs
            .iter()
            .map(|input| input.bytes.to_string())
            .collect();
        for (input, length) in self.inputs.iter().zip(&lengths) {
            words.extend([input.role.as_str(), length, &input.hash]);
        }
        words.push("");
        for (name, value) in &self.parameters {
            words.extend([name.as_str(), value]);
        }
        if !self.names.is_empty() {
            words.push("");
            words.extend(self.names.iter().map(String::as_str));
        }
        // With their lengths, so that words cannot run into each other.
        let text: String = words
            .iter()
            .map(|word| format!("{}:{word},", word.len()))
            .collect();
        content_hash(text.as_bytes())
    }

    /// Does the other one say the same, but for names of files that no output tells?
    pub fn is_same(&self, other: &Fingerprint) -> bool {
        let plain = |of: &Fingerprint| {
            let mut of = of.clone();
            of.inputs.iter_mut().for_each(|input| input.file.clear());
            of
        };
        plain(self) == plain(other)
    }
}

/// [`Fingerprint::names`] of `item`.
fn names_told(item: &Item) -> Vec<String> {
    if !item.outputs.iter().any(|output| output.role == PAGE) {
        return Vec::new();
    }
    let outputs = item.outputs.iter().map(|output| &output.path);
    let paths = item.input.iter().chain(outputs);
    let named = paths.map(|path| path.to_string_lossy().replace('\\', "/"));
    named.collect()
}

/// What was made of an item.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedItem {
    /// Bytes of its outputs, in their order. Nothing in them changes from run to run.
    pub outputs: Vec<Vec<u8>>,
    /// How good it is; no times.
    pub figures: Map<String, Value>,
}

/// What is known of an item that was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of this format.
    pub version: u32,
    /// [`Fingerprint::key`].
    pub key: String,
    /// What it was made of.
    pub made_of: Fingerprint,
    /// What was written.
    pub outputs: Vec<FileRecord>,
    /// How good it is; no times.
    pub figures: Map<String, Value>,
}

/// Why the last attempt failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailureRecord {
    /// [`Fingerprint::key`] of what was tried; `None` if the input could not be read.
    pub key: Option<String>,
    /// One sentence.
    pub error: String,
    /// See [`Failure::is_transient`].
    pub transient: bool,
}

/// Folder of records, in that of the output.
pub const FOLDER: &str = ".strandlight-bake";

/// Longest record, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Longest output name that is part of a record's name, bytes; names have at most 255.
const MAX_NAME: usize = 200;

impl Record {
    /// Version of the format of records.
    pub const VERSION: u32 = 1;

    /// Reads the record at `path`: `Ok(None)` if there is none.
    ///
    /// # Errors
    /// It cannot be read, or is damaged or of another version.
    pub fn read(path: &Path) -> Result<Option<Record>, String> {
        let record: Option<Record> = read_json(path)?;
        match record {
            Some(record) if record.version != Record::VERSION => {
                Err(format!("record of version {}", record.version))
            }
            record => Ok(record),
        }
    }

    /// Writes it to `path`.
    ///
    /// # Errors
    /// What writing answers.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        write_json(path, self)
    }
}

impl FailureRecord {
    /// The one at `path`; `None` if there is none that can be read.
    pub fn read(path: &Path) -> Option<FailureRecord> {
        read_json(path).ok().flatten()
    }

    /// Writes it to `path`.
    ///
    /// # Errors
    /// What writing answers.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        write_json(path, self)
    }
}

fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>, String> {
    match read_file(path, MAX_BYTES) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|error| format!("damaged record: {error}")),
        Err(Error::Io { source, .. })
            if matches!(
                source.kind(),
                std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory
            ) =>
        {
            Ok(None)
        }
        Err(error) => Err(error.to_string()),
    }
}

fn write_json(path: &Path, value: &impl Serialize) -> std::io::Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    write_file(path, &bytes)
}

/// Paths of the records of an item: of success and of failure.
pub struct RecordPaths {
    /// Of [`Record`].
    pub done: PathBuf,
    /// Of [`FailureRecord`].
    pub failed: PathBuf,
}

impl RecordPaths {
    /// Those of `item`, as seen from the current folder.
    pub fn of(item: &Item) -> Self {
        let output = item.resolve(item.output());
        let name = file_name(&output);
        let name = match name.len() <= MAX_NAME {
            true => name,
            false => content_hash(name.as_bytes()),
        };
        let folder = output.with_file_name(FOLDER);
        RecordPaths {
            done: folder.join(format!("{name}.json")),
            failed: folder.join(format!("{name}.failed.json")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fingerprint() -> Fingerprint {
        let input = FileRecord::of_bytes("map", Path::new("maps/a.hdr"), b"abc");
        Fingerprint {
            kind: "lights".to_owned(),
            made_by: "x 1".to_owned(),
            inputs: vec![input],
            parameters: BTreeMap::from([("count".to_owned(), "40".to_owned())]),
            roles: vec!["out".to_owned()],
            names: Vec::new(),
        }
    }

    #[test]
    fn names_count_where_a_page_tells_them() {
        use super::super::item::Output;
        use super::super::text::KindInfo;
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["a.hdr", "b.hdr"] {
            fs::write(folder.path().join(name), "abc").expect("written");
        }
        let item = |map: &str, roles: &[&'static str]| Item {
            kind: KindInfo {
                name: "lights",
                input: Some("map"),
                outputs: &[("out", "lights"), ("page", "html")],
                revision: 1,
            },
            entry: Default::default(),
            input: Some(map.into()),
            outputs: roles
                .iter()
                .map(|role| Output {
                    role,
                    path: PathBuf::from("one").join(role),
                })
                .collect(),
            settings: Vec::new(),
            parameters: BTreeMap::new(),
            folder: folder.path().to_owned(),
        };
        let of = |item: &Item| Fingerprint::of(item).expect("readable");
        let [one, other] = ["a.hdr", "b.hdr"].map(|map| of(&item(map, &["out"])));
        assert_eq!(one.key(), other.key());
        assert!(one.is_same(&other) && one.names.is_empty());
        let [one, other] = ["a.hdr", "b.hdr"].map(|map| of(&item(map, &["out", "page"])));
        assert_ne!(one.key(), other.key());
        assert!(!one.is_same(&other));
        assert_eq!(one.names, ["a.hdr", "one/out", "one/page"]);
        // So do those of outputs.
        let mut moved = item("a.hdr", &["out", "page"]);
        moved.outputs[0].path = "two/out".into();
        assert_ne!(one.key(), of(&moved).key());
    }

    #[test]
    fn keys_are_of_content_and_not_of_names() {
        let one = fingerprint();
        let mut moved = one.clone();
        moved.inputs[0].file = "b.hdr".to_owned();
        assert_eq!(moved.key(), one.key());
        assert!(moved.is_same(&one) && moved != one);
        let changes: [fn(&mut Fingerprint); 7] = [
            |of| of.inputs[0].hash = "0".to_owned(),
            |of| of.inputs[0].bytes += 1,
            |of| of.made_by += "1",
            |of| of.kind += "1",
            |of| of.roles.push("preview".to_owned()),
            |of| drop(of.parameters.insert("seed".to_owned(), "1".to_owned())),
            |of| drop(of.parameters.insert("count".to_owned(), "41".to_owned())),
        ];
        let mut keys = vec![one.key()];
        for change in changes {
            let mut other = one.clone();
            change(&mut other);
            assert!(!other.is_same(&one));
            keys.push(other.key());
        }
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 8);
        // A key outlives the program that made it: caches are full of them.
        assert_eq!(one.key(), "9c4132c9fc2cd50d");
    }

    #[test]
    fn records_come_back_and_damage_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.json");
        assert_eq!(Record::read(&path), Ok(None));
        let record = Record {
            version: Record::VERSION,
            key: fingerprint().key(),
            made_of: fingerprint(),
            outputs: vec![FileRecord::of_bytes("out", Path::new("o/a.lights"), b"")],
            figures: Map::from_iter([("fibre_error".to_owned(), 0.5.into())]),
        };
        record.write(&path).expect("written");
        assert_eq!(Record::read(&path), Ok(Some(record.clone())));
        let bytes = fs::read(&path).expect("read");
        for length in 0..bytes.len() - 1 {
            fs::write(&path, &bytes[..length]).expect("written");
            let error = Record::read(&path).map(|found| found.is_some());
            assert!(error.is_err(), "{length}");
        }
        let later = Record {
            version: 9,
            ..record
        };
        later.write(&path).expect("written");
        assert_eq!(Record::read(&path), Err("record of version 9".to_owned()));
    }
}
