//! Scene descriptions: a TOML file that says which groom stands under which lights.
//!
//! Angles are in degrees, in keys ending in `_deg`. Paths are relative to the scene file. All
//! sections but `groom` and `lights` may be left out.
//!
//! ```
//! let text = "
//! version = 1
//! [groom]
//! file = 'head.groom'
//! [lights]
//! file = 'studio.lights'
//! ";
//! let scene = strandlight_formats::Scene::from_toml(text)?;
//! assert_eq!(scene.hair.eta, 1.55);
//! assert_eq!(scene.render.size, [720, 480]);
//! # Ok::<(), strandlight_formats::Error>(())
//! ```

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::scene_motion::MotionSection;
use crate::scene_proxy::ProxySection;

/// A scene: which groom under which lights, seen from where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of the scene format: 1.
    pub version: u32,
    /// The hair's shape.
    pub groom: GroomSection,
    /// The environment.
    pub lights: LightsSection,
    /// Baked tables; the bundled ones if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<TablesSection>,
    /// The fibres' optics.
    #[serde(default)]
    pub hair: HairSection,
    /// The view; if absent, the whole groom seen from +Z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraSection>,
    /// The picture.
    #[serde(default)]
    pub render: RenderSection,
    /// What else stands in the light and in the view, at most [`MAX_PROXIES`](crate::MAX_PROXIES).
    #[serde(default, rename = "proxy", skip_serializing_if = "Vec::is_empty")]
    pub proxies: Vec<ProxySection>,
    /// How the hair moves; if absent, it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSection>,
    /// Folder that relative paths start from: that of the scene file. Not in the file.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// `[groom]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroomSection {
    /// A `.groom` file.
    pub file: PathBuf,
}

/// `[lights]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightsSection {
    /// A `.lights` file.
    pub file: PathBuf,
    /// Factor on all lights, 0..=1e6.
    #[serde(default = "one")]
    pub intensity: f64,
    /// Turns the environment about +Y, counter-clockwise seen from above, -3600..=3600.
    #[serde(default)]
    pub rotate_deg: f64,
}

/// `[tables]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TablesSection {
    /// A `.tables` file.
    pub file: PathBuf,
}

/// A value in degrees for each mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerModeDeg {
    /// Of R.
    pub r: f64,
    /// Of TT.
    pub tt: f64,
    /// Of TRT.
    pub trt: f64,
}

/// A scattering mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Surface reflection.
    #[serde(rename = "R")]
    R,
    /// Transmission.
    #[serde(rename = "TT")]
    Tt,
    /// One internal reflection.
    #[serde(rename = "TRT")]
    Trt,
}

/// `[hair]`: Marschner's parameters, as his Table 1 gives them.
///
/// Widths are *standard deviations* in degrees; Xu's bandwidths, which the code computes with,
/// are sqrt(2) times that.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HairSection {
    /// Name of the preset that the keys left out are taken from; see [`preset_names`].
    ///
    /// [`preset_names`]: crate::preset_names
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Index of refraction, 1.0001..=3.
    pub eta: f64,
    /// Absorption per fibre radius, linear RGB, 0..=50.
    pub sigma_a: [f64; 3],
    /// Longitudinal shift alpha in theta_h, -28..=28.
    pub shift_deg: PerModeDeg,
    /// Standard deviation of the longitudinal lobe in theta_h, 0.05..=60.
    pub width_deg: PerModeDeg,
    /// Standard deviation of the blur of the TRT caustic, 0.5..=60.
    pub caustic_width_deg: f64,
    /// Eccentricity of the cross section, 0.5..=2; 1 is circular.
    pub eccentricity: f64,
    /// Thickness of a fibre, 1e-5..=10; if absent, the groom's attribute `diameter`, or else
    /// [`HairSection::DEFAULT_DIAMETER_CM`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameter_cm: Option<f64>,
    /// The modes to draw; at least one, none twice.
    pub modes: Vec<Mode>,
    /// d_f, share of blocked light that is scattered on forward, 0..=1; if absent, the renderer's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_forward: Option<f64>,
    /// d_b, share of the hair behind a fibre that scatters light back, 0..=1; likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_back: Option<f64>,
}

