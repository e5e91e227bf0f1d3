//! The window's parts: bar, picture, panel, status and questions. Reads the viewer, answers what
//! was asked for; nothing is changed here but what the interface itself remembers.

use std::sync::Arc;

use egui::{Align, Button, Key, Layout, Panel, RichText, Ui};
use strandlight_formats::{Scene, counted};

use super::asked::Asked;
use super::field::Changes;
use super::in_view::{InView, in_view};
use super::job::Job;
use super::keys::{self, Command};
#[cfg(not(target_arch = "wasm32"))]
use super::legend;
use super::looks::{LookView, Looks};
use super::menus::{self, MenuInput};
use super::notices::{self, FilesAnswer};
use super::orbit::Bounds;
use super::panel::camera::CameraState;
use super::panel::lights::LightsState;
use super::panel::motion::MotionState;
use super::panel::paint::PaintState;
use super::panel::{self, section, statistics::FrameTimes};
use super::presets::Presets;
use super::questions::{self, Answer, Question};
use super::settings::{self, Settings};
use super::thumbnails::Thumbnails;
use super::view::{self, ViewportInput};
use super::{help, orbit, theme, truth};
use crate::viewer::Viewer;
use strandlight_scene::Camera;
use strandlight_scene::interactive::PictureProgress;

/// Below this width, points, the panel lies over the picture, and the bar has menus only.
const NARROW: f32 = 600.0;

/// Whether the panel is shown: beside the picture in a wide window, over it in a narrow one.
#[derive(Clone, Copy, Debug)]
pub struct PanelState {
    is_beside: bool,
    is_over: bool,
    is_narrow: bool,
}

impl Default for PanelState {
    fn default() -> Self {
        PanelState {
            is_beside: true,
            is_over: false,
            is_narrow: false,
        }
    }
}

impl PanelState {
    /// Is it shown?
    pub fn is_open(self) -> bool {
        match self.is_narrow {
            true => self.is_over,
            false => self.is_beside,
        }
    }

    /// Shows or hides it.
    pub fn toggle(&mut self) {
        match self.is_narrow {
            true => self.is_over = !self.is_over,
            false => self.is_beside = !self.is_beside,
        }
    }
}

/// What the interface remembers between frames.
#[derive(Debug, Default)]
pub struct UiState {
    /// Beside the picture or over it.
    pub panel: PanelState,
    /// The picture alone is shown, and keys do no more than look at it from elsewhere.
    pub is_bare: bool,
    /// Files that were open.
    pub settings: Settings,
    /// Hair of one's own.
    pub presets: Presets,
    /// Looks that were kept.
    pub looks: Looks,
    /// Small pictures of the steps.
    pub thumbnails: Thumbnails,
    /// The last colour behind the hair.
    pub backdrop: Option<[f32; 3]>,
    /// Of the section on lights.
    pub lights: LightsState,
    /// The brush.
    pub paint: PaintState,
    /// The clock of the motion.
    pub motion: MotionState,
    /// Of the section on the camera.
    pub camera: CameraState,
    /// The list of keys is shown.
    pub is_help_open: bool,
    /// What the window waits to be answered.
    pub question: Option<Question>,
    /// A field was being typed in when the last frame ended.
    pub is_typing: bool,
    /// Commands that are run once what is typed is taken.
    pub waiting: Vec<Command>,
    /// Files of the scene changed on disk while there are changes here.
    pub has_changed_on_disk: bool,
    /// The last thing that was done, for the status line.
    pub message: String,
    /// What failed, until it is dismissed or the next success.
    pub error: Option<String>,
}

/// What the interface shows.
pub struct UiInput<'a> {
    /// Scene and picture.
    pub viewer: &'a Viewer,
    /// The picture.
    pub texture: Option<egui::TextureId>,
    /// How far it has come.
    pub progress: PictureProgress,
    /// Around the hair.
    pub bounds: Bounds,
    /// Of the window.
    pub times: FrameTimes,
    /// The scene's file.
    pub name: &'a str,
    /// Work that the window waits for.
    pub job: Option<&'a Job>,
    /// Are there views before and after this one?
    pub can_look: [bool; 2],
}

