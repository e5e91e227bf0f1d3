//! `strandlight-bindgen PROGRAM.wasm FOLDER NAME`: writes `NAME.js` and `NAME_bg.wasm`, for
//! a page that loads them as modules.
//!
//! The module exports a function `instantiate`, and each call of it has an instance of the program
//! to itself: several viewers on a page do not share memory, and one that is let go of is collected
//! as a whole. Only the threads of a worker have instances on one memory, which they are given.

use std::path::Path;
use std::process::ExitCode;

/// What wasm-bindgen calls what it makes where there are no modules.
const GLOBAL: &str = "wasm_bindgen";

fn main() -> ExitCode {
    let words: Vec<_> = std::env::args_os().skip(1).collect();
    let [program, folder, name] = words.as_slice() else {
        eprintln!("usage: strandlight-bindgen PROGRAM.wasm FOLDER NAME");
        return ExitCode::from(2);
    };
    let name = name.to_string_lossy();
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen
        .input_path(program)
        .out_name(&name)
        .omit_default_module_path(true)
        .typescript(false);
    // Modules would have their instance in a variable of their own, one for all who import them.
    let made = bindgen
        .no_modules(true)
        .and_then(|bindgen| bindgen.generate(folder))
        .map_err(|error| format!("{error:#}"));
    let script = Path::new(folder).join(format!("{name}.js"));
    match made.and_then(|()| wrap(&script)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("strandlight-bindgen: {error}");
            ExitCode::from(1)
        }
    }
}

/// Makes a module of the script at `path`.
fn wrap(path: &Path) -> Result<(), String> {
    let script = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let start = format!("let {GLOBAL} = ");
    if !script.starts_with(&start) {
        return Err(format!("{}: does not begin with {start:?}", path.display()));
    }
    let module = format!("export function instantiate() {{\n{script}\nreturn {GLOBAL};\n}}\n");
    std::fs::write(path, module).map_err(|error| error.to_string())
}
