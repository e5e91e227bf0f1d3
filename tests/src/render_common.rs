//! Grooms and lights made by code, and comparisons, for the tests of rendering.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{Axis, Background, BakedFile, Scattering, SrbfLight, Table, TableFile};
use strandlight_render::gpu::Context;
use strandlight_scattering::axis;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::table_layout::{
    C_AXIS_NAMES, C_CHANNELS, C_COLUMNS, C_ROWS, H_AXIS_NAMES_DIELECTRIC, H_CHANNELS, H_COLUMNS,
    H_ROWS,
};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::camera::DEFAULT_FOV_Y;
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::strands::Strands;
use strandlight_scene::tables::ShadingTables;
use strandlight_scene::tone::ToneMap;
use strandlight_scene::{Camera, Picture, PreparedScene};

/// The device; GPU tests fail without one.
pub fn context() -> Context {
    Context::new().expect("these tests need a Vulkan driver, e.g. mesa-vulkan-drivers (lavapipe)")
}

/// Numbers in 0..1 from a seed (splitmix64).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    /// In [`low`, `high`).
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }

    /// A unit vector, evenly over the sphere.
    pub fn direction(&mut self) -> Vec3 {
        let z = self.between(-1.0, 1.0);
        let angle = self.between(0.0, std::f32::consts::TAU);
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}

/// Strands hanging from the upper half of a sphere of radius 8 cm, wavy, `n_points` each.
pub fn wig(n_strands: usize, n_points: usize) -> (Vec<[f32; 3]>, Vec<u32>) {
    let mut random = Random(7);
    let (mut points, mut offsets) = (Vec::new(), vec![0]);
    for _ in 0..n_strands {
        let mut root = random.direction();
        root.y = root.y.abs();
        let mut position = root * 8.0;
        let mut heading = root;
        let phase = random.between(0.0, 6.3);
        for ix in 0..n_points {
            points.push(position.to_array());
            let wave = Vec3::new(
                (0.9 * ix as f32 + phase).sin(),
                0.0,
                (0.8 * ix as f32).cos(),
            );
            heading = (heading + Vec3::new(0.0, -0.22, 0.0) + 0.05 * wave).normalize();
            position += heading * (24.0 / n_points as f32) * random.between(0.9, 1.1);
            // Outside of the head.
            let out = Vec3::new(position.x, position.y.max(0.0), position.z);
            if out.length() < 8.2 {
                position += out.normalize_or_zero() * (8.2 - out.length());
            }
        }
        offsets.push(points.len() as u32);
    }
    (points, offsets)
}

/// A light; `direction` need not be a unit vector.
pub fn light(direction: [f32; 3], lambda: f32, rgb: [f32; 3]) -> SrbfLight {
    SrbfLight {
        direction: Vec3::from(direction).normalize().to_array(),
        lambda,
        rgb,
    }
}

/// A narrow key light, a coloured rim, a soft fill and a wide sky.
pub fn lights() -> Vec<SrbfLight> {
    vec![
        light([0.6, 0.7, 0.5], 0.08, [60.0, 55.0, 45.0]),
        light([-0.7, 0.3, -0.6], 0.25, [8.0, 9.0, 14.0]),
        light([-0.8, 0.1, 0.7], 0.5, [0.9, 0.8, 0.7]),
        light([0.0, 1.0, 0.0], 1.4, [0.25, 0.3, 0.4]),
        light([0.1, -1.0, 0.2], 0.9, [0.05, 0.04, 0.03]),
    ]
}

