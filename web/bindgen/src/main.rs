//! `strandlight-bindgen PROGRAM.wasm FOLDER`: writes `strandview.js` and `strandview_bg.wasm`, for
//! a page that loads them as modules.

use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<_> = std::env::args_os().skip(1).collect();
    let [program, folder] = words.as_slice() else {
        eprintln!("usage: strandlight-bindgen PROGRAM.wasm FOLDER");
        return ExitCode::from(2);
    };
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen
        .input_path(program)
        .out_name("strandview")
        .omit_default_module_path(false)
        .typescript(false);
    match bindgen
        .web(true)
        .and_then(|bindgen| bindgen.generate(folder))
    {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("strandlight-bindgen: {error:#}");
            ExitCode::from(1)
        }
    }
}
