//! Makes what is stale.

use std::collections::{BTreeMap, HashSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde_json::{Map, Value};
use strandlight_formats::{
    OutputTarget, check_folder, output_target, remove_stale_temporary_files, write_file,
};
use strandlight_scene::progress::timed;

use super::cache::Cache;
use super::failure::Failure;
use super::item::Item;
use super::judge::{Judgement, Reason, judge};
use super::record::{BakedItem, FailureRecord, FileRecord, Fingerprint, Record, RecordPaths};

/// Who makes items; of any thread.
pub trait Bakery: Sync {
    /// Makes `item`, and writes nothing.
    ///
    /// # Errors
    /// Its input or settings are not what they should be.
    fn bake(&self, item: &Item) -> Result<BakedItem, Failure>;
}

/// What happens in a run.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// All items were looked at.
    Judged {
        /// Items to make.
        stale: usize,
    },
    /// Nothing to do.
    Skipped(&'a Item, &'a Judgement),
    /// Work begins.
    Started(&'a Item, &'a Judgement),
    /// All files of the item are written.
    Done {
        /// Which.
        item: &'a Item,
        /// Its key and why it was made.
        judgement: &'a Judgement,
        /// How good it is.
        figures: &'a Map<String, Value>,
        /// It was copied from the cache.
        is_cached: bool,
        /// How long it took.
        seconds: f64,
    },
    /// It was not made.
    Failed {
        /// Which.
        item: &'a Item,
        /// Its key, unless the input cannot be read.
        judgement: &'a Judgement,
        /// Why.
        failure: &'a Failure,
        /// How long it took.
        seconds: f64,
    },
    /// Something that does not stop the work.
    Note(&'a str),
}

/// Who is told; from any thread.
pub trait Observer: Sync {
    /// Something happened.
    fn event(&self, event: Event<'_>);
}

/// How to run.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Make items that are up to date, too, without the cache's help.
    pub force: bool,
    /// Go on after an item that failed.
    pub keep_going: bool,
    /// Items at work at the same time, at least one.
    pub jobs: usize,
    /// Where to look for what was made before.
    pub cache: Option<Cache>,
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Items made anew.
    pub made: usize,
    /// Items copied from the cache.
    pub cached: usize,
    /// Items that were up to date.
    pub skipped: usize,
    /// Items that were not looked at because another one failed.
    pub left: usize,
    /// Names of items that failed, in order, with the reason.
    pub failed: Vec<(String, Failure)>,
}

/// Makes those of `items` that are not up to date.
pub fn run(
    items: &[Item],
    bakery: &dyn Bakery,
    options: &RunOptions,
    observer: &dyn Observer,
) -> Summary {
    remove_stale_files(items);
    let mut judged: Vec<Judgement> = items.par_iter().map(judge).collect();
    if options.force {
        let forced = judged.iter_mut().filter(|judgement| judgement.is_done());
        forced.for_each(|judgement| judgement.reasons.push(Reason::Forced));
    }
    let (done, stale): (Vec<_>, Vec<_>) = items
        .iter()
        .zip(&judged)
        .partition(|(_, judgement)| judgement.is_done());
    observer.event(Event::Judged { stale: stale.len() });
    for &(item, judgement) in &done {
        // What failed, such as a --force, is of no interest any more.
        if judgement.failure.is_some() {
            let path = RecordPaths::of(item).failed;
            if let Err(failure) = remove_failure(&path) {
                observer.event(Event::Note(&failure.what));
            }
        }
        observer.event(Event::Skipped(item, judgement));
    }
    let run = Run {
        bakery,
        options,
        observer,
        folders: Mutex::default(),
        summary: Mutex::default(),
    };
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || {
        while !is_over.load(Ordering::Relaxed) {
            let ix = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(item, judgement)) = stale.get(ix) else {
                return;
            };
            if !run.item(item, judgement) && !options.keep_going {
                is_over.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        // The caller is one of them.
        for _ in 1..options.jobs.clamp(1, stale.len().max(1)) {
            scope.spawn(work);
        }
        work();
    });
    let mut summary = run
        .summary
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    summary.skipped = done.len();
    summary.left = stale.len() - summary.made - summary.cached - summary.failed.len();
    summary.failed.sort_by(|a, b| a.0.cmp(&b.0));
    summary
}

/// Removes what killed runs left of the files of `items`.
fn remove_stale_files(items: &[Item]) {
    let mut names: BTreeMap<PathBuf, Vec<OsString>> = BTreeMap::new();
    for item in items {
        let outputs = item.outputs.iter().map(|output| item.resolve(&output.path));
        let RecordPaths { done, failed } = RecordPaths::of(item);
        for path in outputs.chain([done, failed]) {
            let name = path.file_name().unwrap_or_default().to_owned();
            names.entry(folder_of(&path)).or_default().push(name);
        }
    }
    for (folder, names) in names {
        remove_stale_temporary_files(&folder, names.iter().map(OsString::as_os_str));
    }
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// What the threads of a run share.
struct Run<'a> {
    bakery: &'a dyn Bakery,
    options: &'a RunOptions,
    observer: &'a dyn Observer,
    /// Folders that take files.
    folders: Mutex<HashSet<PathBuf>>,
    summary: Mutex<Summary>,
}

impl Run<'_> {
    /// Makes an item; whether it was done.
    fn item(&self, item: &Item, judgement: &Judgement) -> bool {
        self.observer.event(Event::Started(item, judgement));
        let (made, seconds) = timed(|| self.make(item, judgement));
        let mut summary = self.summary.lock().unwrap_or_else(PoisonError::into_inner);
        let is_done = made.is_ok();
        match made {
            Ok((figures, is_cached)) => {
                match is_cached {
                    true => summary.cached += 1,
                    false => summary.made += 1,
                }
                self.observer.event(Event::Done {
                    item,
                    judgement,
                    figures: &figures,
                    is_cached,
                    seconds,
                });
            }
            Err(failure) => {
                self.record_failure(item, judgement, &failure);
                self.observer.event(Event::Failed {
                    item,
                    judgement,
                    failure: &failure,
                    seconds,
                });
                summary.failed.push((item.name(), failure));
            }
        }
        is_done
    }

    /// Figures of what was made, and whether it is from the cache.
    fn make(
        &self,
        item: &Item,
        judgement: &Judgement,
    ) -> Result<(Map<String, Value>, bool), Failure> {
        let (fingerprint, key) = judgement.fingerprint.as_ref().map_err(Failure::clone)?;
        for output in &item.outputs {
            self.check_output(&item.resolve(&output.path))?;
        }
        let cache = self.options.cache.as_ref();
        let cached = cache
            .filter(|_| !self.options.force)
            .and_then(|cache| cache.fetch(fingerprint, key));
        if let Some(made) = cached {
            write(item, fingerprint, key, &made)?;
            return Ok((made.figures, true));
        }
        let made = self.bakery.bake(item);
        // Whoever reads it while it is written sees neither the old nor the new one.
        if let Some(path) = item
            .input_path()
            .filter(|_| !fingerprint.is_same_as_now(item))
        {
            let what = format!("{}: changed while it was read", path.display());
            return Err(Failure::transient(what));
        }
        let made = made?;
        write(item, fingerprint, key, &made)?;
        if let Some(Err(error)) = cache.map(|cache| cache.store(fingerprint, key, &made)) {
            let what = format!("{}: not kept in the cache: {error}", item.name());
            self.observer.event(Event::Note(&what));
        }
        Ok((made.figures, false))
    }

    /// Refuses, before any work, an output that cannot be written; makes its folder.
    fn check_output(&self, path: &Path) -> Result<(), Failure> {
        let folder = folder_of(path);
        let mut folders = self.folders.lock().unwrap_or_else(PoisonError::into_inner);
        if !folders.contains(&folder) {
            let cannot = |error: std::io::Error| Failure::io(path, "cannot be written", &error);
            std::fs::create_dir_all(&folder).map_err(cannot)?;
            check_folder(&folder).map_err(cannot)?;
            folders.insert(folder);
        }
        drop(folders);
        match output_target(path) {
            Ok(OutputTarget::File(_)) => Ok(()),
            Ok(_) => {
                let what = format!("{}: is no regular file", path.display());
                Err(Failure::input(what))
            }
            Err(error) => Err(Failure::io(path, "cannot be written", &error)),
        }
    }

    /// For `bake status`; the exit code tells it too, so that failing here is no error.
    fn record_failure(&self, item: &Item, judgement: &Judgement, failure: &Failure) {
        let record = FailureRecord {
            key: judgement.key().map(str::to_owned),
            error: failure.what.clone(),
            transient: failure.is_transient,
        };
        let path = RecordPaths::of(item).failed;
        let made = path.parent().map(std::fs::create_dir_all);
        if let Some(Ok(())) = made {
            let _ = record.write(&path);
        }
    }
}

