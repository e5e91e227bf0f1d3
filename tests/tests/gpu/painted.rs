//! Painted hair: against unpainted hair of the same colour, GPU against CPU, edits that touch only
//! what depends on them.

use strandlight_cpu as cpu;
use strandlight_formats::Scattering;
use strandlight_render::gpu::ResourceCounts;
use strandlight_render::{Backend, ProgressiveRenderer};
use strandlight_scattering::HairParams;
use strandlight_scene::material::{EditError, Outcome, Part};
use strandlight_scene::paint::{ActiveStroke, Brush, BrushEffect, Paint, PaintedPoint, Picker};
use strandlight_scene::{Picture, PreparedScene};
use strandlight_tests::render_common::{context, keep, light, lights, picture_rmse, wig_scene};

const SIZE: [u32; 2] = [120, 90];

/// A wig under the lights of the tests and a sun, all terms drawn.
fn wig() -> PreparedScene {
    let mut scene = wig_scene(200);
    let sun = light([0.5, 0.8, 0.6], 0.01, [2e3, 1.9e3, 1.7e3]);
    scene.lights.push(sun);
    scene.set_scattering(Scattering::Total);
    scene
}

fn uniform(scene: &PreparedScene, point: PaintedPoint) -> Paint {
    Paint {
        points: vec![point; scene.strands.n_groom_points()],
    }
}

/// Dark roots and light tips, with bands of other widths and shifts.
fn various(scene: &PreparedScene) -> Paint {
    let n = scene.strands.n_groom_points();
    let point = |ix: usize| {
        let place = (ix % 24) as f32 / 23.0;
        PaintedPoint {
            sigma_a: [2.0 - 1.9 * place, 3.0 - 2.8 * place, 4.0 - 3.0 * place],
            weight: (1.5 * (place - 0.2)).clamp(0.0, 1.0),
            width_scale: 1.0 + 0.8 * (ix / 24 % 3) as f32,
            shift_scale: 1.0 + 0.5 * (ix / 24 % 2) as f32,
            ..PaintedPoint::NONE
        }
    };
    Paint {
        points: (0..n).map(point).collect(),
    }
}

fn on_cpu(scene: &PreparedScene) -> Picture {
    cpu::render(scene, &scene.camera, SIZE, 8).unwrap().0
}

#[test]
fn uniform_paint_is_hair_of_that_colour() {
    let mut worst = [0.0f64; 2];
    for (ix, (point, terms)) in [
        // Dye alone: dark to light, light to dark, half of each.
        ([0.05, 0.1, 0.2], 1.0, 1.0, 1.0, Scattering::Total),
        ([1.5, 2.5, 4.0], 1.0, 1.0, 1.0, Scattering::Total),
        ([0.9, 0.1, 0.05], 0.5, 1.0, 1.0, Scattering::Total),
        ([0.9, 0.1, 0.05], 0.5, 1.0, 1.0, Scattering::Single),
        // Scales too.
        ([0.3, 0.5, 0.9], 1.0, 1.7, 1.0, Scattering::Total),
        ([0.3, 0.5, 0.9], 1.0, 1.0, 0.6, Scattering::Total),
        ([0.1, 0.2, 0.3], 1.0, 0.6, 1.6, Scattering::Total),
    ]
    .into_iter()
    .map(|(sigma_a, weight, width_scale, shift_scale, terms)| {
        let point = PaintedPoint {
            sigma_a,
            weight,
            width_scale,
            shift_scale,
            ..PaintedPoint::NONE
        };
        (point, terms)
    })
    .enumerate()
    {
        let mut painted = wig();
        painted.set_scattering(terms);
        let mut plain = painted.clone();
        painted.set_paint(Some(&uniform(&painted, point))).unwrap();
        plain.hair.apply(&point.on(&HairParams::default())).unwrap();
        let (a, b) = (on_cpu(&painted), on_cpu(&plain));
        let error = picture_rmse(&a, &b);
        println!("{point:?} {terms:?}: {:.3} %", 100.0 * error);
        let is_scaled = usize::from(ix > 3);
        worst[is_scaled] = worst[is_scaled].max(error);
        if ix % 4 == 0 {
            // It is a comparison: without the paint the pictures are far apart.
            painted.set_paint(None).unwrap();
            assert!(picture_rmse(&on_cpu(&painted), &b) > 0.03);
        }
    }
    assert!(worst[0] < 0.003 && worst[1] < 0.005, "{worst:?}");
}

