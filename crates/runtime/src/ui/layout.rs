//! The window's parts: bar, picture, panel, status and questions. Reads the viewer, answers what
//! was asked for; nothing is changed here but what the interface itself remembers.

use egui::{Align, Button, Key, Layout, Panel, RichText, Ui};
use strandlight_formats::Scene;

use super::field::Changes;
use super::keys::{self, Command};
use super::panel::lights::LightsState;
use super::panel::motion::MotionState;
use super::panel::paint::PaintState;
use super::panel::{self, section, statistics::FrameTimes};
use super::questions::{self, Answer, Question};
use super::view::{self, Bounds, ViewportInput};
use super::{help, orbit, theme};
use crate::viewer::Viewer;
use strandlight_scene::Camera;
use strandlight_scene::interactive::Progress;

/// What the interface remembers between frames.
#[derive(Debug, Default)]
pub struct UiState {
    /// Of the section on lights.
    pub lights: LightsState,
    /// The brush.
    pub paint: PaintState,
    /// The clock of the motion.
    pub motion: MotionState,
    /// The list of keys is shown.
    pub is_help_open: bool,
    /// What the window waits to be answered.
    pub question: Option<Question>,
    /// A field was being typed in when the last frame ended.
    pub is_typing: bool,
    /// Files of the scene changed on disk while there are changes here.
    pub is_stale: bool,
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
    pub progress: Progress,
    /// Around the hair.
    pub bounds: Bounds,
    /// Of the window.
    pub times: FrameTimes,
    /// The scene's file.
    pub name: &'a str,
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
    let is_asking = state.question.is_some();
    if !is_asking {
        output.commands = keys::pressed(ui.ctx());
    }
    // Fields and lists that Escape closes are gone once they have been shown.
    let is_escape_taken = is_asking || state.is_typing || egui::Popup::is_any_open(ui.ctx());
    let frame = |margin| {
        egui::Frame::new()
            .fill(theme::PANEL)
            .inner_margin(egui::Margin::symmetric(margin, 4))
    };
    Panel::top("bar")
        .exact_size(32.0)
        .resizable(false)
        .frame(frame(8))
        .show(ui, |ui| bar(ui, input, &mut output));
    Panel::bottom("status")
        .exact_size(24.0)
        .resizable(false)
        .frame(frame(8))
        .show(ui, |ui| status(ui, input, state));
    if state.error.is_some() || state.is_stale {
        Panel::top("notices")
            .resizable(false)
            .frame(frame(8).fill(egui::Color32::from_gray(44)))
            .show(ui, |ui| notices(ui, state, &mut output));
    }
    Panel::right("panel")
        .exact_size(theme::PANEL_WIDTH)
        .resizable(false)
        .frame(frame(8))
        .show(ui, |ui| {
            egui::ScrollArea::vertical()
                .auto_shrink([false, false])
                .show(ui, |ui| {
                    // Room for the scroll bar, which would lie over the reset buttons.
                    ui.set_max_width(ui.available_width() - 8.0);
                    sections(ui, input, state, &mut output);
                });
        });
    let UiOutput { changes, view, .. } = &mut output;
    // A click that picks a light paints nothing.
    let is_brush = state.paint.is_on && !state.lights.is_picking;
    let camera = input.viewer.prepared().camera;
    let (viewport, response) = view::show(ui, input.texture, &camera, input.bounds, is_brush);
    *view = viewport.camera.or(*view);
    changes.place("View", &response);
    if state.lights.is_picking {
        response.on_hover_cursor(egui::CursorIcon::Crosshair);
    } else if let (true, Some(radius), Some(at)) =
        (state.paint.is_on, state.paint.radius_px, viewport.hover)
    {
        let scale = ui.ctx().pixels_per_point();
        let centre = response.rect.min + egui::vec2(at[0], at[1]) / scale;
        let stroke = |width, gray: u8| egui::Stroke::new(width, egui::Color32::from_gray(gray));
        // Dark under light: seen on any hair.
        let painter = ui.painter().with_clip_rect(response.rect);
        painter.circle_stroke(centre, radius / scale, stroke(2.5, 20));
        painter.circle_stroke(centre, radius / scale, stroke(1.0, 230));
    }
    output.viewport = viewport;
    help::show(ui.ctx(), &mut state.is_help_open);
    let answer = questions::show(ui, &mut state.question, input.name, &mut output.changes);
    output.answer = answer.or(output.answer.take());
    if !is_escape_taken && ui.input(|input| input.key_pressed(Key::Escape)) {
        output.commands.push(Command::Escape);
    }
    state.is_typing = ui.ctx().text_edit_focused();
    if output.commands.contains(&Command::Frame) {
        let [width, height] = output.viewport.size.map(|side| side.max(1) as f32);
        let Bounds { centre, radius } = input.bounds;
        output.view = Some(orbit::frame(&camera, centre, radius, width / height));
    }
    output
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
        panel::hair::show(ui, scene, own, changes);
    });
    section(ui, "Paint", false, changes, |ui, changes| {
        panel::paint::show(ui, &mut state.paint, changes);
    });
    section(ui, "Lights", false, changes, |ui, changes| {
        let lights = &input.viewer.session().light_set().lights;
        panel::lights::show(ui, scene, lights, &mut state.lights, changes);
    });
    section(ui, "Render", false, changes, |ui, changes| {
        panel::picture::show(ui, scene, changes);
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
        *view = panel::camera::show(ui, camera, is_moved, input.bounds, changes, commands);
    });
    section(ui, "Statistics", false, changes, |ui, _| {
        panel::statistics::show(ui, input.viewer, &input.progress, input.times);
    });
}

