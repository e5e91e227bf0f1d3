//! Proxies: what they take of light and view, what they send back, and the GPU against the CPU.

use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_cpu as cpu;
use strandlight_formats::{Scattering, SrbfLight};
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::irradiance;
use strandlight_scene::backend::Backend;
use strandlight_scene::camera::Camera;
use strandlight_scene::mesh::{MeshProxy, MeshShape};
use strandlight_scene::proxy::Proxy;
use strandlight_scene::strands::Strands;
use strandlight_scene::{Picture, PreparedScene};
use strandlight_tests::render_common::{keep, picture_rmse, scene, wig_scene};
use strandlight_tests::scenes::ellipsoid;

fn light(direction: Vec3, lambda: f32) -> SrbfLight {
    SrbfLight {
        direction: direction.normalize().to_array(),
        lambda,
        rgb: [1.0, 0.8, 0.6],
    }
}

/// Inside the hair of `scene`.
fn head(scene: &PreparedScene, share: f32) -> Proxy {
    Proxy::Ellipsoid {
        centre: scene.strands.centre,
        radii: share * scene.strands.radius * Vec3::new(0.8, 1.0, 0.9),
        turn: Quat::from_rotation_x(0.2),
        albedo: [0.5, 0.4, 0.3],
    }
}

fn ground(scene: &PreparedScene) -> Proxy {
    Proxy::Ground {
        height: scene.strands.bounds.0.y - 0.2,
        albedo: [0.6; 3],
    }
}

fn on_cpu(scene: &PreparedScene) -> Picture {
    let (picture, _) = cpu::render(scene, &scene.camera, [96, 72], 16).unwrap();
    picture
}

fn on_gpu(scene: &PreparedScene) -> Picture {
    let context = Context::new().expect("an adapter");
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    renderer
        .render_to_image(&scene.camera, [96, 72], 16)
        .unwrap()
        .0
}

/// Two straight fibres across the x axis, on both sides of the origin.
fn two_fibres(width: f32) -> Strands {
    let points = [
        [-5.0, -1.0, 0.0],
        [-5.0, 1.0, 0.0],
        [5.0, -1.0, 0.0],
        [5.0, 1.0, 0.0],
    ];
    Strands::new(&points, &[0, 2, 4], |_, _| width, false).unwrap()
}

#[test]
fn hair_behind_a_head_is_dark_and_hair_before_it_is_not() {
    let hair = HairParams::default();
    let mut scene = scene(two_fibres(0.1), vec![light(Vec3::X, 0.05)], &hair);
    scene.camera = Camera {
        eye: Vec3::new(0.0, 0.0, 30.0),
        ..scene.camera
    };
    for (scattering, maps) in [(Scattering::Single, 8), (Scattering::Total, 0)] {
        scene.set_scattering(scattering);
        scene.shadow_maps = maps;
        scene.proxies = Vec::new();
        let open = cpu::point_radiance(&scene, &scene.camera, [64, 64]).unwrap();
        assert!(open.iter().all(|rgb| rgb[0] > 0.0));
        scene.proxies = vec![Proxy::Ellipsoid {
            centre: Vec3::ZERO,
            radii: Vec3::splat(2.0),
            turn: Quat::IDENTITY,
            albedo: [0.0; 3],
        }];
        let context = Context::new().expect("an adapter");
        let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        for radiance in [
            cpu::point_radiance(&scene, &scene.camera, [64, 64]).unwrap(),
            renderer.point_radiance(&scene.camera, [64, 64]).unwrap(),
        ] {
            for (point, rgb) in radiance.iter().enumerate() {
                let before = open[point][0];
                if scene.strands.points[point][0] < 0.0 {
                    // TT takes some of its light from behind, whatever the light's direction.
                    assert!(rgb[0] < 1e-2 * before, "{point} {rgb:?} {before}");
                } else {
                    assert!((rgb[0] - before).abs() < 0.02 * before, "{rgb:?} {before}");
                }
            }
        }
    }
}

