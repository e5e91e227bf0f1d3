//! Reading `.hair` files.

use std::path::{Path, PathBuf};

use super::thickness::diameter;
use super::{ATTRIBUTES, HEADER_BYTES, f32_at, flag, u32_at};
use crate::error::{Error, FileName, Result};
use crate::groom::{
    Attribute, Domain, Groom, GroomSource, HairOriginal, MAX_COORDINATE_CM, SinglePoint, UpAxis,
};
use crate::groom_scale::Guesses;
use crate::input::{content_hash, read_file_of_kind, tool_version};
use crate::sniff::FileKind;
use crate::validate::{finite, in_range};

/// Largest `.hair` file: 4 GiB, about 100 million points with all arrays.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// How to understand a file's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairImport {
    /// Centimetres per unit, 1e-6..=1e6.
    pub cm_per_unit: f64,
    /// Axis that points up; z by the format's convention.
    pub up: UpAxis,
}

impl Default for HairImport {
    fn default() -> Self {
        HairImport {
            cm_per_unit: 1.0,
            up: UpAxis::Z,
        }
    }
}

/// A `.hair` file in memory, to be imported in one way or another.
#[derive(Clone, Debug)]
pub struct HairFile {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl HairFile {
    /// Reads the file at `path`; what it holds is checked by [`HairFile::import`].
    ///
    /// # Errors
    /// `Io`, or `Value` where it is too long; the path is named.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = read_file_of_kind(path, MAX_FILE_BYTES, |kind| kind == FileKind::Hair)?;
        let path = path.to_owned();
        Ok(HairFile { path, bytes })
    }

    /// Makes a groom of it.
    ///
    /// # Errors
    /// As [`Groom::from_hair`], naming the path.
    pub fn import(&self, options: HairImport) -> Result<Groom> {
        Groom::from_hair(&self.bytes, options).map_err(|error| error.in_file(&self.path))
    }

    /// Guesses unit and up axis: see [`Groom::guess_source`].
    ///
    /// # Errors
    /// As [`HairFile::import`].
    pub fn guess_source(&self) -> Result<Guesses> {
        // Small enough for the coordinates of a groom, whatever they are in.
        let small = HairImport {
            cm_per_unit: 0.01,
            ..HairImport::default()
        };
        Ok(self.import(small)?.guess_source())
    }

    /// Does it start with `HAIR` in other letters than capitals? It is read all the same.
    pub fn has_odd_magic(&self) -> bool {
        !self.bytes.starts_with(b"HAIR")
    }
}

/// The arrays of a file, checked against its length.
struct Layout<'a> {
    n_strands: usize,
    segments: Option<&'a [u8]>,
    default_segments: u64,
    points: &'a [u8],
    /// In the order of [`ATTRIBUTES`].
    arrays: [Option<&'a [u8]>; 3],
}

impl Groom {
    /// Imports a `.hair` file.
    ///
    /// # Errors
    /// Any of [`Error`], naming the path.
    pub fn read_hair(path: &Path, options: HairImport) -> Result<Self> {
        HairFile::read(path)?.import(options)
    }

    /// Imports a `.hair` file in memory. Memory use is bounded by a small multiple of its length.
    ///
    /// # Errors
    /// `NotThisKind`, `Invalid` when counts, flags and length disagree, `Value` for a number that
    /// is not finite, naming strand and point, or when no strand has two points.
    pub fn from_hair(bytes: &[u8], options: HairImport) -> Result<Self> {
        in_range("unit (cm)", options.cm_per_unit, 1e-6, 1e6)?;
        let layout = parse_layout(bytes)?;
        let mut groom = Groom {
            strand_offsets: vec![0],
            ..Groom::default()
        };
        let mut data: [Vec<f32>; 3] = Default::default();
        let mut single_points = Vec::new();
        let mut first = 0usize;
        for strand in 0..layout.n_strands {
            let n_points = layout.points_of(strand) as usize;
            check_points(&layout, strand, first, n_points, options)?;
            if n_points == 1 {
                single_points.push(layout.single_point(strand, first));
            } else {
                groom.points.extend(
                    (first..first + n_points)
                        .map(|ix| to_groom(point_at(layout.points, ix), options)),
                );
                for (slot, (array, (_, _, components, _))) in
                    data.iter_mut().zip(layout.arrays.iter().zip(ATTRIBUTES))
                {
                    if let Some(array) = array {
                        slot.extend(floats(array, first * components, n_points * components));
                    }
                }
                // The number of points is a u32 in the header.
                groom.strand_offsets.push(groom.points.len() as u32);
            }
            first += n_points;
        }
        if groom.n_strands() == 0 {
            return Err(Error::value(
                "number of strands with two points or more",
                0,
                "at least 1",
            ));
        }
        for ((name, _, components, default_at), (array, data)) in
            ATTRIBUTES.into_iter().zip(layout.arrays.iter().zip(data))
        {
            let defaults: Vec<f32> = (0..components)
                .map(|ix| f32_at(bytes, default_at + 4 * ix))
                .collect();
            if array.is_none() {
                for &value in &defaults {
                    finite(|| format!("default {name} (byte {default_at})"), value)?;
                }
            }
            groom.attributes.push(Attribute {
                name: name.to_owned(),
                domain: array.map_or(Domain::Groom, |_| Domain::Point),
                components: components as u32,
                data: array.map_or(defaults, |_| data),
            });
        }
        groom
            .attributes
            .extend(diameter(&groom, options.cm_per_unit));
        groom.source = GroomSource {
            cm_per_unit: options.cm_per_unit,
            up: options.up,
            hash: content_hash(bytes),
            tool_version: tool_version(),
            parameters: Vec::new(),
            hair: Some(HairOriginal {
                header: [b"HAIR", &bytes[4..HEADER_BYTES]].concat(),
                single_points,
            }),
        };
        groom.validate()?;
        Ok(groom)
    }
}