impl Fingerprint {
    fn is_same_as_now(&self, item: &Item) -> bool {
        Fingerprint::of(item).is_ok_and(|now| now.is_same(self))
    }
}

/// Writes outputs, then the record that vouches for them.
fn write(item: &Item, made_of: &Fingerprint, key: &str, made: &BakedItem) -> Result<(), Failure> {
    let paths = RecordPaths::of(item);
    let cannot = |path: &Path| {
        let path = path.to_owned();
        move |error: std::io::Error| Failure::io(&path, "cannot be written", &error)
    };
    let mut outputs = Vec::new();
    // The main one last.
    for (output, bytes) in item.outputs.iter().zip(&made.outputs).rev() {
        let path = item.resolve(&output.path);
        write_file(&path, bytes).map_err(cannot(&path))?;
        outputs.push(FileRecord::of_bytes(output.role, &path, bytes));
    }
    outputs.reverse();
    let record = Record {
        version: Record::VERSION,
        key: key.to_owned(),
        made_of: made_of.clone(),
        outputs,
        figures: made.figures.clone(),
    };
    let folder = folder_of(&paths.done);
    std::fs::create_dir_all(&folder).map_err(cannot(&folder))?;
    record.write(&paths.done).map_err(cannot(&paths.done))?;
    remove_failure(&paths.failed)
}