#[test]
fn roots_on_a_head_are_lit_where_they_face_the_light() {
    // Short hairs along the normals of a sphere.
    let mut points = Vec::new();
    let n = 200;
    for ix in 0..n {
        let y = 1.0 - 2.0 * (ix as f32 + 0.5) / n as f32;
        let (sin, cos) = (2.4 * ix as f32).sin_cos();
        let r = (1.0 - y * y).sqrt();
        let normal = Vec3::new(r * cos, y, r * sin);
        points.push((8.0 * normal).to_array());
        points.push((9.0 * normal).to_array());
    }
    let offsets: Vec<u32> = (0..=n).map(|ix| 2 * ix).collect();
    let strands = Strands::new(&points, &offsets, |_, _| 0.02, false).unwrap();
    let mut scene = scene(strands, vec![light(Vec3::Y, 0.05)], &HairParams::default());
    scene.shadow_maps = 8;
    let open = cpu::point_radiance(&scene, &scene.camera, [64, 64]).unwrap();
    scene.proxies = vec![Proxy::Ellipsoid {
        centre: Vec3::ZERO,
        radii: Vec3::splat(8.0),
        turn: Quat::IDENTITY,
        albedo: [0.0; 3],
    }];
    let beside = cpu::point_radiance(&scene, &scene.camera, [64, 64]).unwrap();
    let brightest = open.iter().fold(0.0, |a, rgb| f32::max(a, rgb[0]));
    let (mut n_lit, mut n_dark) = (0, 0);
    for root in (0..2 * n as usize).step_by(2) {
        let height = scene.strands.points[root][1] / 8.0;
        // Not where part of the light stands above the horizon.
        if open[root][0] <= 0.0 || height.abs() < 0.15 {
            continue;
        }
        if height > 0.0 {
            n_lit += 1;
            assert!((beside[root][0] - open[root][0]).abs() < 0.05 * open[root][0]);
        } else {
            n_dark += 1;
            // TT takes some of its light from behind, whatever the light's direction.
            assert!(beside[root][0] < 1e-2 * brightest);
        }
    }
    assert!(n_lit > 60 && n_dark > 60, "{n_lit} {n_dark}");
}

#[test]
fn a_head_hides_the_hair_behind_it_and_the_ground_all_that_is_below() {
    let mut scene = wig_scene(300);
    let open = on_cpu(&scene);
    // Before the hair, seen from the eye.
    let towards = (scene.camera.eye - scene.strands.centre).normalize();
    scene.proxies = vec![Proxy::Ellipsoid {
        centre: scene.strands.centre + 1.2 * scene.strands.radius * towards,
        radii: Vec3::splat(0.5 * scene.strands.radius),
        turn: Quat::IDENTITY,
        albedo: [0.0; 3],
    }];
    for picture in [on_cpu(&scene), on_gpu(&scene)] {
        let middle = |picture: &Picture| picture.rgba[36 * 96 + 48];
        assert!(middle(&open)[3] > 0.3);
        assert_eq!(middle(&picture), [0.0, 0.0, 0.0, 1.0]);
        let corner = picture.rgba[0];
        assert_eq!(corner[3], 0.0);
        // Edges are smooth.
        let partly = |rgba: &&[f32; 4]| rgba[3] > 0.05 && rgba[3] < 0.95;
        assert!(picture.rgba.iter().filter(partly).count() > 20);
    }
}

