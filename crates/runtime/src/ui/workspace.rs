//! The open window: events in, frames out, and everything that was asked for done.

#[cfg(not(target_arch = "wasm32"))]
use std::collections::VecDeque;
#[cfg(not(target_arch = "wasm32"))]
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};
use web_time::Instant;
use winit::event::WindowEvent;
use winit::event_loop::OwnedDisplayHandle;
use winit::keyboard::ModifiersState;
use winit::window::Window;

use super::clipboard::{self, Clipboard};
use super::document::Document;
use super::input::split;
use super::job::Job;
use super::keys::{self, Command};
use super::layout::{self, UiInput, UiState};
use super::log::EventLog;
use super::orbit::Bounds;
use super::panel::statistics::FrameTimes;
use super::presets::Presets;
use super::screen::{Painted, Screen};
use super::settings::Settings;
use super::theme;
use super::title::title;
use super::views::Views;
use crate::choice::BackendChoice;
#[cfg(not(target_arch = "wasm32"))]
use crate::ground_truth::TruthProgress;
use crate::viewer::Viewer;
use strandlight_render::gpu::GpuError;
use strandlight_scene::RenderError;
use strandlight_scene::interactive::PictureProgress;

/// Work of a device, or a page, on the picture in a frame while the user drags something, and otherwise.
const BUDGETS: [Duration; 2] = [Duration::from_millis(14), Duration::from_millis(40)];

/// The same until there is a picture of the view: there is nothing else to see, and frames in between would delay it.
const BUDGET_OF_VIEWS: Duration = Duration::from_millis(100);

/// How long the window waits between frames for what a thread works on, before it looks for input again.
const BUDGET_BETWEEN: Duration = Duration::from_millis(4);

/// Longest time without a frame while there is work, so that what tells how far it is goes on.
const LONGEST_FRAME: Duration = Duration::from_millis(60);

/// Frames in a row that are made for what has no size yet.
const MOST_ROUGH: u32 = 4;

/// A look that is drawn in the background.
#[cfg(not(target_arch = "wasm32"))]
pub(super) struct LookJob {
    pub name: String,
    pub view: super::looks::LookView,
    pub answer: std::sync::mpsc::Receiver<Result<Vec<[u8; 4]>, String>>,
}

/// A window with a scene in it.
pub struct Workspace {
    pub(super) window: Arc<Window>,
    #[cfg_attr(
        target_arch = "wasm32",
        expect(dead_code, reason = "a page has no display to name")
    )]
    pub(super) display: Option<OwnedDisplayHandle>,
    pub(super) egui: egui::Context,
    pub(super) input: egui_winit::State,
    pub(super) screen: Screen,
    pub(super) viewer: Viewer,
    /// Which renderer draws scenes.
    pub(super) choice: BackendChoice,
    pub(super) document: Document,
    pub(super) state: UiState,
    pub(super) clipboard: Clipboard,
    modifiers: ModifiersState,
    /// A pen over the page.
    #[cfg(target_arch = "wasm32")]
    pen: super::pen::Pen,
    pub(super) log: EventLog,
    /// Where the user looked from.
    pub(super) views: Views,
    /// Work that the window waits for.
    pub(super) job: Option<Job>,
    /// Files that were dropped on it meanwhile.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) dropped: VecDeque<PathBuf>,
    /// A look that is drawn meanwhile.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) look_job: Option<LookJob>,
    pub(super) progress: PictureProgress,
    /// What was last told of ground truth.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) truth: Option<TruthProgress>,
    /// What was last said of why there is none.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) truth_error: Option<String>,
    /// The log was told that what is inspected is shown.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) is_inspection_noted: bool,
    pub(super) times: FrameTimes,
    pub(super) last_frame: Instant,
    pub(super) last_look: Instant,
    pub(super) last_tick: Instant,
    pub(super) is_stroking: bool,
    pub(super) places: Value,
    pub(super) title: String,
    /// No picture at all was on screen yet, no lit one.
    pub(super) is_empty: bool,
    pub(super) is_first: bool,
    /// The finished picture of what is shown now was not logged yet.
    pub(super) is_unlogged: bool,
    /// It is saved then.
    pub(super) is_to_be_saved: bool,
    /// Of a change of which nothing is on screen yet: the picture that was.
    pub(super) awaited: Option<u64>,
    /// What the page was last told of the picture.
    #[cfg(target_arch = "wasm32")]
    pub(super) told: PictureProgress,
    /// The picture cannot be made as it is asked for now.
    pub(super) is_stuck: bool,
    pub(super) loses_device: bool,
    /// egui's next frame, where it asked for one.
    pub(super) wake: Option<Instant>,
    pub(super) is_open: bool,
    /// Something else is to be shown than the frame that is being made has.
    pub(super) is_outdated: bool,
    /// Frames in a row in which something had no size yet.
    n_rough: u32,
    /// Work on the picture goes on, and something is waited for that the next frame shows.
    is_between_frames: bool,
    /// It has changed something that no frame has shown.
    is_to_be_painted: bool,
    /// The picture that was shown when the hair was last moved.
    pub(super) moved_at: u64,
}

