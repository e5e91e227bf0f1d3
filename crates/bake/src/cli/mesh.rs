//! `strandlight mesh import` and `strandlight mesh generate`.

mod gltf;
mod obj;
mod parts;

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use strandlight_bake::grooms::bust;
use strandlight_formats::{
    BakedFile, FileKind, Kind, Mesh, MeshSource, SNIFF_BYTES, TakenFiles, UpAxis, content_hash,
    counted, read_file,
};

use super::groom::parse_cm;
use super::{
    Failure, Outcome, check_not_taken, check_outputs, check_own_extension, note, print_line,
    write_output,
};
use parts::{MAX_BYTES, Parts};

/// Import or generate meshes for the hair to stand on
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Import(ImportArgs),
    /// Generate head and shoulders, centred and facing as generated hair is
    Generate {
        /// .mesh file to write, - for standard output
        #[arg(short, long)]
        output: PathBuf,
    },
}

/// Convert a mesh of another program (OBJ; glTF 2.0 as .glb or .gltf) to a .mesh; the format is
/// detected from the file's content
///
/// All triangles become one mesh, with the transforms of its nodes. Smooth normals are made where
/// the file has none. Materials, textures, skins and morph targets are not kept.
#[derive(clap::Args)]
struct ImportArgs {
    /// Mesh file, - for standard input
    input: PathBuf,
    /// .mesh file to write, - for standard output
    #[arg(short, long)]
    output: PathBuf,
    /// Unit of the file: mm, cm, in, ft, m or a number of centimetres [default: cm for OBJ, m for
    /// glTF]
    #[arg(long, value_parser = parse_cm)]
    unit: Option<f64>,
    /// Up axis of the file
    #[arg(long, value_enum, default_value = "y")]
    up: Up,
}

#[derive(Clone, Copy, ValueEnum)]
enum Up {
    X,
    Y,
    Z,
}

