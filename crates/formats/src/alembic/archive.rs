//! Objects and their properties, as the headers of an archive list them.

use super::cursor::Cursor;
use super::ogawa::{Group, Ogawa};
use super::pod::{Pod, Values};
use super::sampling::Sampling;
use crate::error::{Error, Result};

/// A file whose tables are read.
pub(super) struct Archive<'a> {
    pub ogawa: Ogawa<'a>,
    /// Times of samples; properties name them by index.
    pub samplings: Vec<Sampling>,
    /// Texts that headers name by index.
    metadata: Vec<&'a str>,
    /// The object at the top.
    pub top: Object<'a>,
}

/// An object of the tree.
#[derive(Clone, Copy)]
pub(super) struct Object<'a> {
    pub name: &'a str,
    /// `key=value;key=value`.
    pub metadata: &'a str,
    /// Properties first, then children, then their headers.
    group: Group<'a>,
}

/// Properties under their names.
#[derive(Clone, Default)]
pub(super) struct Compound<'a> {
    pub properties: Vec<Property<'a>>,
}

/// What a property holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Other properties.
    Compound,
    /// One value a sample.
    Scalar,
    /// Any number of values a sample.
    Array,
}

/// A property, as its header says.
#[derive(Clone, Copy)]
pub(super) struct Property<'a> {
    pub name: &'a str,
    pub metadata: &'a str,
    pub kind: Kind,
    pub pod: Pod,
    /// Values of the type that make one element.
    pub extent: u8,
    /// Number of samples.
    pub n_samples: u32,
    /// First and last sample that differ from the one before; both 0 if none does.
    pub changes: [u32; 2],
    /// Index of its sampling.
    pub sampling: u32,
    /// Its group.
    reference: u64,
}

/// The value of `key` in a text of metadata.
pub(super) fn metadata_value<'a>(metadata: &'a str, key: &str) -> Option<&'a str> {
    let mut pairs = metadata.split(';').filter_map(|pair| pair.split_once('='));
    pairs
        .find(|(found, _)| *found == key)
        .map(|(_, value)| value)
}

impl<'a> Compound<'a> {
    /// The property called `name`.
    pub fn get(&self, name: &str) -> Option<&Property<'a>> {
        self.properties
            .iter()
            .find(|property| property.name == name)
    }
}

impl Property<'_> {
    /// Do its samples differ?
    pub fn varies(&self) -> bool {
        self.n_samples > 1 && self.changes != [0, 0]
    }

    /// Where the file keeps sample `ix`.
    fn stored(&self, ix: u32) -> usize {
        let [first, last] = self.changes;
        let stored = match ix.min(self.n_samples.saturating_sub(1)) {
            _ if last == 0 => 0,
            ix if ix < first => 0,
            ix => ix.min(last).saturating_sub(first).saturating_add(1),
        };
        stored as usize
    }
}

