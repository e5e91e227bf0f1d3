//! `strandlight bench growth`.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandlight_bake::grooms::{GrowSpec, MAX_GENERATED_POINTS, generate};
use strandlight_bake::lights::{FitOptions, MAX_FITTED_LIGHTS, STEPS, fit};
use strandlight_bake::scenes::{PaperScene, SCENES};
use strandlight_formats::{BakedFile, LightSet, Scene, SrbfLight};
use strandlight_images::Map;
use strandlight_lab::bench::cpu_frames::{PictureCost, edit_costs, n_edit_pictures};
use strandlight_lab::bench::growth::{FRAMES, Growth, Row, Sweep};
use strandlight_runtime::options::parse_size;
use strandlight_scene::PreparedScene;
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::budget::{MAX_TARGET_SIDE, check_target};
use strandlight_scene::files::Files;
use strandlight_scene::progress::Progress;

use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_extension, check_outputs, print_line, write_output};

/// Height in pixels of the map that lights are fitted to.
const MAP_HEIGHT: usize = 256;

/// Points of each strand, as the scenes for accuracy have them.
const POINTS_PER_STRAND: u32 = 50;

/// Measure how the time of a frame grows with points, lights and pixels
///
/// Complete pictures on the CPU after an edit of the hair's colour and after a turn of the view, of
/// the generated scene `animation` with other numbers of points, lights and pixels: one of the three
/// varies, the others stay at the middle value of their lists. Prints times, counts, and the slope of
/// each curve in log-log (1: linear).
#[derive(clap::Args)]
pub struct Args {
    /// Numbers of points, each in strands of 50, comma-separated
    #[arg(long, value_name = "N", value_delimiter = ',',
        default_value = "50000,150000,500000,1500000,5000000",
        value_parser = clap::value_parser!(u32).range(100..=MAX_GENERATED_POINTS as i64))]
    points: Vec<u32>,
    #[arg(long, value_name = "N", value_delimiter = ',',
        default_value = "5,10,20,40,80,160",
        value_parser = clap::value_parser!(u16).range(1..=MAX_FITTED_LIGHTS as i64),
        help = format!("Numbers of lights, each 1..={MAX_FITTED_LIGHTS}, comma-separated"))]
    lights: Vec<u16>,
    #[arg(long, value_name = "WxH", value_delimiter = ',', value_parser = parse_size,
        default_value = "240x160,480x320,720x480,1440x960,3840x2160",
        help = format!("Widths and heights in pixels, each 1..={MAX_TARGET_SIDE}, comma-separated"))]
    sizes: Vec<[u32; 2]>,
    /// Rounds of two frames of each kind, after one warm-up round
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
    /// Draw the curves as SVG
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    for &size in &args.sizes {
        check_target(size).map_err(Failure::input)?;
    }
    if let Some(svg) = &args.svg {
        check_extension(svg, "svg")?;
        check_outputs(&[], &[svg])?;
    }
    let [points, lights, sizes] = [args.points.len(), args.lights.len(), args.sizes.len()];
    let measured = (points + lights + sizes) as u64 * FRAMES.len() as u64;
    let progress = progress("frames", measured * n_edit_pictures(args.repetitions));
    let (sweeps, ended) = sweeps(args, &progress);
    progress.finish();
    if sweeps.is_empty() {
        return ended;
    }
    let growth = Growth { sweeps };
    if args.json {
        let mut document = growth.to_json();
        document["repetitions"] = json!(args.repetitions);
        document["svg"] = svg_name(args);
        print_line(document)?;
    } else {
        print_growth(&growth)?;
    }
    if let Some(svg) = &args.svg {
        write_output(svg, growth.figure().to_svg().as_bytes())?;
        if !args.json {
            print_line(format_args!("wrote {}", svg.display()))?;
        }
    }
    ended
}

fn svg_name(args: &Args) -> Value {
    let svg = args.svg.as_ref();
    json!(svg.map(|svg| svg.display().to_string()))
}

/// The middle of a list, the upper one of two.
fn middle<T: Copy + Ord>(values: &[T]) -> T {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    sorted[sorted.len() / 2]
}