/// Tables by plain quadrature, good to about 1e-5; baked tables are tested elsewhere.
pub fn tables() -> ShadingTables {
    let mut c = Vec::new();
    for row in 0..C_ROWS.count {
        let kappa = C_ROWS.value_at(row);
        let range = (7.0 / (kappa + 1e-9).sqrt()).min(PI);
        for column in 0..C_COLUMNS.count {
            let phi = 2.0 * C_COLUMNS.value_at(column).acos();
            let mut b = [0.0; 9];
            for node in 0..300 {
                let x = range * ((f64::from(node) + 0.5) / 150.0 - 1.0);
                let weight = (kappa * (x.cos() - 1.0)).exp();
                let c = (0.5 * (phi - x)).cos().abs();
                for (i, b) in b.iter_mut().enumerate() {
                    let binomial = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0][i];
                    *b += weight * binomial * c.powi(i as i32) * (1.0 - c).powi(8 - i as i32);
                }
            }
            let total: f64 = b.iter().sum();
            let b = b.map(|x| (x / total) as f32);
            c.extend(&b[1..]);
        }
    }
    let h = |trt: bool| {
        let mut texels = Vec::new();
        for row in 0..H_ROWS.count {
            for column in 0..H_COLUMNS.count {
                texels.extend(h_moments(
                    H_ROWS.value_at(row),
                    H_COLUMNS.value_at(column),
                    trt,
                ));
            }
        }
        texels
    };
    let table =
        |name: &str, axes: [axis::Axis; 2], names: [&str; 2], channels: &[&str], data| Table {
            name: name.to_owned(),
            axes: axes
                .iter()
                .zip(names)
                .map(|(axis, name)| Axis::new(name, axis))
                .collect(),
            channels: channels.iter().map(|&channel| channel.to_owned()).collect(),
            data,
            max_interpolation_error: 1e-3,
        };
    let h_axes = [H_ROWS, H_COLUMNS];
    let h_names = H_AXIS_NAMES_DIELECTRIC;
    let file = TableFile {
        fresnel: "dielectric".to_owned(),
        tables: vec![
            table("C", [C_ROWS, C_COLUMNS], C_AXIS_NAMES, &C_CHANNELS, c),
            table("H_TT", h_axes, h_names, &H_CHANNELS, h(false)),
            table("H_TRT", h_axes, h_names, &H_CHANNELS, h(true)),
        ],
        ..TableFile::default()
    };
    ShadingTables::from_file(&file).expect("complete tables")
}

/// H_0, H_2, H_4, H_6 with the dielectric Fresnel term.
fn h_moments(eta: f64, ratio: f64, trt: bool) -> [f32; 4] {
    let cos_theta_d = (ratio * ratio * (eta * eta - 1.0) / (eta * eta - ratio * ratio).max(1e-12))
        .clamp(0.0, 1.0)
        .sqrt();
    let mut sums = [0.0; 4];
    let n = 128;
    for node in 0..n {
        let (h, u) = (0.5 * PI * (f64::from(node) + 0.5) / f64::from(n)).sin_cos();
        let c = cos_theta_d * u;
        let q = (eta * eta - 1.0 + c * c).sqrt();
        let (s, p) = ((c - q) / (c + q), (eta * eta * c - q) / (eta * eta * c + q));
        let f = if c > 0.0 { 0.5 * (s * s + p * p) } else { 1.0 };
        let term = (1.0 - f) * (1.0 - f) * if trt { f } else { 1.0 };
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += PI / f64::from(n) * u * term * h.powi(2 * k as i32);
        }
    }
    sums.map(|x| x as f32)
}

/// The hair's textures, from the bundled lobes.
pub fn textures(hair: &HairParams, modes: &[Lobe]) -> HairMaterial {
    let file = TableFile::from_bytes(DEFAULT_TABLES).expect("part of the project");
    let lobes = Arc::new(LobeTables::from_file(&file, modes).expect("all lobes"));
    HairMaterial::new(lobes, Fresnel::Dielectric, hair, modes, 4).expect("valid parameters")
}

/// A scene of `strands` with what else it needs, single scattering alone.
pub fn scene(strands: Strands, lights: Vec<SrbfLight>, hair: &HairParams) -> PreparedScene {
    let camera = Camera::framing(strands.centre, strands.radius, DEFAULT_FOV_Y);
    let hair = textures(hair, &Lobe::ALL);
    let mut scene =
        PreparedScene::from_parts(strands, lights, hair, tables(), camera, Background::None)
            .expect("lights in range");
    scene.set_scattering(Scattering::Single);
    // A few, for the sake of time on software devices.
    scene.shadow_maps = 8;
    scene
}

