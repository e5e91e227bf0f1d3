//! The kinds of items: the commands `lights`, `groom import` and `tables`, whose options are the keys
//! of a manifest.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgAction, ArgMatches, Args as _, FromArgMatches};
use serde_json::{Map, Value, json};
use strandlight_bake::manifest::{
    BakedItem, Bakery, Entry, Failure, Item, KindInfo, Resolved, Setting, unknown_key,
};
use strandlight_formats::BakedFile;
use strandlight_scene::progress::Progress;

use crate::cli::groom::import;
use crate::cli::{self, lights, tables, usage};

/// The kinds of items.
pub const KINDS: [KindInfo; 3] = [
    KindInfo {
        name: "lights",
        input: Some("map"),
        outputs: &[
            ("out", "lights"),
            ("report", "json"),
            ("page", "html"),
            ("preview", "png"),
            ("panorama", "panorama"),
            ("residual", "exr"),
        ],
        revision: 1,
    },
    KindInfo {
        name: "groom",
        input: Some("in"),
        outputs: &[("out", "groom")],
        revision: 1,
    },
    KindInfo {
        name: "tables",
        input: None,
        outputs: &[("out", "tables")],
        revision: 1,
    },
];

/// Options that a manifest says in other words, or that say nothing about the outputs.
/// A scene of `hair` would be an input that nobody looks at.
const NO_KEYS: [&str; 10] = [
    "output", "report", "preview", "panorama", "residual", "timings", "json", "hair", "help",
    "frames",
];

/// The command whose options are the keys of `kind`.
fn command(kind: &KindInfo) -> clap::Command {
    let command = clap::Command::new(kind.name).no_binary_name(true);
    match kind.name {
        "lights" => lights::FitArgs::augment_args(command),
        "groom" => import::Args::augment_args(command),
        _ => tables::Args::augment_args(command),
    }
}

/// The keys of a command and what they do.
fn keys(command: &clap::Command) -> impl Iterator<Item = (String, &clap::Arg)> {
    command.get_arguments().filter_map(|arg| {
        let long = arg.get_long().filter(|long| !NO_KEYS.contains(long))?;
        Some((long.replace('-', "_"), arg))
    })
}

/// The option that writes an output.
fn option_of(role: &str) -> &str {
    match role {
        "out" => "output",
        "page" => "report",
        role => role,
    }
}

/// The command line of an item, or the key to blame and what is wrong.
fn parse(
    kind: &KindInfo,
    input: Option<&Path>,
    outputs: &[(&str, PathBuf)],
    settings: &[Setting],
) -> Result<(clap::Command, ArgMatches), (String, String)> {
    let mut command = command(kind);
    command.build();
    let mut words: Vec<OsString> = Vec::new();
    for (role, path) in outputs {
        let mut word = OsString::from(format!("--{}=", option_of(role)));
        word.push(path);
        words.push(word);
    }
    for setting in settings {
        let found = keys(&command).find(|(key, _)| *key == setting.key);
        let Some((_, arg)) = found else {
            let names = kind.names().map(str::to_owned);
            let known: Vec<String> = names.chain(keys(&command).map(|(key, _)| key)).collect();
            let what = unknown_key(&setting.key, known.iter().map(String::as_str));
            return Err((setting.key.clone(), what));
        };
        let option = format!("--{}", arg.get_long().unwrap_or_default());
        for value in &setting.values {
            match (arg.get_action(), value.as_str()) {
                (ArgAction::SetTrue, "true") => words.push(option.clone().into()),
                (ArgAction::SetTrue, "false") => {}
                (ArgAction::SetTrue, _) => {
                    let what = format!("is {value}, must be true or false");
                    return Err((setting.key.clone(), what));
                }
                _ => words.push(format!("{option}={value}").into()),
            }
        }
    }
    words.extend(
        input
            .into_iter()
            .flat_map(|path| ["--".into(), path.into()]),
    );
    match command.clone().try_get_matches_from(words) {
        Ok(matches) => Ok((command, matches)),
        Err(error) => Err((key_of(&error, outputs), in_words(&error, outputs))),
    }
}

/// The key of a manifest that stands for an option, `--report`.
fn key_for(option: &str, outputs: &[(&str, PathBuf)]) -> String {
    let long = option.trim_start_matches("--");
    let role = outputs.iter().find(|(role, _)| option_of(role) == long);
    match role {
        Some((role, _)) => (*role).to_owned(),
        None => long.replace('-', "_"),
    }
}

