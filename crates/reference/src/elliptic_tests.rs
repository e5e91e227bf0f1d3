//! Elliptic hair: against quadrature, one method against another, and turned about its axis.

use super::*;

use crate::film::Pixel;
use crate::{PathTracer, TracedScene};

const FRESNEL: Fresnel = Fresnel::Dielectric;

fn elliptic() -> HairParams {
    HairParams {
        eccentricity: 0.85,
        ..blond()
    }
}

fn bcsdf(hair: &HairParams, modes: &[Lobe]) -> Bcsdf {
    Bcsdf::new(hair, FRESNEL, modes).unwrap()
}

/// The frame of every point turned by a quarter about the strand.
fn turned(strands: &Strands) -> Strands {
    let mut turned = strands.clone();
    for (normal, tangent) in turned.normals.iter_mut().zip(&strands.tangents) {
        let [u, v] = [tangent, &*normal].map(|x| Vec3::from_slice(x));
        let w = u.cross(v);
        *normal = [w.x, w.y, w.z, normal[3]];
    }
    turned
}

/// What the strand at x = z = 0 sends by `modes`, from quadrature in its frame.
fn from_quadrature(
    strands: &Strands,
    set: &SrbfLight,
    view: Vec3,
    hair: &HairParams,
    modes: &[Lobe],
) -> [f64; 3] {
    let (theta, phi) = angles(strands, Vec3::from(set.direction));
    let lambda = f64::from(set.lambda);
    let source = Light { theta, phi, lambda };
    let (theta, phi) = angles(strands, -view);
    let mut expected = [0.0; 3];
    for &lobe in modes {
        let sent = single(lobe, source, View { theta, phi }, hair, FRESNEL);
        for c in 0..3 {
            expected[c] += sent[c] * f64::from(set.rgb[c]);
        }
    }
    expected
}

#[test]
fn a_lone_elliptic_fibre_sends_what_quadrature_says() {
    let hair = elliptic();
    for modes in [&[Lobe::Trt][..], &Lobe::ALL] {
        let bcsdf = bcsdf(&hair, modes);
        let upright = fibres(&[[0.0, 0.0, 0.1]]);
        // From before, and with another side of the section to the eye.
        for strands in [turned(&upright), upright] {
            let rays = Rays::new(&strands);
            let set = light([0.3, 0.4, 1.0], 0.4, [3.0, 2.0, 1.0]);
            let environment = Environment::Lights(LightSampler::new(&[set]));
            for view in [Vec3::NEG_Z, Vec3::new(-0.8, 0.1, -1.0)] {
                let expected = from_quadrature(&strands, &set, view, &hair, modes);
                let directional = Directional::new(&strands, &rays, &bcsdf, &environment, 8192, 1);
                assert_near(mean(&directional, view, 64).single, expected, 0.01);
                let path = PathTracer::new(&strands, &rays, &bcsdf, &environment);
                assert_near(mean(&path, view, 40_000).single, expected, 0.02);
            }
        }
    }
}

#[test]
fn roll_is_seen() {
    let upright = fibres(&[[0.0, 0.0, 0.1]]);
    let set = light([0.2, 0.2, 1.0], 0.3, [1.0; 3]);
    let environment = Environment::Lights(LightSampler::new(&[set]));
    let ratio = |hair: &HairParams| {
        let bcsdf = bcsdf(hair, &[Lobe::Trt]);
        let [a, b] = [&upright, &turned(&upright)].map(|strands| {
            let rays = Rays::new(strands);
            let directional = Directional::new(strands, &rays, &bcsdf, &environment, 2048, 1);
            mean(&directional, Vec3::NEG_Z, 64).single[0]
        });
        b / a
    };
    let [elliptic, round] = [elliptic(), blond()].map(|hair| ratio(&hair));
    println!("turned by a quarter: {elliptic:.3}, round {round:.6}");
    assert!((round - 1.0).abs() < 1e-5, "{round}");
    assert!((elliptic - 1.0).abs() > 0.3, "{elliptic}");
}

/// The scene of the other tests with `hair`.
fn scene_of(hair: &HairParams) -> PreparedScene {
    let mut scene = scene();
    scene.hair.apply(hair).unwrap();
    scene
}

/// Sums over the pixels of the single layer of each channel, and their variance.
fn single_layer(scene: &PreparedScene, integrator: &dyn Integrator, n: u32) -> [[f64; 2]; 3] {
    // Seeds are independent, samples of one pixel are not.
    let n_seeds = 8;
    let of_seed = (0..n_seeds).map(|seed| {
        let mut film = Film::new([48, 32]);
        film.expose(scene, integrator, n, 100 + seed, &|_| ());
        let add = |sums: [f64; 3], pixel: Pixel| {
            std::array::from_fn(|c| sums[c] + pixel.single[c] / f64::from(n))
        };
        film.pixels().fold([0.0; 3], add)
    });
    let of_seed: Vec<[f64; 3]> = of_seed.collect();
    let n_seeds = n_seeds as f64;
    std::array::from_fn(|c| {
        let mean = of_seed.iter().map(|sums| sums[c]).sum::<f64>() / n_seeds;
        let squares: f64 = of_seed.iter().map(|sums| (sums[c] - mean).powi(2)).sum();
        [mean, squares / ((n_seeds - 1.0) * n_seeds)]
    })
}

/// Two estimators that share neither directions nor densities.
#[test]
fn single_scattering_of_paths_is_that_of_directional_lights() {
    let scene = scene_of(&elliptic());
    let environment = Environment::Lights(LightSampler::new(&scene.lights));
    let rays = Rays::new(&scene.strands);
    let traced = TracedScene::new(&scene).unwrap();
    let paths = single_layer(&scene, &traced.tracer(&environment), 32);
    let seen = |hair: &HairParams| {
        let bcsdf = bcsdf(hair, &Lobe::ALL);
        let lights = Directional::new(&scene.strands, &rays, &bcsdf, &environment, 4096, 3);
        single_layer(&scene, &lights, 32)
    };
    let [lights, round] = [elliptic(), blond()].map(|hair| seen(&hair));
    let z = |other: &[[f64; 2]; 3], c: usize| {
        let [[a, e], [b, f]] = [paths[c], other[c]];
        (a - b) / (e + f).sqrt()
    };
    for c in 0..3 {
        let [z, other] = [z(&lights, c), z(&round, c)];
        let relative = (paths[c][1] + lights[c][1]).sqrt() / paths[c][0];
        println!("channel {c}: {z:.2} sigma of {relative:.4}; round hair {other:.1}");
        assert!(relative < 0.005, "{relative}");
        assert!(z.abs() < 3.5, "{z}");
        // It could fail.
        assert!(other.abs() > 5.0, "{other}");
    }
}
