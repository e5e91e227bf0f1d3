//! Is an item up to date, and if not, why?

use std::fmt;

use super::failure::Failure;
use super::item::Item;
use super::record::{FailureRecord, FileRecord, Fingerprint, Record, RecordPaths};

/// One reason to make an item.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// An output is not there.
    Missing(String),
    /// The output is there, and nothing is known of it.
    Unknown,
    /// Its record cannot be read.
    Record(String),
    /// An output is not what was written.
    Altered(String),
    /// An input has other content: its key and its name.
    Input(String, String),
    /// A parameter has another value.
    Parameter(String, Option<String>, Option<String>),
    /// The page that was written tells other names of files.
    Names,
    /// Made by another program.
    MadeBy(String),
    /// Asked for.
    Forced,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Missing(file) => write!(f, "{file} is missing"),
            Reason::Unknown => f.write_str("it is there, but not by a bake"),
            Reason::Record(what) => write!(f, "{what}"),
            Reason::Altered(file) => write!(f, "{file} was altered or is damaged"),
            Reason::Input(key, file) => write!(f, "{key} {file} changed"),
            Reason::Parameter(name, old, new) => {
                let text = |value: &Option<String>| value.clone().unwrap_or("none".to_owned());
                write!(f, "{name} {} -> {}", text(old), text(new))
            }
            Reason::Names => f.write_str("its page tells other names of files"),
            Reason::MadeBy(program) => write!(f, "made by {program}"),
            Reason::Forced => f.write_str("--force"),
        }
    }
}

/// What an item is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Its outputs are what its input and parameters make.
    Done,
    /// It was made, of something else.
    Stale,
    /// Its output is not there.
    Missing,
    /// The last attempt to make it as it is now failed, or its input cannot be read.
    Failed,
}

impl State {
    /// Name in JSON and listings.
    pub const fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::Stale => "stale",
            State::Missing => "missing",
            State::Failed => "failed",
        }
    }
}

/// What is known of an item.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// What it would be made of now, with its key, unless the input cannot be read.
    pub fingerprint: Result<(Fingerprint, String), Failure>,
    /// Why it is to be made; empty if it is up to date.
    pub reasons: Vec<Reason>,
    /// Its record, if there is one.
    pub record: Option<Record>,
    /// Why it failed last, if nothing has changed since.
    pub failure: Option<String>,
}

impl Judgement {
    /// Is there nothing to do?
    pub fn is_done(&self) -> bool {
        self.fingerprint.is_ok() && self.reasons.is_empty()
    }

    /// In a word.
    pub fn state(&self) -> State {
        match &self.reasons[..] {
            _ if self.fingerprint.is_err() => State::Failed,
            [] => State::Done,
            _ if self.failure.is_some() => State::Failed,
            [Reason::Missing(_), ..] => State::Missing,
            _ => State::Stale,
        }
    }

    /// The key, if the input can be read.
    pub fn key(&self) -> Option<&str> {
        self.fingerprint.as_ref().ok().map(|(_, key)| key.as_str())
    }

    /// All reasons in one line.
    pub fn why(&self) -> String {
        let reasons = self.reasons.iter().map(Reason::to_string);
        reasons.collect::<Vec<_>>().join("; ")
    }

    /// [`Judgement::why`] behind the name of the item, which is not said twice.
    pub fn why_beside(&self, name: &str) -> String {
        let reasons = self.reasons.iter().map(|reason| {
            let reason = reason.to_string();
            let rest = reason
                .strip_prefix(name)
                .and_then(|rest| rest.strip_prefix(' '));
            rest.map(str::to_owned).unwrap_or(reason)
        });
        reasons.collect::<Vec<_>>().join("; ")
    }
}

