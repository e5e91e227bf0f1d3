//! `strandlight bench plots`.

use std::path::PathBuf;

use serde_json::json;
use strandlight_lab::bench::figures;

use super::method_tables::method_tables;
use crate::cli::{Failure, Outcome, check_outputs, output_folder, print_line, write_output};

/// Plot the approximations of each scheme against the exact model
///
/// Writes lobes over azimuth, attenuation and energies, and the outer integrand with its nodes,
/// each as SVG and as CSV.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the plots; created if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let folder = &args.output;
    let _new = output_folder(folder)?;
    let figures = figures(&method_tables()?).map_err(Failure::input)?;
    let paths: Vec<[PathBuf; 2]> = figures
        .iter()
        .map(|(stem, _)| ["svg", "csv"].map(|kind| folder.join(format!("{stem}.{kind}"))))
        .collect();
    let outputs: Vec<_> = paths.as_flattened().iter().map(PathBuf::as_path).collect();
    check_outputs(&[], &outputs)?;
    for ((_, figure), [svg, csv]) in figures.iter().zip(&paths) {
        write_output(svg, figure.to_svg().as_bytes())?;
        write_output(csv, figure.to_csv().as_bytes())?;
    }
    if args.json {
        let files: Vec<String> = outputs
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        return print_line(json!({ "files": files }));
    }
    for path in outputs {
        print_line(format_args!("wrote {}", path.display()))?;
    }
    Ok(())
}
