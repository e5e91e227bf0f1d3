use strandlight_scattering::random::SplitMix64;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::{Picture, PreparedScene};

use super::{Converged, Convergence, TILE, block_norm};
use crate::environment::LightSampler;
use crate::integrator::{CameraRay, Integrator, Layers};
use crate::{Environment, Film, TracedScene};

const SIZE: [u32; 2] = [96, 80];

/// A truth that is known at every place of the picture, seen with noise.
struct Noisy<'a> {
    scene: &'a PreparedScene,
    /// Standard deviation of a sample over its mean.
    deviation: f64,
}

impl Noisy<'_> {
    /// Radiance where a ray along `direction` meets the screen.
    fn truth(&self, direction: glam::Vec3) -> [f64; 3] {
        let view = view_uniform(&self.scene.camera, &self.scene.strands, SIZE, 1.0);
        let [forward, right, up] = [view.forward, view.right, view.up].map(glam::Vec3::from);
        let depth = direction.dot(forward);
        let x = f64::from(direction.dot(right) / depth * view.focal_px);
        let y = f64::from(direction.dot(up) / depth * view.focal_px);
        let fine = 1.0 + 0.6 * (0.9 * x).sin() * (0.7 * y).cos();
        let wide = 1.5 + (0.05 * x + 0.4).sin() + 0.4 * (0.09 * y).cos();
        [1.0, 0.7, 0.3].map(|colour| colour * fine * wide)
    }
}

impl Integrator for Noisy<'_> {
    fn sample(&self, ray: &CameraRay, random: &mut SplitMix64) -> Layers {
        // Seldom much, mostly little, as paths are.
        let share = 1.0 / (1.0 + self.deviation * self.deviation);
        let is_hit = random.uniform(0.0, 1.0) < share;
        let factor = if is_hit { 1.0 / share } else { 0.0 };
        Layers {
            is_covered: true,
            single: self.truth(ray.direction).map(|x| x * factor),
            ..Layers::default()
        }
    }
}

/// The truth's picture, and one that is wrong by `wrong` at each place.
fn pictures(noisy: &Noisy, wrong: impl Fn(f64, f64) -> f64) -> [Picture; 2] {
    let sure = Noisy {
        deviation: 0.0,
        ..*noisy
    };
    let mut film = Film::new(SIZE);
    film.expose(noisy.scene, &sure, 64, 1, &|_| ());
    let layer = film.single();
    let picture = |of: &dyn Fn(usize) -> f64| Picture {
        width: SIZE[0],
        height: SIZE[1],
        rgba: (layer.rgb.iter().enumerate())
            .map(|(ix, rgb)| {
                let [r, g, b] = rgb.map(|x| x * of(ix) as f32);
                [r, g, b, 1.0]
            })
            .collect(),
    };
    let width = SIZE[0] as usize;
    let of_place = |ix: usize| wrong((ix % width) as f64, (ix / width) as f64);
    [picture(&|_| 1.0), picture(&of_place)]
}

/// Squares of the differences of means over blocks, added up.
fn block_error(a: &Picture, b: &Picture) -> f64 {
    let rgba = a.rgba.iter().zip(&b.rgba);
    let difference = rgba.map(|(a, b)| std::array::from_fn(|c| a[c] - b[c]));
    block_norm(&Picture {
        rgba: difference.collect(),
        ..*a
    })
}

fn relative_error(a: &Picture, truth: &Picture) -> f64 {
    (block_error(a, truth) / block_norm(truth)).sqrt()
}

/// Wrong by a third over the whole picture, here more and there less.
fn a_third(x: f64, y: f64) -> f64 {
    0.67 + 0.15 * (0.06 * x).sin() * (0.05 * y).cos()
}

#[test]
fn without_noise_it_is_the_mean_of_the_samples() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 0.0,
    };
    let [_, fast] = pictures(&noisy, |x, y| 0.3 + 0.5 * (7.0 * x + 3.0 * y).sin().abs());
    let mut film = Film::new(SIZE);
    film.expose(&scene, &noisy, 256, 5, &|_| ());
    let mut convergence = Convergence::new(fast, &scene, 5).evenly();
    // The same in each sequence: there is no noise.
    convergence.trace(&scene, &noisy, 256);
    for sums in &mut convergence.sums {
        let mean = [0, 1, 2].map(|c: usize| sums.of.iter().map(|sum| sum[c]).sum::<f64>() / 4.0);
        sums.of = [mean; 4];
    }
    let converged = convergence.converged();
    for (found, expected) in converged.picture.rgba.iter().zip(&film.single().rgb) {
        for c in 0..3 {
            assert!(
                (found[c] - expected[c]).abs() < 0.02 * expected[c],
                "{found:?} {expected:?}"
            );
        }
    }
    assert!(
        converged.relative_error < 1e-5,
        "{}",
        converged.relative_error
    );
}

