//! `strandview`: shows a scene in a window, or renders frames of it without one.
//!
//! Exit codes: 0 done; 2 bad usage or bad input; 129, 130 and 143 ended by SIGHUP, SIGINT and SIGTERM.

mod args;
mod headless;
mod output;
mod window;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use args::{Args, Job, USAGE, help};
use output::say;

fn main() -> ExitCode {
    let words: Vec<OsString> = std::env::args_os().skip(1).collect();
    let has = |options: [&str; 2]| words.iter().any(|word| options.iter().any(|of| word == of));
    if has(["--help", "-h"]) {
        return ended(say(format_args!("{USAGE}\n{}", help())));
    }
    if has(["--version", "-V"]) {
        return ended(say(concat!("strandview ", env!("CARGO_PKG_VERSION"))));
    }
    ended(args::parse(words.into_iter()).and_then(|args| run(&args)))
}

fn ended(answer: Result<(), String>) -> ExitCode {
    match answer {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            let message = strandlight_formats::system_in_plain_words(&message);
            let lines: Vec<&str> = message.lines().map(str::trim).collect();
            let _ = writeln!(std::io::stderr(), "strandview: {}", lines.join(" "));
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    strandlight_runtime::work::end_all_when_interrupted();
    match args.job {
        Job::Window => window::run(args),
        _ => headless::run(args).map_err(|error| error.to_string()),
    }
}
