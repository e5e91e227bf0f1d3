//! What the window does when it is asked: edits, strokes, steps back, files.

use std::path::Path;

use serde_json::{Value, json};
use web_time::Instant;

use super::keys::Command;
use super::layout::Asked;
use super::panel::motion::end_of;
use super::pick;
use super::view::{self, Seen};
use super::workspace::Workspace;
use crate::Camera;
use crate::paint::Picker;

impl Workspace {
    /// Does what a frame asked for. Answers whether somebody is moving something.
    pub(super) fn serve(&mut self, asked: Asked) -> bool {
        let is_changed = asked.scene != *self.viewer.session().scene();
        if let (true, Some(label)) = (is_changed, &asked.changes.label) {
            let scene = asked.scene;
            match self.viewer.edit(label, |of_session| *of_session = scene) {
                Ok(_) => {
                    self.state.error = None;
                    self.changed("edit", json!({ "label": label }));
                }
                Err(error) => self.fail(&error.to_string()),
            }
        }
        if asked.changes.is_complete {
            self.viewer.commit();
        }
        for command in asked.commands {
            self.run(command);
        }
        if let Some(path) = asked.save_to {
            self.save(Some(&path));
        }
        if let Some(place) = asked.seen.clicked.filter(|_| self.state.lights.is_picking) {
            self.pick(place);
        }
        self.paint(asked.seen);
        self.move_clock();
        if let Some(place) = asked.seen.clicked_twice {
            self.look_at(place);
        }
        match asked.close {
            Some(true) => self.is_open = !self.save(None),
            Some(false) => self.is_open = false,
            None => {}
        }
        self.resize_picture(asked.seen.size);
        is_changed || asked.seen.is_dragged
    }

    /// Tells the log where controls are, when that is not where they were.
    pub(super) fn note_places(&mut self, asked: &Asked) {
        if !self.log.is_on() {
            return;
        }
        let scale = self.egui.pixels_per_point();
        let pixels = |rect: &egui::Rect| {
            let corners = [rect.left(), rect.top(), rect.right(), rect.bottom()];
            corners.map(|x| (x * scale).round())
        };
        let places: serde_json::Map<String, Value> = (asked.changes.places.iter())
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
            Command::Save => drop(self.save(None)),
            Command::SaveAs => self.state.save_as = Some(self.document.path_text()),
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
            // Edits of the scene, done with those of the panel.
            Command::Frame | Command::Home => {}
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
                    "Light {} adds most there: about {:.0} % of the light scattered once.",
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
        let section = view::section_of(&moved);
        self.viewer.commit();
        if let Err(error) = self
            .viewer
            .edit("Look at", |scene| scene.camera = Some(section))
        {
            self.fail(&error.to_string());
        }
        self.viewer.commit();
    }

    /// Moves the brush. A stroke lasts as long as the button is down.
    pub(super) fn paint(&mut self, seen: Seen) {
        let state = &mut self.state.paint;
        state.radius_px = None;

        if !state.is_on && !self.is_stroking {
            return;
        }
        let brush = state.brush(self.viewer.session().scene());
        let painted = match (seen.brush, self.is_stroking) {
            (Some(place), false) => {
                self.is_stroking = true;
                let pressed = self.viewer.press(brush);
                pressed.and_then(|()| self.viewer.drag(place))
            }
            (Some(place), true) => self.viewer.drag(place),
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
        if let Some(hit) = seen.hover.and_then(|place| self.viewer.pick(place)) {
            let camera = self.viewer.prepared().camera;
            let radius = Picker::radius_px(&camera, seen.size, hit, brush.radius_cm);
            self.state.paint.radius_px = Some(radius);
        }
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
        self.end_stroke();
        if self.viewer.session().is_modified() {
            self.state.is_closing = true;
            self.window.request_redraw();
        } else {
            self.is_open = false;
        }
    }

    /// Saves to `path`, or where the scene is from. Answers whether that worked.
    pub(super) fn save(&mut self, path: Option<&str>) -> bool {
        let saved = match path {
            Some(path) => self.viewer.save_as(Path::new(path)),
            None => self.viewer.save(),
        };
        let saved = saved.map_err(|error| error.to_string());
        // What was saved in a page's memory is the reader's to keep.
        #[cfg(target_arch = "wasm32")]
        let saved =
            saved.and_then(|saved| crate::web::offer(self.viewer.session().files(), &saved));
        match saved {
            Ok(_) => {
                self.document.saved(&self.viewer);
                self.say(&format!("Saved {}", self.document.path_text()));
                self.log
                    .write("saved", json!({ "path": self.document.path_text() }));
                true
            }
            Err(error) => {
                self.fail(&error);
                false
            }
        }
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
                self.state.home = self.viewer.session().scene().camera.clone();
                self.say("Reloaded");
                self.changed("reloaded", json!({}));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    pub(super) fn screenshot(&mut self) {
        let saved = self.document.screenshot(&self.screen.context, &self.viewer);
        match saved {
            Ok(path) => {
                self.say(&format!("Wrote {path}"));
                self.log.write("picture", json!({ "path": path }));
            }
            Err(error) => self.fail(&error),
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
    }

    pub(super) fn fail(&mut self, message: &str) {
        if self.state.error.as_deref() != Some(message) {
            self.log.write("error", json!({ "message": message }));
        }
        self.state.error = Some(message.to_owned());
    }
}
