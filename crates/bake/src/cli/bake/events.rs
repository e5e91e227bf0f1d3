//! What happens in a run: for people on stderr, for programs as JSON Lines.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::{Value, json};
use strandlight_bake::manifest::{self, Event, Observer, Summary};
use strandlight_formats::{OutputTarget, output_target, tool_version};
use strandlight_scene::progress::Progress;

use super::exit::in_exit_codes;
use crate::cli::Failure;
use crate::cli::shard::Shard;

/// A stream of JSON documents, one a line.
pub struct Events {
    path: PathBuf,
    sink: Mutex<Sink>,
}

struct Sink {
    out: Box<dyn Write + Send>,
    /// The first error; nothing is written after it.
    error: Option<io::Error>,
}

impl Events {
    /// Opens `path` for a new run; what was in it is gone.
    pub fn create(path: &Path) -> Result<Events, Failure> {
        let open = || -> io::Result<Box<dyn Write + Send>> {
            Ok(match output_target(path)? {
                OutputTarget::Stdout => Box::new(io::stdout()),
                OutputTarget::Stream(path) => Box::new(File::options().append(true).open(path)?),
                OutputTarget::File(path) => Box::new(File::create(path)?),
            })
        };
        let out = open().map_err(|error| {
            in_exit_codes(manifest::Failure::io(path, "cannot be written", &error))
        })?;
        Ok(Events {
            path: path.to_owned(),
            sink: Mutex::new(Sink { out, error: None }),
        })
    }

    fn write(&self, document: &Value) {
        let mut sink = self.sink.lock().unwrap_or_else(PoisonError::into_inner);
        if sink.error.is_some() {
            return;
        }
        // In one call: a line is there or not.
        let line = format!("{document}\n");
        let written = sink.out.write_all(line.as_bytes());
        let written = written.and_then(|()| sink.out.flush());
        match written {
            // Whoever listened has had enough.
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => sink.error = Some(error),
            _ => {}
        }
    }
}

/// Tells of a run.
pub struct Teller {
    events: Option<Events>,
    progress: Arc<Progress>,
    /// Failures are told when they happen; otherwise the run ends with the first.
    tells_failures: bool,
    openjd: Option<OpenJd>,
    timings: Mutex<Vec<(String, Value)>>,
}

/// Progress in the words of Open Job Description.
struct OpenJd {
    n_items: usize,
    n_done: Mutex<usize>,
}

impl OpenJd {
    /// One more item is over.
    fn advance(&self) {
        // Held while the line is written: percentages only grow.
        let mut n_done = self.n_done.lock().unwrap_or_else(PoisonError::into_inner);
        *n_done += 1;
        let percent = 100.0 * *n_done as f64 / self.n_items as f64;
        // Who no longer listens does not end the work.
        let _ = writeln!(io::stdout(), "openjd_progress: {percent:.1}");
    }
}

impl Teller {
    /// One that writes `events` and shows `progress`.
    pub fn new(events: Option<Events>, progress: Arc<Progress>, tells_failures: bool) -> Self {
        Teller {
            events,
            progress,
            tells_failures,
            openjd: None,
            timings: Mutex::default(),
        }
    }

    /// One that also prints progress as Open Job Description has it.
    pub fn with_openjd(self, n_items: usize) -> Self {
        Teller {
            openjd: Some(OpenJd {
                n_items,
                n_done: Mutex::new(0),
            }),
            ..self
        }
    }

    /// One more item is over.
    fn advance(&self) {
        self.progress.advance(1);
        if let Some(openjd) = &self.openjd {
            openjd.advance();
        }
    }

    /// The run begins.
    pub fn start(&self, n_items: usize, shard: Option<Shard>) {
        self.write(json!({
            "event": "run",
            "items": n_items,
            "shard": shard.map(|shard| json!({ "index": shard.index(), "count": shard.count() })),
            "tool_version": tool_version(),
        }));
    }

    /// The run is over.
    pub fn end(&self, summary: &Summary, seconds: f64) {
        self.write(json!({
            "event": "end",
            "made": summary.made,
            "cached": summary.cached,
            "up_to_date": summary.skipped,
            "failed": summary.failed.len(),
            "left": summary.left,
            "seconds": seconds,
        }));
    }

    /// How long each item took, by name.
    pub fn timings(&self) -> Vec<Value> {
        let timings = self.timings.lock().unwrap_or_else(PoisonError::into_inner);
        let mut timings = timings.clone();
        timings.sort_by(|a, b| a.0.cmp(&b.0));
        timings.into_iter().map(|(_, timing)| timing).collect()
    }

    /// Whether all events could be written.
    pub fn outcome(&self) -> Result<(), Failure> {
        let Some(events) = &self.events else {
            return Ok(());
        };
        let mut sink = events.sink.lock().unwrap_or_else(PoisonError::into_inner);
        match sink.error.take() {
            None => Ok(()),
            Some(error) => {
                let failure = manifest::Failure::io(&events.path, "cannot be written", &error);
                Err(in_exit_codes(failure))
            }
        }
    }

    fn write(&self, document: Value) {
        if let Some(events) = &self.events {
            events.write(&document);
        }
    }

    fn keep_timing(&self, name: String, seconds: f64, is_cached: bool) {
        let timing = json!({ "item": name, "seconds": seconds, "cached": is_cached });
        let mut timings = self.timings.lock().unwrap_or_else(PoisonError::into_inner);
        timings.push((name, timing));
    }
}

impl Observer for Teller {
    fn event(&self, event: Event<'_>) {
        match event {
            Event::Judged { .. } => {}
            Event::Skipped(item, judgement) => {
                self.write(json!({
                    "event": "skipped", "item": item.name(), "key": judgement.key(),
                }));
                self.advance();
            }
            Event::Started(item, judgement) => self.write(json!({
                "event": "start",
                "item": item.name(),
                "key": judgement.key(),
                "reasons": judgement.reasons.iter().map(ToString::to_string).collect::<Vec<_>>(),
            })),
            Event::Done {
                item,
                judgement,
                figures,
                is_cached,
                seconds,
            } => {
                self.write(json!({
                    "event": "done", "item": item.name(), "key": judgement.key(),
                    "cached": is_cached, "seconds": seconds, "figures": figures,
                }));
                let error = match figures.get("fibre_error").and_then(Value::as_f64) {
                    Some(error) => format!("fibre error {:.2} %, ", 100.0 * error),
                    None => String::new(),
                };
                let from = if is_cached { ", from the cache" } else { "" };
                let name = item.name();
                let why = judgement.why_beside(&name);
                self.progress
                    .say(&format!("{name}: {error}{seconds:.2} s{from} ({why})"));
                self.advance();
                self.keep_timing(name, seconds, is_cached);
            }
            Event::Failed {
                item,
                judgement,
                failure,
                seconds,
            } => {
                self.write(json!({
                    "event": "failed", "item": item.name(), "key": judgement.key(),
                    "error": failure.what, "transient": failure.is_transient, "seconds": seconds,
                }));
                if self.tells_failures {
                    // An error, which --quiet does not silence.
                    let _ = writeln!(
                        io::stderr(),
                        "strandlight: {}",
                        failure.of_item(&item.name())
                    );
                }
                self.advance();
            }
            Event::Note(line) => {
                self.write(json!({ "event": "note", "message": line }));
                self.progress.say(line);
            }
        }
    }
}