impl Workspace {
    /// Shows `viewer`, which draws with the device of `screen` or without; `choice` says how to draw
    /// the next.
    pub fn new(
        window: Arc<Window>,
        display: Option<OwnedDisplayHandle>,
        screen: Screen,
        viewer: Viewer,
        choice: BackendChoice,
        log: EventLog,
    ) -> Self {
        let egui = egui::Context::default();
        theme::apply(&egui);
        let input = egui_winit::State::new(
            egui.clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(screen.max_texture_side() as usize),
        );
        window.request_redraw();
        let mut settings = Settings::read();
        if !viewer.session().is_unsaved() && cfg!(not(target_arch = "wasm32")) {
            settings.opened(viewer.session().path());
        }
        Workspace {
            window,
            display,
            egui,
            input,
            screen,
            document: Document::new(viewer.session()),
            viewer,
            choice,
            state: UiState {
                settings,
                presets: Presets::read(),
                ..UiState::default()
            },
            views: Views::default(),
            job: None,
            #[cfg(not(target_arch = "wasm32"))]
            dropped: VecDeque::new(),
            #[cfg(not(target_arch = "wasm32"))]
            look_job: None,
            clipboard: Clipboard::default(),
            modifiers: ModifiersState::default(),
            #[cfg(target_arch = "wasm32")]
            pen: super::pen::Pen::default(),
            log,
            progress: PictureProgress::default(),
            #[cfg(not(target_arch = "wasm32"))]
            truth: None,
            #[cfg(not(target_arch = "wasm32"))]
            truth_error: None,
            #[cfg(not(target_arch = "wasm32"))]
            is_inspection_noted: false,
            times: FrameTimes::default(),
            last_frame: Instant::now(),
            last_look: Instant::now(),
            last_tick: Instant::now(),
            is_stroking: false,
            places: Value::Null,
            title: String::new(),
            is_empty: true,
            is_first: true,
            is_unlogged: true,
            is_to_be_saved: false,
            awaited: None,
            #[cfg(target_arch = "wasm32")]
            told: PictureProgress::default(),
            is_stuck: false,
            loses_device: false,
            wake: None,
            is_open: true,
            is_outdated: false,
            n_rough: 0,
            is_between_frames: false,
            is_to_be_painted: false,
            moved_at: u64::MAX,
        }
    }

    /// Sets the clock of the motion.
    pub fn set_time(&mut self, seconds: f64) {
        self.state.motion.seconds = seconds;
    }

    /// Loses the device after the first finished picture, so that tests see it come back.
    pub fn lose_device(&mut self) {
        self.loses_device = true;
    }

