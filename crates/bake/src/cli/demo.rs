//! `strandlight demo`: the whole pipeline on the bundled sample.
//!
//! Each step is the very command line that it prints, so the demo shows how to go on alone.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use strandlight_data::{SAMPLE_GROOM, SAMPLE_MAP, SAMPLE_MESH, SAMPLE_SCENE, SAMPLE_SCRIPT};
use strandlight_scene::progress::timed;

use super::{Outcome, check_outputs, note, output_folder, print_line, write_output};

/// Bake and render the bundled sample
///
/// Bakes the tables, fits lights to a studio map, grows hair, verifies all of it and renders
/// them. Needs nothing but this program.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the demo's files; created if missing
    #[arg(
        short,
        long,
        visible_alias = "out",
        value_name = "DIR",
        default_value = "demo"
    )]
    output: PathBuf,
}

/// What people edit stays as it is when the demo runs again.
const EDITED: [(&str, &str); 2] = [
    ("scene.toml", SAMPLE_SCENE),
    ("painted.json", SAMPLE_SCRIPT),
];

/// One step: what it is for, and its command line with file names inside the demo's folder
/// written as `@NAME`.
struct Step {
    purpose: &'static str,
    line: &'static str,
}

const STEPS: [Step; 6] = [
    Step {
        purpose: "bake the tables",
        line: "tables -o @default.tables",
    },
    Step {
        purpose: "fit lights to the map",
        line: "lights @studio.exr -o @studio.lights --report @studio.json --preview @studio.png",
    },
    Step {
        purpose: "grow hair",
        line: SAMPLE_GROOM,
    },
    Step {
        purpose: "make the head and shoulders that it lies on",
        line: SAMPLE_MESH,
    },
    Step {
        purpose: "verify what was baked",
        line: "verify @default.tables @studio.lights @layered.groom @bust.mesh --map @studio.exr",
    },
    Step {
        purpose: "render",
        line: "render @scene.toml -o @demo.png",
    },
];

/// Runs the command; `run_line` runs another command line of this program.
pub fn run(args: &Args, run_line: impl Fn(&[OsString]) -> Outcome) -> Outcome {
    let folder = &args.output;
    let _new = output_folder(folder)?;
    check_outputs(
        &[],
        &outputs(folder)
            .iter()
            .map(PathBuf::as_path)
            .collect::<Vec<_>>(),
    )?;
    write_output(&folder.join("studio.exr"), SAMPLE_MAP)?;
    for (name, text) in EDITED {
        let path = folder.join(name);
        if path.exists() {
            note!("keeping existing file {}", path.display());
        } else {
            write_output(&path, text.as_bytes())?;
        }
    }

    let mut seconds = Vec::with_capacity(STEPS.len());
    for step in &STEPS {
        let line = command_line(step.line, folder);
        let shown: Vec<_> = line.iter().map(|word| word.to_string_lossy()).collect();
        print_line(format_args!(
            "\n{}:\n$ strandlight {}",
            step.purpose,
            shown.join(" ")
        ))?;
        let (outcome, spent) = timed(|| run_line(&line));
        outcome?;
        seconds.push(spent);
    }

    print_line("\nseconds:")?;
    for (step, spent) in STEPS.iter().zip(&seconds) {
        print_line(format_args!("{spent:8.2}  {}", step.purpose))?;
    }
    print_line(format_args!("{:8.2}  in all", seconds.iter().sum::<f64>()))?;
    let shown = folder.display();
    print_line(format_args!(
        "\nThe picture is {shown}/demo.png; {shown}/studio.png shows the map, its lights and what they miss.\n\
         Next: change sigma_a or width_deg in {shown}/scene.toml and run the last command again,\n\
         or name your own files in it, made by\n\
         $ strandlight lights MAP.exr -o {shown}/mine.lights\n\
         $ strandlight groom import MODEL.hair -o {shown}/mine.groom\n\
         or paint the hair by a list of strokes:\n\
         $ strandlight render {shown}/scene.toml --script {shown}/painted.json -o {shown}/painted"
    ))
}

/// All files that the demo writes: its samples and what its steps name.
fn outputs(folder: &Path) -> Vec<PathBuf> {
    let named = STEPS.iter().flat_map(|step| step.line.split_whitespace());
    let named = named.filter_map(|word| word.strip_prefix('@'));
    let edited = EDITED.iter().map(|(name, _)| *name);
    let names: BTreeSet<&str> = named.chain(edited).collect();
    names.into_iter().map(|name| folder.join(name)).collect()
}

/// The words of `line`, with `@NAME` as a file in `folder`.
fn command_line(line: &str, folder: &Path) -> Vec<OsString> {
    line.split_whitespace()
        .map(|word| match word.strip_prefix('@') {
            Some(name) => folder.join(name).into_os_string(),
            None => OsString::from(word),
        })
        .collect()
}
