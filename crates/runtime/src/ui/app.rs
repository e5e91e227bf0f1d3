//! The event loop: opens the window, then hands it all events.

use std::sync::Arc;

use web_time::Instant;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy, OwnedDisplayHandle};
use winit::window::{Window, WindowAttributes, WindowId};

use super::launch::{Failure, Launch, Rest};
use super::screen::Screen;
#[cfg(not(target_arch = "wasm32"))]
use super::splash::Splash;
use super::workspace::Workspace;
use crate::choice::BackendChoice;
#[cfg(target_arch = "wasm32")]
use crate::interactive::InteractiveBackend;
use crate::session::Session;
use crate::viewer::Viewer;
#[cfg(target_arch = "wasm32")]
use crate::worker::{PageLink, WorkerRenderer};
#[cfg(target_arch = "wasm32")]
use strandlight_cpu::InteractiveRenderer;
use strandlight_render::gpu::GpuError;

/// Sent to the event loop.
pub enum Sent {
    /// A device has come, which in a browser takes a while.
    Opened(Result<Screen, GpuError>),
    /// The process is about to end: what would be lost is to be kept, and it is told when that is done.
    #[cfg(not(target_arch = "wasm32"))]
    Interrupted(std::sync::mpsc::Sender<()>),
    /// The page wants the window no more.
    #[cfg(target_arch = "wasm32")]
    Close,
    /// A worker has answered.
    #[cfg(target_arch = "wasm32")]
    Answered,
}

/// The program with a window.
pub struct App {
    launch: Option<Launch>,
    proxy: EventLoopProxy<Sent>,
    window: Option<Arc<Window>>,
    display: Option<OwnedDisplayHandle>,
    workspace: Option<Workspace>,
    /// The scene is being read meanwhile.
    #[cfg(not(target_arch = "wasm32"))]
    splash: Option<Splash>,
    is_opening: bool,
    /// Why it ended, if not because it was closed.
    pub failure: Option<Failure>,
}

