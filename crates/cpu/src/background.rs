//! The interactive renderer in a thread of its own, so that a window answers input whatever is being computed.

use std::mem;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::budget::check_target;
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::Paint;
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::progress::Deadline;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::stats::Observer;
use strandlight_scene::{
    Backend, Camera, DisplayTransform, Picture, PreparedScene, RenderError, Stats,
};

use super::edited_scene::{BentStrands, EditedScene, edit_setters};
use super::frame::Edit;
use super::interactive::{DisplayPixels, InteractiveRenderer};

/// Work before the thread looks for edits again. Steps take some 30 ms at most, and so does the work on a view that is shown as
/// seen from another.
const BUDGET: Duration = Duration::from_millis(4);

/// An [`InteractiveRenderer`] that works in a thread of its own. Setters do as there,
/// [`BackgroundRenderer::advance`] waits for what is new, and [`BackgroundRenderer::display`] is the last picture meanwhile.
pub struct BackgroundRenderer {
    edited: EditedScene,
    size: [u32; 2],
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// What was edited since the thread was last told. It is told all at once, so that it draws no scene between two edits that are
    /// made together.
    unsent: Vec<Edit>,
    /// Requests so far, that of `unsent` included, and the last of them that asked for another view.
    n_requests: u64,
    last_view: u64,
    display: Display,
    /// Of the thread, when this was last asked to advance.
    progress: PictureProgress,
    /// Requests that `progress` knows of.
    n_taken: u64,
    report: RenderReport,
    /// Did the thread stop at an error? Whoever goes on asks it again.
    is_failed: bool,
}

/// What the thread and its renderer share.
#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    /// There are requests, or the picture was taken.
    is_asked: Condvar,
    /// There is something new to show.
    has_news: Condvar,
}

#[derive(Default)]
struct State {
    requests: Vec<Request>,
    /// Somebody asked to advance since the scene was set: until then its size is not the one that will be shown.
    is_watched: bool,
    /// Nobody is there any more.
    is_closed: bool,
    /// The thread ended.
    is_ended: bool,
    /// Requests that the thread has taken.
    n_taken: u64,
    progress: PictureProgress,
    report: RenderReport,
    /// What nobody has seen yet.
    display: Option<Display>,
    /// Strands that the thread has bent, the last of them.
    bent: Option<BentStrands>,
    error: Option<RenderError>,
    is_new: bool,
}

/// A copy of [`DisplayPixels`].
#[derive(Default)]
struct Display {
    pixels: Vec<[u8; 4]>,
    size: [u32; 2],
    version: u64,
}

enum Request {
    /// The scene was edited.
    Edited(Box<EditedScene>, Vec<Edit>),
    Scene(Box<EditedScene>),
    Size([u32; 2]),
    /// Another try after an error.
    Again,
    OverNothing([u32; 2], Sender<Result<Picture, RenderError>>),
    Render([u32; 2], u32, Sender<Rendering>),
}

/// How far a picture is that was asked for.
enum Rendering {
    ShareDone(f64),
    Done(Box<Result<(Picture, Stats), RenderError>>),
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl BackgroundRenderer {
    /// A renderer of `scene`; its first picture, of the scene's size, is begun by [`BackgroundRenderer::advance`].
    pub fn new(scene: PreparedScene) -> BackgroundRenderer {
        let shared = Arc::new(Shared::default());
        let (size, edited) = (scene.size, EditedScene::new(scene));
        let renderer = InteractiveRenderer::of(edited.clone());
        let report = renderer.report().clone();
        shared.lock().report.clone_from(&report);
        let thread = {
            let shared = Arc::clone(&shared);
            std::thread::spawn(move || {
                let ended = Ended(&shared);
                work(renderer, &shared);
                drop(ended);
            })
        };
        BackgroundRenderer {
            edited,
            size,
            shared,
            thread: Some(thread),
            unsent: Vec::new(),
            n_requests: 0,
            last_view: 0,
            display: Display::default(),
            progress: PictureProgress::default(),
            n_taken: 0,
            report,
            is_failed: false,
        }
    }

    /// Waits for something new, for about `budget`, and takes it up. Without a wait nothing is new unless the thread was ready.
    ///
    /// # Errors
    /// A picture that is too large; strands that wind cannot bend, as [`Strands::moved`](strandlight_scene::strands::Strands::moved).
    pub fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        self.send_edits();
        // It fails again at once, if it does.
        let is_again = mem::take(&mut self.is_failed);
        if is_again {
            self.ask(Request::Again);
        }
        if self.size.contains(&0) {
            return Ok(self.progress());
        }
        let least = Duration::from_secs(u64::from(is_again));
        let deadline = Deadline::after(budget.max(least));
        let mut state = self.shared.lock();
        if !mem::replace(&mut state.is_watched, true) {
            self.shared.is_asked.notify_one();
        }
        loop {
            let is_resting = state.progress.is_done && state.n_taken == self.n_requests;
            let left = deadline.left();
            if state.is_new || state.is_ended || is_resting || left.is_zero() {
                break;
            }
            let waited = self.shared.has_news.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.is_new = false;
        if let Some(display) = state.display.take() {
            self.display = display;
            self.shared.is_asked.notify_one();
        }
        if let Some(bent) = state.bent.take() {
            self.edited.take_bent(&bent);
        }
        (self.progress, self.n_taken) = (state.progress, state.n_taken);
        self.report.clone_from(&state.report);
        let (error, is_ended) = (state.error.take(), state.is_ended);
        drop(state);
        if is_ended && let Some(Err(panic)) = self.thread.take().map(JoinHandle::join) {
            resume_unwind(panic);
        }
        match error {
            Some(error) => {
                self.is_failed = true;
                Err(error)
            }
            None => Ok(self.progress()),
        }
    }

    /// How far the picture has come, as far as [`BackgroundRenderer::advance`] saw. It has no samples.
    pub fn progress(&self) -> PictureProgress {
        let is_all_taken = self.n_taken == self.n_requests;
        PictureProgress {
            is_shown: self.progress.is_shown && self.n_taken >= self.last_view,
            is_shaded: self.progress.is_shaded && is_all_taken,
            is_done: self.progress.is_done && is_all_taken || self.size.contains(&0),
            ..self.progress
        }
    }

    /// The last picture that [`BackgroundRenderer::advance`] saw.
    pub fn display(&self) -> DisplayPixels<'_> {
        DisplayPixels {
            pixels: &self.display.pixels,
            size: self.display.size,
            version: self.display.version,
        }
    }

