//! Multiple scattering in pictures: the sum of its terms, on both backends, and what is skipped.

use strandlight_cpu as cpu;
use strandlight_formats::Scattering;
use strandlight_render::{Backend, ProgressiveRenderer};
use strandlight_scattering::{HairParams, Lobe, Model};
use strandlight_scene::PreparedScene;
use strandlight_tests::render_common::{
    context, keep, picture_rmse, relative_rmse, textures, wig_scene,
};

const SIZE: [u32; 2] = [60, 45];

/// A wig of this absorption, all terms drawn.
fn scene_of(n_strands: usize, sigma_a: [f64; 3]) -> PreparedScene {
    let hair = HairParams {
        sigma_a,
        ..HairParams::default()
    };
    let mut scene = wig_scene(n_strands);
    scene.hair = textures(&hair, &Lobe::ALL);
    scene.set_scattering(Scattering::Total);
    scene
}

const BLOND: [f64; 3] = [0.03, 0.07, 0.15];
const BROWN: [f64; 3] = [0.26, 0.42, 0.83];
const BLACK: [f64; 3] = [2.0, 3.0, 5.0];

fn radiance(scene: &PreparedScene) -> Vec<f32> {
    let radiance = cpu::point_radiance(scene, &scene.camera, SIZE).unwrap();
    radiance.as_flattened().to_vec()
}

#[test]
fn both_backends_draw_every_choice_of_terms() {
    let context = context();
    // So much hair that it sends some light back.
    let mut scene = scene_of(800, BLOND);
    for scattering in Scattering::ALL {
        scene.set_scattering(scattering);
        let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        let (gpu, gpu_stats) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
        let (cpu, cpu_stats) = cpu::render(&scene, &scene.camera, SIZE, 8).unwrap();
        keep(&format!("multiple-{}", scattering.name()), &gpu);
        let error = picture_rmse(&gpu, &cpu);
        println!("{}: {error:.2e}", scattering.name());
        assert!(error < 0.01, "{}: {error}", scattering.name());
        assert!(cpu.rgba.as_flattened().iter().all(|x| *x >= 0.0));
        for (gpu, cpu) in gpu_stats.terms.iter().zip(&cpu_stats.terms) {
            println!("  {gpu:?}");
            assert_eq!(gpu.name, cpu.name);
            assert_eq!(gpu.products + gpu.skipped, cpu.products + cpu.skipped);
        }
        let n_terms = [1, 1, 2, 4][scattering as usize];
        assert_eq!(gpu_stats.terms.len(), n_terms);
        assert_eq!(cpu_stats.terms.len(), n_terms);
    }
}

/// By tables and by the closed form; then another model on the same renderer.
#[test]
fn both_backends_draw_hair_of_model_energy() {
    let context = context();
    let energy = HairParams {
        sigma_a: [0.0, 0.03, 0.15],
        model: Model::Energy,
        ..HairParams::default()
    };
    let scene_with = |hair: &HairParams| {
        let mut scene = wig_scene(150);
        scene.hair = textures(hair, &Lobe::ALL);
        scene.set_scattering(Scattering::Total);
        scene
    };
    let scene = scene_with(&energy);
    let (cpu, _) = cpu::render(&scene, &scene.camera, SIZE, 8).unwrap();
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (gpu, _) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
    keep("multiple-energy", &gpu);
    let error = picture_rmse(&gpu, &cpu);
    println!("energy: {error:.2e}");
    assert!(error < 0.01, "{error}");
    let marschner = HairParams {
        model: Model::Marschner,
        ..energy
    };
    renderer.set_hair(&marschner, &Lobe::ALL).unwrap();
    let (edited, _) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
    let scene = scene_with(&marschner);
    let (other, _) = cpu::render(&scene, &scene.camera, SIZE, 8).unwrap();
    let error = picture_rmse(&edited, &other);
    println!("back to marschner: {error:.2e}");
    assert!(error < 0.01, "{error}");
    // The models are told apart.
    assert!(picture_rmse(&gpu, &other) > 0.03);
}

