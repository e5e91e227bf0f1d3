//! Pictures without samples: the GPU's visibility list against the CPU's, and what is done again after edits.

use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::Background;
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_render::passes::PartLimits;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::mesh::{MeshProxy, MeshShape};
use strandlight_scene::proxy::Proxy;
use strandlight_scene::{Backend, Camera, Picture, PreparedScene, Stats};
use strandlight_tests::render_common::{context, keep, light, picture_rmse, rings, wig_scene};
use strandlight_tests::scenes::ellipsoid;

const SIZE: [u32; 2] = [120, 90];

/// Relative RMSE of linear pictures (and alpha) by the two lists.
const PICTURE_TOLERANCE: f64 = 2e-3;

fn by_list(context: &Context, scene: &PreparedScene) -> ProgressiveRenderer {
    let mut renderer = ProgressiveRenderer::new(context, scene.clone()).unwrap();
    renderer.draw_by_list().unwrap();
    renderer.shade_view_only();
    renderer
}

fn drawn(renderer: &mut dyn Backend) -> (Picture, Stats) {
    renderer.render(SIZE, 16, &|_| ()).unwrap()
}

/// How often a stage ran.
fn runs(stats: &Stats, name: &str) -> u32 {
    let stage = stats.stages.iter().find(|stage| stage.name == name);
    stage.map_or(0, |stage| stage.runs)
}

/// So near that strands are several pixels wide, bent, and end in the picture.
fn near(mut scene: PreparedScene) -> PreparedScene {
    let points = scene.strands.points.iter();
    let nearest = points.map(|point| Vec3::from_slice(point));
    let nearest = nearest.max_by(|a, b| a.z.total_cmp(&b.z)).expect("points");
    scene.camera = Camera {
        eye: nearest + Vec3::new(0.0, 0.0, 0.6),
        target: nearest,
        ..scene.camera
    };
    scene
}

/// A head inside the hair, on a ground.
fn head_and_ground(scene: &PreparedScene) -> Vec<Proxy> {
    vec![
        Proxy::Ellipsoid {
            centre: scene.strands.centre,
            radii: 0.6 * scene.strands.radius * Vec3::new(0.8, 1.0, 0.9),
            turn: Quat::from_rotation_x(0.2),
            albedo: [0.5, 0.4, 0.3],
        },
        Proxy::Ground {
            height: scene.strands.bounds.0.y - 0.2,
            albedo: [0.6; 3],
        },
    ]
}

/// The head as a mesh.
fn mesh(scene: &PreparedScene) -> Proxy {
    let radius = 0.6 * scene.strands.radius;
    let shape = MeshShape::new(ellipsoid([0.8 * radius, radius, 0.9 * radius], 24));
    Proxy::Mesh(MeshProxy {
        shape: Arc::new(shape),
        offset: scene.strands.centre,
        albedo: [0.5, 0.4, 0.3],
    })
}

fn scenes() -> Vec<(&'static str, PreparedScene)> {
    let plain = wig_scene(400);
    let mut sunny = plain.clone();
    sunny
        .lights
        .push(light([0.4, 1.0, 0.6], 0.05, [4.0, 3.5, 3.0]));
    let mut beside = plain.clone();
    beside.proxies = head_and_ground(&plain);
    beside.background = Background::Color([0.2, 0.3, 0.1]);
    let mut meshes = sunny.clone();
    let [_, ground] = <[Proxy; 2]>::try_from(head_and_ground(&plain)).unwrap();
    meshes.proxies = vec![mesh(&plain), ground];
    vec![
        ("plain", plain.clone()),
        ("sun", sunny.clone()),
        ("near", near(plain)),
        ("near in the sun", near(sunny)),
        ("rings", rings(9)),
        ("head and ground", beside),
        ("mesh and ground in the sun", meshes),
    ]
}

#[test]
fn pictures_agree_with_the_list_of_the_cpu() {
    let context = context();
    for (name, scene) in scenes() {
        let (gpu, of_gpu) = drawn(&mut by_list(&context, &scene));
        let mut renderer = CpuRenderer::new(scene.clone());
        renderer.shade_view_only();
        let (cpu, of_cpu) = drawn(&mut renderer);
        keep(&format!("list-{name}-gpu"), &gpu);
        keep(&format!("list-{name}-cpu"), &cpu);
        let error = picture_rmse(&gpu, &cpu);
        let numbers = |stats: &Stats| [stats.visible_points, stats.list_entries];
        println!(
            "{name}: {error:.2e}; {:?} {:?}",
            numbers(&of_gpu),
            numbers(&of_cpu)
        );
        assert!(error < PICTURE_TOLERANCE, "{name}: {error}");
        assert_eq!((of_gpu.samples, of_gpu.passes), (0, 0));
        // The CPU leaves out entries of next to no weight.
        for (gpu, cpu) in numbers(&of_gpu).into_iter().zip(numbers(&of_cpu)) {
            let ratio = gpu as f64 / cpu as f64;
            assert!((0.98..1.05).contains(&ratio), "{name}: {gpu} {cpu}");
        }
        // What is not seen is not shaded.
        let lights = scene.lights.len() as u64;
        let products = of_gpu.products().iter().sum::<u64>();
        assert!(products <= 4 * lights * of_gpu.visible_points, "{name}");
        let others = of_gpu.points as u64 - of_gpu.visible_points;
        assert!(of_gpu.points_skipped >= others, "{name}");
        assert_eq!(others > 0, !["plain", "sun"].contains(&name), "{name}");
    }
}

