//! `strandlight render --converge`: a picture that goes on to the truth.

use std::cell::Cell;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use strandlight_formats::{Background, Scene, counted};
use strandlight_images::exr_file::{self, floats};
use strandlight_reference::converge::{Converged, Convergence, TILE, next_step};
use strandlight_reference::{MAX_TRUTH_SAMPLES, TracedScene};
use strandlight_scene::files::Files;
use strandlight_scene::provenance::{Provenance, Recorder};
use strandlight_scene::{PreparedScene, SceneError};

use super::args::{Args, Format};
use super::report::{inputs, report};
use super::until::Until;
use crate::cli::light::{environment_of, map_of};
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, note, print_line, write_output};

/// Most pixels: some 300 bytes are kept of each.
const MAX_PIXELS: u64 = 1 << 24;

/// Samples that are taken before the error is looked at take at most this long, or as long as looking.
const LONGEST: Duration = Duration::from_secs(5);

/// Renders `scene` at `size` to the output.
pub fn run(args: &Args, scene: &Scene, format: Format, size: [u32; 2]) -> Outcome {
    if u64::from(size[0]) * u64::from(size[1]) > MAX_PIXELS {
        let text = format!(
            "--converge draws at most {MAX_PIXELS} pixels; {}x{} is more",
            size[0], size[1]
        );
        return Err(Failure::file(&args.scene, text));
    }
    let start = Instant::now();
    let in_scene = |error: SceneError| Failure::input(error.in_file(&args.scene));
    let prepared = PreparedScene::load_at(scene, args.time).map_err(in_scene)?;
    let provenance = Recorder::new(&Files::Disk).record(scene, args.time);
    let mut provenance = provenance.map_err(in_scene)?;
    let map = map_of(args.map.as_deref(), (&args.scene, scene))?;
    if let Some(map) = &map {
        provenance = provenance.with("map", &map.source().hash);
    }
    let environment = environment_of(map.as_ref(), scene, &prepared);
    // What is behind the hair comes last.
    let mut over_nothing = prepared.clone();
    over_nothing.background = Background::None;
    let samples = scene.render.samples;
    let (drawn, traced) = std::thread::scope(|scope| {
        // One thread makes the hierarchies while the picture leaves it some time.
        let traced = scope.spawn(|| TracedScene::new(&prepared));
        let drawn = args.on_backend(|open| {
            let mut backend = open(over_nothing.clone())?;
            backend.shade_view_only();
            backend.render(size, samples, &|_| ())
        });
        let traced = traced.join();
        let traced = traced.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (drawn, traced)
    });
    let (fast, stats) = drawn?;
    let traced = traced.map_err(|error| Failure::file(&args.scene, error))?;
    let tracer = traced.tracer(&environment);
    let tracer = tracer.with_scattering(prepared.scattering());
    let mut convergence = Convergence::new(fast, &prepared, args.seed);
    let mut converged = pursue(args, start, &mut |n| {
        let start = Instant::now();
        convergence.trace(&prepared, &tracer, n);
        let traced = start.elapsed();
        let converged = convergence.converged();
        let of_one = traced.as_secs_f64() / f64::from(n);
        let of_picture = (start.elapsed() - traced).as_secs_f64();
        (converged, [of_one, of_picture])
    });
    if converged.relative_error.is_nan() {
        let what =
            "the light of the picture is beyond the range of its numbers; lower lights.intensity";
        return Err(Failure::file(&args.scene, what));
    }

    converged
        .picture
        .rgba
        .iter_mut()
        .for_each(make_compositable);
    let picture = &converged.picture;
    let until: Vec<String> = args.until.iter().map(Until::to_string).collect();
    let provenance = provenance
        .drawn(converged.samples, &stats.backend)
        .with("seed", args.seed)
        .with("until", until.join(", "))
        .with("relative_error", converged.relative_error);
    if args.stats {
        note!("{stats}");
    }
    let bytes = match format {
        Format::Png => picture
            .to_png_of(prepared.exposure, &prepared.display, &provenance)
            .map_err(Failure::input)?,
        Format::Exr => {
            exr_of(&converged, &provenance).map_err(|error| Failure::file(&args.output, error))?
        }
    };
    write_output(&args.output, &bytes)?;
    let seconds = start.elapsed().as_secs_f64();
    if args.json {
        let mut document = report(&args.output, picture, &stats);
        document["time"] = json!(args.time);
        document["inputs"] = inputs(&provenance);
        document["converge"] = converge_report(&converged, seconds);
        return print_line(document);
    }
    let of_fast = match converged.relative_error_of_fast {
        Some(error) => format!(" ({:.1} % without samples)", 100.0 * error),
        None => String::new(),
    };
    print_line(format_args!(
        "{}: {}x{}, {}, expected error {:.2} %{of_fast}, {seconds:.1} s, {} bytes",
        args.output.display(),
        size[0],
        size[1],
        counted(converged.samples, "sample", "samples"),
        100.0 * converged.relative_error,
        bytes.len()
    ))
}

