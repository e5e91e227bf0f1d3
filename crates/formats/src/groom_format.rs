//! What a format that hair comes in and goes out by has to say and do.
//!
//! **To add a format**: a module of its own with a type that implements [`GroomFormat`], and its
//! row in [`GROOM_FORMATS`](crate::GROOM_FORMATS). Commands, errors and help go by that table.

use std::fmt;

use crate::error::{Error, Result};
use crate::groom::{Groom, MAX_COORDINATE_CM, UpAxis};
use crate::validate::in_range;

/// How many bytes of a file's start tell what it is.
pub const SNIFF_BYTES: usize = 4096;

/// What is known about a format before any file of it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FormatInfo {
    /// Name in commands and files, e.g. `hair`; never changes, for `.groom` files record it.
    pub name: &'static str,
    /// What a file is called in messages, with its article: `a .hair file`.
    pub title: &'static str,
    /// Endings of file names without the dot, the usual one first; never empty.
    pub extensions: &'static [&'static str],
    /// Centimetres per unit of a file that does not state its unit: the format's convention.
    pub cm_per_unit: f64,
    /// Up axis of a file that does not state it.
    pub up: UpAxis,
    /// What the format can hold, and what is written and read.
    pub can: Capabilities,
}

impl FormatInfo {
    /// The error of a format that is only read.
    pub(crate) fn is_not_written(&self) -> Error {
        Error::value("format", self.name, "one that is written as well as read")
    }
}

/// What a format can hold.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Capabilities {
    /// Files are read.
    pub reads: bool,
    /// Files are written.
    pub writes: bool,
    /// Attributes of a groom that a file holds.
    pub attributes: AttributeSupport,
    /// Kinds of curve that a file can hold. Other than linear ones are made polylines when read;
    /// linear ones are written wherever the format has them.
    pub bases: &'static [CurveBasis],
    /// A file can hold several points in time.
    pub frames: bool,
    /// A file is a tree of named objects: what [`ImportOptions::object`] chooses from.
    pub objects: bool,
}

/// The attributes that a file of a format can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AttributeSupport {
    /// Those of these names, under whatever name of its own.
    Only(&'static [&'static str]),
    /// Any, by name.
    Any,
}

impl AttributeSupport {
    /// Can a file hold the attribute called `name`?
    pub fn holds(self, name: &str) -> bool {
        match self {
            AttributeSupport::Only(names) => names.contains(&name),
            AttributeSupport::Any => true,
        }
    }
}

/// How the points of a strand make a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CurveBasis {
    /// A polyline through the points.
    Linear,
    /// Cubic Bezier pieces of 1 + 3 n points.
    Bezier,
    /// A uniform cubic B-spline.
    BSpline,
    /// A uniform cubic Catmull-Rom spline.
    CatmullRom,
}

impl CurveBasis {
    /// Name in listings: `linear`, `bezier`, `bspline`, `catmull_rom`.
    pub const fn name(self) -> &'static str {
        match self {
            CurveBasis::Linear => "linear",
            CurveBasis::Bezier => "bezier",
            CurveBasis::BSpline => "bspline",
            CurveBasis::CatmullRom => "catmull_rom",
        }
    }
}

/// How sure [`GroomFormat::sniff`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sniff {
    /// The file is something else.
    No,
    /// The file has no signature, but its start makes sense. Every format with a signature is asked
    /// before.
    Likely,
    /// The file starts with the signature of the format.
    Sure,
}

/// How to understand a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ImportOptions {
    /// Centimetres per unit, 1e-6..=1e6; `None`: as the file says, or else as its format has it by
    /// convention.
    pub cm_per_unit: Option<f64>,
    /// Axis that points up; `None` likewise.
    pub up: Option<UpAxis>,
    /// Most points that are read; a file of more is refused.
    pub max_points: u32,
    /// Which of several points in time, from 0: see [`SourceFile::frame_times`].
    ///
    /// [`SourceFile::frame_times`]: crate::SourceFile::frame_times
    pub frame: u32,
    /// Path of the one object to read of a file with several, as `/head/hair`, with all below it;
    /// `None`: all hair of the file.
    pub object: Option<String>,
    /// Pieces of a polyline that a cubic segment is drawn with, 1..=64.
    pub samples_per_segment: u32,
}

impl Default for ImportOptions {
    fn default() -> Self {
        ImportOptions {
            cm_per_unit: None,
            up: None,
            max_points: u32::MAX,
            frame: 0,
            object: None,
            samples_per_segment: 4,
        }
    }
}

impl ImportOptions {
    /// The same with a unit of so many centimetres.
    #[must_use]
    pub const fn with_unit(mut self, cm_per_unit: f64) -> Self {
        self.cm_per_unit = Some(cm_per_unit);
        self
    }

