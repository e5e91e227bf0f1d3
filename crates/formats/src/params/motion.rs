//! `[motion]`, `[motion.wind]` and `[[proxy]]`.

use super::section::{Param, Place, Section, at};
use super::spec::{Absent, Kind, Shape};
use crate::scene_motion::{MotionSection, WindSection};
use crate::scene_proxy::ProxySection;

/// A sequence of grooms.
pub const MOTION: Section<MotionSection> = Section {
    name: "motion",
    heading: "[motion]",
    kind: None,
    help: "How the hair moves: through a sequence of grooms, or in the wind of `[motion.wind]`, not \
           both. Without it, the hair stays.",
    params: &[
        Param::new("frames", "Frames", Kind::Files, at!(MotionSection.frames))
            .absent(Absent::Words("must be given, unless there is wind"))
            .help(
                "`.groom` files, one pose each, with the strands and points of `groom.file`; the first \
                 at time 0. Between two the hair moves straight; after the last it stays. Numbered files \
                 as `{ files = \"pose.%04d.groom\", first = 1, last = 24 }`, or with `####`.",
            ),
        Param::number("fps", "Frame rate", [1e-3, 1e3], at!(MotionSection.fps))
            .absent(Absent::Number(MotionSection::DEFAULT_FPS))
            .unit("/s")
            .slider(1.0, 60.0)
            .help("Playback rate of `motion.frames`, without which it is refused."),
    ],
    plain: MotionSection::default,
};

/// Wind.
pub const WIND: Section<WindSection> = Section {
    name: "motion.wind",
    heading: "[motion.wind]",
    kind: None,
    help: "Wind that bends the groom.",
    params: &[
        Param::number("speed", "Wind speed", [0.0, 30.0], at!(WindSection.speed))
            .unit("m/s")
            .help("3 is a breeze, in which hanging hair leans by 13 degrees; by 34 at 6, and by 44 at most."),
        Param::number("gust", "Gusts", [0.0, 1.0], at!(WindSection.gust))
            .help("Strength of the variation of the wind speed."),
        Param::number(
            "direction_deg",
            "Wind direction",
            [-3600.0, 3600.0],
            at!(WindSection.direction_deg),
        )
        .unit("°")
        .slider(-180.0, 180.0)
        .decimals(0)
        .help("Direction in which the wind blows: 0 is towards +Z, 90 towards +X."),
        Param::number(
            "stiffness",
            "Stiffness",
            [0.1, 1000.0],
            at!(WindSection.stiffness),
        )
        .unit("cm")
        .slider(1.0, 40.0)
        .help("Length from the root at which half of the wind acts; longer is stiffer."),
        Param::numbers(
            "seed",
            "Seed",
            Shape::Whole,
            [0.0, u32::MAX as f64],
            at!(WindSection.seed),
        )
        .slider(0.0, 100.0)
        .help("Random seed of the gusts."),
    ],
    plain: WindSection::default,
};

/// Range of a coordinate.
const COORDINATE: [f64; 2] = [-1e6, 1e6];
/// Range of a share of light.
const ALBEDO: [f64; 2] = [0.0, 1.0];
const ALBEDO_HELP: &str = "Diffuse albedo of the surface.";

/// The place of a field of one kind of proxy.
macro_rules! of {
    ($kind:ident $field:ident) => {
        Place {
            get: |proxy| match proxy {
                ProxySection::$kind { $field, .. } => Some($field),
                _ => None,
            },
            get_mut: |proxy| match proxy {
                ProxySection::$kind { $field, .. } => Some($field),
                _ => None,
            },
        }
    };
}

/// A head.
pub const ELLIPSOID: Section<ProxySection> = Section {
    name: "proxy",
    heading: "[[proxy]]",
    kind: Some("ellipsoid"),
    help: "An ellipsoid in place of the head: opaque, matte, lit by the lights and shadowed by the hair.",
    params: &[
        Param::numbers(
            "centre",
            "Centre",
            Shape::Vector,
            COORDINATE,
            of!(Ellipsoid centre),
        )
        .absent(Absent::Refused)
        .unit("cm")
        .help("Centre of the ellipsoid."),
        Param::numbers(
            "radii",
            "Radius",
            Shape::Vector,
            [1e-3, 1e6],
            of!(Ellipsoid radii),
        )
        .absent(Absent::Refused)
        .unit("cm")
        .help("Half axes along x, y and z."),
        Param::number("tilt_deg", "Tilt", [-180.0, 180.0], of!(Ellipsoid tilt_deg))
            .unit("°")
            .decimals(1)
            .help("Pitch about the x axis through its centre; above 0 the top leans towards +Z."),
        Param::numbers(
            "albedo",
            "Albedo",
            Shape::Rgb,
            ALBEDO,
            of!(Ellipsoid albedo),
        )
        .decimals(3)
        .help(ALBEDO_HELP),
    ],
    plain: || ProxySection::ellipsoid([0.0; 3], [1.0; 3]),
};

/// A ground.
pub const GROUND: Section<ProxySection> = Section {
    name: "proxy",
    heading: "[[proxy]]",
    kind: Some("ground"),
    help: "An infinite horizontal plane, lit from above.",
    params: &[
        Param::number("height", "Height", COORDINATE, of!(Ground height))
            .absent(Absent::Refused)
            .unit("cm")
            .help("Height y of the plane."),
        Param::numbers("albedo", "Albedo", Shape::Rgb, ALBEDO, of!(Ground albedo))
            .decimals(3)
            .help(ALBEDO_HELP),
    ],
    plain: || ProxySection::ground(0.0),
};

/// A mesh.
pub const MESH: Section<ProxySection> = Section {
    name: "proxy",
    heading: "[[proxy]]",
    kind: Some("mesh"),
    help: "A triangle mesh, such as a head: opaque, matte, lit by the lights and shadowed by the hair and itself.",
    params: &[
        Param::new("mesh", "Mesh", Kind::File, of!(Mesh mesh))
            .absent(Absent::Refused)
            .help("A `.mesh` file; `strandlight mesh import` makes one of OBJ or glTF."),
        Param::numbers(
            "offset",
            "Offset",
            Shape::Vector,
            COORDINATE,
            of!(Mesh offset),
        )
        .unit("cm")
        .help("Translation of the mesh."),
        Param::numbers("albedo", "Albedo", Shape::Rgb, ALBEDO, of!(Mesh albedo))
            .decimals(3)
            .help(ALBEDO_HELP),
    ],
    plain: || ProxySection::mesh("head.mesh"),
};

impl ProxySection {
    /// The rows of this kind.
    pub const fn section(&self) -> &'static Section<ProxySection> {
        match self {
            ProxySection::Ellipsoid { .. } => &ELLIPSOID,
            ProxySection::Ground { .. } => &GROUND,
            ProxySection::Mesh { .. } => &MESH,
        }
    }
}