impl App {
    /// Waits for the event loop to start.
    pub fn new(
        launch: Launch,
        proxy: EventLoopProxy<Sent>,
        display: Option<OwnedDisplayHandle>,
    ) -> Self {
        App {
            launch: Some(launch),
            proxy,
            window: None,
            display,
            workspace: None,
            #[cfg(not(target_arch = "wasm32"))]
            splash: None,
            is_opening: false,
            failure: None,
        }
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Failure> {
        let attributes = Window::default_attributes().with_title("strandview");
        let attributes = self.placed(attributes);
        let window = event_loop
            .create_window(attributes)
            .map_err(Failure::Window)?;
        let window = Arc::new(window);
        self.window = Some(window.clone());
        self.open_screen(window);
        Ok(())
    }

    fn open_screen(&mut self, window: Arc<Window>) {
        self.is_opening = true;
        let (proxy, display) = (self.proxy.clone(), self.display.clone());
        let choice = match (&self.launch, &self.workspace) {
            (Some(launch), _) => launch.choice,
            (None, Some(workspace)) => workspace.screen_choice(),
            (None, None) => BackendChoice::Auto,
        };
        let opening = async move {
            let opened = Sent::Opened(Screen::open(window, display, choice).await);
            // Without a loop there is no window left to show an error in.
            let _ = proxy.send_event(opened);
        };
        #[cfg(not(target_arch = "wasm32"))]
        pollster::block_on(opening);
        #[cfg(target_arch = "wasm32")]
        wasm_bindgen_futures::spawn_local(opening);
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn placed(&self, attributes: WindowAttributes) -> WindowAttributes {
        use winit::dpi::{LogicalSize, PhysicalSize, Size};

        let size = self.launch.as_ref().and_then(|launch| launch.size);
        let size: Size = match size {
            Some([width, height]) => PhysicalSize::new(width, height).into(),
            None => LogicalSize::new(1280.0, 720.0).into(),
        };
        attributes
            .with_inner_size(size)
            .with_min_inner_size(LogicalSize::new(320.0, 240.0))
    }

    /// In the page's canvas, whose size is the page's affair.
    #[cfg(target_arch = "wasm32")]
    fn placed(&self, attributes: WindowAttributes) -> WindowAttributes {
        use winit::platform::web::WindowAttributesExtWebSys;

        let canvas = self.launch.as_ref().map(|launch| launch.canvas.clone());
        // Which of its elements has the keyboard is the page's affair as well.
        attributes.with_canvas(canvas).with_active(false)
    }

    fn open_scene(&mut self, screen: Screen) -> Result<(), Failure> {
        self.is_opening = false;
        if let Some(workspace) = &mut self.workspace {
            workspace.take_up(screen);
            return Ok(());
        }
        let (Some(mut launch), Some(window)) = (self.launch.take(), self.window.clone()) else {
            return Ok(());
        };
        let adapter = screen.context().map(|context| &context.adapter_name);
        let adapter = serde_json::json!({ "adapter": adapter });
        launch.log.write("device", adapter);
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.splash = Some(Splash::new(window, screen, launch));
            Ok(())
        }
        #[cfg(target_arch = "wasm32")]
        {
            let (open, mut rest) = launch.parts();
            // The worker opens the scene in step with this.
            let is_on_cpu = screen.context().is_none();
            let link = is_on_cpu.then(|| self.start_worker(&mut rest)).flatten();
            let session = open()?;
            self.show(window, screen, rest, session, link)
        }
    }

    /// Starts what draws without a GPU, if that was not tried before and the browser lets it.
    #[cfg(target_arch = "wasm32")]
    fn start_worker(&self, launch: &mut Rest) -> Option<PageLink> {
        let proxy = self.proxy.clone();
        launch.worker.take()?.start(move || {
            // A loop that is gone has nothing to show.
            let _ = proxy.send_event(Sent::Answered);
        })
    }

    /// Shows a document that was read; in a page, drawn by what `link` leads to where no GPU draws.
    fn show(
        &mut self,
        window: Arc<Window>,
        screen: Screen,
        mut launch: Rest,
        session: Session,
        #[cfg(target_arch = "wasm32")] link: Option<PageLink>,
    ) -> Result<(), Failure> {
        let choice = launch.choice;
        #[cfg(not(target_arch = "wasm32"))]
        let viewer = Viewer::choose(choice, screen.chosen(choice)?, session)?;
        #[cfg(target_arch = "wasm32")]
        let viewer = {
            let on_cpu = |scene| -> Box<dyn InteractiveBackend> {
                match link.or_else(|| self.start_worker(&mut launch)) {
                    Some(link) => Box::new(WorkerRenderer::new(scene, Box::new(link))),
                    None => Box::new(InteractiveRenderer::new(scene)),
                }
            };
            Viewer::choose_from(choice, screen.chosen(choice)?, session, on_cpu)?
        };
        let reason = viewer.cpu_reason().map(ToString::to_string);
        let renderer = serde_json::json!({ "name": viewer.renderer().name(), "reason": reason });
        launch.log.write("renderer", renderer);
        let display = self.display.clone();
        let mut workspace = Workspace::new(window, display, screen, viewer, choice, launch.log);
        workspace.set_time(launch.seconds);
        #[cfg(not(target_arch = "wasm32"))]
        workspace.tell_recovery();
        if launch.loses_device {
            workspace.lose_device();
        }
        #[cfg(target_arch = "wasm32")]
        workspace.show_panel(launch.has_panel);
        self.workspace = Some(workspace);
        #[cfg(target_arch = "wasm32")]
        crate::page::say("");
        Ok(())
    }

    /// Looks whether the scene was read meanwhile; answers when to look again.
    #[cfg(not(target_arch = "wasm32"))]
    fn poll_splash(&mut self) -> Result<Option<Instant>, Failure> {
        let Some(mut splash) = self.splash.take() else {
            return Ok(None);
        };
        match splash.poll() {
            Some(session) => {
                let session = session?;
                let (window, screen, launch) = splash.into_parts();
                self.show(window, screen, launch, session)?;
                Ok(None)
            }
            None => {
                let next = splash.next_look();
                self.splash = Some(splash);
                Ok(Some(next))
            }
        }
    }

    /// What is shown, for the page that shows it.
    #[cfg(target_arch = "wasm32")]
    pub fn workspace(&mut self) -> Option<&mut Workspace> {
        self.workspace.as_mut()
    }

    /// Gives back what takes memory, without waiting for the event loop.
    #[cfg(target_arch = "wasm32")]
    pub fn release(&mut self) {
        self.launch = None;
        if let Some(workspace) = self.workspace.take() {
            workspace.release();
        }
        self.window = None;
    }

    /// Keeps changes that were not saved in a file of their own: nobody can be asked any more.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn keep_unsaved(&mut self) {
        if let Some(workspace) = &mut self.workspace {
            workspace.keep_unsaved();
        }
    }

