//! The scenes of Xu et al. 2011, Table 2, at the paper's sizes from generated hair, and three on
//! which the renderer's accuracy is measured.
//!
//! - [`SCENES`]: what each consists of.
//! - [`PaperScene::toml`]: its scene file.

use crate::grooms::{GrowSpec, HEAD_RADII, Style};
use crate::maps::Sky;

/// One scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperScene {
    /// Name of its files.
    pub name: &'static str,
    /// Where its size is from.
    pub source: &'static str,
    /// Frames a second that Table 2 has of it, at 720x480 on a GTX 580; none of the scenes for
    /// accuracy.
    pub frames_per_second: Option<f64>,
    /// How the hair is worn.
    pub style: Style,
    /// Number of strands.
    pub strands: u32,
    /// Points of each.
    pub points_per_strand: u32,
    /// Number of SRBF lights.
    pub lights: usize,
    /// The map that they are fitted to, unless the user has one.
    pub sky: Sky,
    /// Turn of the environment about +Y, degrees.
    pub rotate_deg: f64,
    /// The hair's preset.
    pub preset: &'static str,
    /// Eye, cm.
    pub position: [f64; 3],
    /// Point looked at, cm.
    pub target: [f64; 3],
    /// Vertical field of view, degrees.
    pub fov_deg: f64,
    /// Stops.
    pub exposure: f64,
    /// Value of `background` in the scene file.
    pub background: &'static str,
}

/// Seed of all grooms.
const SEED: u64 = 11;

/// Behind the pictures of the paper's scenes: dark grey.
const BACKDROP: &str = "[0.010, 0.011, 0.013]";

/// The paper's six, then the three for accuracy: those have no background, so that alpha tells
/// hair from nothing.
pub const SCENES: [PaperScene; 9] = [
    PaperScene {
        name: "animation",
        source: "Xu et al. 2011, Table 2 and Figure 1: 10k fibres, 270k points, 40 SRBFs",
        frames_per_second: Some(8.3),
        style: Style::Wavy,
        strands: 10_000,
        points_per_strand: 27,
        lights: 40,
        sky: Sky::Studio,
        rotate_deg: 0.0,
        preset: "auburn",
        position: [66.0, 10.0, -30.0],
        target: [0.0, -3.5, -1.0],
        fov_deg: 30.0,
        exposure: 1.3,
        background: BACKDROP,
    },
    PaperScene {
        name: "straight",
        source: "Xu et al. 2011, Table 2 and Figure 6: 50k fibres, 1.25M points, 41 SRBFs",
        frames_per_second: Some(5.9),
        style: Style::Straight,
        strands: 50_000,
        points_per_strand: 25,
        lights: 41,
        sky: Sky::Studio,
        rotate_deg: 200.0,
        preset: "zinke-fig8-blond",
        position: [-55.0, 8.0, -48.0],
        target: [0.0, -3.5, -1.0],
        fov_deg: 30.0,
        exposure: 0.6,
        background: BACKDROP,
    },
    PaperScene {
        name: "natural",
        source: "Xu et al. 2011, Table 2 and Figure 7: 10k fibres, 1.5M points, 40 SRBFs",
        frames_per_second: Some(5.8),
        style: Style::Curly,
        strands: 10_000,
        points_per_strand: 150,
        lights: 40,
        sky: Sky::Sun,
        rotate_deg: 40.0,
        preset: "xu-fig7-a",
        position: [62.0, 12.0, -36.0],
        target: [0.0, -4.0, 0.0],
        fov_deg: 32.0,
        exposure: 0.7,
        background: BACKDROP,
    },
    PaperScene {
        name: "bob-cut",
        source: "Xu et al. 2011, Table 2 and Figure 8: 10k fibres, 350k points, 30 SRBFs",
        frames_per_second: Some(10.6),
        style: Style::Bob,
        strands: 10_000,
        points_per_strand: 35,
        lights: 30,
        sky: Sky::Studio,
        rotate_deg: 0.0,
        preset: "xu-fig8-a",
        position: [64.0, 10.0, -14.0],
        target: [0.0, 1.0, 0.0],
        fov_deg: 25.0,
        exposure: 1.3,
        background: BACKDROP,
    },
    PaperScene {
        name: "dark",
        source: "Xu et al. 2011, Table 2 and Figure 9: 15k fibres, 1.0M points, 36 SRBFs",
        frames_per_second: Some(6.2),
        style: Style::Wavy,
        strands: 15_000,
        points_per_strand: 67,
        lights: 36,
        sky: Sky::Studio,
        rotate_deg: 60.0,
        preset: "xu-fig9-a",
        position: [20.0, 10.0, -72.0],
        target: [0.0, -3.5, 0.0],
        fov_deg: 30.0,
        exposure: 1.5,
        background: BACKDROP,
    },
    PaperScene {
        name: "ponytail",
        source: "Xu et al. 2011, Table 2 and Figure 10: 6k fibres, 100k points, 42 SRBFs",
        frames_per_second: Some(8.9),
        style: Style::Ponytail,
        strands: 6_000,
        points_per_strand: 17,
        lights: 42,
        sky: Sky::Sun,
        rotate_deg: 40.0,
        preset: "xu-fig10-d",
        position: [74.0, 6.0, -30.0],
        target: [0.0, -6.0, -10.0],
        fov_deg: 32.0,
        exposure: 0.4,
        background: BACKDROP,
    },
    PaperScene {
        name: "dark-sun",
        source: "for accuracy: dark hair under a hard sun",
        frames_per_second: None,
        style: Style::Wavy,
        strands: 10_000,
        points_per_strand: 48,
        lights: 40,
        sky: Sky::Sun,
        rotate_deg: 0.0,
        preset: "black",
        position: [66.0, 10.0, -30.0],
        target: [0.0, -3.5, -1.0],
        fov_deg: 30.0,
        exposure: 1.0,
        background: "\"none\"",
    },
    PaperScene {
        name: "brown-studio",
        source: "for accuracy: brown hair in a studio",
        frames_per_second: None,
        style: Style::Straight,
        strands: 10_000,
        points_per_strand: 48,
        lights: 40,
        sky: Sky::Studio,
        rotate_deg: 0.0,
        preset: "brown",
        position: [60.0, 10.0, -40.0],
        target: [0.0, -3.5, -1.0],
        fov_deg: 30.0,
        exposure: 1.5,
        background: "\"none\"",
    },
    PaperScene {
        name: "blond-soft",
        source: "for accuracy: blond hair under a soft sky",
        frames_per_second: None,
        style: Style::Bob,
        strands: 10_000,
        points_per_strand: 48,
        lights: 40,
        sky: Sky::Soft,
        rotate_deg: 0.0,
        preset: "blond",
        position: [64.0, 10.0, -14.0],
        target: [0.0, 1.0, 0.0],
        fov_deg: 25.0,
        exposure: 0.8,
        background: "\"none\"",
    },
];