#[test]
fn backends_agree() {
    let context = context();
    for terms in [Scattering::Single, Scattering::Total] {
        let mut scene = wig();
        scene.set_scattering(terms);
        scene.set_paint(Some(&various(&scene))).unwrap();
        let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        let (gpu, _) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
        let cpu = on_cpu(&scene);
        keep(&format!("painted-{terms:?}-gpu"), &gpu);
        keep(&format!("painted-{terms:?}-cpu"), &cpu);
        let error = picture_rmse(&gpu, &cpu);
        println!("{terms:?}: {:.4} %", 100.0 * error);
        assert!(error < 0.003, "{terms:?}: {error}");
    }
}

#[test]
fn painting_a_renderer_is_as_starting_with_the_paint() {
    let context = context();
    let bare_scene = wig();
    let mut scene = bare_scene.clone();
    let mut renderer = ProgressiveRenderer::new(&context, bare_scene.clone()).unwrap();
    let picker = Picker::new(&scene.strands);
    let mut paint = Paint::unpainted(scene.strands.n_groom_points());
    let top = glam::Vec3::new(0.0, 8.5, 2.0);
    for effect in [
        BrushEffect::Dye([0.1, 2.0, 3.0]),
        BrushEffect::WidthScale(2.0),
        BrushEffect::Dye([3.0, 0.3, 0.2]),
    ] {
        let brush = Brush {
            radius_cm: 4.0,
            along_cm: 12.0,
            effect,
            ..Brush::default()
        };
        let mut active_stroke = ActiveStroke::new(brush).unwrap();
        let changed = active_stroke.dab(&picker, &mut paint, top).unwrap();
        renderer.set_paint(&paint, changed.clone()).unwrap();
        scene.repaint(&paint, changed).unwrap();
    }
    let (found, _) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
    keep("painted-strokes", &found);
    let mut whole = wig();
    whole.set_paint(Some(&paint)).unwrap();
    assert_eq!(whole.paint(), scene.paint());
    assert_eq!(whole.hair, scene.hair);
    let mut fresh = ProgressiveRenderer::new(&context, whole.clone()).unwrap();
    let (expected, _) = fresh.render_to_image(&scene.camera, SIZE, 8).unwrap();
    assert_eq!(found.rgba, expected.rgba);
    let (bare, _) = ProgressiveRenderer::new(&context, wig())
        .unwrap()
        .render_to_image(&scene.camera, SIZE, 8)
        .unwrap();
    assert!(picture_rmse(&found, &bare) > 0.05);
}

