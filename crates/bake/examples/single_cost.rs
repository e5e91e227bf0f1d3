//! Evaluates one method again and again and nothing else, for counting instructions:
//!
//! ```sh
//! cargo build -p strandlight-bake --example single_cost
//! for n in 20 40; do
//!   valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!     target/debug/examples/single_cost paper m=4 $n 2>&1 | grep Collected
//! done
//! ```
//!
//! Each repetition is 8 fibres x 16 lights x 16 views = 2048 evaluations of all modes, so the
//! instructions per light and point are the difference of the two counts over 20 x 2048. A set of
//! `bench single` may follow: `wide`, or `energy` for fibres of that model.

use std::hint::black_box;
use std::process::ExitCode;

use strandlight_bake::tables::bake_c_and_h;
use strandlight_lab::bench::{Method, MethodTables, Prepared, Scene, Set};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::progress::Progress;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("single_cost: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (set, arguments) = match &arguments[..] {
        [rest @ .., set] if set == "wide" => (Set::Wide, rest),
        [rest @ .., set] if set == "energy" => (Set::Energy, rest),
        all => (Set::Accuracy, all),
    };
    let [family, setting, repetitions] = arguments else {
        let usage = "usage: single_cost FAMILY SETTING REPETITIONS [wide|energy], as in single.csv";
        return Err(usage.into());
    };
    let repetitions: u32 = repetitions.parse()?;
    let method = Method::all_of(set.model())
        .into_iter()
        .find(|method| method.family() == family && method.setting() == *setting)
        .ok_or_else(|| format!("there is no method '{family} {setting}'"))?;
    let prepared = Prepared::new(
        method,
        &MethodTables::new(&bake_c_and_h(Fresnel::Schlick, &Progress::silent()))?,
    );
    let scene = Scene::new(set, 0, [8, 16, 16]);
    let fibres = scene
        .hair
        .iter()
        .map(|hair| prepared.on_fibre(hair))
        .collect::<Result<Vec<_>, _>>()?;
    for _ in 0..repetitions {
        for fibre in &fibres {
            for view in &scene.views {
                black_box(fibre.lit(black_box(&scene.lights), black_box(view)));
            }
        }
    }
    Ok(())
}
