//! What the README, the book and the pages beside them promise: links lead somewhere, command
//! blocks run, generated pages are up to date, and every key and option is documented.
//!
//! `STRANDLIGHT_UPDATE_DOCS=1 cargo test -p strandlight-tests --test cli docs::` rewrites generated
//! pages.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use strandlight_formats::Scene;
use strandlight_scene::paint::Brush;
use strandlight_tests::{assert_done, project_root, strandlight, strandview};

/// Largest README, bytes.
const README_BYTES: usize = 5000;

/// Folder of the book's pages.
fn book() -> PathBuf {
    project_root().join("docs/book/src")
}

/// The page of the book called `name`.
fn page(name: &str) -> PathBuf {
    book().join(format!("{name}.md"))
}

/// Markdown files below `folder`.
fn markdown_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() {
            markdown_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
    found.sort();
}

/// All pages that a reader is meant to read.
fn pages() -> Vec<PathBuf> {
    let root = project_root();
    let mut pages: Vec<PathBuf> = [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "shaders/README.md",
        "docs/bench/README.md",
    ]
    .map(|name| root.join(name))
    .into();
    markdown_files(&book(), &mut pages);
    assert!(pages.len() > 30, "{pages:?}");
    pages
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// `text` without fenced blocks and code spans.
fn prose(text: &str) -> String {
    let mut is_fenced = false;
    let mut out = String::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_fenced = !is_fenced;
        } else if !is_fenced {
            let outside = line.split('`').step_by(2);
            out.push_str(&outside.collect::<Vec<_>>().join(" "));
            out.push('\n');
        }
    }
    out
}

/// Targets of the links and images in `text`.
fn links(text: &str) -> Vec<String> {
    let text = prose(text);
    text.match_indices("](")
        .filter_map(|(at, open)| {
            let rest = &text[at + open.len()..];
            rest.split_once(')').map(|(target, _)| target.to_owned())
        })
        .collect()
}

/// Anchors of the headings in `text`, as GitHub and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut is_fenced = false;
    let mut found = BTreeSet::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_fenced = !is_fenced;
        }
        let title = line.trim_start_matches('#');
        if is_fenced || title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        let slug: String = title
            .trim()
            .chars()
            .filter_map(|c| match c {
                c if c.is_alphanumeric() || c == '_' || c == '-' => c.to_lowercase().next(),
                c if c.is_whitespace() => Some('-'),
                _ => None,
            })
            .collect();
        let again = (1..).map(|n| format!("{slug}-{n}"));
        let mut names = std::iter::once(slug.clone()).chain(again);
        let free = names.find(|name| !found.contains(name));
        found.extend(free);
    }
    found
}

/// What is wrong with the links of the page at `path` that says `text`, and how many were checked.
fn broken_links(path: &Path, text: &str) -> (Vec<String>, usize) {
    let mut broken = Vec::new();
    let links = links(text);
    let relative = links.iter().filter(|target| !target.contains("://"));
    let mut n_checked = 0;
    for target in relative {
        n_checked += 1;
        let (file, anchor) = match target.split_once('#') {
            Some((file, anchor)) => (file, Some(anchor)),
            None => (&**target, None),
        };
        let to = match file {
            "" => path.to_owned(),
            _ => path.parent().unwrap_or(path).join(file),
        };
        let what = |what: &str| format!("{}: {target}: {what}", path.display());
        let Ok(real) = to.canonicalize() else {
            broken.push(what("there is no such file"));
            continue;
        };
        // The built book holds nothing else.
        let book = book().canonicalize().expect("the book is there");
        if path.starts_with(project_root().join("docs/book")) && !real.starts_with(&book) {
            broken.push(what("is outside of the book"));
        }
        if let Some(anchor) = anchor
            && (real.is_dir() || !anchors(&read(&real)).contains(anchor))
        {
            broken.push(what("there is no such heading"));
        }
    }
    (broken, n_checked)
}