/// A head among hair too thin to matter: its light falls off to the edge as in the open, with no
/// steps of the voxels around it.
#[test]
fn the_edge_of_a_light_on_a_head_is_smooth() {
    let points = [
        [-8.0, -8.0, -8.0],
        [-8.0, 8.0, -8.0],
        [8.0, -8.0, 8.0],
        [8.0, 8.0, 8.0],
    ];
    let strands = Strands::new(&points, &[0, 2, 4], |_, _| 1e-4, false).unwrap();
    let (width, height) = (96, 72);
    for lambda in [0.1, 0.28, 0.5, 0.9] {
        let sun = light(Vec3::new(1.0, 0.3, 0.2), lambda);
        let mut scene = scene(strands.clone(), vec![sun], &HairParams::default());
        scene.camera = Camera {
            eye: Vec3::new(0.0, 0.0, 60.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_y: 0.28,
        };
        scene.proxies = vec![Proxy::Ellipsoid {
            centre: Vec3::ZERO,
            radii: Vec3::splat(7.5),
            turn: Quat::IDENTITY,
            albedo: [1.0; 3],
        }];
        let focal_px = 0.5 * height as f32 / 0.14_f32.tan();
        for picture in [on_cpu(&scene), on_gpu(&scene)] {
            let (mut n, mut most) = (0, 0.0_f32);
            for (ix, rgba) in picture.rgba.iter().enumerate() {
                let x = (ix % width) as f32 + 0.5 - 0.5 * width as f32;
                let y = 0.5 * height as f32 - (ix / width) as f32 - 0.5;
                let ray = Vec3::new(x, y, -focal_px).normalize();
                let along = -60.0 * ray.z;
                let across_2 = 60.0 * 60.0 - along * along;
                // Not at the outline, where samples are far apart on the sphere.
                if across_2 > 0.9 * 7.5 * 7.5 {
                    continue;
                }
                let distance = along - (7.5 * 7.5 - across_2).sqrt();
                let normal = (Vec3::new(0.0, 0.0, 60.0) + distance * ray).normalize();
                let cos = normal.dot(Vec3::from(sun.direction));
                let open = irradiance(cos, lambda) / irradiance(1.0, lambda);
                let seen = rgba[0] * std::f32::consts::PI / irradiance(1.0, lambda);
                most = most.max((seen - open).abs());
                n += 1;
            }
            println!("lambda {lambda}: {most:.4} of the brightest, {n} pixels");
            assert!(n > 1500 && most < 0.01, "{lambda}: {most}");
        }
    }
}

#[test]
fn the_gpu_draws_proxies_as_the_cpu_does() {
    for (ix, scattering) in [Scattering::Single, Scattering::Total]
        .into_iter()
        .enumerate()
    {
        let mut scene = wig_scene(400);
        scene.set_scattering(scattering);
        scene.proxies = vec![head(&scene, 0.7), ground(&scene)];
        let (cpu, gpu) = (on_cpu(&scene), on_gpu(&scene));
        keep(&format!("proxies-cpu-{ix}"), &cpu);
        keep(&format!("proxies-gpu-{ix}"), &gpu);
        let error = picture_rmse(&gpu, &cpu);
        println!("{scattering:?}: relative RMSE {error:.2e}");
        assert!(error < 0.01, "{error}");
    }
}

/// Fibres high above a ground are lit by it as by a wide light from below. They are thin: what the shadow volume has of a
/// thick fibre about itself is not the same towards both.
#[test]
fn the_ground_lights_hair() {
    let sun = light(Vec3::new(0.3, 1.0, 0.2), 0.05);
    for scattering in [Scattering::Single, Scattering::Total] {
        let mut scene = scene(two_fibres(0.02), vec![sun], &HairParams::default());
        scene.set_scattering(scattering);
        let at = |scene: &PreparedScene| {
            let context = Context::new().expect("an adapter");
            let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
            [
                cpu::point_radiance(scene, &scene.camera, [64, 64]).unwrap(),
                renderer.point_radiance(&scene.camera, [64, 64]).unwrap(),
            ]
        };
        let with_albedo = |albedo: f32| {
            let mut scene = scene.clone();
            scene.proxies = vec![Proxy::Ground {
                height: -30.0,
                albedo: [albedo; 3],
            }];
            at(&scene)
        };
        let (black, white) = (with_albedo(0.0), with_albedo(1.0));
        // An even half of the sky, of the mean cosine of such light.
        let kappa = 1.8_f32;
        let sent_back = irradiance(sun.direction[1], sun.lambda) / std::f32::consts::PI;
        let power = std::f32::consts::TAU * sent_back;
        let solid_angle = std::f32::consts::TAU * (1.0 - (-2.0 * kappa).exp()) / kappa;
        let mut alone = scene.clone();
        alone.shadow_maps = 0;
        alone.lights = vec![SrbfLight {
            direction: [0.0, -1.0, 0.0],
            lambda: (2.0 / kappa).sqrt(),
            rgb: sun.rgb.map(|x| x * power / solid_angle),
        }];
        for ((black, white), alone) in black.iter().zip(&white).zip(at(&alone)) {
            for (point, wanted) in alone.iter().enumerate() {
                for channel in 0..3 {
                    let found = white[point][channel] - black[point][channel];
                    let error = found / wanted[channel] - 1.0;
                    println!("{scattering:?} {point} {channel}: {error:+.4}");
                    assert!(error.abs() < 0.1, "{found} {wanted:?}");
                }
            }
        }
    }
}

#[test]
fn the_ground_sends_back_its_albedo_of_the_light() {
    // One small tuft high above: nearly all of the ground is in the open.
    let strands = Strands::new(
        &[[0.0, 0.0, 0.0], [0.1, 0.2, 0.0]],
        &[0, 2],
        |_, _| 0.01,
        false,
    )
    .unwrap();
    for (lambda, height) in [(0.05, 0.8), (0.4, 0.9), (1.2, 0.6)] {
        let sun = light(Vec3::new(0.4, height, 0.1), lambda);
        let mut scene = scene(strands.clone(), vec![sun], &HairParams::default());
        scene.proxies = vec![Proxy::Ground {
            height: -30.0,
            albedo: [0.5, 0.5, 1.0],
        }];
        scene.camera = Camera {
            eye: Vec3::new(0.0, 100.0, 60.0),
            target: Vec3::new(40.0, -30.0, 0.0),
            up: Vec3::Y,
            fov_y: 0.2,
        };
        let cos = f64::from(sun.direction[1]);
        // Irradiance by quadrature over the upper half.
        let n = 400;
        let mut exact = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let z = (f64::from(i) + 0.5) / f64::from(n);
            let phi = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(n);
            let r = (1.0 - z * z).sqrt();
            let d = z * cos + r * phi.cos() * (1.0 - cos * cos).sqrt();
            let kappa = 2.0 / f64::from(lambda * lambda);
            exact += z * (kappa * (d - 1.0)).exp() * std::f64::consts::TAU / f64::from(n * n);
        }
        let expected = sun.rgb.map(|x| exact * f64::from(x) / std::f64::consts::PI);
        for picture in [on_cpu(&scene), on_gpu(&scene)] {
            let seen = picture.rgba[36 * 96 + 48];
            for (channel, albedo) in [0.5, 0.5, 1.0].into_iter().enumerate() {
                let ratio = f64::from(seen[channel]) / (albedo * expected[channel]);
                assert!((ratio - 1.0).abs() < 0.01, "{lambda}: {ratio}");
            }
        }
    }
}