/// Changes and commands that the user requested in a frame.
#[derive(Debug)]
pub struct UiOutput {
    /// The scene with this frame's edits.
    pub scene: Scene,
    /// What they are called.
    pub changes: Changes,
    /// Keys and buttons.
    pub commands: Vec<Command>,
    /// Look from here.
    pub view: Option<Camera>,
    /// What was answered to a question.
    pub answer: Option<Answer>,
    /// The picture under the mouse.
    pub viewport: ViewportInput,
}

/// Draws the window.
pub fn show(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState) -> UiOutput {
    let mut output = UiOutput {
        scene: input.viewer.session().scene().clone(),
        changes: Changes::default(),
        commands: Vec::new(),
        view: None,
        answer: None,
        viewport: ViewportInput::default(),
    };
    let is_asking = state.question.is_some() || input.job.is_some();
    state.panel.is_narrow = ui.available_width() < NARROW;
    match is_asking {
        true => state.waiting.clear(),
        false => output.commands = keys::due(ui.ctx(), &mut state.waiting),
    }
    if state.is_bare {
        output.commands.retain(|command| command.is_view());
    }
    // Fields and lists that Escape closes are gone once they have been shown.
    let is_escape_taken = is_asking || state.is_typing || egui::Popup::is_any_open(ui.ctx());
    let is_beside = !state.is_bare && !state.panel.is_narrow && state.panel.is_beside;
    if !state.is_bare {
        bars(ui, input, state, &mut output);
    }
    if is_beside {
        // As wide as the picture leaves room for.
        let most = (ui.available_width() - 160.0).max(theme::PANEL_WIDTH);
        Panel::right("panel")
            .default_size(theme::PANEL_WIDTH)
            .size_range(theme::PANEL_LEAST..=most)
            .resizable(true)
            .frame(frame(8))
            .show(ui, |ui| panel_of(ui, input, state, &mut output));
    }
    let picture = ui.available_rect_before_wrap();
    if !state.is_bare && state.panel.is_narrow && state.panel.is_over {
        sheet(ui, picture, frame(8), |ui| {
            panel_of(ui, input, state, &mut output);
        });
    }
    viewport(ui, input, state, (picture, is_beside), &mut output);
    if !state.is_bare {
        let have_changed = state.has_changed_on_disk;
        let (error, changes) = (&mut state.error, &mut output.changes);
        match notices::show(ui.ctx(), picture, error, have_changed, changes) {
            Some(FilesAnswer::Reload) => output.commands.push(Command::Reload),
            Some(FilesAnswer::KeepMine) => output.answer = Some(Answer::KeepMine),
            None => {}
        }
    }
    help::show(ui.ctx(), &mut state.is_help_open);
    ask(ui, input, state, &mut output);
    if !is_escape_taken && ui.input(|input| input.key_pressed(Key::Escape)) {
        output.commands.push(Command::Escape);
    }
    if !state.waiting.is_empty() {
        keys::end_typing(ui.ctx());
    }
    state.is_typing = ui.ctx().text_edit_focused();
    if output.commands.contains(&Command::Frame) {
        let [width, height] = output.viewport.size.map(|side| side.max(1) as f32);
        let Bounds { centre, radius } = input.bounds;
        let camera = input.viewer.prepared().camera;
        output.view = Some(orbit::frame(&camera, centre, radius, width / height));
    }
    output
}

/// Around bars and the panel.
fn frame(margin: i8) -> egui::Frame {
    egui::Frame::new()
        .fill(theme::PANEL)
        .inner_margin(egui::Margin::symmetric(margin, 4))
}

/// What is above and below the picture.
fn bars(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState, output: &mut UiOutput) {
    Panel::top("bar")
        .exact_size(32.0)
        .resizable(false)
        .frame(frame(8))
        .show(ui, |ui| bar(ui, input, state, output));
    Panel::bottom("status")
        .exact_size(24.0)
        .resizable(false)
        .frame(frame(8))
        .show(ui, |ui| status(ui, input, state, &mut output.changes));
}