fn pixels([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

/// Measures all three sweeps, or what there is of them until something fails; sweeps without a row are
/// left out.
fn sweeps(args: &Args, progress: &Progress) -> (Vec<Sweep>, Outcome) {
    let names = ["points", "lights", "pixels"];
    let mut rows = [Vec::new(), Vec::new(), Vec::new()];
    let ended = grow(args, progress, &mut rows);
    let sweeps = names.into_iter().zip(rows);
    let sweeps = sweeps.filter(|(_, rows)| !rows.is_empty());
    let sweeps = sweeps.map(|(name, rows)| Sweep::new(name, rows));
    (sweeps.collect(), ended)
}

/// Rows over points, lights and pixels, each put where it belongs as soon as it is measured.
fn grow(args: &Args, progress: &Progress, rows: &mut [Vec<Row>; 3]) -> Outcome {
    let [over_points, over_lights, over_sizes] = rows;
    let maker = Maker::new()?;
    let base_points = middle(&args.points);
    let base_lights = middle(&args.lights);
    let mut sizes = args.sizes.clone();
    sizes.sort_by_key(|size| pixels(*size));
    let base_size = sizes[sizes.len() / 2];
    let lights = maker.lights(base_lights)?;
    let measure = |x: u64, scene: &PreparedScene| -> Result<Row, Failure> {
        let drawn = || progress.advance(1);
        let frames = edit_costs(scene, &FRAMES, args.repetitions, &drawn);
        let frames: Vec<PictureCost> = frames.map_err(Failure::input)?;
        Ok(Row { x, frames })
    };

    for &points in &args.points {
        let scene = maker.scene(points, &lights, base_size)?;
        over_points.push(measure(scene.strands.points.len() as u64, &scene)?);
    }
    let mut scene = maker.scene(base_points, &lights, base_size)?;
    for &size in &sizes {
        scene.size = size;
        over_sizes.push(measure(pixels(size), &scene)?);
    }
    for &count in &args.lights {
        let scene = maker.scene(base_points, &maker.lights(count)?, base_size)?;
        over_lights.push(measure(u64::from(count), &scene)?);
    }
    Ok(())
}

/// Makes scenes without files.
struct Maker {
    paper: &'static PaperScene,
    map: Map,
}

impl Maker {
    fn new() -> Result<Maker, Failure> {
        let paper = &SCENES[0];
        let bytes = paper.sky.exr_file(MAP_HEIGHT).map_err(Failure::input)?;
        let map = Map::decode(&bytes).map_err(Failure::input)?;
        Ok(Maker { paper, map })
    }

    fn lights(&self, count: u16) -> Result<Vec<SrbfLight>, Failure> {
        let options = FitOptions {
            count: usize::from(count),
            seed: 0,
        };
        let progress = progress("fitting lights", STEPS);
        let fitted = fit(&self.map, options, &progress);
        progress.finish();
        Ok(fitted.map_err(Failure::input)?.lights.lights)
    }

    fn scene(
        &self,
        points: u32,
        lights: &[SrbfLight],
        size: [u32; 2],
    ) -> Result<PreparedScene, Failure> {
        let spec = GrowSpec {
            strands: points / POINTS_PER_STRAND,
            points_per_strand: POINTS_PER_STRAND,
            ..self.paper.groom(1.0)
        };
        let groom = generate(&spec, &Progress::silent()).map_err(Failure::input)?;
        let lights = LightSet {
            lights: lights.to_vec(),
            ..LightSet::default()
        };
        let name = |extension: &str| Path::new(self.paper.name).with_extension(extension);
        let files = Files::in_memory([
            (name("groom"), groom.to_bytes().map_err(Failure::input)?),
            (name("lights"), lights.to_bytes().map_err(Failure::input)?),
        ]);
        let scene = Scene::from_toml(&self.paper.toml()).map_err(Failure::input)?;
        let assets = Assets::read(&scene, &files, ModesToRead::OfScene).map_err(Failure::input)?;
        let mut scene = PreparedScene::new(&scene, &assets).map_err(Failure::input)?;
        scene.size = size;
        Ok(scene)
    }
}

fn print_growth(growth: &Growth) -> Outcome {
    for sweep in &growth.sweeps {
        for (ix, name) in FRAMES.iter().enumerate() {
            print_line(format_args!(
                "{:>9}  {:20} {:>9} {:>8} {:>9} {:>12} {:>9}",
                sweep.name, name, "ms", "core-s", "points", "products", "entries"
            ))?;
            for row in &sweep.rows {
                let frame = &row.frames[ix];
                let seconds = frame.core_seconds;
                print_line(format_args!(
                    "{:9}  {:20} {:9.1} {:>8} {:9} {:12} {:9}",
                    row.x,
                    "",
                    frame.milliseconds,
                    seconds.map_or("-".to_owned(), |seconds| format!("{seconds:.3}")),
                    frame.stats.visible_points,
                    frame.stats.products()[0],
                    frame.stats.list_entries,
                ))?;
            }
            let shown =
                |slope: Option<f64>| slope.map_or("-".to_owned(), |slope| format!("{slope:.2}"));
            let slopes = sweep.slopes(ix);
            print_line(format_args!(
                "{:>9}  {:20} {:>9} {:>8}",
                "slope",
                "",
                shown(slopes.milliseconds),
                shown(slopes.core_seconds),
            ))?;
        }
    }
    Ok(())
}