/// Tiles of a picture, and bands of rows whose hits do not fit at a time, give the same pixels.
#[test]
fn a_list_in_parts_is_the_whole_list() {
    let context = context();
    for (name, scene) in scenes().into_iter().skip(3) {
        let (whole, stats) = drawn(&mut by_list(&context, &scene));
        let mut renderer = by_list(&context, &scene);
        for parts in [
            PartLimits {
                hits: 3000,
                ..PartLimits::default()
            },
            PartLimits {
                tile_side: Some(37),
                ..PartLimits::default()
            },
        ] {
            renderer.set_parts(parts);
            let (in_parts, of_parts) = drawn(&mut renderer);
            let pixels = in_parts.rgba.iter().zip(&whole.rgba);
            assert_eq!(
                pixels.filter(|(a, b)| a != b).count(),
                0,
                "{name} {parts:?}"
            );
            assert_eq!(of_parts.visible_points, stats.visible_points, "{name}");
        }
    }
}

/// An edit of hair or lights shades the points of the list anew; another view, other points or proxies list anew.
#[test]
fn edits_at_rest_keep_the_list() {
    let context = context();
    let mut scene = wig_scene(400);
    scene.proxies = head_and_ground(&scene);
    let mut renderer = by_list(&context, &scene);
    let (before, stats) = drawn(&mut renderer);
    assert_eq!(runs(&stats, "list"), 1);

    let hair = HairParams {
        sigma_a: [9.0, 3.0, 1.0],
        ..HairParams::default()
    };
    renderer.set_hair(&hair, &Lobe::ALL).unwrap();
    let (dyed, stats) = drawn(&mut renderer);
    assert_eq!(runs(&stats, "list"), 0);
    assert!(runs(&stats, "shade") > 0);
    let change = picture_rmse(&dyed, &before);
    assert!(change > 0.01, "{change}");
    let mut fresh = by_list(&context, renderer.scene());
    assert_eq!(drawn(&mut fresh).0, dyed);

    let mut camera = renderer.scene().camera;
    camera.eye += Vec3::new(3.0, 1.0, 0.0);
    renderer.set_camera(camera);
    let (turned, stats) = drawn(&mut renderer);
    assert_eq!(runs(&stats, "list"), 1);
    let mut fresh = by_list(&context, renderer.scene());
    assert_eq!(drawn(&mut fresh).0, turned);

    renderer.set_proxies(head_and_ground(&scene).split_off(1));
    let (bald, stats) = drawn(&mut renderer);
    assert_eq!(runs(&stats, "list"), 1);
    assert!(picture_rmse(&bald, &turned) > 0.01);
    let mut fresh = by_list(&context, renderer.scene());
    assert_eq!(drawn(&mut fresh).0, bald);

    let points = renderer.scene().strands.points.clone();
    let lifted: Vec<_> = points
        .iter()
        .map(|[x, y, z, r]| [*x, y + 0.3, *z, *r])
        .collect();
    renderer.set_points(&lifted).unwrap();
    let (moved, stats) = drawn(&mut renderer);
    assert_eq!(runs(&stats, "list"), 1);
    let mut fresh = by_list(&context, renderer.scene());
    assert!(picture_rmse(&drawn(&mut fresh).0, &moved) < 1e-5);
}

/// What is drawn by samples after a still has all its points, those that the still did not show as well.
#[test]
fn samples_after_a_list_are_those_of_a_fresh_scene() {
    let context = context();
    let scene = near(wig_scene(400));
    let mut fresh = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let of_points = fresh.point_radiance(&scene.camera, SIZE).unwrap();
    let mut renderer = by_list(&context, &scene);
    renderer.set_size(SIZE).unwrap();
    let (still, stats) = drawn(&mut renderer);
    assert!(stats.visible_points < stats.points as u64);
    let found = renderer.point_radiance(&scene.camera, SIZE).unwrap();
    assert_eq!(found, of_points);
    assert_eq!(drawn(&mut renderer).0, still);
    fresh.shade_view_only();
    fresh.set_size(SIZE).unwrap();
    let expected = fresh.finish(16).unwrap();
    assert_eq!(renderer.finish(16).unwrap(), expected);
    // A window that turns has points beyond the view.
    let mut window = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    window.draw_by_list().unwrap();
    let (with_margin, stats) = drawn(&mut window);
    assert!(picture_rmse(&with_margin, &still) < 1e-5);
    assert!(stats.list_entries > 0 && stats.visible_points > 0);
}
