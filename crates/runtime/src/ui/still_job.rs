//! Pictures, turntables and layers that are asked for in the window and drawn by the installed `strandlight`.

#[cfg(not(target_arch = "wasm32"))]
use std::path::{Path, PathBuf};

#[cfg(not(target_arch = "wasm32"))]
use serde_json::{Value, json};

#[cfg(not(target_arch = "wasm32"))]
use super::job::{Job, JobResult};
use super::questions::Question;
#[cfg(not(target_arch = "wasm32"))]
use super::questions::name_of;
use super::still::Still;
use super::workspace::Workspace;
#[cfg(not(target_arch = "wasm32"))]
use crate::opening::CannotOpen;
#[cfg(not(target_arch = "wasm32"))]
use crate::script::{Script, Step};
#[cfg(not(target_arch = "wasm32"))]
use crate::session::section_of;
#[cfg(not(target_arch = "wasm32"))]
use crate::work::{Scratch, Work};

impl Workspace {
    /// Asks of which size a picture is to be, and where it goes.
    pub(super) fn ask_still(&mut self) {
        let size = self.viewer.size();
        let path = self.document.next_picture();
        let still = Box::new(Still::new(path, size));
        self.ask(Question::Still {
            still,
            failure: None,
        });
    }

    /// Writes pictures as they were asked for; asks before it replaces other files.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn write_still(&mut self, still: Box<Still>, is_agreed: bool) {
        let path = still.path();
        let asked = Question::Still {
            still: still.clone(),
            failure: None,
        };
        let is_known = ["png", "exr"].map(|kind| {
            path.extension()
                .is_some_and(|x| x.eq_ignore_ascii_case(kind))
        });
        let files = still.files();
        let refused_file = files.iter().find_map(|file| {
            let error = strandlight_formats::check_writable(file).err()?;
            Some(format!("{}: cannot be written: {error}", file.display()))
        });
        let refused = match is_known.contains(&true) {
            true => refused_file,
            false => Some("the name must end in .png or .exr".to_owned()),
        };
        if let Some(refused) = refused {
            self.log.write("error", json!({ "message": refused }));
            return self.ask(asked.failed(refused));
        }
        let there = files.iter().find(|file| file.symlink_metadata().is_ok());
        if let (Some(there), false) = (there, is_agreed) {
            let path = there.display().to_string();
            let asked = Box::new(asked);
            return self.ask(Question::Replace { path, asked });
        }
        self.end_stroke();
        let (mut session, view) = (
            self.viewer.session().clone(),
            section_of(&self.viewer.prepared().camera),
        );
        let (seconds, backend) = (self.viewer.time(), self.choice.name());
        let title = format!("Rendering {}", name_of(&path));
        self.begin(Job::start(title, move |work| {
            // What the window shows, whether it is saved or not.
            let scratch = Scratch::new().map_err(strandlight_formats::Error::from)?;
            let scene = scratch.join("scene.toml");
            session.edit("picture", |scene| {
                scene.camera = Some(view);
                scene.render.size = still.size;
            })?;
            // Files that are in memory only stay there.
            session.save_copy(&scene)?;
            let mut arguments = vec!["render".into(), scene.into_os_string()];
            arguments.extend(["--time".into(), seconds.to_string().into()]);
            arguments.extend(["--backend".into(), backend.into()]);
            if still.is_layered() {
                arguments.extend(["--aov".into(), "modes,terms,data".into()]);
            }
            let is_picture = files.len() == 1;
            let out = match is_picture {
                true => path.clone(),
                false => scratch.join("frames"),
            };
            arguments.extend(["-o".into(), out.clone().into_os_string()]);
            if !is_picture {
                let edits = scratch.join("turntable.json");
                let script = turntable(&Script::turntable(&session.camera(), still.frames), &files);
                std::fs::write(&edits, script.to_string())
                    .map_err(strandlight_formats::Error::from)?;
                arguments.extend(["--script".into(), edits.into_os_string()]);
            }
            work.strandlight(&format!("rendering {}", name_of(&path)), arguments)?;
            if !is_picture {
                put(work, &out, &files)?;
            }
            Ok(JobResult::Pictures(files))
        }));
    }

    /// A page has no other program to draw it.
    #[cfg(target_arch = "wasm32")]
    pub(super) fn write_still(&mut self, _: Box<Still>, _: bool) {
        self.screenshot();
    }
}

/// A script as a file, its frames with the names of [`frame_name`].
#[cfg(not(target_arch = "wasm32"))]
fn turntable(script: &Script, files: &[PathBuf]) -> Value {
    let mut files = files.iter().enumerate();
    let steps = script.steps.iter().filter_map(|step| match step {
        Step::Set(values) => Some(json!({ "set": values })),
        Step::Frame(_) => {
            let (ix, file) = files.next()?;
            Some(json!({ "frame": frame_name(ix, file) }))
        }
        _ => None,
    });
    steps.collect()
}

/// The name of a frame until it is moved to `file`, whose own name may be one that scripts do not take.
#[cfg(not(target_arch = "wasm32"))]
fn frame_name(ix: usize, file: &Path) -> String {
    match file.extension() {
        Some(extension) => format!("{ix:04}.{}", extension.to_string_lossy()),
        None => format!("{ix:04}"),
    }
}

/// Moves frames out of `folder`, all of which are there, to where they were asked for.
#[cfg(not(target_arch = "wasm32"))]
fn put(work: &Work, folder: &Path, files: &[PathBuf]) -> Result<(), CannotOpen> {
    let named = |path: &Path, error| strandlight_formats::Error::from(error).in_file(path);
    for (ix, file) in files.iter().enumerate() {
        work.check()?;
        let frame = folder.join(frame_name(ix, file));
        let bytes = std::fs::read(&frame).map_err(|error| named(&frame, error))?;
        strandlight_formats::write_file(file, &bytes).map_err(|error| named(file, error))?;
    }
    Ok(())
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn a_turntable_may_have_a_name_that_scripts_do_not_take() {
        let camera = strandlight_formats::CameraSection {
            position: [0.0, 0.0, 10.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            fov_deg: 30.0,
        };
        let long = format!("{}.0001.PNG", "x".repeat(200));
        let files = ["a/Zöpfe und mehr.0000.png", &long].map(PathBuf::from);
        let script = turntable(&Script::turntable(&camera, 2), &files);
        let read = Script::from_json(&script.to_string()).expect("a script");
        let names: Vec<&str> = read.frames().map(|frame| frame.name.as_str()).collect();
        assert_eq!(names, ["0000.png", "0001.PNG"]);
        assert_eq!(read.steps.len(), 4);
    }
}
