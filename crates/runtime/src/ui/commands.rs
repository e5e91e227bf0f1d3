//! Command handlers of the window: edits, strokes, undo and redo, files.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use web_time::Instant;

use super::document::Document;
use super::dropped::{Dropped, kind_of};
use super::keys::Command;
use super::layout::{UiOutput, UiState};
use super::panel::motion::end_of;
use super::pick;
use super::questions::{Answer, Question, Then, name_of};
use super::view::ViewportInput;
use super::workspace::Workspace;
use crate::error::SessionError;
use crate::session::Session;
use crate::viewer::Viewer;
use strandlight_scene::interactive::Progress;
use strandlight_scene::paint::Picker;
use strandlight_scene::{Camera, RenderError};

/// A document that cannot be saved.
#[derive(Debug, thiserror::Error)]
enum SaveError {
    #[error(transparent)]
    Session(#[from] SessionError),
    #[cfg(target_arch = "wasm32")]
    #[error(transparent)]
    Web(#[from] crate::page::WebError),
}

impl Workspace {
    /// Applies the output of a frame. Returns whether the user is dragging something.
    pub(super) fn handle(&mut self, output: UiOutput) -> bool {
        let is_changed = output.scene != *self.viewer.session().scene();
        if let (true, Some(label)) = (is_changed, &output.changes.label) {
            let scene = output.scene;
            match self.viewer.edit(label, |of_session| *of_session = scene) {
                Ok(_) => {
                    self.state.error = None;
                    self.changed("edit", json!({ "label": label }));
                }
                Err(error) => self.fail(&error.to_string()),
            }
        }
        if output.changes.is_complete {
            self.viewer.commit();
        }
        let is_moved = output.view.is_some();
        if let Some(view) = output.view {
            self.look(view);
        }
        for command in output.commands {
            self.run(command);
        }
        if let Some(answer) = output.answer {
            self.answer(answer);
        }
        if let Some(place) = output
            .viewport
            .clicked
            .filter(|_| self.state.lights.is_picking)
        {
            self.pick(place);
        }
        self.paint(&output.viewport);
        self.move_clock();
        if let Some(place) = output.viewport.clicked_twice {
            self.look_at(place);
        }
        self.resize_picture(output.viewport.size);
        is_changed || is_moved || output.viewport.is_dragged
    }

    /// Tells the log where controls are, when that is not where they were.
    pub(super) fn note_places(&mut self, output: &UiOutput) {
        if !self.log.is_on() {
            return;
        }
        let scale = self.egui.pixels_per_point();
        let pixels = |rect: &egui::Rect| {
            let corners = [rect.left(), rect.top(), rect.right(), rect.bottom()];
            corners.map(|x| (x * scale).round())
        };
        let places: serde_json::Map<String, Value> = (output.changes.places.iter())
            .map(|(name, rect)| (name.clone(), json!(pixels(rect))))
            .collect();
        let places = Value::Object(places);
        if places != self.places {
            self.log.write("places", json!({ "places": places }));
            self.places = places;
        }
    }

    pub(super) fn run(&mut self, command: Command) {
        match command {
            Command::Undo | Command::Redo => self.step(command == Command::Undo),
            Command::Save => self.save(Then::Stay),
            Command::SaveAs => self.ask(Question::SaveAs {
                path: self.document.path_text(),
                failure: None,
            }),
            Command::Reload => self.reload(),
            Command::Screenshot => self.screenshot(),
            Command::Paint => self.state.paint.is_on = !self.state.paint.is_on,
            Command::LargerBrush => self.state.paint.scale(1.25),
            Command::SmallerBrush => self.state.paint.scale(0.8),
            Command::Play => {
                let end = end_of(self.viewer.session().scene());
                self.state.motion.toggle(end);
            }
            Command::Help => self.state.is_help_open = !self.state.is_help_open,
            Command::Escape => {
                let state = &mut self.state;
                let (help, picking) = (&mut state.is_help_open, &mut state.lights.is_picking);
                if let Some(open) = [help, picking, &mut state.paint.is_on]
                    .into_iter()
                    .find(|is_open| **is_open)
                {
                    *open = false;
                }
            }
            Command::Close => self.close(),
            Command::Home => {
                self.viewer.reset_view();
                self.changed("view", json!({}));
            }
            Command::SaveView => self.save_view(),
            // A view, as the mouse gives others.
            Command::Frame => {}
        }
        self.is_outdated = true;
    }

    /// Looks from elsewhere.
    pub(super) fn look(&mut self, view: Camera) {
        match self.viewer.set_view(view) {
            Ok(()) => self.changed("view", json!({})),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Makes the view the scene's camera.
    pub(super) fn save_view(&mut self) {
        match self.viewer.save_view() {
            Ok(change) if change.is_empty() => {
                self.say("The view already matches the scene's camera")
            }
            Ok(_) => {
                self.say("Saved the view as the scene's camera");
                self.changed("edit", json!({ "label": "Save view" }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Selects the light that adds most where the picture was clicked.
    pub(super) fn pick(&mut self, place: [f32; 2]) {
        let hit = self.viewer.pick(place);
        let (scene, session) = (self.viewer.prepared(), self.viewer.session());
        let section = &session.scene().lights;
        let mut lights = session.assets().turned_lights(section);
        for (light, rgb) in lights
            .iter_mut()
            .zip(session.assets().light_colors(section))
        {
            light.rgb = rgb;
        }
        let found = hit
            .and_then(|position| pick::nearest(&scene.strands, position))
            .and_then(|point| pick::brightest(scene, &lights, scene.camera.eye, point));
        let light = found.map(|found| found.light);
        self.log.write("picked", json!({ "light": light }));
        let state = &mut self.state.lights;
        state.is_picking = false;
        state.picked = Some(match found {
            Some(found) => {
                state.selected = Some(found.light as u32);
                state.reveal = true;
                format!(
                    "Light {} contributes most there: about {:.0} % of single scattering.",
                    found.light,
                    100.0 * found.share
                )
            }
            None => "No lit hair there: click on a strand.".to_owned(),
        });
    }

    /// Brings the strand under the mouse to the middle of the picture.
    pub(super) fn look_at(&mut self, place: [f32; 2]) {
        let Some(target) = self.viewer.pick(place) else {
            return;
        };
        let camera = self.viewer.prepared().camera;
        let moved = Camera {
            eye: camera.eye + target - camera.target,
            target,
            ..camera
        };
        self.look(moved);
    }

    /// Moves the brush. A stroke lasts as long as the button is down.
    pub(super) fn paint(&mut self, viewport: &ViewportInput) {
        let state = &mut self.state.paint;
        let circle = state.radius_px.take();
        if !state.is_on && !self.is_stroking {
            return;
        }
        let brush = state.brush(self.viewer.session().scene());
        let drag = |viewer: &mut Viewer, path: &[[f32; 2]]| {
            let mut places = path.iter();
            places.try_for_each(|&place| viewer.drag(place))
        };
        let painted = match (&viewport.brush, self.is_stroking) {
            (Some(path), false) => {
                self.is_stroking = true;
                let pressed = self.viewer.press(brush);
                pressed.and_then(|()| drag(&mut self.viewer, path))
            }
            (Some(path), true) => drag(&mut self.viewer, path),
            (None, true) => {
                self.is_stroking = false;
                self.end_stroke();
                Ok(())
            }
            (None, false) => Ok(()),
        };
        if let Err(error) = painted {
            self.fail(&error.to_string());
        }
        if let Some(hit) = viewport.hover.and_then(|place| self.viewer.pick(place)) {
            let camera = self.viewer.prepared().camera;
            let radius = Picker::radius_px(&camera, viewport.size, hit, brush.radius_cm);
            self.state.paint.radius_px = Some(radius);
        }
        // The circle around the mouse was drawn before it was known.
        self.is_outdated |= self.state.paint.radius_px != circle;
    }

    /// Ends the stroke that is being made, if one is: it can be undone and saved from then on.
    pub(super) fn end_stroke(&mut self) {
        match self.viewer.release() {
            Ok(change) if change.is_empty() => {}
            Ok(_) => self.changed("stroke", json!({})),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Lets the time of the motion go on.
    pub(super) fn move_clock(&mut self) {
        let now = Instant::now();
        let passed = now.duration_since(self.last_tick).as_secs_f64();
        self.last_tick = now;
        let scene = self.viewer.session().scene();
        let motion = &mut self.state.motion;
        if motion.is_playing && scene.motion.is_some() {
            // A window that was hidden goes on where it was.
            motion.seconds += passed.min(0.25);
            if let Some(end) = end_of(scene).filter(|&end| motion.seconds >= end) {
                // The last frame stays, and its picture is finished.
                (motion.seconds, motion.is_playing) = (end, false);
            }
            self.window.request_redraw();
        }
        if motion.seconds != self.viewer.time() {
            let seconds = motion.seconds;
            if let Err(error) = self.viewer.set_time(seconds) {
                self.fail(&error.to_string());
            }
            self.is_stale = true;
        }
    }

    pub(super) fn step(&mut self, is_back: bool) {
        let stepped = match is_back {
            true => self.viewer.undo(),
            false => self.viewer.redo(),
        };
        match stepped {
            Ok(Some(_)) => {
                let event = if is_back { "undo" } else { "redo" };
                self.changed(event, json!({}));
            }
            Ok(None) => {}
            Err(error) => self.fail(&error.to_string()),
        }
    }

    pub(super) fn resize_picture(&mut self, size: [u32; 2]) {
        if size.contains(&0) {
            return;
        }
        let side = self.screen.max_texture_side();
        let size = size.map(|pixels| pixels.min(side));
        if let Err(error) = self.viewer.set_window(size) {
            self.fail(&error.to_string());
        }
    }

    pub(super) fn close(&mut self) {
        self.before_losing(Then::Close);
    }

    /// Goes on with `then`, by which changes would be lost: asks first where there are any.
    fn before_losing(&mut self, then: Then) {
        self.end_stroke();
        if self.viewer.session().is_modified() {
            self.ask(Question::Unsaved { then });
        } else {
            self.go_on(then);
        }
    }

    fn go_on(&mut self, then: Then) {
        match then {
            Then::Stay => {}
            Then::Close => self.is_open = false,
            Then::Open(path) => self.open(&path),
        }
    }

    pub(super) fn ask(&mut self, question: Question) {
        self.log
            .write("question", json!({ "name": question.name() }));
        self.state.question = Some(question);
        self.is_outdated = true;
        self.window.request_redraw();
    }

    pub(super) fn answer(&mut self, answer: Answer) {
        match answer {
            Answer::SaveAs(path) => self.save_as(path, false),
            Answer::Replace(path) => self.save_as(path, true),
            Answer::Overwrite(then) => {
                self.viewer.keep_mine();
                self.state.is_stale = false;
                self.save(then);
            }
            Answer::Save(then) => self.save(then),
            Answer::Discard(then) => self.go_on(then),
            Answer::KeepMine => {
                self.viewer.keep_mine();
                self.state.is_stale = false;
            }
        }
        self.is_outdated = true;
    }

    /// Saves where the scene is from and goes on with `then`; asks first where another program has
    /// written that file.
    pub(super) fn save(&mut self, then: Then) {
        self.end_stroke();
        if let Some(file) = self.viewer.session().conflict() {
            let file = file.to_owned();
            return self.ask(Question::Overwrite { file, then });
        }
        match self.write(None) {
            Ok(()) => self.go_on(then),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Saves to the path that was typed; asks before it replaces another file there.
    fn save_as(&mut self, path: String, is_agreed: bool) {
        let session = self.viewer.session();
        let typed = Path::new(&path);
        let is_replacing = session.replaces_other(typed);
        if !is_replacing && session.files().exists(typed) {
            return self.save(Then::Stay);
        }
        // What cannot be written is not asked about.
        let can_be_written = session.check_target(typed).map_err(SaveError::from);
        if can_be_written.is_ok() && is_replacing && !is_agreed {
            return self.ask(Question::Replace { path });
        }
        if let Err(error) = can_be_written.and_then(|()| self.write(Some(typed))) {
            let error = error.to_string();
            self.log.write("error", json!({ "message": error }));
            let failure = Some(error);
            self.ask(Question::SaveAs { path, failure });
        }
    }

    fn write(&mut self, path: Option<&Path>) -> Result<(), SaveError> {
        let saved = match path {
            Some(path) => self.viewer.save_as(path),
            None => self.viewer.save(),
        };
        let saved = saved?;
        // What was saved in a page's memory is the reader's to keep.
        #[cfg(target_arch = "wasm32")]
        crate::page::offer(self.viewer.session().files(), &saved)?;
        #[cfg(not(target_arch = "wasm32"))]
        let _ = saved;
        self.document.saved(&self.viewer);
        self.say(&format!("Saved {}", self.document.path_text()));
        self.log
            .write("saved", json!({ "path": self.document.path_text() }));
        Ok(())
    }

    /// Takes a file that was dropped on the window.
    pub(super) fn take_file(&mut self, path: &Path) {
        self.end_stroke();
        match kind_of(path) {
            Ok(Dropped::Scene) => self.before_losing(Then::Open(path.to_owned())),
            Ok(kind) => self.swap(kind, path),
            Err(error) => self.fail(&error.to_string()),
        }
        self.window.request_redraw();
    }

    /// Puts another groom or light set into the scene.
    fn swap(&mut self, kind: Dropped, path: &Path) {
        let file: PathBuf = self.viewer.session().path_in_scene(path);
        let what = match kind {
            Dropped::Lights => "Light set",
            _ => "Groom",
        };
        let name = name_of(path);
        let label = format!("{what} {name}");
        self.viewer.commit();
        let changed = self.viewer.edit(&label, |scene| match kind {
            Dropped::Lights if scene.lights.file != file => {
                let lights = &mut scene.lights;
                lights.file = file;
                // These name lights of the old set by number.
                (lights.muted, lights.solo, lights.adjust) = Default::default();
            }
            Dropped::Lights => {}
            _ => scene.groom.file = file,
        });
        self.viewer.commit();
        match changed {
            Ok(change) if change.is_empty() => {
                self.say(&format!("The scene already uses {name}"));
            }
            Ok(_) => {
                self.state.lights.forget();
                self.say(&label);
                self.document.saved(&self.viewer);
                self.changed("edit", json!({ "label": label }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Opens another scene in place of this one, which stays if that fails.
    fn open(&mut self, path: &Path) {
        let opened = Session::open(path).and_then(|session| {
            let chosen = self.screen.chosen(self.choice);
            let chosen = chosen.map_err(|error| RenderError::Gpu(error.into()))?;
            Viewer::choose(self.choice, chosen, session)
        });
        match opened {
            Ok(viewer) => {
                self.viewer = viewer;
                self.document = Document::new(&self.viewer);
                self.state = UiState {
                    paint: std::mem::take(&mut self.state.paint),
                    is_help_open: self.state.is_help_open,
                    ..UiState::default()
                };
                self.progress = Progress::default();
                self.is_stuck = false;
                self.say(&format!("Opened {}", path.display()));
                self.changed("opened", json!({ "path": path.display().to_string() }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
        self.window.request_redraw();
    }

    pub(super) fn on_files(&mut self) {
        self.end_stroke();
        if self.viewer.session().is_modified() {
            self.state.is_stale = true;
        } else {
            self.reload();
        }
        self.window.request_redraw();
    }

    pub(super) fn reload(&mut self) {
        self.state.is_stale = false;
        match self.viewer.reload() {
            Ok(_) => {
                self.document.saved(&self.viewer);
                self.say("Reloaded");
                self.changed("reloaded", json!({}));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    pub(super) fn screenshot(&mut self) {
        let saved = self.document.screenshot(&self.viewer);
        match saved {
            Ok(path) => {
                self.say(&format!("Wrote {path}"));
                self.log.write("picture", json!({ "path": path }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Notes something after which the picture is another.
    pub(super) fn changed(&mut self, event: &str, more: Value) {
        self.is_stale = true;
        self.log.write(event, more);
    }

    pub(super) fn say(&mut self, message: &str) {
        message.clone_into(&mut self.state.message);
        self.state.error = None;
        self.is_outdated = true;
    }

    pub(super) fn fail(&mut self, message: &str) {
        if self.state.error.as_deref() != Some(message) {
            self.log.write("error", json!({ "message": message }));
            self.is_outdated = true;
        }
        self.state.error = Some(message.to_owned());
    }
}
