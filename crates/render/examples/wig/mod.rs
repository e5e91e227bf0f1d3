//! Hair for the examples of embedding.

use std::error::Error;

use glam::Vec3;
use strandlight_formats::{BakedFile, Groom, LightSet, Scene, SrbfLight};
use strandlight_scattering::random::GOLDEN_ANGLE;
use strandlight_scene::PreparedScene;

/// A ball of curls under three lights.
pub fn wig() -> Result<PreparedScene, Box<dyn Error>> {
    const N_STRANDS: usize = 8000;
    const N_POINTS: usize = 24;
    let mut points = Vec::new();
    for strand in 0..N_STRANDS {
        // Fibonacci's sphere.
        let y = 1.0 - (strand as f32 + 0.5) * 2.0 / N_STRANDS as f32;
        let angle = GOLDEN_ANGLE as f32 * strand as f32;
        let (sin, cos) = angle.sin_cos();
        let root = Vec3::new(cos * (1.0 - y * y).sqrt(), y, sin * (1.0 - y * y).sqrt());
        let (side, other) = root.any_orthonormal_pair();
        for point in 0..N_POINTS {
            let along = point as f32 / (N_POINTS - 1) as f32;
            let (sin, cos) = (9.0 * along + angle).sin_cos();
            let curl = 0.35 * along * (side * cos + other * sin);
            let fall = Vec3::NEG_Y * 2.5 * along * along;
            points.push((7.0 * root + 3.0 * along * root + curl + fall).to_array());
        }
    }
    let groom = Groom {
        points,
        strand_offsets: (0..=N_STRANDS).map(|ix| (ix * N_POINTS) as u32).collect(),
        ..Groom::default()
    };
    let light = |direction: [f32; 3], lambda, rgb| SrbfLight {
        direction: Vec3::from(direction).normalize().to_array(),
        lambda,
        rgb,
    };
    let lights = LightSet {
        lights: vec![
            light([1.0, 1.0, 1.0], 0.3, [9.0, 8.5, 8.0]),
            light([-1.0, 0.6, -0.8], 0.2, [5.0, 6.0, 9.0]),
            light([0.0, 1.0, 0.0], 1.2, [0.5, 0.55, 0.6]),
        ],
        ..LightSet::default()
    };
    let folder = tempfile::tempdir()?;
    let [groom_file, lights_file] =
        ["wig.groom", "wig.lights"].map(|name| folder.path().join(name));
    groom.write(&groom_file)?;
    lights.write(&lights_file)?;
    let mut scene = Scene::new(groom_file, lights_file);
    scene.hair = scene.hair.with_preset("auburn")?;
    scene.hair.diameter_cm = Some(0.05);
    Ok(PreparedScene::load(&scene)?)
}