impl PaperScene {
    /// The scene called `name`, or `None`.
    pub fn from_name(name: &str) -> Option<&'static PaperScene> {
        SCENES.iter().find(|scene| scene.name == name)
    }

    /// The six scenes of Table 2.
    pub fn of_table_2() -> impl Iterator<Item = &'static PaperScene> {
        SCENES
            .iter()
            .filter(|scene| scene.frames_per_second.is_some())
    }

    /// The head that the hair grows on. The scenes for accuracy have none: they measure hair alone.
    fn head(&self) -> String {
        if self.background != BACKDROP {
            return String::new();
        }
        let [x, y, z] = HEAD_RADII.to_array();
        format!(
            "[[proxy]]\nkind = \"ellipsoid\"\ncentre = [0.0, 0.0, 0.0]\nradii = [{x:.1}, {y:.1}, {z:.1}]\n"
        )
    }

    /// The groom, with `scale` times the strands, at least one. Fewer strands are grown thicker.
    pub fn groom(&self, scale: f64) -> GrowSpec {
        GrowSpec {
            style: self.style,
            strands: ((f64::from(self.strands) * scale).round() as u32).max(1),
            points_per_strand: self.points_per_strand,
            seed: SEED,
        }
    }

    /// Text of the scene file beside `NAME.groom` and `NAME.lights`.
    pub fn toml(&self) -> String {
        let PaperScene {
            name,
            source,
            rotate_deg,
            preset,
            fov_deg,
            exposure,
            background,
            ..
        } = self;
        let vector = |[x, y, z]: [f64; 3]| format!("[{x:.1}, {y:.1}, {z:.1}]");
        format!(
            "# {source}.\n\
             # Written by `strandlight scenes`; the hair is generated, not the paper's.\n\
             version = 1\n\n\
             [groom]\nfile = \"{name}.groom\"\n\n\
             [lights]\nfile = \"{name}.lights\"\nrotate_deg = {rotate_deg:.1}\n\n\
             [hair]\npreset = \"{preset}\"       # keys beside it take precedence\n\n\
             [camera]\nposition = {}\ntarget = {}\nfov_deg = {fov_deg:.1}\n\n\
             {head}[render]\nsize = [720, 480]\nsamples = 64\nexposure = {exposure:.1}\nbackground = {background}\n",
            vector(self.position),
            vector(self.target),
            head = self.head(),
        )
    }
}

#[cfg(test)]
mod tests {
    use strandlight_formats::Scene;

    use super::*;

    #[test]
    fn scene_files_are_valid() {
        for scene in &SCENES {
            let parsed = Scene::from_toml(&scene.toml()).expect(scene.name);
            assert_eq!(parsed.hair.preset.as_deref(), Some(scene.preset));
            assert_eq!(parsed.camera.expect("one").position, scene.position);
            assert_eq!(parsed.render.exposure, scene.exposure);
            assert_eq!(parsed.proxies.is_empty(), scene.background != BACKDROP);
            assert_eq!(PaperScene::from_name(scene.name), Some(scene));
        }
    }

    /// Fibres, points and lights of the paper's Table 2, points to the digits that it prints.
    #[test]
    fn sizes_are_those_of_table_2() {
        for (name, fibres, points, digit, lights, a_second) in [
            ("animation", 10_000, 270_000, 5_000, 40, 8.3),
            ("straight", 50_000, 1_250_000, 5_000, 41, 5.9),
            ("natural", 10_000, 1_500_000, 50_000, 40, 5.8),
            ("bob-cut", 10_000, 350_000, 5_000, 30, 10.6),
            ("dark", 15_000, 1_000_000, 50_000, 36, 6.2),
            ("ponytail", 6_000, 100_000, 5_000, 42, 8.9),
        ] {
            let scene = PaperScene::from_name(name).expect(name);
            assert_eq!((scene.strands, scene.lights), (fibres, lights), "{name}");
            let found = scene.strands * scene.points_per_strand;
            assert!(found.abs_diff(points) <= digit, "{name}: {found}");
            assert_eq!(scene.frames_per_second, Some(a_second), "{name}");
        }
        assert_eq!(PaperScene::of_table_2().count(), 6);
        let spec = SCENES[0].groom(0.1);
        assert_eq!((spec.strands, spec.points_per_strand), (1000, 27));
    }
}