#[test]
fn noise_never_adds_more_than_it_mends() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 3.0,
    };
    let [truth, right] = pictures(&noisy, |_, _| 1.0);
    let [_, wrong] = pictures(&noisy, a_third);
    for (fast, samples) in [
        (&right, 2),
        (&right, 16),
        (&wrong, 2),
        (&wrong, 16),
        (&wrong, 256),
    ] {
        let mut convergence = Convergence::new(fast.clone(), &scene, 9);
        convergence.trace(&scene, &noisy, samples);
        let converged = convergence.converged();
        let before = relative_error(fast, &truth);
        let after = relative_error(&converged.picture, &truth);
        // Of a mean over 4x4 pixels.
        let plain = noisy.deviation / 4.0 / f64::from(samples).sqrt();
        println!(
            "{samples}: fast {before:.4}, plain {plain:.4}, converged {after:.4}, said {:.4}",
            converged.relative_error
        );
        // Right pictures stay so, and wrong ones are not made worse by the least of samples.
        let worst = if before < 1e-4 {
            0.1 * plain
        } else {
            0.5 * before
        };
        assert!(after < worst, "{samples}: {before} {plain} {after}");
        assert!(after < 0.5 * plain, "{samples}: {plain} {after}");
    }
}

/// How many tiles are off by no more than their 95 % interval, and how many there are.
fn tiles_inside(converged: &Converged, truth: &Picture) -> [u32; 2] {
    let [width, tile] = [SIZE[0] as usize, TILE as usize];
    let across = width / tile;
    let mut inside = 0;
    for (ix, error) in converged.tile_error.iter().enumerate() {
        let [x, y] = [ix % across * tile, ix / across * tile];
        let places = (y..y + tile).flat_map(|y| (x..x + tile).map(move |x| y * width + x));
        // One channel: they all have the same noise.
        let off = places.map(|at| converged.picture.rgba[at][0] - truth.rgba[at][0]);
        let off = off.sum::<f32>() / (tile * tile) as f32;
        inside += u32::from(off.abs() < 1.96 * error[0]);
    }
    [inside, converged.tile_error.len() as u32]
}

/// Noise hides what the picture is off by: by chance it seems to be nothing, which the stated error must not believe.
#[test]
fn what_noise_hides_is_not_taken_for_right() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 3.0,
    };
    let [truth, fast] = pictures(&noisy, |x, y| {
        1.0 + 0.15 * (0.2 * x).sin() * (0.17 * y).cos()
    });
    let mut sum = [0; 2];
    for seed in 0..32 {
        let mut convergence = Convergence::new(fast.clone(), &scene, seed);
        convergence.trace(&scene, &noisy, 2);
        let found = tiles_inside(&convergence.converged(), &truth);
        sum = std::array::from_fn(|ix| sum[ix] + found[ix]);
    }
    let share = f64::from(sum[0]) / f64::from(sum[1]);
    println!("inside {share:.3}");
    assert!(share > 0.9, "{share}");
}

#[test]
fn expected_errors_are_those_that_are_found() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 3.0,
    };
    let [truth, fast] = pictures(&noisy, a_third);
    for samples in [8, 32, 128] {
        let (mut found, mut expected) = (0.0, 0.0);
        let (mut inside, mut n_tiles) = (0, 0);
        for seed in 0..16 {
            let mut convergence = Convergence::new(fast.clone(), &scene, seed);
            convergence.trace(&scene, &noisy, samples);
            let converged = convergence.converged();
            found += block_error(&converged.picture, &truth);
            expected += converged.relative_error.powi(2) * block_norm(&converged.picture);
            let [within, all] = tiles_inside(&converged, &truth);
            inside += within;
            n_tiles += all;
        }
        let share = f64::from(inside) / f64::from(n_tiles);
        let ratio = (found / expected).sqrt();
        println!("{samples}: found over expected {ratio:.3}, inside {share:.3} of {n_tiles}");
        // Few samples of much noise tell less of the error than it may be.
        assert!((0.65..1.1).contains(&ratio), "{samples}: {ratio}");
        assert!((0.93..=0.97).contains(&share), "{samples}: {share}");
    }
}

