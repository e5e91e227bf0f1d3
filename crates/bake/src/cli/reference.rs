//! `strandlight reference` and `strandlight reference merge`: ground truth for a scene's picture.

mod merge;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::ValueEnum;
use serde_json::{Value, json};
use strandlight_formats::{LightsSection, Scattering, Scene, content_hash, counted};
use strandlight_images::Map;
use strandlight_reference::rays::Rays;
use strandlight_reference::{
    Averages, Backdrop, Densities, Directional, Environment, FibreTables, Film, Integrator,
    MAX_TRUTH_SAMPLES, MeshRays, Method, Painted, PathTracer, RayShoot, ReferenceFile,
    ReferencePart, samples_of_part, whole_samples,
};
use strandlight_runtime::options::{parse_key, parse_size, parse_time};
use strandlight_scattering::closed_form::PaintTexel;
use strandlight_scattering::dual_scattering::{
    AverageTable, DEFAULT_AVERAGE_LAYERS, DEFAULT_SCALES, PaintedAverageTable,
};
use strandlight_scattering::exact::Bcsdf;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::budget::check_target;
use strandlight_scene::files::Files;
use strandlight_scene::paint::{PaintKinds, PaintedPoint};
use strandlight_scene::provenance::{PANORAMA, Recorder};
use strandlight_scene::{PreparedScene, RenderError, memory};

use super::{
    Failure, Outcome, check_extension, check_not_of_scene, check_outputs, is_stream, note,
    print_line, write_output,
};
use crate::cli::light::{environment_of, map_of};
use crate::cli::overrides::scene_with;
use crate::cli::progress::progress;
use crate::cli::shard::{self, Shard};

/// Render ground truth for a scene, slowly, on the CPU
///
/// Writes linear OpenEXR: R, G, B, A over the scene's background as `render` does; layers single,
/// global, local and total of the hair alone; layer proxies of the proxies; the variance of each
/// pixel's mean. With --shard I/N, a part of the samples, for `reference merge`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    trace: Option<TraceArgs>,
}

#[derive(clap::Subcommand)]
enum Command {
    Merge(merge::Args),
}

#[derive(clap::Args)]
struct TraceArgs {
    /// Scene file (TOML)
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// Integrator
    #[arg(long, value_enum)]
    method: MethodName,
    /// OpenEXR file to write, - for standard output
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Override a key of the scene file, as `render` does; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_key)]
    set: Vec<(String, Value)>,
    /// Samples per pixel; with --resume, samples to add; with --shard, those of all shards together
    #[arg(long, visible_alias = "spp", value_name = "N", default_value_t = 64,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_TRUTH_SAMPLES)))]
    samples: u32,
    /// directional: number of lights [default: 1536]; ray-shoot: light directions sampled per
    /// camera sample [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    lights: Option<u32>,
    /// Width and height in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    #[arg(long, value_name = "SECONDS", value_parser = parse_time, default_value_t = 0.0,
        help = super::render::time_help())]
    time: f64,
    /// Random seed
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Light the scene with this OpenEXR or Radiance map, rotated and scaled as in the scene
    /// [default: the scene's lights.map; the light set where it has none, or with lights.map=null
    /// in --set]
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// ray-shoot: forward scattering density d_f, 0 to 1 [default: the scene's]
    #[arg(long, value_name = "X", value_parser = parse_share)]
    density_forward: Option<f64>,
    /// ray-shoot: backward scattering density d_b, 0 to 1 [default: the scene's]
    #[arg(long, value_name = "X", value_parser = parse_share)]
    density_back: Option<f64>,
    /// path: normalize the scattering function by the albedo of the same fibre without absorption
    /// (the exact one loses about 6 % of the energy per event, and gains near grazing)
    #[arg(long)]
    energy_safe: bool,
    /// Add samples to an existing OUT.exr of the same inputs and seed; the result equals one run
    /// with all samples
    #[arg(long, conflicts_with = "shard")]
    resume: bool,
    #[arg(long, value_name = "I/N", value_parser = shard::parse_shard, help = shard::HELP)]
    shard: Option<Shard>,
    /// Print a JSON document about the picture instead of text
    #[arg(long)]
    json: bool,
}