/// Options that the parser names, as keys.
fn keys_in(error: &clap::Error, kind: ContextKind, outputs: &[(&str, PathBuf)]) -> Vec<String> {
    let args = match error.get(kind) {
        Some(ContextValue::String(arg)) => std::slice::from_ref(arg),
        Some(ContextValue::Strings(args)) => args,
        _ => &[],
    };
    let option = |arg: &String| arg.split([' ', '=']).next().unwrap_or_default().to_owned();
    let options = args.iter().map(option);
    let options = options.filter(|option| option.starts_with("--"));
    options.map(|option| key_for(&option, outputs)).collect()
}

/// The key that the parser complains about; empty if there is none, or one that is not there.
fn key_of(error: &clap::Error, outputs: &[(&str, PathBuf)]) -> String {
    match error.kind() {
        ErrorKind::MissingRequiredArgument => String::new(),
        _ => keys_in(error, ContextKind::InvalidArg, outputs)
            .pop()
            .unwrap_or_default(),
    }
}

/// What the parser says, of keys in place of options.
fn in_words(error: &clap::Error, outputs: &[(&str, PathBuf)]) -> String {
    let named = |kind: ContextKind| keys_in(error, kind, outputs).join(", ");
    match error.kind() {
        ErrorKind::ArgumentConflict => match named(ContextKind::PriorArg) {
            others if others.is_empty() => "may be given once".to_owned(),
            others => format!("cannot be used with {others}"),
        },
        ErrorKind::MissingRequiredArgument => {
            format!("{} is missing", named(ContextKind::InvalidArg))
        }
        _ => {
            let text = usage(error).to_string();
            let text = text.trim_end_matches(" (see --help)");
            // The key stands before the message.
            match text.split_once(" for '--") {
                Some((start, rest)) => match rest.split_once('\'') {
                    Some((_, end)) => format!("{start}{end}"),
                    None => text.to_owned(),
                },
                None => text.to_owned(),
            }
        }
    }
}

/// `text` of a command with the options of an entry of `kind` as keys. Names of files stay, whatever is in them.
fn with_keys(
    text: &str,
    kind: &KindInfo,
    command: &clap::Command,
    outputs: &[(&str, PathBuf)],
) -> String {
    let of_outputs = kind.outputs.iter().map(|(role, _)| option_of(role));
    let of_settings = keys(command).filter_map(|(_, arg)| arg.get_long());
    let options: Vec<&str> = of_settings.chain(of_outputs).collect();
    let mut said = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("--") {
        said.push_str(before);
        let goes_on = |c: char| c.is_alphanumeric() || "-_/.".contains(c);
        let end = after.find(|c| !goes_on(c)).unwrap_or(after.len());
        let (word, after) = after.split_at(end);
        let starts = |c: char| c.is_whitespace() || "('`".contains(c);
        if said.chars().next_back().is_none_or(starts) && options.contains(&word) {
            said.push_str(&key_for(word, outputs));
        } else {
            said.push_str("--");
            said.push_str(word);
        }
        rest = after;
    }
    said.push_str(rest);
    said
}

/// All parameters of an entry by name, with their defaults.
pub fn resolve(entry: &Entry) -> Resolved {
    // Where they lie does not matter yet.
    let input = entry.kind.input.map(|_| Path::new("input"));
    let outputs = entry.outputs.iter();
    let outputs: Vec<(&str, PathBuf)> = outputs
        .map(|setting| (setting.key.as_str(), PathBuf::from(&setting.key)))
        .collect();
    let (command, matches) = parse(&entry.kind, input, &outputs, &entry.settings)?;
    let mut parameters = BTreeMap::new();
    for (key, arg) in keys(&command) {
        let id = arg.get_id().as_str();
        let value = match arg.get_action() {
            ArgAction::SetTrue => matches.get_flag(id).then(|| "true".to_owned()),
            _ => matches.get_raw(id).map(|values| {
                let values = values.map(|value| value.to_string_lossy().into_owned());
                values.collect::<Vec<_>>().join(", ")
            }),
        };
        parameters.extend(value.map(|value| (key, value)));
    }
    Ok(parameters)
}

/// Makes items as the commands do.
pub struct Kitchen {
    progress: Arc<Progress>,
}

impl Kitchen {
    /// One that says on `progress` what the commands say.
    pub fn new(progress: Arc<Progress>) -> Self {
        Kitchen { progress }
    }
}