fn bar(ui: &mut Ui, input: &UiInput<'_>, output: &mut UiOutput) {
    let session = input.viewer.session();
    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
        let star = if session.is_modified() { " *" } else { "" };
        ui.label(RichText::new(format!("{}{star}", input.name)).strong());
        ui.add_space(8.0);
        let mut button = |ui: &mut Ui, text: &str, is_enabled, help: &str, command| {
            let button = ui.add_enabled(is_enabled, Button::new(text));
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
        let is_modified = session.is_modified();
        button(ui, "Save", is_modified, "Ctrl+S", Command::Save);
        button(
            ui,
            "Undo",
            undo.is_some(),
            &named("Undo", undo),
            Command::Undo,
        );
        button(
            ui,
            "Redo",
            redo.is_some(),
            &named("Redo", redo),
            Command::Redo,
        );
        if let Some(undo) = undo {
            let last = RichText::new(format!("last: {undo}"));
            ui.label(last.small().color(theme::WEAK));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            button(ui, "Help", true, "Keys and mouse: H", Command::Help);
            let help = "Save the picture as a PNG next to the scene: P";
            button(ui, "Picture", true, help, Command::Screenshot);
            button(ui, "Home", true, "The scene's camera: Home", Command::Home);
            button(ui, "Frame", true, "Frame all hair: F", Command::Frame);
        });
    });
}

fn status(ui: &mut Ui, input: &UiInput<'_>, state: &UiState) {
    let progress = input.progress;
    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
        let (what, share) = if progress.is_done && progress.total_samples == 0 {
            ("done".to_owned(), 1.0)
        } else if progress.is_done {
            (format!("{} samples", progress.samples), 1.0)
        } else if progress.is_shaded && progress.total_samples > 0 {
            let Progress {
                samples,
                total_samples,
                ..
            } = progress;
            let share = samples as f32 / total_samples.max(1) as f32;
            (format!("{samples} of {total_samples} samples"), share)
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
        ui.label(RichText::new(what).small());
        ui.label(RichText::new(&state.message).small().color(theme::WEAK));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let stats = &input.viewer.report().stats;
            let text = format!("{} strands, {} lights", stats.strands, stats.lights);
            ui.label(RichText::new(text).small().color(theme::WEAK));
            let (name, help) = renderer(input.viewer);
            ui.label(RichText::new(name).small().color(theme::WEAK))
                .on_hover_text(help);
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

fn notices(ui: &mut Ui, state: &mut UiState, output: &mut UiOutput) {
    if let Some(error) = state.error.clone() {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(error).color(theme::ERROR));
            if ui.button("Dismiss").clicked() {
                state.error = None;
            }
        });
    }
    if state.is_stale {
        ui.horizontal_wrapped(|ui| {
            let text = "The scene's files changed on disk. You have unsaved changes.";
            ui.label(RichText::new(text).color(theme::WARNING));
            let reload = ui.button("Discard my changes and reload");
            output.changes.place("Reload button", &reload);
            if reload.clicked() {
                output.commands.push(Command::Reload);
            }
            let keep = ui.button("Keep my changes");
            output.changes.place("Keep my changes button", &keep);
            if keep.clicked() {
                output.answer = Some(Answer::KeepMine);
            }
        });
    }
}
