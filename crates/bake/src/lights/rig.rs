//! A light set as a USD light rig: a `DistantLight` for each light, and a `DomeLight` for the rest of a
//! map whose compact sources the lights are.
//!
//! A `DistantLight` is a disc of even radiance, as wide as its `angle` (a diameter). Its disc has the
//! light's energy and mean cosine to the axis. With `inputs:normalize` its `intensity` is, by UsdLux, the
//! irradiance on a surface that faces it, whatever the angle: renderers that draw every distant
//! light as a point agree with those that draw the disc.

use std::f64::consts::PI;
use std::fmt::Write as _;

use strandlight_formats::{LightSet, SrbfLight};
use strandlight_scattering::spherical_gaussian::solid_angle;

use super::exchange::sharpness;
use super::sphere::{normalize, tangents};

/// Which program a rig is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RigTarget {
    /// What UsdLux says.
    #[default]
    Usd,
    /// Blender 5.0, whose import doubles the angle and multiplies the intensity by 4.
    Blender,
}

/// A light as an even disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Half its angle, radians; at most pi / 2, half the sphere.
    pub radius: f64,
    /// Irradiance on a surface that faces it, linear RGB.
    pub irradiance: [f64; 3],
    /// Was the light wider than half the sphere?
    pub is_narrowed: bool,
}

/// The disc that stands for a light: of its energy and, up to half the sphere, its mean cosine.
pub fn disc(light: &SrbfLight) -> Disc {
    let s = sharpness(light.lambda);
    // 1 - cos in the mean: 1 - coth(s) + 1 / s, which loses its digits where it is small.
    let mean = match s {
        50.0.. => 1.0 / s,
        1e-3.. => 1.0 / s - 2.0 / (2.0 * s).exp_m1(),
        _ => 1.0 - s / 3.0,
    };
    // That of a disc is (1 - cos(radius)) / 2.
    let cos = (1.0 - 2.0 * mean).max(0.0);
    // In sin(radius / 2), which keeps the digits of narrow lights.
    let radius = 2.0 * mean.min(0.5).sqrt().asin();
    let energy = solid_angle(f64::from(light.lambda));
    Disc {
        radius,
        // L pi sin^2 of the L that has the energy over 2 pi (1 - cos).
        irradiance: light.rgb.map(|x| f64::from(x) * energy * 0.5 * (1.0 + cos)),
        is_narrowed: mean > 0.5,
    }
}

/// A USD layer (`.usda`) of the lights; `residual` is the asset path of the map of a `DomeLight`.
pub fn to_usda(set: &LightSet, residual: Option<&str>, target: RigTarget) -> String {
    let (angle_factor, intensity_factor) = match target {
        RigTarget::Usd => (1.0, 1.0),
        RigTarget::Blender => (0.5, 0.25),
    };
    let doc = match target {
        RigTarget::Usd => {
            "Distant lights of even radiance: angle is a diameter in degrees, intensity times color the \
             irradiance (normalize is on)."
        }
        RigTarget::Blender => {
            "For Blender alone, whose import doubles the angle and multiplies the intensity by 4: both \
             are smaller here by as much."
        }
    };
    let mut out = format!(
        "#usda 1.0\n(\n    defaultPrim = \"Lights\"\n    doc = \"\"\"{doc}\"\"\"\n    metersPerUnit = 0.01\n    \
         upAxis = \"Y\"\n)\n\ndef Xform \"Lights\"\n{{\n"
    );
    for (ix, light) in set.lights.iter().enumerate() {
        let disc = disc(light);
        // A light shines along its -Z: its +Z points to where it is.
        let z = normalize(light.direction.map(f64::from));
        let [x, y] = tangents(z);
        let rows = [x, y, z].map(|[a, b, c]| format!("({a}, {b}, {c}, 0)"));
        let strongest = disc.irradiance.iter().fold(0.0f64, |m, e| m.max(*e));
        let color = disc.irradiance.map(|e| match strongest > 0.0 {
            true => (e / strongest) as f32,
            false => 1.0,
        });
        let [r, g, b] = color;
        let _ = write!(
            out,
            "    def DistantLight \"Light_{:04}\"\n    {{\n        float inputs:angle = {}\n        \
             color3f inputs:color = ({r}, {g}, {b})\n        float inputs:intensity = {}\n        \
             bool inputs:normalize = 1\n        \
             matrix4d xformOp:transform = ( {}, (0, 0, 0, 1) )\n        \
             uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }}\n\n",
            ix + 1,
            (angle_factor * (2.0 * disc.radius).to_degrees()) as f32,
            (intensity_factor * strongest) as f32,
            rows.join(", "),
        );
    }
    if let Some(path) = residual {
        let _ = write!(
            out,
            "    def DomeLight \"Residual\"\n    {{\n        float inputs:intensity = 1\n        \
             asset inputs:texture:file = {}\n        token inputs:texture:format = \"latlong\"\n    }}\n\n",
            asset(path)
        );
    }
    out.truncate(out.trim_end().len());
    out + "\n}\n"
}

