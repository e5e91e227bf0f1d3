//! Files of a crate do not import each other in a circle.
//!
//! A file imports another where a path in it names something that is defined there; re-exports are
//! followed to the definition, and import nothing themselves. Tests are left out, and so are
//! methods, which are called without a path.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use strandlight_tests::project_root;

/// A path, one name after another; of a module from the root of its crate.
type Names = Vec<String>;
type Modules = BTreeMap<Names, Module>;

/// A file of a crate.
#[derive(Default)]
struct Module {
    /// Names that `use` brings in, with their paths.
    uses: BTreeMap<String, Names>,
    /// All paths, but of re-exports only those that the file itself needs.
    paths: BTreeSet<Names>,
}

/// Names and signs of `text`, which rustfmt has laid out, with `~` for `::`; without comments and
/// what is compiled for tests alone.
fn tokens(text: &str) -> Vec<String> {
    let (mut spaced, mut is_test) = (String::new(), false);
    for line in text.lines() {
        is_test |= line.starts_with("#[cfg(test)]") || line.starts_with("#[cfg(all(test");
        if !is_test {
            let code = line.split("//").next().unwrap_or_default();
            for c in code.replace("::", "~").chars().chain(['\n']) {
                match c.is_alphanumeric() || c == '_' {
                    true => spaced.push(c),
                    false => spaced.extend([' ', c, ' ']),
                }
            }
        }
        let ends = line == "}" || (line.ends_with(';') && !line.starts_with([' ', '}']));
        is_test &= !ends;
    }
    spaced.split_whitespace().map(str::to_owned).collect()
}

impl Module {
    fn of(text: &str) -> Module {
        let tokens = tokens(text);
        let token = |ix: usize| tokens.get(ix).map_or("", String::as_str);
        let is_name = |token: &str| token.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        let (mut module, mut re_exports, mut words) = (Module::default(), Vec::new(), Vec::new());
        // Paths before the open braces, the path so far, and whether a `use` around it re-exports.
        let (mut before, mut path, mut in_use) = (vec![Names::new()], Names::new(), None);
        for ix in 0..tokens.len() {
            let last = token(ix.wrapping_sub(1));
            match token(ix) {
                "use" => in_use = Some(["pub", ")"].contains(&last)),
                ";" => in_use = None,
                "{" => {
                    let outer = before.last().cloned().unwrap_or_default();
                    before.push([outer, std::mem::take(&mut path)].concat());
                }
                "}" => drop(before.pop()),
                name if is_name(name) && !["as", "mod"].contains(&last) => {
                    path.push(name.to_owned());
                    if token(ix + 1) == "~" && (is_name(token(ix + 2)) || token(ix + 2) == "{") {
                        continue;
                    }
                    let outer = before.last().cloned().unwrap_or_default();
                    let mut full = [outer, std::mem::take(&mut path)].concat();
                    full.pop_if(|name| name == "self");
                    let alias = Some(token(ix + 2)).filter(|_| token(ix + 1) == "as");
                    let name = alias
                        .or(full.last().map(String::as_str))
                        .unwrap_or_default()
                        .to_owned();
                    match in_use {
                        Some(true) => re_exports.push((name.clone(), full.clone())),
                        None if full.len() == 1 => words.push(name.clone()),
                        _ => drop(module.paths.insert(full.clone())),
                    }
                    if in_use.is_some() {
                        module.uses.insert(name, full);
                    }
                }
                _ => {}
            }
        }
        re_exports.retain(|(name, _)| words.contains(name));
        module
            .paths
            .extend(re_exports.into_iter().map(|(_, path)| path));
        module
    }
}

/// The module that defines what `path` in the module `from` names, if it is of this crate.
fn home(modules: &Modules, from: &Names, path: &[String], depth: u32) -> Option<Names> {
    let child = |at: &Names, name: &String| [&at[..], std::slice::from_ref(name)].concat();
    let (mut at, mut rest) = (from.clone(), path);
    match path.first()?.as_str() {
        "crate" => (at, rest) = (Names::new(), &path[1..]),
        "self" | "super" => {}
        _ if modules.contains_key(&child(from, &path[0])) => {}
        name => {
            // What the file's own `use` brings in, unless that is what is looked for.
            let further = modules[from].uses.get(name).filter(|_| depth == 0)?;
            return home(modules, from, &[further, &path[1..]].concat(), 1);
        }
    }
    while let [name, below @ ..] = rest {
        if name == "super" {
            at.pop()?;
        } else if modules.contains_key(&child(&at, name)) {
            at.push(name.clone());
        } else if let Some(further) = modules.get(&at)?.uses.get(name).filter(|_| at != *from) {
            let further = [further, below].concat();
            return home(modules, &at, &further, depth + 1).filter(|_| depth < 9);
        } else if name != "self" {
            break;
        }
        rest = below;
    }
    modules.contains_key(&at).then_some(at)
}

