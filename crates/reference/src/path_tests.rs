use strandlight_formats::SrbfLight;
use strandlight_scattering::exact::{Light, View, single};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, Model};
use strandlight_scene::proxy::{Proxy, ProxyRecords};

use super::super::environment::{LightSampler, MapSampler};
use super::*;
use crate::rays::Crossing;
use crate::tests::proxies::{ellipsoid, of_triangles};
use strandlight_images::Map;

/// Mean and standard error of each channel.
#[derive(Default)]
struct Mean {
    n: f64,
    sum: [f64; 3],
    squares: [f64; 3],
}

impl Mean {
    fn add(&mut self, value: [f64; 3]) {
        self.n += 1.0;
        for (c, x) in value.into_iter().enumerate() {
            self.sum[c] += x;
            self.squares[c] += x * x;
        }
    }

    fn get(&self, c: usize) -> (f64, f64) {
        let mean = self.sum[c] / self.n;
        let variance = (self.squares[c] / self.n - mean * mean).max(0.0);
        (mean, (variance / self.n).sqrt())
    }
}

fn three(random: &mut SplitMix64) -> [f64; 3] {
    std::array::from_fn(|_| random.uniform(0.0, 1.0))
}

fn bcsdf(hair: &HairParams) -> Bcsdf {
    Bcsdf::new(hair, Fresnel::Dielectric, &Lobe::ALL).unwrap()
}

fn white() -> HairParams {
    HairParams {
        sigma_a: [0.0; 3],
        ..HairParams::default()
    }
}

/// Radiance 1 from everywhere.
fn furnace() -> Environment {
    let map = Map::new(8, 4, vec![[1.0; 3]; 32]).unwrap();
    Environment::Map(MapSampler::new(map.grid(), map.pixels(), 0.0, [1.0; 3]))
}

/// A ball of radius 1 of short strands in all directions, dense: a ray through its middle crosses
/// some 30.
fn ball() -> Strands {
    let mut random = SplitMix64(11);
    let (mut points, mut offsets) = (Vec::new(), vec![0]);
    while offsets.len() <= 4000 {
        let mut unit = || random.uniform(-1.0, 1.0) as f32;
        let root = Vec3::new(unit(), unit(), unit());
        let along = Vec3::new(unit(), unit(), unit());
        let bend = 0.3 * Vec3::new(unit(), unit(), unit());
        if root.length() > 1.0 || !(0.1..1.0).contains(&along.length()) {
            continue;
        }
        let step = 0.25 * along.normalize();
        points.extend([root, root + step, root + 2.0 * step + 0.25 * bend].map(|p| p.to_array()));
        offsets.push(points.len() as u32);
    }
    Strands::new(&points, &offsets, |_, _| 0.03, false).unwrap()
}

/// Ray `ix` from around the ball towards its middle.
fn at_ball(seed: u64, ix: u64) -> (Start, Vec3, SplitMix64) {
    let mut random = SplitMix64::of_item(seed, ix);
    let mut unit = || random.uniform(-1.0, 1.0) as f32;
    let towards = Vec3::new(unit(), unit(), unit()).normalize_or(Vec3::X);
    let aside = 0.5 * Vec3::new(unit(), unit(), unit());
    (Start::camera(aside - 4.0 * towards), towards, random)
}

/// Paths from around the ball to its middle; those that miss do not count.
fn mean_of_ball(tracer: &PathTracer, n: u64, seed: u64) -> (Mean, f64, u64) {
    let (mut mean, mut events, mut capped) = (Mean::default(), 0.0, 0);
    for ix in 0..n {
        let (start, towards, mut random) = at_ball(seed, ix);
        let traced = tracer.trace(&start, towards, three(&mut random), &mut random);
        if traced.is_covered {
            mean.add(traced.total);
            events += f64::from(traced.events);
            capped += u64::from(traced.is_capped);
        }
    }
    let events = events / mean.n;
    (mean, events, capped)
}