#[test]
fn every_link_and_anchor_leads_somewhere() {
    let mut broken = Vec::new();
    let mut n_checked = 0;
    for page in pages() {
        let (found, n) = broken_links(&page, &read(&page));
        broken.extend(found);
        n_checked += n;
    }
    assert!(n_checked > 80, "{n_checked}");
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn broken_links_are_found() {
    let readme = project_root().join("README.md");
    let text = "# A `b`\n[a](nowhere) [b](LICENSE-MIT) `[c](code)` [d](#a-b) [e](#a-c)\n\
                ```sh\n[f](fenced)\n```\n[g](https://example.org/x) ![h](docs/no.png)\n";
    let (broken, n_checked) = broken_links(&readme, text);
    assert_eq!(n_checked, 5);
    assert_eq!(broken.len(), 4, "{broken:#?}");
    let inside = page("introduction");
    let (broken, _) = broken_links(&inside, "[a](../../../LICENSE-MIT)");
    assert_eq!(broken.len(), 1, "{broken:#?}");
    let twice = anchors("# Run it!\n## Run it!\n");
    assert_eq!(
        twice,
        BTreeSet::from(["run-it".to_owned(), "run-it-1".to_owned()])
    );
}

#[test]
fn the_summary_lists_every_page_once() {
    let summary = read(&page("SUMMARY"));
    let mut listed = links(&summary);
    listed.sort();
    let mut files = Vec::new();
    markdown_files(&book(), &mut files);
    let names = files.iter().map(|path| {
        let name = path.strip_prefix(book()).expect("below the book");
        name.to_string_lossy().replace('\\', "/")
    });
    let mut pages: Vec<String> = names
        .filter(|name| name != concat!("SUMMARY", ".md"))
        .collect();
    pages.sort();
    assert_eq!(listed, pages);
    for page in files {
        let text = read(&page);
        assert!(text.starts_with("# "), "{}: no title", page.display());
    }
}

#[test]
fn the_readme_is_short() {
    let n_bytes = read(&project_root().join("README.md")).len();
    assert!(n_bytes <= README_BYTES, "{n_bytes} bytes");
}

/// A fenced block of shell commands.
struct Block {
    /// Whether it can run in a test.
    runs: bool,
    /// First line in the page, from 1.
    line: usize,
    text: String,
}

/// The blocks marked `sh` and `sh,no_run`.
fn blocks(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    for (ix, line) in text.lines().enumerate() {
        match (&mut open, line) {
            (Some(_), "```") => blocks.extend(open.take()),
            (Some(block), line) => {
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, "```sh" | "```sh,no_run") => {
                open = Some(Block {
                    runs: line == "```sh",
                    line: ix + 2,
                    text: String::new(),
                });
            }
            (None, line) => {
                assert!(
                    !line.starts_with("```sh") && line != "```bash",
                    "{line}: shell blocks are sh, or sh,no_run"
                );
            }
        }
    }
    blocks
}

/// The commands in `text` as words, without redirections, comments and the bodies of here
/// documents.
fn command_lines(text: &str) -> Vec<Vec<String>> {
    let mut commands = Vec::new();
    let joined = text.replace("\\\n", " ").replace("2>&1", "");
    let mut lines = joined.lines();
    while let Some(line) = lines.next() {
        let mut words: Vec<String> = Vec::new();
        let mut word: Option<String> = None;
        let mut quote = None;
        for c in line.chars() {
            match (quote, c) {
                (Some(open), c) if c == open => quote = None,
                (None, '\'' | '"') => {
                    quote = Some(c);
                    word.get_or_insert_default();
                }
                (None, '#') if word.is_none() => break,
                (None, '|' | ';' | '&') => {
                    words.extend(word.take());
                    commands.push(std::mem::take(&mut words));
                }
                (None, c) if c.is_whitespace() => words.extend(word.take()),
                (_, c) => word.get_or_insert_default().push(c),
            }
        }
        words.extend(word);
        let end = words.iter().find_map(|word| word.strip_prefix("<<"));
        if let Some(end) = end.map(str::to_owned) {
            lines.by_ref().find(|line| *line == end);
        }
        commands.push(words);
    }
    for words in &mut commands {
        let redirection = words.iter().position(|word| word.starts_with(['<', '>']));
        words.truncate(redirection.unwrap_or(words.len()));
        let is_assignment = |word: &String| {
            let name = word.split_once('=').map_or("", |(name, _)| name);
            !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_')
        };
        let n_assigned = words.iter().take_while(|word| is_assignment(word)).count();
        words.drain(..n_assigned);
    }
    commands.retain(|words| !words.is_empty());
    commands
}

/// Does the parser of the program take these words? What is wrong, if not.
fn parse_fault(words: &[String]) -> Option<String> {
    let (program, rest) = words.split_first()?;
    let is_there = |path: &str| match project_root().join(path).exists() {
        true => None,
        false => Some(format!("{path} is not there")),
    };
    let taken = |mut command: Command| {
        let output = command.output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (!output.status.success()).then_some(said)
    };
    match &**program {
        // Options and values before --help are parsed and checked.
        "strandlight" => {
            let mut command = strandlight();
            command.args(rest).arg("--help");
            taken(command)
        }
        "strandview" => {
            let help = assert_done(strandview().arg("--help"));
            let known: BTreeSet<&str> = options(&help).into_iter().collect();
            let mut given = rest.iter().filter(|word| word.starts_with("--"));
            let unknown = given.find(|word| !known.contains(&***word));
            unknown.map(|word| format!("{word} is not in --help"))
        }
        "cargo" => {
            if let Some(at) = rest.iter().position(|word| word == "--path") {
                return is_there(&rest[at + 1]);
            }
            if rest.starts_with(&["run".into(), "--release".into(), "--".into()]) {
                let mut command = strandlight();
                command.args(&rest[3..]).arg("--help");
                return taken(command);
            }
            None
        }
        "tests/run" | "web/build" | "web/package" | "release/build" | "release/check" => {
            is_there(program)
        }
        "cat"
        | "echo"
        | "printf"
        | "python3"
        | "mdbook"
        | "sbatch"
        | "pip"
        | "maturin"
        | "for"
        | "do"
        | "done"
        | "valgrind"
        | "grep"
        | "target/debug/examples/single_cost" => None,
        _ => Some("an unknown program".to_owned()),
    }
}

/// The long options that `text` names.
fn options(text: &str) -> Vec<&str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'))
        .filter(|word| word.starts_with("--") && word.len() > 3)
        .collect()
}

