//! Writes the environment map of the bundled sample, `data/sample/studio.exr`.
//!
//! ```text
//! cargo run -p strandlight-bake --example sample_map -- data/sample/studio.exr
//! ```

use strandlight_bake::maps::Sky;

const HEIGHT: usize = 128;

fn main() {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: sample_map OUT.exr");
        std::process::exit(2);
    };
    let written = Sky::Studio
        .exr_file(HEIGHT)
        .map_err(|error| error.to_string())
        .and_then(|bytes| std::fs::write(&path, bytes).map_err(|error| error.to_string()));
    if let Err(error) = written {
        eprintln!("sample_map: {path}: {error}");
        std::process::exit(2);
    }
}