/// Names of the methods.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum MethodName {
    /// Unbiased path tracing
    Path,
    /// Zinke's offline dual scattering
    RayShoot,
    /// Single scattering of many directional lights
    Directional,
}

impl MethodName {
    fn method(self) -> Method {
        match self {
            MethodName::Path => Method::Path,
            MethodName::RayShoot => Method::RayShoot,
            MethodName::Directional => Method::Directional,
        }
    }
}

fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("not a number from 0 to 1".to_owned()),
    }
}

impl TraceArgs {
    /// Are fibres normalized? Other methods take no notice of the flag.
    fn is_energy_safe(&self) -> bool {
        self.energy_safe && self.method == MethodName::Path
    }

    /// Those of the picture that are taken.
    fn samples(&self) -> Range<u32> {
        match self.shard {
            Some(shard) => samples_of_part(shard.index(), shard.count(), self.samples),
            None => 0..self.samples,
        }
    }

    /// Says which flags the method takes no notice of.
    fn note_ignored(&self) {
        use MethodName::{Directional, Path, RayShoot};
        let flags = [
            (
                "--lights",
                self.lights.is_some(),
                &[Directional, RayShoot][..],
            ),
            (
                "--density-forward",
                self.density_forward.is_some(),
                &[RayShoot],
            ),
            ("--density-back", self.density_back.is_some(), &[RayShoot]),
            ("--energy-safe", self.energy_safe, &[Path]),
        ];
        for (flag, is_given, methods) in flags {
            if is_given && !methods.contains(&self.method) {
                let method = self.method.method().name();
                note!("{flag} has no effect with --method {method}");
            }
        }
    }
}

/// Why there is no energy-safe picture of `scene`, if its hair has paint of such kinds: what is painted, or what
/// varies, by which fibres differ in what they lose.
fn energy_safe_fault(scene: &Scene, kinds: PaintKinds) -> Option<String> {
    let what = match kinds {
        _ if scene.variation.varies_widths() => {
            "widths vary (variation.roughness_strand, variation.roughness_lock)"
        }
        PaintKinds { widths: true, .. } | PaintKinds { shifts: true, .. } => {
            "the groom is painted with widths or shifts"
        }
        _ => return None,
    };
    let text =
        format!("--energy-safe: {what}, whose fibres differ in what they lose; leave it out");
    Some(text)
}

/// What an energy-safe fibre of `hair` is measured by: it loses nothing by absorption, and no light is left out.
fn white_of(hair: &HairParams) -> HairParams {
    HairParams {
        sigma_a: [0.0; 3],
        intensity: HairParams::default().intensity,
        ..*hair
    }
}

/// Refuses sums of samples that would not fit in the memory there is, and names a number that takes less.
fn check_memory(
    size: [u32; 2],
    samples: Range<u32>,
    has_proxies: bool,
    available: Option<u64>,
) -> Result<(), RenderError> {
    let bytes = ReferenceFile::peak_bytes(size, samples.clone(), has_proxies);
    let Some(limit) = available.filter(|&available| bytes > available) else {
        return Ok(());
    };
    let n = samples.end;
    let whole = whole_samples(n);
    let instead = match samples.start {
        0 if whole != n => format!("; {whole} samples take less"),
        _ => String::new(),
    };
    let n = counted(n - samples.start, "sample", "samples");
    Err(RenderError::TooLarge {
        what: format!("{}x{} pixels of {n}{instead}", size[0], size[1]),
        bytes,
        limit,
    })
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match (&args.command, &args.trace) {
        (Some(Command::Merge(args)), _) => merge::run(args),
        (None, Some(args)) => trace(args),
        // The parser asks for a scene or a subcommand.
        (None, None) => Ok(()),
    }
}

fn trace(args: &TraceArgs) -> Outcome {
    let start = Instant::now();
    args.note_ignored();
    let (scene, prepared) = load(args)?;
    let map = map_of(args.map.as_deref(), (&args.scene, &scene))?;
    let light = environment_of(map.as_ref(), &scene, &prepared);
    let settings = Settings::new(args, &prepared);
    let mut file = begin(args, &settings, map.as_ref(), (&scene, &prepared))?;
    expose(args, &settings, &light, &prepared, &mut file.film)?;
    let backdrop = Backdrop::of(&prepared, file.film.size());
    write(args, file, backdrop, start)
}

