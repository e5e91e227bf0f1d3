//! `strandview`: renders one frame of a scene without a window.
//!
//! Exit codes: 0 done; 2 bad usage or bad input.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use strandlight_formats::Scene;
use strandlight_runtime::gpu::Context;
use strandlight_runtime::render::{check_frame, whole_passes};
use strandlight_runtime::{PreparedScene, Renderer};

const USAGE: &str = "usage: strandview SCENE.toml --frame OUT.png [--size WxH] [--samples N]";

#[derive(Default)]
struct Args {
    scene: PathBuf,
    frame: Option<PathBuf>,
    size: Option<[u32; 2]>,
    samples: Option<u32>,
}

fn main() -> ExitCode {
    let mut words = std::env::args_os().skip(1).peekable();
    if words
        .peek()
        .is_some_and(|word| word == "--help" || word == "-h")
    {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    if words
        .peek()
        .is_some_and(|word| word == "--version" || word == "-V")
    {
        println!("strandview {}", env!("CARGO_PKG_VERSION"));
        return ExitCode::SUCCESS;
    }
    match parse(words).and_then(|args| run(&args)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            let lines: Vec<&str> = message.lines().map(str::trim).collect();
            let _ = writeln!(std::io::stderr(), "strandview: {}", lines.join(" "));
            ExitCode::from(2)
        }
    }
}

fn parse(mut words: impl Iterator<Item = std::ffi::OsString>) -> Result<Args, String> {
    let mut args = Args::default();
    let mut scene = None;
    while let Some(word) = words.next() {
        let text = word.to_string_lossy().into_owned();
        let mut value = || {
            let value = words
                .next()
                .ok_or(format!("{text} needs a value; {USAGE}"))?;
            value
                .to_str()
                .map(str::to_owned)
                .ok_or(format!("{text}: the value is not UTF-8"))
        };
        match text.as_str() {
            "--frame" => args.frame = Some(PathBuf::from(value()?)),
            "--size" => args.size = Some(parse_size(&value()?)?),
            "--samples" => {
                let text = value()?;
                let samples = text.parse().ok().filter(|n| (1..=65_536).contains(n));
                args.samples = Some(samples.ok_or(format!("--samples {text}: must be 1..=65536"))?);
            }
            _ if text.starts_with('-') => return Err(format!("unknown option {text}; {USAGE}")),
            _ if scene.is_none() => scene = Some(PathBuf::from(&word)),
            _ => return Err(format!("unexpected argument {text}; {USAGE}")),
        }
    }
    args.scene = scene.ok_or(USAGE)?;
    Ok(args)
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let size = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]))
        .ok_or(format!("--size {text}: a size is two numbers like 720x480"))?;
    check_frame(size, 4).map_err(|error| error.to_string())?;
    Ok(size)
}

fn run(args: &Args) -> Result<(), String> {
    let Some(frame) = &args.frame else {
        return Err("this build has no window yet; render one frame with --frame OUT.png".into());
    };
    let is_png = frame
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    if !is_png {
        return Err(format!("{}: the name must end in .png", frame.display()));
    }
    strandlight_formats::check_writable(frame)
        .map_err(|error| format!("{}: cannot be written: {error}", frame.display()))?;
    render(args, frame).map_err(|error| error.to_string())
}

fn render(args: &Args, frame: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::read(&args.scene)?;
    let size = args.size.unwrap_or(scene.render.size);
    let samples = whole_passes(args.samples.unwrap_or(scene.render.samples));
    check_frame(size, samples)?;
    let prepared = PreparedScene::load(&scene)?;
    let context = Context::new()?;
    let renderer = Renderer::new(&context, &prepared)?;
    let (picture, stats) = renderer.render(&prepared.camera, size, samples)?;
    let _ = writeln!(std::io::stderr(), "{stats}");
    let png = picture.to_png(prepared.exposure, prepared.tone_map)?;
    strandlight_formats::write_file(frame, &png)
        .map_err(|error| format!("{}: cannot be written: {error}", frame.display()))?;
    println!(
        "{}: {}x{}, {samples} samples",
        frame.display(),
        size[0],
        size[1]
    );
    Ok(())
}