/// Looks at `item`: reads its input, its outputs and its record.
pub fn judge(item: &Item) -> Judgement {
    let paths = RecordPaths::of(item);
    let fingerprint = Fingerprint::of(item).map(|fingerprint| {
        let key = fingerprint.key();
        (fingerprint, key)
    });
    let (record, unreadable) = match Record::read(&paths.done) {
        Ok(record) => (record, None),
        Err(what) => (None, Some(Reason::Record(what))),
    };
    let mut reasons: Vec<Reason> = Vec::new();
    let is_there = |path: &std::path::Path| item.resolve(path).exists();
    let missing = item.outputs.iter().filter(|output| !is_there(&output.path));
    reasons.extend(missing.map(|output| Reason::Missing(output.path.display().to_string())));
    if let Some(record) = &record {
        reasons.extend(altered(item, record));
        if let Ok((fingerprint, key)) = &fingerprint {
            reasons.extend(changes(item, record, fingerprint, key));
        }
    } else if reasons.is_empty() {
        reasons.push(unreadable.unwrap_or(Reason::Unknown));
    }
    let failure = match &fingerprint {
        Err(failure) => Some(failure.what.clone()),
        Ok((_, key)) => FailureRecord::read(&paths.failed)
            .filter(|failed| failed.key.as_ref() == Some(key))
            .map(|failed| failed.error),
    };
    Judgement {
        fingerprint,
        reasons,
        record,
        failure,
    }
}

/// Outputs that are there and not what the record says.
fn altered(item: &Item, record: &Record) -> Vec<Reason> {
    let mut reasons = Vec::new();
    for output in &item.outputs {
        let known = record.outputs.iter().find(|file| file.role == output.role);
        let Some(known) = known else { continue };
        let path = item.resolve(&output.path);
        // Its length first: cheap, and usually enough.
        let length = std::fs::metadata(&path).map(|metadata| metadata.len());
        let is_same = match length {
            Ok(length) if length == known.bytes => {
                FileRecord::of_file(output.role, &path).is_ok_and(|found| found.hash == known.hash)
            }
            Ok(_) => false,
            // Missing.
            Err(_) => continue,
        };
        if !is_same {
            let file = output.path.display().to_string();
            reasons.push(Reason::Altered(file));
        }
    }
    reasons
}

/// What is not as it was when the record was made.
fn changes(item: &Item, record: &Record, now: &Fingerprint, key: &str) -> Vec<Reason> {
    let before = &record.made_of;
    let mut reasons = Vec::new();
    for input in &now.inputs {
        let mut others = before.inputs.iter();
        let is_same =
            |other: &&FileRecord| (other.bytes, &other.hash) == (input.bytes, &input.hash);
        if !others.any(|other| is_same(&other)) {
            let file = item.input.as_deref().unwrap_or(input.file.as_ref());
            let file = file.display().to_string();
            reasons.push(Reason::Input(input.role.clone(), file));
        }
    }
    let names = before.parameters.keys().chain(now.parameters.keys());
    let mut names: Vec<&String> = names.collect();
    names.sort();
    names.dedup();
    for name in names {
        let [old, new] = [before, now].map(|of| of.parameters.get(name).cloned());
        if old != new {
            reasons.push(Reason::Parameter(name.clone(), old, new));
        }
    }
    let roles = now.roles.iter().filter(|role| !before.roles.contains(role));
    reasons.extend(
        roles.map(|role| Reason::Parameter(role.clone(), None, Some("written".to_owned()))),
    );
    let gone = before.roles.iter().filter(|role| !now.roles.contains(role));
    reasons
        .extend(gone.map(|role| Reason::Parameter(role.clone(), Some("written".to_owned()), None)));
    // Where the page is new or gone, that was said.
    if reasons.is_empty() && before.names != now.names {
        reasons.push(Reason::Names);
    }
    if before.made_by != now.made_by {
        reasons.push(Reason::MadeBy(before.made_by.clone()));
    }
    // Whatever else there may be, such as a record that contradicts itself.
    if reasons.is_empty() && record.key != key {
        reasons.push(Reason::Record("damaged record: another key".to_owned()));
    }
    reasons
}