/// A walk without roulette and without looking for light: the product of its weights, which is
/// what the furnace shows; and what p >= 3 alone leaves of it.
fn walk(tracer: &PathTracer, start: &Start, direction: Vec3, random: &mut SplitMix64) -> [f64; 3] {
    let (mut start, mut direction) = (*start, direction);
    let (mut weight, mut kept) = (1.0, 1.0);
    while let Some(crossing) = tracer.world.rays.nearest(&start, direction) {
        let frame = Frame::at(tracer.strands, &crossing);
        let omega_o = frame.to_fibre(-direction);
        let view = tracer.fibres.view(tracer.strands, &crossing, omega_o);
        let sample = view.sample(&mut || random.uniform(0.0, 1.0)).unwrap();
        weight *= sample.weight[0];
        // 0.7 % of the paths at normal incidence take more than two segments.
        kept *= 1.0 - 0.0066;
        direction = frame.to_world(sample.omega_i);
        start = Start::inside(tracer.strands, crossing.segment, crossing.along);
    }
    [weight, kept, 0.0]
}

#[test]
fn slow_a_white_groom_vanishes_in_a_furnace() {
    let strands = ball();
    let rays = Rays::new(&strands);
    let (bcsdf, environment) = (bcsdf(&white()), furnace());
    let tracer = || PathTracer::new(&strands, &rays, &bcsdf, &environment);
    // Every event made to return all: the ball must vanish.
    for estimator in [Estimator::Both, Estimator::Fibre] {
        let tracer = tracer().with_estimator(estimator).with_energy_of(&bcsdf);
        let (mean, events, capped) = mean_of_ball(&tracer, 25_000, 1);
        let (value, error) = mean.get(0);
        println!("{estimator:?}: {value:.4} +- {error:.4}, {events:.1} events");
        assert_eq!(capped, 0);
        assert!(events > 8.0, "the ball is not dense: {events}");
        assert!(error < 0.008 && (value - 1.0).abs() < 3.0 * error);
    }
    // The exact S: half is lost in some 9 events, p >= 3 a tenth of that; the rest is the factor
    // cos^2 theta_i / cos^2 theta_d (Bcsdf::albedo).
    let (mean, events, _) = mean_of_ball(&tracer(), 25_000, 1);
    let (value, error) = mean.get(0);
    let mut walks = Mean::default();
    for ix in 0..25_000 {
        let (start, towards, mut random) = at_ball(2, ix);
        if rays.is_blocked(&start, towards) {
            walks.add(walk(&tracer(), &start, towards, &mut random));
        }
    }
    let (expected, spread) = walks.get(0);
    println!("exact: {value:.4} +- {error:.4}, {events:.1} events");
    println!(
        "walks: {expected:.4} +- {spread:.4}, p >= 3 alone {:.4}",
        walks.get(1).0
    );
    assert!((value - expected).abs() < 3.0 * error.hypot(spread));
    assert!((0.45..0.53).contains(&value), "{value}");
}

/// Of model `energy` it vanishes as it is.
#[test]
fn slow_a_white_groom_of_model_energy_vanishes_in_a_furnace() {
    let strands = ball();
    let rays = Rays::new(&strands);
    let environment = furnace();
    let bcsdf = bcsdf(&HairParams {
        model: Model::Energy,
        ..white()
    });
    for estimator in [Estimator::Both, Estimator::Fibre] {
        let tracer =
            PathTracer::new(&strands, &rays, &bcsdf, &environment).with_estimator(estimator);
        let (mean, events, capped) = mean_of_ball(&tracer, 25_000, 1);
        let (value, error) = mean.get(0);
        println!("{estimator:?}: {value:.4} +- {error:.4}, {events:.1} events, {capped} capped");
        assert!(events > 8.0, "the ball is not dense: {events}");
        assert!(error < 0.01 && (0.99 - 2.0 * error..1.0 + 2.0 * error).contains(&value));
    }
    // Weights alone, without light: all that the sampler's tables lose.
    let tracer = PathTracer::new(&strands, &rays, &bcsdf, &environment);
    let mut walks = Mean::default();
    for ix in 0..25_000 {
        let (start, towards, mut random) = at_ball(2, ix);
        if rays.is_blocked(&start, towards) {
            walks.add(walk(&tracer, &start, towards, &mut random));
        }
    }
    let (value, error) = walks.get(0);
    println!("walks: {value:.5} +- {error:.5}");
    assert!(error < 6e-3 && (value - 1.0).abs() < 3.0 * error, "{value}");
}