impl Bakery for Kitchen {
    fn bake(&self, item: &Item) -> Result<BakedItem, Failure> {
        let outputs = item.outputs.iter();
        let outputs: Vec<(&str, PathBuf)> = outputs
            .map(|output| (output.role, item.resolve(&output.path)))
            .collect();
        let input = item.input_path();
        let parsed = parse(&item.kind, input.as_deref(), &outputs, &item.settings);
        let (command, matches) =
            parsed.map_err(|(key, what)| Failure::input(format!("{key}: {what}")))?;
        let progress = quiet(&self.progress, item.name());
        let made = match item.kind.name {
            "lights" => bake_lights(&args_of(&matches)?, &told(item)?, item, &progress),
            "groom" => bake_groom(&args_of(&matches)?),
            _ => tables::bake(&args_of(&matches)?, &progress).map(|bytes| BakedItem {
                outputs: vec![bytes],
                figures: Map::new(),
            }),
        };
        made.map_err(|failure| match failure {
            cli::Failure::Transient(what) => Failure::transient(what),
            failure => Failure::input(with_keys(
                &failure.to_string(),
                &item.kind,
                &command,
                &outputs,
            )),
        })
    }
}

fn args_of<T: FromArgMatches>(matches: &ArgMatches) -> Result<T, Failure> {
    T::from_arg_matches(matches).map_err(|error| Failure::input(in_words(&error, &[])))
}

/// The words of `item` as seen from the manifest's folder: what a page tells is the same from wherever it is made.
fn told<T: FromArgMatches>(item: &Item) -> Result<T, Failure> {
    let outputs = item.outputs.iter();
    let outputs: Vec<(&str, PathBuf)> = outputs
        .map(|output| (output.role, output.path.clone()))
        .collect();
    let parsed = parse(&item.kind, item.input.as_deref(), &outputs, &item.settings);
    let (_, matches) = parsed.map_err(|(key, what)| Failure::input(format!("{key}: {what}")))?;
    args_of(&matches)
}

fn figures(pairs: Value) -> Map<String, Value> {
    match pairs {
        Value::Object(pairs) => pairs,
        _ => Map::new(),
    }
}

fn bake_lights(
    args: &lights::FitArgs,
    told: &lights::FitArgs,
    item: &Item,
    progress: &Progress,
) -> Result<BakedItem, cli::Failure> {
    let baked = lights::bake(args, told, &lights::Plan::of(args)?, progress)?;
    if let Some(missed) = lights::missed_budget(args, &baked) {
        return Err(missed);
    }
    let mut about = json!({ "lights": baked.results.set.lights.len() });
    if baked.results.report.is_some() {
        for key in ["fibre_error", "irradiance_error", "rel_l2", "energy_ratio"] {
            about[key] = baked.document[key].clone();
        }
    }
    let outputs = item.outputs.iter().map(|output| match output.role {
        "out" => baked.bytes.clone(),
        _ => {
            let bytes = baked.file(&item.resolve(&output.path));
            bytes.map(<[u8]>::to_vec).unwrap_or_default()
        }
    });
    Ok(BakedItem {
        outputs: outputs.collect(),
        figures: figures(about),
    })
}

fn bake_groom(args: &import::Args) -> Result<BakedItem, cli::Failure> {
    let groom = import::groom(args)?;
    let bytes = groom.to_bytes().map_err(cli::Failure::input)?;
    let about = json!({ "strands": groom.n_strands(), "points": groom.points.len() });
    Ok(BakedItem {
        outputs: vec![bytes],
        figures: figures(about),
    })
}

