//! The command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use strandlight_formats::nearest;
use strandlight_runtime::BackendChoice;
use strandlight_runtime::options::{OptionError, parse_key, parse_size, parse_time};
use strandlight_runtime::script::MAX_SCRIPT_FRAMES;
use strandlight_scene::budget::{MAX_PIXELS, MAX_SAMPLES, MAX_SECONDS, MAX_SIDE};

/// The first line of `--help`, appended to every error about the command line.
pub const USAGE: &str = "usage: strandview [FILE] [--set KEY=VALUE]... [--size WxH] [--samples N], opens a window with a \
                         scene, hair, a light set, an HDR map, a LUT or the sample; without one: strandview SCENE.toml --frame \
                         OUT.png | --turntable N --output DIR | --script EDITS.json --output DIR";

/// The rest of `--help`.
pub fn help() -> String {
    format!(
        "
  --frame OUT.png        Render one frame without a window; - for standard output
  --turntable N          Render N frames of a full turn about +Y: 0000.png, 0001.png, ...
  --script EDITS.json    Render the frames of a list of edits and views
  --output DIR, -o DIR   Folder for the frames and timings.json, created if missing
  --set KEY=VALUE        Override a key of the scene file, such as hair.eta=1.6 or
                         render.background=none; repeatable
  --size WxH             Width and height of the window or picture in pixels, each 1..={MAX_SIDE} and
                         together at most {MAX_PIXELS} pixels
                         [default: 1280x720 points for the window, else the scene's]
  --time SECONDS         Animation time in seconds, 0..={MAX_SECONDS} [default: 0]
  --samples N            Samples per pixel of frames drawn on a GPU, 1..={MAX_SAMPLES} [default: the
                         scene's]; a window draws without, where it can
  --backend BACKEND      Renderer: auto, gpu or cpu; auto uses the GPU if there is one, and the CPU
                         rather than a software adapter [default: auto]
  --stats                Print counts and times of the picture, of one frame alone
  --quiet                Print nothing on stderr except errors
  --log EVENTS.json      Write UI events to EVENTS.json as JSON Lines"
    )
}

/// All options, for suggestions when one is mistyped.
const OPTIONS: [&str; 12] = [
    "--frame",
    "--turntable",
    "--script",
    "--output",
    "--set",
    "--size",
    "--time",
    "--samples",
    "--backend",
    "--stats",
    "--quiet",
    "--log",
];

/// What is to be done with the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Job {
    /// Shown in a window.
    #[default]
    Window,
    /// One frame in a file.
    Frame(PathBuf),
    /// So many frames of a full turn.
    Turntable(u32),
    /// The frames of a script.
    Script(PathBuf),
}

/// A command line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Args {
    /// The scene file, or for a window another file that one is made around; without one a window
    /// opens the sample.
    pub scene: Option<PathBuf>,
    /// What is done with it.
    pub job: Job,
    /// Folder for frames.
    pub output: Option<PathBuf>,
    /// Which renderer draws.
    pub backend: BackendChoice,
    /// Whether to print what a frame took.
    pub stats: bool,
    /// Whether to print nothing except errors.
    pub quiet: bool,
    /// File for the events of the window.
    pub log: Option<PathBuf>,
    /// For tests of the window: its device is lost after the first picture.
    pub loses_device: bool,
    /// Seconds since the start of the scene's motion.
    pub time: f64,
    /// Keys of the scene and their values; those of `--size` and `--samples`, which take
    /// precedence, are among them.
    pub set: Map<String, Value>,
}

