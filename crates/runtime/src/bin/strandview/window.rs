//! The window, or what is said where there is none.

use crate::args::Args;

/// Tells that there is no window in this build.
///
/// # Errors
/// Always.
#[cfg(not(feature = "ui"))]
pub fn run(args: &Args) -> Result<(), String> {
    let _ = (&args.log, args.loses_device, args.time, args.quiet);
    Err("this build has no window; render one frame with --frame OUT.png".into())
}

/// Opens the scene in a window and returns when it is closed.
///
/// # Errors
/// One line that says why it could not be opened.
#[cfg(feature = "ui")]
pub fn run(args: &Args) -> Result<(), String> {
    use std::path::Path;

    use strandlight_formats::{Scene, TakenFiles, output_target};
    use strandlight_runtime::opening::{self, Openable, kind_of};
    use strandlight_runtime::ui::{EventLog, Launch, run, sample};
    use strandlight_runtime::work::Work;

    let start = web_time::Instant::now();
    let mut set = args.set.clone();
    // The size is that of the window; the scene keeps its own.
    let size = set.remove("render.size");
    let size = size.and_then(|size| serde_json::from_value(size).ok());
    // What is wrong with the scene's file is said before a window opens.
    let mut taken = TakenFiles::default();
    taken.add(&args.scene, "an input");
    if let Some(path) = &args.scene
        && kind_of(path).map_err(|error| error.to_string())? == Openable::Scene
    {
        let scene = Scene::read(path).map_err(|error| error.to_string())?;
        taken.add(scene.file_paths(), "a file of the scene");
    }
    let path = args.scene.clone();
    let name = match path.as_deref().and_then(Path::file_name) {
        Some(name) => name.to_string_lossy().into_owned(),
        None => "the sample".to_owned(),
    };
    let open = move |work: &Work| {
        let mut session = match &path {
            Some(path) => opening::open(path, work)?,
            None => sample(work)?,
        };
        session.apply_cli_overrides(&set)?;
        Ok(session)
    };
    let log = match &args.log {
        Some(path) => {
            let cannot = |error| format!("{}: cannot be written: {error}", path.display());
            let target = output_target(path).map_err(cannot)?;
            if let Some(what) = taken.refusal(&target) {
                return Err(format!("{}: {what}", path.display()));
            }
            EventLog::to_file(start, path).map_err(cannot)?
        }
        None => EventLog::silent(start),
    };
    let launch = Launch {
        open: Box::new(open),
        name,
        choice: args.backend,
        size,
        seconds: args.time,
        log,
        loses_device: args.loses_device,
    };
    run(launch).map_err(|error| error.to_string())
}