/// Elliptic hair made to return all vanishes too: its albedo follows the azimuth.
#[test]
fn slow_a_white_elliptic_groom_vanishes_in_a_furnace() {
    let strands = ball();
    let rays = Rays::new(&strands);
    let environment = furnace();
    let bcsdf = bcsdf(&HairParams {
        eccentricity: 1.25,
        ..white()
    });
    let tracer = PathTracer::new(&strands, &rays, &bcsdf, &environment).with_energy_of(&bcsdf);
    let (mean, events, capped) = mean_of_ball(&tracer, 25_000, 1);
    let (value, error) = mean.get(0);
    println!("{value:.4} +- {error:.4}, {events:.1} events");
    assert_eq!(capped, 0);
    assert!(
        error < 0.008 && (value - 1.0).abs() < 3.0 * error,
        "{value}"
    );
}

/// A straight thick strand along an oblique axis and a light from aside.
fn lone_strand() -> (Strands, SrbfLight) {
    let along = Vec3::new(0.3, 1.0, 0.2);
    let points = [(-10.0 * along).to_array(), (10.0 * along).to_array()];
    let strands = Strands::new(&points, &[0, 2], |_, _| 0.4, false).unwrap();
    let light = SrbfLight {
        direction: Vec3::new(0.6, 0.3, 0.7).normalize().to_array(),
        lambda: 0.25,
        rgb: [3.0, 2.0, 1.0],
    };
    (strands, light)
}

