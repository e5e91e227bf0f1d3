//! What happened in the window, as JSON lines, for tests and timings: `--log FILE`, or in a page an
//! array called `strandview_log`. A page is told of those events besides that it can have use for.
//!
//! Every line has `event` and `ms`, milliseconds since the program started. Events:
//! `device` (the window is open, and the device if there is one; the scene is read next), `renderer` (which draws, and the
//! reason where that is the CPU), `first_picture` (the first
//! picture of hair on screen, a draft), `ready` (the first lit one), `places` (where controls are,
//! pixels, whenever that changes), `drawn` (a frame of the window is on screen), `shown` (that has a picture, if a draft,
//! of a change since), `frame` (a picture
//! has all its samples), `view` (another view), `question` (its name), `opened` (another scene),
//! `edit`, `stroke`, `flood`, `color` (of a brush, from the picture), `undo`, `redo`, `saved`, `reloaded`, `picked` (the light that makes a
//! highlight), `picture` (a PNG), `thumbnail` (of a step), `kept` and `look` (a look was kept, or drawn to be compared), `job` (work that
//! the window waits for), `mask`, `inspect` and `inspected`, `ground_truth` and `truth` (how far it is), `resized`, `error`, `lost`
//! (a device), `closed`.

use serde_json::{Value, json};
use web_time::Instant;

/// Events that a page is told.
#[cfg(target_arch = "wasm32")]
const TOLD: [&str; 12] = [
    "renderer", "progress", "frame", "view", "edit", "stroke", "flood", "undo", "redo", "reloaded",
    "error", "saved",
];

/// Writes events, or nothing where no file was asked for.
#[derive(Debug)]
pub struct EventLog {
    start: Instant,
    #[cfg(not(target_arch = "wasm32"))]
    file: Option<std::fs::File>,
    #[cfg(target_arch = "wasm32")]
    lines: Option<js_sys::Array>,
}

impl EventLog {
    /// A log that writes nothing, with times since `start`.
    pub fn silent(start: Instant) -> Self {
        EventLog {
            start,
            #[cfg(not(target_arch = "wasm32"))]
            file: None,
            #[cfg(target_arch = "wasm32")]
            lines: None,
        }
    }

    /// A log that tells the page, and appends to its global array `strandview_log` if it has one.
    #[cfg(target_arch = "wasm32")]
    pub fn in_page(start: Instant) -> Self {
        use wasm_bindgen::JsCast;

        let list = js_sys::Reflect::get(&js_sys::global(), &"strandview_log".into());
        EventLog {
            start,
            lines: list.ok().and_then(|list| list.dyn_into().ok()),
        }
    }

    /// A log that writes to `path`, which is overwritten.
    ///
    /// # Errors
    /// What the system says when the file cannot be made.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn to_file(start: Instant, path: &std::path::Path) -> std::io::Result<Self> {
        Ok(EventLog {
            start,
            file: Some(std::fs::File::create(path)?),
        })
    }

    /// Does anybody read it?
    pub fn is_on(&self) -> bool {
        #[cfg(not(target_arch = "wasm32"))]
        return self.file.is_some();
        #[cfg(target_arch = "wasm32")]
        return self.lines.is_some();
    }

    /// Milliseconds since the program started.
    pub fn ms(&self) -> f64 {
        1e3 * self.start.elapsed().as_secs_f64()
    }

    /// Writes `event` with the keys of `more`, an object.
    pub fn write(&mut self, event: &str, more: Value) {
        #[cfg(target_arch = "wasm32")]
        if TOLD.contains(&event) {
            crate::page::tell(event, &more);
        }
        if !self.is_on() {
            return;
        }
        let ms = (self.ms() * 1e3).round() / 1e3;
        let mut line = json!({ "event": event, "ms": ms });
        if let (Value::Object(line), Value::Object(more)) = (&mut line, more) {
            line.extend(more);
        }
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(file) = &mut self.file {
            use std::io::Write;
            // A log that cannot be written is no reason to stop showing hair.
            let _ = writeln!(file, "{line}");
        }
        #[cfg(target_arch = "wasm32")]
        if let Some(lines) = &self.lines {
            lines.push(&line.to_string().into());
        }
    }
}
