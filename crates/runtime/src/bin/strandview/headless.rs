//! Frames without a window, by the same viewer that the window drives.

use std::collections::BTreeSet;
use std::error::Error;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use strandlight_formats::{OutputTarget, TakenFiles, check_writable, output_target, write_file};
use strandlight_render::gpu::Context;
use strandlight_runtime::script::{self, Frame, Script, Stopped};
use strandlight_runtime::timings::{FrameTiming, Timings};
use strandlight_runtime::work::NewFolders;
use strandlight_runtime::{CpuReason, ScriptError, Session, Viewer};
use strandlight_scene::provenance::{Provenance, Recorder};
use strandlight_scene::stats::FrameStats;
use strandlight_scene::{Picture, RenderError, SceneError, Stats, files};
use web_time::Instant;

use crate::args::{Args, Job};
use crate::output::say;

type Answer<T> = Result<T, Box<dyn Error>>;

/// Does a job that is not a window's.
pub fn run(args: &Args) -> Answer<()> {
    match (&args.job, &args.output) {
        (Job::Frame(path), _) => one(args, path),
        (Job::Turntable(n), Some(out)) => {
            let session = open(args)?;
            let script = Script::turntable(&session.camera(), *n);
            many(args, session, &script, out)
        }
        (Job::Script(path), Some(out)) => {
            let bytes = files::Files::Disk.read(path, script::MAX_BYTES)?;
            let script = Script::from_bytes(&bytes);
            let script = script.map_err(|error| format!("{}: {error}", path.display()))?;
            many(args, open(args)?, &script, out)
        }
        _ => Err("nothing to do".into()),
    }
}

/// The scene: the command line has one where there is no window.
fn scene_of(args: &Args) -> &Path {
    args.scene.as_deref().unwrap_or(Path::new(""))
}

fn open(args: &Args) -> Answer<Session> {
    let mut session = Session::open(scene_of(args))?;
    session.apply_cli_overrides(&args.set)?;
    Ok(session)
}

/// Puts the scene on the renderer that was chosen; says why if that is the CPU for want of a GPU.
fn viewer(args: &Args, session: Session) -> Answer<Viewer> {
    let chosen = args.backend.decide(Context::new)?;
    let mut viewer = Viewer::choose(args.backend, chosen, session)?;
    // As many as were asked for.
    viewer.draw_with_samples();
    if let (Some(CpuReason::Failed(reason)), false) = (viewer.cpu_reason(), args.quiet) {
        let _ = writeln!(std::io::stderr(), "rendering on the CPU: {reason}");
    }
    Ok(viewer)
}

fn one(args: &Args, path: &Path) -> Answer<()> {
    let named = |what: String| format!("{}: {what}", path.display());
    let target = check_writable(path);
    let is_stream = target.as_ref().is_ok_and(OutputTarget::is_stream);
    if !is_stream && !has_extension(path, "png") {
        return Err(named("the name must end in .png".to_owned()).into());
    }
    let target = target.map_err(|error| named(format!("cannot be written: {error}")))?;
    let mut taken = inputs_of(args);
    check_not_taken(&taken, path, &target)?;
    // What is wrong with the scene is said before a device is opened.
    let session = open(args)?;
    taken.add(session.scene().file_paths(), "a file of the scene");
    check_not_taken(&taken, path, &target)?;
    let mut recorder = Recorder::new(session.files());
    let mut viewer = viewer(args, session)?;
    viewer.set_time(args.time)?;
    let scene = viewer.session().scene();
    let (size, samples) = (scene.render.size, scene.render.samples);
    let start = Instant::now();
    let (picture, stats) = viewer.frame(size, samples)?;
    let seconds = start.elapsed().as_secs_f64();
    if args.stats && !args.quiet {
        let _ = writeln!(std::io::stderr(), "{}", FrameStats(&stats));
    }
    let provenance = provenance(&mut recorder, &viewer, size, [samples, stats.samples])?;
    write(path, &png(&viewer, &picture, &provenance)?)?;
    match target {
        // It holds the picture.
        OutputTarget::Stdout => Ok(()),
        _ => Ok(say(line_about(path, &picture, &stats, seconds))?),
    }
}

/// The scene and the script.
fn inputs_of(args: &Args) -> TakenFiles {
    let script = match &args.job {
        Job::Script(script) => Some(&**script),
        _ => None,
    };
    let mut taken = TakenFiles::default();
    taken.add([scene_of(args)].into_iter().chain(script), "an input");
    taken
}

fn check_not_taken(taken: &TakenFiles, path: &Path, target: &OutputTarget) -> Answer<()> {
    match taken.refusal(target) {
        Some(what) => Err(format!("{}: {what}", path.display()).into()),
        None => Ok(()),
    }
}

