//! `[lights]`, `[[lights.adjust]]` and `[[lights.added]]`.

use super::section::{Param, Section, at};
use super::spec::{Absent, Kind, Shape};
use crate::scene_lights::{AddedLight, LightAdjust, LightsSection};

/// The environment.
pub const LIGHTS: Section<LightsSection> = Section {
    name: "lights",
    heading: "[lights]",
    kind: None,
    help: "The environment. Lights are named by their place in the light set's file, from 0; those of \
           `[[lights.added]]` follow.",
    params: &[
        Param::new("file", "Light set", Kind::File, at!(LightsSection.file))
            .absent(Absent::Refused)
            .help("A `.lights` file."),
        Param::new(
            "panorama",
            "Panorama",
            Kind::File,
            at!(LightsSection.panorama),
        )
        .help(
            "A `.panorama` file: the map that the lights were fitted to, for `render.background` \
             `\"panorama\"`. It turns with `rotate_deg`, times `intensity` and `tint`.",
        ),
        Param::new("map", "Map", Kind::File, at!(LightsSection.map)).help(
            "The HDR map that the lights were fitted to, OpenEXR or Radiance: `render --converge`, `reference`, \
             `bench converge` and ground truth in the window take its light, not that of the light set. It turns \
             with `rotate_deg`, times `intensity` and `tint`; single lights of the set count only where pictures start from. Nothing else \
             reads it.",
        ),
        Param::number(
            "rotate_deg",
            "Rotate",
            [-3600.0, 3600.0],
            at!(LightsSection.rotate_deg),
        )
        .unit("°")
        .slider(-180.0, 180.0)
        .decimals(1)
        .help("Rotation of the light set about +Y, counter-clockwise seen from above."),
        Param::number(
            "intensity",
            "Intensity",
            INTENSITY,
            at!(LightsSection.intensity),
        )
        .slider(0.0, 8.0)
        .help("Intensity factor of all lights of the set."),
        Param::numbers("tint", "Tint", Shape::Rgb, TINT, at!(LightsSection.tint))
            .decimals(3)
            .help("Colour factor of all lights of the set."),
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

/// A light beside those of the set.
pub const ADDED: Section<AddedLight> = Section {
    name: "lights.added",
    heading: "[[lights.added]]",
    kind: None,
    help: "A Gaussian light beside those of the set, such as a key or rim light; at most 64. It is fixed in world \
           space: rotation, intensity and tint of `[lights]` do not apply. Its number follows those of the set.",
    params: &[
        Param::number(
            "azimuth_deg",
            "Azimuth",
            [-3600.0, 3600.0],
            at!(AddedLight.azimuth_deg),
        )
        .unit("°")
        .slider(-180.0, 180.0)
        .decimals(1)
        .help("Where the light comes from, about +Y: 0 is +Z, 90 is +X."),
        Param::number(
            "elevation_deg",
            "Elevation",
            [-90.0, 90.0],
            at!(AddedLight.elevation_deg),
        )
        .unit("°")
        .decimals(1)
        .help("Where the light comes from, above the horizon."),
        Param::number("width_deg", "Width", [0.1, 90.0], at!(AddedLight.width_deg))
            .unit("°")
            .slider(0.5, 60.0)
            .decimals(1)
            .logarithmic()
            .symbol("lambda / sqrt 2")
            .help("Standard deviation of the Gaussian: narrow lights throw hard shadows."),
        Param::number(
            "intensity",
            "Intensity",
            INTENSITY,
            at!(AddedLight.intensity),
        )
        .slider(0.0, 8.0)
        .help("Radiance integrated over the sphere: as strong at any width."),
        Param::numbers("color", "Colour", Shape::Rgb, TINT, at!(AddedLight.color))
            .decimals(3)
            .help("Colour of the light, times the intensity."),
    ],
    plain: AddedLight::default,
};

/// Range of a factor on a light.
const INTENSITY: [f64; 2] = [0.0, 1e6];
/// Range of a factor on a channel of a light.
const TINT: [f64; 2] = [0.0, 1e3];
/// Number of the last light that a set may have.
const LAST_LIGHT: f64 = (crate::light_set::MAX_LIGHTS - 1) as f64;
