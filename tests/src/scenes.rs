//! Small scenes on disk: a curtain of hair under a few lights.

use std::path::{Path, PathBuf};

use strandlight_formats::{BakedFile, Groom, LightSet, Mesh, Scene, SrbfLight};

/// `n_strands` strands side by side along x, `spacing` cm apart from -2 on; `n_points` points each,
/// a centimetre below one another from `top` on, wavy in z.
pub fn curtain(n_strands: usize, n_points: usize, spacing: f32, top: f32) -> Groom {
    let mut groom = Groom::default();
    groom.strand_offsets.push(0);
    for strand in 0..n_strands {
        for point in 0..n_points {
            let (x, y) = (strand as f32 * spacing - 2.0, top - point as f32);
            groom.points.push([x, y, (0.5 * y + x).sin() * 0.3]);
        }
        groom.strand_offsets.push(groom.points.len() as u32);
    }
    groom
}

/// An ellipsoid about the origin, of `n` rows.
pub fn ellipsoid(radii: [f32; 3], n: u32) -> Mesh {
    let mut positions = Vec::new();
    for row in 0..=n {
        for column in 0..2 * n {
            let polar = std::f32::consts::PI * row as f32 / n as f32;
            let azimuth = std::f32::consts::PI * column as f32 / n as f32;
            let (sin, cos) = polar.sin_cos();
            let unit = [sin * azimuth.sin(), cos, sin * azimuth.cos()];
            positions.push([0, 1, 2].map(|axis: usize| radii[axis] * unit[axis]));
        }
    }
    let at = |row: u32, column: u32| 2 * n * row + column % (2 * n);
    let places = (0..n).flat_map(|row| (0..2 * n).map(move |column| (row, column)));
    let triangles = places.flat_map(|(row, column)| {
        let [a, b] = [at(row, column), at(row, column + 1)];
        let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
        [[a, c, b], [b, c, d]]
    });
    Mesh::new(positions, triangles.collect()).expect("valid")
}

/// A light.
pub fn light(direction: [f32; 3], lambda: f32, rgb: [f32; 3]) -> SrbfLight {
    SrbfLight {
        direction,
        lambda,
        rgb,
    }
}

/// A key light in front and a sky.
pub fn key_and_sky() -> Vec<SrbfLight> {
    vec![
        light([0.0, 0.6, 0.8], 0.2, [20.0, 19.0, 17.0]),
        light([0.0, 1.0, 0.0], 1.2, [0.4, 0.5, 0.6]),
    ]
}

/// Writes `a.groom`, `a.lights` and `a.toml`, a scene of both that `change` has its way with;
/// answers where the scene is.
///
/// # Panics
/// If they cannot be written.
pub fn write_small_scene(
    folder: &Path,
    groom: &Groom,
    lights: Vec<SrbfLight>,
    change: impl FnOnce(&mut Scene),
) -> PathBuf {
    groom.write(&folder.join("a.groom")).expect("written");
    let lights = LightSet {
        lights,
        ..LightSet::default()
    };
    lights.write(&folder.join("a.lights")).expect("written");
    let mut scene = Scene::new("a.groom", "a.lights");
    change(&mut scene);
    write_scene(folder, "a.toml", &scene)
}

/// Writes `scene` as `name`; answers where it is.
///
/// # Panics
/// If it cannot be written.
pub fn write_scene(folder: &Path, name: &str, scene: &Scene) -> PathBuf {
    let path = folder.join(name);
    let text = scene.to_toml_string().expect("valid");
    std::fs::write(&path, text).expect("written");
    path
}
