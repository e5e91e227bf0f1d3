//! Looks that are kept, compared, copied and pasted.

use serde_json::json;
use strandlight_formats::Scene;

use crate::error::SessionError;
#[cfg(not(target_arch = "wasm32"))]
use crate::session::section_of;
use crate::ui::looks::{Look, LookView, Shown};
#[cfg(not(target_arch = "wasm32"))]
use crate::ui::workspace::LookJob;
use crate::ui::workspace::Workspace;
use crate::ui::{presets, snapshot};
use crate::viewer::Viewer;

impl Workspace {
    /// Keeps the look with the picture that is shown.
    pub(super) fn keep_look(&mut self) {
        let look = Look::of(self.viewer.session().scene());
        // Of the fast picture alone: others are compared with it.
        #[cfg(not(target_arch = "wasm32"))]
        let is_plain = self.viewer.inspection().is_none() && self.viewer.ground_truth().is_none();
        #[cfg(target_arch = "wasm32")]
        let is_plain = true;
        // After an edit in this frame `progress` is still that of the picture before.
        let is_finished = self.progress.is_done && !self.is_unlogged;
        let shown = (is_finished && is_plain).then(|| snapshot::pixels(&self.viewer));
        let view = LookView::of(&self.viewer);
        let shown = (shown.and_then(Result::ok))
            .filter(|(size, _)| *size == view.size)
            .and_then(|(_, pixels)| Shown::new(&self.egui, view, &pixels));
        let name = self.state.looks.keep(look, shown);
        self.say(&format!("Kept the look as {name}"));
        self.log.write("kept", json!({ "name": name }));
    }

    pub(super) fn swap_look(&mut self) {
        let now = Look::of(self.viewer.session().scene());
        match self.state.looks.swap(now) {
            Some((name, look)) => {
                self.put_on(&format!("Swap to {name}"), |scene| look.put_on(scene))
            }
            None => self.say("Keep a look first: K"),
        }
    }

    /// Keeps a small version of the finished picture for the history, where the state of the document has none.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn keep_thumbnail(&mut self) {
        let session = self.viewer.session();
        let n_done = session.n_done();
        let state = session.state_after(n_done);
        let is_plain = self.viewer.inspection().is_none() && self.viewer.ground_truth().is_none();
        if !is_plain || self.state.thumbnails.of(state).is_some() {
            return;
        }
        let Ok((size, pixels)) = snapshot::pixels(&self.viewer) else {
            return;
        };
        let mut states: Vec<u64> = session.steps().map(|(_, state)| state).collect();
        states.push(session.state_after(0));
        let thumbnails = &mut self.state.thumbnails;
        thumbnails.retain(|state| states.contains(&state));
        thumbnails.keep(&self.egui, state, size, &pixels);
        self.log.write("thumbnail", json!({ "step": n_done }));
        self.window.request_redraw();
    }

    /// An edit of the look, as one step.
    fn put_on(&mut self, label: &str, change: impl FnOnce(&mut Scene)) {
        self.viewer.commit();
        let changed = self.viewer.edit(label, change);
        self.viewer.commit();
        match changed {
            Ok(change) if change.is_empty() => self.say("The look is the same"),
            Ok(_) => {
                self.say(label);
                self.changed("edit", json!({ "label": label }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// The hair as text, as scene files have it.
    pub(super) fn copy_look(&mut self) {
        match presets::to_text(&self.viewer.session().scene().hair) {
            Ok(text) => {
                self.clipboard.set_text(&text);
                self.input.set_clipboard_text(text);
                self.say("Copied the look as text");
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Puts on the hair of a text that was copied here, or from a scene file.
    pub(super) fn paste_look(&mut self) {
        let own = self.input.clipboard_text();
        let text = self.clipboard.text().or(own).unwrap_or_default();
        match presets::from_text(&text) {
            Ok(preset) => self.put_on("Paste look", |scene| {
                scene.hair = presets::dressed(&scene.hair, &preset);
            }),
            Err(error) => self.fail(&format!("The clipboard holds no look: {error}")),
        }
    }

    /// Draws the look that is compared for this view, in the background.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn draw_look(&mut self) {
        use std::sync::mpsc::{TryRecvError, channel};
        use strandlight_cpu::CpuRenderer;

        if let Some(drawn) = &self.look_job {
            match drawn.answer.try_recv() {
                Ok(answer) => {
                    let (name, view) = (drawn.name.clone(), drawn.view);
                    self.look_job = None;
                    self.take_look(&name, view, answer);
                    self.window.request_redraw();
                }
                Err(TryRecvError::Disconnected) => self.look_job = None,
                Err(TryRecvError::Empty) => return,
            }
        }
        let view = LookView::of(&self.viewer);
        // What is edited comes first, and of hair that moves the picture would be late.
        let is_moving = self.state.motion.moves(self.viewer.session().scene());
        if is_moving || !self.progress.is_done || !self.state.looks.wants(&view) {
            return;
        }
        let Some(kept) = self.state.looks.chosen() else {
            return;
        };
        let (name, look) = (kept.name.clone(), kept.look.clone());
        let mut session = self.viewer.session().clone();
        let seconds = self.viewer.time();
        let (tell, answer) = channel();
        std::thread::spawn(move || {
            let drawn = || -> Result<Vec<[u8; 4]>, SessionError> {
                session.edit("look", |scene| {
                    look.put_on(scene);
                    scene.camera = Some(section_of(&view.camera));
                })?;
                let render = session.scene().render.clone();
                let mut viewer: Viewer<CpuRenderer> =
                    Viewer::on(session, |scene| Ok(Box::new(CpuRenderer::new(scene))))?;
                viewer.set_time(seconds)?;
                let (picture, _) = viewer.frame(view.size, render.samples)?;
                let display = &viewer.prepared().display;
                let straight = picture.to_srgb8(render.exposure as f32, display);
                let times = |x: u8, a: u8| ((u32::from(x) * u32::from(a) + 127) / 255) as u8;
                let pixels = straight
                    .iter()
                    .map(|&[r, g, b, a]| [times(r, a), times(g, a), times(b, a), a]);
                Ok(pixels.collect())
            };
            let drawn = crate::apart::apart(drawn);
            let _ = tell.send(drawn.map_err(|error| error.to_string()));
        });
        self.look_job = Some(LookJob { name, view, answer });
    }

    /// Shows a look that was drawn for a view, or says why it was not.
    #[cfg(not(target_arch = "wasm32"))]
    fn take_look(&mut self, name: &str, view: LookView, drawn: Result<Vec<[u8; 4]>, String>) {
        match drawn {
            Ok(pixels) => {
                if let Some(shown) = Shown::new(&self.egui, view, &pixels) {
                    self.state.looks.show(name, shown);
                    self.log.write("look", json!({ "name": name }));
                }
            }
            Err(error) => {
                self.state.looks.fail(name, view);
                self.fail(&format!("Look {name} cannot be drawn: {error}"));
            }
        }
    }
}
