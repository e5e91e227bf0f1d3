//! `strandlight man`: the reference of the command line, made from the parser itself.

use std::fmt::Write;
use std::path::PathBuf;

use super::{Failure, Outcome, check_outputs, output_folder, print_line, write_output};

/// Write man pages, one per command
///
/// With --markdown, writes one Markdown page: the command reference of the handbook.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the man pages, created if missing; with --markdown, file to write, - for standard
    /// output
    #[arg(short, long, value_name = "DIR|FILE")]
    output: PathBuf,
    /// Write one Markdown page instead
    #[arg(long)]
    markdown: bool,
}

/// Runs the command; `program` is the parser of the whole command line.
pub fn run(args: &Args, mut program: clap::Command) -> Outcome {
    program.build();
    if args.markdown {
        check_outputs(&[], &[&args.output])?;
        write_output(&args.output, markdown(&program).as_bytes())?;
        return print_line(format_args!("wrote {}", args.output.display()));
    }
    let _new = output_folder(&args.output)?;
    let mut pages = Vec::new();
    man_pages(&program, &mut pages)?;
    for (name, page) in &pages {
        write_output(&args.output.join(name), page)?;
    }
    let folder = args.output.display();
    print_line(format_args!("wrote {} man pages to {folder}", pages.len()))
}

/// The man pages of `command` and of its subcommands, each with its file name.
fn man_pages(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> Outcome {
    let man = clap_mangen::Man::new(command.clone());
    let mut page = Vec::new();
    man.render(&mut page).map_err(Failure::input)?;
    pages.push((man.get_filename(), page));
    documented(command).try_for_each(|subcommand| man_pages(subcommand, pages))
}

/// Subcommands that a reader should know, without clap's own `help`.
fn documented(command: &clap::Command) -> impl Iterator<Item = &clap::Command> {
    command
        .get_subcommands()
        .filter(|subcommand| !subcommand.is_hide_set() && subcommand.get_name() != "help")
}

/// The whole command line as a Markdown page.
fn markdown(program: &clap::Command) -> String {
    let mut page = String::from(
        "# Commands\n\n\
         <!-- Generated from the command-line parser: strandlight man --markdown -o FILE.\n\
         \x20    To update: STRANDLIGHT_UPDATE_DOCS=1 cargo test -p strandlight-tests --test cli docs:: -->\n\n\
         Every command takes `--help` (this page is that text), and the [options of all \
         commands](#options-of-all-commands).\n",
    );
    for command in documented(program) {
        section(command, &mut page);
    }
    page.push_str("\n## Options of all commands\n\n");
    let shared = program.get_arguments().filter(|arg| arg.is_global_set());
    shared.for_each(|arg| argument(arg, &mut page));
    page
}

fn section(command: &clap::Command, page: &mut String) {
    let name = command.get_bin_name().unwrap_or(command.get_name());
    let depth = "#".repeat(name.split(' ').count().clamp(2, 6));
    // Writing to a string cannot fail.
    let _ = write!(page, "\n{depth} `{name}`\n");
    let about = command.get_long_about().or(command.get_about());
    if let Some(about) = about {
        let _ = write!(page, "\n{}\n", escaped(about.to_string().trim()));
    }
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage:").trim();
    let _ = write!(page, "\n```text\n{usage}\n```\n");
    let own = |arg: &&clap::Arg| {
        !arg.is_hide_set()
            && !arg.is_global_set()
            && !["help", "version"].contains(&arg.get_id().as_str())
    };
    let own: Vec<_> = command.get_arguments().filter(own).collect();
    if !own.is_empty() {
        page.push('\n');
    }
    own.iter().for_each(|arg| argument(arg, page));
    for subcommand in documented(command) {
        section(subcommand, page);
    }
}

/// A list item: the argument as one types it, what it does, its values and its default.
fn argument(arg: &clap::Arg, page: &mut String) {
    let takes_value = arg.get_action().takes_values();
    let names = arg.get_value_names().unwrap_or_default();
    let value: Vec<String> = names.iter().map(|name| format!("<{name}>")).collect();
    let value = match takes_value {
        true => value.join(" "),
        false => String::new(),
    };
    let flags = [
        arg.get_short().map(|short| format!("-{short}")),
        arg.get_long().map(|long| format!("--{long}")),
    ];
    let flags: Vec<String> = flags.into_iter().flatten().collect();
    let shown = match (flags.is_empty(), value.is_empty()) {
        (true, _) => value,
        (false, true) => flags.join(", "),
        (false, false) => format!("{} {value}", flags.join(", ")),
    };
    let _ = write!(page, "- `{shown}`");
    if arg.is_required_set() && !flags.is_empty() {
        page.push_str(" (required)");
    }
    if let Some(help) = arg.get_long_help().or(arg.get_help()) {
        let _ = write!(page, ": {}", escaped(&help.to_string()).replace('\n', " "));
    }
    let hides_values = arg.is_hide_possible_values_set() || !takes_value;
    let values = arg.get_possible_values();
    let values: Vec<_> = values.iter().filter(|value| !value.is_hide_set()).collect();
    if !hides_values && !values.is_empty() {
        let all: Vec<String> = values
            .iter()
            .map(|value| match value.get_help() {
                Some(help) => format!("`{}` ({})", value.get_name(), escaped(&help.to_string())),
                None => format!("`{}`", value.get_name()),
            })
            .collect();
        let _ = write!(page, "; one of {}", all.join(", "));
    }
    let defaults = arg.get_default_values();
    if takes_value && !defaults.is_empty() && !arg.is_hide_default_value_set() {
        let defaults: Vec<_> = defaults
            .iter()
            .map(|value| value.to_string_lossy())
            .collect();
        let _ = write!(page, "; default `{}`", defaults.join(" "));
    }
    page.push('\n');
}

/// `text` as Markdown that shows it as it is: outside of code, no HTML and no links.
fn escaped(text: &str) -> String {
    let mut is_code = false;
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '`' => is_code = !is_code,
            '<' | '>' | '[' | ']' | '*' | '_' if !is_code => out.push('\\'),
            _ => {}
        }
        out.push(character);
    }
    out
}