impl Layout<'_> {
    /// Number of points of `strand`.
    fn points_of(&self, strand: usize) -> u64 {
        let segments = self.segments.map_or(self.default_segments, |segments| {
            u64::from(u16::from_le_bytes([
                segments[2 * strand],
                segments[2 * strand + 1],
            ]))
        });
        segments + 1
    }

    fn single_point(&self, strand: usize, ix: usize) -> SinglePoint {
        let value = |array: usize, components: usize, component: usize| {
            self.arrays[array].map_or(0.0, |bytes| {
                f32_at(bytes, 4 * (ix * components + component))
            })
        };
        SinglePoint {
            strand: strand as u32,
            position: point_at(self.points, ix),
            thickness: value(0, 1, 0),
            transparency: value(1, 1, 0),
            color: [0, 1, 2].map(|component| value(2, 3, component)),
        }
    }
}

fn parse_layout(bytes: &[u8]) -> Result<Layout<'_>> {
    match FileKind::of(bytes) {
        FileKind::Hair => {}
        FileKind::Unknown | FileKind::Text => {
            return Err(Error::NotThisKind {
                file: FileName::default(),
                expected: ".hair file",
                found: "it does not start with HAIR".to_owned(),
            });
        }
        found => return Err(Error::not_this_kind(".hair file", found)),
    }
    if bytes.len() < HEADER_BYTES {
        let what = "file ends within its 128-byte header";
        return Err(Error::invalid(what, bytes.len() as u64));
    }
    let n_strands = u64::from(u32_at(bytes, 4));
    let n_points = u64::from(u32_at(bytes, 8));
    let flags = u32_at(bytes, 12);
    if flags & !flag::ALL != 0 {
        let what = format!("flags {flags:#x} have bits that mean nothing");
        return Err(Error::invalid(what, 12));
    }
    if flags & flag::POINTS == 0 {
        return Err(Error::invalid("file has no points (flag 2 is not set)", 12));
    }

    // Take the arrays one after another, each checked against what is left.
    let mut rest = &bytes[HEADER_BYTES..];
    let mut take = |name: &str, flag: u32, count: u64, item_bytes: u64| {
        if flags & flag == 0 {
            return Ok(None);
        }
        let wanted = count * item_bytes;
        if wanted > rest.len() as u64 {
            return Err(Error::invalid(
                format!(
                    "the header promises {wanted} bytes of {name}, the file has {} left",
                    rest.len()
                ),
                (bytes.len() - rest.len()) as u64,
            ));
        }
        let (array, after) = rest.split_at(wanted as usize);
        rest = after;
        Ok(Some(array))
    };
    let segments = take("segments", flag::SEGMENTS, n_strands, 2)?;
    let points = take("points", flag::POINTS, n_points, 12)?.unwrap_or_default();
    let arrays = [
        take("thickness", flag::THICKNESS, n_points, 4)?,
        take("transparency", flag::TRANSPARENCY, n_points, 4)?,
        take("colours", flag::COLOR, n_points, 12)?,
    ];
    if !rest.is_empty() {
        return Err(Error::invalid(
            format!("{} bytes after the last array", rest.len()),
            (bytes.len() - rest.len()) as u64,
        ));
    }

    let default_segments = u64::from(u32_at(bytes, 16));
    // u32 times u32 + 1 fits into u64.
    let total = match segments {
        None => n_strands * (default_segments + 1),
        Some(segments) => segments
            .chunks_exact(2)
            .map(|pair| u64::from(u16::from_le_bytes([pair[0], pair[1]])) + 1)
            .sum(),
    };
    if total != n_points {
        return Err(Error::invalid(
            format!("the strands have {total} points in all, the header says {n_points}"),
            8,
        ));
    }
    Ok(Layout {
        n_strands: n_strands as usize,
        segments,
        default_segments,
        points,
        arrays,
    })
}

/// Every number of the strand must be finite, and the points not too far out.
fn check_points(
    layout: &Layout<'_>,
    strand: usize,
    first: usize,
    n_points: usize,
    options: HairImport,
) -> Result<()> {
    for point in 0..n_points {
        let position = to_groom(point_at(layout.points, first + point), options);
        let range = -MAX_COORDINATE_CM..=MAX_COORDINATE_CM;
        if !position.iter().all(|x| range.contains(x)) {
            return Err(Error::value(
                format!("strand {strand}, point {point}"),
                format!("{:?}", point_at(layout.points, first + point)),
                format!(
                    "finite and within +-{MAX_COORDINATE_CM} cm, at {} cm per unit",
                    options.cm_per_unit
                ),
            ));
        }
        for (array, (name, _, components, _)) in layout.arrays.iter().zip(ATTRIBUTES) {
            let Some(array) = array else { continue };
            for value in floats(array, (first + point) * components, components) {
                if !value.is_finite() {
                    let key = format!("{name} of strand {strand}, point {point}");
                    return Err(Error::value(key, value, "finite"));
                }
            }
        }
    }
    Ok(())
}

fn point_at(points: &[u8], ix: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| f32_at(points, 12 * ix + 4 * axis))
}

fn floats(bytes: &[u8], first: usize, count: usize) -> impl Iterator<Item = f32> + '_ {
    (first..first + count).map(|ix| f32_at(bytes, 4 * ix))
}

/// From the file's unit and axes to centimetres, +Y up.
fn to_groom(position: [f32; 3], options: HairImport) -> [f32; 3] {
    options.up.to_y_up(position.map(|x| {
        if options.cm_per_unit == 1.0 {
            x
        } else {
            (f64::from(x) * options.cm_per_unit) as f32
        }
    }))
}