#[test]
fn a_stroke_is_seen_live_and_uploads_little() {
    let context = context();
    let mut scene = wig();
    scene.size = SIZE;
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    progressive.finish(4).unwrap();
    let skips_paint = |progressive: &ProgressiveRenderer| {
        let skipped = &progressive.report().stats.skipped;
        skipped.iter().any(|what| what.starts_with("paint"))
    };
    assert!(skips_paint(&progressive));
    let picker = Picker::new(&scene.strands);
    let mut paint = Paint::unpainted(scene.strands.n_groom_points());
    let brush = Brush {
        radius_cm: 4.0,
        along_cm: 8.0,
        ..Brush::default()
    };
    let mut active_stroke = ActiveStroke::new(brush).unwrap();
    let mut counts = Vec::new();
    for x in [-3.0, 0.0, 3.0] {
        let centre = glam::Vec3::new(x, 8.5, 2.0);
        let changed = active_stroke.dab(&picker, &mut paint, centre).unwrap();
        progressive.set_paint(&paint, changed).unwrap();
        progressive.finish(4).unwrap();
        counts.push(context.counts());
    }
    assert!(
        !skips_paint(&progressive),
        "{:?}",
        progressive.report().stats.skipped
    );
    // After the first dab: neither pipelines nor textures nor geometry.
    let of = |counts: &ResourceCounts| (counts.pipelines, counts.textures, counts.geometry_uploads);
    assert_eq!(of(&counts[1]), of(&counts[0]));
    assert_eq!(of(&counts[2]), of(&counts[0]));
    let found = progressive.finish(8).unwrap();
    scene.set_paint(Some(&paint)).unwrap();
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (expected, _) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
    let error = picture_rmse(&found, &expected);
    assert!(error < 1e-5, "{error}");
    // Undone, it is the hair without paint.
    let stroke = active_stroke.finish(&paint);
    let range = paint.revert(&stroke).unwrap();
    progressive.set_paint(&paint, range).unwrap();
    let undone = progressive.finish(8).unwrap();
    let bare = wig();
    let mut bare = ProgressiveRenderer::new(&context, bare.clone()).unwrap();
    let (bare, _) = bare.render_to_image(&scene.camera, SIZE, 8).unwrap();
    assert!(picture_rmse(&undone, &bare) < 0.003);
    assert!(picture_rmse(&found, &bare) > 0.02);
}

#[test]
fn neither_colour_nor_paint_touches_the_tables() {
    let mut scene = wig();
    let dyed = PaintedPoint {
        sigma_a: [1.0, 2.0, 3.0],
        weight: 0.5,
        ..PaintedPoint::NONE
    };
    let mut paint = Paint::unpainted(scene.strands.n_groom_points());
    paint.points[5] = dyed;
    let report = scene.set_paint(Some(&paint)).unwrap();
    for part in &report.parts {
        let expected = match part.part {
            Part::Fibre | Part::Reflectance => Outcome::Kept,
            part if part.is_painted() => Outcome::Rebuilt,
            _ => Outcome::Absent,
        };
        assert_eq!(part.outcome, expected, "{}", part.name);
    }
    paint.points[7] = dyed;
    let (range, report) = scene.repaint(&paint, 7..8).unwrap();
    assert!(report.is_none() && !range.is_empty());
    assert_eq!(
        scene.paint().unwrap(),
        paint.spread(&scene.strands).unwrap()
    );
    let hair = HairParams {
        sigma_a: [1.0; 3],
        ..HairParams::default()
    };
    let report = scene.hair.apply(&hair).unwrap();
    let rebuilt: Vec<Part> = report.rebuilt().map(|it| it.part).collect();
    assert_eq!(rebuilt, [Part::Fibre]);
    let report = scene.hair.apply(&HairParams { eta: 1.4, ..hair }).unwrap();
    assert!(report.is_rebuilt(Part::PaintedTt) && report.is_rebuilt(Part::PaintedAverages));
    // Paint of a new kind: the averages alone.
    paint.points[7].width_scale = 2.0;
    let (_, report) = scene.repaint(&paint, 7..8).unwrap();
    let report = report.unwrap();
    let rebuilt: Vec<Part> = report.rebuilt().map(|it| it.part).collect();
    assert_eq!(rebuilt, [Part::PaintedAverages]);
    let elliptic = HairParams {
        eccentricity: 1.2,
        ..hair
    };
    let error = scene.hair.apply(&elliptic).unwrap_err();
    assert_eq!(error, EditError::PaintedEccentric(1.2));
    let mut elliptical = wig();
    elliptical.hair.apply(&elliptic).unwrap();
    let error = elliptical.set_paint(Some(&paint)).unwrap_err();
    assert!(error.to_string().contains("eccentricity"), "{error}");
    assert!(lights().len() > 2 && elliptical.paint().is_none());
}