#[test]
fn a_lone_wrong_place_is_mended_and_its_error_is_told() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 1.0,
    };
    // Too dark about the middle of a tile, and right elsewhere.
    let [truth, fast] = pictures(&noisy, |x, y| {
        let square = (x - 39.5).powi(2) + (y - 39.5).powi(2);
        1.0 - 0.6 * (-square / 72.0).exp()
    });
    let width = SIZE[0] as usize;
    let tile = 2 * (width / TILE as usize) + 2;
    let mean_of_tile = |picture: &Picture| {
        let rows = (32..48).flat_map(|y| (32..48).map(move |x| y * width + x));
        rows.map(|ix| f64::from(picture.rgba[ix][0])).sum::<f64>() / 256.0
    };
    let expected = mean_of_tile(&truth);
    let before = mean_of_tile(&fast) / expected - 1.0;
    assert!(before < -0.3, "{before}");
    let n_seeds = 32;
    let [mut off, mut error] = [0.0; 2];
    for seed in 0..n_seeds {
        let mut convergence = Convergence::new(fast.clone(), &scene, seed);
        convergence.trace(&scene, &noisy, 8);
        let converged = convergence.converged();
        off += (mean_of_tile(&converged.picture) / expected - 1.0) / n_seeds as f64;
        error += f64::from(converged.tile_error[tile][0]) / expected / n_seeds as f64;
    }
    // As everything around is right, it is not believed wholly; nor is its error known from there.
    println!("{before:.4} before, {off:.4} after, told {error:.4}");
    assert!(off.abs() < 0.08, "{off}");
    assert!(error > off.abs() / 5.0, "{error} {off}");
}

#[test]
fn the_mean_of_the_whole_picture_is_right_at_once() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 3.0,
    };
    let [truth, fast] = pictures(&noisy, |_, _| 0.9);
    let mean = |picture: &Picture| {
        let sum: f32 = picture.rgba.iter().map(|rgba| rgba[0]).sum();
        f64::from(sum) / picture.rgba.len() as f64
    };
    let mut convergence = Convergence::new(fast.clone(), &scene, 2);
    convergence.trace(&scene, &noisy, 4);
    let converged = convergence.converged();
    let [before, after] = [&fast, &converged.picture].map(|picture| mean(picture) / mean(&truth));
    assert!((before - 0.9).abs() < 1e-3, "{before}");
    // 3 / sqrt(4 * 96 * 80) is 0.017.
    assert!((after - 1.0).abs() < 0.05, "{after}");
}

#[test]
fn samples_of_two_calls_are_those_of_one() {
    let scene = crate::tests::scene();
    let traced = TracedScene::new(&scene).unwrap();
    let environment = Environment::Lights(LightSampler::new(&scene.lights));
    let tracer = traced.tracer(&environment);
    let size = [24, 16];
    let (fast, _) = strandlight_cpu::render(&scene, &scene.camera, size, 4).unwrap();
    let run = |parts: &[u32], threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut convergence = Convergence::new(fast.clone(), &scene, 3);
            for &n in parts {
                convergence.trace(&scene, &tracer, n);
            }
            convergence.converged()
        })
    };
    assert_eq!(run(&[8], 1), run(&[2, 1, 5], 3));
}

#[test]
fn the_error_of_the_fast_picture_is_told_where_samples_show_it() {
    let scene = crate::tests::scene();
    let noisy = Noisy {
        scene: &scene,
        deviation: 3.0,
    };
    let [truth, fast] = pictures(&noisy, a_third);
    let told = |fast: &Picture, samples: u32, seed: u64| {
        let mut convergence = Convergence::new(fast.clone(), &scene, seed);
        convergence.trace(&scene, &noisy, samples);
        convergence.converged().relative_error_of_fast
    };
    let before = relative_error(&fast, &truth);
    let found = told(&fast, 128, 0).expect("more than the noise");
    assert!((found / before - 1.0).abs() < 0.1, "{found} {before}");
    // A picture that is right: half of the time the noise seems to be less than it is, and then there is nothing to tell.
    let of_right: Vec<Option<f64>> = (0..12).map(|seed| told(&truth, 2, seed)).collect();
    assert!(of_right.contains(&None), "{of_right:?}");
    assert!(of_right.iter().flatten().all(|error| *error > 0.0));
}
