//! `strandlight groom merge`.

use std::path::{Path, PathBuf};

use strandlight_bake::grooms::{MergeInput, merge};

use super::kept::note_kept;
use super::source::read_to_edit;
use super::target::{Target, Wish};
use crate::cli::{Failure, Outcome, check_outputs, note};

/// Join hair of several files into one groom
///
/// Attributes that all files have are kept. Files without diameter, guide or paint get neutral values
/// (of diameters, those that the file is drawn with), so these are kept too. Each file without group_id
/// becomes a group named like it. Says on stderr what was kept and what was dropped.
#[derive(clap::Args)]
pub struct Args {
    /// .groom or hair files of other programs, in the order of their strands
    #[arg(required = true, num_args = 2.., value_name = "FILE")]
    inputs: Vec<PathBuf>,
    /// File to write, a .groom or a hair format by its extension; - for standard output (a .groom)
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Args { inputs, output } = args;
    let target = Target::new(output, Wish::default(), None)?;
    let paths: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    check_outputs(&paths, &[output])?;
    let grooms = paths.into_iter().map(|path| {
        let name = path.file_stem().unwrap_or(path.as_os_str());
        Ok(MergeInput {
            name: name.to_string_lossy().into_owned(),
            groom: read_to_edit(path)?,
        })
    });
    let grooms = grooms.collect::<Result<Vec<MergeInput>, Failure>>()?;
    let merged = merge(&grooms).map_err(|error| Failure::file(output, error))?;
    for line in &merged.notes {
        note!("{line}");
    }
    note_kept(output, &merged.groom, &merged.dropped);
    target.write(&merged.groom, output)
}