    /// Is it still wanted?
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Takes up an event of the window.
    ///
    /// # Errors
    /// A device that cannot be had again.
    pub fn on_event(&mut self, event: &WindowEvent) -> Result<(), GpuError> {
        // egui-winit takes a frame for a reason to make another one, and so on for ever.
        if *event == WindowEvent::RedrawRequested {
            return self.redraw();
        }
        #[cfg(target_arch = "wasm32")]
        let touch = match event {
            WindowEvent::CursorMoved { .. } | WindowEvent::MouseInput { .. } => {
                self.pen.touch(event, crate::page::pen_pressure())
            }
            _ => self.pen.touch(event, None),
        };
        #[cfg(target_arch = "wasm32")]
        let event = touch.as_ref().unwrap_or(event);
        if clipboard::pastes(event, self.modifiers)
            && let Some(text) = self.clipboard.text()
        {
            self.input.set_clipboard_text(text);
        }
        if let WindowEvent::ModifiersChanged(modifiers) = event {
            self.modifiers = modifiers.state();
        }
        let response = self.input.on_window_event(&self.window, event);
        if response.repaint {
            // The frame first.
            self.is_between_frames = false;
            self.window.request_redraw();
        }
        match event {
            WindowEvent::Resized(size) => {
                self.screen.resize(*size);
                self.changed("resized", json!({ "size": [size.width, size.height] }));
                self.window.request_redraw();
            }
            WindowEvent::CloseRequested => self.close(),
            #[cfg(not(target_arch = "wasm32"))]
            WindowEvent::DroppedFile(path) => self.drop_file(path),
            WindowEvent::Occluded(false) => self.window.request_redraw(),
            _ => {}
        }
        Ok(())
    }