impl<'a> Archive<'a> {
    /// Reads the tables of a file.
    pub fn new(bytes: &'a [u8]) -> Result<Self> {
        let (ogawa, root) = Ogawa::new(bytes)?;
        let part = |ix: usize, what: &str| root.child(ix, || what.to_owned());
        let data = |ix: usize, what: &'static str| {
            let (bytes, offset) = ogawa.data(part(ix, what)?, || what.to_owned())?;
            Ok::<_, Error>(Cursor::new(bytes, offset, what))
        };
        let version = data(0, "the version of the archive")?.word()?;
        if version != 0 {
            return Err(Error::UnsupportedVersion {
                file: Default::default(),
                kind: "Alembic archive",
                found: version.to_string(),
                known: 0,
            });
        }
        let top = ogawa.group(part(2, "the top object")?, || "the top object".to_owned())?;
        let mut samplings = Vec::new();
        let mut table = data(4, "the table of time samplings")?;
        while !table.is_empty() {
            samplings.push(Sampling::read(&mut table)?);
        }
        let mut metadata = vec![""];
        let mut table = data(5, "the table of metadata")?;
        while !table.is_empty() {
            let length = table.byte()?;
            ogawa.spend(16, table.offset)?;
            metadata.push(table.text(u32::from(length))?);
        }
        Ok(Archive {
            ogawa,
            samplings,
            metadata,
            top: Object {
                name: "",
                metadata: "",
                group: top,
            },
        })
    }

    /// The objects below `object`, which is called `path`.
    pub fn children(&self, object: &Object<'a>, path: &str) -> Result<Vec<Object<'a>>> {
        let group = object.group;
        if group.len() < 2 {
            return Ok(Vec::new());
        }
        let what = || format!("the list of children of {path:?}");
        let last = group.child(group.len() - 1, what)?;
        let (bytes, offset) = self.ogawa.data(last, what)?;
        // Behind the headers stand two hashes.
        let headers = &bytes[..bytes.len().saturating_sub(32)];
        let name = format!("the list of children of {path:?}");
        let mut cursor = Cursor::new(headers, offset, &name);
        let mut children = Vec::new();
        while !cursor.is_empty() {
            let length = cursor.word()?;
            let name = cursor.text(length)?;
            let metadata = match cursor.byte()? {
                u8::MAX => {
                    let length = cursor.word()?;
                    cursor.text(length)?
                }
                ix => self.metadata(ix, &cursor)?,
            };
            let what = || format!("child {name:?} of {path:?}");
            let group = self
                .ogawa
                .group(group.child(children.len() + 1, what)?, what)?;
            self.ogawa.spend(size_of::<Object<'_>>() as u64, offset)?;
            children.push(Object {
                name,
                metadata,
                group,
            });
        }
        Ok(children)
    }

    /// The properties of `object`, which is called `path`.
    pub fn properties(&self, object: &Object<'a>, path: &str) -> Result<Compound<'a>> {
        match object.group.len() {
            0 => Ok(Compound::default()),
            _ => {
                let what = || format!("the properties of {path:?}");
                self.read_compound(object.group.child(0, what)?, path)
            }
        }
    }

    /// The properties in `property` of the object called `path`; none if it is no compound.
    pub fn compound(&self, property: Option<&Property<'a>>, path: &str) -> Result<Compound<'a>> {
        match property {
            Some(property) if property.kind == Kind::Compound => {
                self.read_compound(property.reference, path)
            }
            _ => Ok(Compound::default()),
        }
    }

    fn read_compound(&self, reference: u64, path: &str) -> Result<Compound<'a>> {
        let what = || format!("the properties of {path:?}");
        let group = self.ogawa.group(reference, what)?;
        if group.len() == 0 {
            return Ok(Compound::default());
        }
        let last = group.child(group.len() - 1, what)?;
        let (headers, offset) = self.ogawa.data(last, what)?;
        let name = format!("the list of properties of {path:?}");
        let mut cursor = Cursor::new(headers, offset, &name);
        let mut properties = Vec::new();
        while !cursor.is_empty() {
            self.ogawa.spend(size_of::<Property<'_>>() as u64, offset)?;
            let mut property = self.header(&mut cursor)?;
            let what = || format!("property {:?} of {path:?}", property.name);
            property.reference = group.child(properties.len(), what)?;
            properties.push(property);
        }
        Ok(Compound { properties })
    }

    /// The header of a property.
    ///
    /// | bits | of the first word |
    /// |---|---|
    /// | 0..2 | 0 compound, 1 scalar, 2 array, 3 array of one element |
    /// | 2..4 | bytes of each number behind it: 1, 2 or 4 |
    /// | 4..8 | type of the values |
    /// | 8 | there is an index of a sampling |
    /// | 9 | there are the first and the last sample that change |
    /// | 10 | all samples are of one length |
    /// | 11 | no sample changes |
    /// | 12..20 | extent |
    /// | 20..28 | index of the metadata, 255 for metadata in place |
    fn header(&self, cursor: &mut Cursor<'a, '_>) -> Result<Property<'a>> {
        let start = cursor.offset;
        let info = cursor.word()?;
        let width = (info >> 2) & 3;
        let kind = match info & 3 {
            0 => Kind::Compound,
            1 => Kind::Scalar,
            _ => Kind::Array,
        };
        let (mut n_samples, mut changes, mut sampling) = (0, [0, 0], 0);
        let mut pod = Pod::Bool;
        if kind != Kind::Compound {
            pod = Pod::from_code((info >> 4) & 15).ok_or_else(|| {
                let code = (info >> 4) & 15;
                Error::invalid(format!("type {code} of a property is unknown"), start)
            })?;
            n_samples = cursor.number(width)?;
            changes = match (info & 0x200 != 0, info & 0x800 != 0) {
                (true, _) => [cursor.number(width)?, cursor.number(width)?],
                (false, true) => [0, 0],
                (false, false) => [1, n_samples.saturating_sub(1)],
            };
            if info & 0x100 != 0 {
                sampling = cursor.number(width)?;
            }
        }
        let length = cursor.number(width)?;
        let name = cursor.text(length)?;
        let metadata = match (info >> 20) & 0xff {
            0xff => {
                let length = cursor.number(width)?;
                cursor.text(length)?
            }
            ix => self.metadata(ix as u8, cursor)?,
        };
        let [first, last] = changes;
        if n_samples > 1 && changes != [0, 0] && (first == 0 || first > last || last >= n_samples) {
            let what = format!(
                "property {name:?} changes between samples {first} and {last} of {n_samples}"
            );
            return Err(Error::invalid(what, start));
        }
        Ok(Property {
            name,
            metadata,
            kind,
            pod,
            extent: ((info >> 12) & 0xff) as u8,
            n_samples,
            changes: if n_samples > 1 { changes } else { [0, 0] },
            sampling,
            reference: 0,
        })
    }

    fn metadata(&self, ix: u8, cursor: &Cursor<'_, '_>) -> Result<&'a str> {
        self.metadata.get(usize::from(ix)).copied().ok_or_else(|| {
            let n = self.metadata.len();
            Error::invalid(format!("metadata {ix} of {n} are named"), cursor.offset)
        })
    }

    /// Sample `ix` of a property of the object called `path`; no values if it has none.
    pub fn values(&self, property: &Property<'a>, ix: u32, path: &str) -> Result<Values<'a>> {
        let pod = property.pod;
        let none = Values {
            pod,
            bytes: &[],
            offset: 0,
        };
        if property.n_samples == 0 || property.kind == Kind::Compound {
            return Ok(none);
        }
        let what = || format!("sample {ix} of {:?} of {path:?}", property.name);
        let group = self.ogawa.group(property.reference, what)?;
        let stored = match property.kind {
            Kind::Array => 2 * property.stored(ix),
            _ => property.stored(ix),
        };
        let (bytes, offset) = self.ogawa.data(group.child(stored, what)?, what)?;
        // In front of the values stands their hash.
        let refuse = |fault: String| Err(Error::invalid(format!("{} {fault}", what()), offset));
        match bytes.split_at_checked(16) {
            Some((_, bytes)) if bytes.len() % pod.bytes() == 0 => Ok(Values {
                pod,
                bytes,
                offset: offset + 16,
            }),
            Some((_, bytes)) => {
                let (n, each) = (bytes.len(), pod.bytes());
                refuse(format!("has {n} bytes for values of {each}"))
            }
            None if bytes.is_empty() => Ok(none),
            None => refuse(format!("has {} bytes, its hash alone 16", bytes.len())),
        }
    }

    /// The sample of `property` that holds at `time`, seconds.
    pub fn index_at(&self, property: &Property<'a>, time: f64, path: &str) -> Result<u32> {
        match property.varies() {
            true => Ok(self
                .sampling(property, path)?
                .index(property.n_samples, time)),
            false => Ok(0),
        }
    }

    /// The values of `property` at `time`, seconds.
    pub fn values_at(&self, property: &Property<'a>, time: f64, path: &str) -> Result<Values<'a>> {
        self.values(property, self.index_at(property, time, path)?, path)
    }

    /// The times of the samples of `property`.
    pub fn sampling(&self, property: &Property<'a>, path: &str) -> Result<&Sampling> {
        let found = self.samplings.get(property.sampling as usize);
        let fits = found.filter(|sampling| sampling.holds(property.n_samples));
        fits.ok_or_else(|| {
            let (name, n) = (property.name, property.n_samples);
            let what = format!(
                "{name:?} of {path:?} has {n} samples, time sampling {} of {} has not",
                property.sampling,
                self.samplings.len()
            );
            Error::invalid(what, property.reference)
        })
    }
}
