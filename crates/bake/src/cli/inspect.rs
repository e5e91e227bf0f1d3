//! `strandlight inspect`.

use std::path::{Path, PathBuf};

use serde::Serialize;
use strandlight_formats::{
    BakedFile, FileKind, FormatInfo, Groom, ImportOptions, Kind, Note, NoteKind, SNIFF_BYTES,
    Scene, SourceFile, read_start,
};

use super::{Failure, Outcome, is_stream, note, print_line};
use groom::{GroomInfo, describe_groom, text_of_groom};
use lights::text_of_lights;
use lut::{lut, text_of_lut};
use mesh::{mesh, text_of_mesh};
use panorama::{panorama, text_of_panorama};
use parts::version;
use tables::{tables, text_of_tables};

pub use lights::lights;

mod groom;
mod lights;
mod lut;
mod mesh;
mod panorama;
mod parts;
mod tables;

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
                let what = "not a table file, light set, hair file, mesh (.mesh), panorama, LUT (.cube) or scene (.toml)";
                let what = format!("{what}: {}", other.describe());
                Err(Failure::file(path, what))
            }
        }
    }
}

fn show<T: Serialize>(info: &T, json: bool, text: impl Fn(&T) -> Vec<String>) -> Outcome {
    if json {
        return print_line(serde_json::to_string_pretty(info).map_err(Failure::input)?);
    }
    text(info).into_iter().try_for_each(print_line)
}

#[derive(Serialize)]
struct SceneInfo {
    kind: &'static str,
    #[serde(flatten)]
    scene: Scene,
}