#[test]
fn every_command_line_parses() {
    let mut faults = Vec::new();
    let mut n_checked = 0;
    for page in pages() {
        for block in blocks(&read(&page)) {
            for words in command_lines(&block.text) {
                let place = format!("{}:{}", page.display(), block.line);
                let fault = parse_fault(&words);
                faults.extend(fault.map(|fault| format!("{place}: {}: {fault}", words.join(" "))));
                n_checked += 1;
            }
        }
    }
    assert!(n_checked > 60, "{n_checked}");
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn wrong_command_lines_are_found() {
    let text = "strandlight lights a.exr -o 'b c' --cuont 3 # note\nFOO=1 cargo install --path crates/none\n\
                echo '{\"a|b\"}' | strandlight prob > x\ncat > f <<'END'\nstrandlight nonsense\nEND\n\
                strandview a.toml --farme x.png\nstrandlight render a.toml --size 9x\nfoo\n\
                strandlight render a.toml \\\n  --samples 4 -o b.png\n";
    let lines = command_lines(text);
    assert_eq!(lines[0][4], "b c");
    assert_eq!(lines.len(), 9, "{lines:?}");
    let faults = lines.iter().map(|words| parse_fault(words).is_some());
    assert_eq!(
        faults.collect::<Vec<_>>(),
        [true, true, false, true, false, true, true, true, false]
    );
}

/// Files that the pages start from: those of the demo, small, and a `.hair` file.
fn samples() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let demo = at.join("demo");
    fs::create_dir(&demo).expect("it can be made");
    let data = project_root().join("data");
    let run = |line: &str| {
        let mut command = strandlight();
        assert_done(command.current_dir(at).args(line.split_whitespace()));
    };
    for place in [at, &demo] {
        fs::copy(data.join("sample/studio.exr"), place.join("studio.exr")).expect("copied");
    }
    fs::copy(data.join("default.tables"), demo.join("default.tables")).expect("copied");
    run("lights studio.exr --count 4 --no-report -o demo/studio.lights");
    run("groom generate --style layered --strands 60 --points-per-strand 12 -o demo/layered.groom");
    run("mesh generate -o demo/bust.mesh");
    run("export demo/layered.groom -o model.hair");
    fs::write(at.join("head.obj"), "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n").expect("written");
    let scene = read(&data.join("sample/scene.toml"));
    let small = scene
        .replace("size = [720, 480]", "size = [48, 32]")
        .replace("samples = 64", "samples = 2\nshadow_maps = 8");
    assert_ne!(scene, small);
    fs::write(demo.join("scene.toml"), small).expect("written");
    let painted = read(&data.join("sample/painted.json"));
    let small = painted.replace("[600, 400], \"samples\": 64", "[48, 32], \"samples\": 2");
    assert_ne!(painted, small);
    fs::write(demo.join("painted.json"), small).expect("written");
    folder
}