/// The picture at the place that is left for it, with what lies over it; beside the panel or not.
fn viewport(
    ui: &mut Ui,
    input: &UiInput<'_>,
    state: &mut UiState,
    (picture, is_beside): (egui::Rect, bool),
    output: &mut UiOutput,
) {
    let UiOutput {
        scene,
        changes,
        view,
        ..
    } = output;
    // A click that picks a light or a colour paints nothing.
    let lights = &state.lights;
    let is_clicking = lights.is_picking || lights.is_placing || state.paint.is_picking;
    let is_brush = state.paint.is_on && !is_clicking;
    let camera = input.viewer.prepared().camera;
    let background = input.viewer.session().scene().render.background;
    let is_see_through = background == strandlight_formats::Background::None;
    let mode = (is_brush, is_see_through, is_beside);
    let (viewport, response) = view::show(ui, input.texture, &camera, input.bounds, mode);
    *view = viewport
        .camera
        .filter(|_| !state.camera.is_locked)
        .or(*view);
    changes.place("View", &response);
    if let Some(turn_deg) = viewport.turn_lights_deg {
        scene.lights.rotate_deg = panel::lights::turned(scene.lights.rotate_deg, turn_deg);
        changes.label = Some("Rotate".to_owned());
    }
    changes.is_complete |= response.drag_stopped();
    if state.camera.has_frame {
        let size = input.viewer.session().scene().render.size;
        panel::camera::frame(ui, response.rect, size);
    }
    state
        .paint
        .mask_layer
        .show(ui, input.viewer.mask_display(), response.rect);
    wipe(ui, state, input.viewer, response.rect, changes);
    #[cfg(not(target_arch = "wasm32"))]
    legend::show(ui, input.viewer, viewport.hover, response.rect);
    state.paint.show_photo(ui.ctx(), picture, changes);
    if is_clicking {
        response.on_hover_cursor(egui::CursorIcon::Crosshair);
    } else if let (true, Some(radius), Some(at)) =
        (state.paint.is_on, state.paint.radius_px, viewport.hover)
    {
        let scale = viewport.pixels_per_point;
        let centre = response.rect.min + egui::vec2(at[0], at[1]) / scale;
        let stroke = |width, gray: u8| egui::Stroke::new(width, egui::Color32::from_gray(gray));
        // Dark under light: seen on any hair.
        let painter = ui.painter().with_clip_rect(response.rect);
        painter.circle_stroke(centre, radius / scale, stroke(2.5, 20));
        painter.circle_stroke(centre, radius / scale, stroke(1.0, 230));
    }
    output.viewport = viewport;
}

/// The question that is asked, and the work that is waited for.
fn ask(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState, output: &mut UiOutput) {
    if state.question.is_some() {
        let places = places(input);
        let asked = Asked {
            scene: input.name,
            places: &places,
            window: input.viewer.size(),
            scene_size: input.viewer.session().scene().render.size,
        };
        let answer = questions::show(ui, &mut state.question, &asked, &mut output.changes);
        output.answer = answer.or(output.answer.take());
    }
    if let Some(job) = input.job {
        job.show(ui, &mut output.changes);
    }
}