/// The scene as the flags have it, once nothing is wrong with them.
fn load(args: &TraceArgs) -> Result<(Scene, PreparedScene), Failure> {
    check_extension(&args.output, "exr")?;
    if args.resume && is_stream(&args.output) {
        let text = "--resume goes on with a file; name one that ends in .exr";
        return Err(Failure::file(&args.output, text));
    }
    let inputs: Vec<&Path> = std::iter::once(&args.scene)
        .chain(args.map.as_ref())
        .map(PathBuf::as_path)
        .collect();
    check_outputs(&inputs, &[&args.output])?;
    let mut scene = scene_with(&args.scene, &args.set)?;
    check_not_of_scene(&scene, &[&args.output])?;
    if scene.render.scattering != Scattering::Total {
        note!(
            "render.scattering has no effect: the picture has all light, the layers have its parts"
        );
    }
    let size = args.size.unwrap_or(scene.render.size);
    check_target(size).map_err(|error| Failure::file(&args.scene, error))?;
    scene.render.size = size;
    let prepared = PreparedScene::load_at(&scene, args.time)
        .map_err(|error| Failure::input(error.in_file(&args.scene)))?;
    if args.is_energy_safe() {
        let kinds = prepared.paint().map(PaintKinds::of);
        if let Some(fault) = energy_safe_fault(&scene, kinds.unwrap_or_default()) {
            return Err(Failure::file(&args.scene, fault));
        }
    }
    Ok((scene, prepared))
}

/// What methods are told beside scene and light.
struct Settings {
    n_lights: u32,
    densities: Densities,
    /// What an energy-safe fibre is measured by, if fibres are.
    white: Option<HairParams>,
    /// As text, for the picture.
    options: String,
}

impl Settings {
    fn new(args: &TraceArgs, prepared: &PreparedScene) -> Settings {
        let method = args.method.method();
        let n_lights = args.lights.unwrap_or(match method {
            Method::Directional => 1536,
            _ => 4,
        });
        let [forward, back] = prepared.densities.map(f64::from);
        let densities = Densities {
            forward: args.density_forward.unwrap_or(forward),
            back: args.density_back.unwrap_or(back),
        };
        let hair = &prepared.hair;
        let white = args.is_energy_safe().then(|| white_of(hair.hair()));
        let is_of_part = |white: &HairParams| {
            hair.modes() != Lobe::ALL || hair.hair().intensity != white.intensity
        };
        let options = match method {
            // Where the white fibre was another before, what was begun is not gone on with.
            Method::Path if white.as_ref().is_some_and(is_of_part) => {
                "true, by all modes".to_owned()
            }
            Method::Path => format!("{}", args.energy_safe),
            Method::Directional => format!("{n_lights}"),
            Method::RayShoot => format!("{n_lights} {densities:?}"),
        };
        Settings {
            n_lights,
            densities,
            white,
            options,
        }
    }
}

/// The picture before its samples are taken: empty, or what is gone on with.
fn begin(
    args: &TraceArgs,
    Settings { options, .. }: &Settings,
    map: Option<&Map>,
    (scene, prepared): (&Scene, &PreparedScene),
) -> Result<ReferenceFile, Failure> {
    let provenance = Recorder::new(&Files::Disk).record(scene, args.time);
    let mut provenance = provenance
        .map_err(|error| Failure::input(error.in_file(&args.scene)))?
        .with("options", options);
    if let Some(map) = map {
        provenance = provenance.with("map", &map.source().hash);
    }
    // Of scenes without a panorama the text is as it always was.
    let behind = provenance.get(PANORAMA);
    let behind = behind.map_or(String::new(), |hash| format!(" {hash}"));
    let from_map = map.map_or(String::new(), |map| light_of(map, &scene.lights));
    let inputs = hash_of(prepared, &format!("{options} {from_map}{behind}"));
    let size = prepared.size;
    let samples = args.samples();
    let mut file = ReferenceFile {
        method: args.method.method(),
        inputs,
        seed: args.seed,
        provenance,
        film: Film::from_sample(size, samples.start),
    };
    if args.resume {
        resume(args, &mut file)?;
    }
    let whole = samples.start..samples.end + file.film.n_samples();
    let has_proxies = !prepared.proxies.is_empty();
    check_memory(size, whole, has_proxies, memory::available_bytes())
        .map_err(|error| Failure::file(&args.scene, error))?;
    Ok(file)
}

