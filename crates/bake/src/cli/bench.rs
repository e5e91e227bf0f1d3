//! `strandlight bench`: run time against error.

mod against;
mod converge;
mod edit;
mod frames;
mod growth;
mod method_tables;
mod multiple;
mod peers;
mod plots;
mod scenes;
mod single;
mod transmittance;

use super::Outcome;

/// Benchmark speed against accuracy
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Edit(edit::Args),
    Frames(frames::Args),
    Peers(peers::Args),
    Converge(converge::Args),
    Growth(growth::Args),
    Single(single::Args),
    Multiple(multiple::Args),
    Transmittance(transmittance::Args),
    Plots(plots::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.what {
        What::Edit(args) => edit::run(args),
        What::Frames(args) => frames::run(args),
        What::Peers(args) => peers::run(args),
        What::Converge(args) => converge::run(args),
        What::Growth(args) => growth::run(args),
        What::Single(args) => single::run(args),
        What::Multiple(args) => multiple::run(args),
        What::Transmittance(args) => transmittance::run(args),
        What::Plots(args) => plots::run(args),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command() -> clap::Command {
        <Args as clap::Args>::augment_args(clap::Command::new("bench"))
    }

    #[test]
    fn lists_say_how_to_write_them() {
        let mut n_checked = 0;
        for subcommand in command().get_subcommands() {
            let lists = subcommand.get_arguments();
            for list in lists.filter(|list| list.get_value_delimiter().is_some()) {
                let help = list.get_help().map(ToString::to_string).unwrap_or_default();
                let id = list.get_id();
                assert!(help.contains("comma-separated"), "{id}: {help}");
                // Several defaults are shown with spaces between.
                let is_one = list.get_default_values().len() <= 1;
                assert!(is_one || list.is_hide_default_value_set(), "{id}");
                n_checked += 1;
            }
        }
        assert_eq!(n_checked, 8);
    }

    #[test]
    fn defaults_are_lists() {
        for (line, id, expected) in [
            ("bench growth", "points", 5),
            ("bench growth", "lights", 6),
            ("bench growth", "sizes", 5),
            ("bench peers a.toml", "samples", 3),
            ("bench peers --scattering total a.toml", "samples", 5),
            ("bench converge a.toml", "samples", 5),
            ("bench transmittance a.toml", "methods", 4),
        ] {
            let matches = command().try_get_matches_from(line.split(' '));
            let matches = matches.expect("complete");
            let (_, matches) = matches.subcommand().expect("a subcommand");
            // Of each value, where it is.
            let values = matches.indices_of(id).map_or(0, Iterator::count);
            assert_eq!(values, expected, "{line}: {id}");
        }
    }
}
