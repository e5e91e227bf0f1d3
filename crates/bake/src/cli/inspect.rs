//! `strandlight inspect`.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};
use strandlight_bake::lights::exchange;
use strandlight_formats::{
    Axis, BakedFile, Container, Cube, CubeTable, FileKind, FitReport, FormatInfo, Groom, Guesses,
    ImportOptions, Kind, LightSet, Mesh, Note, NoteKind, Panorama, SNIFF_BYTES, Scene, SourceFile,
    SrbfLight, TableFile, read_start,
};

use strandlight_images::LatLong;

use super::{Failure, Outcome, is_stream, note, print_line};

/// Summarize a file: .tables, .lights, .groom, .mesh, .panorama, .cube, a scene, or hair of another program
#[derive(clap::Args)]
pub struct Args {
    /// File to inspect, - for standard input
    file: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let path = &args.file;
    match Content::of(path)? {
        Content::Kind(Kind::Tables) => show(&tables(path)?, args.json, text_of_tables),
        Content::Kind(Kind::Lights) => show(&lights(path)?, args.json, text_of_lights),
        Content::Kind(Kind::Groom) => {
            let version = version(path, Kind::Groom)?;
            let groom = Groom::read(path).map_err(Failure::input)?;
            show_groom(&describe_groom(&groom, "groom", version), args)
        }
        Content::Kind(Kind::Mesh) => show(&mesh(path)?, args.json, text_of_mesh),
        Content::Kind(Kind::Panorama) => show(&panorama(path)?, args.json, text_of_panorama),
        Content::Kind(_) => Err(Failure::file(path, "no summary is available for this file")),
        Content::Hair(format) => {
            let file = SourceFile::read(path).map_err(Failure::input)?;
            let import = file
                .import(&ImportOptions::default())
                .map_err(Failure::input)?;
            // The others stand in what is printed.
            let assumed = |note: &&Note| note.kind == NoteKind::Assumed;
            for line in import.notes.iter().filter(assumed) {
                note!("{line}");
            }
            show_groom(
                &describe_groom(&import.groom, format.name, String::new()),
                args,
            )
        }
        Content::Lut => show(&lut(path)?, args.json, text_of_lut),
        Content::Scene => {
            let scene = Scene::read(path).map_err(Failure::input)?;
            let text = scene.to_toml_string().map_err(Failure::input)?;
            show(
                &SceneInfo {
                    kind: "scene",
                    scene,
                },
                args.json,
                |_| text.lines().map(str::to_owned).collect(),
            )
        }
    }
}

fn show_groom(info: &GroomInfo, args: &Args) -> Outcome {
    for line in &info.notes {
        note!("{}: {line}", args.file.display());
    }
    show(info, args.json, text_of_groom)
}

