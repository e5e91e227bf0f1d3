//! What can go wrong between a scene file and a picture.

use std::path::{Path, PathBuf};

use strandlight_scattering::{Lobe, ParamError};

use crate::budget::FrameError;
use crate::limits::{MAX_GROOM_BYTES, MAX_POINTS};
use crate::tables::ShadingTablesError;

/// A scene that cannot be prepared for rendering.
///
/// Its text is the whole story in one line, those of its causes included;
/// [`source`](std::error::Error::source) leads to the causes one by one, in the end to what the
/// operating system answered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file that cannot be read or written, or a value outside its range.
    #[error(transparent)]
    Format(#[from] strandlight_formats::Error),
    /// Something in a file.
    #[error("{}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong in it.
        source: Box<SceneError>,
    },
    /// What a key of the scene says, or the file that it names.
    #[error("{key}: {source}")]
    Key {
        /// The key, such as `groom.file` or `lights[3]`.
        key: String,
        /// What is wrong there.
        source: Box<SceneError>,
    },
    /// A file that comes with the program.
    #[error("{name}: {source}")]
    BuiltIn {
        /// What it is.
        name: &'static str,
        /// What is wrong with it.
        source: Box<SceneError>,
    },
    /// Tables that shading cannot use.
    #[error(transparent)]
    Tables(#[from] ShadingTablesError),
    /// Hair that cannot be shaded.
    #[error(transparent)]
    Material(#[from] EditError),
    /// A brush that cannot be used.
    #[error(transparent)]
    Brush(#[from] BrushError),
    /// A picture that cannot be made.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A key names a light that the set does not have.
    #[error("{key}: there is no light {light}; the set has lights 0..={last}")]
    NoLight {
        /// The key.
        key: &'static str,
        /// Index of the light it names.
        light: u32,
        /// Index of the last light of the set.
        last: usize,
    },
    /// A group of lights cannot have one of the lights it names.
    #[error("group {group}: light {light} {fault}")]
    Group {
        /// Name of the group.
        group: String,
        /// Index of the light.
        light: usize,
        /// Why not.
        fault: GroupFault,
    },
    /// Two groups of lights have one name.
    #[error("group {0} is there twice; name all its lights in one")]
    GroupTwice(String),
    /// A frame of the motion has other strands than the groom.
    #[error("its strands differ from those of groom.file")]
    FrameStrands,
    /// More points in a groom file than the buffers hold.
    #[error("the groom has {points} points; at most {MAX_POINTS} can be drawn")]
    GroomPoints {
        /// Points of the groom.
        points: u64,
    },
    /// A groom file that is too long.
    #[error(
        "the groom has {} MB; at most {} MB are read",
        megabytes(*bytes),
        megabytes(MAX_GROOM_BYTES)
    )]
    GroomBytes {
        /// Bytes of its arrays.
        bytes: u64,
    },
    /// Not enough memory for a groom.
    #[error(
        "the groom takes {} MB of memory and {} MB are free",
        megabytes(*needed),
        megabytes(*available)
    )]
    GroomMemory {
        /// Bytes that preparing it takes.
        needed: u64,
        /// Bytes that are free.
        available: u64,
    },
    /// Nothing to draw.
    #[error("the groom has no strand with two different points")]
    EmptyGroom,
    /// Strand offsets are not a partition of the points.
    #[error("the groom's strand offsets do not fit its points")]
    Offsets,
    /// A coordinate is NaN, infinite or beyond 1e7 cm.
    #[error("point {point} of the groom is not within 1e7 cm of the origin")]
    Point {
        /// Index of the point.
        point: usize,
    },
    /// A fibre diameter is not a positive number.
    #[error("the fibre diameter of strand {strand} is {value} cm; it must be positive")]
    Diameter {
        /// Index of the strand.
        strand: usize,
        /// The offending value.
        value: f32,
    },
    /// More points than the buffers hold.
    #[error("the groom has {points} points or more; at most {MAX_POINTS} can be drawn")]
    TooManyPoints {
        /// Points counted until then.
        points: usize,
    },
}

fn megabytes(bytes: u64) -> u64 {
    bytes.div_ceil(1_000_000)
}

impl SceneError {
    /// The same error, about something in the file at `path`.
    #[must_use]
    pub fn in_file(self, path: &Path) -> SceneError {
        SceneError::InFile {
            path: path.to_owned(),
            source: Box::new(self),
        }
    }

