//! `strandlight render --script` and `--turntable`: many frames of one scene, or a shard of them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;
use strandlight_images::picture::exr_file_of;
use strandlight_runtime::script::{self, Frame, Script, Stopped};
use strandlight_runtime::timings::{FrameTiming, Timings};
use strandlight_runtime::{ScriptError, Session, Viewer};
use strandlight_scene::files::Files;
use strandlight_scene::provenance::Recorder;
use strandlight_scene::stats::FrameStats;
use strandlight_scene::{Backend, Picture};

use super::args::{Args, Format, format_of};
use crate::cli::shard::Shard;
use crate::cli::{
    Failure, Outcome, check_not_of_scene, check_outputs, groom, note, output_folder, print_line,
    write_output,
};

/// Renders the frames that the command line asks for into the folder that is the output.
pub fn run(args: &Args) -> Outcome {
    let start = Instant::now();
    let mut session = Session::open(&args.scene).map_err(Failure::input)?;
    session
        .apply_cli_overrides(&args.keys())
        .map_err(Failure::input)?;
    let script = match (&args.script, args.turntable) {
        (Some(path), _) => read(path)?,
        (None, Some(n)) => Script::turntable(&session.camera(), n),
        (None, None) => Script::default(),
    };
    for frame in script.frames() {
        format_of(&file_of(frame))?;
    }
    let in_script = |error: ScriptError| match &args.script {
        Some(path) => Failure::file(path, error),
        None => Failure::input(error),
    };
    script.check(&session).map_err(in_script)?;
    let folder = &args.output;
    let is_picture = folder != Path::new("-") && format_of(folder).is_ok();
    if is_picture && !folder.is_dir() {
        let text = "has the ending of a picture, and many frames are written; name a folder";
        return Err(Failure::file(folder, text));
    }
    let shard = args.shard.shard;
    let mut new = output_folder(folder)?;
    if shard.is_some() {
        // Another shard may be about to write there, even if this one fails.
        new.keep();
    }
    let times = folder.join(timings_file(shard));
    let shard = shard.unwrap_or(Shard::WHOLE);
    let frames = script.frames().enumerate();
    let frames = frames.filter(|(ix, _)| shard.has(*ix));
    let mut outputs: Vec<PathBuf> = frames
        .map(|(_, frame)| folder.join(file_of(frame)))
        .collect();
    outputs.push(times.clone());
    let outputs: Vec<&Path> = outputs.iter().map(PathBuf::as_path).collect();
    let inputs: Vec<&Path> = [Some(&args.scene), args.script.as_ref()]
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    check_outputs(&inputs, &outputs)?;
    check_not_of_scene(session.scene(), &outputs)?;
    groom::note_doubts(session.scene());
    let out = Out {
        folder,
        with_stats: args.stats,
        recorder: Recorder::new(session.files()),
        timings: Timings::default(),
    };
    let viewer = args.on_backend(|open| {
        let mut viewer = Viewer::on(session.clone(), open)?;
        viewer.set_time(args.time)?;
        Ok(viewer)
    })?;
    let opened = 1e3 * start.elapsed().as_secs_f64();
    let backend = viewer.renderer().name();
    let timings = draw(viewer, &script, shard, out).map_err(|stopped| match stopped {
        Stopped::Script(error) => in_script(error),
        Stopped::Frame(failure) => failure,
    })?;
    let mut document = timings.document(&args.scene.display().to_string(), &backend, opened);
    if let Some(shard) = args.shard.shard {
        document["shard"] = json!(shard.to_string());
    }
    let path = times;
    let text = serde_json::to_string_pretty(&document).map_err(Failure::input)? + "\n";
    write_output(&path, text.as_bytes())?;
    if args.json {
        print_line(document)
    } else {
        print_line(timings.line_about(&path))
    }
}

/// The times of a shard have a name of their own: several are written into one folder at a time.
fn timings_file(shard: Option<Shard>) -> String {
    match shard {
        None => "timings.json".to_owned(),
        Some(shard) => format!("timings-{}-of-{}.json", shard.index(), shard.count()),
    }
}

fn read(path: &Path) -> Result<Script, Failure> {
    let bytes = Files::Disk
        .read(path, script::MAX_BYTES)
        .map_err(Failure::input)?;
    Script::from_bytes(&bytes).map_err(|error| Failure::file(path, error))
}

/// OpenEXR unless the frame's name says otherwise.
fn file_of(frame: &Frame) -> PathBuf {
    let name = Path::new(&frame.name);
    let is_known = ["exr", "png"].into_iter().any(|known| {
        name.extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case(known))
    });
    match is_known {
        true => name.to_owned(),
        false => format!("{}.exr", frame.name).into(),
    }
}

/// Where frames go.
struct Out<'a> {
    folder: &'a Path,
    with_stats: bool,
    recorder: Recorder,
    timings: Timings,
}

impl Out<'_> {
    /// Writes one frame and notes what it took.
    fn write(
        &mut self,
        viewer: &Viewer<dyn Backend>,
        picture: &Picture,
        frame: FrameTiming,
    ) -> Result<(), Failure> {
        let path = self.folder.join(&frame.file);
        let provenance = self.recorder.record_frame(
            viewer.session().scene(),
            viewer.session().own_paint(),
            frame.time,
            frame.size,
            [frame.samples, frame.stats.samples],
            &viewer.renderer().name(),
        );
        let provenance = provenance.map_err(Failure::input)?;
        let scene = viewer.prepared();
        let bytes = match format_of(&path)? {
            Format::Png => picture
                .to_png_of(scene.exposure, &scene.display, &provenance)
                .map_err(Failure::input)?,
            Format::Exr => {
                exr_file_of(picture, &provenance).map_err(|error| Failure::file(&path, error))?
            }
        };
        write_output(&path, &bytes)?;
        note!(
            "{}: {}x{}, {}",
            path.display(),
            picture.width,
            picture.height,
            frame.stats.visibility()
        );
        if self.with_stats {
            note!("{}", FrameStats(&frame.stats));
        }
        self.timings.push(frame);
        Ok(())
    }
}

/// Draws the frames of `shard`; what the steps before a frame edit is edited for all of them. An
/// edit recomputes what depends on it.
fn draw(
    mut viewer: Viewer<dyn Backend>,
    script: &Script,
    shard: Shard,
    mut out: Out,
) -> Result<Timings, Stopped<Failure>> {
    let mut numbers = 0..;
    script.run(&mut viewer, |viewer, frame| {
        if !numbers.next().is_some_and(|number| shard.has(number)) {
            return Ok(());
        }
        let file = file_of(frame).display().to_string();
        let (picture, timing) = FrameTiming::draw(viewer, frame, file).map_err(Failure::input)?;
        out.write(viewer, &picture, timing)
    })?;
    Ok(out.timings)
}