#[test]
fn hair_and_head_throw_shadows_on_the_ground() {
    let mut scene = wig_scene(3000);
    scene.lights = vec![light(Vec3::Y, 0.05)];
    let radius = scene.strands.radius;
    let below = scene.strands.centre.y - 1.5 * radius;
    scene.proxies = vec![Proxy::Ground {
        height: below,
        albedo: [1.0; 3],
    }];
    scene.camera = Camera {
        eye: scene.strands.centre + radius * Vec3::new(5.0, 0.5, 0.0),
        target: Vec3::new(scene.strands.centre.x, below, scene.strands.centre.z),
        up: Vec3::Y,
        fov_y: 0.6,
    };
    // Where the line of sight meets the ground below the hair, or beside its shadow.
    let seen = |scene: &PreparedScene, aside: f32| {
        let mut camera = scene.camera;
        camera.target.z += aside * radius;
        let (picture, _) = cpu::render(scene, &camera, [33, 33], 16).unwrap();
        picture.rgba[16 * 33 + 16][0]
    };
    let (in_shadow, beside) = (seen(&scene, 0.0), seen(&scene, 4.0));
    assert!(in_shadow < 0.95 * beside, "{in_shadow} {beside}");
    let mut head = head(&scene, 0.6);
    // What it sent back would light its shadow.
    *head.albedo_mut() = [0.0; 3];
    scene.proxies.push(head);
    let behind_head = [seen(&scene, 0.0), seen(&scene, 4.0)];
    assert!(behind_head[0] < 1e-2 * beside, "{behind_head:?} {beside}");
    assert!(
        (behind_head[1] / beside - 1.0).abs() < 0.02,
        "{behind_head:?} {beside}"
    );
}