    fn end(&mut self, event_loop: &ActiveEventLoop, failure: Option<Failure>) {
        #[cfg(not(target_arch = "wasm32"))]
        if failure.is_some() {
            self.keep_unsaved();
        }
        if let Some(workspace) = &mut self.workspace {
            workspace.closed();
        }
        #[cfg(target_arch = "wasm32")]
        crate::page::say(&match &failure {
            Some(failure) => format!("strandview: {failure}"),
            None => "Closed.".to_owned(),
        });
        self.failure = failure;
        event_loop.exit();
    }
}

impl ApplicationHandler<Sent> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        if let Err(failure) = self.open_window(event_loop) {
            self.end(event_loop, Some(failure));
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, sent: Sent) {
        let opened = match sent {
            Sent::Opened(screen) => screen.map_err(Failure::Gpu),
            #[cfg(not(target_arch = "wasm32"))]
            Sent::Interrupted(tell) => {
                self.keep_unsaved();
                // Who waited no longer ends the process anyway.
                let _ = tell.send(());
                return;
            }
            #[cfg(target_arch = "wasm32")]
            Sent::Close => return self.end(event_loop, None),
            // It is taken up before the loop waits.
            #[cfg(target_arch = "wasm32")]
            Sent::Answered => return,
        };
        if let Err(failure) = opened.and_then(|screen| self.open_scene(screen)) {
            self.end(event_loop, Some(failure));
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match &mut self.workspace {
            // Its device is on the way.
            Some(_) if self.is_opening => {}
            Some(workspace) => match workspace.on_event(&event) {
                // Only pages cannot wait for another one there and then.
                Err(GpuError::Lost { .. }) if cfg!(target_arch = "wasm32") => {
                    if let Some(window) = self.window.clone() {
                        self.open_screen(window);
                    }
                }
                Err(error) => self.end(event_loop, Some(Failure::Gpu(error))),
                Ok(()) if !workspace.is_open() => self.end(event_loop, None),
                Ok(()) => {}
            },
            None if event == WindowEvent::CloseRequested => {
                #[cfg(not(target_arch = "wasm32"))]
                if let Some(splash) = self.splash.take() {
                    splash.stop();
                }
                self.end(event_loop, None);
            }
            None =>
            {
                #[cfg(not(target_arch = "wasm32"))]
                if let Some(splash) = &mut self.splash {
                    splash.on_event(&event);
                }
            }
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        #[cfg(not(target_arch = "wasm32"))]
        match self.poll_splash() {
            Ok(Some(time)) => return event_loop.set_control_flow(ControlFlow::WaitUntil(time)),
            Ok(None) => {}
            Err(failure) => return self.end(event_loop, Some(failure)),
        }
        let next: Option<Instant> = self.workspace.as_mut().and_then(Workspace::on_time);
        event_loop.set_control_flow(match next {
            Some(time) => ControlFlow::WaitUntil(time),
            None => ControlFlow::Wait,
        });
    }
}
