//! The viewer: a document, its edits, and their pictures, in a window, a web page or without
//! either.
//!
//! - [`Session`]: a document, its edits, undo and saving.
//! - [`Viewer`]: a session and a renderer that follows it, on the GPU or the CPU ([`BackendChoice`]).
//! - [`script`]: the same without a window.
//!
//! ```
//! use strandlight_runtime::script::Script;
//!
//! let script = Script::from_json(r#"[{"set": {"hair.eta": 1.6}}, {"frame": "a", "samples": 8}]"#)?;
//! let names: Vec<&str> = script.frames().map(|frame| frame.name.as_str()).collect();
//! assert_eq!(names, ["a"]);
//! # Ok::<(), strandlight_runtime::ScriptError>(())
//! ```

#[cfg(not(target_arch = "wasm32"))]
mod apart;
mod choice;
mod error;
#[cfg(not(target_arch = "wasm32"))]
mod ground_truth;
#[cfg(not(target_arch = "wasm32"))]
mod inspection;
mod interactive;
#[cfg(not(target_arch = "wasm32"))]
mod light_layer;
mod mask_view;
#[cfg(not(target_arch = "wasm32"))]
#[doc(hidden)]
pub mod opening;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
mod page;
#[cfg(target_arch = "wasm32")]
pub mod page_worker;
#[cfg(not(target_arch = "wasm32"))]
mod plain_hair;
// For the programs.
#[doc(hidden)]
pub mod options;
pub mod script;
pub mod session;
pub mod timings;
#[cfg(not(target_arch = "wasm32"))]
mod truth_map;
#[cfg(feature = "ui")]
pub mod ui;
pub mod viewer;
#[cfg(all(target_arch = "wasm32", feature = "ui"))]
pub mod web;
#[cfg(not(target_arch = "wasm32"))]
#[doc(hidden)]
pub mod work;
#[cfg(any(test, target_arch = "wasm32"))]
mod worker;

pub use choice::{BackendChoice, Chosen, CpuReason};
pub use error::{KeyError, ScriptError, SessionError, StepError};
#[cfg(not(target_arch = "wasm32"))]
pub use ground_truth::{TruthError, TruthProgress};
#[cfg(not(target_arch = "wasm32"))]
pub use inspection::{BANDS, Inspection};
pub use interactive::{Display, InteractiveBackend};
#[cfg(not(target_arch = "wasm32"))]
pub use light_layer::LightLayer;
pub use session::Session;
#[cfg(not(target_arch = "wasm32"))]
pub use truth_map::TruthMapError;
pub use viewer::Viewer;