    /// [`InteractiveRenderer::over_nothing`]. Waits for it.
    ///
    /// # Errors
    /// As there.
    pub fn over_nothing(&mut self, size: [u32; 2]) -> Result<Picture, RenderError> {
        let (sender, receiver) = channel();
        self.ask(Request::OverNothing(size, sender));
        match receiver.recv() {
            Ok(picture) => picture,
            Err(_) => self.ended(),
        }
    }

    /// [`InteractiveRenderer::report`].
    pub fn report(&self) -> &RenderReport {
        &self.report
    }

    fn ask(&mut self, request: Request) {
        self.send_edits();
        self.n_requests += 1;
        self.push(request);
    }

    fn push(&mut self, request: Request) {
        let mut state = self.shared.lock();
        state.is_watched &= !matches!(request, Request::Scene(_));
        // Nobody would answer it.
        if !state.is_ended {
            state.requests.push(request);
        }
        drop(state);
        self.shared.is_asked.notify_one();
    }

    /// The scene was edited.
    fn take(&mut self, edits: impl IntoIterator<Item = Edit>) {
        let was_empty = self.unsent.is_empty();
        let n_before = self.unsent.len();
        self.unsent.extend(edits);
        if was_empty && !self.unsent.is_empty() {
            self.n_requests += 1;
        }
        if self.unsent[n_before..].contains(&Edit::View) {
            self.last_view = self.n_requests;
        }
    }

    /// Tells the thread what was edited.
    fn send_edits(&mut self) {
        if self.unsent.is_empty() {
            return;
        }
        let edits = mem::take(&mut self.unsent);
        let edited = Box::new(self.edited.clone());
        let mut state = self.shared.lock();
        // One scene is enough of those that wait.
        if let Some(Request::Edited(waiting, before)) = state.requests.last_mut() {
            *waiting = edited;
            before.extend(edits);
            self.n_requests -= 1;
            self.last_view = self.last_view.min(self.n_requests);
        } else {
            drop(state);
            self.push(Request::Edited(edited, edits));
        }
    }

    /// What was edited is part of a scene that is replaced.
    fn forget_edits(&mut self) {
        if !self.unsent.is_empty() {
            self.unsent.clear();
            self.n_requests -= 1;
        }
    }

    /// Goes on with the panic of the thread, which does not end otherwise while somebody waits for it.
    fn ended(&mut self) -> ! {
        match self.thread.take().map(JoinHandle::join) {
            Some(Err(panic)) => resume_unwind(panic),
            _ => unreachable!("the thread ends with its renderer"),
        }
    }
}

impl Drop for BackgroundRenderer {
    fn drop(&mut self) {
        self.shared.lock().is_closed = true;
        self.shared.is_asked.notify_one();
        if let Some(thread) = self.thread.take() {
            // What it panicked with was told when it did.
            thread.join().ok();
        }
    }
}

/// Tells that the thread ended, whatever ended it.
struct Ended<'a>(&'a Shared);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        let mut state = self.0.lock();
        state.is_ended = true;
        // Whoever waits for an answer learns that there will be none.
        state.requests.clear();
        drop(state);
        self.0.has_news.notify_one();
    }
}