/// The look that was kept, left of a line that is dragged.
fn wipe(
    ui: &mut Ui,
    state: &mut UiState,
    viewer: &Viewer,
    rect: egui::Rect,
    changes: &mut Changes,
) {
    let looks = &mut state.looks;
    if !looks.is_wiping {
        return;
    }
    let painter = ui.painter().with_clip_rect(rect);
    let says = match looks.left(&LookView::of(viewer)) {
        Some(shown) => {
            shown.paint(&painter, rect, looks.at);
            String::new()
        }
        None => " ...".to_owned(),
    };
    let x = rect.left() + looks.at * rect.width();
    let top = egui::pos2(x, rect.top());
    let bottom = egui::pos2(x, rect.bottom());
    // Wide enough to be taken hold of; the rest of the picture is the camera's.
    let handle = egui::Rect::from_min_max(top, bottom).expand2(egui::vec2(7.0, 0.0));
    let handle = handle.intersect(rect);
    let id = egui::Id::unique("wipe");
    let response = ui.interact(handle, id, egui::Sense::click_and_drag());
    if let (true, Some(at)) = (response.dragged(), response.interact_pointer_pos()) {
        looks.at = ((at.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0);
    }
    changes.place("Wipe line", &response);
    response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    let line = |width, gray: u8| egui::Stroke::new(width, egui::Color32::from_gray(gray));
    painter.line_segment([top, bottom], line(3.0, 20));
    painter.line_segment([top, bottom], line(1.0, 230));
    let font = egui::TextStyle::Body.resolve(ui.style());
    let label = |text: String, align: egui::Align2, at: egui::Pos2| {
        theme::outlined(&painter, at, align, &text, &font);
    };
    if let Some(kept) = looks.chosen() {
        let text = format!("{}{says}", kept.name);
        label(text, egui::Align2::RIGHT_TOP, top + egui::vec2(-8.0, 6.0));
        label(
            "now".to_owned(),
            egui::Align2::LEFT_TOP,
            top + egui::vec2(8.0, 6.0),
        );
    }
}

/// Margins and edges of the panel where it lies over the picture.
const SHEET_EDGE: egui::Vec2 = egui::vec2(18.0, 10.0);

/// The panel over the lower part of a narrow window, or the right part of a low one.
fn sheet(ui: &Ui, room: egui::Rect, frame: egui::Frame, content: impl FnOnce(&mut Ui)) {
    let mut rect = room;
    if room.height() >= room.width() {
        rect.set_top(room.top() + 0.45 * room.height());
    } else {
        // Short of that, numbers and buttons would be cut off.
        let width = (0.6 * room.width()).max(theme::PANEL_LEAST + SHEET_EDGE.x);
        rect.set_left((room.right() - width).max(room.left()));
    }
    egui::Area::new(egui::Id::unique("sheet"))
        .order(egui::Order::Middle)
        .fixed_pos(rect.min)
        .constrain(false)
        .show(ui.ctx(), |ui| {
            let frame = frame.stroke(egui::Stroke::new(1.0, egui::Color32::from_gray(70)));
            frame.show(ui, |ui| {
                let inside = rect.size() - SHEET_EDGE;
                ui.set_min_size(inside.max(egui::Vec2::ZERO));
                ui.set_max_size(inside.max(egui::Vec2::splat(1.0)));
                content(ui);
            });
        });
}

fn panel_of(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState, output: &mut UiOutput) {
    // Beside the picture it is as wide as its widest row.
    egui::ScrollArea::new([state.panel.is_narrow, true])
        .auto_shrink([false, false])
        .show(ui, |ui| {
            // Room for the scroll bar, which would lie over the reset buttons.
            ui.set_max_width(ui.available_width() - 8.0);
            sections(ui, input, state, output);
        });
}

/// Folders that files are chosen from.
fn places(input: &UiInput<'_>) -> Vec<(&'static str, std::path::PathBuf)> {
    let mut places = Vec::new();
    let path = input.viewer.session().path();
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    if let Some(folder) = whole.parent() {
        places.push(("Scene", folder.to_owned()));
    }
    if let Some(home) = settings::home_folder() {
        places.push(("Home", home));
    }
    if let Ok(current) = std::env::current_dir() {
        places.push(("Current", current));
    }
    places
}

fn sections(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState, output: &mut UiOutput) {
    let UiOutput {
        scene,
        changes,
        commands,
        view,
        ..
    } = output;
    section(ui, "Hair", true, changes, |ui, changes| {
        let own = input.viewer.session().assets().diameters;
        let own_presets = &mut state.presets;
        panel::hair::show(ui, scene, own, own_presets, changes, commands);
    });
    section(ui, "Variation", false, changes, |ui, changes| {
        panel::variation::show(ui, scene, changes);
    });
    section(ui, "Looks", false, changes, |ui, changes| {
        panel::looks::show(ui, &mut state.looks, changes, commands);
        let session = input.viewer.session();
        panel::history::show(ui, session, &state.thumbnails, changes, commands);
    });
    section(ui, "Paint", false, changes, |ui, changes| {
        let is_masked = input.viewer.session().is_masked();
        panel::paint::show(ui, &mut state.paint, is_masked, changes, commands);
    });
    section(ui, "Lights", false, changes, |ui, changes| {
        let prepared = input.viewer.prepared();
        let lights = input.viewer.session().assets();
        let lights = lights.turned_lights(&scene.lights);
        let key = panel::lights::key_direction(&prepared.camera);
        let of_scene = [&lights[..], &prepared.lights];
        panel::lights::show(ui, scene, of_scene, key, &mut state.lights, changes);
    });
    section(ui, "Render", false, changes, |ui, changes| {
        let session = input.viewer.session();
        let panorama = scene.panorama_path();
        let has_map = panorama.is_some_and(|path| session.files().exists(&path));
        panel::picture::show(ui, scene, (&mut state.backdrop, has_map), changes);
    });
    section(ui, "Motion", false, changes, |ui, changes| {
        panel::motion::show(ui, scene, &mut state.motion, changes);
    });
    section(ui, "Proxies", false, changes, |ui, changes| {
        let groom = input.viewer.session().groom();
        panel::motion::proxies(ui, scene, groom, input.bounds, changes);
    });
    section(ui, "Camera", false, changes, |ui, changes| {
        let camera = &input.viewer.prepared().camera;
        let is_moved = input.viewer.is_view_moved();
        let can_look = input.can_look;
        let (of_view, looks) = ((camera, input.bounds), (is_moved, can_look));
        *view = panel::camera::show(ui, of_view, looks, &mut state.camera, changes, commands);
    });
    section(ui, "Statistics", false, changes, |ui, _| {
        panel::statistics::show(ui, input.viewer, &input.progress, input.times);
    });
}

fn bar(ui: &mut Ui, input: &UiInput<'_>, state: &mut UiState, output: &mut UiOutput) {
    let session = input.viewer.session();
    let is_narrow = state.panel.is_narrow;
    let is_open = state.panel.is_open();
    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
        let of_menus = MenuInput {
            viewer: input.viewer,
            settings: &state.settings,
            can_look: input.can_look,
            selected_light: state.lights.selected,
        };
        let (changes, commands) = (&mut output.changes, &mut output.commands);
        menus::show(ui, &of_menus, changes, commands, &mut output.answer);
        let mut button = |ui: &mut Ui, text: &str, is_enabled, help: &str, command| {
            let selected = command == Command::Panel && is_open;
            let button = ui.add_enabled(is_enabled, Button::new(text).selected(selected));
            output.changes.place(format!("{text} button"), &button);
            if button.on_hover_text(help).clicked() {
                output.commands.push(command);
            }
        };
        let named = |verb: &str, label: Option<&str>| match label {
            Some(label) => format!("{verb} {}", label.to_lowercase()),
            None => verb.to_owned(),
        };
        let undo = session.undo_label();
        let redo = session.redo_label();
        let is_modified = session.is_modified() || session.is_unsaved();
        if !is_narrow {
            button(ui, "Save", is_modified, "Ctrl+S", Command::Save);
        }
        let undo_help = named("Undo", undo);
        button(ui, "Undo", undo.is_some(), &undo_help, Command::Undo);
        let redo_help = named("Redo", redo);
        button(ui, "Redo", redo.is_some(), &redo_help, Command::Redo);
        if let (Some(undo), false) = (undo, is_narrow) {
            let last = RichText::new(format!("last: {undo}"));
            ui.label(last.small().color(theme::WEAK));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let help = "Show or hide the panel: Tab";
            button(ui, "Panel", true, help, Command::Panel);
            if !is_narrow {
                button(ui, "Help", true, "Keys and mouse: H", Command::Help);
                let help = "Save the window's picture as a PNG next to the scene: P";
                button(ui, "Picture", true, help, Command::Screenshot);
                button(ui, "Home", true, "The scene's camera: Home", Command::Home);
                button(ui, "Frame", true, "Frame all hair: F", Command::Frame);
            }
            let star = if session.is_modified() { " *" } else { "" };
            let name = RichText::new(format!("{}{star}", input.name)).strong();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let label = ui.add(egui::Label::new(name).truncate());
                label.on_hover_text(session.path().display().to_string());
            });
        });
    });
}

