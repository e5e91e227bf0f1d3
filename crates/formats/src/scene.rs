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

use crate::scene_hair::HairSection;
use crate::scene_lights::LightsSection;
use crate::scene_motion::MotionSection;
use crate::scene_proxy::ProxySection;
use crate::scene_variation::VariationSection;

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
    /// How strands differ from each other; if absent, they do not.
    #[serde(default, skip_serializing_if = "VariationSection::is_default")]
    pub variation: VariationSection,
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

/// `[tables]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TablesSection {
    /// A `.tables` file.
    pub file: PathBuf,
}

/// `[camera]`; see [`params::CAMERA`](crate::params::CAMERA).
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
    /// Vertical field of view.
    #[serde(default = "default_fov_deg")]
    pub fov_deg: f64,
}

impl CameraSection {
    /// The view from `position` to `target`, with the defaults of the rest.
    pub fn new(position: [f64; 3], target: [f64; 3]) -> Self {
        CameraSection {
            position,
            target,
            up: plus_y(),
            fov_deg: default_fov_deg(),
        }
    }
}

/// Longest side of a picture, pixels.
pub const MAX_SIDE: u32 = 16_384;

/// Most samples a pixel.
pub const MAX_SAMPLES: u32 = 65_536;

/// Most shadow maps of a scene.
pub const MAX_SHADOW_MAPS: u32 = 4096;

/// `[render]`; ranges are those of [`params::RENDER`](crate::params::RENDER).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSection {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// Exposure in stops: radiance is multiplied by 2^exposure.
    pub exposure: f64,
    /// Curve from linear radiance to the 8-bit picture.
    pub tone_map: ToneMap,
    /// A `.cube` file that takes the place of the curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lut: Option<PathBuf>,
    /// What `lut` takes; of no effect without it.
    #[serde(skip_serializing_if = "LutInput::is_default")]
    pub lut_input: LutInput,
    /// What is seen between the strands.
    pub background: Background,
    /// Which terms of scattering are drawn.
    pub scattering: Scattering,
    /// Shadow maps to draw, about, for all lights: more for less noise in the shadows.
    pub shadow_maps: u32,
}

impl Default for RenderSection {
    fn default() -> Self {
        RenderSection {
            size: [720, 480],
            samples: 64,
            exposure: 0.0,
            tone_map: ToneMap::Filmic,
            lut: None,
            lut_input: LutInput::Log2,
            background: Background::Lights,
            scattering: Scattering::Total,
            shadow_maps: 64,
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
    /// AgX: highlights roll off further and turn white; colours keep their hue.
    Agx,
    /// ACES 2.0 for SDR displays: darker, with more contrast; bright colours turn white and keep their hue.
    Aces2,
    /// Clipped at 1.
    None,
}

impl ToneMap {
    /// All choices.
    pub const ALL: [ToneMap; 4] = [ToneMap::Filmic, ToneMap::Agx, ToneMap::Aces2, ToneMap::None];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            ToneMap::Filmic => "filmic",
            ToneMap::Agx => "agx",
            ToneMap::Aces2 => "aces2",
            ToneMap::None => "none",
        }
    }
}

/// How linear radiance, exposed, is encoded for a LUT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LutInput {
    /// `(log2(v / 0.18) + 10) / 20`, clipped to 0..=1: ten stops below middle grey and ten above it,
    /// which lies at 0.5.
    #[default]
    Log2,
    /// Clipped to 0..=1 and encoded by the curve of sRGB, as a picture without tone map is.
    Srgb,
    /// As it is. The LUT's own range, or its curves, say what of it is kept.
    Linear,
}

impl LutInput {
    /// All choices.
    pub const ALL: [LutInput; 3] = [LutInput::Log2, LutInput::Srgb, LutInput::Linear];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            LutInput::Log2 => "log2",
            LutInput::Srgb => "srgb",
            LutInput::Linear => "linear",
        }
    }

    /// Scenes without a LUT do not mention it.
    fn is_default(&self) -> bool {
        *self == LutInput::default()
    }
}

/// What is seen between the strands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The environment as the light set has it.
    Lights,
    /// The environment map, of [`LightsSection::panorama`](crate::LightsSection::panorama).
    Panorama,
    /// Nothing: black, alpha 0.
    None,
    /// A plain linear colour.
    Color([f32; 3]),
}

impl Serialize for Background {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Background::Lights => serializer.serialize_str("lights"),
            Background::Panorama => serializer.serialize_str("panorama"),
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
                f.write_str("\"lights\", \"panorama\", \"none\" or [r, g, b]")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Background, E> {
                match text {
                    "lights" => Ok(Background::Lights),
                    "panorama" => Ok(Background::Panorama),
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

const fn plus_y() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

const fn default_fov_deg() -> f64 {
    30.0
}

#[cfg(test)]
impl Scene {
    /// A scene of the files `a` and `b` with further `lines`, for tests of its sections.
    pub(crate) fn from_lines(lines: &str) -> crate::error::Result<Scene> {
        let head = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
        Scene::from_toml(&format!("{head}{lines}"))
    }
}
