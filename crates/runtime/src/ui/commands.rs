//! Command handlers of the window: edits, strokes, undo and redo.

mod files;
mod lights;
mod looks;
#[cfg(not(target_arch = "wasm32"))]
mod opening;
mod views;

use serde_json::{Value, json};
use strandlight_scattering::color::reflectance_from_sigma_a;
use strandlight_scene::paint::{Brush, BrushEffect, Picker};
use web_time::Instant;

use super::keys::Command;
use super::layout::UiOutput;
use super::orbit::Bounds;
use super::panel::motion::end_of;
use super::questions::{Question, Then};
use super::stroke_input::drag;
use super::view::ViewportInput;
use super::workspace::Workspace;
use crate::session::{Change, Edits};

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
            self.look(view, output.viewport.is_dragged);
        }
        if !output.viewport.is_dragged {
            self.views.released();
        }
        if is_changed || !output.commands.is_empty() {
            self.moved_on();
        }
        for command in output.commands {
            self.run(command);
        }
        // After the commands, whose success is no reason to forget it.
        if let Some(refused) = output.changes.refused {
            self.fail(&refused);
        }
        #[cfg(not(target_arch = "wasm32"))]
        self.inspect_selected();
        if let Some(answer) = output.answer {
            self.answer(answer);
        }
        if let Some(place) = output.viewport.clicked {
            match &self.state.lights {
                lights if lights.is_picking => self.pick(place),
                lights if lights.is_placing => self.place_highlight(place),
                _ => {}
            }
        }
        if let Some(place) = output
            .viewport
            .clicked
            .filter(|_| self.state.paint.is_picking)
        {
            self.pick_color(place);
        }
        self.paint(&output.viewport);
        self.move_clock();
        let clicked_twice = output.viewport.clicked_twice;
        if let Some(place) = clicked_twice.filter(|_| !self.state.camera.is_locked) {
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
            Command::GoTo(n_done) => self.go_to(n_done),
            Command::Save => self.save(Then::Stay),
            Command::SaveAs => self.ask_where(Then::Stay),
            Command::Open => self.ask_what(),
            Command::Sample => self.before_losing(Then::Sample),
            Command::ForgetRecent => self.state.settings.forget(),
            Command::Still => self.ask_still(),
            Command::SavePreset => self.ask(Question::Preset {
                name: String::new(),
                failure: None,
            }),
            Command::Panel => self.state.panel.toggle(),
            Command::KeepLook => self.keep_look(),
            Command::SwapLook => self.swap_look(),
            Command::Wipe => {
                if self.state.looks.kept().is_empty() {
                    self.keep_look();
                }
                self.state.looks.is_wiping = !self.state.looks.is_wiping;
            }
            Command::GroundTruth => self.toggle_ground_truth(),
            #[cfg(not(target_arch = "wasm32"))]
            Command::Inspect(inspection) => self.inspect(inspection),
            Command::NextInspection => self.inspect_next(),
            Command::NextLightLayer => self.inspect_next_layer(),
            Command::NextLights => self.next_light_set(true),
            Command::LightsBefore => self.next_light_set(false),
            Command::CopyLook => self.copy_look(),
            Command::PasteLook => self.paste_look(),
            // The menu has it greyed out. What other programs wrote is read whatever the scene is.
            Command::Reload
                if self.viewer.session().is_unsaved() && !self.state.has_changed_on_disk =>
            {
                self.say("There is no file yet to reload the scene from");
            }
            Command::Reload => self.reload(),
            Command::Screenshot => self.screenshot(),
            Command::Paint => self.state.paint.is_on = !self.state.paint.is_on,
            Command::Flood => {
                let brush = self.state.paint.brush(self.viewer.session().scene());
                self.flood(&brush);
            }
            Command::InvertMask => self.flood_mask(BrushEffect::InvertProtection),
            Command::ClearMask => self.flood_mask(BrushEffect::Protect(0.0)),
            Command::LargerBrush => self.state.paint.scale(1.25),
            Command::SmallerBrush => self.state.paint.scale(0.8),
            Command::Play => match self.viewer.session().scene() {
                scene if scene.motion.is_some() => self.state.motion.toggle(end_of(scene)),
                _ => self.say("Nothing moves in this scene: the section Motion has wind"),
            },
            Command::Help => self.state.is_help_open = !self.state.is_help_open,
            Command::Escape => {
                let state = &mut self.state;
                let (help, lights, paint) =
                    (&mut state.is_help_open, &mut state.lights, &mut state.paint);
                let (picking, placing) = (&mut lights.is_picking, &mut lights.is_placing);
                let (color, painting) = (&mut paint.is_picking, &mut paint.is_on);
                if let Some(open) = [help, picking, placing, color, painting]
                    .into_iter()
                    .find(|is_open| **is_open)
                {
                    *open = false;
                }
            }
            Command::Close => self.close(),
            Command::Home => {
                self.views.close();
                let from = self.viewer.prepared().camera;
                self.views.left(from, false, Instant::now());
                self.views.close();
                self.viewer.reset_view();
                self.changed("view", json!({}));
            }
            Command::ViewBack | Command::ViewForward => {
                let from = self.viewer.prepared().camera;
                let view = match command {
                    Command::ViewBack => self.views.back(from),
                    _ => self.views.forward(from),
                };
                if let Some(view) = view {
                    self.set_view(view);
                }
            }
            Command::Look(side) => self.look_from(side),
            Command::SaveView => self.save_view(),
            // A view, as the mouse gives others.
            Command::Frame => {}
        }
        self.is_outdated = true;
    }

    /// Moves the brush. A stroke lasts as long as the button is down.
    pub(super) fn paint(&mut self, viewport: &ViewportInput) {
        let state = &mut self.state.paint;
        let circle = state.radius_px.take();
        if !state.is_on && !self.is_stroking {
            return;
        }
        let mut brush = state.brush(self.viewer.session().scene());
        if self.egui.input(|input| input.modifiers.shift) {
            brush.effect = state.other(brush.effect);
        }
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
        if viewport.brush.is_some() {
            let version = self.viewer.display().version();
            self.awaited.get_or_insert(version);
        }
        if let Some(hit) = viewport.hover.and_then(|place| self.viewer.pick(place)) {
            let camera = self.viewer.prepared().camera;
            let radius = Picker::radius_px(&camera, viewport.size, hit, brush.radius_cm);
            self.state.paint.radius_px = Some(radius);
        }
        // The circle around the mouse was drawn before it was known.
        self.is_outdated |= self.state.paint.radius_px != circle;
    }

    /// Changes the mask of all hair, whatever the brush is.
    fn flood_mask(&mut self, effect: BrushEffect) {
        self.flood(&Brush {
            effect,
            ..Brush::default()
        });
    }

    /// Paints all hair with a brush.
    fn flood(&mut self, brush: &Brush) {
        match self.viewer.flood(brush) {
            Ok(change) if change.is_empty() && brush.effect.is_of_mask() => {
                self.say("The mask is so already");
            }
            Ok(change) if change.is_empty() => self.say("Nothing to paint there"),
            Ok(_) => self.changed("flood", json!({})),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// The dye takes the colour of the hair where the picture was clicked.
    fn pick_color(&mut self, place: [f32; 2]) {
        let caustic_width = self.viewer.session().scene().hair.params().caustic_width;
        let sigma_a = self.viewer.pick_sigma_a(place);
        self.log.write("color", json!({ "sigma_a": sigma_a }));
        self.state.paint.is_picking = false;
        match sigma_a {
            Some(sigma_a) => {
                let color = reflectance_from_sigma_a(sigma_a, caustic_width);
                self.state.paint.dye(color);
            }
            None => self.say("No hair there: click on a strand."),
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
        if motion.moves(scene) {
            // A window that was hidden goes on where it was.
            motion.seconds += passed.min(0.25);
            if let Some(end) = end_of(scene).filter(|&end| motion.seconds >= end) {
                // The last frame stays, and its picture is finished.
                (motion.seconds, motion.is_playing) = (end, false);
            }
            // While a thread works, a frame follows whenever there is something to see.
            if !self.works_between_frames() || self.progress.is_done || self.is_stuck {
                self.window.request_redraw();
            }
        }
        // Without a device hair moves on once it was seen where it is: to bend it for nobody takes time from its picture.
        let version = self.viewer.display().version();
        let is_seen = !self.works_between_frames()
            || self.progress.is_done
            || self.is_stuck
            || version != self.moved_at;
        let seconds = self.state.motion.seconds;
        if seconds != self.viewer.time() && is_seen {
            if let Err(error) = self.viewer.set_time(seconds) {
                self.fail(&error.to_string());
            }
            (self.is_unlogged, self.moved_at) = (true, version);
        }
    }

    pub(super) fn step(&mut self, is_back: bool) {
        let before = Bounds::of(&self.viewer.prepared().strands);
        let stepped = match is_back {
            true => self.viewer.undo(),
            false => self.viewer.redo(),
        };
        match stepped {
            Ok(Some(change)) => {
                let event = if is_back { "undo" } else { "redo" };
                self.changed(event, json!({}));
                self.show_other_hair(&change, before);
            }
            Ok(None) => {}
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Goes to the state after the first `n_done` steps.
    pub(super) fn go_to(&mut self, n_done: usize) {
        let before = self.viewer.session().n_done();
        let bounds = Bounds::of(&self.viewer.prepared().strands);
        match self.viewer.go_to(n_done) {
            Ok(Some(change)) => {
                let event = if n_done < before { "undo" } else { "redo" };
                let n_steps = n_done.abs_diff(before);
                self.changed(event, json!({ "steps": n_steps }));
                self.show_other_hair(&change, bounds);
            }
            Ok(None) => {}
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Frames the hair where an undo has brought other hair than `before`, and the view does not show it.
    fn show_other_hair(&mut self, change: &Change, before: Bounds) {
        if change.has(Edits::GEOMETRY) {
            self.frame_other_hair(before);
        }
    }

    pub(super) fn resize_picture(&mut self, size: [u32; 2]) {
        if size.contains(&0) {
            return;
        }
        let side = self.screen.max_texture_side();
        let size = size.map(|pixels| pixels.min(side));
        // The picture of another size is another one.
        self.is_unlogged |= size != self.viewer.size();
        if let Err(error) = self.viewer.set_window(size) {
            self.fail(&error.to_string());
        }
    }

    /// Saves the picture once it is finished.
    pub(super) fn screenshot(&mut self) {
        self.is_to_be_saved = true;
        self.save_if_finished();
        if self.is_to_be_saved {
            self.say("The picture is saved once it is finished");
        }
    }

    /// Saves the picture if that was asked for and it is finished; as it is where hair moves on, or nothing more comes.
    pub(super) fn save_if_finished(&mut self) {
        let is_moving = self.state.motion.moves(self.viewer.session().scene());
        let is_finished =
            self.progress.is_done && !self.is_unlogged && self.viewer.awaited_layer().is_none();
        if !self.is_to_be_saved || !(is_finished || is_moving || self.is_stuck) {
            return;
        }
        self.is_to_be_saved = false;
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
        (self.is_unlogged, self.awaited) = (true, Some(self.viewer.display().version()));
        self.log.write(event, more);
    }

    /// Notes that the status line's message is no longer of the last thing that was done.
    pub(super) fn moved_on(&mut self) {
        self.state.message.clear();
    }

    pub(super) fn say(&mut self, message: &str) {
        message.clone_into(&mut self.state.message);
        self.state.error = None;
        self.is_outdated = true;
    }

    pub(super) fn fail(&mut self, message: &str) {
        let message = strandlight_formats::system_in_plain_words(message);
        if self.state.error.as_ref() != Some(&message) {
            self.log.write("error", json!({ "message": &message }));
            self.is_outdated = true;
        }
        self.state.error = Some(message);
    }
}

/// A page has the files that it was opened with.
#[cfg(target_arch = "wasm32")]
impl Workspace {
    pub(super) fn take_file(&mut self, _: &std::path::Path) {}

    fn open(&mut self, _: Option<std::path::PathBuf>) {}
}
