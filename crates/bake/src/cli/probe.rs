//! `strandlight probe`: values of the model, for checking it from outside.
//!
//! One answer line for each line of stdin, in order. A bad line is answered by an error and
//! nothing else happens; only a missing file or adapter ends the command.

use std::io::{self, BufRead, BufReader, Read};
use std::path::PathBuf;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use serde_json::json;
use strandlight_bake::probe::{self, Device, Evaluator, ProbeError, Request};
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_render::probe::GpuProbe;
use strandlight_scattering::closed_form::paper::MAX_SEGMENTS;
use strandlight_scene::tables::ShadingTables;

use super::{Failure, Outcome, note, print_while_read};

/// Evaluate the scattering model at given points
///
/// Reads JSON Lines on stdin and prints {"value": x} or {"error": "..."} for each. Angles are in
/// radians. Queries: table_C, table_H, azimuthal, single, global, local, average.
#[derive(clap::Args)]
pub struct Args {
    /// Baked tables [default: the bundled ones]
    #[arg(long, value_name = "F.tables")]
    tables: Option<PathBuf>,
    /// Evaluation method
    #[arg(long, value_enum, default_value_t = Method::Runtime)]
    method: Method,
    /// Segments of the outer integral for --method paper, 2 to 64 [default: 4]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(2..=i64::from(MAX_SEGMENTS)))]
    segments: Option<u32>,
}

/// Ways to evaluate the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// What the renderer computes, on the CPU
    Runtime,
    /// The same by the shaders' functions, on the GPU
    Gpu,
    /// Double-precision quadrature of the exact model
    Reference,
    /// Xu's scheme as published
    Paper,
}

/// The bundled tables.
pub fn default_tables() -> Result<TableFile, Failure> {
    TableFile::from_bytes(DEFAULT_TABLES).map_err(Failure::input)
}

/// Is `line` a query with every value in its range? The error names what is wrong.
pub fn parse_query(line: &str) -> Result<(), String> {
    Request::parse(line).map(|_| ())
}

/// Segments of the paper's outer integral unless others are asked for.
const SEGMENTS: u32 = 4;
/// Longest line that is read as a query; longer ones are answered by an error.
const MAX_LINE: usize = 1 << 20;
/// Most lines evaluated at once on the GPU.
const MAX_BATCH: usize = 1 << 14;

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    if args.segments.is_some() && args.method != Method::Paper {
        let method = args.method.to_possible_value();
        let method = method.as_ref().map_or("", PossibleValue::get_name);
        note!("--segments has no effect with --method {method}");
    }
    let tables = load_tables(args)?;
    let evaluator = match args.method {
        Method::Runtime => Evaluator::new(probe::Method::Runtime, &tables),
        Method::Gpu => Evaluator::on_device(&tables, open_gpu),
        Method::Reference => Evaluator::new(probe::Method::Reference, &tables),
        Method::Paper => Evaluator::new(
            probe::Method::Paper(args.segments.unwrap_or(SEGMENTS)),
            &tables,
        ),
    };
    let evaluator = evaluator.map_err(|error| match (&args.tables, &error) {
        (Some(path), ProbeError::Tables(_) | ProbeError::Fresnel(_)) => Failure::file(path, error),
        _ => Failure::input(error),
    })?;
    let mut reader = BufReader::with_capacity(MAX_LINE, io::stdin().lock());
    loop {
        let (batch, at_end) = read_batch(&mut reader).map_err(Failure::input)?;
        let requests: Vec<Result<Request, String>> = batch
            .into_iter()
            .map(|line| line.and_then(|line| Request::parse(&line)))
            .collect();
        for answer in evaluator.answer(&requests).map_err(Failure::input)? {
            let is_read = print_while_read(match answer {
                Ok(value) => json!({ "value": value }),
                Err(error) => json!({ "error": error }),
            })?;
            if !is_read {
                return Ok(());
            }
        }
        if at_end {
            return Ok(());
        }
    }
}

/// The shaders' functions with these tables, on the adapter.
fn open_gpu(tables: &ShadingTables) -> Result<Device, String> {
    let probe = GpuProbe::new(tables).map_err(|error| error.to_string())?;
    Ok(Box::new(move |queries, optics| {
        let values = probe.evaluate(queries, optics);
        values.map_err(|error| error.to_string())
    }))
}

/// The tables asked for, or the bundled ones.
fn load_tables(args: &Args) -> Result<TableFile, Failure> {
    match &args.tables {
        Some(path) => TableFile::read(path).map_err(Failure::input),
        None => default_tables(),
    }
}

/// A line, or why it cannot be a query.
type Line = Result<String, String>;

/// The next lines: at least one (unless the input ends), then those that have already arrived,
/// so that whoever waits for an answer before the next question gets it.
fn read_batch(reader: &mut BufReader<impl Read>) -> io::Result<(Vec<Line>, bool)> {
    let mut batch = Vec::new();
    loop {
        match read_line(reader)? {
            None => return Ok((batch, true)),
            Some(line) => batch.push(line),
        }
        if batch.len() >= MAX_BATCH || !reader.buffer().contains(&b'\n') {
            return Ok((batch, false));
        }
    }
}

/// The next line without its end, in bounded memory; `None` at the end of the input.
fn read_line(reader: &mut impl BufRead) -> io::Result<Option<Line>> {
    let mut bytes = Vec::new();
    let limit = MAX_LINE as u64 + 1;
    reader.by_ref().take(limit).read_until(b'\n', &mut bytes)?;
    if bytes.is_empty() {
        return Ok(None);
    }
    if bytes.last() == Some(&b'\n') {
        bytes.pop();
    } else if bytes.len() > MAX_LINE {
        reader.skip_until(b'\n')?;
        return Ok(Some(Err(format!("line is longer than {MAX_LINE} bytes"))));
    }
    Ok(Some(
        String::from_utf8(bytes).map_err(|_| "line is not UTF-8".to_owned()),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_in_bounded_memory() {
        let long = "x".repeat(MAX_LINE + 5);
        let text = format!("a\n\n{long}\nb");
        let mut reader = BufReader::new(text.as_bytes());
        let mut lines = Vec::new();
        while let Some(line) = read_line(&mut reader).unwrap() {
            lines.push(line);
        }
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[0], Ok("a".to_owned()));
        assert_eq!(lines[1], Ok(String::new()));
        assert!(lines[2].is_err());
        assert_eq!(lines[3], Ok("b".to_owned()));
    }
}