/// What the thread does.
fn work(mut renderer: InteractiveRenderer, shared: &Shared) {
    let mut version = 0;
    let mut is_failed = false;
    loop {
        let (requests, is_watched) = {
            let mut state = shared.lock();
            loop {
                if state.is_closed {
                    return;
                }
                // Without edits no picture is made before the last one was seen, so that none is left out and nothing jumps.
                let is_seen = state.display.is_none() && state.is_watched;
                let is_working = is_seen && !is_failed && !renderer.progress().is_done;
                if is_working || !state.requests.is_empty() {
                    break;
                }
                let waited = shared.is_asked.wait(state);
                state = waited.unwrap_or_else(PoisonError::into_inner);
            }
            (mem::take(&mut state.requests), state.is_watched)
        };
        let mut n_requests = requests.len() as u64;
        let mut done = Ok(());
        for request in requests {
            done = done.and(do_request(&mut renderer, request));
        }
        // Another view is seen as soon as it can be, and worked on then.
        if is_watched && done.is_ok() && n_requests > 0 && renderer.show_reprojected() {
            publish(
                &renderer,
                shared,
                &mut version,
                mem::take(&mut n_requests),
                None,
            );
        }
        let advanced = match is_watched {
            true => done.and_then(|()| renderer.advance(BUDGET)),
            false => done.map(|()| renderer.progress()),
        };
        is_failed = advanced.is_err();
        publish(&renderer, shared, &mut version, n_requests, advanced.err());
    }
}

/// Tells what there is after `n_requests` more, if it is new, and at which error the thread stopped. The pixels that were told last are
/// those of `version`.
fn publish(
    renderer: &InteractiveRenderer,
    shared: &Shared,
    version: &mut u64,
    n_requests: u64,
    error: Option<RenderError>,
) {
    let mut state = shared.lock();
    state.n_taken += n_requests;
    if n_requests > 0 {
        state.bent = renderer.bent();
    }
    state.report.clone_from(renderer.report());
    let display = renderer.display();
    if display.version != *version {
        *version = display.version;
        state.display = Some(Display {
            pixels: display.pixels.to_vec(),
            size: display.size,
            version: *version,
        });
        state.is_new = true;
    }
    let progress = renderer.progress();
    state.is_new |= error.is_some() || n_requests > 0 || state.progress != progress;
    state.progress = progress;
    if error.is_some() {
        state.error = error;
    }
    if state.is_new {
        shared.has_news.notify_one();
    }
}

fn do_request(renderer: &mut InteractiveRenderer, request: Request) -> Result<(), RenderError> {
    match request {
        Request::Edited(edited, edits) => return renderer.set_edited(*edited, edits),
        Request::Scene(edited) => renderer.replace(*edited),
        // It was looked at before it was sent.
        Request::Size(size) => drop(renderer.set_size(size)),
        Request::Again => {}
        Request::OverNothing(size, sender) => {
            sender.send(renderer.over_nothing(size)).ok();
        }
        Request::Render(size, samples, sender) => {
            let observer = |share| {
                sender.send(Rendering::ShareDone(share)).ok();
            };
            let rendered = renderer.render(size, samples, &observer);
            sender.send(Rendering::Done(Box::new(rendered))).ok();
        }
    }
    Ok(())
}

impl Backend for BackgroundRenderer {
    fn name(&self) -> String {
        "cpu".to_owned()
    }

    fn scene(&self) -> &PreparedScene {
        &self.edited.scene
    }

    fn set_scene(&mut self, scene: PreparedScene) -> Result<(), RenderError> {
        self.forget_edits();
        self.size = scene.size;
        self.edited = EditedScene::new(scene);
        self.ask(Request::Scene(Box::new(self.edited.clone())));
        self.last_view = self.n_requests;
        Ok(())
    }

    edit_setters!(edited);

    /// The thread bends them, and [`BackgroundRenderer::advance`] takes them up: until then those of the scene are where they were.
    fn set_wind(&mut self, wind: Option<Wind>) -> Result<(), RenderError> {
        let edit = self.edited.ask_for_wind(wind);
        self.take(edit);
        Ok(())
    }

    fn set_size(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if self.size == size {
            return Ok(());
        }
        if !size.contains(&0) {
            check_target(size)?;
            self.edited.scene.size = size;
        }
        self.size = size;
        self.ask(Request::Size(size));
        self.last_view = self.n_requests;
        Ok(())
    }

    /// Of pictures by samples alone, which a screen is not shown.
    fn set_samples(&mut self, samples: u32) {
        self.edited.scene.samples = samples;
        self.ask(Request::Edited(Box::new(self.edited.clone()), Vec::new()));
    }

    /// Nothing else is ever shaded.
    fn shade_view_only(&mut self) {}

    fn render(
        &mut self,
        size: [u32; 2],
        samples: u32,
        observer: Observer,
    ) -> Result<(Picture, Stats), RenderError> {
        let (sender, receiver) = channel();
        self.ask(Request::Render(size, samples, sender));
        for rendering in receiver {
            match rendering {
                Rendering::ShareDone(share) => observer(share),
                Rendering::Done(rendered) => return *rendered,
            }
        }
        self.ended()
    }
}
