//! Command handlers of the window: edits, strokes, undo and redo, files.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use web_time::Instant;

#[cfg(not(target_arch = "wasm32"))]
use super::desktop;
use super::document::Document;
#[cfg(not(target_arch = "wasm32"))]
use super::job::{Job, Made, News, Wanted};
use super::keys::{Command, Side};
use super::layout::{UiOutput, UiState};
use super::looks::{Look, Shown};
use super::orbit;
use super::orbit::Bounds;
use super::panel::motion::end_of;
use super::pick;
use super::picker::{Picker as FilePicker, Purpose};
use super::presets;
use super::questions::{Answer, Question, Then, name_of};
use super::snapshot;
use super::view::ViewportInput;
use super::views::Views;
#[cfg(not(target_arch = "wasm32"))]
use super::workspace::LookJob;
use super::workspace::Workspace;
use crate::error::SessionError;
#[cfg(not(target_arch = "wasm32"))]
use crate::inspection::Inspection;
use crate::session::Session;
#[cfg(not(target_arch = "wasm32"))]
use crate::session::section_of;
use crate::viewer::Viewer;
use strandlight_formats::Scene;
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
            self.look(view, output.viewport.is_dragged);
        }
        if !output.viewport.is_dragged {
            self.views.released();
        }
        if let Some(refused) = output.changes.refused {
            self.fail(&refused);
        }
        if is_changed || !output.commands.is_empty() {
            self.moved_on();
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
            Command::CopyLook => self.copy_look(),
            Command::PasteLook => self.paste_look(),
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

    /// Looks from elsewhere, by a drag that may go on or at once.
    pub(super) fn look(&mut self, view: Camera, is_drag: bool) {
        let from = self.viewer.prepared().camera;
        self.views.left(from, is_drag, Instant::now());
        self.set_view(view);
    }

    /// Looks at all hair from a side.
    fn look_from(&mut self, side: Side) {
        let strands = &self.viewer.prepared().strands;
        let bounds = Bounds {
            centre: strands.centre,
            radius: strands.radius,
        };
        let camera = self.viewer.prepared().camera;
        let [width, height] = self.viewer.size().map(|side| side.max(1) as f32);
        self.views.close();
        self.look(
            orbit::from_side(&camera, side, bounds, width / height),
            false,
        );
        self.views.close();
    }

    fn set_view(&mut self, view: Camera) {
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

    /// Keeps the look with the picture that is shown.
    fn keep_look(&mut self) {
        let look = Look::of(self.viewer.session().scene());
        // Of the fast picture alone: others are compared with it.
        #[cfg(not(target_arch = "wasm32"))]
        let is_plain = self.viewer.inspection().is_none() && self.viewer.ground_truth().is_none();
        #[cfg(target_arch = "wasm32")]
        let is_plain = true;
        let shown = (self.progress.is_done && is_plain).then(|| snapshot::pixels(&self.viewer));
        let shown = shown.and_then(Result::ok).and_then(|(size, pixels)| {
            let camera = self.viewer.prepared().camera;
            Shown::new(&self.egui, camera, size, &pixels)
        });
        let name = self.state.looks.keep(look, shown);
        self.say(&format!("Kept the look as {name}"));
        self.log.write("kept", json!({ "name": name }));
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn toggle_ground_truth(&mut self) {
        let is_wanted = self.viewer.ground_truth().is_none();
        self.viewer.set_ground_truth(is_wanted);
        self.truth = None;
        self.log
            .write("ground_truth", json!({ "is_wanted": is_wanted }));
        self.say(match is_wanted {
            true => "The finished picture goes on to ground truth while nothing changes",
            false => "Back to the fast picture",
        });
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn inspect(&mut self, inspection: Option<Inspection>) {
        self.viewer.set_inspection(inspection);
        let name = inspection.map(Inspection::name);
        self.log.write("inspect", json!({ "inspection": name }));
        if inspection == Some(Inspection::Error) && self.viewer.ground_truth().is_none() {
            self.say("The error is told on the way to ground truth: G");
        } else {
            self.say(name.unwrap_or("The picture"));
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn inspect_next(&mut self) {
        let all = Inspection::ALL.map(|(inspection, _)| inspection);
        let next = match self.viewer.inspection() {
            None => all.first(),
            Some(now) => all.iter().skip_while(|&&it| it != now).nth(1),
        };
        self.inspect(next.copied());
    }

    #[cfg(target_arch = "wasm32")]
    fn inspect_next(&mut self) {
        self.say("Only strandview on a desktop shows more than the picture");
    }

    #[cfg(target_arch = "wasm32")]
    fn toggle_ground_truth(&mut self) {
        self.say("Ground truth needs strandview on a desktop");
    }

    fn swap_look(&mut self) {
        let now = Look::of(self.viewer.session().scene());
        match self.state.looks.swap(now) {
            Some((name, look)) => {
                self.put_on(&format!("Swap to {name}"), |scene| look.put_on(scene))
            }
            None => self.say("Keep a look first: K"),
        }
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
    fn copy_look(&mut self) {
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
    fn paste_look(&mut self) {
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
    pub(super) fn draw_look(&mut self) {
        use std::sync::mpsc::{TryRecvError, channel};
        use strandlight_cpu::CpuRenderer;

        if let Some(drawn) = &self.look_job {
            match drawn.answer.try_recv() {
                Ok(pixels) => {
                    if let Some(drawn) = self.look_job.take()
                        && let Some(pixels) = pixels
                        && let Some(shown) =
                            Shown::new(&self.egui, drawn.camera, drawn.size, &pixels)
                    {
                        self.state.looks.show(&drawn.name, shown);
                        self.log.write("look", json!({ "name": drawn.name }));
                    }
                    self.window.request_redraw();
                }
                Err(TryRecvError::Disconnected) => self.look_job = None,
                Err(TryRecvError::Empty) => return,
            }
        }
        let camera = self.viewer.prepared().camera;
        let size = self.viewer.size();
        // What is edited comes first.
        if !self.progress.is_done || !self.state.looks.wants(&camera, size) {
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
                    scene.camera = Some(section_of(&camera));
                })?;
                let render = session.scene().render.clone();
                let mut viewer: Viewer<CpuRenderer> =
                    Viewer::on(session, |scene| Ok(Box::new(CpuRenderer::new(scene))))?;
                viewer.set_time(seconds)?;
                let (picture, _) = viewer.frame(size, render.samples)?;
                let display = &viewer.prepared().display;
                let straight = picture.to_srgb8(render.exposure as f32, display);
                let times = |x: u8, a: u8| ((u32::from(x) * u32::from(a) + 127) / 255) as u8;
                let pixels = straight
                    .iter()
                    .map(|&[r, g, b, a]| [times(r, a), times(g, a), times(b, a), a]);
                Ok(pixels.collect())
            };
            // A look that cannot be drawn is not shown; putting it on says why.
            let _ = tell.send(drawn().ok());
        });
        self.look_job = Some(LookJob {
            name,
            camera,
            size,
            answer,
        });
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
        self.views.close();
        self.look(moved, false);
        self.views.close();
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
            Then::Open(path) => self.open(Some(path)),
            Then::Sample => self.open(None),
        }
    }

    pub(super) fn ask(&mut self, question: Question) {
        self.log
            .write("question", json!({ "name": question.name() }));
        self.state.question = Some(question);
        self.is_outdated = true;
        self.window.request_redraw();
    }

    /// Asks for a file to open.
    fn ask_what(&mut self) {
        // A page has no files to choose from.
        if cfg!(target_arch = "wasm32") {
            return;
        }
        #[cfg(not(target_arch = "wasm32"))]
        if desktop::has_dialogs() {
            return self.ask_desktop(Wanted::Open);
        }
        self.list_files();
    }

    /// Asks for a file to open by the window's own list.
    fn list_files(&mut self) {
        let path = self.viewer.session().path();
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let picker = FilePicker::in_folder_of(Purpose::Open, &whole, openable_extensions());
        self.ask(Question::Open {
            picker,
            failure: None,
        });
    }

    /// Asks where the scene is saved, and goes on with `then` once it is.
    fn ask_where(&mut self, then: Then) {
        #[cfg(not(target_arch = "wasm32"))]
        if desktop::has_dialogs() {
            return self.ask_desktop(Wanted::SaveAs(then));
        }
        self.list_places(then);
    }

    /// The same by the window's own list.
    fn list_places(&mut self, then: Then) {
        let path = self.document.path_text();
        self.ask(save_as_question(path, then));
    }

    /// Asks by the desktop's dialog.
    #[cfg(not(target_arch = "wasm32"))]
    fn ask_desktop(&mut self, wanted: Wanted) {
        let path = self.viewer.session().path();
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let title = "Choose a file in the desktop's dialog".to_owned();
        self.begin(Job::start(title, move |_| {
            let start = Instant::now();
            let path = match &wanted {
                Wanted::Open => desktop::open(&whole, &openable_extensions()),
                Wanted::SaveAs(_) => desktop::save(&whole),
            };
            Ok(Made::Chosen {
                is_missing: path.is_none() && start.elapsed() < desktop::GLANCE,
                wanted,
                path,
            })
        }));
    }

    pub(super) fn answer(&mut self, answer: Answer) {
        match answer {
            Answer::Open(path) => self.take_file(&path),
            Answer::SaveAs(path, then) => self.save_as(path, then, false),
            Answer::Still(still) => self.write_still(still, false),
            Answer::Replace(asked, path) => match *asked {
                Question::SaveAs { then, .. } => self.save_as(path, then, true),
                Question::Still { still, .. } => self.write_still(still, true),
                _ => {}
            },
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
            Answer::Preset(name) => self.save_preset(&name),
        }
        self.is_outdated = true;
    }

    /// Saves the hair as a preset of one's own.
    fn save_preset(&mut self, name: &str) {
        let hair = self.viewer.session().scene().hair.clone();
        match self.state.presets.save(name, &hair) {
            Ok(()) => self.say(&format!("Saved the preset {}", name.trim())),
            Err(failure) => {
                self.log.write("error", json!({ "message": failure }));
                let name = name.to_owned();
                self.ask(Question::Preset {
                    name,
                    failure: Some(failure),
                });
            }
        }
    }

    /// Saves where the scene is from and goes on with `then`; asks first where another program has
    /// written that file.
    pub(super) fn save(&mut self, then: Then) {
        self.end_stroke();
        if let Some(file) = self.viewer.session().conflict() {
            let file = file.to_owned();
            return self.ask(Question::Overwrite { file, then });
        }
        // One that was made here has no file yet.
        if self.viewer.session().is_unsaved() {
            return self.ask_where(then);
        }
        match self.write(None) {
            Ok(()) => self.go_on(then),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Saves to the path that was typed and goes on with `then`; asks before it replaces another file
    /// there.
    fn save_as(&mut self, path: String, then: Then, is_agreed: bool) {
        let session = self.viewer.session();
        let typed = Path::new(&path);
        let is_own = !session.is_unsaved() && !session.replaces_other(typed);
        if is_own && session.files().exists(typed) {
            return self.save(then);
        }
        // What cannot be written is not asked about.
        let can_be_written = session.check_target(typed).map_err(SaveError::from);
        let is_replacing = match session.is_unsaved() {
            true => typed.symlink_metadata().is_ok(),
            false => !is_own,
        };
        if can_be_written.is_ok() && is_replacing && !is_agreed {
            let asked = Box::new(save_as_question(path.clone(), then));
            return self.ask(Question::Replace { path, asked });
        }
        match can_be_written.and_then(|()| self.write(Some(typed))) {
            Ok(()) => self.go_on(then),
            Err(error) => {
                let error = error.to_string();
                self.log.write("error", json!({ "message": error }));
                self.ask(save_as_question(path, then).failed(error));
            }
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
        #[cfg(not(target_arch = "wasm32"))]
        self.state.settings.opened(self.viewer.session().path());
        self.say(&format!("Saved {}", self.document.path_text()));
        self.log
            .write("saved", json!({ "path": self.document.path_text() }));
        Ok(())
    }

    /// Takes a file that was chosen, or dropped on the window.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn take_file(&mut self, path: &Path) {
        use crate::opening::{Openable, fit_map, import_hair, kind_of};
        use strandlight_formats::BakedFile;

        self.end_stroke();
        let from = path.to_owned();
        let name = name_of(path);
        match kind_of(path) {
            Ok(Openable::Scene) => self.before_losing(Then::Open(from)),
            Ok(kind @ (Openable::Groom | Openable::Lights | Openable::Lut)) => {
                self.swap(kind, path, path);
            }
            Ok(Openable::Hair) => self.begin(Job::start(format!("Reading {name}"), move |_| {
                let imported = import_hair(&from)?;
                Ok(Made::Groom {
                    bytes: imported.groom.to_bytes()?,
                    notes: imported.notes,
                    from,
                })
            })),
            Ok(Openable::Map) => {
                let title = format!("Fitting lights to {name}");
                self.begin(Job::start(title, move |work| {
                    let (bytes, figures) = fit_map(&from, work)?;
                    Ok(Made::Lights {
                        from,
                        bytes,
                        figures,
                    })
                }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
        self.window.request_redraw();
    }

    /// A page has no files to choose from.
    #[cfg(target_arch = "wasm32")]
    pub(super) fn take_file(&mut self, _: &Path) {}

    /// Waits for work; what was under way is stopped.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn begin(&mut self, job: Job) {
        self.log.write("job", json!({ "title": job.title }));
        if let Some(other) = self.job.replace(job) {
            other.stop();
        }
        self.is_outdated = true;
        self.window.request_redraw();
    }

    /// Takes up what work has made.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn poll_job(&mut self) {
        use crate::opening::{Openable, beside};

        let news = self.job.as_ref().map_or(News::None, Job::news);
        if matches!(news, News::None) {
            return;
        }
        self.job = None;
        let files = self.viewer.session().files().clone();
        match news {
            News::None => {}
            News::Failed(reason) => self.fail(&reason),
            News::Stopped => self.say("Cancelled"),
            News::Made(Made::Scene { from, session }) => self.show_session(from, *session),
            News::Made(Made::Groom { from, bytes, notes }) => {
                let path = std::path::absolute(&from).unwrap_or_else(|_| from.clone());
                let path = beside(&path, "groom", &files);
                files.hold(&path, bytes);
                if self.swap(Openable::Groom, &path, &from) {
                    self.say(&format!("{}: {}", name_of(&from), notes.join("; ")));
                }
            }
            News::Made(Made::Lights {
                from,
                bytes,
                figures,
            }) => {
                let path = std::path::absolute(&from).unwrap_or_else(|_| from.clone());
                let path = beside(&path, "lights", &files);
                files.hold(&path, bytes);
                if self.swap(Openable::Lights, &path, &from) {
                    self.say(&format!("{}: {figures}", name_of(&from)));
                }
            }
            News::Made(Made::Chosen {
                wanted,
                path,
                is_missing,
            }) => match (wanted, path) {
                (Wanted::Open, Some(path)) => self.take_file(&path),
                (Wanted::SaveAs(then), Some(path)) => {
                    self.save_as(path.display().to_string(), then, false);
                }
                (Wanted::Open, None) if is_missing => self.list_files(),
                (Wanted::SaveAs(then), None) if is_missing => self.list_places(then),
                _ => {}
            },
            News::Made(Made::Pictures(paths)) => {
                let (first, n) = (paths.first().map(|path| path.display()), paths.len());
                let first = first.map(|path| path.to_string()).unwrap_or_default();
                self.say(&match n {
                    1 => format!("Wrote {first}"),
                    _ => format!("Wrote {n} frames, the first one {first}"),
                });
                self.log
                    .write("picture", json!({ "path": first, "frames": n }));
            }
        }
        self.window.request_redraw();
    }

    /// Puts another groom, light set or LUT into the scene, that of the file `from`; answers whether it is
    /// another one.
    #[cfg(not(target_arch = "wasm32"))]
    fn swap(&mut self, kind: crate::opening::Openable, path: &Path, from: &Path) -> bool {
        use crate::opening::Openable;

        let file = self.viewer.session().path_in_scene(path);
        let name = name_of(from);
        let label = format!("{} {name}", kind.name());
        self.viewer.commit();
        let changed = self.viewer.edit(&label, |scene| match kind {
            Openable::Lights if scene.lights.file != file => {
                let lights = &mut scene.lights;
                lights.file = file;
                // These name lights of the old set by number.
                (lights.muted, lights.solo, lights.adjust) = Default::default();
            }
            Openable::Lights => {}
            Openable::Lut => scene.render.lut = Some(file),
            _ => scene.groom.file = file,
        });
        self.viewer.commit();
        match changed {
            Ok(change) if change.is_empty() => {
                self.say(&format!("The scene already uses {name}"));
                false
            }
            Ok(_) => {
                self.state.lights.forget();
                self.state.settings.opened(from);
                self.say(&label);
                self.document.saved(&self.viewer);
                self.changed("edit", json!({ "label": label }));
                true
            }
            Err(error) => {
                self.fail(&error.to_string());
                false
            }
        }
    }

    /// Opens another scene in place of this one, which stays if that fails; the sample where there is
    /// no path.
    #[cfg(not(target_arch = "wasm32"))]
    fn open(&mut self, path: Option<PathBuf>) {
        self.begin(Job::open(path));
    }

    #[cfg(target_arch = "wasm32")]
    fn open(&mut self, _: Option<PathBuf>) {}

    /// Shows a document that was opened, in place of this one.
    #[cfg(not(target_arch = "wasm32"))]
    fn show_session(&mut self, from: Option<PathBuf>, session: Session) {
        let chosen = self.screen.chosen(self.choice);
        let chosen = chosen.map_err(|error| SessionError::from(RenderError::Gpu(error.into())));
        let opened = chosen.and_then(|chosen| Viewer::choose(self.choice, chosen, session));
        match opened {
            Ok(mut viewer) => {
                viewer.set_ground_truth(self.viewer.ground_truth().is_some());
                viewer.set_inspection(self.viewer.inspection());
                self.viewer = viewer;
                self.document = Document::new(&self.viewer);
                let old = std::mem::take(&mut self.state);
                self.state = UiState {
                    paint: old.paint,
                    is_help_open: old.is_help_open,
                    settings: old.settings,
                    presets: old.presets,
                    panel: old.panel,
                    ..UiState::default()
                };
                self.views = Views::default();
                self.progress = Progress::default();
                self.is_stuck = false;
                let name = match &from {
                    Some(path) => path.display().to_string(),
                    None => "the sample".to_owned(),
                };
                if let Some(path) = &from {
                    self.state.settings.opened(path);
                }
                self.say(&format!("Opened {name}"));
                self.changed("opened", json!({ "path": name }));
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
        if self.state.error.as_deref() != Some(message) {
            self.log.write("error", json!({ "message": message }));
            self.is_outdated = true;
        }
        self.state.error = Some(message.to_owned());
    }
}

fn save_as_question(path: String, then: Then) -> Question {
    Question::SaveAs {
        picker: FilePicker::new(Purpose::Save, path, vec!["toml".to_owned()]),
        failure: None,
        then,
    }
}

/// Endings of the files that can be opened.
fn openable_extensions() -> Vec<String> {
    let ours = ["toml", "groom", "lights", "exr", "hdr", "cube"].into_iter();
    let formats = strandlight_formats::GROOM_FORMATS.iter();
    let others = formats.flat_map(|format| format.info().extensions);
    ours.chain(others.copied()).map(str::to_owned).collect()
}
