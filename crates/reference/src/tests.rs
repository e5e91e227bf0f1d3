//! The methods against quadrature of the exact model, and the film against itself.

#[path = "elliptic_tests.rs"]
mod elliptic;
#[path = "painted_tests.rs"]
mod painted;
#[path = "part_tests.rs"]
mod part_tests;
#[path = "proxy_tests.rs"]
pub(crate) mod proxies;

use glam::Vec3;
use strandlight_formats::{BakedFile, Groom, LightSet, Scene, SrbfLight};
use strandlight_scattering::dual_scattering::{Average, AverageTable, Backscatter};
use strandlight_scattering::exact::{
    Bcsdf, Forward, Light, View, direct_local, global, local, single,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::provenance::Provenance;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume;

use super::directional::directional_lights;
use super::environment::LightSampler;
use super::{
    Averages, Backdrop, CameraRay, Densities, Directional, Environment, Fibres, FileError, Film,
    Integrator, Layers, Method, RayShoot, ReferenceFile,
};
use crate::rays::{Rays, Start};
use strandlight_cpu as cpu;
use strandlight_scattering::random::SplitMix64;

fn light(direction: [f32; 3], lambda: f32, rgb: [f32; 3]) -> SrbfLight {
    SrbfLight {
        direction: Vec3::from(direction).normalize().to_array(),
        lambda,
        rgb,
    }
}

/// Straight strands along +Y of one segment each: x, z, diameter.
fn fibres(fibres: &[[f32; 3]]) -> Strands {
    let points: Vec<[f32; 3]> = fibres
        .iter()
        .flat_map(|&[x, z, _]| [[x, -50.0, z], [x, 50.0, z]])
        .collect();
    let offsets: Vec<u32> = (0..=fibres.len() as u32).map(|ix| 2 * ix).collect();
    let diameter = |strand: usize, _| fibres[strand][2];
    Strands::new(&points, &offsets, diameter, false).unwrap()
}

fn blond() -> HairParams {
    HairParams {
        sigma_a: [0.02, 0.06, 0.2],
        ..HairParams::default()
    }
}

/// A camera ray that meets the strand at x = z = 0, seen along `direction`.
fn ray(direction: Vec3, sample: u32) -> CameraRay {
    let direction = direction.normalize();
    CameraRay {
        start: Start::camera(-20.0 * direction),
        direction,
        pixel_key: 17,
        sample,
    }
}

fn mean(integrator: &dyn Integrator, direction: Vec3, n: u32) -> Layers {
    let mut mean = Layers::default();
    for sample in 0..n {
        let mut random = SplitMix64::of_item(5, u64::from(sample));
        let seen = integrator.sample(&ray(direction, sample), &mut random);
        assert!(seen.is_covered);
        for c in 0..3 {
            mean.single[c] += seen.single[c] / f64::from(n);
            mean.global[c] += seen.global[c] / f64::from(n);
            mean.local[c] += seen.local[c] / f64::from(n);
        }
    }
    mean
}

/// Inclination and azimuth in the frame of the strand at x = z = 0.
fn angles(strands: &Strands, direction: Vec3) -> (f64, f64) {
    let [u, v] = [&strands.tangents[0], &strands.normals[0]].map(|x| Vec3::from_slice(x));
    let [u, v, w] = [u, v, u.cross(v)].map(|axis| f64::from(axis.dot(direction.normalize())));
    (u.clamp(-1.0, 1.0).asin(), w.atan2(v))
}

fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    for c in 0..3 {
        let error = found[c] / expected[c] - 1.0;
        assert!(error.abs() < tolerance, "{found:?} {expected:?}: {error}");
    }
}

#[test]
fn directional_lights_have_the_power_of_the_set() {
    let set = [
        light([1.0, 2.0, 0.5], 0.05, [50.0, 40.0, 30.0]),
        light([-1.0, 0.3, 1.0], 0.6, [1.0, 2.0, 3.0]),
        light([0.0, 1.0, 0.0], 5.0, [0.1, 0.2, 0.3]),
    ];
    let lights = directional_lights(&Environment::Lights(LightSampler::new(&set)), 1536, 3);
    assert_eq!(lights.len(), 1536);
    for c in 0..3 {
        let power: f64 = lights.iter().map(|light| light.power[c]).sum();
        let expected: f64 = set.iter().map(|light| volume::power(light)[c]).sum();
        let error = power / expected - 1.0;
        assert!(error.abs() < 0.005, "{c}: {power} {expected}");
    }
    // Each has the same share of it, in the mean of the channels.
    let share = |ix: usize| lights[ix].power.iter().sum::<f64>();
    assert!((share(0) / share(1000) - 1.0).abs() < 1e-4);
    let dark = Environment::Lights(LightSampler::new(&[]));
    assert!(directional_lights(&dark, 8, 0).is_empty());
}