/// Takes the samples that the flags ask for.
fn expose(
    args: &TraceArgs,
    settings: &Settings,
    environment: &Environment,
    prepared: &PreparedScene,
    film: &mut Film,
) -> Outcome {
    let method = args.method.method();
    let failed = |error| Failure::file(&args.scene, error);
    let tables = FibreTables::new(prepared).map_err(failed)?;
    let fibres = tables.fibres();
    let averages = AverageTables::new(prepared, method);
    let white = settings.white.as_ref();
    let white = white.map(|white| Bcsdf::new(white, prepared.hair.fresnel(), &Lobe::ALL));
    let white = white.transpose().map_err(failed)?;
    let strands = &prepared.strands;
    let rays = Rays::new(strands);
    let records = prepared.proxy_records();
    let proxies = records.list();
    let beside = prepared.beside();
    let meshes: Vec<MeshRays> = beside.meshes().iter().map(MeshRays::new).collect();
    let n_lights = settings.n_lights;
    let integrator: Box<dyn Integrator + '_> = match method {
        Method::Path => {
            let tracer = PathTracer::new(strands, &rays, fibres, environment);
            let tracer = tracer.with_proxies(proxies).with_meshes(&meshes);
            Box::new(match &white {
                Some(white) => tracer.with_energy_of(white),
                None => tracer,
            })
        }
        Method::Directional => {
            let lights = Directional::new(strands, &rays, fibres, environment, n_lights, args.seed);
            Box::new(lights.with_proxies(proxies).with_meshes(&meshes))
        }
        Method::RayShoot => Box::new(RayShoot {
            strands,
            rays: &rays,
            proxies,
            meshes: &meshes,
            fibres,
            averages: averages.view(),
            environment,
            n_draws: n_lights,
            densities: settings.densities,
        }),
    };
    const STEPS: u64 = 1000;
    let progress = progress(method.name(), STEPS);
    let observer = |done: f64| progress.reach((done * STEPS as f64) as u64);
    let n_samples = args.samples().len() as u32;
    film.expose(prepared, &*integrator, n_samples, args.seed, &observer);
    progress.finish();
    Ok(())
}

/// Writes the picture, or the part of it that the shard is, and says so.
fn write(args: &TraceArgs, file: ReferenceFile, backdrop: Backdrop, start: Instant) -> Outcome {
    let [method, inputs] = [file.method.name().to_owned(), file.inputs.clone()];
    let (size, n_samples) = (file.film.size(), file.film.n_samples());
    let bytes = match args.shard {
        None => file.encode(&backdrop),
        Some(shard) => {
            let part = ReferencePart {
                file,
                backdrop,
                index: shard.index(),
                count: shard.count(),
                n_samples: args.samples,
            };
            part.encode()
        }
    };
    let bytes = bytes.map_err(|error| Failure::file(&args.output, error))?;
    write_output(&args.output, &bytes)?;
    let seconds = start.elapsed().as_secs_f64();
    if args.json {
        let mut document = json!({
            "file": args.output.display().to_string(),
            "method": method,
            "size": size,
            "spp": n_samples,
            "seed": args.seed,
            "inputs": inputs,
            "bytes": bytes.len(),
            "seconds": seconds,
        });
        if let Some(shard) = args.shard {
            document["shard"] = json!(shard.to_string());
            document["spp_of_all"] = json!(args.samples);
        }
        return print_line(document);
    }
    let of = args
        .shard
        .map(|shard| format!(" of {}, shard {shard}", args.samples));
    print_line(format_args!(
        "{}: {method}, {}x{}, {}{}, {} bytes, {seconds:.1} s",
        args.output.display(),
        size[0],
        size[1],
        counted(n_samples, "sample", "samples"),
        of.unwrap_or_default(),
        bytes.len(),
    ))
}

/// What fibres do on average.
enum AverageTables<'a> {
    Alike(AverageTable),
    Painted(Painted<'a>, PaintedAverageTable),
}

