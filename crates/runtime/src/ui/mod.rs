//! The window of `strandview`: winit's events and egui's panels around a
//! [`Viewer`](crate::Viewer).
//!
//! [`run`] opens it. Everything that a control changes is a change of the scene, so that undo, the
//! scene file and scripts know the same parameters.

#![cfg_attr(
    target_arch = "wasm32",
    allow(dead_code, unused_imports, reason = "a page opens and saves no files")
)]

mod app;
mod asked;
mod clipboard;
mod color;
mod commands;
#[cfg(not(target_arch = "wasm32"))]
mod desktop;
mod document;
mod field;
mod fitted;
mod help;
#[cfg(target_arch = "wasm32")]
mod hosted;
mod in_view;
mod input;
mod job;
mod keys;
mod launch;
mod layout;
#[cfg(not(target_arch = "wasm32"))]
mod legend;
mod log;
mod looks;
mod mask_layer;
mod menus;
mod notices;
mod number;
mod orbit;
mod panel;
mod param;
#[cfg(any(target_arch = "wasm32", test))]
mod pen;
mod photo;
mod pick;
mod picker;
mod presets;
mod questions;
mod scalp;
mod screen;
#[cfg(not(target_arch = "wasm32"))]
mod sequence;
mod settings;
mod snapshot;
#[cfg(not(target_arch = "wasm32"))]
mod splash;
mod still;
mod still_job;
mod stroke_input;
mod theme;
mod thumbnails;
mod title;
mod truth;
mod view;
mod views;
mod workspace;

#[cfg(target_arch = "wasm32")]
pub use hosted::{Hosted, HostedError};
#[cfg(not(target_arch = "wasm32"))]
pub use job::sample;
#[cfg(target_arch = "wasm32")]
pub use launch::WorkerStart;
pub use launch::{Failure, Launch, Open};
pub use log::EventLog;

/// Opens a window and returns when it is closed.
///
/// # Errors
/// Any of [`Failure`].
#[cfg(not(target_arch = "wasm32"))]
pub fn run(launch: Launch) -> Result<(), Failure> {
    use winit::event_loop::EventLoop;

    let event_loop = EventLoop::<app::Sent>::with_user_event()
        .build()
        .map_err(Failure::Display)?;
    let display = Some(event_loop.owned_display_handle());
    keep_unsaved_when_interrupted(event_loop.create_proxy());
    let mut app = app::App::new(launch, event_loop.create_proxy(), display);
    if let Err(error) = event_loop.run_app(&mut app) {
        app.keep_unsaved();
        return Err(Failure::EventLoop(error));
    }
    match app.failure {
        Some(failure) => Err(failure),
        None => Ok(()),
    }
}

/// How long an interrupt waits for a window that is busy.
#[cfg(not(target_arch = "wasm32"))]
const INTERRUPT_PATIENCE: std::time::Duration = std::time::Duration::from_secs(20);

/// The document belongs to the window's thread, which is asked to keep it.
#[cfg(not(target_arch = "wasm32"))]
fn keep_unsaved_when_interrupted(proxy: winit::event_loop::EventLoopProxy<app::Sent>) {
    crate::work::before_interrupted_end(move || {
        let (tell, answer) = std::sync::mpsc::channel();
        // A window that is closed has nothing to keep.
        if proxy.send_event(app::Sent::Interrupted(tell)).is_ok() {
            let _ = answer.recv_timeout(INTERRUPT_PATIENCE);
        }
    });
}

/// Opens a window in a page's canvas and returns; what ends it is said in the page, which has hold
/// of it by the answer.
///
/// # Errors
/// Any of [`Failure`].
#[cfg(target_arch = "wasm32")]
pub fn start(launch: Launch) -> Result<Hosted, Failure> {
    use winit::event_loop::EventLoop;
    use winit::platform::web::EventLoopExtWebSys;

    let event_loop = EventLoop::<app::Sent>::with_user_event()
        .build()
        .map_err(Failure::Display)?;
    let proxy = event_loop.create_proxy();
    let app = app::App::new(launch, proxy.clone(), None);
    let (hosted, app) = Hosted::new(app, proxy);
    event_loop.spawn_app(app);
    Ok(hosted)
}