#[test]
fn terms_add_up_to_the_total() {
    // So much hair that it sends some light back.
    let mut scene = scene_of(800, BLOND);
    let total = radiance(&scene);
    let mut sum = vec![0.0; total.len()];
    let mut norms = Vec::new();
    for scattering in [Scattering::Single, Scattering::Global, Scattering::Local] {
        scene.set_scattering(scattering);
        let term = radiance(&scene);
        norms.push(term.iter().map(|x| x * x).sum::<f32>().sqrt());
        for (sum, term) in sum.iter_mut().zip(term) {
            *sum += term;
        }
    }
    println!("norms of single, global, local: {norms:?}");
    assert!(relative_rmse(&sum, &total) < 1e-5);
    assert!(norms.iter().all(|norm| *norm > 0.02 * norms[0]));
}

#[test]
fn darker_hair_has_less_of_multiple_scattering() {
    let share = |sigma_a| {
        let mut scene = scene_of(60, sigma_a);
        let total: f32 = radiance(&scene).iter().sum();
        scene.set_scattering(Scattering::Single);
        1.0 - radiance(&scene).iter().sum::<f32>() / total
    };
    let [blond, brown, black] = [BLOND, BROWN, BLACK].map(share);
    println!("share of multiple scattering: {blond:.3} {brown:.3} {black:.3}");
    assert!(blond > 1.3 * brown && brown > 1.3 * black && black > 0.0);
}

#[test]
fn what_is_skipped_is_negligible() {
    for (name, sigma_a) in [("brown", BROWN), ("black", BLACK)] {
        let mut scene = scene_of(300, sigma_a);
        let (skipping, stats) = cpu::render(&scene, &scene.camera, SIZE, 8).unwrap();
        scene.negligible_share = 0.0;
        let (whole, all) = cpu::render(&scene, &scene.camera, SIZE, 8).unwrap();
        let error = picture_rmse(&skipping, &whole);
        let [products, skipped] = stats.products();
        println!(
            "{name}: {error:.2e} without {skipped} of {} products",
            products + skipped
        );
        for term in &stats.terms {
            println!("  {term:?}");
        }
        assert_eq!(all.products(), [products + skipped, 0]);
        assert!(skipped > 0 && error < 1e-4, "{name}: {error}");
    }
}

#[test]
fn an_edit_of_multiple_scattering_draws_what_a_new_renderer_draws() {
    let context = context();
    let scene = scene_of(40, BROWN);
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let at =
        |renderer: &mut ProgressiveRenderer| renderer.point_radiance(&scene.camera, SIZE).unwrap();
    let before = at(&mut renderer);
    let mut hair = *scene.hair.hair();
    hair.sigma_a = BLOND;
    renderer.set_hair(&hair, scene.hair.modes()).unwrap();
    let fresh = at(&mut ProgressiveRenderer::new(&context, scene_of(40, BLOND).clone()).unwrap());
    assert!(at(&mut renderer) == fresh && fresh != before);
}

#[test]
fn records_that_are_not_kept_draw_the_same() {
    let context = context();
    let mut scene = scene_of(40, BROWN);
    let at = |scene: &PreparedScene| {
        let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        let (picture, stats) = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap();
        // Another size in between: nothing of the first picture is left.
        renderer
            .render_to_image(&scene.camera, [16, 12], 4)
            .unwrap();
        let again = renderer.render_to_image(&scene.camera, SIZE, 8).unwrap().0;
        assert!(picture == again);
        let bytes = stats.stages.iter().find(|s| s.name == "transmittance");
        (picture, bytes.unwrap().bytes)
    };
    // More lights than share a buffer, so that kept ones lie in two.
    let lights = scene.lights.clone();
    scene.lights = lights.iter().copied().cycle().take(70).collect();
    let (kept, all) = at(&scene);
    scene.record_budget = 0;
    let (swept_again, room) = at(&scene);
    assert!(kept == swept_again);
    assert!(room < all, "{room} {all}");
}