/// An asset path as USD quotes it.
fn asset(path: &str) -> String {
    match path.contains('@') {
        true => format!("@@@{}@@@", path.replace("@@@", "\\@@@")),
        false => format!("@{path}@"),
    }
}

/// Energy of a disc over the sphere, by channel.
pub fn energy(disc: &Disc) -> [f64; 3] {
    // E / (pi sin^2) 2 pi (1 - cos) = 2 E / (1 + cos)
    disc.irradiance.map(|e| {
        e / (PI * disc.radius.sin().powi(2)) * 4.0 * PI * (0.5 * disc.radius).sin().powi(2)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(lambda: f32) -> SrbfLight {
        SrbfLight {
            direction: [0.0, 0.6, 0.8],
            lambda,
            rgb: [3.0, 2.0, 1.0],
        }
    }

    #[test]
    fn discs_have_the_energy_of_their_lights() {
        for lambda in [0.001f32, 0.005, 0.1, 0.2, 0.5, 1.0, 1.5, 3.0, 10.0] {
            let light = light(lambda);
            let disc = disc(&light);
            assert!(
                (0.0..=PI / 2.0 + 1e-12).contains(&disc.radius),
                "{lambda}: {disc:?}"
            );
            for (found, rgb) in energy(&disc).into_iter().zip(light.rgb) {
                let wanted = f64::from(rgb) * solid_angle(f64::from(lambda));
                assert!(
                    (found / wanted - 1.0).abs() < 1e-9,
                    "{lambda}: {found} {wanted}"
                );
            }
            assert_eq!(disc.is_narrowed, lambda > 1.1, "{lambda}");
        }
        // A narrow one: the radius of equal mean square angle.
        let ratio = disc(&light(0.01)).radius / (0.01 * 2f64.sqrt());
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }

    #[test]
    fn discs_have_the_mean_cosine_of_their_lights() {
        let steps = 200_000;
        for lambda in [0.05f32, 0.199, 0.201, 0.6, 0.9] {
            let s = sharpness(lambda);
            let mut sums = [0.0; 2];
            for step in 0..steps {
                let cos = 1.0 - 2.0 * (f64::from(step) + 0.5) / f64::from(steps);
                let value = (s * (cos - 1.0)).exp();
                sums[0] += value;
                sums[1] += value * cos;
            }
            let (mean, radius) = (sums[1] / sums[0], disc(&light(lambda)).radius);
            let of_disc = 0.5 * (1.0 + radius.cos());
            assert!((mean - of_disc).abs() < 1e-4, "{lambda}: {mean} {of_disc}");
        }
    }

    #[test]
    fn a_rig_names_its_numbers() {
        let set = LightSet {
            lights: vec![light(0.005), light(0.5)],
            ..LightSet::default()
        };
        let plain = to_usda(&set, Some("./rest@2.exr"), RigTarget::Usd);
        assert!(plain.starts_with("#usda 1.0\n"));
        assert_eq!(plain.matches("def DistantLight").count(), 2);
        assert!(plain.contains("@@@./rest@2.exr@@@"), "{plain}");
        let number = |text: &str, name: &str| -> f64 {
            let (_, rest) = text.split_once(&format!("{name} = ")).expect(name);
            rest.lines().next().expect("a line").parse().expect(name)
        };
        let blender = to_usda(&set, None, RigTarget::Blender);
        assert!(!blender.contains("DomeLight"));
        for (name, factor) in [("inputs:angle", 2.0), ("inputs:intensity", 4.0)] {
            let ratio = number(&plain, name) / number(&blender, name);
            assert!((ratio / factor - 1.0).abs() < 1e-6, "{name}: {ratio}");
        }
    }
}