impl<'a> AverageTables<'a> {
    /// Of the hair of `scene`, as `method` needs them.
    fn new(scene: &'a PreparedScene, method: Method) -> Self {
        let hair = scene.hair.hair();
        match scene.paint() {
            None => AverageTables::Alike(AverageTable::new(hair, scene.hair.fresnel())),
            Some(points) => {
                AverageTables::Painted(Painted { hair, points }, painted_averages(scene, method))
            }
        }
    }

    fn view(&self) -> Averages<'_> {
        match self {
            AverageTables::Alike(averages) => averages.into(),
            AverageTables::Painted(painted, averages) => {
                Averages::Painted(*painted, averages.view())
            }
        }
    }
}

/// The averages of painted fibres that `method` needs.
fn painted_averages(scene: &PreparedScene, method: Method) -> PaintedAverageTable {
    let kinds = scene.paint().map(PaintKinds::of).unwrap_or_default();
    let scales = |is_painted| if is_painted { DEFAULT_SCALES } else { 1 };
    let size = match method {
        Method::RayShoot => [
            DEFAULT_AVERAGE_LAYERS,
            scales(kinds.widths),
            scales(kinds.shifts),
        ],
        _ => [2, 1, 1],
    };
    PaintedAverageTable::new(scene.hair.hair(), scene.hair.fresnel(), size)
}

/// What decides the light of a map.
fn light_of(map: &Map, lights: &LightsSection) -> String {
    let hash = &map.source().hash;
    let mut decided = format!("{hash} {} {}", lights.rotate_deg, lights.intensity);
    // Parts that were begun before tints counted go on.
    if lights.tint != [1.0; 3] {
        decided += &format!(" {:?}", lights.tint);
    }
    decided
}

/// Hash of what decides the picture.
fn hash_of(scene: &PreparedScene, rest: &str) -> String {
    let strands = &scene.strands;
    let arrays = [
        bytemuck::cast_slice(&strands.points),
        bytemuck::cast_slice(&strands.tangents),
        bytemuck::cast_slice(&strands.segments),
    ];
    let geometry: Vec<String> = arrays.into_iter().map(content_hash).collect();
    let hair = &scene.hair;
    // Of hair without paint and proxies the text is as it always was.
    let proxies = (!scene.proxies.is_empty()).then(|| format!(" {:?}", scene.proxies));
    let paint = scene.paint().map(|paint| {
        let texels: Vec<PaintTexel> = paint.iter().map(PaintedPoint::texel).collect();
        content_hash(bytemuck::cast_slice(&texels))
    });
    let text = format!(
        "{geometry:?} {:?} {:?} {:?} {:?} {:?} {:?} {rest}{}{}",
        scene.lights,
        hair.hair(),
        hair.fresnel(),
        hair.modes(),
        scene.camera,
        scene.background,
        paint.map_or(String::new(), |paint| format!(" {paint}")),
        proxies.unwrap_or_default(),
    );
    content_hash(text.as_bytes())
}

/// Takes the samples that the output has already, if it is there.
fn resume(args: &TraceArgs, file: &mut ReferenceFile) -> Outcome {
    let path = &args.output;
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            note!("{}: no such file to resume; starting it", path.display());
            return Ok(());
        }
        Err(error) => return Err(Failure::file(path, format!("cannot be read: {error}"))),
    };
    let resumed = file.resume(&bytes);
    resumed.map_err(|error| Failure::file(path, format!("cannot be resumed: {error}")))?;
    if args.samples > MAX_TRUTH_SAMPLES - file.film.n_samples() {
        let text = format!("more than {MAX_TRUTH_SAMPLES} samples in all");
        return Err(Failure::file(path, text));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_that_do_not_fit_are_refused() {
        let size = [3840, 2160];
        let check = |samples, free| check_memory(size, samples, false, free);
        for samples in [0..63, 0..64] {
            assert!(check(samples, None).is_ok());
        }
        // The whole block has one sum a pixel, all numbers but powers of two before it have more.
        let free = Some(4 << 30);
        assert!(check(0..64, free).is_ok());
        for (samples, said) in [
            (
                0..63,
                "3840x2160 pixels of 63 samples; 64 samples take less: ",
            ),
            (64..127, "3840x2160 pixels of 63 samples: "),
        ] {
            let error = check(samples, free).expect_err(said).to_string();
            assert!(error.starts_with(said), "{error}");
        }
    }
}
