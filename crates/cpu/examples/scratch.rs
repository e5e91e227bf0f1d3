use std::time::{Duration, Instant};
use strandlight_cpu::InteractiveRenderer;
use strandlight_formats::Scene;
use strandlight_scene::{Backend, PreparedScene};
fn lin(v: u8) -> f64 {
    let x = v as f64 / 255.0;
    if x < 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let scene = Scene::read(&a[1]).unwrap();
    let mut base = PreparedScene::load(&scene).unwrap();
    if let Some(w) = a.get(2).and_then(|w| w.parse::<u32>().ok()) {
        base.size = [w, w * base.size[1] / base.size[0]];
    }
    let mut live = InteractiveRenderer::new(base.clone());
    let run = |live: &mut InteractiveRenderer, what: &str| {
        let start = Instant::now();
        let mut pics: Vec<(f64, bool, Vec<[u8; 4]>)> = vec![];
        let mut v = live.display().version;
        loop {
            let p = live.advance(Duration::from_millis(8)).unwrap();
            if live.display().version != v {
                v = live.display().version;
                pics.push((
                    start.elapsed().as_secs_f64() * 1e3,
                    p.is_shaded,
                    live.display().pixels.to_vec(),
                ));
            }
            if p.is_done {
                break;
            }
        }
        let total = start.elapsed().as_secs_f64() * 1e3;
        let last = pics.last().unwrap().2.clone();
        let mean: f64 = last
            .iter()
            .map(|p| lin(p[0]) + lin(p[1]) + lin(p[2]))
            .sum::<f64>();
        print!("{what}: done {total:.0} ms;");
        let [w, h] = base.size.map(|n| n as usize);
        for (t, shaded, pic) in &pics {
            let mean_p: f64 = pic
                .iter()
                .map(|p| lin(p[0]) + lin(p[1]) + lin(p[2]))
                .sum::<f64>();
            let (mut e, mut s) = (0.0, 0.0);
            let mut worst: f64 = 0.0;
            for y in (0..h - 3).step_by(4) {
                for x in (0..w - 3).step_by(4) {
                    for c in 0..3 {
                        let (mut a, mut b) = (0.0, 0.0);
                        for j in 0..4 {
                            for i in 0..4 {
                                let ix = (y + j) * w + x + i;
                                a += lin(pic[ix][c]);
                                b += lin(last[ix][c]);
                            }
                        }
                        e += (a - b) * (a - b);
                        s += b * b;
                        worst = worst.max((a - b).abs() / 16.0);
                    }
                }
            }
            print!(
                " [{t:.0} ms shaded {shaded} mean {:+.2}% tile {:.2}% worst {:.3}]",
                100.0 * (mean_p / mean - 1.0),
                100.0 * (e / s).sqrt(),
                worst
            );
        }
        println!();
        for s in &live.report().stats.stages {
            print!(" {} {:.0}", s.name, s.milliseconds);
        }
        println!();
    };
    run(&mut live, "first");
    for _ in 0..2 {
        let mut hair = base.hair.hair().clone();
        hair.sigma_a = hair.sigma_a.map(|x| x * 0.5);
        let modes: Vec<_> = base.hair.modes().to_vec();
        live.set_hair(&hair, &modes).unwrap();
        run(&mut live, "colour");
        live.set_hair(&base.hair.hair().clone(), &modes).unwrap();
        run(&mut live, "back");
    }
    if a.len() > 3 {
        let mut lights = base.lights.clone();
        for l in &mut lights {
            let [x, y, z] = l.direction;
            let (s, c) = (0.1f64.sin() as f32, 0.1f64.cos() as f32);
            l.direction = [c * x + s * z, y, c * z - s * x];
        }
        live.set_lights(lights).unwrap();
        run(&mut live, "turned");
        live.set_lights(base.lights.clone()).unwrap();
        run(&mut live, "turned back");
        let mut cam = base.camera.clone();
        cam.eye.x += 2.0;
        live.set_camera(cam);
        run(&mut live, "view");
        live.set_camera(base.camera.clone());
        run(&mut live, "view back");
    }
}