impl Up {
    const fn axis(self) -> UpAxis {
        match self {
            Up::X => UpAxis::X,
            Up::Y => UpAxis::Y,
            Up::Z => UpAxis::Z,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Import(args) => import(args),
        Command::Generate { output } => {
            check_own_extension(output, "mesh")?;
            check_outputs(&[], &[output])?;
            write_mesh(&bust(), output)
        }
    }
}

fn import(args: &ImportArgs) -> Outcome {
    check_own_extension(&args.output, "mesh")?;
    check_outputs(&[&args.input], &[&args.output])?;
    let bytes = read_file(&args.input, MAX_BYTES).map_err(Failure::input)?;
    let read = mesh_of(&bytes, &args.input, args.unit, args.up.axis())
        .map_err(|what| Failure::file(&args.input, what))?;
    let mut taken = TakenFiles::default();
    taken.add(&read.files, "an input");
    check_not_taken(&taken, &[&args.output])?;
    for line in &read.notes {
        note!("{}: {line}", args.input.display());
    }
    write_mesh(&read.mesh, &args.output)
}

fn write_mesh(mesh: &Mesh, path: &Path) -> Outcome {
    let bytes = mesh
        .to_bytes()
        .map_err(|error| Failure::file(path, error))?;
    write_output(path, &bytes)?;
    let (major, minor) = Kind::Mesh.version();
    print_line(format_args!(
        "{}: mesh {major}.{minor}, {} vertices, {}, {} bytes",
        path.display(),
        mesh.positions.len(),
        counted(mesh.triangles.len(), "triangle", "triangles"),
        bytes.len()
    ))
}

/// A mesh, and what there is to say of it.
#[derive(Debug)]
struct Read {
    mesh: Mesh,
    notes: Vec<String>,
    /// Files beside its own that were read.
    files: Vec<PathBuf>,
}

/// What is in the file at `path`, whose folder files beside it are read from.
fn mesh_of(bytes: &[u8], path: &Path, unit: Option<f64>, up: UpAxis) -> Result<Read, String> {
    let mut notes = Vec::new();
    // A byte order mark is no part of the text.
    let content = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let (mut parts, name, own_cm): (Parts, _, _) = match format_of(content)? {
        Format::Gltf => (gltf::read(content, path, &mut notes)?, "gltf", 100.0),
        Format::Obj => (obj::read(content)?, "obj", 1.0),
    };
    let files = std::mem::take(&mut parts.files);
    let cm = unit.unwrap_or(own_cm);
    let mut mesh = parts.mesh(cm, up, &mut notes)?;
    let pair = |name: &str, value: String| (name.to_owned(), value);
    mesh.source = MeshSource {
        hash: content_hash(bytes),
        parameters: vec![
            pair("format", name.to_owned()),
            pair("cm_per_unit", cm.to_string()),
            pair("up", up.name().to_owned()),
        ],
        ..MeshSource::default()
    };
    let (low, high) = mesh.bounds();
    let size = (0..3)
        .map(|axis| high[axis] - low[axis])
        .fold(0.0, f32::max);
    if !(5.0..=500.0).contains(&size) {
        notes.push(format!("the mesh is {size:.2} cm large; is --unit right?"));
    }
    let open = mesh.open_edges();
    if open > 0 {
        notes.push(format!(
            "open along {}: taken for a solid, so that hair behind a single sheet lies in the light before it",
            counted(open, "edge", "edges")
        ));
    }
    Ok(Read { mesh, notes, files })
}

enum Format {
    Gltf,
    Obj,
}

fn format_of(bytes: &[u8]) -> Result<Format, String> {
    let start = &bytes[..bytes.len().min(SNIFF_BYTES)];
    let found = FileKind::of(start);
    let is_line_of_obj = |line: &[u8]| line.starts_with(b"v ") || line.starts_with(b"v\t");
    match found {
        FileKind::Foreign(name) if name.contains("glTF") => Ok(Format::Gltf),
        FileKind::Foreign(name) if name.contains("OBJ") => Ok(Format::Obj),
        // A long comment may come before what tells.
        FileKind::Text if bytes.split(|&byte| byte == b'\n').any(is_line_of_obj) => Ok(Format::Obj),
        // As may a long name before `"asset"`.
        FileKind::Foreign(name) if name.contains("JSON") => Ok(Format::Gltf),
        _ => Err(format!(
            "not an OBJ or glTF mesh: {} (found by content)",
            found.name()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<(Mesh, Vec<String>), String> {
        let read = mesh_of(bytes, Path::new("here/x"), None, UpAxis::Y)?;
        Ok((read.mesh, read.notes))
    }

    /// A unit square in the plane of x and y, of one quad.
    const SQUARE: &str = "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn obj_is_triangulated_and_gets_smooth_normals() {
        let (mesh, notes) = read(format!("{SQUARE}f 1 2 3 4\n").as_bytes()).expect("good");
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 0.0, 1.0]));
        assert!(mesh.uvs.is_empty());
        assert_eq!(mesh.source.parameters[1].1, "1");
        assert!(
            notes.iter().any(|line| line.contains("--unit")),
            "{notes:?}"
        );
        // Negative indices, texture coordinates and normals of its own, and a triangle without an
        // area.
        let text = format!(
            "{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 2\nf -4/1/1 -3/2/1 -2/3/1\nf 1/1/1 1/1/1 2/2/1\n"
        );
        let (mesh, notes) = read(text.as_bytes()).expect("good");
        assert_eq!(mesh.triangles.len(), 1);
        assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
        assert_eq!(mesh.uvs[1], [1.0, 0.0]);
        assert!(
            notes.iter().any(|line| line.contains("without an area")),
            "{notes:?}"
        );
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_text() {
        let text = "\u{feff}v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
        let (mesh, _) = read(text.as_bytes()).expect("good");
        assert_eq!(mesh.positions[0], [0.0; 3]);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        assert_eq!(mesh.source.hash, content_hash(text.as_bytes()));
    }

    #[test]
    fn unit_and_axis_are_those_asked_for() {
        let text = format!("{SQUARE}f 1 2 3\n");
        let of = |unit, up| {
            let read = mesh_of(text.as_bytes(), Path::new("x"), unit, up);
            read.expect("good").mesh
        };
        assert_eq!(of(Some(2.54), UpAxis::Y).positions[1], [2.54, 0.0, 0.0]);
        let turned = of(None, UpAxis::Z);
        assert_eq!(turned.positions[2], [1.0, 0.0, -1.0]);
        assert_eq!(turned.normals[0], [0.0, 1.0, 0.0]);
    }

    /// One triangle, or as `change` makes of it, in a .glb whose node is moved and scaled.
    fn glb(change: impl Fn(String) -> String) -> Vec<u8> {
        let mut data = Vec::new();
        for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            data.extend(x.to_le_bytes());
        }
        for ix in [0u16, 1, 2, 0] {
            data.extend(ix.to_le_bytes());
        }
        let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
            "nodes":[{"children":[1],"translation":[0,1,0]},{"mesh":0,"scale":[0.5,0.5,0.5]}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
            "buffers":[{"byteLength":44}],
            "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
            {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]}"#;
        let mut json = change(json.to_owned()).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend((12 + 8 + json.len() as u32 + 8 + data.len() as u32).to_le_bytes());
        file.extend((json.len() as u32).to_le_bytes());
        file.extend(b"JSON");
        file.extend(json);
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(data);
        file
    }

