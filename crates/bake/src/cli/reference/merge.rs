//! `strandlight reference merge`: a picture of the parts that several machines have drawn.

use std::path::{Path, PathBuf};
use std::time::Instant;
use strandlight_formats::counted;

use serde_json::json;
use strandlight_reference::{FileError, PartInfo, PartsError, ReferencePart, order_of_parts};

use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_extension, check_outputs, print_line, write_output};

/// Merge the parts that `reference --shard` wrote, in any order
///
/// All parts must be there, once, and be of one scene, method, size, seed and number of samples, by
/// one version of the program. The picture has the bytes of one run with all samples.
#[derive(clap::Args)]
pub struct Args {
    /// Parts of one picture
    #[arg(required = true, value_name = "PART.exr")]
    parts: Vec<PathBuf>,
    /// OpenEXR file to write, - for standard output
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Print a JSON document about the picture instead of text
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let start = Instant::now();
    let Args { parts, output, .. } = args;
    check_extension(output, "exr")?;
    let inputs: Vec<&Path> = parts.iter().map(PathBuf::as_path).collect();
    check_outputs(&inputs, &[output])?;
    // Headers first: pictures are large, and what does not fit is told before any is decoded.
    let infos = parts
        .iter()
        .map(|path| PartInfo::read(&read(path)?).map_err(|error| Failure::file(path, error)));
    let infos = infos.collect::<Result<Vec<PartInfo>, Failure>>()?;
    let order = order_of_parts(&infos).map_err(|error| of_parts(parts, &error))?;
    let progress = progress("merging", order.len() as u64);
    let mut picture: Option<ReferencePart> = None;
    for ix in order {
        let failed = |error: FileError| Failure::file(&parts[ix], error);
        let part = ReferencePart::decode(&read(&parts[ix])?, &infos[ix]).map_err(failed)?;
        match &mut picture {
            None => picture = Some(part),
            Some(picture) => picture.append(&part).map_err(failed)?,
        }
        progress.advance(1);
    }
    progress.finish();
    // The parser asks for one part at least.
    let Some(ReferencePart { file, backdrop, .. }) = picture else {
        return Ok(());
    };
    let bytes = file.encode(&backdrop);
    let bytes = bytes.map_err(|error| Failure::file(output, error))?;
    write_output(output, &bytes)?;
    let (size, seconds) = (file.film.size(), start.elapsed().as_secs_f64());
    if args.json {
        return print_line(json!({
            "file": output.display().to_string(),
            "parts": parts.len(),
            "method": file.method.name(),
            "size": size,
            "spp": file.film.n_samples(),
            "seed": file.seed,
            "inputs": file.inputs,
            "bytes": bytes.len(),
            "seconds": seconds,
        }));
    }
    print_line(format_args!(
        "{}: {}, {}x{}, {} of {}, {} bytes",
        output.display(),
        file.method.name(),
        size[0],
        size[1],
        counted(file.film.n_samples(), "sample", "samples"),
        counted(parts.len(), "part", "parts"),
        bytes.len(),
    ))
}

/// A part, which is read twice: a pipe would be empty then.
fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let cannot = |error| Failure::file(path, format!("cannot be read: {error}"));
    if !std::fs::metadata(path).map_err(cannot)?.is_file() {
        return Err(Failure::file(path, "is not a file; parts must be files"));
    }
    std::fs::read(path).map_err(cannot)
}

/// Why `parts` make no picture, by their names.
fn of_parts(parts: &[PathBuf], error: &PartsError) -> Failure {
    let name = |part: usize| parts[part].display();
    match error {
        PartsError::Other { part, source } => Failure::file(
            &parts[*part],
            format_args!("cannot be merged with {}: {source}", name(0)),
        ),
        PartsError::Doubled { part, before, .. } => Failure::file(
            &parts[*part],
            format_args!("{error}, after {}", name(*before)),
        ),
        _ => Failure::input(error),
    }
}
