//! What the status line tells of ground truth.

#[cfg(not(target_arch = "wasm32"))]
use strandlight_formats::counted;

use crate::viewer::Viewer;

/// How far the picture is to ground truth, where that is wanted, and what that means.
#[cfg(not(target_arch = "wasm32"))]
pub fn status(viewer: &Viewer) -> Option<(String, String)> {
    let light = match viewer.session().scene().lights.map {
        Some(_) => "in the light of the map that the scene names",
        None => "in the light of its light set",
    };
    let help = format!(
        "Path tracing corrects the finished picture while nothing changes, {light}. The error is the relative \
         RMSE over blocks of 4x4 pixels that is to be expected"
    );
    Some(match viewer.ground_truth()? {
        Err(error) => ("no ground truth".to_owned(), error.to_string()),
        Ok(truth) if truth.samples == 0 => ("ground truth: starting".to_owned(), help),
        Ok(truth) => {
            let error = 100.0 * truth.relative_error;
            let of_fast = match truth.relative_error_of_fast {
                Some(error) => format!("; of the fast picture {:.1} %", 100.0 * error),
                None => String::new(),
            };
            let verb = if truth.is_done { "done" } else { "tracing" };
            (
                format!(
                    "ground truth: {verb}, {}, expected error {error:.1} %",
                    counted(truth.samples, "sample", "samples")
                ),
                format!("{help}{of_fast}"),
            )
        }
    })
}

#[cfg(target_arch = "wasm32")]
pub fn status(_: &Viewer) -> Option<(String, String)> {
    None
}
