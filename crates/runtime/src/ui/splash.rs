//! What a window shows until its scene was read.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

use egui::{Align2, RichText};
use web_time::Instant;
use winit::event::WindowEvent;
use winit::window::Window;

use super::job::bar;
use super::launch::{Launch, Rest};
use super::screen::Screen;
use super::theme;
use crate::opening::CannotOpen;
use crate::session::Session;
use crate::work::{Work, WorkError};

/// Between two looks at the work, and two pictures of how far it is.
const LOOK: Duration = Duration::from_millis(15);
const FRAME: Duration = Duration::from_millis(100);

/// A window whose scene is being read.
pub struct Splash {
    window: Arc<Window>,
    screen: Screen,
    launch: Rest,
    egui: egui::Context,
    work: Arc<Work>,
    answer: Receiver<Result<Session, CannotOpen>>,
    start: Instant,
    next_frame: Instant,
}

impl Splash {
    /// Starts to read the scene.
    pub fn new(window: Arc<Window>, screen: Screen, launch: Launch) -> Splash {
        let egui = egui::Context::default();
        theme::apply(&egui);
        let (open, launch) = launch.parts();
        let work = Arc::new(Work::default());
        let (of_thread, (tell, answer)) = (work.clone(), channel());
        std::thread::spawn(move || {
            let opened = open(&of_thread);
            // A window that was closed meanwhile does not listen.
            let _ = tell.send(opened);
        });
        let start = Instant::now();
        Splash {
            window,
            screen,
            launch,
            egui,
            work,
            answer,
            start,
            // Small scenes are there before anybody could read what is said.
            next_frame: start + FRAME,
        }
    }

    /// The document, once it was read.
    pub fn poll(&mut self) -> Option<Result<Session, CannotOpen>> {
        match self.answer.try_recv() {
            Ok(opened) => return Some(opened),
            Err(TryRecvError::Disconnected) => {
                let failed = WorkError::Failed(format!("{} cannot be opened", self.launch.name));
                return Some(Err(failed.into()));
            }
            Err(TryRecvError::Empty) => {}
        }
        if Instant::now() >= self.next_frame {
            self.next_frame = Instant::now() + FRAME;
            self.paint();
        }
        None
    }

    /// When to look again.
    pub fn next_look(&self) -> Instant {
        Instant::now() + LOOK
    }

    /// Follows the window's size.
    pub fn on_event(&mut self, event: &WindowEvent) {
        if let WindowEvent::Resized(size) = event {
            self.screen.resize(*size);
        }
        if let WindowEvent::Resized(_) | WindowEvent::RedrawRequested = event {
            self.next_frame = self.next_frame.min(Instant::now());
        }
    }

    /// The window is closed: the scene is not wanted any more.
    pub fn stop(&self) {
        self.work.stop();
    }

    /// The window, its screen, and the rest of what it was opened with.
    pub fn into_parts(self) -> (Arc<Window>, Screen, Rest) {
        (self.window, self.screen, self.launch)
    }

    fn paint(&mut self) {
        let scale = self.window.scale_factor() as f32;
        let size = self.window.inner_size();
        let points = egui::vec2(size.width as f32, size.height as f32) / scale;
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points)),
            ..egui::RawInput::default()
        };
        if let Some(viewport) = input.viewports.get_mut(&egui::ViewportId::ROOT) {
            viewport.native_pixels_per_point = Some(scale);
        }
        let (name, share, start) = (&self.launch.name, self.work.share(), self.start);
        let mut output = self.egui.run_ui(input, |ui| {
            egui::Area::new(egui::Id::unique("splash"))
                .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
                .show(ui.ctx(), |ui| {
                    ui.set_width(260.0);
                    ui.label(RichText::new(format!("Opening {name}")).strong());
                    bar(ui, share, start);
                });
        });
        self.screen.paint(
            &self.egui,
            std::mem::take(&mut output.shapes),
            output.pixels_per_point,
            &mut output.textures_delta,
        );
    }
}
