use strandlight_formats::Scene;
use strandlight_lab::bench::cpu_frames::{Options, scene_costs};
use strandlight_lab::bench::window_frames::window_costs;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let scene = Scene::read(std::path::Path::new(&args[1])).unwrap();
    let options = Options { size: None, repetitions: args[3].parse().unwrap(), samples: None };
    if args[2] == "window" {
        for c in window_costs(&scene, &options, &|| ()).unwrap() {
            println!("{:22} first {:8.1} ms {:6.3} core-s; last {:8.1}; longest {:6.1}", c.name, c.first_milliseconds, c.first_core_seconds.unwrap_or(0.0), c.settled_milliseconds, c.longest_milliseconds);
        }
    } else {
        let c = scene_costs(&scene, &options, &|| ()).unwrap();
        for p in &c.pictures {
            println!("{:22} {:8.1} ms {:6.3} core-s {:?}", p.name, p.milliseconds, p.core_seconds.unwrap_or(0.0), p.stages.iter().map(|s| format!("{} {:.0}", s.0, s.1)).collect::<Vec<_>>());
        }
    }
}
