//! `[lights]` and `[[lights.adjust]]`.

use super::section::{Param, Section, at};
use super::spec::{Absent, Kind, Shape};
use crate::scene_lights::{LightAdjust, LightsSection};

/// The environment.
pub const LIGHTS: Section<LightsSection> = Section {
    name: "lights",
    heading: "[lights]",
    kind: None,
    help: "The environment. Lights are named by their place in the light set's file, from 0.",
    params: &[
        Param::new("file", "Light set", Kind::File, at!(LightsSection.file))
            .absent(Absent::Refused)
            .help("A `.lights` file."),
        Param::number(
            "rotate_deg",
            "Rotate",
            [-3600.0, 3600.0],
            at!(LightsSection.rotate_deg),
        )
        .unit("°")
        .slider(-180.0, 180.0)
        .decimals(1)
        .help("Rotation of the environment about +Y, counter-clockwise seen from above."),
        Param::number(
            "intensity",
            "Intensity",
            INTENSITY,
            at!(LightsSection.intensity),
        )
        .slider(0.0, 8.0)
        .help("Intensity factor of all lights."),
        Param::numbers("tint", "Tint", Shape::Rgb, TINT, at!(LightsSection.tint))
            .decimals(3)
            .help("Colour factor of all lights."),
        Param::new("muted", "Mute", Kind::Lights, at!(LightsSection.muted))
            .help("Disabled lights."),
        Param::new("solo", "Solo", Kind::Lights, at!(LightsSection.solo)).help(
            "If there are any, lights not among them are switched off. A light that is muted as \
             well stays off.",
        ),
    ],
    plain: || LightsSection::new("x.lights"),
};

/// Changes of one light.
pub const ADJUST: Section<LightAdjust> = Section {
    name: "lights.adjust",
    heading: "[[lights.adjust]]",
    kind: None,
    help: "Factors on one light, at most one entry for each.",
    params: &[
        Param::numbers(
            "light",
            "Light",
            Shape::Whole,
            [0.0, LAST_LIGHT],
            at!(LightAdjust.light),
        )
        .absent(Absent::Refused)
        .help("Index of the light in the set, from 0."),
        Param::number(
            "intensity",
            "Intensity",
            INTENSITY,
            at!(LightAdjust.intensity),
        )
        .slider(0.0, 8.0)
        .help("Intensity factor of this light."),
        Param::numbers("tint", "Tint", Shape::Rgb, TINT, at!(LightAdjust.tint))
            .decimals(3)
            .help("Colour factor of this light."),
    ],
    plain: || LightAdjust::new(0),
};

/// Range of a factor on a light.
const INTENSITY: [f64; 2] = [0.0, 1e6];
/// Range of a factor on a channel of a light.
const TINT: [f64; 2] = [0.0, 1e3];
/// Number of the last light that a set may have.
const LAST_LIGHT: f64 = (crate::light_set::MAX_LIGHTS - 1) as f64;