/// An ellipsoid of triangles, on the GPU: as the ellipsoid, and as on the CPU.
#[test]
fn a_mesh_looks_the_same_on_both_and_like_the_ellipsoid() {
    let mut scene = wig_scene(200);
    let radii = 0.7 * scene.strands.radius * Vec3::new(0.8, 1.0, 0.9);
    let (centre, albedo) = (scene.strands.centre, [0.5, 0.4, 0.3]);
    let exact = Proxy::Ellipsoid {
        centre,
        radii,
        turn: Quat::IDENTITY,
        albedo,
    };
    let mesh = Proxy::Mesh(MeshProxy {
        shape: Arc::new(MeshShape::new(ellipsoid(radii.into(), 64))),
        offset: centre,
        albedo,
    });
    let mut pictures = Vec::new();
    for head in [exact, mesh] {
        scene.proxies = vec![head, ground(&scene)];
        pictures.push((on_gpu(&scene), on_cpu(&scene)));
    }
    let [(exact, _), (mesh, twin)] = &pictures[..] else {
        panic!("two pictures of each");
    };
    let [to_exact, to_twin] = [exact, twin].map(|other| picture_rmse(mesh, other));
    println!("relative RMSE {to_exact:.4} to the ellipsoid, {to_twin:.4} to the CPU");
    keep("mesh", mesh);
    assert!(to_exact < 0.03, "{to_exact}");
    assert!(to_twin < 0.03, "{to_twin}");
}

/// The underside of a sphere, which no light of the sky reaches, is lit by the ground far below.
#[test]
fn the_ground_lights_the_underside_of_a_head() {
    let sun = light(Vec3::new(1.0, 1.0, 0.2), 0.05);
    // Beside the sphere, out of the picture.
    let strands = Strands::new(
        &[[40.0, 0.0, 0.0], [40.1, 0.2, 0.0]],
        &[0, 2],
        |_, _| 0.01,
        false,
    )
    .unwrap();
    let mut scene = scene(strands, vec![sun], &HairParams::default());
    let albedos = [[0.5, 0.4, 0.25], [0.8, 0.6, 0.4]];
    scene.proxies = vec![
        Proxy::Ellipsoid {
            centre: Vec3::ZERO,
            radii: Vec3::splat(3.0),
            turn: Quat::IDENTITY,
            albedo: albedos[0],
        },
        Proxy::Ground {
            height: -30.0,
            albedo: albedos[1],
        },
    ];
    // From between the two, so that the middle of the picture is the lowest place of the sphere.
    scene.camera = Camera {
        eye: Vec3::new(0.0, -20.0, 0.0),
        target: Vec3::ZERO,
        up: Vec3::Z,
        fov_y: 0.05,
    };
    let on_ground = irradiance(sun.direction[1], sun.lambda);
    for picture in [on_cpu(&scene), on_gpu(&scene)] {
        let seen = picture.rgba[36 * 96 + 48];
        for channel in 0..3 {
            // The ground is all that the place sees; its own shadow, a hundredth of that, is aside.
            let sent_back = sun.rgb[channel] * on_ground / std::f32::consts::PI;
            let expected = albedos[0][channel] * albedos[1][channel] * sent_back;
            let ratio = seen[channel] / expected;
            println!("{channel}: {ratio:.4}");
            assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
        }
    }
}

