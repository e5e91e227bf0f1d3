//! Pictures without samples: the GPU's visibility list against the CPU's, and what is done again after edits.

use std::sync::Arc;
use std::time::Duration;

use glam::{Quat, Vec3};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, WindSection};
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_render::passes::PartLimits;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::mesh::{MeshProxy, MeshShape};
use strandlight_scene::motion::{Wind, wind};
use strandlight_scene::proxy::Proxy;
use strandlight_scene::{Backend, Camera, Picture, PreparedScene, Stats};
use strandlight_tests::render_common::{
    context, deep, keep, light, picture_rmse, rings, wig_scene,
};
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
    for (name, scene) in scenes().into_iter().chain([("deep", deep())]) {
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
        assert_eq!(others == 0, name == "deep", "{name}");
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
            // Room for the entries of all bands.
            PartLimits {
                hits: stats.list_entries as u32,
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

/// Where there are several bands, an edit draws their entries, which were kept, as it draws those of one; without room
/// for them it lists band by band again.
#[test]
fn entries_of_several_bands_are_kept() {
    let context = context();
    let scene = wig_scene(400);
    let (mut whole, _) = window(&context, &scene);
    let n_entries = whole.report().stats.list_entries as u32;
    let edited = |renderer: &mut ProgressiveRenderer, sigma_a| {
        let hair = HairParams {
            sigma_a,
            ..HairParams::default()
        };
        renderer.set_hair(&hair, &Lobe::ALL).unwrap();
        (shown(renderer), renderer.report().counts.workgroups)
    };
    edited(&mut whole, [1.0; 3]);
    let (expected, least) = edited(&mut whole, [9.0, 3.0, 1.0]);
    for (hits, is_kept) in [(n_entries, true), (n_entries - 1, false)] {
        let (mut renderer, _) = window(&context, &scene);
        renderer.set_parts(PartLimits {
            hits,
            ..PartLimits::default()
        });
        // Shades the points of the list in bands.
        edited(&mut renderer, [1.0; 3]);
        let (picture, workgroups) = edited(&mut renderer, [9.0, 3.0, 1.0]);
        assert!(picture == expected, "{hits}");
        // Slices of points, whose last group is not full, depend on how fast the device is.
        let is_least = workgroups < least + least / 10;
        assert_eq!(is_least, is_kept, "{workgroups} for {least}");
    }
}

/// Wind leaves what proxies hide and which of them light may come from, since it bends strands that are at rest as they
/// were: the picture is that of a fresh renderer.
#[test]
fn wind_after_wind_is_drawn_as_at_first() {
    let context = context();
    let mut scene = wig_scene(200);
    scene.proxies = head_and_ground(&scene);
    scene.proxies.push(mesh(&scene));
    let section = WindSection::default();
    scene.strands = wind::with_room(&section, (*scene.strands).clone()).into();
    let at = |seconds| Some(Wind::at(&section, &scene.strands, seconds));
    let mut renderer = by_list(&context, &scene);
    renderer.set_wind(at(1.0)).unwrap();
    let (before, _) = drawn(&mut renderer);
    renderer.set_wind(at(3.0)).unwrap();
    let (picture, _) = drawn(&mut renderer);
    let change = picture_rmse(&picture, &before);
    assert!(change > 0.01, "{change}");
    let mut fresh = by_list(&context, &scene);
    fresh.set_wind(at(3.0)).unwrap();
    assert_eq!(drawn(&mut fresh).0, picture);
    // Without wind it is at rest.
    renderer.set_wind(None).unwrap();
    assert_eq!(
        drawn(&mut renderer).0,
        drawn(&mut by_list(&context, &scene)).0
    );
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

/// Works until nothing is left to do, and answers what is shown then.
fn shown(renderer: &mut ProgressiveRenderer) -> Vec<[u8; 4]> {
    while !renderer.advance(Duration::from_secs(1)).unwrap().is_done {}
    renderer.read_display().unwrap()
}

/// A window by list of `scene`, as it is shown.
fn window(context: &Context, scene: &PreparedScene) -> (ProgressiveRenderer, Vec<[u8; 4]>) {
    let mut renderer = ProgressiveRenderer::new(context, scene.clone()).unwrap();
    renderer.draw_by_list().unwrap();
    renderer.set_size(SIZE).unwrap();
    let picture = shown(&mut renderer);
    (renderer, picture)
}

/// Mean and largest difference of levels.
fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> (f64, u8) {
    let levels = a.as_flattened().iter().zip(b.as_flattened());
    let differences: Vec<u8> = levels.map(|(a, b)| a.abs_diff(*b)).collect();
    let sum: f64 = differences.iter().copied().map(f64::from).sum();
    let most = differences.iter().copied().max().unwrap_or(0);
    (sum / differences.len() as f64, most)
}

/// A window by list has no samples and shows what a still has; after every edit it shows what a fresh one does, and does
/// no more than the edit takes.
#[test]
fn windows_are_drawn_by_list_after_every_edit() {
    let context = context();
    let mut scene = wig_scene(400);
    scene.proxies = head_and_ground(&scene);
    scene.background = Background::Color([0.02, 0.03, 0.05]);
    let (mut renderer, first) = window(&context, &scene);
    let progress = renderer.progress();
    assert_eq!((progress.samples, progress.total_samples), (0, 0));
    assert!(progress.is_done && progress.is_shown && progress.noise.is_none());
    let report = renderer.report().clone();
    assert_eq!((report.runs("list"), report.runs("project")), (1, 0));
    assert!(report.stats.visible_points < report.stats.points as u64);
    let (still, stats) = drawn(&mut by_list(&context, &scene));
    assert_eq!(stats.visible_points, report.stats.visible_points);
    let (mean, most) = difference(&first, &still.to_srgb8(scene.exposure, &scene.display));
    assert!(mean < 0.6 && most <= 3, "{mean} {most}");

    type Edit = fn(&mut ProgressiveRenderer);
    // How often each makes a list, and draws it: a draft first where the view or the points moved.
    let edits: [(&str, [u32; 2], Edit); 9] = [
        ("view", [1, 2], |renderer| {
            let mut camera = renderer.scene().camera;
            let turn = Quat::from_rotation_y(0.4);
            camera.eye = camera.target + turn * (camera.eye - camera.target);
            renderer.set_camera(camera);
        }),
        ("view, not turned", [1, 2], |renderer| {
            let mut camera = renderer.scene().camera;
            let across = Vec3::new(0.0, 1.5, 0.0);
            (camera.eye, camera.target) = (camera.eye + across, camera.target + across);
            renderer.set_camera(camera);
        }),
        ("hair", [0, 1], |renderer| {
            let mut hair = *renderer.scene().hair.hair();
            hair.sigma_a = [0.1, 0.3, 0.6];
            renderer.set_hair(&hair, &Lobe::ALL).unwrap();
        }),
        ("colours of the lights", [0, 1], |renderer| {
            let lights = renderer.scene().lights.iter();
            let rgb: Vec<_> = lights.map(|light| light.rgb.map(|x| 0.5 * x)).collect();
            renderer.set_light_colors(&rgb).unwrap();
        }),
        ("grade", [0, 0], |renderer| {
            let display = renderer.scene().display.clone();
            renderer.set_grade(2.0, display, Background::Color([0.1, 0.2, 0.3]));
        }),
        ("points", [1, 2], |renderer| {
            let points = renderer.scene().strands.points.iter();
            let moved: Vec<_> = points.map(|[x, y, z, r]| [*x, y + 0.3, *z, *r]).collect();
            renderer.set_points(&moved).unwrap();
        }),
        ("proxies", [1, 1], |renderer| {
            renderer.set_proxies(Vec::new())
        }),
        ("size", [1, 2], |renderer| {
            renderer.set_size([90, 70]).unwrap()
        }),
        ("close-up", [1, 2], |renderer| {
            let scene = near(renderer.scene().clone());
            renderer.set_camera(scene.camera);
        }),
    ];
    for (name, expected, edit) in edits {
        edit(&mut renderer);
        let edited = shown(&mut renderer);
        let runs = ["list", "draw"].map(|stage| renderer.report().runs(stage));
        assert_eq!(runs, expected, "{name}");
        let mut fresh = ProgressiveRenderer::new(&context, renderer.scene().clone()).unwrap();
        fresh.draw_by_list().unwrap();
        let (mean, most) = difference(&edited, &shown(&mut fresh));
        assert!(mean < 0.01 && most <= 2, "{name}: {mean} {most}");
    }
    renderer.set_samples(128);
    assert!(renderer.progress().is_done);
    // A still of another size, and back.
    let before = renderer.read_display().unwrap();
    let still = renderer.still([64, 48], 16).unwrap();
    assert_eq!(still.width, 64);
    assert_eq!(shown(&mut renderer), before);
    // Samples when they are asked for, and no longer.
    renderer.finish(4).unwrap();
    assert_eq!(shown(&mut renderer), before);
    assert_eq!(renderer.progress().total_samples, 0);
    // Hair without light is there at once in a view that turns.
    let rgb = vec![[0.0; 3]; renderer.scene().lights.len()];
    renderer.set_light_colors(&rgb).unwrap();
    let black = shown(&mut renderer);
    let eye = renderer.scene().camera.eye;
    let moved = Camera {
        eye: eye * 1.001,
        ..renderer.scene().camera
    };
    renderer.set_camera(moved);
    renderer.advance(Duration::ZERO).unwrap();
    let draft = renderer.read_display().unwrap();
    let last = shown(&mut renderer);
    assert!(difference(&draft, &last).1 == 0 && difference(&black, &before).1 > 0);
    let rgb: Vec<_> = scene.lights.iter().map(|light| light.rgb).collect();
    renderer.set_light_colors(&rgb).unwrap();
    shown(&mut renderer);
    // On another device it is drawn in the same way.
    let scene = renderer.scene().clone();
    let before = shown(&mut renderer);
    renderer.move_to(&context, scene).unwrap();
    renderer.set_size([90, 70]).unwrap();
    assert_eq!(difference(&shown(&mut renderer), &before).1, 0);
    assert_eq!(renderer.progress().total_samples, 0);
}

/// What a view shows before its points are lit has no holes where the view before did not see them, and is gone once
/// they are.
#[test]
fn drafts_of_a_turning_view_have_no_holes() {
    let context = context();
    let mut scene = wig_scene(400);
    // It hides what is behind it.
    scene.proxies = head_and_ground(&scene);
    scene.proxies.truncate(1);
    let (mut renderer, _) = window(&context, &scene);
    let mut camera = renderer.scene().camera;
    camera.eye = camera.target + Quat::from_rotation_y(0.3) * (camera.eye - camera.target);
    renderer.set_camera(camera);
    let mut draft = None;
    while draft.is_none() {
        let progress = renderer.advance(Duration::ZERO).unwrap();
        assert!(!progress.is_done, "no draft was shown");
        draft = progress.is_shown.then(|| renderer.read_display().unwrap());
    }
    let draft = draft.unwrap_or_default();
    let last = shown(&mut renderer);
    let level = |[r, g, b, _]: [u8; 4]| u32::from(r) + u32::from(g) + u32::from(b);
    let lit = draft.iter().zip(&last);
    let lit: Vec<_> = lit
        .map(|(a, b)| (level(*a), level(*b)))
        .filter(|(_, b)| *b > 40)
        .collect();
    let dark = lit.iter().filter(|(a, b)| 2 * a < *b).count();
    assert!(lit.len() > 1000 && dark == 0, "{dark} of {}", lit.len());
    // The outline is that of the view at once, but for strands that no view showed yet.
    let other = draft.iter().zip(&last).filter(|(a, b)| a[3] != b[3]);
    assert!(other.clone().all(|(a, b)| a[3] < b[3]) && other.count() < 20);
    let (mean, _) = difference(&draft, &last);
    assert!(mean > 0.1, "{mean}");
}

/// A picture that has no room for its list is drawn by samples.
#[test]
fn windows_without_room_for_a_list_are_sampled() {
    // Three surfaces of 16 bytes behind each of 364,000 pixels do not fit.
    let context = Context::within(|limits| limits.max_storage_buffer_binding_size = 16 << 20);
    let (context, size) = (context.unwrap(), [700, 520]);
    let mut scene = wig_scene(100);
    scene.proxies = head_and_ground(&scene);
    scene.samples = 8;
    let (mut renderer, _) = window(&context, &scene);
    assert_eq!(renderer.progress().total_samples, 0);
    renderer.set_size(size).unwrap();
    // Samples show all points, and those that the list had not are not lit.
    let mut progress = renderer.progress();
    while !progress.is_shown {
        progress = renderer.advance(Duration::ZERO).unwrap();
    }
    assert!(progress.is_shaded);
    let picture = shown(&mut renderer);
    let progress = renderer.progress();
    assert_eq!((progress.samples, progress.total_samples), (8, 8));
    let mut sampled = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    sampled.set_size(size).unwrap();
    assert_eq!(difference(&shown(&mut sampled), &picture).1, 0);
    let mut camera = scene.camera;
    camera.eye *= 1.1;
    renderer.set_camera(camera);
    let turned = shown(&mut renderer);
    sampled.set_camera(camera);
    assert_eq!(difference(&shown(&mut sampled), &turned).1, 0);
    // A smaller one has room again.
    renderer.set_size(SIZE).unwrap();
    shown(&mut renderer);
    assert_eq!(renderer.progress().total_samples, 0);
}

/// Who does not wait for the device, as a page cannot, is shown the same picture some turns later, and a view that keeps
/// turning while it turns.
#[test]
fn lists_are_drawn_without_waiting_for_them() {
    let context = context();
    let mut scene = wig_scene(400);
    scene.proxies = head_and_ground(&scene);
    scene.proxies.push(mesh(&scene));
    let (_, expected) = window(&context, &scene);
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    renderer.draw_by_list().unwrap();
    renderer.set_waiting(false);
    renderer.set_size(SIZE).unwrap();
    assert_eq!(difference(&shown(&mut renderer), &expected).1, 0);
    let parts = PartLimits {
        hits: 5000,
        ..PartLimits::default()
    };
    renderer.set_parts(parts);
    assert_eq!(difference(&shown(&mut renderer), &expected).1, 0);

    const TURN: Duration = Duration::from_millis(5);
    let camera = scene.camera;
    let turned = |step: u32| Camera {
        eye: camera.target
            + Quat::from_rotation_y(0.01 * step as f32) * (camera.eye - camera.target),
        ..camera
    };
    renderer.set_camera(turned(1));
    renderer.advance(TURN).unwrap();
    assert_eq!(renderer.report().runs("list"), 0, "it was waited for");
    // A still waits for the list that is under way.
    let still = renderer.still(SIZE, 1).unwrap();
    let fresh = drawn(&mut by_list(&context, renderer.scene())).0;
    assert!(picture_rmse(&still, &fresh) < 1e-5);
    // And takes none of another view, which is under way when all of its own is lit.
    shown(&mut renderer);
    renderer.set_camera(turned(20));
    renderer.advance(TURN).unwrap();
    renderer.set_camera(turned(2));
    renderer.finish(1).unwrap();
    let still = renderer.still(SIZE, 1).unwrap();
    let fresh = drawn(&mut by_list(&context, renderer.scene())).0;
    assert!(picture_rmse(&still, &fresh) < 1e-5);

    let shadings = renderer.report().shadings;
    let mut pictures = vec![renderer.read_display().unwrap()];
    let mut step = 1;
    while pictures.len() < 8 || renderer.report().shadings < shadings + 3 {
        step += 1;
        renderer.set_camera(turned(step));
        renderer.advance(TURN).unwrap();
        assert!(renderer.progress().is_shown || pictures.len() < 3);
        let picture = renderer.read_display().unwrap();
        if pictures.last() != Some(&picture) {
            pictures.push(picture);
        }
        assert!(step < 300, "{} pictures", pictures.len());
    }
    let last = shown(&mut renderer);
    let mut scene = renderer.scene().clone();
    scene.camera = turned(step);
    let (mean, most) = difference(&last, &window(&context, &scene).1);
    assert!(mean < 0.01 && most <= 2, "{mean} {most}");
}

/// One answer of the device, how much room a list takes, stands between a view and its picture: who asks again as soon as
/// it is there gets the draft. How many points are seen, none perhaps, is known when they are shaded.
#[test]
fn points_are_shaded_before_anybody_knows_how_many_are_seen() {
    let context = context();
    let scene = wig_scene(400);
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    renderer.draw_by_list().unwrap();
    renderer.set_waiting(false);
    renderer.set_size(SIZE).unwrap();
    shown(&mut renderer);
    let camera = scene.camera;
    let back = camera.eye - camera.target;
    let away = Camera {
        target: camera.eye + back,
        ..camera
    };
    let far = Camera {
        eye: camera.target + 40.0 * back,
        ..camera
    };
    let mut numbers = Vec::new();
    for camera in [away, far, camera, away, camera] {
        renderer.set_camera(camera);
        for is_answered in [false, true] {
            renderer.advance(Duration::from_secs(1)).unwrap();
            assert_eq!(renderer.report().runs("draw") > 0, is_answered);
            context.wait("list").unwrap();
        }
        let last = shown(&mut renderer);
        let mut scene = scene.clone();
        scene.camera = camera;
        let (fresh, expected) = window(&context, &scene);
        assert_eq!(difference(&last, &expected).1, 0);
        let number = renderer.report().stats.visible_points;
        assert_eq!(number, fresh.report().stats.visible_points);
        numbers.push(number);
    }
    assert_eq!([numbers[0], numbers[3]], [0; 2]);
    assert!(0 < numbers[1] && numbers[1] < numbers[2], "{numbers:?}");
}

/// Software devices end the loops of a pixel with very many hits: samples are drawn there.
#[test]
fn small_pictures_of_much_hair_are_whole() {
    let context = context();
    let mut scene = wig_scene(4000);
    scene.size = [16, 12];
    let draw = |renderer: &mut dyn Backend| {
        let (picture, _) = renderer.render(scene.size, 64, &|_| ()).unwrap();
        picture
    };
    let on_cpu = draw(&mut CpuRenderer::by_samples(scene.clone()));
    let on_gpu = draw(&mut by_list(&context, &scene));
    let difference = picture_rmse(&on_gpu, &on_cpu);
    println!("{difference}");
    assert!(difference < 0.05, "{difference}");
}