#[test]
fn a_lone_fibre_sends_what_quadrature_says() {
    let strands = fibres(&[[0.0, 0.0, 0.1]]);
    let rays = Rays::new(&strands);
    let hair = blond();
    let bcsdf = Bcsdf::new(&hair, Fresnel::Dielectric, &Lobe::ALL).unwrap();
    let averages = AverageTable::new(&hair, Fresnel::Dielectric);
    for (set, view) in [
        (light([0.3, 0.4, 1.0], 0.3, [3.0, 2.0, 1.0]), Vec3::NEG_Z),
        (
            light([1.0, 0.5, -0.2], 0.6, [1.0; 3]),
            Vec3::new(0.2, 0.4, -1.0),
        ),
        (
            light([1.0, 0.2, 0.2], 1.2, [1.0; 3]),
            Vec3::new(0.5, -0.3, -1.0),
        ),
    ] {
        let environment = Environment::Lights(LightSampler::new(&[set]));
        let directional = Directional::new(&strands, &rays, &bcsdf, &environment, 8192, 1);
        let found = mean(&directional, view, 64);
        let (theta, phi) = angles(&strands, Vec3::from(set.direction));
        let source = Light {
            theta,
            phi,
            lambda: f64::from(set.lambda),
        };
        let (theta, phi) = angles(&strands, -view);
        let eye = View { theta, phi };
        let mut expected = [0.0; 3];
        for lobe in Lobe::ALL {
            let sent = single(lobe, source, eye, &hair, Fresnel::Dielectric);
            for c in 0..3 {
                expected[c] += sent[c] * f64::from(set.rgb[c]);
            }
        }
        assert_near(found.single, expected, 0.01);
        assert_eq!((found.global, found.local), ([0.0; 3], [0.0; 3]));

        let ray_shoot = RayShoot {
            strands: &strands,
            rays: &rays,
            proxies: &[],
            meshes: &[],
            fibres: Fibres::Alike(&bcsdf),
            averages: Averages::Alike(&averages),
            environment: &environment,
            n_draws: 16,
            densities: Densities {
                forward: 0.7,
                back: 0.5,
            },
        };
        let found = mean(&ray_shoot, view, 20_000);
        assert_near(found.single, expected, 0.01);
        assert_eq!(found.global, [0.0; 3]);
        let sent_back = direct_local(source, eye, |theta| backscatter(&averages, theta));
        let power = volume::power(&set);
        let expected = std::array::from_fn(|c| 0.5 * sent_back[c] * power[c]);
        assert_near(found.local, expected, 0.02);
    }
}

fn backscatter(averages: &AverageTable, theta: f64) -> Backscatter {
    let row = averages.sample(theta as f32);
    let of = |average: Average| row[average as usize].map(f64::from);
    Backscatter {
        attenuation: of(Average::Ab),
        shift: of(Average::DeltaB),
        width_2: of(Average::SigmaB).map(|width| width * width),
        model: averages.model,
    }
}

