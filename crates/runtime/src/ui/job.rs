//! Long work that the window waits for in the background: files that are opened, maps that lights are
//! fitted to, large pictures.

use web_time::Instant;

use super::theme;

#[cfg(not(target_arch = "wasm32"))]
mod native {
    use std::path::PathBuf;
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, TryRecvError, channel};

    use egui::{RichText, Ui};
    use web_time::Instant;

    use crate::opening::{self, CannotOpen, Fitted};
    use crate::session::Session;
    use crate::ui::field::Changes;
    use crate::ui::fitted::fitted_modal;
    use crate::ui::job::bar;
    use crate::ui::questions::Then;
    use crate::work::{Work, WorkError};

    /// What work has made.
    pub enum JobResult {
        /// A scene, opened from a file or made around one.
        Scene {
            /// The file that was asked for; none for the sample.
            from: Option<PathBuf>,
            /// The document.
            session: Box<Session>,
        },
        /// A groom, as a file, of hair of another program.
        Groom {
            /// That program's file.
            from: PathBuf,
            /// A `.groom` file.
            bytes: Vec<u8>,
            /// What was taken, dropped and doubted.
            notes: Vec<String>,
        },
        /// A light set fitted to a map, and the map for the background.
        Lights {
            /// The map.
            from: PathBuf,
            /// Light set, panorama, and how good they are.
            fitted: Fitted,
        },
        /// The desktop's dialog was closed.
        Chosen {
            /// What a file was wanted for.
            wanted: Wanted,
            /// The file; none where none was chosen.
            path: Option<PathBuf>,
            /// It was closed before anybody could have seen it: there is no dialog.
            is_missing: bool,
        },
        /// Pictures were written here: one, or the frames of a turntable.
        Pictures(Vec<PathBuf>),
    }

    /// What a file is wanted for.
    #[derive(Clone, Debug)]
    pub enum Wanted {
        /// It is opened.
        Open,
        /// The scene is saved there, and this is done then.
        SaveAs(Then),
    }

    /// Work under way.
    pub struct Job {
        /// What is being done, for people.
        pub title: String,
        work: Arc<Work>,
        answer: Receiver<Result<JobResult, CannotOpen>>,
        start: Instant,
    }

    /// What became of a job since it was last asked.
    pub enum News {
        /// It goes on.
        None,
        /// It is done.
        Done(JobResult),
        /// It failed, for this reason.
        Failed(String),
        /// It was stopped.
        Stopped,
    }

    impl Job {
        /// Starts `make` in a thread of its own.
        pub fn start(
            title: String,
            make: impl FnOnce(&Work) -> Result<JobResult, CannotOpen> + Send + 'static,
        ) -> Job {
            let work = Arc::new(Work::default());
            let (of_thread, (tell, answer)) = (work.clone(), channel());
            std::thread::spawn(move || {
                let made = make(&of_thread);
                // A window that was closed meanwhile does not listen.
                let _ = tell.send(made);
            });
            Job {
                title,
                work,
                answer,
                start: Instant::now(),
            }
        }

        /// Opens a file, or the bundled sample where there is none to open.
        pub fn open(path: Option<PathBuf>) -> Job {
            let title = match &path {
                Some(path) => format!("Opening {}", crate::ui::questions::name_of(path)),
                None => "Making the sample".to_owned(),
            };
            Job::start(title, move |work| {
                let session = Box::new(match &path {
                    Some(path) => opening::open(path, work)?,
                    None => sample(work)?,
                });
                Ok(JobResult::Scene {
                    from: path,
                    session,
                })
            })
        }

        /// Stops it.
        pub fn stop(&self) {
            self.work.stop();
        }

        /// How it is going.
        pub fn news(&self) -> News {
            match self.answer.try_recv() {
                Ok(Ok(made)) => News::Done(made),
                Ok(Err(CannotOpen::Work(WorkError::Stopped))) => News::Stopped,
                Ok(Err(error)) => News::Failed(error.to_string()),
                Err(TryRecvError::Empty) => News::None,
                Err(TryRecvError::Disconnected) => {
                    News::Failed(format!("{} failed without a reason", self.title))
                }
            }
        }

        /// Shows how far it is, and a way to stop it.
        pub fn show(&self, ui: &Ui, changes: &mut Changes) {
            let modal = fitted_modal(ui, "job", |ui, width| {
                ui.set_width(width.min(300.0));
                ui.label(RichText::new(&self.title).strong());
                bar(ui, self.work.share(), self.start);
                let cancel = ui.button("Cancel");
                changes.place("Cancel job button", &cancel);
                cancel.clicked()
            });
            if modal.inner || modal.should_close() {
                self.stop();
            }
        }
    }

    /// The sample for somebody who starts in the current folder, or plain hair where it cannot be made.
    ///
    /// # Errors
    /// What cannot be made, by name.
    pub fn sample(work: &Work) -> Result<Session, CannotOpen> {
        let home = std::env::current_dir().unwrap_or_default();
        let cache = crate::ui::settings::cache_folder();
        let cache = cache.unwrap_or_else(|| std::env::temp_dir().join("strandlight"));
        let cache = cache.join(concat!("sample-", env!("CARGO_PKG_VERSION")));
        match opening::sample(&cache, &home, work) {
            Err(CannotOpen::Work(WorkError::Program { .. })) => opening::plain(&home),
            answer => answer,
        }
    }
}

#[cfg(target_arch = "wasm32")]
mod web {
    use egui::Ui;

    use crate::ui::field::Changes;

    /// A page has one thread and no other programs.
    pub enum Job {}

    impl Job {
        /// Never called.
        pub fn show(&self, _: &Ui, _: &mut Changes) {
            match *self {}
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
pub use native::{Job, JobResult, News, Wanted, sample};
#[cfg(target_arch = "wasm32")]
pub use web::Job;

/// How much is done, or that something is.
pub fn bar(ui: &mut egui::Ui, share: Option<f32>, start: Instant) {
    let bar = match share {
        Some(share) => egui::ProgressBar::new(share),
        None => {
            // It comes and goes: nothing is known but that it lives.
            let turn = (0.7 * start.elapsed().as_secs_f32()).fract();
            egui::ProgressBar::new(turn)
        }
    };
    ui.add(bar.desired_height(6.0).fill(theme::ACCENT));
}