    /// The same error, about what `key` says or the file that it names.
    #[must_use]
    pub fn at_key(self, key: impl Into<String>) -> SceneError {
        SceneError::Key {
            key: key.into(),
            source: Box::new(self),
        }
    }
}

/// Why a group of lights cannot have a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GroupFault {
    /// The light set does not have it.
    Missing,
    /// A group has it already.
    Shared,
}

impl std::fmt::Display for GroupFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            GroupFault::Missing => "is not in the light set",
            GroupFault::Shared => "is in a group already",
        })
    }
}

/// Why textures cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// A hair parameter is outside its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A mode is enabled and its lobes were not loaded.
    #[error("the lobes of {} are not loaded", .0.name())]
    NoLobes(Lobe),
    /// The lobes of painted hair are those of round fibres.
    #[error("painted hair must be round: eccentricity is {0}, not 1")]
    PaintedEccentric(f64),
    /// The lobes and averages of painted hair are Marschner's.
    #[error("painted hair takes hair.model = \"marschner\", not \"energy\"")]
    PaintedEnergy,
    /// The orders beyond TRT are those of a dielectric.
    #[error("hair.model = \"energy\" takes tables of the dielectric Fresnel term, not Schlick's")]
    EnergySchlick,
}

/// Why a brush cannot be used: the name of its value and what it must be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("brush: {key} = {value} must be in {min}..={max}")]
pub struct BrushError {
    /// Name of the value.
    pub key: &'static str,
    /// The value.
    pub value: f32,
    /// Least value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
}

/// A picture that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A size or a number of samples that no picture has.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Not one colour for each light.
    #[error("{colors} colours for {lights} lights")]
    Colors {
        /// Colours given.
        colors: usize,
        /// Lights there are.
        lights: usize,
    },
    /// Lights or points that a renderer was given cannot be drawn.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The adapter or its driver failed; the cause is the error of the crate that drives it.
    #[error("GPU: {0}")]
    Gpu(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// A side is longer than the adapter can draw.
    #[error("GPU: size {width}x{height}: the sides of pictures are at most {most} on this adapter")]
    AdapterSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// The adapter's longest side.
        most: u32,
    },
    /// The device is gone, and all that was on it. Another may be opened and the scene put there.
    #[error("GPU: the device was lost: {0}")]
    DeviceLost(String),
    /// The scene does not fit the device.
    #[error("{what}: {bytes} bytes are needed, and {limit} are allowed")]
    TooLarge {
        /// What is too large.
        what: String,
        /// Bytes needed.
        bytes: u64,
        /// Bytes there may be.
        limit: u64,
    },
    /// The PNG encoder failed.
    #[error("PNG: {0}")]
    Png(#[from] png::EncodingError),
    /// Proxies, and a method for transmittance that does not know them.
    #[error("[[proxy]] requires transmittance by sweeps")]
    ProxiesNeedSweeps,
}

#[cfg(test)]
mod tests {
    use std::error::Error;
    use std::io;

    use strandlight_formats::Scene;

    use super::*;
    use crate::assets::{Assets, ModesToRead};
    use crate::files::Files;

    #[test]
    fn causes_lead_from_the_key_to_what_the_system_answered() {
        let scene = Scene::new("not/there.groom", "not/there.lights");
        let error = Assets::read(&scene, &Files::Disk, ModesToRead::OfScene)
            .expect_err("no such file")
            .in_file(Path::new("a.toml"));
        let SceneError::InFile { path, source } = &error else {
            panic!("{error:?}");
        };
        assert_eq!(path, Path::new("a.toml"));
        let SceneError::Key { key, source } = &**source else {
            panic!("{source:?}");
        };
        assert_eq!(key, "groom.file");
        let SceneError::Format(formats) = &**source else {
            panic!("{source:?}");
        };
        assert_eq!(formats.path(), Some(Path::new("not/there.groom")));
        let causes = std::iter::successors(error.source(), |&error| error.source());
        let system = causes
            .last()
            .and_then(|last| last.downcast_ref::<io::Error>());
        let system = system.expect("the system's answer");
        assert_eq!(system.kind(), io::ErrorKind::NotFound);
        assert_eq!(
            error.to_string(),
            format!("a.toml: groom.file: not/there.groom: {system}")
        );
    }

    #[test]
    fn errors_can_leave_their_thread() {
        fn check<T: Error + Send + Sync + 'static>() {}
        check::<SceneError>();
        check::<RenderError>();
    }
}