/// Parses the words after the program's name.
///
/// # Errors
/// One line that says what is wrong.
pub fn parse(mut words: impl Iterator<Item = OsString>) -> Result<Args, String> {
    let mut args = Args::default();
    let mut scene = None;
    let mut job = None;
    let mut flags = Map::new();
    while let Some(word) = words.next() {
        let text = word.to_string_lossy().into_owned();
        let mut value = || {
            let value = words
                .next()
                .ok_or(format!("{text} needs a value; {USAGE}"))?;
            value
                .to_str()
                .map(str::to_owned)
                .ok_or(format!("{text}: the value is not UTF-8"))
        };
        let mut set_job = |new: Job| match job.replace(new) {
            Some(_) => Err(format!(
                "only one of --frame, --turntable and --script; {USAGE}"
            )),
            None => Ok(()),
        };
        match text.as_str() {
            "--frame" => set_job(Job::Frame(value()?.into()))?,
            "--turntable" => {
                let n = number(&text, &value()?, MAX_SCRIPT_FRAMES)?;
                set_job(Job::Turntable(n))?;
            }
            "--script" => set_job(Job::Script(value()?.into()))?,
            "--output" | "-o" | "--out" => args.output = Some(value()?.into()),
            "--backend" => args.backend = backend(&value()?)?,
            "--log" => args.log = Some(value()?.into()),
            "--stats" => args.stats = true,
            "--quiet" => args.quiet = true,
            "--lose-device" => args.loses_device = true,
            "--set" => {
                let (key, value) = shared(&text, &value()?, parse_key)?;
                args.set.insert(key, value);
            }
            "--size" => {
                let size = shared(&text, &value()?, parse_size)?;
                flags.insert("render.size".to_owned(), size.to_vec().into());
            }
            "--time" => args.time = shared(&text, &value()?, parse_time)?,
            "--samples" => {
                let samples = number(&text, &value()?, MAX_SAMPLES)?;
                flags.insert("render.samples".to_owned(), samples.into());
            }
            _ if text.starts_with('-') => {
                let meant = match nearest(text.split('=').next().unwrap_or(&text), OPTIONS) {
                    Some(option) => format!("; did you mean {option}?"),
                    None => String::new(),
                };
                return Err(format!("unknown option {text}{meant}; {USAGE}"));
            }
            _ if scene.is_none() => scene = Some(PathBuf::from(&word)),
            _ => return Err(format!("unexpected argument {text}; {USAGE}")),
        }
    }
    args.job = job.unwrap_or_default();
    if scene.is_none() && args.job != Job::Window {
        return Err(format!(
            "a scene file is missing: pictures without a window are of one; {USAGE}"
        ));
    }
    args.scene = scene;
    args.set.extend(flags);
    let job = match args.job {
        Job::Window => None,
        Job::Frame(_) => Some("--frame"),
        Job::Turntable(_) => Some("--turntable"),
        Job::Script(_) => Some("--script"),
    };
    let of_window = [
        ("--log", args.log.is_some()),
        ("--lose-device", args.loses_device),
    ];
    let of_window = of_window.into_iter().find(|(_, is_given)| *is_given);
    if let (Some(job), Some((flag, _))) = (job, of_window) {
        return Err(format!("{flag} is for the window; leave it out with {job}"));
    }
    if args.stats {
        let with = match (&args.job, job) {
            (Job::Frame(_), _) => args.quiet.then_some("--quiet"),
            (_, Some(job)) => Some(job),
            (_, None) => Some("a window"),
        };
        if let Some(with) = with {
            return Err(format!(
                "--stats prints something about the picture of --frame; leave it out with {with}"
            ));
        }
    }
    let is_many = matches!(args.job, Job::Turntable(_) | Job::Script(_));
    match (is_many, &args.output) {
        (true, None) => Err(format!("the frames need a folder: --output DIR; {USAGE}")),
        (true, Some(out)) if out == Path::new("-") => Err(format!(
            "--output -: the frames need a folder, not standard output; {USAGE}"
        )),
        (false, Some(_)) => {
            let without = job.map_or(String::new(), |job| format!(", not for {job}"));
            Err(format!(
                "--output is for --turntable and --script{without}; {USAGE}"
            ))
        }
        _ => Ok(args),
    }
}

fn backend(text: &str) -> Result<BackendChoice, String> {
    let mut all = BackendChoice::ALL.into_iter();
    let known = all.find(|choice| choice.name() == text);
    known.ok_or(format!("--backend {text}: must be auto, gpu or cpu"))
}

fn number(option: &str, text: &str, most: u32) -> Result<u32, String> {
    let number = text.parse().ok().filter(|n| (1..=most).contains(n));
    number.ok_or(format!("{option} {text}: must be 1..={most}"))
}