/// Corrections may leave a pixel a little below black, or light where no hair covers it, which programs that divide by alpha
/// cannot take.
fn make_compositable(rgba: &mut [f32; 4]) {
    let alpha = rgba[3].clamp(0.0, 1.0);
    rgba[3] = alpha;
    for value in &mut rgba[..3] {
        *value = if alpha > 0.0 { value.max(0.0) } else { 0.0 };
    }
}

/// Takes samples by `trace`, which is told how many and answers what a sample and the picture take in
/// seconds as well, until a goal is reached.
fn pursue(
    args: &Args,
    start: Instant,
    trace: &mut dyn FnMut(u32) -> (Converged, [f64; 2]),
) -> Converged {
    const STEPS: u64 = 1000;
    let progress = progress("converging", STEPS);
    let most = |goal: &Until| match goal {
        Until::Samples(samples) => *samples,
        _ => MAX_TRUTH_SAMPLES,
    };
    let most = args
        .until
        .iter()
        .map(most)
        .min()
        .unwrap_or(MAX_TRUTH_SAMPLES);
    // How far: the largest share of any goal.
    let first_error = Cell::new(None);
    let share = |converged: &Converged| {
        let first = first_error.get().unwrap_or(converged.relative_error);
        first_error.set(Some(first));
        let shares = args.until.iter().map(|goal| match goal {
            // Errors fall as the root of the samples at best.
            Until::Error(error) if converged.relative_error <= *error => 1.0,
            Until::Error(error) => {
                let left = (converged.relative_error / error).ln() / (first / error).ln();
                (1.0 - left).clamp(0.0, 0.999)
            }
            Until::Time(time) => start.elapsed().as_secs_f64() / time.as_secs_f64(),
            Until::Samples(samples) => f64::from(converged.samples) / f64::from(*samples),
        });
        shares.fold(0.0, f64::max)
    };
    let is_time = |goal: &Until| match goal {
        Until::Time(time) => Some(*time),
        _ => None,
    };
    let end = args.until.iter().filter_map(is_time).min();
    let is_error_wanted = args
        .until
        .iter()
        .any(|goal| matches!(goal, Until::Error(_)));
    let mut next = 2_u32;
    let mut told = 0.0;
    loop {
        let (converged, seconds) = trace(next);
        let done = share(&converged);
        progress.reach((done.min(1.0) * STEPS as f64) as u64);
        // Each time that the work has doubled.
        if f64::from(converged.samples) >= 2.0 * told {
            told = f64::from(converged.samples);
            progress.say(&format!(
                "{}, {:.1} s: expected error {:.2} %",
                counted(converged.samples, "sample", "samples"),
                start.elapsed().as_secs_f64(),
                100.0 * converged.relative_error
            ));
        }
        // Light that overflows stays so.
        let is_number = !converged.relative_error.is_nan();
        if done >= 1.0 || converged.samples >= most || !is_number {
            progress.finish();
            return converged;
        }
        let [of_one, of_picture] = seconds;
        let by_goal = match is_error_wanted {
            true => next_step(converged.samples, seconds, LONGEST),
            // Pictures before the last are only looked at.
            false => ((LONGEST.as_secs_f64() / of_one) as u32).clamp(1, converged.samples),
        };
        let by_time = end.map_or(f64::INFINITY, |end| {
            let left = end.saturating_sub(start.elapsed()).as_secs_f64();
            (left - of_picture) / of_one
        });
        // Better a little less than asked for than much more.
        if by_time < 0.5 {
            progress.finish();
            return converged;
        }
        next = by_goal
            .min(by_time.max(1.0) as u32)
            .min(most - converged.samples);
    }
}

/// What `--json` tells beyond any picture.
fn converge_report(converged: &Converged, seconds: f64) -> Value {
    json!({
        "samples": converged.samples,
        "relative_error": converged.relative_error,
        "relative_error_of_fast": converged.relative_error_of_fast,
        "seconds": seconds,
    })
}

/// The picture with its errors as layers.
fn exr_of(converged: &Converged, provenance: &Provenance) -> Result<Vec<u8>, exr::error::Error> {
    let picture = &converged.picture;
    let [width, height] = [picture.width as usize, picture.height as usize];
    let across = width.div_ceil(TILE as usize);
    let tile = |ix: usize| ix / width / TILE as usize * across + ix % width / TILE as usize;
    let mut channels = Vec::new();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let of_picture = picture.rgba.iter().map(|rgba| rgba[c]);
        channels.push(floats(name, of_picture.collect()));
        let of_pixels = converged.error.iter().map(|error| error[c]);
        channels.push(floats(format!("error.{name}"), of_pixels.collect()));
        let of_tiles = (0..width * height).map(|ix| converged.tile_error[tile(ix)][c]);
        channels.push(floats(format!("tile_error.{name}"), of_tiles.collect()));
    }
    let alpha = picture.rgba.iter().map(|rgba| rgba[3]);
    channels.push(floats("A", alpha.collect()));
    exr_file::encode((width, height), channels, provenance.entries())
}
