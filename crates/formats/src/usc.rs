//! Files of strands as in the hair style database USC-HairSalon (Hu et al. 2015) and its
//! successors, `.data`.
//!
//! All numbers are little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | number of strands, i32 |
//! | for each strand: 4 | number of points n, i32 |
//! | 12 n | points, 3 f32 each, root first |
//!
//! There is no signature and nothing but points. In the database strands have 100 points, or one
//! where nothing grows. Unit and axis are not stated; its heads stand 1.64 up along y, so they are
//! in metres.
//!
//! **Import and export are inverse** with a unit of 1 cm, as for [`crate::hair`]; strands of one
//! point or none are set aside. What is kept in the groom's [`crate::Original`]: 20 bytes for each
//! of these, its index u32, number of points u32 (0 or 1), and the point, 3 f32, in the file's own
//! unit and axes (zero if there is none).

use crate::bytes::{extend_floats, point_at, u32_at};
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::groom::{Groom, GroomSource, Original, UpAxis};
use crate::groom_format::{
    AttributeSupport, Capabilities, CurveBasis, Export, ExportOptions, FormatInfo, GroomFormat,
    Import, ImportOptions, Note, NoteKind, Placement, SNIFF_BYTES, Sniff,
};
use crate::point_list::{self, PointKind};
use crate::validate::{finite, in_range};

/// Files of the USC-HairSalon database.
#[derive(Debug)]
pub(crate) struct UscFormat;

static INFO: FormatInfo = FormatInfo {
    name: "usc",
    title: "a USC-HairSalon .data file",
    extensions: &["data"],
    cm_per_unit: 100.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Only(&[]),
        bases: &[CurveBasis::Linear],
        frames: false,
        objects: false,
    },
};

/// Bytes of a short strand in the original.
const SHORT_BYTES: usize = 20;

impl GroomFormat for UscFormat {
    fn info(&self) -> &'static FormatInfo {
        &INFO
    }

    fn sniff(&self, start: &[u8]) -> Sniff {
        match point_list::kind(start, SNIFF_BYTES) {
            Some(PointKind::Position) => Sniff::Likely,
            _ => Sniff::No,
        }
    }

    fn read(&self, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
        read(bytes, options)
    }

    fn write(&self, groom: &Groom, options: &ExportOptions) -> Result<Export> {
        write(groom, options).map(Export::new)
    }

    fn n_set_aside(&self, original: &[u8]) -> usize {
        original.len() / SHORT_BYTES
    }
}

/// A strand of one point or none.
#[derive(Debug)]
struct Short {
    strand: u32,
    /// In the file's own unit and axes.
    point: Option<[f32; 3]>,
}

impl Short {
    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.strand.to_le_bytes().to_vec();
        bytes.extend(u32::from(self.point.is_some()).to_le_bytes());
        extend_floats(&mut bytes, &self.point.unwrap_or_default());
        bytes
    }
}

/// The bytes that are not read yet.
struct Rest<'a> {
    bytes: &'a [u8],
    offset: u64,
}

impl<'a> Rest<'a> {
    /// The next `length` bytes, which hold `what`.
    fn take(&mut self, length: u64, what: impl FnOnce() -> String) -> Result<&'a [u8]> {
        let taken = usize::try_from(length)
            .ok()
            .and_then(|length| self.bytes.split_at_checked(length));
        let Some((taken, rest)) = taken else {
            let left = self.bytes.len();
            let what = format!("{} take {length} bytes, the file has {left} left", what());
            return Err(Error::invalid(what, self.offset));
        };
        self.bytes = rest;
        self.offset += length;
        Ok(taken)
    }

    /// The next count, which must not be negative.
    fn count(&mut self, what: impl Fn() -> String) -> Result<u32> {
        let count = u32_at(self.take(4, &what)?, 0);
        let range = format!("in 0..={}", i32::MAX);
        match i32::try_from(count) {
            Ok(_) => Ok(count),
            Err(_) => Err(Error::value(what(), count as i32, range)),
        }
    }
}

fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let placement = options.placement(&INFO);
    let mut rest = Rest { bytes, offset: 0 };
    let n_strands = rest.count(|| "number of strands".to_owned())?;
    let mut groom = Groom {
        strand_offsets: vec![0],
        ..Groom::default()
    };
    let mut shorts = Vec::new();
    let mut n_points_before = 0u64;
    for strand in 0..n_strands {
        let n_points = rest.count(|| format!("number of points of strand {strand}"))?;
        let what = || format!("{n_points} points of strand {strand}");
        let array = rest.take(12 * u64::from(n_points), what)?;
        n_points_before += u64::from(n_points);
        options.check_points(n_points_before)?;
        for (ix, point) in array.chunks_exact(12).enumerate() {
            placement.check(strand as usize, ix, point_at(point, 0))?;
        }
        let mut points = array.chunks_exact(12).map(|point| point_at(point, 0));
        if n_points < 2 {
            let point = points.next();
            shorts.push(Short { strand, point });
        } else {
            groom
                .points
                .extend(points.map(|point| placement.to_groom(point)));
            // No more than `max_points`, a u32.
            groom.strand_offsets.push(groom.points.len() as u32);
        }
    }
    if !rest.bytes.is_empty() {
        let what = counted(rest.bytes.len(), "byte", "bytes") + " after the last strand";
        return Err(Error::invalid(what, rest.offset));
    }
    if groom.n_strands() == 0 {
        let key = "number of strands with two points or more";
        return Err(Error::value(key, 0, "at least 1"));
    }
    let mut notes = Vec::new();
    if !shorts.is_empty() {
        let n = shorts.len();
        let what = counted(
            n,
            "strand of fewer than two points is",
            "strands of fewer than two points are",
        ) + " kept for export but not drawn";
        notes.push(Note::new(NoteKind::SetAside, what));
    }
    groom.source = GroomSource {
        cm_per_unit: placement.cm_per_unit,
        up: placement.up,
        original: Some(Original {
            format: INFO.name.to_owned(),
            data: shorts.iter().flat_map(Short::to_bytes).collect(),
        }),
        ..GroomSource::default()
    };
    Ok(Import::new(groom, notes))
}

/// The short strands that `groom` keeps.
fn shorts_of(groom: &Groom) -> Result<Vec<Short>> {
    let Some(bytes) = groom.source.original_of(INFO.name) else {
        return Ok(Vec::new());
    };
    let refused = |found: String, range: String| {
        let key = "original short strands of a .data file";
        Err(Error::value(key, found, range))
    };
    if bytes.len() % SHORT_BYTES != 0 {
        let range = format!("a multiple of {SHORT_BYTES}");
        return refused(format!("{} bytes", bytes.len()), range);
    }
    let mut shorts: Vec<Short> = Vec::new();
    let total = groom.n_strands() + bytes.len() / SHORT_BYTES;
    for entry in bytes.chunks_exact(SHORT_BYTES) {
        let (strand, n_points) = (u32_at(entry, 0), u32_at(entry, 4));
        let rising = shorts.last().is_none_or(|last| last.strand < strand);
        if !rising || strand as usize >= total {
            let range = format!("rising and below {total}");
            return refused(format!("index {strand}"), range);
        }
        let point = match n_points {
            0 => None,
            1 => Some(point_at(entry, 8)),
            _ => return refused(format!("{n_points} points"), "0 or 1".to_owned()),
        };
        for x in point.unwrap_or_default() {
            finite(|| format!("point of strand {strand}"), x)?;
        }
        shorts.push(Short { strand, point });
    }
    Ok(shorts)
}

fn write(groom: &Groom, options: &ExportOptions) -> Result<Vec<u8>> {
    let placement = options.placement(groom, &INFO);
    let source = Placement::from_source(groom);
    let shorts = shorts_of(groom)?;
    let n_strands = groom.n_strands() + shorts.len();
    let largest = f64::from(i32::MAX);
    in_range("number of strands", n_strands as f64, 0.0, largest)?;
    let mut file = Vec::with_capacity(4 + 4 * n_strands + 12 * groom.points.len());
    file.extend((n_strands as u32).to_le_bytes());
    let mut shorts = shorts.into_iter().peekable();
    let mut whole = 0..groom.n_strands();
    for strand in 0..n_strands {
        if let Some(short) = shorts.next_if(|short| short.strand as usize == strand) {
            file.extend(u32::from(short.point.is_some()).to_le_bytes());
            if let Some(point) = short.point {
                let moved = match source == placement {
                    true => point,
                    false => placement.to_file(source.to_groom(point)),
                };
                extend_floats(&mut file, &moved);
            }
        } else if let Some(ix) = whole.next() {
            let points = &groom.points[groom.strand(ix)];
            let key = format!("number of points of strand {ix}");
            in_range(key, points.len() as f64, 0.0, largest)?;
            file.extend((points.len() as u32).to_le_bytes());
            for &point in points {
                extend_floats(&mut file, &placement.to_file(point));
            }
        }
    }
    Ok(file)
}