/// Removes the record of a failure, if there is one.
fn remove_failure(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::io(path, "cannot be removed", &error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::judge::State;
    use super::super::{KindInfo, Manifest, items};
    use super::*;

    const COPY: KindInfo = KindInfo {
        name: "copy",
        input: Some("in"),
        outputs: &[("out", "txt")],
        revision: 1,
    };

    /// Copies inputs; does what they say besides.
    struct Copier;

    impl Bakery for Copier {
        fn bake(&self, item: &Item) -> Result<BakedItem, Failure> {
            let path = item.input_path().expect("it has one");
            let text = fs::read_to_string(&path).expect("readable");
            match text.as_str() {
                "bad" => return Err(Failure::input("no good")),
                "changing" => fs::write(&path, "changed").expect("written"),
                _ => {}
            }
            Ok(BakedItem {
                outputs: vec![text.into_bytes()],
                figures: Map::new(),
            })
        }
    }

    #[derive(Default)]
    struct Log(Mutex<Vec<String>>);

    impl Observer for Log {
        fn event(&self, event: Event<'_>) {
            let line = match event {
                Event::Judged { stale } => format!("stale {stale}"),
                Event::Skipped(item, _) => format!("skipped {}", item.name()),
                Event::Started(..) => return,
                Event::Done {
                    item, is_cached, ..
                } => format!("done {} {is_cached}", item.name()),
                Event::Failed { item, failure, .. } => {
                    format!("failed {} {failure}", item.name())
                }
                Event::Note(line) => format!("note {line}"),
            };
            self.0.lock().expect("not poisoned").push(line);
        }
    }

    fn found(at: &Path) -> Vec<Item> {
        let path = at.join("m.toml");
        let text = "version = 1\n[[copy]]\nin = 'in/*'\nout = 'out/{stem}.txt'\n";
        fs::write(&path, text).expect("written");
        let manifest = Manifest::read(&path, &[COPY]).expect("a manifest");
        items(&manifest, &|_| Ok(BTreeMap::new())).expect("items")
    }

    fn inputs(texts: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("in")).expect("made");
        for (name, text) in texts {
            fs::write(folder.path().join("in").join(name), text).expect("written");
        }
        folder
    }

    fn ran(items: &[Item], options: &RunOptions) -> (Summary, Vec<String>) {
        let log = Log::default();
        let summary = run(items, &Copier, options, &log);
        (summary, log.0.into_inner().expect("not poisoned"))
    }

    #[test]
    fn the_first_failure_ends_the_run_unless_told_otherwise() {
        let folder = inputs(&[("a", "1"), ("b", "bad"), ("c", "3")]);
        let items = found(folder.path());
        let (summary, log) = ran(&items, &RunOptions::default());
        assert_eq!((summary.made, summary.left), (1, 1));
        assert_eq!(
            log,
            [
                "stale 3",
                "done out/a.txt false",
                "failed out/b.txt no good"
            ]
        );
        let judgement = judge(&items[1]);
        assert_eq!(judgement.state(), State::Failed);
        assert_eq!(judgement.failure.as_deref(), Some("no good"));
        let options = RunOptions {
            keep_going: true,
            jobs: 4,
            ..RunOptions::default()
        };
        let (summary, log) = ran(&items, &options);
        assert_eq!((summary.made, summary.skipped, summary.left), (1, 1, 0));
        assert_eq!(summary.failed.len(), 1);
        assert_eq!(log.len(), 4, "{log:?}");
        // Another input, another try.
        fs::write(folder.path().join("in/b"), "good").expect("written");
        assert_eq!(judge(&items[1]).state(), State::Missing);
        assert_eq!(ran(&items, &RunOptions::default()).0.skipped, 2);
        assert_eq!(judge(&items[1]).state(), State::Done);
    }

    #[test]
    fn a_failure_is_forgotten_once_its_item_is_up_to_date() {
        let folder = inputs(&[("a", "1")]);
        let items = found(folder.path());
        assert_eq!(ran(&items, &RunOptions::default()).0.made, 1);
        // As after a --force that could not write.
        let judgement = judge(&items[0]);
        let failed = FailureRecord {
            key: judgement.key().map(str::to_owned),
            error: "is write-protected".to_owned(),
            transient: false,
        };
        let path = RecordPaths::of(&items[0]).failed;
        failed.write(&path).expect("written");
        assert_eq!(judge(&items[0]).failure, Some(failed.error));
        let (summary, log) = ran(&items, &RunOptions::default());
        assert_eq!(summary.skipped, 1);
        assert_eq!(log, ["stale 0", "skipped out/a.txt"]);
        assert_eq!(judge(&items[0]).failure, None);
        assert!(!path.exists());
    }

    #[test]
    fn an_input_that_changes_meanwhile_is_worth_another_try() {
        let folder = inputs(&[("a", "changing")]);
        let items = found(folder.path());
        let (summary, _) = ran(&items, &RunOptions::default());
        let (_, failure) = &summary.failed[0];
        assert!(
            failure.is_transient && failure.what.contains("changed while"),
            "{failure}"
        );
        assert!(!folder.path().join("out/a.txt").exists());
        assert_eq!(ran(&items, &RunOptions::default()).0.made, 1);
        let text = fs::read_to_string(folder.path().join("out/a.txt"));
        assert_eq!(text.expect("written"), "changed");
    }

    #[test]
    fn a_cache_is_asked_and_filled() {
        let (one, two) = (inputs(&[("a", "1")]), inputs(&[("b", "1"), ("c", "2")]));
        let cache = Cache::open(&one.path().join("cache")).expect("made");
        let options = RunOptions {
            cache: Some(cache),
            ..RunOptions::default()
        };
        assert_eq!(ran(&found(one.path()), &options).0.made, 1);
        // The same content under another name.
        let items = found(two.path());
        let (_, log) = ran(&items, &options);
        assert_eq!(
            log,
            ["stale 2", "done out/b.txt true", "done out/c.txt false"]
        );
        let force = RunOptions {
            force: true,
            ..options
        };
        assert_eq!(ran(&items, &force).0.made, 2);
    }
}