impl HairSection {
    /// Thickness of a human hair in cm where nobody says otherwise.
    pub const DEFAULT_DIAMETER_CM: f64 = 0.008;
}

impl Default for HairSection {
    /// Brown hair, in the middle of Marschner's Table 1.
    fn default() -> Self {
        HairSection {
            preset: None,
            eta: 1.55,
            sigma_a: [0.26, 0.42, 0.83],
            shift_deg: PerModeDeg {
                r: -7.0,
                tt: 3.5,
                trt: 10.5,
            },
            width_deg: PerModeDeg {
                r: 7.0,
                tt: 3.5,
                trt: 14.0,
            },
            caustic_width_deg: 6.0,
            eccentricity: 1.0,
            diameter_cm: None,
            modes: vec![Mode::R, Mode::Tt, Mode::Trt],
            density_forward: None,
            density_back: None,
        }
    }
}

/// `[camera]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSection {
    /// Where the eye is, cm.
    pub position: [f64; 3],
    /// Point that it looks at, cm.
    pub target: [f64; 3],
    /// Direction that is up in the picture; need not be a unit vector.
    #[serde(default = "plus_y")]
    pub up: [f64; 3],
    /// Vertical field of view, 1..=170.
    #[serde(default = "default_fov_deg")]
    pub fov_deg: f64,
}

/// `[render]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSection {
    /// Width and height in pixels, 1..=8192 each.
    pub size: [u32; 2],
    /// Samples per pixel, 1..=65536.
    pub samples: u32,
    /// Exposure in stops: radiance is multiplied by 2^exposure; -32..=32.
    pub exposure: f64,
    /// Curve from linear radiance to the 8-bit picture.
    pub tone_map: ToneMap,
    /// What is seen between the strands.
    pub background: Background,
    /// Which terms of scattering are drawn.
    pub scattering: Scattering,
    /// Shadow maps to draw, about, for all lights, 0..=4096: more for less noise in the shadows.
    pub shadow_maps: u32,
}

impl Default for RenderSection {
    fn default() -> Self {
        RenderSection {
            size: [720, 480],
            samples: 64,
            exposure: 0.0,
            tone_map: ToneMap::Filmic,
            background: Background::Lights,
            scattering: Scattering::Total,
            shadow_maps: 96,
        }
    }
}

/// Terms of scattering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scattering {
    /// Light that reaches a fibre unblocked and is scattered by it alone.
    Single,
    /// Light that fibres in front scattered on forward.
    Global,
    /// Light that comes back out of the hair behind a fibre.
    Local,
    /// All of them.
    #[default]
    Total,
}

impl Scattering {
    /// All choices.
    pub const ALL: [Scattering; 4] = [
        Scattering::Single,
        Scattering::Global,
        Scattering::Local,
        Scattering::Total,
    ];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Scattering::Single => "single",
            Scattering::Global => "global",
            Scattering::Local => "local",
            Scattering::Total => "total",
        }
    }
}

/// Curve from linear radiance to the 8-bit picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ToneMap {
    /// Highlights roll off.
    Filmic,
    /// Clipped at 1.
    None,
}

/// What is seen between the strands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The environment as the light set has it.
    Lights,
    /// Nothing: black, alpha 0.
    None,
    /// A plain linear colour, 0..=1e6 each.
    Color([f32; 3]),
}

impl Serialize for Background {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Background::Lights => serializer.serialize_str("lights"),
            Background::None => serializer.serialize_str("none"),
            Background::Color(rgb) => rgb.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Background {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = Background;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"lights\", \"none\" or [r, g, b]")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Background, E> {
                match text {
                    "lights" => Ok(Background::Lights),
                    "none" => Ok(Background::None),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Background, A::Error> {
                let rgb = <[f32; 3]>::deserialize(de::value::SeqAccessDeserializer::new(seq))?;
                Ok(Background::Color(rgb))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

const fn one() -> f64 {
    1.0
}

const fn plus_y() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

const fn default_fov_deg() -> f64 {
    30.0
}
