//! A folder of outputs by content key, shared by any number of processes and machines.

use std::io;
use std::path::{Path, PathBuf};

use strandlight_formats::{check_folder, content_hash, read_file, write_file};

use super::record::{BakedItem, FileRecord, Fingerprint, Record};

/// A folder that keeps what was made: `ab/abcd….json` is the record of the key `abcd…`, and
/// `abcd….out` an output by its role.
///
/// Every file is whole or not there, records are written last, and two processes that make the same
/// item write the same bytes. What is read is compared with its record, and that with what was asked
/// for; whatever does not fit is as good as not there.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The cache in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// The folder takes no files.
    pub fn open(folder: &Path) -> io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        check_folder(folder)?;
        let folder = folder.to_owned();
        Ok(Cache { folder })
    }

    fn path(&self, key: &str, end: &str) -> PathBuf {
        let start = key.get(..2).unwrap_or(key);
        self.folder.join(start).join(format!("{key}.{end}"))
    }

    /// What was made of `fingerprint`, if it is here.
    pub fn fetch(&self, fingerprint: &Fingerprint, key: &str) -> Option<BakedItem> {
        let record = Record::read(&self.path(key, "json")).ok().flatten()?;
        if !record.made_of.is_same(fingerprint) || record.key != key {
            return None;
        }
        let outputs = fingerprint.roles.iter().map(|role| {
            let known = record.outputs.iter().find(|file| file.role == *role)?;
            let bytes = read_file(&self.path(key, role), known.bytes).ok()?;
            let is_whole = bytes.len() as u64 == known.bytes && content_hash(&bytes) == known.hash;
            is_whole.then_some(bytes)
        });
        Some(BakedItem {
            outputs: outputs.collect::<Option<_>>()?,
            figures: record.figures,
        })
    }

    /// Keeps what was made.
    ///
    /// # Errors
    /// What writing answers; nothing half written is left.
    pub fn store(&self, fingerprint: &Fingerprint, key: &str, made: &BakedItem) -> io::Result<()> {
        let record_path = self.path(key, "json");
        std::fs::create_dir_all(record_path.parent().unwrap_or(&self.folder))?;
        let mut outputs = Vec::new();
        for (role, bytes) in fingerprint.roles.iter().zip(&made.outputs) {
            let path = self.path(key, role);
            write_file(&path, bytes)?;
            outputs.push(FileRecord::of_bytes(role, &path, bytes));
        }
        let mut made_of = fingerprint.clone();
        // Names are of whoever came first.
        made_of
            .inputs
            .iter_mut()
            .for_each(|input| input.file.clear());
        let record = Record {
            version: Record::VERSION,
            key: key.to_owned(),
            made_of,
            outputs,
            figures: made.figures.clone(),
        };
        record.write(&record_path)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;

    use super::*;

    #[test]
    fn what_is_kept_comes_back_whole_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = Cache::open(&folder.path().join("deep/cache")).expect("made");
        let fingerprint = Fingerprint {
            kind: "k".to_owned(),
            made_by: "p".to_owned(),
            inputs: vec![FileRecord::of_bytes("map", Path::new("a"), b"input")],
            parameters: BTreeMap::new(),
            roles: vec!["out".to_owned(), "preview".to_owned()],
            names: Vec::new(),
        };
        let key = fingerprint.key();
        assert!(cache.fetch(&fingerprint, &key).is_none());
        let made = BakedItem {
            outputs: vec![b"one".to_vec(), b"two".to_vec()],
            // Read fast, it would come back as 0.9452706955539224.
            figures: serde_json::Map::from_iter([("error".to_owned(), 0.9452706955539223.into())]),
        };
        cache.store(&fingerprint, &key, &made).expect("kept");
        let mut moved = fingerprint.clone();
        moved.inputs[0].file = "elsewhere".to_owned();
        let found = cache.fetch(&moved, &key).expect("it is there");
        assert_eq!(found.outputs, made.outputs);
        assert_eq!(found.figures, made.figures);
        // Another item under the same key.
        let mut other = fingerprint.clone();
        other.inputs[0].bytes += 1;
        assert!(cache.fetch(&other, &key).is_none());
        for name in ["out", "preview", "json"] {
            let path = cache.path(&key, name);
            let bytes = fs::read(&path).expect("there");
            for damaged in [&bytes[..bytes.len() - 1], b"", b"xxx"] {
                fs::write(&path, damaged).expect("written");
                let is_found = cache.fetch(&fingerprint, &key).is_some();
                // A record lacks its last line end only.
                assert_eq!(is_found, name == "json" && damaged.len() > 3, "{name}");
            }
            fs::write(&path, bytes).expect("written");
        }
        assert!(cache.fetch(&fingerprint, &key).is_some());
    }
}
