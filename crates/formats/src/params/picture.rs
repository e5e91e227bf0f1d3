//! `[groom]`, `[tables]`, `[camera]` and `[render]`.

use super::section::{Param, Section, at};
use super::spec::{Absent, Kind, Numbers, Shape, Word};
use crate::scene::{
    CameraSection, GroomSection, MAX_SAMPLES, MAX_SHADOW_MAPS, MAX_SIDE, RenderSection,
    TablesSection,
};

/// The hair's shape.
pub const GROOM: Section<GroomSection> = Section {
    name: "groom",
    heading: "[groom]",
    kind: None,
    help: "The hair's shape.",
    params: &[
        Param::new("file", "Groom", Kind::File, at!(GroomSection.file))
            .absent(Absent::Refused)
            .help("A `.groom` file."),
    ],
    plain: || GroomSection {
        file: "x.groom".into(),
    },
};

/// Baked tables.
pub const TABLES: Section<TablesSection> = Section {
    name: "tables",
    heading: "[tables]",
    kind: None,
    help: "Baked tables. Without it, the bundled ones.",
    params: &[
        Param::new("file", "Tables", Kind::File, at!(TablesSection.file))
            .absent(Absent::Refused)
            .help("A `.tables` file."),
    ],
    plain: || TablesSection {
        file: "x.tables".into(),
    },
};

/// Range of a coordinate.
const COORDINATE: [f64; 2] = [-1e6, 1e6];

/// The view.
pub const CAMERA: Section<CameraSection> = Section {
    name: "camera",
    heading: "[camera]",
    kind: None,
    help: "The view. Without it, the whole groom seen from +Z; pictures higher than wide show less of it.",
    params: &[
        Param::numbers(
            "position",
            "Position",
            Shape::Vector,
            COORDINATE,
            at!(CameraSection.position),
        )
        .absent(Absent::Refused)
        .unit("cm")
        .help("Position of the camera."),
        Param::numbers(
            "target",
            "Target",
            Shape::Vector,
            COORDINATE,
            at!(CameraSection.target),
        )
        .absent(Absent::Refused)
        .unit("cm")
        .help("Point that the camera looks at; must differ from `position`."),
        Param::numbers("up", "Up", Shape::Vector, COORDINATE, at!(CameraSection.up)).help(
            "Direction that is up in the picture, not along the line of sight; need not be a unit \
             vector.",
        ),
        Param::number(
            "fov_deg",
            "Field of view",
            [1.0, 170.0],
            at!(CameraSection.fov_deg),
        )
        .unit("°")
        .slider(5.0, 90.0)
        .decimals(1)
        .help("Vertical angle of view. Small is a long lens from afar."),
    ],
    plain: || CameraSection::new([0.0, 0.0, 1.0], [0.0; 3]),
};

/// Terms of scattering with what they are to the eye.
const TERMS: &[Word] = &[
    ("total", "Total", "All light."),
    (
        "single",
        "Single",
        "Single scattering of unoccluded light: highlights and hard shadows.",
    ),
    (
        "global",
        "Global",
        "Multiple scattering through the hair in front: the soft glow inside blond hair.",
    ),
    (
        "local",
        "Local",
        "Multiple scattering from the hair around a fibre: saturated colour.",
    ),
];

const TONE_MAPS: &[Word] = &[
    ("filmic", "Filmic", "Filmic curve with highlight roll-off."),
    (
        "agx",
        "AgX",
        "AgX: softer than filmic; bright colours turn white and keep their hue.",
    ),
    (
        "aces2",
        "ACES 2",
        "ACES 2.0 for SDR displays: darker than filmic, with more contrast; bright colours turn white \
         and keep their hue.",
    ),
    (
        "none",
        "None",
        "No curve, clipped at white, for measurements.",
    ),
];

const LUT_INPUTS: &[Word] = &[
    (
        "log2",
        "Log2",
        "`(log2(v / 0.18) + 10) / 20`, clipped to 0..1: ten stops on either side of middle grey.",
    ),
    (
        "srgb",
        "sRGB",
        "clipped to 0..1 and encoded as sRGB, for looks made on finished pictures.",
    ),
    (
        "linear",
        "Linear",
        "as it is, for LUTs with a range or curves of their own.",
    ),
];

const BACKGROUNDS: &[Word] = &[
    ("lights", "Lights", "The environment of the lights."),
    (
        "panorama",
        "Map",
        "The environment map itself, of `lights.panorama`.",
    ),
    ("none", "None", "Transparent in saved pictures."),
];

/// The picture.
pub const RENDER: Section<RenderSection> = Section {
    name: "render",
    heading: "[render]",
    kind: None,
    help: "The picture.",
    params: &[
        Param::numbers(
            "size",
            "Size",
            Shape::Size,
            [1.0, MAX_SIDE as f64],
            at!(RenderSection.size),
        )
        .unit("pixels")
        .help("Width and height of the picture."),
        Param::new(
            "scattering",
            "Scattering",
            Kind::Choice(TERMS),
            at!(RenderSection.scattering),
        )
        .help("Scattering terms to render"),
        Param::number(
            "exposure",
            "Exposure",
            [-32.0, 32.0],
            at!(RenderSection.exposure),
        )
        .unit("stops")
        .slider(-6.0, 6.0)
        .help("Exposure: one stop more doubles the brightness."),
        Param::new(
            "tone_map",
            "Tone map",
            Kind::Choice(TONE_MAPS),
            at!(RenderSection.tone_map),
        )
        .help("Tone curve for the display"),
        Param::new("lut", "LUT", Kind::File, at!(RenderSection.lut)).help(
            "A `.cube` file, 1D or 3D, in place of the tone map: from exposed radiance, encoded as \
             `lut_input` says, to sRGB as displayed.",
        ),
        Param::new(
            "lut_input",
            "LUT input",
            Kind::Choice(LUT_INPUTS),
            at!(RenderSection.lut_input),
        )
        .help("How exposed linear Rec.709 radiance v is encoded for the LUT"),
        Param::new(
            "background",
            "Background",
            Kind::ChoiceOrColor(BACKGROUNDS, Numbers::new(Shape::Rgb, [0.0, 1e6])),
            at!(RenderSection.background),
        )
        .help("Background behind the hair"),
        Param::numbers(
            "samples",
            "Samples",
            Shape::Whole,
            [1.0, MAX_SAMPLES as f64],
            at!(RenderSection.samples),
        )
        .slider(4.0, 1024.0)
        .logarithmic()
        .help(
            "Samples per pixel where pictures are drawn with samples: by `strandview` \
                 without a window on a GPU, in pictures of more than 33 million pixels, and where a GPU has no room for a visibility list. More give smoother strands and take longer.",
        ),
        Param::numbers(
            "shadow_maps",
            "Shadow maps",
            Shape::Whole,
            [0.0, MAX_SHADOW_MAPS as f64],
            at!(RenderSection.shadow_maps),
        )
        .slider(0.0, 256.0)
        .help(
            "About how many shadow maps all lights share; a few more may be drawn. 0 keeps only the soft shadows. \
                 More cost memory and time when the hair or the lights move.",
        ),
    ],
    plain: RenderSection::default,
};