    /// The same with this axis up.
    #[must_use]
    pub const fn with_up(mut self, up: UpAxis) -> Self {
        self.up = Some(up);
        self
    }

    /// The same with another limit of the number of points.
    #[must_use]
    pub const fn with_max_points(mut self, max_points: u32) -> Self {
        self.max_points = max_points;
        self
    }

    /// The same for another point in time.
    #[must_use]
    pub const fn with_frame(mut self, frame: u32) -> Self {
        self.frame = frame;
        self
    }

    /// The same for one object of the file.
    #[must_use]
    pub fn with_object(mut self, path: impl Into<String>) -> Self {
        self.object = Some(path.into());
        self
    }

    /// The same with another number of pieces per cubic segment.
    #[must_use]
    pub const fn with_samples_per_segment(mut self, samples: u32) -> Self {
        self.samples_per_segment = samples;
        self
    }

    /// Checks the ranges.
    pub(crate) fn validate(&self) -> Result<()> {
        let samples = f64::from(self.samples_per_segment);
        in_range("samples per segment", samples, 1.0, 64.0)?;
        check_unit(self.cm_per_unit)
    }

    /// Where the points of a file of `format` go that states neither unit nor axis.
    pub(crate) fn placement(&self, format: &FormatInfo) -> Placement {
        Placement {
            cm_per_unit: self.cm_per_unit.unwrap_or(format.cm_per_unit),
            up: self.up.unwrap_or(format.up),
        }
    }

    /// `n_points` must not exceed the limit.
    pub(crate) fn check_points(&self, n_points: u64) -> Result<()> {
        if n_points <= u64::from(self.max_points) {
            return Ok(());
        }
        let range = format!("at most {}", self.max_points);
        Err(Error::value("number of points", n_points, range))
    }
}

/// How to write a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ExportOptions {
    /// Centimetres per unit of the file, 1e-6..=1e6; `None`: as in the source file if it was of the
    /// same format, else as the format has it by convention.
    pub cm_per_unit: Option<f64>,
    /// Axis of the file that points up; `None` likewise.
    pub up: Option<UpAxis>,
}

impl ExportOptions {
    /// The same with a unit of so many centimetres.
    #[must_use]
    pub const fn with_unit(mut self, cm_per_unit: f64) -> Self {
        self.cm_per_unit = Some(cm_per_unit);
        self
    }

    /// The same with this axis up.
    #[must_use]
    pub const fn with_up(mut self, up: UpAxis) -> Self {
        self.up = Some(up);
        self
    }

    /// Checks the ranges.
    pub(crate) fn validate(&self) -> Result<()> {
        check_unit(self.cm_per_unit)
    }

    /// Where the points of `groom` go in a file of `format`.
    pub(crate) fn placement(&self, groom: &Groom, format: &FormatInfo) -> Placement {
        let usual = match groom.source.original_of(format.name) {
            Some(_) => Placement::from_source(groom),
            None => ImportOptions::default().placement(format),
        };
        Placement {
            cm_per_unit: self.cm_per_unit.unwrap_or(usual.cm_per_unit),
            up: self.up.unwrap_or(usual.up),
        }
    }
}

fn check_unit(cm_per_unit: Option<f64>) -> Result<()> {
    match cm_per_unit {
        Some(cm) => in_range("unit (cm)", cm, 1e-6, 1e6),
        None => Ok(()),
    }
}

/// Between the points of a file and those of a groom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    /// Centimetres per unit of the file.
    pub cm_per_unit: f64,
    /// Axis of the file that points up.
    pub up: UpAxis,
}

impl Placement {
    /// That of the file that `groom` was imported from.
    pub fn from_source(groom: &Groom) -> Self {
        Placement {
            cm_per_unit: groom.source.cm_per_unit,
            up: groom.source.up,
        }
    }

    /// From the file's unit and axes to centimetres, +Y up; not checked.
    pub fn to_groom(self, position: [f32; 3]) -> [f32; 3] {
        self.up
            .file_to_y_up(position.map(|x| match self.cm_per_unit {
                1.0 => x,
                cm => (f64::from(x) * cm) as f32,
            }))
    }

    /// The inverse; of a unit of 1 cm without rounding.
    pub fn to_file(self, point: [f32; 3]) -> [f32; 3] {
        self.up.y_up_to_file(point).map(|x| match self.cm_per_unit {
            1.0 => x,
            cm => (f64::from(x) / cm) as f32,
        })
    }