/// After every edit light between proxies is that of a scene that was so from the beginning.
#[test]
fn light_between_proxies_follows_edits() {
    let mut scene = wig_scene(200);
    scene.set_scattering(Scattering::Total);
    scene.proxies = vec![head(&scene, 0.7), ground(&scene)];
    let context = Context::new().expect("an adapter");
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let check = |what: &str, scene: &PreparedScene, renderer: &mut ProgressiveRenderer| {
        let drawn = renderer.render_to_image(&scene.camera, [96, 72], 16);
        let error = picture_rmse(&drawn.unwrap().0, &on_gpu(scene));
        println!("{what}: {error:.2e}");
        assert!(error < 1e-5, "{what}: {error}");
    };
    check("at first", &scene, &mut renderer);
    for light in &mut scene.lights {
        light.rgb = light.rgb.map(|value| 3.0 * value);
    }
    let colors: Vec<_> = scene.lights.iter().map(|light| light.rgb).collect();
    renderer.set_light_colors(&colors).unwrap();
    check("brighter lights", &scene, &mut renderer);
    for (what, albedos) in [
        ("other albedos", [[0.8, 0.2, 0.1], [0.7; 3]]),
        ("a black ground", [[0.8, 0.2, 0.1], [0.0; 3]]),
        ("both again", [[0.3; 3], [0.9; 3]]),
    ] {
        for (proxy, albedo) in scene.proxies.iter_mut().zip(albedos) {
            *proxy.albedo_mut() = albedo;
        }
        renderer.set_proxies(scene.proxies.clone());
        check(what, &scene, &mut renderer);
    }
    renderer.set_scattering(Scattering::Single);
    scene.set_scattering(Scattering::Single);
    check("single scattering", &scene, &mut renderer);
    renderer.set_scattering(Scattering::Total);
    scene.set_scattering(Scattering::Total);
    let albedos = scene.proxies.clone();
    *scene.proxies[1].albedo_mut() = [0.0; 3];
    let black = on_gpu(&scene);
    scene.proxies = albedos;
    let difference = picture_rmse(&on_gpu(&scene), &black);
    assert!(difference > 0.05, "light from the ground: {difference}");
    // The ground's places move with the hair.
    let moved: Vec<[f32; 4]> = (scene.strands.points.iter())
        .map(|&[x, y, z, radius]| [x, y + 0.01 * y * y, z, radius])
        .collect();
    renderer.set_points(&moved).unwrap();
    let drawn = renderer.render_to_image(&scene.camera, [96, 72], 16);
    let moved = renderer.scene().clone();
    let error = picture_rmse(&drawn.unwrap().0, &on_gpu(&moved));
    println!("other points: {error:.2e}");
    assert!(error < 1e-5, "{error}");
    scene = moved;
    // The ground alone, then with a mesh, whose places are others.
    let mesh = Proxy::Mesh(MeshProxy {
        shape: Arc::new(MeshShape::new(ellipsoid([1.0, 2.0, 1.5], 24))),
        offset: scene.strands.centre,
        albedo: [0.5; 3],
    });
    for proxies in [vec![ground(&scene)], vec![mesh, ground(&scene)]] {
        scene.proxies.clone_from(&proxies);
        renderer.set_proxies(proxies);
        check("other proxies", &scene, &mut renderer);
    }
}