/// What a page's commands find on their path: the programs, `render` with a small picture where
/// no size is asked for.
#[cfg(unix)]
fn programs() -> tempfile::TempDir {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().expect("a temporary folder");
    let small = "case \"$*\" in *--size*|*--script*|*--turntable*) ;;\n\
                 render*) set -- \"$@\" --size 48x32;; esac\n\
                 case \"$*\" in *--samples*|*--script*) ;; render*) set -- \"$@\" --samples 2;; esac\n";
    for (name, command, before) in [
        ("strandlight", strandlight(), small),
        ("strandview", strandview(), ""),
    ] {
        let program = command.get_program().to_string_lossy().into_owned();
        let path = folder.path().join(name);
        let script = format!("#!/bin/sh\n{before}exec '{program}' \"$@\"\n");
        fs::write(&path, script).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("permitted");
    }
    folder
}

/// Each page's blocks in order, in a folder of the page's own.
#[cfg(unix)]
#[test]
fn gpu_the_commands_of_every_page_run() {
    let programs = programs();
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", programs.path().display());
    let mut n_run = 0;
    for page in pages() {
        let blocks = blocks(&read(&page));
        let blocks: Vec<&Block> = blocks.iter().filter(|block| block.runs).collect();
        if blocks.is_empty() {
            continue;
        }
        let folder = samples();
        for block in blocks {
            let start = std::time::Instant::now();
            let mut shell = Command::new("sh");
            shell.args(["-eu", "-c", &block.text]);
            shell.current_dir(folder.path()).env("PATH", &path);
            let output = shell.output().expect("a shell");
            let place = format!("{}:{}", page.display(), block.line);
            assert!(
                output.status.success(),
                "{place}:\n{}\n{}",
                block.text,
                String::from_utf8_lossy(&output.stderr)
            );
            println!("{place}: {:.1} s", start.elapsed().as_secs_f64());
            n_run += 1;
        }
    }
    assert!(n_run >= 15, "{n_run}");
}

/// Compares a generated page with the committed one, or rewrites that.
fn check_generated(page: &Path, generated: &str) {
    if std::env::var_os("STRANDLIGHT_UPDATE_DOCS").is_some() {
        fs::write(page, generated).expect("written");
    }
    assert!(
        read(page) == generated,
        "{} is out of date: STRANDLIGHT_UPDATE_DOCS=1 cargo test -p strandlight-tests --test cli docs::",
        page.display()
    );
}

#[test]
fn the_command_reference_is_that_of_the_program() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let generated = folder.path().join("commands");
    let mut command = strandlight();
    assert_done(command.args(["man", "--markdown", "-o"]).arg(&generated));
    let generated = read(&generated);
    for heading in [
        "\n## `strandlight render`\n",
        "\n### `strandlight bench edit`\n",
    ] {
        assert!(generated.contains(heading), "{heading}");
    }
    check_generated(&page("reference/commands"), &generated);
}

/// Every command has a man page, and every option of its help is in it.
#[test]
fn man_pages_and_completions_know_every_option() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert_done(strandlight().args(["man", "-o"]).arg(folder.path()));
    let man_page = |name: &str| read(&folder.path().join(name)).replace("\\-", "-");
    let help = assert_done(strandlight().args(["groom", "import", "--help"]));
    let import = man_page("strandlight-groom-import.1");
    let mut n_checked = 0;
    for option in options(&help) {
        assert!(import.contains(option), "{option}");
        n_checked += 1;
    }
    assert!(n_checked > 5, "{n_checked}");
    assert!(man_page("strandlight.1").contains("strandlight-render(1)"));
    assert!(!folder.path().join("strandlight-help.1").exists());
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = assert_done(strandlight().args(["completions", shell]));
        assert!(script.contains("shadow-maps"), "{shell}");
    }
}

#[test]
fn the_reference_of_strandview_is_its_help() {
    let help = assert_done(strandview().arg("--help"));
    let page = read(&page("reference/strandview"));
    let in_help: BTreeSet<&str> = options(&help).into_iter().collect();
    let rows = page.lines().filter(|line| line.starts_with("| `--"));
    let cells = rows.filter_map(|row| row.split(" | ").next());
    let mut in_page: BTreeSet<&str> = cells.flat_map(options).collect();
    assert!(in_page.remove("--help") && in_page.remove("--version"));
    assert_eq!(in_page, in_help);
}

/// Names of the keys of `value`, as paths with N for the place in a list of tables.
fn key_paths(path: &str, value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(table) => {
            for (key, value) in table {
                let path = match path {
                    "" => key.clone(),
                    _ => format!("{path}.{key}"),
                };
                key_paths(&path, value, found);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_object) => {
            let each = items.iter().filter(|item| item.is_object());
            let path = format!("{path}.N");
            each.for_each(|item| key_paths(&path, item, found));
        }
        _ => {
            found.insert(path.to_owned());
        }
    }
}