#[test]
fn a_lone_strand_is_the_single_scattering_integral() {
    let (strands, light) = lone_strand();
    let rays = Rays::new(&strands);
    let hair = HairParams {
        sigma_a: [0.1, 0.3, 0.6],
        ..HairParams::default()
    };
    let bcsdf = bcsdf(&hair);
    let environment = Environment::Lights(LightSampler::new(&[light]));
    let frame = Frame::at(
        &strands,
        &Crossing {
            t: 0.0,
            segment: 0,
            along: 0.5,
        },
    );
    let angles = |omega: Vec3| {
        let [u, v, w] = frame.to_fibre(omega);
        (u.asin(), w.atan2(v))
    };
    let mut checked = 0;
    for from in [
        Vec3::new(0.0, 0.2, 5.0),
        Vec3::new(4.0, -2.0, -3.0),
        Vec3::new(-5.0, 0.5, 1.0),
    ] {
        let direction = -from.normalize();
        let ((theta_o, phi_o), (theta_j, phi_j)) =
            (angles(-direction), angles(Vec3::from(light.direction)));
        let mut expected = [0.0; 3];
        for lobe in Lobe::ALL {
            let part = single(
                lobe,
                Light {
                    theta: theta_j,
                    phi: phi_j,
                    lambda: f64::from(light.lambda),
                },
                View {
                    theta: theta_o,
                    phi: phi_o,
                },
                &hair,
                Fresnel::Dielectric,
            );
            for c in 0..3 {
                expected[c] += part[c] * f64::from(light.rgb[c]);
            }
        }
        for estimator in [Estimator::Both, Estimator::Fibre, Estimator::Light] {
            let tracer =
                PathTracer::new(&strands, &rays, &bcsdf, &environment).with_estimator(estimator);
            let mut mean = Mean::default();
            for ix in 0..60_000 {
                let mut random = SplitMix64::of_item(4, ix);
                let start = Start::camera(from);
                let traced = tracer.trace(&start, direction, three(&mut random), &mut random);
                assert!(traced.is_covered && traced.events == 1, "{traced:?} {from}");
                assert_eq!(traced.single, traced.total);
                mean.add(traced.single);
            }
            for (c, expected) in expected.into_iter().enumerate() {
                let (value, error) = mean.get(c);
                println!("{estimator:?} {c}: {value:.5} +- {error:.5}, {expected:.5}");
                assert!((value - expected).abs() < 3.5 * error + 1e-3 * expected);
                if estimator == Estimator::Both {
                    assert!((value / expected - 1.0).abs() < 0.01);
                }
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 27);
}

#[test]
fn draws_of_the_light_lie_in_strata_of_their_own() {
    let mut random = SplitMix64(8);
    for n in [1, 2, 4] {
        let first = three(&mut random);
        let drawn: Vec<[f64; 3]> = (0..n).map(|ix| spread(first, ix, n)).collect();
        assert_eq!(drawn[0], first);
        let mut strata: Vec<u32> = (drawn.iter())
            .map(|u| (u[0] * f64::from(n)) as u32)
            .collect();
        strata.sort();
        assert_eq!(strata, (0..n).collect::<Vec<_>>());
        assert!(drawn.iter().flatten().all(|u| (0.0..1.0).contains(u)));
    }
}

#[test]
fn paths_of_a_part_bring_what_whole_ones_bring_of_it() {
    let strands = ball();
    let rays = Rays::new(&strands);
    let hair = HairParams {
        sigma_a: [0.05, 0.3, 1.5],
        ..HairParams::default()
    };
    let bcsdf = bcsdf(&hair);
    let environment = furnace();
    let ground = Proxy::Ground {
        height: -0.8,
        albedo: [0.7; 3],
    };
    let beside = [ground, ellipsoid(Vec3::new(-1.4, 0.0, 0.0))];
    let proxies = ProxyRecords::new(&beside, &strands);
    let meshes = [MeshRays::new(&of_triangles(Vec3::new(1.4, 0.0, 0.3)))];
    let alone = || PathTracer::new(&strands, &rays, &bcsdf, &environment);
    parts_are_those_of_the_whole(alone);
    parts_are_those_of_the_whole(|| alone().with_proxies(proxies.list()).with_meshes(&meshes));
}

fn parts_are_those_of_the_whole<'a>(tracer: impl Fn() -> PathTracer<'a>) {
    let whole = tracer();
    let n_events = [
        Scattering::Single,
        Scattering::Global,
        Scattering::Local,
        Scattering::Total,
    ]
    .map(|scattering| {
        let part = tracer().with_scattering(scattering);
        let mut n_events = 0;
        for ix in 0..2000 {
            let sample = |tracer: &PathTracer| {
                let (start, towards, mut random) = at_ball(5, ix);
                tracer.trace(&start, towards, three(&mut random), &mut random)
            };
            let [part, whole] = [&part, &whole].map(sample);
            let of = |traced: &Traced| match scattering {
                Scattering::Single => traced.single,
                Scattering::Global => traced.forward,
                Scattering::Local | Scattering::Total => traced.total,
            };
            assert_eq!(of(&part), of(&whole), "{scattering:?} {ix}");
            assert_eq!(part.matte, whole.matte, "{scattering:?} {ix}");
            // Proxies are seen in all light.
            n_events += if part.is_matte { 0 } else { part.events };
        }
        n_events
    });
    let [single, global, local, total] = n_events;
    assert!(single <= 2000 && local == total, "{n_events:?}");
    assert!(single < global && global < total, "{n_events:?}");
}

#[test]
fn slow_all_ways_of_finding_the_light_agree() {
    let strands = ball();
    let rays = Rays::new(&strands);
    let hair = HairParams {
        sigma_a: [0.05, 0.3, 1.5],
        ..HairParams::default()
    };
    let bcsdf = bcsdf(&hair);
    let light = |direction: Vec3, lambda, rgb| SrbfLight {
        direction: direction.normalize().to_array(),
        lambda,
        rgb,
    };
    let environment = Environment::Lights(LightSampler::new(&[
        light(Vec3::new(0.5, 1.0, 0.3), 0.3, [4.0, 3.0, 2.0]),
        light(Vec3::new(-1.0, 0.2, 0.4), 1.0, [0.3, 0.6, 0.9]),
    ]));
    let of = |estimator| {
        let tracer =
            PathTracer::new(&strands, &rays, &bcsdf, &environment).with_estimator(estimator);
        mean_of_ball(&tracer, 40_000, 21).0
    };
    let both = of(Estimator::Both);
    for estimator in [Estimator::Fibre, Estimator::Light] {
        let other = of(estimator);
        for c in 0..3 {
            let ((a, e), (b, f)) = (both.get(c), other.get(c));
            println!("{estimator:?} {c}: {b:.4} +- {f:.4}, both {a:.4} +- {e:.4}");
            assert!((a - b).abs() < 3.5 * e.hypot(f), "{a} {b}");
            assert!(e < 0.04 * a && f < 0.08 * b);
        }
    }
}