    #[test]
    fn gltf_is_read_in_metres_with_the_transforms_of_its_nodes() {
        let (mesh, _) = read(&glb(|json| json)).expect("good");
        assert_eq!(
            mesh.positions,
            [[0.0, 100.0, 0.0], [50.0, 100.0, 0.0], [0.0, 150.0, 0.0]]
        );
        assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
        // A mirror turns the winding over, so that the outside stays outside.
        let mirrored = read(&glb(|json| json.replace("[0.5,0.5,0.5]", "[-0.5,0.5,0.5]")));
        let mirrored = mirrored.expect("good").0;
        assert_eq!(mirrored.positions[1], [-50.0, 100.0, 0.0]);
        assert_eq!(mirrored.normals[0], [0.0, 0.0, 1.0]);
        // The same buffer as text.
        let base64 = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=";
        let whole = glb(|json| {
            let uri = format!("{{\"uri\":\"{base64}\",\"byteLength\":44}}");
            json.replace("{\"byteLength\":44}", &uri)
        });
        let length = u32::from_le_bytes(whole[12..16].try_into().expect("4 bytes")) as usize;
        let text = &whole[20..20 + length];
        assert_eq!(
            read(text).expect("good").0.positions,
            read(&glb(|json| json)).expect("good").0.positions
        );
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for (bytes, needle) in [
            (b"#usda 1.0\n".to_vec(), "a USD file"),
            (b"solid x\nfacet".to_vec(), "not an OBJ or glTF"),
            (SQUARE.as_bytes().to_vec(), "no triangles"),
            (format!("{SQUARE}f 1 2 9\n").into_bytes(), "OBJ"),
            (
                format!("{SQUARE}v nan 0 0\nf 1 2 5\n").into_bytes(),
                "positions",
            ),
            (
                glb(|json| json.replace("\"byteLength\":36}", "\"byteLength\":48}")),
                "outside",
            ),
            (
                glb(|json| json.replace("\"count\":3,\"type\":\"SC", "\"count\":9,\"type\":\"SC")),
                "outside",
            ),
            (
                glb(|json| json.replace("\"children\":[1]", "\"children\":[0]")),
                "twice",
            ),
            (glb(|json| json.replace("5123", "5122")), "no indices"),
            (glb(|json| json.replace("\"mesh\":0,", "")), "no triangles"),
            (
                glb(|json| {
                    json.replace(
                        "{\"byteLength\":44}",
                        "{\"uri\":\"no.bin\",\"byteLength\":44}",
                    )
                }),
                "no.bin",
            ),
            (
                glb(|json| {
                    json.replace(
                        "{\"byteLength\":44}",
                        "{\"uri\":\"../../no.bin\",\"byteLength\":44}",
                    )
                }),
                "beside",
            ),
        ] {
            let error = read(&bytes).expect_err(needle);
            assert!(error.contains(needle), "{needle}: {error}");
        }
    }

    #[test]
    fn no_damage_makes_it_panic() {
        let good = [
            glb(|json| json),
            format!("{SQUARE}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n").into_bytes(),
        ];
        let mut n_refused = 0;
        for bytes in good {
            for length in 0..bytes.len() {
                n_refused += usize::from(read(&bytes[..length]).is_err());
            }
            for bit in 0..8 * bytes.len() {
                let mut changed = bytes.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                n_refused += usize::from(read(&changed).is_err());
            }
        }
        assert!(n_refused > 1000, "{n_refused}");
    }
}