/// The scene of a [`wig`] of `n_strands` strands under [`lights`].
pub fn wig_scene(n_strands: usize) -> PreparedScene {
    let (points, offsets) = wig(n_strands, 24);
    let strands = Strands::new(&points, &offsets, |_, _| 0.03, true).expect("a valid groom");
    scene(strands, lights(), &HairParams::default())
}

/// A close-up of 60 rings that are not quite closed, in `n` segments each.
pub fn rings(n: usize) -> PreparedScene {
    let mut points = Vec::new();
    let mut offsets = vec![0];
    for ring in 0..60 {
        let (x, y) = ((ring % 10) as f32 - 4.5, (ring / 10) as f32 - 2.5);
        points.extend((0..=n).map(|ix| {
            let (sin, cos) = (5.0 * ix as f32 / n as f32 + ring as f32).sin_cos();
            [1.6 * x + 0.6 * cos, 1.6 * y + 0.6 * sin, 0.3 * sin]
        }));
        offsets.push(points.len() as u32);
    }
    let strands = Strands::new(&points, &offsets, |_, _| 0.25, false).expect("a valid groom");
    let mut scene = scene(strands, lights(), &HairParams::default());
    scene.camera.eye = Vec3::new(0.0, 0.0, 14.0);
    scene.camera.target = Vec3::ZERO;
    scene
}

/// Rows of hair so thin that every pixel of theirs shows all of some hundred strands, and one of 200 strands in the same
/// place.
pub fn deep() -> PreparedScene {
    let mut points = Vec::new();
    let mut offsets = vec![0];
    let mut add = |y: f32, z: f32| {
        points.extend((0..=4).map(|ix| [1.5 * ix as f32 - 3.0, y, z]));
        offsets.push(points.len() as u32);
    };
    for row in [-1.0, 1.0] {
        for ix in 0..300 {
            add(row + 0.02 * (7 * ix % 11) as f32, 0.01 * ix as f32 - 1.5);
        }
    }
    for _ in 0..200 {
        add(0.0, 0.5);
    }
    let strands = Strands::new(&points, &offsets, |_, _| 0.003, false).expect("a valid groom");
    let mut scene = scene(strands, lights(), &HairParams::default());
    scene.camera.eye = Vec3::new(0.0, 0.0, 14.0);
    scene.camera.target = Vec3::ZERO;
    scene
}

/// Root of the mean squared difference over the root mean square of `b`.
pub fn relative_rmse(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    assert!(!a.is_empty());
    let square = |x: f32| f64::from(x) * f64::from(x);
    let difference: f64 = a.iter().zip(b).map(|(a, b)| square(a - b)).sum();
    let norm: f64 = b.iter().map(|&b| square(b)).sum();
    assert!(norm > 0.0, "nothing to compare with");
    (difference / norm).sqrt()
}

/// The larger of the relative RMSE of radiance and that of alpha.
pub fn picture_rmse(a: &Picture, b: &Picture) -> f64 {
    assert!(a.rgba.iter().flatten().all(|x| x.is_finite()));
    let rgb = |p: &Picture| {
        p.rgba
            .iter()
            .flat_map(|x| [x[0], x[1], x[2]])
            .collect::<Vec<_>>()
    };
    let alpha = |p: &Picture| p.rgba.iter().map(|x| x[3]).collect::<Vec<_>>();
    relative_rmse(&rgb(a), &rgb(b)).max(relative_rmse(&alpha(a), &alpha(b)))
}

/// Writes a picture where a person can look at it, if `STRANDLIGHT_PICTURES` names a folder.
pub fn keep(name: &str, picture: &Picture) {
    if let Some(folder) = std::env::var_os("STRANDLIGHT_PICTURES") {
        let png = picture.to_png(0.0, &ToneMap::Filmic.into()).expect("a PNG");
        let path = std::path::Path::new(&folder).join(format!("{name}.png"));
        std::fs::write(path, png).expect("the folder can be written");
    }
}