#[test]
fn behind_other_fibres_dual_scattering_is_that_of_quadrature() {
    // Two wide fibres between a narrow light along +X and the seen one.
    let strands = fibres(&[[0.0, 0.0, 0.1], [3.0, 0.0, 2.0], [6.0, 0.0, 2.0]]);
    let rays = Rays::new(&strands);
    let hair = blond();
    let bcsdf = Bcsdf::new(&hair, Fresnel::Dielectric, &Lobe::ALL).unwrap();
    let averages = AverageTable::new(&hair, Fresnel::Dielectric);
    let set = light([1.0, 0.3, 0.0], 0.002, [2.0, 3.0, 4.0]);
    let environment = Environment::Lights(LightSampler::new(&[set]));
    let ray_shoot = RayShoot {
        strands: &strands,
        rays: &rays,
        proxies: &[],
        meshes: &[],
        fibres: Fibres::Alike(&bcsdf),
        averages: Averages::Alike(&averages),
        environment: &environment,
        n_draws: 4,
        densities: Densities {
            forward: 0.7,
            back: 0.5,
        },
    };
    let (theta_d, phi_d) = angles(&strands, Vec3::from(set.direction));
    let one = averages.sample(theta_d as f32);
    let (a_f, beta_f_2) = (one[Average::AF as usize], one[Average::BetaF as usize]);
    for direction in [
        Vec3::NEG_Z,
        Vec3::new(0.3, 0.2, -1.0),
        Vec3::new(-0.3, -0.6, 1.0),
    ] {
        let found = mean(&ray_shoot, direction, 30_000);
        assert_eq!(found.single, [0.0; 3]);
        let (theta, phi) = angles(&strands, -direction);
        let eye = View { theta, phi };
        let (mut expected, mut expected_local) = ([0.0; 3], [0.0; 3]);
        for c in 0..3 {
            let forward = Forward {
                theta: theta_d,
                phi: phi_d,
                sigma_f: f64::from(2.0 * beta_f_2[c]).sqrt(),
            };
            let power = volume::power(&set)[c] * f64::from(a_f[c] * a_f[c]);
            for lobe in Lobe::ALL {
                let sent = global(lobe, forward, eye, &hair, Fresnel::Dielectric)[c];
                expected[c] += 0.7 * power * sent;
            }
            let sent_back = local(forward, eye, |theta| backscatter(&averages, theta))[c];
            expected_local[c] = 0.7 * 0.5 * power * sent_back;
        }
        assert_near(found.global, expected, 0.02);
        assert_near(found.local, expected_local, 0.02);
    }
    // In front of the fibres, nothing is in the way.
    let environment = Environment::Lights(LightSampler::new(&[light(
        [-1.0, 0.3, 0.0],
        0.002,
        [1.0; 3],
    )]));
    let ray_shoot = RayShoot {
        environment: &environment,
        ..ray_shoot
    };
    let found = mean(&ray_shoot, Vec3::NEG_Z, 4);
    assert!(found.single[0] > 0.0 && found.global == [0.0; 3]);
}

/// Forty curved strands in a folder's files.
pub(super) fn scene() -> PreparedScene {
    changed_scene(|_| ())
}

/// [`scene`], its file changed.
pub(super) fn changed_scene(change: impl FnOnce(&mut Scene)) -> PreparedScene {
    let folder = tempfile::tempdir().unwrap();
    let mut groom = Groom::default();
    groom.strand_offsets.push(0);
    for strand in 0..40 {
        for point in 0..6 {
            let (x, y) = (strand as f32 * 0.1 - 2.0, -point as f32);
            groom.points.push([x, y, (0.5 * y + x).sin() * 0.3]);
        }
        groom.strand_offsets.push(groom.points.len() as u32);
    }
    groom.write(&folder.path().join("a.groom")).unwrap();
    let lights = LightSet {
        lights: vec![
            light([0.0, 0.6, 0.8], 0.2, [20.0, 19.0, 17.0]),
            light([0.0, 1.0, 0.0], 1.2, [0.4, 0.5, 0.6]),
        ],
        ..LightSet::default()
    };
    lights.write(&folder.path().join("a.lights")).unwrap();
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.hair.diameter_cm = Some(0.06);
    scene.render.background = strandlight_formats::Background::None;
    change(&mut scene);
    let path = folder.path().join("a.toml");
    std::fs::write(&path, scene.to_toml_string().unwrap()).unwrap();
    PreparedScene::load(&Scene::read(&path).unwrap()).unwrap()
}

/// Runs `work` with a directional integrator of 64 lights of `scene`.
fn with_directional<T>(scene: &PreparedScene, work: impl FnOnce(&dyn Integrator) -> T) -> T {
    let rays = Rays::new(&scene.strands);
    let hair = &scene.hair;
    let bcsdf = Bcsdf::new(hair.hair(), hair.fresnel(), hair.modes()).unwrap();
    let environment = Environment::Lights(LightSampler::new(&scene.lights));
    let directional = Directional::new(&scene.strands, &rays, &bcsdf, &environment, 64, 0);
    work(&directional)
}