#[test]
fn every_scene_key_is_in_the_reference() {
    let text = r#"version = 1
        [groom]
        file = "a.groom"
        [lights]
        file = "a.lights"
        muted = [1]
        solo = [2]
        [[lights.adjust]]
        light = 3
        [tables]
        file = "a.tables"
        [hair]
        preset = "blond"
        diameter_cm = 0.01
        density_forward = 0.5
        density_back = 0.5
        [camera]
        position = [0, 0, 1]
        target = [0, 0, 0]
        [[proxy]]
        kind = "ellipsoid"
        centre = [0, 0, 0]
        radii = [1, 1, 1]
        [[proxy]]
        kind = "ground"
        height = 0
        [motion]
        fps = 25
        frames = ["b.groom"]
        "#;
    let files = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
    let windy = format!("{files}[motion.wind]\nspeed = 1\n[hair.melanin]\neumelanin = 1\n");
    let matched = format!("{files}[hair]\nreflectance = [0.1, 0.1, 0.1]\n");
    let mut paths = BTreeSet::new();
    let folder = tempfile::tempdir().expect("a temporary folder");
    for text in [text, &windy, &matched] {
        let file = folder.path().join("scene.toml");
        fs::write(&file, text).expect("written");
        let scene = Scene::read(&file).expect("a scene");
        key_paths("", &serde_json::to_value(&scene).expect("JSON"), &mut paths);
    }
    let page = read(&page("reference/scene"));
    let mut missing = Vec::new();
    for path in &paths {
        // A table of one value for each mode is one key.
        let key = ["r", "tt", "trt"]
            .iter()
            .find_map(|mode| path.strip_suffix(&format!(".{mode}")))
            .unwrap_or(path);
        if !page.contains(&format!("`{key}`")) {
            missing.push(key);
        }
    }
    assert!(paths.len() > 40, "{paths:?}");
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_key_of_a_brush_is_in_the_reference() {
    let page = read(&page("reference/scripts"));
    let mut paths = BTreeSet::new();
    let brush = serde_json::to_value(Brush::default()).expect("JSON");
    key_paths("", &brush, &mut paths);
    assert!(paths.len() > 8, "{paths:?}");
    for path in paths {
        for key in path.split('.') {
            let names = [format!("`{key}`"), format!("\"{key}\"")];
            assert!(names.iter().any(|name| page.contains(name)), "{path}");
        }
    }
}

/// The annotated dump of a light set is the golden file, byte by byte.
#[test]
fn the_example_of_the_file_format_is_the_golden_file() {
    let page = read(&page("reference/files"));
    let (_, dump) = page
        .split_once("```text\n   0  93")
        .expect("the dump starts with the magic");
    let (dump, _) = dump.split_once("\n```").expect("the dump ends");
    let mut bytes: Vec<u8> = Vec::new();
    for line in format!("   0  93{dump}").lines() {
        let (offset, rest) = line.trim_start().split_once("  ").expect("an offset");
        assert_eq!(offset.parse(), Ok(bytes.len()), "{line}");
        // Bytes take up to 48 columns; the note comes after.
        let columns = rest.get(..48).unwrap_or(rest);
        let mut words = columns.split_whitespace();
        let first: Vec<&str> = words.clone().take(3).collect();
        if let ["00", "x", n] = first[..] {
            bytes.resize(bytes.len() + n.parse::<usize>().expect("a number"), 0);
            continue;
        }
        let byte = |word: &str| u8::from_str_radix(word, 16).expect("a byte");
        bytes.extend(words.by_ref().map(byte));
    }
    let golden = fs::read(project_root().join("tests/golden/v1_1.lights")).expect("it is there");
    assert_eq!(bytes, golden);
}

/// Fenced blocks in languages other than shell: JSON is JSON.
#[test]
fn json_blocks_are_json() {
    let mut n_checked = 0;
    for page in pages() {
        let text = read(&page);
        for block in text.split("```json\n").skip(1) {
            let (json, _) = block.split_once("```").expect("the block ends");
            let values: BTreeMap<usize, Result<Value, _>> =
                serde_json::Deserializer::from_str(json)
                    .into_iter()
                    .enumerate()
                    .collect();
            for value in values.values() {
                assert!(value.is_ok(), "{}: {value:?}", page.display());
                n_checked += 1;
            }
        }
    }
    assert!(n_checked >= 4, "{n_checked}");
}
