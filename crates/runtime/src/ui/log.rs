//! What happened in the window, as JSON lines, for tests and timings: `--log FILE`.
//!
//! Every line has `event` and `ms`, milliseconds since the program started. Events:
//! `first_picture` (the first picture of hair on screen, a draft), `ready` (the first lit one), `places` (where controls are, pixels, whenever that changes), `frame` (a
//! picture has all its samples), `edit`, `stroke`, `undo`, `redo`, `saved`, `reloaded`, `picked` (the
//! light that makes a highlight), `picture` (a PNG), `resized`, `error`, `lost` (a device), `closed`.

use serde_json::{Value, json};
use web_time::Instant;

/// Writes events, or nothing where no file was asked for.
#[derive(Debug)]
pub struct EventLog {
    start: Instant,
    #[cfg(not(target_arch = "wasm32"))]
    file: Option<std::fs::File>,
}

impl EventLog {
    /// A log that writes nothing, with times since `start`.
    pub fn silent(start: Instant) -> Self {
        EventLog {
            start,
            #[cfg(not(target_arch = "wasm32"))]
            file: None,
        }
    }

    /// A log that writes to `path`, which is made anew.
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
        return false;
    }

    /// Milliseconds since the program started.
    pub fn ms(&self) -> f64 {
        1e3 * self.start.elapsed().as_secs_f64()
    }

    /// Writes `event` with the keys of `more`, an object.
    pub fn write(&mut self, event: &str, more: Value) {
        #[cfg(not(target_arch = "wasm32"))]
        {
            use std::io::Write;
            let ms = (self.ms() * 1e3).round() / 1e3;
            if let Some(file) = &mut self.file {
                let mut line = json!({ "event": event, "ms": ms });
                if let (Value::Object(line), Value::Object(more)) = (&mut line, more) {
                    line.extend(more);
                }
                // A log that cannot be written is no reason to stop showing hair.
                let _ = writeln!(file, "{line}");
            }
        }
        #[cfg(target_arch = "wasm32")]
        let _ = (event, more, json!({}));
    }
}