/// The modules in circles, each with what it imports, and how many imports there are in all.
fn circles(modules: &Modules) -> (Vec<String>, usize) {
    let imports = modules.iter().map(|(from, module)| {
        let homes = module
            .paths
            .iter()
            .filter_map(|path| home(modules, from, path, 0));
        (
            from,
            homes.filter(|to| to != from).collect::<BTreeSet<Names>>(),
        )
    });
    let imports: BTreeMap<&Names, BTreeSet<Names>> = imports.collect();
    let reach_themselves = imports.keys().filter(|&&from| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
        while let Some(at) = next.pop() {
            next.extend(imports[at].iter().filter(|&to| seen.insert(to)));
        }
        seen.contains(from)
    });
    let line = |from: &&Names| format!("{} -> {:?}", from.join("::"), imports[*from]);
    let n_imports = imports.values().map(BTreeSet::len).sum();
    (reach_themselves.map(line).collect(), n_imports)
}

/// Adds the files below `folder`, which is the module `at`.
fn add_files(folder: &Path, at: &[String], modules: &mut Modules) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let stem = path.file_stem().expect("a name").to_string_lossy();
        let below = [at, &[stem.to_string()]].concat();
        if path.is_dir() {
            add_files(&path, &below, modules);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let is_root = stem == "lib" || stem == "mod";
            let text = fs::read_to_string(&path).expect("it can be read");
            modules.insert(if is_root { at.to_vec() } else { below }, Module::of(&text));
        }
    }
}

#[test]
fn no_files_of_a_crate_import_each_other_in_a_circle() {
    let mut n_imports = 0;
    for entry in fs::read_dir(project_root().join("crates")).expect("the crates are there") {
        let folder = entry.expect("it can be read").path().join("src");
        let mut modules = Modules::new();
        add_files(&folder, &[], &mut modules);
        let (found, n) = circles(&modules);
        assert!(found.is_empty(), "{}: {found:#?}", folder.display());
        n_imports += n;
    }
    assert!(n_imports > 1000, "only {n_imports} imports found");
}

#[test]
fn circles_are_found() {
    let n_found = |root: &str, a: &str, b: &str| {
        let files = [("", root), ("a", a), ("b", b), ("a::deep", "pub struct C;")];
        let names = |name: &str| name.split_terminator("::").map(str::to_owned).collect();
        circles(
            &files
                .map(|(name, text)| (names(name), Module::of(text)))
                .into(),
        )
        .0
        .len()
    };
    let root = "mod a;\npub mod b;\npub use a::{A, deep::{C as D}};\n";
    let a = "pub struct A;\nfn f() -> crate::b::B {}\n";
    let plain = "use super::a::{self, A};";
    let in_braces = "use crate::{A};";
    let in_code = "type T = super::A;";
    let through_module = "use crate::a;\ntype T = a::A;";
    for b in [plain, in_braces, in_code, through_module] {
        assert_eq!(n_found(root, a, b), 2, "{b}");
    }
    let in_test = "#[cfg(test)]\nmod tests {\n    use crate::A;\n}\n";
    for b in [
        "// use crate::A;",
        "use std::fmt::A;",
        "use crate::D;",
        in_test,
    ] {
        assert_eq!(n_found(root, a, b), 0, "{b}");
    }
    // A parent may pass on what its child defines, but not use it where the child uses the parent.
    let child = "use super::Limit;\npub fn f() {}\n";
    assert_eq!(n_found("pub use a::f;\nstruct Limit;\n", child, ""), 0);
    let user = "pub use a::f;\nstruct Limit;\nfn g() {\n    f();\n}\n";
    assert_eq!(n_found(user, child, ""), 2);
}