    /// Looks at the clock: files that changed, frames that egui wanted by now. Answers when to
    /// look again.
    pub fn on_time(&mut self) -> Option<Instant> {
        let now = Instant::now();
        if self.document.poll(now, self.viewer.session()) {
            self.on_files();
        }
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.poll_job();
            self.take_dropped();
            self.draw_look();
        }
        if self.wake.is_some_and(|wake| wake <= now) {
            self.wake = None;
            self.is_between_frames = false;
            self.window.request_redraw();
        }
        if self.is_between_frames {
            self.wait_between_frames();
        }
        if now.duration_since(self.last_look) > Duration::from_secs(1) {
            self.last_look = now;
            self.times.peak_bytes = strandlight_scene::memory::peak_bytes();
        }
        let next = [
            self.wake,
            self.document.next_poll(),
            // A worker wakes its page.
            (self.is_between_frames && cfg!(not(target_arch = "wasm32"))).then_some(now),
        ];
        next.into_iter().flatten().min()
    }

    /// Writes the last line of the log.
    pub fn closed(&mut self) {
        let peak = strandlight_scene::memory::peak_bytes();
        self.log.write("closed", json!({ "peak_bytes": peak }));
    }

    fn redraw(&mut self) -> Result<(), GpuError> {
        // A canvas has no size before the page is laid out or while it is hidden, and egui would take
        // that for a huge one. A frame follows when it has.
        #[cfg(target_arch = "wasm32")]
        if <[u32; 2]>::from(self.window.inner_size()).contains(&0) {
            return Ok(());
        }
        match self.screen.check() {
            Err(GpuError::Lost { reason }) => self.recover(&reason)?,
            Err(error) => self.fail(&error.to_string()),
            Ok(()) => {}
        }
        let progress = self.progress;
        let mut is_busy = false;
        let mut output: Option<egui::FullOutput> = None;
        let raw = self.input.take_egui_input(&self.window);
        #[cfg(target_arch = "wasm32")]
        let raw = super::input::on_one_screen(raw);
        for raw in split(raw) {
            let (next, is_moving) = self.lay_out(raw);
            is_busy |= is_moving;
            match &mut output {
                Some(output) => output.append(next),
                None => output = Some(next),
            }
        }
        let Some(mut output) = output else {
            return Ok(());
        };
        // What came between frames is seen before there is more, so that fades take a step a frame. Where no work
        // follows, what was edited in this frame would wait.
        let is_new = std::mem::take(&mut self.is_to_be_painted);
        if !is_new || self.progress.is_done || self.is_stuck {
            self.advance_in_frame(is_busy);
        }
        // The display may have been recreated in another size.
        self.screen.picture(self.viewer.display());
        let painted = self.screen.paint(
            &self.egui,
            std::mem::take(&mut output.shapes),
            output.pixels_per_point,
            &mut output.textures_delta,
        );
        self.after(painted, progress, &output);
        Ok(())
    }

    /// Lays the window out after the input `raw` and does what was asked for. Answers what to
    /// paint, and whether the user is dragging something.
    fn lay_out(&mut self, mut raw: egui::RawInput) -> (egui::FullOutput, bool) {
        if !self.state.is_typing && self.state.question.is_none() {
            for _ in 0..keys::take_tabs(&mut raw.events) {
                self.run(Command::Panel);
            }
        }
        let texture = self.screen.picture(self.viewer.display());
        let strands = &self.viewer.renderer().scene().strands;
        let shown = UiInput {
            viewer: &self.viewer,
            texture: Some(texture),
            progress: self.progress,
            bounds: Bounds::of(strands),
            times: self.times,
            name: self.document.name(),
            job: self.job.as_ref(),
            can_look: self.views.can(),
        };
        let mut asked = None;
        let state = &mut self.state;
        let mut output = self.egui.run_ui(raw, |ui| {
            asked = Some(layout::show(ui, &shown, state));
        });
        // What was laid out without knowing its size looks right in the next frame.
        let is_rough = output.platform_output.requested_discard();
        self.n_rough = if is_rough { self.n_rough + 1 } else { 0 };
        for command in &output.platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                self.clipboard.set_text(text);
            }
        }
        self.input
            .handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let is_busy = match asked {
            Some(asked) => {
                self.note_places(&asked);
                self.handle(asked)
            }
            None => false,
        };
        (output, is_busy)
    }

    /// Is the picture worked on without a frame, in a thread or a worker? A device has to show what it drew.
    pub(super) fn works_between_frames(&self) -> bool {
        self.viewer.renderer().works_alone()
    }

    /// Waits a little between two frames for what is new of the picture, and asks for the next one when there is something
    /// to see.
    fn wait_between_frames(&mut self) {
        let shown = (self.progress, self.viewer.display().version());
        self.advance(BUDGET_BETWEEN);
        let is_new = shown != (self.progress, self.viewer.display().version());
        let is_due = self.last_frame.elapsed() > LONGEST_FRAME;
        // A worker may have ended.
        let is_left = !self.works_between_frames();
        if is_new || is_due || is_left || self.progress.is_done || self.is_stuck || self.is_outdated
        {
            self.is_between_frames = false;
            self.is_to_be_painted = is_new;
            self.window.request_redraw();
        }
    }

    fn advance_in_frame(&mut self, is_busy: bool) {
        self.advance(if self.works_between_frames() {
            Duration::ZERO
        } else if self.progress.is_shown || self.is_empty || is_busy {
            BUDGETS[usize::from(!is_busy)]
        } else {
            BUDGET_OF_VIEWS
        });
    }

    fn advance(&mut self, budget: Duration) {
        let is_mask_shown = self.state.paint.is_mask_shown();
        self.viewer.set_mask_shown(is_mask_shown);
        match self.viewer.advance(budget) {
            Ok(progress) => {
                self.progress = progress;
                self.is_stuck = false;
                self.note_mask();
            }
            // The next frame recovers.
            Err(RenderError::DeviceLost(_)) => self.window.request_redraw(),
            Err(error) => {
                self.is_stuck = true;
                self.fail(&error.to_string());
            }
        }
    }

    /// Tells the log what is on screen now and decides when the next frame is made. `shown` is the
    /// progress that the status line of this frame tells.
    fn after(&mut self, painted: Painted, shown: PictureProgress, output: &egui::FullOutput) {
        let frame = self.last_frame.elapsed().as_secs_f64() * 1e3;
        self.last_frame = Instant::now();
        // A pause is no frame.
        if frame < 1e3 {
            self.times.frame_ms += 0.2 * (frame - self.times.frame_ms);
        }
        if painted == Painted::Presented {
            self.log.write("drawn", json!({}));
            #[cfg(target_arch = "wasm32")]
            self.note_progress();
            self.note_picture();
            #[cfg(not(target_arch = "wasm32"))]
            {
                self.note_truth();
                self.note_inspection();
            }
        }
        self.set_title();
        let delay = (output.viewport_output.get(&egui::ViewportId::ROOT))
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        let is_working = !self.progress.is_done && !self.is_stuck;
        let is_outdated = std::mem::take(&mut self.is_outdated);
        // Work goes on elsewhere: how far it is is shown now and then.
        #[cfg(not(target_arch = "wasm32"))]
        let is_waiting = {
            self.draw_look();
            self.job.is_some() || self.look_job.is_some()
        };
        #[cfg(target_arch = "wasm32")]
        let is_waiting = false;
        let delay = match is_waiting {
            true => delay.min(Duration::from_millis(100)),
            false => delay,
        };
        #[cfg(not(target_arch = "wasm32"))]
        let delay = self
            .viewer
            .next_update()
            .map_or(delay, |next| delay.min(next));
        let is_next = match painted {
            Painted::Again => true,
            Painted::Presented => {
                let is_rough = (1..MOST_ROUGH).contains(&self.n_rough);
                let is_new = is_outdated || self.progress != shown;
                let is_worked_on = is_working && !self.works_between_frames();
                delay.is_zero() || is_worked_on || is_rough || is_new
            }
            Painted::Hidden => false,
        };
        let is_presented = painted == Painted::Presented;
        self.is_between_frames =
            is_working && !is_next && is_presented && self.works_between_frames();
        if is_next {
            self.window.request_redraw();
        } else {
            // A window that could not be shown is tried again now and then.
            let longest = if is_working { 1 } else { 3600 };
            self.wake = Instant::now().checked_add(delay.min(Duration::from_secs(longest)));
        }
    }

    /// Tells the log once how the mask is shown, and has a frame made where it is another than was laid out.
    fn note_mask(&mut self) {
        let version = self.viewer.mask_display().map(|display| display.version);
        let layer = &mut self.state.paint.mask_layer;
        self.is_outdated |= version != layer.version();
        let (is_shown, is_of_view) = (version.is_some(), self.viewer.is_mask_of_view());
        let told = (is_shown, is_of_view);
        if std::mem::replace(&mut layer.told, told) != told {
            let of_mask = json!({ "is_shown": is_shown, "is_of_view": is_of_view });
            self.log.write("mask", of_mask);
        }
    }

    fn note_picture(&mut self) {
        // In memory it is another picture, or there is none to come.
        let version = self.viewer.display().version();
        let is_other = |before: u64| version != before || version == 0 || self.progress.is_done;
        if self.progress.is_shown && self.awaited.is_some_and(is_other) {
            self.awaited = None;
            self.log.write("shown", json!({}));
        }
        let device = || match self.viewer.renderer().device() {
            Some(context) => format!("{} ({})", context.adapter_name, context.backend),
            None => self.viewer.report().stats.backend.clone(),
        };
        if self.is_empty && self.progress.is_shown {
            self.is_empty = false;
            self.log
                .write("first_picture", json!({ "device": device() }));
        }
        if self.is_first && self.progress.is_shaded && self.progress.is_shown {
            self.is_first = false;
            self.log.write("ready", json!({ "device": device() }));
        }
        if self.progress.is_done && std::mem::take(&mut self.is_unlogged) {
            let samples = self.progress.samples;
            self.log.write("frame", json!({ "samples": samples }));
            #[cfg(not(target_arch = "wasm32"))]
            self.keep_thumbnail();
            if std::mem::take(&mut self.loses_device) {
                if let Some(context) = self.screen.context() {
                    context.device.destroy();
                }
                self.window.request_redraw();
            }
        }
        self.save_if_finished();
    }

    /// Tells how far the picture on screen is to ground truth, where that is news.
    #[cfg(not(target_arch = "wasm32"))]
    fn note_truth(&mut self) {
        let truth = self.viewer.ground_truth().transpose();
        let error = truth.as_ref().err().map(ToString::to_string);
        let truth = truth.ok().flatten();
        // Once, however often the picture is finished again.
        if let Some(error) = error.filter(|error| self.truth_error.as_ref() != Some(error)) {
            self.fail(&error);
            self.truth_error = Some(error);
            self.window.request_redraw();
        }
        if truth != self.truth {
            self.truth = truth;
            // The status line was laid out before.
            self.window.request_redraw();
            if let Some(truth) = truth {
                let error = truth.relative_error;
                self.log.write(
                    "truth",
                    json!({
                        "samples": truth.samples,
                        "relative_error": error.is_finite().then_some(error),
                        "is_done": truth.is_done,
                    }),
                );
            }
        }
    }

    fn set_title(&mut self) {
        let is_modified = self.viewer.session().is_modified();
        #[cfg(target_arch = "wasm32")]
        crate::page::note_modified(is_modified);
        let name = self.document.name_in_folder();
        let title = title(&name, is_modified, &self.progress);
        if title != self.title {
            self.window.set_title(&title);
            self.title = title;
        }
    }

    /// Nothing is drawn any more until there is another device, and the title says so.
    fn note_loss(&mut self, reason: &str) {
        self.changed("lost", json!({ "reason": reason }));
        self.progress = PictureProgress::default();
        self.set_title();
    }

    /// A new device for the same window and the same session.
    #[cfg(not(target_arch = "wasm32"))]
    fn recover(&mut self, reason: &str) -> Result<(), GpuError> {
        self.note_loss(reason);
        let screen = Screen::open(
            self.window.clone(),
            self.display.clone(),
            self.screen_choice(),
        );
        self.take_up(pollster::block_on(screen)?);
        Ok(())
    }

    /// A page cannot wait: whoever calls opens a device and brings it to [`Workspace::take_up`].
    #[cfg(target_arch = "wasm32")]
    fn recover(&mut self, reason: &str) -> Result<(), GpuError> {
        self.note_loss(reason);
        let reason = reason.to_owned();
        Err(GpuError::Lost { reason })
    }

    /// What a screen is opened for in place of one that was lost: a picture that a device draws needs
    /// a device again.
    pub fn screen_choice(&self) -> BackendChoice {
        match self.viewer.renderer().device() {
            Some(_) => BackendChoice::Gpu,
            None => self.choice,
        }
    }

    /// Goes on with the device of `screen`.
    pub fn take_up(&mut self, screen: Screen) {
        self.screen = screen;
        if let Some(context) = self.screen.context()
            && let Err(error) = self.viewer.set_context(context)
        {
            self.fail(&error.to_string());
        }
        self.state.looks.forget_pictures();
        if let Some(photo) = &mut self.state.paint.photo {
            photo.forget_texture();
        }
        self.state.paint.mask_layer.forget();
        self.state.lights.map.forget_texture();
        self.state.thumbnails.forget();
        // egui sends its fonts again to the new device, and remembers what was open.
        let memory = self.egui.memory(Clone::clone);
        self.egui = egui::Context::default();
        self.egui.memory_mut(|of_new| *of_new = memory);
        // After the memory, in which fonts wait to be taken up.
        theme::apply(&self.egui);
        self.input = egui_winit::State::new(
            self.egui.clone(),
            egui::ViewportId::ROOT,
            &self.window,
            Some(self.window.scale_factor() as f32),
            None,
            Some(self.screen.max_texture_side() as usize),
        );
        self.say("The graphics device was lost and opened again.");
        self.window.request_redraw();
    }
}