/// What a file seems to be, by its first bytes, or its name for scenes, which are text.
pub enum Content {
    /// One of our binary kinds.
    Kind(Kind),
    /// Hair of another program.
    Hair(&'static FormatInfo),
    /// A LUT.
    Lut,
    /// A scene.
    Scene,
}

impl Content {
    /// Looks at the file's start.
    pub fn of(path: &Path) -> Result<Content, Failure> {
        let start = read_start(path, SNIFF_BYTES as u64).map_err(Failure::input)?;
        let extension = path.extension();
        let is_toml = extension.is_some_and(|extension| extension == "toml");
        let is_cube = extension.is_some_and(|extension| extension.eq_ignore_ascii_case("cube"));
        match FileKind::of(&start) {
            FileKind::Ours(kind) => Ok(Content::Kind(kind)),
            FileKind::Hair(format) => Ok(Content::Hair(format)),
            FileKind::Scene => Ok(Content::Scene),
            FileKind::Cube => Ok(Content::Lut),
            // After long comments; what is wrong with it is said by line.
            FileKind::Text if is_cube => Ok(Content::Lut),
            // Why it is no scene is said by the reader. A pipe need not have a name that tells.
            kind if is_toml || (kind == FileKind::Text && is_stream(path)) => Ok(Content::Scene),
            other => {
                let what = "not a table file, light set, hair file, LUT (.cube) or scene (.toml)";
                let what = format!("{what}: {}", other.describe());
                Err(Failure::file(path, what))
            }
        }
    }
}

/// Pairs as a JSON object, in their order.
fn as_map<S: Serializer>(pairs: &[(String, String)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

fn show<T: Serialize>(info: &T, json: bool, text: impl Fn(&T) -> Vec<String>) -> Outcome {
    if json {
        return print_line(serde_json::to_string_pretty(info).map_err(Failure::input)?);
    }
    text(info).into_iter().try_for_each(print_line)
}

/// Format version found in the file, `major.minor`.
fn version(path: &Path, kind: Kind) -> Result<String, Failure> {
    let (major, minor) = Container::open(path, kind)
        .map_err(Failure::input)?
        .version();
    Ok(format!("{major}.{minor}"))
}

#[derive(Serialize)]
struct SceneInfo {
    kind: &'static str,
    #[serde(flatten)]
    scene: Scene,
}

#[derive(Serialize)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

#[derive(Serialize)]
struct AttributeInfo {
    name: String,
    domain: &'static str,
    components: u32,
}

#[derive(Serialize)]
struct DiameterInfo {
    min: f32,
    median: f32,
    max: f32,
    source: &'static str,
}

/// Names, and why; null where nothing tells.
#[derive(Serialize)]
struct GuessInfo {
    unit: Option<&'static str>,
    unit_because: Option<String>,
    up: Option<&'static str>,
    up_because: Option<String>,
}

#[derive(Serialize)]
struct GroomInfo {
    kind: &'static str,
    format_version: String,
    strands: usize,
    points: usize,
    /// Fewest and most points of a strand.
    points_per_strand: [usize; 2],
    /// Shortest, mean and longest strand.
    strand_length: [f64; 3],
    bounds: Bounds,
    /// Extents of the bounds.
    size: [f32; 3],
    /// Of bounds, size and lengths.
    unit: &'static str,
    /// As drawn, unless the scene has a `diameter_cm`.
    diameter_cm: DiameterInfo,
    /// What unit and axes of the source file seem to be.
    guess: GuessInfo,
    /// What seems wrong with them, and with the thickness.
    notes: Vec<String>,
    /// Name of the format it was imported from; null where it was generated.
    source_format: Option<String>,
    source_cm_per_unit: f64,
    source_up: &'static str,
    source_hash: String,
    /// Strands of fewer than two points in the source file, kept for export only.
    single_point_strands: usize,
    attributes: Vec<AttributeInfo>,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

fn describe_groom(groom: &Groom, kind: &'static str, format_version: String) -> GroomInfo {
    let (min, max) = groom.bounds();
    let mut points_per_strand = [usize::MAX, 0];
    let mut strand_length = [f64::INFINITY, 0.0, 0.0];
    for strand_ix in 0..groom.n_strands() {
        let points = &groom.points[groom.strand(strand_ix)];
        let n = points.len();
        points_per_strand = [points_per_strand[0].min(n), points_per_strand[1].max(n)];
        let length: f64 = points
            .windows(2)
            .map(|pair| distance(pair[0], pair[1]))
            .sum();
        strand_length[0] = strand_length[0].min(length);
        strand_length[1] += length / groom.n_strands() as f64;
        strand_length[2] = strand_length[2].max(length);
    }
    let source = &groom.source;
    let drawn = groom.diameter_range();
    let Guesses { unit, up } = groom.guess_source();
    GroomInfo {
        kind,
        format_version,
        strands: groom.n_strands(),
        points: groom.points.len(),
        points_per_strand,
        strand_length,
        bounds: Bounds { min, max },
        size: [0, 1, 2].map(|axis| max[axis] - min[axis]),
        unit: "cm",
        diameter_cm: DiameterInfo {
            min: drawn.min,
            median: drawn.median,
            max: drawn.max,
            source: drawn.source.name(),
        },
        guess: GuessInfo {
            unit: unit.as_ref().map(|guess| guess.value.name()),
            unit_because: unit.map(|guess| guess.because),
            up: up.as_ref().map(|guess| guess.value.name()),
            up_because: up.map(|guess| guess.because),
        },
        notes: super::groom::doubts(groom, drawn),
        source_format: source
            .original
            .as_ref()
            .map(|original| original.format.clone()),
        source_cm_per_unit: source.cm_per_unit,
        source_up: source.up.name(),
        source_hash: source.hash.clone(),
        single_point_strands: source.n_set_aside(),
        attributes: groom
            .attributes
            .iter()
            .map(|attribute| AttributeInfo {
                name: attribute.name.clone(),
                domain: attribute.domain.name(),
                components: attribute.components,
            })
            .collect(),
        parameters: source.parameters.clone(),
        tool_version: source.tool_version.clone(),
    }
}

fn distance(from: [f32; 3], to: [f32; 3]) -> f64 {
    (0..3)
        .map(|axis| f64::from(to[axis] - from[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// The thickness of the strands, in micrometres.
fn text_of_diameter(info: &DiameterInfo) -> String {
    let [min, median, max] = [info.min, info.median, info.max].map(|cm| {
        let text = format!("{:.2}", f64::from(cm) * 1e4);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    });
    let source = info.source;
    if min == max {
        format!("diameter {max} \u{b5}m ({source})")
    } else {
        format!("diameter {min} to {max} \u{b5}m, median {median} ({source})")
    }
}

fn text_of_groom(info: &GroomInfo) -> Vec<String> {
    let [fewest, most] = info.points_per_strand;
    let [shortest, mean, longest] = info.strand_length;
    let (Bounds { min, max }, size) = (&info.bounds, info.size);
    let mut lines = vec![
        format!("{} {}", info.kind, info.format_version)
            .trim_end()
            .to_owned(),
        format!(
            "{} strands, {} points, {fewest} to {most} a strand",
            info.strands, info.points
        ),
        format!("lengths {shortest:.2} to {longest:.2} cm, mean {mean:.2}"),
        text_of_diameter(&info.diameter_cm),
        format!("bounds {min:.2?} to {max:.2?} cm"),
        format!("size {:.2} x {:.2} x {:.2} cm", size[0], size[1], size[2]),
        format!(
            "source: {}{} cm per unit, {} up, hash {}",
            match &info.source_format {
                Some(format) => format!("{format}, "),
                None => String::new(),
            },
            info.source_cm_per_unit,
            info.source_up,
            if info.source_hash.is_empty() {
                "none"
            } else {
                &info.source_hash
            }
        ),
    ];
    if info.single_point_strands > 0 {
        lines.push(format!(
            "{} strands of a single point, kept for export",
            info.single_point_strands
        ));
    }
    for attribute in &info.attributes {
        let AttributeInfo {
            name,
            domain,
            components,
        } = attribute;
        lines.push(format!("attribute {name}: {components} per {domain}"));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}

fn parameters(parameters: &[(String, String)], tool_version: &str) -> Vec<String> {
    let named = parameters
        .iter()
        .map(|(name, value)| format!("{name} = {value}"));
    named.chain([format!("made by {tool_version}")]).collect()
}

/// A light set as `inspect --json` and `export -o X.json` show it.
#[derive(Serialize)]
pub struct LightsInfo {
    kind: &'static str,
    format_version: String,
    map_hash: String,
    map_size: [u32; 2],
    requested_count: u32,
    seed: u64,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
    report: Option<FitReport>,
    /// Name of the kind of the lights.
    light_kind: &'static str,
    /// What the numbers of a light mean.
    formula: &'static str,
    up: &'static str,
    frame: &'static str,
    lights: Vec<LightInfo>,
    test_directions: [TestInfo; 8],
    sh9_basis: &'static str,
    sh9: [[f64; 3]; 9],
}

#[derive(Serialize)]
struct LightInfo {
    #[serde(flatten)]
    light: SrbfLight,
    sharpness: f64,
}

/// A direction, and the radiance of the set from there.
#[derive(Serialize)]
struct TestInfo {
    direction: [f64; 3],
    radiance: [f64; 3],
}

/// Reads the light set at `path`.
pub fn lights(path: &Path) -> Result<LightsInfo, Failure> {
    let format_version = version(path, Kind::Lights)?;
    let set = LightSet::read(path).map_err(Failure::input)?;
    let light_kind = set.kind().name();
    let LightSet { lights, info } = set;
    Ok(LightsInfo {
        kind: "lights",
        format_version,
        map_hash: info.map_hash,
        map_size: info.map_size,
        requested_count: info.requested_count,
        seed: info.seed,
        parameters: info.parameters,
        tool_version: info.tool_version,
        report: info.report,
        light_kind,
        formula: exchange::FORMULA,
        up: "+Y",
        frame: exchange::FRAME,
        test_directions: exchange::test_directions(&lights).map(|test| TestInfo {
            direction: test.direction,
            radiance: test.radiance,
        }),
        sh9_basis: exchange::SH9_BASIS,
        sh9: exchange::sh9(&lights),
        lights: lights
            .into_iter()
            .map(|light| LightInfo {
                sharpness: exchange::sharpness(light.lambda),
                light,
            })
            .collect(),
    })
}

fn text_of_lights(info: &LightsInfo) -> Vec<String> {
    let mut lines = vec![format!("lights {}", info.format_version)];
    lines.push(format!(
        "{} lights ({}), {} asked for, seed {}",
        info.lights.len(),
        info.light_kind,
        info.requested_count,
        info.seed
    ));
    if !info.map_hash.is_empty() {
        let [width, height] = info.map_size;
        lines.push(format!("map: {width} x {height}, hash {}", info.map_hash));
    }
    if let Some(report) = info.report {
        lines.push(format!(
            "rel_l2 {:.4}, energy_ratio {:.4?}, irradiance_error {:.4}, fibre_error {:.4}",
            report.rel_l2, report.energy_ratio, report.irradiance_error, report.fibre_error
        ));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines.push("direction x, y, z; lambda; r, g, b".to_owned());
    for LightInfo { light, .. } in &info.lights {
        let ([x, y, z], [r, g, b]) = (light.direction, light.rgb);
        lines.push(format!(
            "{x:8.4} {y:8.4} {z:8.4}  {:8.5}  {r:10.4} {g:10.4} {b:10.4}",
            light.lambda
        ));
    }
    lines
}

#[derive(Serialize)]
struct MeshInfo {
    kind: &'static str,
    format_version: String,
    vertices: usize,
    triangles: usize,
    has_uvs: bool,
    bounds: Bounds,
    /// Extents of the bounds.
    size: [f32; 3],
    /// Of bounds and size.
    unit: &'static str,
    source_hash: String,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

fn mesh(path: &Path) -> Result<MeshInfo, Failure> {
    let format_version = version(path, Kind::Mesh)?;
    let mesh = Mesh::read(path).map_err(Failure::input)?;
    let (min, max) = mesh.bounds();
    Ok(MeshInfo {
        kind: "mesh",
        format_version,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        has_uvs: !mesh.uvs.is_empty(),
        bounds: Bounds { min, max },
        size: [0, 1, 2].map(|axis| max[axis] - min[axis]),
        unit: "cm",
        source_hash: mesh.source.hash,
        parameters: mesh.source.parameters,
        tool_version: mesh.source.tool_version,
    })
}

fn text_of_mesh(info: &MeshInfo) -> Vec<String> {
    let (Bounds { min, max }, size) = (&info.bounds, info.size);
    let mut lines = vec![
        format!("mesh {}", info.format_version),
        format!(
            "{} vertices, {} triangles, {} texture coordinates",
            info.vertices,
            info.triangles,
            if info.has_uvs { "with" } else { "no" }
        ),
        format!("bounds {min:.2?} to {max:.2?} cm"),
        format!("size {:.2} x {:.2} x {:.2} cm", size[0], size[1], size[2]),
    ];
    if !info.source_hash.is_empty() {
        lines.push(format!("source: hash {}", info.source_hash));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}

#[derive(Serialize)]
struct PanoramaInfo {
    kind: &'static str,
    format_version: String,
    /// Texels across and down.
    size: [u32; 2],
    /// Of the texels, whose factor is 2 to the power of `exponent`.
    format: &'static str,
    exponent: i32,
    /// Means over the sphere and largest values, linear radiance.
    mean: [f64; 3],
    max: [f32; 3],
    up: &'static str,
    frame: &'static str,
    map_hash: String,
    map_size: [u32; 2],
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

fn panorama(path: &Path) -> Result<PanoramaInfo, Failure> {
    let format_version = version(path, Kind::Panorama)?;
    let panorama = Panorama::read(path).map_err(Failure::input)?;
    let pixels = panorama.pixels();
    let max = |c: usize| pixels.iter().map(|rgb| rgb[c]).fold(0.0, f32::max);
    let grid = LatLong {
        width: panorama.width() as usize,
        height: panorama.height() as usize,
    };
    let energy = grid.energy(pixels.chunks_exact(grid.width));
    Ok(PanoramaInfo {
        kind: "panorama",
        format_version,
        size: [panorama.width(), panorama.height()],
        format: "rgb9e5",
        exponent: panorama.exponent(),
        mean: energy.map(|x| x / (4.0 * std::f64::consts::PI)),
        max: [0, 1, 2].map(max),
        up: "+Y",
        frame: exchange::FRAME,
        map_hash: panorama.source.map_hash,
        map_size: panorama.source.map_size,
        parameters: panorama.source.parameters,
        tool_version: panorama.source.tool_version,
    })
}

fn text_of_panorama(info: &PanoramaInfo) -> Vec<String> {
    let ([width, height], exponent) = (info.size, info.exponent);
    let mut lines = vec![
        format!("panorama {}", info.format_version),
        format!(
            "{width} x {height} texels, {}, times 2^{exponent}",
            info.format
        ),
        format!("mean {:.4?}, max {:.4?}", info.mean, info.max),
    ];
    if !info.map_hash.is_empty() {
        let [width, height] = info.map_size;
        lines.push(format!("map: {width} x {height}, hash {}", info.map_hash));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}

/// Curves or a grid: samples along an axis, and the inputs at the first and the last.
#[derive(Serialize)]
struct CubeTableInfo {
    size: u32,
    input_min: [f32; 3],
    input_max: [f32; 3],
}

#[derive(Serialize)]
struct LutInfo {
    kind: &'static str,
    title: Option<String>,
    /// Null where there are none.
    curves: Option<CubeTableInfo>,
    /// Null where there is none.
    grid: Option<CubeTableInfo>,
    /// Least and largest value of each channel, of the grid where there is one.
    output_min: [f32; 3],
    output_max: [f32; 3],
}

fn lut(path: &Path) -> Result<LutInfo, Failure> {
    let cube = Cube::read(path).map_err(Failure::input)?;
    let last = cube.grid.as_ref().or(cube.curves.as_ref());
    let samples = last.map_or(&[][..], |table| &table.samples);
    let extreme = |pick: fn(f32, f32) -> f32| {
        let of = |channel: usize| samples.iter().map(|rgb| rgb[channel]).reduce(pick);
        [0, 1, 2].map(|channel| of(channel).unwrap_or_default())
    };
    let table = |table: &CubeTable| CubeTableInfo {
        size: table.size,
        input_min: table.low,
        input_max: table.high,
    };
    Ok(LutInfo {
        kind: "lut",
        curves: cube.curves.as_ref().map(table),
        grid: cube.grid.as_ref().map(table),
        output_min: extreme(f32::min),
        output_max: extreme(f32::max),
        title: cube.title,
    })
}

fn text_of_lut(info: &LutInfo) -> Vec<String> {
    let of = |what: String, table: &CubeTableInfo| {
        let (min, max) = (table.input_min, table.input_max);
        format!("{what}, input {min:?} to {max:?}")
    };
    let title = info.title.as_deref().unwrap_or_default();
    let mut lines = vec![format!("LUT (.cube) {title}").trim_end().to_owned()];
    if let Some(table) = &info.curves {
        lines.push(of(format!("1D: {} samples", table.size), table));
    }
    if let Some(table) = &info.grid {
        let n = table.size;
        lines.push(of(format!("3D: {n} x {n} x {n} samples"), table));
    }
    let (min, max) = (info.output_min, info.output_max);
    lines.push(format!("output {min:?} to {max:?}"));
    lines
}

#[derive(Serialize)]
struct AxisInfo {
    name: String,
    min: f64,
    max: f64,
    count: u32,
    spacing: &'static str,
    texel_centres: &'static str,
}

#[derive(Serialize)]
struct TableEntry {
    name: String,
    axes: Vec<AxisInfo>,
    channels: Vec<String>,
    format: String,
    max_interpolation_error: f32,
}

#[derive(Serialize)]
struct TablesInfo {
    kind: &'static str,
    format_version: String,
    fresnel: String,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
    tables: Vec<TableEntry>,
}

/// Reads everything, so that damage anywhere is found, and keeps the headers.
fn tables(path: &Path) -> Result<TablesInfo, Failure> {
    let format_version = version(path, Kind::Tables)?;
    let file = TableFile::read(path).map_err(Failure::input)?;
    let entries = file.tables.iter().map(|table| TableEntry {
        name: table.name.clone(),
        axes: table
            .axes
            .iter()
            .map(|axis| AxisInfo {
                name: axis.name.clone(),
                min: axis.min,
                max: axis.max,
                count: axis.count,
                spacing: axis.spacing.name(),
                texel_centres: Axis::TEXEL_CENTRES,
            })
            .collect(),
        channels: table.channels.clone(),
        format: table.header().format(),
        max_interpolation_error: table.max_interpolation_error,
    });
    Ok(TablesInfo {
        kind: "tables",
        format_version,
        tables: entries.collect(),
        fresnel: file.fresnel,
        parameters: file.info.parameters,
        tool_version: file.info.tool_version,
    })
}

fn text_of_tables(info: &TablesInfo) -> Vec<String> {
    let mut lines = vec![
        format!("tables {}", info.format_version),
        format!("fresnel {}", info.fresnel),
    ];
    lines.extend(parameters(&info.parameters, &info.tool_version));
    for table in &info.tables {
        lines.push(format!(
            "{}: {}, channels {}, max interpolation error {:.2e}",
            table.name,
            table.format,
            table.channels.join(" "),
            table.max_interpolation_error
        ));
        for axis in &table.axes {
            lines.push(format!(
                "  {}: {} texels, {} to {}, {}, {}",
                axis.name, axis.count, axis.min, axis.max, axis.spacing, axis.texel_centres
            ));
        }
    }
    lines
}
