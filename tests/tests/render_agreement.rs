//! The GPU's picture against the CPU's: whole, and stage by stage.

mod render_common;

use render_common::{context, keep, picture_rmse, relative_rmse, wig_scene};
use strandlight_bake::cpu;
use strandlight_formats::{Background, Groom, HairImport};
use strandlight_runtime::gpu::Context;
use strandlight_runtime::strands::Strands;
use strandlight_runtime::volume::Grid;
use strandlight_runtime::{Renderer, Stats};
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::unpack_record;
use strandlight_tests::samples::{hair_file, real_file};

const SIZE: [u32; 2] = [120, 90];

/// Relative RMSE of linear pictures (and alpha) that lavapipe and the CPU stay within; 3.7e-4 at
/// most was measured.
const PICTURE_TOLERANCE: f64 = 1.5e-3;

/// What an adapter is held to where lavapipe is held to `measured`, a few times what it does: GPUs
/// have exponential and trigonometric functions of their own, less exact ones.
fn held(context: &Context, measured: f64, on_gpus: f64) -> f64 {
    if context.is_software() {
        measured
    } else {
        on_gpus
    }
}

#[test]
fn pictures_agree_for_every_background() {
    let context = context();
    let mut scene = wig_scene(400);
    for (name, background) in [
        ("none", Background::None),
        ("color", Background::Color([0.2, 0.3, 0.1])),
        ("lights", Background::Lights),
    ] {
        scene.background = background;
        let renderer = Renderer::new(&context, &scene).unwrap();
        let (gpu, gpu_stats) = renderer.render(&scene.camera, SIZE, 16).unwrap();
        let (cpu, cpu_stats) = cpu::render(&scene, &scene.camera, SIZE, 16).unwrap();
        keep(&format!("agree-{name}-gpu"), &gpu);
        keep(&format!("agree-{name}-cpu"), &cpu);
        let error = picture_rmse(&gpu, &cpu);
        println!("background {name}: {error:.2e}");
        let tolerance = held(&context, PICTURE_TOLERANCE, 0.01);
        assert!(error < tolerance, "background {name}: {error}");
        let all = |stats: &Stats| stats.products().iter().sum::<u64>();
        assert_eq!(all(&gpu_stats), all(&cpu_stats));
        assert!(all(&cpu_stats) > 0);
        let covered = cpu.rgba.iter().filter(|p| p[3] > 0.0).count();
        assert!(covered > 1000, "{covered} pixels covered");
    }
}

#[test]
fn the_comparison_notices_a_wrong_picture() {
    let scene = wig_scene(400);
    let (picture, _) = cpu::render(&scene, &scene.camera, SIZE, 16).unwrap();
    let mut brighter = picture.clone();
    for pixel in &mut brighter.rgba {
        pixel[1] *= 1.005;
    }
    assert!(picture_rmse(&brighter, &picture) > PICTURE_TOLERANCE);
    let mut shifted = picture.clone();
    shifted.rgba.rotate_right(1);
    assert!(picture_rmse(&shifted, &picture) > PICTURE_TOLERANCE);
}

#[test]
fn every_stage_agrees() {
    let context = context();
    let scene = wig_scene(400);
    let grid = Grid::around(&scene.strands);
    let renderer = Renderer::new(&context, &scene).unwrap();

    let volume = cpu::voxelise(&scene.strands, &grid);
    let gpu_volume = renderer.volume().unwrap();
    let flat: Vec<f32> = volume.as_flattened().to_vec();
    let largest = flat.iter().copied().fold(0.0, f32::max);
    let worst = gpu_volume
        .as_flattened()
        .iter()
        .zip(&flat)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    println!("volume: largest {largest}, worst difference {worst:.2e}");
    assert!(largest > 0.0 && worst <= 1e-5 * largest);

    let (lights, sweeps) = scene.light_records();
    let records = cpu::transmittance(&grid, &volume, &lights, &sweeps);
    let gpu_records = renderer.records().unwrap();
    assert_eq!(records.len(), gpu_records.len());
    let (mut worst_share, mut worst_sine, mut inclined) = (0.0_f32, 0.0_f32, 0);
    for (a, b) in records.iter().zip(&gpu_records) {
        let (a, b) = (unpack_record(a), unpack_record(b));
        for (a, b) in a.shares.iter().zip(b.shares) {
            worst_share = worst_share.max((a - b).abs());
        }
        // Directions are weighed by the depth in rounded shares: 1 % off at 0.97.
        if a.shares[2] < 0.97 {
            worst_sine = worst_sine.max((a.sin_theta - b.sin_theta).abs());
        }
        inclined += usize::from(a.sin_theta > 0.5);
    }
    println!("records: worst differences {worst_share:.2e} and {worst_sine:.2e}");
    // Eight half floats are added up, each rounded by 2^-11 of the sum at most; 9.8e-4 and 4.9e-4
    // were measured.
    assert!(worst_share < 2e-3 && worst_sine < 2e-3);
    assert!(inclined > 1000, "{inclined} voxels behind inclined fibres");

    let radiance = cpu::point_radiance(&scene, &scene.camera, SIZE).unwrap();
    let gpu_radiance = renderer.point_radiance(&scene.camera, SIZE).unwrap();
    let error = relative_rmse(gpu_radiance.as_flattened(), radiance.as_flattened());
    println!("shading: {error:.2e}");
    // 3.7e-6 was measured.
    assert!(error < held(&context, 2e-5, 1e-3));
}

#[test]
fn pictures_of_imported_grooms_agree() {
    let context = context();
    let mut grooms = vec![("made here", hair_file(400, 16))];
    if let Some(path) = real_file("hair/cyuksel_straight.hair") {
        grooms.push(("real", std::fs::read(path).expect("readable")));
    }
    for (name, file) in grooms {
        let groom = Groom::from_hair(&file, HairImport::default()).unwrap();
        let strands = Strands::new(&groom.points, &groom.strand_offsets, |_, _| 0.07, true);
        let strands = strands.unwrap();
        let scene = render_common::scene(strands, render_common::lights(), &HairParams::default());
        let size = [180, 120];
        let renderer = Renderer::new(&context, &scene).unwrap();
        let (gpu, _) = renderer.render(&scene.camera, size, 8).unwrap();
        let (cpu, _) = cpu::render(&scene, &scene.camera, size, 8).unwrap();
        keep(&format!("imported-{name}-gpu"), &gpu);
        let covered = cpu.rgba.iter().filter(|p| p[3] > 0.0).count();
        assert!(covered > 2000, "{name}: {covered} pixels covered");
        let error = picture_rmse(&gpu, &cpu);
        let n = scene.strands.segments.len();
        println!("{name}, {n} segments: {error:.2e}");
        let tolerance = held(&context, PICTURE_TOLERANCE, 0.01);
        assert!(error < tolerance, "{name}: {error}");
    }
}
