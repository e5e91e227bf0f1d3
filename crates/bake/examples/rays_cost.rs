//! Rays a second of each query: `rays_cost [STYLE] [STRANDS] [POINTS]`, on one core.

use std::time::Instant;

use glam::Vec3;
use strandlight_bake::grooms::{GrowSpec, Style, generate};
use strandlight_reference::rays::{Rays, Start};
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::Camera;
use strandlight_scene::progress::Progress;
use strandlight_scene::strands::Strands;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number =
        |ix: usize, default: u32| args.get(ix).and_then(|x| x.parse().ok()).unwrap_or(default);
    let style = args
        .first()
        .and_then(|name| Style::ALL.into_iter().find(|style| style.name() == name));
    let spec = GrowSpec {
        style: style.unwrap_or(Style::Wavy),
        strands: number(1, 10_000),
        points_per_strand: number(2, 48),
        seed: 0,
    };
    let groom = generate(&spec, &Progress::silent()).expect("the size is in range");
    let strands = Strands::new(&groom.points, &groom.strand_offsets, |_, _| 0.008, true)
        .expect("a generated groom is valid");
    println!("{} segments", strands.segments.len());
    let start = Instant::now();
    let rays = Rays::new(&strands);
    println!("built in {:.2} s", start.elapsed().as_secs_f64());

    let n = 200_000;
    let mut random = SplitMix64(1);
    let camera = Camera::framing(strands.centre, strands.radius, 0.5);
    let towards: Vec<Vec3> = (0..n)
        .map(|_| {
            let mut x = || random.uniform(-0.7, 0.7) as f32 * strands.radius;
            (strands.centre + Vec3::new(x(), x(), x()) - camera.eye).normalize()
        })
        .collect();
    let eye = Start::camera(camera.eye);
    let mut hits = Vec::new();
    time("nearest", n, || {
        hits = towards
            .iter()
            .filter_map(|&d| rays.nearest(&eye, d))
            .collect();
        hits.len()
    });
    let shadow: Vec<(Start, Vec3)> = (0..n)
        .map(|ix| {
            let hit = hits[ix % hits.len()];
            let z = random.uniform(-1.0, 1.0) as f32;
            let (sin, cos) = (random.uniform(0.0, std::f64::consts::TAU) as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            (
                Start::inside(&strands, hit.segment, hit.along),
                Vec3::new(r * cos, r * sin, z),
            )
        })
        .collect();
    time("is_blocked", n, || {
        shadow
            .iter()
            .filter(|(s, d)| rays.is_blocked(s, *d))
            .count()
    });
    time("crossings", n, || {
        let mut count = 0;
        for (s, d) in &shadow {
            rays.crossings(s, *d, |_| count += 1);
        }
        count
    });
}

fn time(name: &str, n: usize, mut work: impl FnMut() -> usize) {
    let start = Instant::now();
    let found = work();
    let rate = n as f64 / start.elapsed().as_secs_f64();
    println!(
        "{name}: {:.3} M rays/s, {:.3} found a ray",
        1e-6 * rate,
        found as f64 / n as f64
    );
}