/// The look that is compared, while it is drawn for this view.
fn drawn_look<'a>(input: &UiInput<'_>, state: &'a UiState) -> Option<&'a str> {
    // A page draws no other picture.
    let can_draw = cfg!(not(target_arch = "wasm32"));
    let is_moving = state.motion.moves(input.viewer.session().scene());
    let is_next = can_draw && input.progress.is_done && !is_moving;
    let looks = &state.looks;
    let is_drawn = is_next && looks.wants(&LookView::of(input.viewer));
    looks
        .chosen()
        .filter(|_| is_drawn)
        .map(|kept| kept.name.as_str())
}

fn status(ui: &mut Ui, input: &UiInput<'_>, state: &UiState, changes: &mut Changes) {
    let progress = input.progress;
    let [width, height] = input.viewer.size().map(|side| side.max(1) as f32);
    let aspect = width / height;
    let is_narrow = state.panel.is_narrow;
    let drawn_look = drawn_look(input, state);
    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
        let (what, share) =
            if let Some(name) = input.viewer.awaited_layer().filter(|_| progress.is_done) {
                // The picture is finished, which is not what was asked for.
                (format!("drawing {name}"), 0.0)
            } else if let Some(name) = drawn_look {
                (format!("drawing look {name}"), 0.0)
            } else if progress.is_done && progress.total_samples == 0 {
                ("done".to_owned(), 1.0)
            } else if progress.is_done {
                (counted(progress.samples, "sample", "samples"), 1.0)
            } else if progress.is_shaded && progress.total_samples > 0 {
                let PictureProgress {
                    samples,
                    total_samples,
                    ..
                } = progress;
                let share = samples as f32 / total_samples.max(1) as f32;
                let total = counted(total_samples, "sample", "samples");
                (format!("{samples} of {total}"), share)
            } else {
                // What is shown was lit before the last edit.
                ("shading".to_owned(), 0.0)
            };
        ui.add(
            egui::ProgressBar::new(share)
                .desired_width(90.0)
                .desired_height(6.0)
                .fill(theme::ACCENT),
        );
        let label = ui.label(RichText::new(what).small());
        if drawn_look.is_some() {
            changes.place("Drawn look", &label);
        }
        let shown = input.viewer.prepared();
        let seen = (shown.camera, aspect, Arc::as_ptr(&shown.strands) as usize);
        // Where nothing is in view, all segments are asked: once for each view.
        let id = ui.scope_id().with("in view");
        let known = ui.data(|data| data.get_temp::<((Camera, f32, usize), InView)>(id));
        let what = match known.filter(|(of, _)| *of == seen) {
            Some((_, what)) => what,
            None => in_view(&shown.camera, &shown.strands, aspect),
        };
        ui.data_mut(|data| data.insert_temp(id, (seen, what)));
        let what = match what {
            InView::Nothing => Some("no hair in view"),
            InView::Speck => Some("the hair is a speck in this view"),
            InView::Hair => None,
        };
        if let Some(what) = what {
            let key = keys::shortcut(ui.ctx(), Command::Frame);
            let text = format!("{what}; {key} frames it");
            let label = ui.label(RichText::new(text).small().color(theme::WARNING));
            changes.place("Out of view", &label);
            label.on_hover_text("View > Frame all hair");
        }
        if let Some((text, help)) = truth::status(input.viewer) {
            let label = ui.label(RichText::new(text).small());
            changes.place("Ground truth", &label);
            label.on_hover_text(help);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if !is_narrow {
                let session = input.viewer.session();
                let n_strands = session.groom().n_strands();
                let lights = &session.scene().lights;
                let n_lights = input.viewer.prepared().lights.len();
                let n_on = (0..n_lights as u32).filter(|&ix| lights.is_on(ix)).count();
                let all = counted(n_lights, "light", "lights");
                let lights = match n_on == n_lights {
                    true => all,
                    false => format!("{n_on} of {all}"),
                };
                let text = RichText::new(format!(
                    "{}, {lights}",
                    counted(n_strands, "strand", "strands")
                ));
                ui.label(text.small().color(theme::WEAK));
                let (name, help) = renderer(input.viewer);
                ui.label(RichText::new(name).small().color(theme::WEAK))
                    .on_hover_text(help);
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let message = RichText::new(&state.message).small().color(theme::WEAK);
                let label = ui.add(egui::Label::new(message).truncate());
                changes.place("Message", &label);
            });
        });
    });
}

/// Which renderer draws, and why.
fn renderer(viewer: &Viewer) -> (String, String) {
    match viewer.cpu_reason() {
        Some(reason) => (
            format!("CPU renderer ({})", reason.short()),
            format!("The CPU draws: {reason}"),
        ),
        None => ("GPU renderer".to_owned(), viewer.renderer().name()),
    }
}