#[test]
fn a_picture_does_not_depend_on_threads_and_can_be_gone_on_with() {
    let scene = scene();
    with_directional(&scene, |integrator| {
        let expose = |mut film: Film, n: u32, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap()
                .install(|| film.expose(&scene, integrator, n, 9, &|_| ()));
            film
        };
        let size = [70, 40];
        let whole = expose(Film::new(size), 12, 1);
        assert_eq!(whole, expose(Film::new(size), 12, 3));
        assert_eq!(whole, expose(expose(Film::new(size), 5, 2), 7, 2));

        // By way of a file nothing is lost.
        let of = |film: Film, groom: &str| ReferenceFile {
            method: Method::Directional,
            inputs: format!("these {groom}"),
            seed: 9,
            provenance: Provenance::default()
                .with("scene", groom)
                .with("groom", groom),
            film,
        };
        let backdrop = Backdrop::of(&scene, size);
        let part = of(expose(Film::new(size), 5, 2), "a");
        let bytes = part.encode(&backdrop).unwrap();
        assert_eq!(bytes, part.encode(&backdrop).unwrap());
        let mut half = of(Film::new(size), "a");
        half.resume(&bytes).unwrap();
        assert_eq!(half.film, part.film);
        let resumed = of(expose(half.film, 7, 1), "a");
        assert_eq!(resumed.film, whole);
        let at_once = of(whole.clone(), "a").encode(&backdrop).unwrap();
        assert_eq!(resumed.encode(&backdrop).unwrap(), at_once);
        let resumed = resumed.film;
        assert_eq!(resumed.n_samples(), 12);
        let sums = resumed.pixels().flat_map(|pixel| pixel.single);
        let seen = sums.filter(|&sum| sum > 0.0).count();
        assert!(seen > 500, "{seen}");

        // Other pictures are refused by name, damaged ones too.
        let refused = |mut wanted: ReferenceFile, bytes: &[u8]| {
            let before = wanted.clone();
            let error = wanted.resume(bytes).unwrap_err();
            assert_eq!(wanted, before);
            error
        };
        let empty = || of(Film::new(size), "a");
        let method = Method::Path;
        let seed = 10;
        for (wanted, named) in [
            (
                ReferenceFile { method, ..empty() },
                "its method is directional, not path",
            ),
            (of(Film::new([70, 41]), "a"), "its size is 70x40, not 70x41"),
            (ReferenceFile { seed, ..empty() }, "its seed is 9, not 10"),
            (of(Film::new(size), "b"), "its groom is a, not b"),
        ] {
            let error = refused(wanted, &bytes).to_string();
            assert!(error.ends_with(named), "{error}");
        }
        for length in [0, 3, 100, bytes.len() / 2, bytes.len() - 1] {
            refused(empty(), &bytes[..length]);
        }
        let plain = cpu::render(&scene, &scene.camera, size, 4).unwrap().0;
        let plain = strandlight_images::picture::exr_file(&plain).unwrap();
        let error = refused(empty(), &plain);
        assert!(matches!(error, FileError::Missing(_)), "{error}");
    });
}

#[test]
fn the_camera_sees_what_the_rasteriser_draws() {
    let scene = scene();
    let size = [240, 160];
    // Hairs are more than a pixel wide: the rasteriser draws them at their width.
    let view = view_uniform(&scene.camera, &scene.strands, size, 1.0);
    let depth = (scene.strands.centre - scene.camera.eye).length();
    assert!(0.06 * view.focal_px / depth > 1.0);
    let (drawn, _) = cpu::render(&scene, &scene.camera, size, 64).unwrap();
    with_directional(&scene, |integrator| {
        let mut film = Film::new(size);
        film.expose(&scene, integrator, 64, 0, &|_| ());
        let (mut squares, mut reference, mut sums) = (0.0, 0.0, [0.0; 2]);
        for (pixel, rgba) in film.pixels().zip(&drawn.rgba) {
            let (found, expected) = (pixel.covered / 64.0, f64::from(rgba[3]));
            squares += (found - expected).powi(2);
            reference += expected * expected;
            sums[0] += found;
            sums[1] += expected;
        }
        let rmse = (squares / reference).sqrt();
        println!("coverage: relative RMSE {rmse}, {} {}", sums[0], sums[1]);
        assert!((sums[0] / sums[1] - 1.0).abs() < 0.02, "{sums:?}");
        assert!(rmse < 0.2, "{rmse}");
    });
}

#[test]
fn variance_is_that_of_the_mean() {
    // Pictures of different seeds scatter as the variance layer says.
    let scene = scene();
    with_directional(&scene, |integrator| {
        let n = 16.0;
        let films: Vec<Film> = (0..24)
            .map(|seed| {
                let mut film = Film::new([24, 16]);
                film.expose(&scene, integrator, 16, seed, &|_| ());
                film
            })
            .collect();
        let (mut stated, mut seen) = (0.0, 0.0);
        for ix in 0..films[0].n_pixels() {
            let means: Vec<f64> = films.iter().map(|f| f.pixel(ix).total()[1] / n).collect();
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            let squares: f64 = means.iter().map(|x| (x - mean).powi(2)).sum();
            seen += squares / (means.len() - 1) as f64;
            stated += (films[0].pixel(ix).squares[1] / n - means[0].powi(2)) / (n - 1.0);
        }
        println!("variance {stated} stated, {seen} seen");
        // Stratified samples do better than independent ones.
        assert!(
            seen < 1.2 * stated && seen > 0.1 * stated,
            "{stated} {seen}"
        );
    });
}