/// A progress that passes on only what is said.
fn quiet(progress: &Arc<Progress>, name: String) -> Progress {
    struct Says(Arc<Progress>, String);
    impl strandlight_scene::progress::ProgressDisplay for Says {
        fn advance(&self, _: u64) {}
        fn reach(&self, _: u64) {}
        fn say(&self, line: &str) {
            self.0.say(&format!("{}: {line}", self.1));
        }
        fn finish(&self) {}
    }
    Progress::new(Says(Arc::clone(progress), name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_bake::manifest::Output;

    fn entry(kind: KindInfo, settings: &[(&str, &str)]) -> Entry {
        let setting = |key: &str, value: &str| Setting {
            key: key.to_owned(),
            values: vec![value.to_owned()],
            at: Default::default(),
            path: key.to_owned(),
        };
        Entry {
            kind,
            name: String::new(),
            at: Default::default(),
            inputs: None,
            outputs: vec![setting("out", "x")],
            settings: settings
                .iter()
                .map(|(key, value)| setting(key, value))
                .collect(),
        }
    }

    #[test]
    fn parameters_have_their_defaults() {
        let [lights, groom, tables] = KINDS;
        let resolved = resolve(&entry(lights, &[("seed", "7"), ("no_report", "true")]));
        let resolved = resolved.expect("good settings");
        let expected = [
            ("count", "40"),
            ("layout", "latlong"),
            ("no_report", "true"),
            ("seed", "7"),
        ];
        for (name, value) in expected {
            assert_eq!(
                resolved.get(name).map(String::as_str),
                Some(value),
                "{name}"
            );
        }
        let groom =
            resolve(&entry(groom, &[("unit", "m"), ("up", "auto")])).expect("good settings");
        assert_eq!(groom.get("unit").map(String::as_str), Some("m"));
        assert_eq!(groom.get("frame").map(String::as_str), Some("0"));
        let tables = resolve(&entry(tables, &[("lean", "false")])).expect("good settings");
        assert_eq!(tables.get("lean"), None);
    }

    #[test]
    fn options_are_said_as_keys_and_file_names_as_they_are() {
        let [lights, groom, tables] = KINDS;
        let report = [("page", PathBuf::from("a.html"))];
        for (kind, text, expected) in [
            (
                groom,
                "/shots/sky--unit/a.abc: what is --unit",
                "/shots/sky--unit/a.abc: what is unit",
            ),
            (
                groom,
                "a --unit/b.abc: is empty",
                "a --unit/b.abc: is empty",
            ),
            (groom, "a --unit.abc: is empty", "a --unit.abc: is empty"),
            (groom, "wrong (see --help)", "wrong (see --help)"),
            (
                lights,
                "--max-error 0.1 is not met: '--count', (--suns) or `--no-report`",
                "max_error 0.1 is not met: 'count', (suns) or `no_report`",
            ),
            (lights, "--report and --output", "page and output"),
            (tables, "--report", "--report"),
        ] {
            let said = with_keys(text, &kind, &command(&kind), &report);
            assert_eq!(said, expected);
        }
    }

    #[test]
    fn a_page_is_the_same_from_wherever_it_is_made() {
        let made = |folder: &Path| {
            let item = Item {
                kind: KINDS[0],
                entry: Default::default(),
                input: Some("maps/a.hdr".into()),
                outputs: [("out", "o/a.lights"), ("page", "o/a.html")]
                    .map(|(role, path)| Output {
                        role,
                        path: path.into(),
                    })
                    .to_vec(),
                settings: entry(KINDS[0], &[("count", "1")]).settings,
                parameters: BTreeMap::new(),
                folder: folder.to_owned(),
            };
            std::fs::create_dir(folder.join("maps")).expect("made");
            let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n".to_vec();
            map.extend([100, 140, 130, 128].repeat(16 * 32));
            std::fs::write(folder.join("maps/a.hdr"), map).expect("written");
            let kitchen = Kitchen::new(Arc::new(Progress::silent()));
            let page = kitchen.bake(&item).expect("baked").outputs.pop();
            String::from_utf8(page.expect("two outputs")).expect("a page")
        };
        let [one, two] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let page = made(one.path());
        assert!(page.contains("strandlight lights maps/a.hdr -o o/a.lights"));
        assert!(!page.contains(&*one.path().to_string_lossy()));
        assert_eq!(page, made(two.path()));
    }

    #[test]
    fn bad_settings_are_blamed_on_their_key() {
        let [lights, groom, tables] = KINDS;
        for (kind, key, value, needle) in [
            (
                lights,
                "count",
                "0",
                "invalid value '0': not a number from 1 to 1024",
            ),
            (lights, "cuont", "4", "unknown; did you mean count?"),
            (lights, "json", "true", "unknown"),
            (lights, "no_report", "4", "must be true or false"),
            (groom, "up", "w", "invalid value 'w'"),
            (groom, "unit", "furlong", "must be mm"),
            (
                tables,
                "fresnel",
                "glass",
                "possible values: dielectric, schlick",
            ),
        ] {
            let (blamed, what) = resolve(&entry(kind, &[(key, value)])).expect_err(key);
            assert_eq!(blamed, key);
            assert!(
                what.contains(needle) && !what.contains("--"),
                "{key}: {what}"
            );
        }
        let mut page = entry(lights, &[("no_report", "true")]);
        page.outputs
            .extend(entry(lights, &[]).outputs.pop().map(|out| Setting {
                key: "page".to_owned(),
                ..out
            }));
        let blamed = resolve(&page).expect_err("two that exclude each other");
        assert_eq!(
            blamed,
            (
                "page".to_owned(),
                "cannot be used with no_report".to_owned()
            )
        );
        let blamed = resolve(&entry(lights, &[("suns", "2")])).expect_err("half of it");
        assert_eq!(blamed, (String::new(), "residual is missing".to_owned()));
        let (_, known) = resolve(&entry(lights, &[("frizzle", "2")])).expect_err("unknown");
        assert!(known.contains("known are map, out, report, "), "{known}");
    }
}