/// The value of an option that `strandlight` has as well.
fn shared<T>(
    option: &str,
    text: &str,
    parse: fn(&str) -> Result<T, OptionError>,
) -> Result<T, String> {
    parse(text).map_err(|error| format!("{option} {text}: {error}"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn parsed(line: &str) -> Result<Args, String> {
        parse(line.split_whitespace().map(OsString::from))
    }

    #[test]
    fn lines_are_read() {
        let args = parsed("a.toml --set hair.eta=1.6 --size 20x10 --turntable 8 --out d").unwrap();
        assert_eq!(args.job, Job::Turntable(8));
        assert_eq!(args.set["hair.eta"], json!(1.6));
        assert_eq!(args.set["render.size"], json!([20, 10]));
        // A flag of its own stands over the key, wherever it is.
        for line in [
            "a.toml --samples 8 --set render.samples=4",
            "a.toml --set render.samples=4 --samples 8",
        ] {
            assert_eq!(parsed(line).unwrap().set["render.samples"], json!(8));
        }
        assert_eq!(parsed("a.toml").unwrap().job, Job::Window);
        assert_eq!(
            parsed("--set render.background=none a.toml")
                .unwrap()
                .set
                .len(),
            1
        );
    }

    /// Each pair of flags is taken as it stands, or refused by a line that names both.
    #[test]
    fn every_pair_of_flags_is_taken_or_refused_by_name() {
        const FLAGS: [(&str, &str); 12] = [
            ("--frame", "a.png"),
            ("--turntable", "2"),
            ("--script", "s.json"),
            ("--output", "d"),
            ("--set", "hair.eta=1.6"),
            ("--size", "20x10"),
            ("--time", "1.5"),
            ("--samples", "8"),
            ("--log", "l.json"),
            ("--backend", "cpu"),
            ("--stats", ""),
            ("--quiet", ""),
        ];
        // What USAGE and the help say of flags is all of these.
        let help = help();
        for limit in [MAX_SIDE, MAX_PIXELS, MAX_SAMPLES] {
            assert!(help.contains(&limit.to_string()), "{limit}");
        }
        let words = help
            .split_whitespace()
            .filter(|word| word.starts_with("--"));
        let mut documented: Vec<&str> = words.collect();
        let mut known = FLAGS.map(|(flag, _)| flag).to_vec();
        documented.sort_unstable();
        known.sort_unstable();
        assert_eq!(documented, known);
        let shows = |args: &Args, flag: &str| match flag {
            "--frame" => args.job == Job::Frame("a.png".into()),
            "--turntable" => args.job == Job::Turntable(2),
            "--script" => args.job == Job::Script("s.json".into()),
            "--output" => args.output == Some("d".into()),
            "--set" => args.set["hair.eta"] == 1.6,
            "--size" => args.set["render.size"] == json!([20, 10]),
            "--time" => args.time == 1.5,
            "--samples" => args.set["render.samples"] == 8,
            "--log" => args.log == Some("l.json".into()),
            "--backend" => args.backend == BackendChoice::Cpu,
            "--stats" => args.stats,
            "--quiet" => args.quiet,
            _ => false,
        };
        let (mut n_taken, mut n_refused) = (0, 0);
        for (ix, (a, of_a)) in FLAGS.into_iter().enumerate() {
            for (b, of_b) in FLAGS[ix + 1..].iter().copied() {
                let is = |flags: &[&str]| [a, b].iter().any(|flag| flags.contains(flag));
                let has_place = is(&["--frame", "--turntable", "--script", "--output", "--log"]);
                let frame = match is(&["--stats"]) && !has_place {
                    true => " --frame a.png",
                    false => "",
                };
                let many = |flag| ["--turntable", "--script"].contains(&flag);
                let needs_out = (many(a) || many(b)) && a != "--output" && b != "--output";
                let out = if needs_out { " --output d" } else { "" };
                match parsed(&format!("a.toml {a} {of_a} {b} {of_b}{out}{frame}")) {
                    Ok(args) => {
                        assert!(shows(&args, a) && shows(&args, b), "{a} {b}: {args:?}");
                        n_taken += 1;
                    }
                    Err(error) => {
                        let error = error.replace(USAGE, "");
                        // `--output` alone has no job that it could go with, and `--stats` has none in the window.
                        let needs_job = is(&["--output"]) || (a, b) == ("--log", "--stats");
                        assert!(error.contains(a) || needs_job, "{a} {b}: {error}");
                        assert!(error.contains(b) || needs_job, "{a} {b}: {error}");
                        n_refused += 1;
                    }
                }
            }
        }
        assert_eq!((n_taken, n_refused), (47, 19));
    }

    #[test]
    fn a_mistyped_option_is_recognised() {
        for (line, meant) in [
            ("a.toml --sapmles 3", "did you mean --samples?"),
            ("a.toml --size=10x10", "did you mean --size?"),
            ("a.toml -set a=b", "did you mean --set?"),
        ] {
            let error = parsed(line).unwrap_err();
            assert!(error.contains(meant), "{line}: {error}");
        }
        assert!(
            !parsed("a.toml --loudly")
                .unwrap_err()
                .contains("did you mean")
        );
        let help = help();
        let documented = help
            .lines()
            .filter_map(|line| line.trim().split(' ').next());
        let documented: Vec<&str> = documented.filter(|word| word.starts_with("--")).collect();
        assert!(documented.iter().all(|option| OPTIONS.contains(option)));
        assert_eq!(documented.len(), OPTIONS.len());
    }

    #[test]
    fn errors_name_the_fault() {
        for (line, needle) in [
            ("a.toml --frame a.png --turntable 3", "only one of --frame"),
            ("a.toml --turntable 3", "--output"),
            ("a.toml --frame a.png --output d", "--output is for"),
            ("a.toml --turntable 3 --output -", "need a folder"),
            ("a.toml --turntable 0 --output d", "--turntable 0"),
            ("a.toml --stats", "--stats prints"),
            ("a.toml --stats --log l.json", "--stats prints"),
            ("a.toml --set eta", "KEY=VALUE"),
            ("a.toml --size 0x3", "0x3"),
            ("a.toml --frame", "needs a value"),
            ("a.toml b.toml", "b.toml"),
            ("--loud a.toml", "--loud"),
        ] {
            let error = parsed(line).unwrap_err();
            assert!(error.contains(needle), "{line}: {error}");
        }
    }
}