    /// `position` of the file must be a point of a groom.
    pub fn check(self, strand: usize, point: usize, position: [f32; 3]) -> Result<()> {
        // `contains` is false for NaN.
        let range = -MAX_COORDINATE_CM..=MAX_COORDINATE_CM;
        if self.to_groom(position).iter().all(|x| range.contains(x)) {
            return Ok(());
        }
        Err(Error::value(
            format!("strand {strand}, point {point}"),
            format!("{position:?}"),
            format!(
                "finite and within +-{MAX_COORDINATE_CM} cm, at {} cm per unit",
                self.cm_per_unit
            ),
        ))
    }
}

/// What kind of thing a [`Note`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoteKind {
    /// The file leaves something open or bends the rules of its format; what it was taken for.
    Assumed,
    /// Something is kept for writing the file again and not drawn.
    SetAside,
    /// Something is left out.
    Dropped,
}

/// Something that whoever imports or exports wants to know, in one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What kind of thing.
    pub kind: NoteKind,
    /// The line.
    pub text: String,
}

impl Note {
    pub(crate) fn new(kind: NoteKind, text: impl Into<String>) -> Self {
        let text = text.into();
        Note { kind, text }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What says which unit or up axis a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StatedBy {
    /// [`ImportOptions`].
    Options,
    /// The file itself.
    File,
    /// Nothing: the format's convention.
    Convention,
}

/// What came in.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Import {
    /// The groom; its source says what it was imported from.
    pub groom: Groom,
    /// What was assumed, set aside and left out.
    pub notes: Vec<Note>,
    /// What says the unit.
    pub unit_by: StatedBy,
    /// What says the up axis.
    pub up_by: StatedBy,
}

impl Import {
    /// Unit and axis are those of the options or else of the format; a reader whose file states
    /// them says so in the fields.
    pub(crate) fn new(groom: Groom, notes: Vec<Note>) -> Self {
        Import {
            groom,
            notes,
            unit_by: StatedBy::Convention,
            up_by: StatedBy::Convention,
        }
    }
}

/// What goes out.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Export {
    /// The file.
    pub bytes: Vec<u8>,
    /// Names of the attributes that the file cannot hold, in the order of the groom.
    pub dropped: Vec<String>,
    /// What else was left out or made different.
    pub notes: Vec<Note>,
    /// Number of points in the file, where it is not that of the groom.
    pub n_points: Option<usize>,
}

impl Export {
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        Export {
            bytes,
            dropped: Vec::new(),
            notes: Vec::new(),
            n_points: None,
        }
    }
}

/// A format that hair comes in and goes out by.
///
/// Call [`SourceFile`](crate::SourceFile) and [`Groom::export`] rather than `read` and `write`:
/// they check options and grooms for all formats, and fill in what is the same for all.
pub trait GroomFormat: fmt::Debug + Sync {
    /// Name, conventions and capabilities.
    fn info(&self) -> &'static FormatInfo;

    /// Is a file of this format that starts with `start`, its first
    /// [`SNIFF_BYTES`](crate::SNIFF_BYTES) bytes or all of it?
    fn sniff(&self, start: &[u8]) -> Sniff;

    /// Decodes a whole file, in memory bounded by a small multiple of its length. The groom's
    /// source has unit, axis and [`Original`](crate::Original); its hash is filled in by the
    /// caller.
    ///
    /// # Errors
    /// `Invalid` where counts and length disagree, `Value` for numbers out of range, naming strand
    /// and point; `Value` where the format cannot be read.
    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import>;

    /// Encodes a groom that keeps its promises.
    ///
    /// # Errors
    /// `Value` where the groom does not fit into the format, or the format cannot be written.
    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export>;

    /// Times of the points in time that the file holds, seconds, rising; one for a file that does
    /// not move.
    ///
    /// # Errors
    /// As [`GroomFormat::read`].
    fn frame_times(&self, bytes: &[u8]) -> Result<Vec<f64>> {
        let _ = bytes;
        Ok(vec![0.0])
    }

    /// Encodes a groom that moves: points in time of the same strands, `frames_per_second` of them.
    ///
    /// # Errors
    /// As [`GroomFormat::write`]; `Value` where the format holds one point in time only.
    fn write_frames(
        &self,
        frames: &[Groom],
        frames_per_second: f64,
        options: &ExportOptions,
    ) -> Result<Export> {
        let _ = frames_per_second;
        match frames {
            [groom] => self.write(groom, options),
            _ => Err(Error::value(
                "number of frames",
                frames.len(),
                format!("1, for {} holds no more", self.info().title),
            )),
        }
    }

    /// How many strands of the file are not in the groom, but kept in `original` for writing the
    /// file again.
    fn n_set_aside(&self, original: &[u8]) -> usize {
        let _ = original;
        0
    }
}