fn many(args: &Args, session: Session, script: &Script, out: &Path) -> Answer<()> {
    let start = Instant::now();
    let mut files = BTreeSet::new();
    for frame in script.frames() {
        let file = file_of(frame)?;
        if !files.insert(file.clone()) {
            return Err(format!("frame {}: a second {}", frame.name, file.display()).into());
        }
    }
    let in_script = |error: ScriptError| match &args.job {
        Job::Script(path) => format!("{}: {error}", path.display()),
        _ => error.to_string(),
    };
    script.check(&session).map_err(in_script)?;
    let _new = make_folder(out)?;
    let times = out.join("timings.json");
    check_writable(&times).map_err(|error| cannot_write(&times, &error))?;
    let mut taken = inputs_of(args);
    taken.add(session.scene().file_paths(), "a file of the scene");
    let outputs = files.iter().map(|file| out.join(file));
    for path in outputs.chain([times.clone()]) {
        let target = output_target(&path).map_err(|error| cannot_write(&path, &error))?;
        check_not_taken(&taken, &path, &target)?;
    }
    let mut viewer = viewer(args, session)?;
    viewer.set_time(args.time)?;
    let opened = 1e3 * start.elapsed().as_secs_f64();
    let mut recorder = Recorder::new(viewer.session().files());
    let mut timings = Timings::default();
    let write_frame = |viewer: &mut Viewer, frame: &Frame| -> Answer<()> {
        let file = file_of(frame)?;
        let path = out.join(&file);
        let (picture, timing) = FrameTiming::draw(viewer, frame, file.display().to_string())?;
        let samples = [timing.samples, timing.stats.samples];
        let provenance = provenance(&mut recorder, viewer, timing.size, samples)?;
        write(&path, &png(viewer, &picture, &provenance)?)?;
        let seconds = 1e-3 * timing.milliseconds;
        say(line_about(&path, &picture, &timing.stats, seconds))?;
        timings.push(timing);
        Ok(())
    };
    let done = script.run(&mut viewer, write_frame);
    done.map_err(|stopped| match stopped {
        Stopped::Script(error) => in_script(error).into(),
        Stopped::Frame(error) => error,
    })?;
    let backend = viewer.renderer().name();
    let document = timings.document(&scene_of(args).display().to_string(), &backend, opened);
    let text = serde_json::to_string_pretty(&document)? + "\n";
    write(&times, text.as_bytes())?;
    Ok(say(timings.line_about(&times))?)
}

/// A folder for the frames, made if it is not there.
fn make_folder(folder: &Path) -> Result<NewFolders, String> {
    if folder.metadata().is_ok_and(|data| !data.is_dir()) {
        let why = "is not a folder, and several files are written; name a folder";
        return Err(format!("{}: {why}", folder.display()));
    }
    NewFolders::make(folder)
        .map_err(|error| format!("{}: cannot be made: {error}", folder.display()))
}

/// What the frame of `viewer` is made from.
fn provenance(
    recorder: &mut Recorder,
    viewer: &Viewer,
    size: [u32; 2],
    samples: [u32; 2],
) -> Result<Provenance, SceneError> {
    let backend = viewer.renderer().name();
    let session = viewer.session();
    let paint = session.own_paint();
    recorder.record_frame(
        session.scene(),
        paint,
        viewer.time(),
        size,
        samples,
        &backend,
    )
}

/// File that a frame is written to.
fn file_of(frame: &Frame) -> Result<PathBuf, String> {
    let name = Path::new(&frame.name);
    if has_extension(name, "exr") {
        let name = &frame.name;
        return Err(format!(
            "frame {name}: OpenEXR is written by strandlight render --script"
        ));
    }
    match has_extension(name, "png") {
        true => Ok(name.to_owned()),
        false => Ok(format!("{}.png", frame.name).into()),
    }
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

fn png(
    viewer: &Viewer,
    picture: &Picture,
    provenance: &Provenance,
) -> Result<Vec<u8>, RenderError> {
    let exposure = viewer.session().scene().render.exposure as f32;
    picture.to_png_of(exposure, &viewer.prepared().display, provenance)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
    write_file(path, bytes).map_err(|error| cannot_write(path, &error))
}

fn cannot_write(path: &Path, error: &io::Error) -> String {
    format!("{}: cannot be written: {error}", path.display())
}

fn line_about(path: &Path, picture: &Picture, stats: &Stats, seconds: f64) -> String {
    let (width, height) = (picture.width, picture.height);
    let visibility = stats.visibility();
    let path = path.display();
    format!("{path}: {width}x{height}, {visibility}, {seconds:.2} s")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_go_to_a_folder_that_is_made_and_to_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        drop(make_folder(&at("a/b")).expect("made"));
        assert!(!at("a").exists(), "nothing was written there");
        for _ in 0..2 {
            let _new = make_folder(&at("a/b")).expect("made");
            std::fs::write(at("a/b/0.png"), "").expect("written");
        }
        assert!(at("a/b/0.png").exists());
        std::fs::write(at("text.txt"), "").expect("written");
        let refused = make_folder(&at("text.txt")).expect_err("a file");
        assert!(refused.contains("text.txt: is not a folder"), "{refused}");
        let below = make_folder(&at("text.txt/b")).expect_err("below a file");
        assert!(below.contains("cannot be made"), "{below}");
    }
}
