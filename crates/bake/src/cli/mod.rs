//! The commands, one file each: `Args` are parsed by clap, `run` does the work.

pub mod bake;
pub mod bench;
pub mod compare;
pub mod completions;
pub mod demo;
pub mod export;
pub mod groom;
pub mod inspect;
mod light;
pub mod lights;
pub mod man;
pub mod mesh;
mod output;
mod overrides;
pub mod probe;
pub mod progress;
pub mod reference;
pub mod render;
pub mod scenes;
pub mod shard;
pub mod stress;
pub mod tables;
pub mod verify;

use std::fmt;
use std::path::Path;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue};
use strandlight_formats::system_in_plain_words;
use strandlight_lab::transmittance::Method;

pub use output::{
    STDOUT, check_extension, check_not_of_scene, check_not_taken, check_outputs,
    check_own_extension, check_report_extension, is_stream, output_folder, print_failure,
    print_line, print_while_read, try_print, want_json, write_output,
};

/// Says a line on stderr, unless `--quiet`; a closed stderr is no error.
macro_rules! note {
    ($($text:tt)*) => {{
        use std::io::Write;
        if !crate::cli::progress::is_quiet() {
            let _ = writeln!(std::io::stderr(), $($text)*);
        }
    }};
}
use note;

/// Parses `--transmittance METHOD`.
fn transmittance_method() -> impl clap::builder::TypedValueParser<Value = Method> {
    let names = Method::ALL.map(Method::name);
    PossibleValuesParser::new(names).map(|name| {
        let mut methods = Method::ALL.into_iter();
        methods
            .find(|method| method.name() == name)
            .unwrap_or_default()
    })
}

/// Why a command did not do what was asked; printed as one line on stderr.
#[derive(Debug)]
pub enum Failure {
    /// A check was made and failed: exit code 1.
    Check(String),
    /// Bad usage or bad input: exit code 2.
    Input(String),
    /// What may succeed later, such as writing to a disk that is full: exit code 75.
    Transient(String),
}

impl Failure {
    /// Any error of a library, as bad input.
    pub fn input(error: impl fmt::Display) -> Self {
        Failure::Input(error.to_string())
    }

    /// An error about `path`.
    pub fn file(path: &Path, error: impl fmt::Display) -> Self {
        Failure::Input(format!("{}: {error}", path.display()))
    }

    /// The process exit code that stands for this failure.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Check(_) => 1,
            Failure::Input(_) => 2,
            // EX_TEMPFAIL of sysexits.h.
            Failure::Transient(_) => 75,
        }
    }

    /// Its kind in JSON.
    pub fn kind(&self) -> &'static str {
        match self {
            Failure::Check(_) => "check",
            Failure::Input(_) => "input",
            Failure::Transient(_) => "transient",
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Failure::Check(text) | Failure::Input(text) | Failure::Transient(text)) = self;
        let text = system_in_plain_words(text);
        // One line, whatever a library put into its message.
        for (ix, line) in text
            .lines()
            .map(str::trim)
            .filter(|line| !line.is_empty())
            .enumerate()
        {
            write!(f, "{}{line}", if ix == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

/// What clap says of a command line, without its usage text: one line like every other failure.
pub fn usage(error: &clap::Error) -> Failure {
    let rendered = error.render().to_string();
    let text = rendered.strip_prefix("error: ").unwrap_or(&rendered);
    let first = text.split("\n\n").next().unwrap_or(text);
    let first: Vec<&str> = first.lines().map(str::trim).collect();
    let first = numbers_in_plain_words(&first.join(" "));
    let meant = match suggestions(error).join(" or ") {
        names if names.is_empty() => String::new(),
        names => format!("; did you mean {names}?"),
    };
    Failure::Input(format!("{first}{meant} (see --help)"))
}

/// What the standard library says of numbers that it cannot read, in words of people who give them.
fn numbers_in_plain_words(text: &str) -> String {
    [
        ("invalid digit found in string", "not a whole number"),
        ("number too large to fit in target type", "too large"),
        ("number too small to fit in target type", "too small"),
        ("cannot parse integer from empty string", "no number"),
        ("invalid float literal", "not a number"),
        ("cannot parse float from empty string", "no number"),
    ]
    .iter()
    .fold(text.to_owned(), |text, (std, plain)| {
        match text.strip_suffix(std) {
            Some(start) => format!("{start}{plain}"),
            None => text,
        }
    })
}

/// What clap thinks was meant.
fn suggestions(error: &clap::Error) -> Vec<String> {
    let kinds = [
        ContextKind::SuggestedSubcommand,
        ContextKind::SuggestedArg,
        ContextKind::SuggestedValue,
    ];
    let suggested = kinds.iter().filter_map(|&kind| error.get(kind));
    let names = suggested.flat_map(|value| match value {
        ContextValue::String(name) => vec![name.clone()],
        ContextValue::Strings(names) => names.clone(),
        _ => Vec::new(),
    });
    // An option may come with its value's name: --count <COUNT>.
    let name = |text: String| text.split(' ').next().unwrap_or_default().to_owned();
    names.map(name).collect()
}

/// A fraction in 0..=1, as such or as `2%`.
fn parse_error(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text, 1.0),
    };
    match number.parse::<f64>().map(|number| number * unit) {
        Ok(error) if (0.0..=1.0).contains(&error) => Ok(error),
        _ => Err("not a fraction in 0..=1 or per cent in 0%..=100%".to_owned()),
    }
}

/// What every command answers.
pub type Outcome = Result<(), Failure>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_fractions_or_per_cent() {
        for (text, limit) in [("2%", 0.02), ("0.5 %", 0.005), ("0.02", 0.02), ("1", 1.0)] {
            let found = parse_error(text).unwrap();
            assert!((found - limit).abs() < 1e-15, "{text}: {found}");
        }
        for text in ["2", "-1%", "101%", "%", "", "NaN", "inf", "x"] {
            assert!(parse_error(text).is_err(), "{text}");
        }
    }
}
