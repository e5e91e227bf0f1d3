//! Reading `.hair` files.

use super::layout::{ATTRIBUTES, HEADER_BYTES, INFO, flag};
use super::original::{HairOriginal, SinglePoint};
use super::thickness::diameter;
use crate::bytes::{f32_at, point_at, u32_at};
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom, GroomSource, Original};
use crate::groom_format::{Import, ImportOptions, Note, NoteKind, Placement};
use crate::validate::finite;

/// The arrays of a file, checked against its length.
struct Layout<'a> {
    n_strands: usize,
    segments: Option<&'a [u8]>,
    default_segments: u64,
    points: &'a [u8],
    /// In the order of [`ATTRIBUTES`].
    arrays: [Option<&'a [u8]>; 3],
}

/// Decodes a `.hair` file.
pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let placement = options.placement(&INFO);
    let layout = parse_layout(bytes, options)?;
    let mut groom = Groom {
        strand_offsets: vec![0],
        ..Groom::default()
    };
    let mut data: [Vec<f32>; 3] = Default::default();
    let mut single_points = Vec::new();
    let mut first = 0usize;
    for strand in 0..layout.n_strands {
        let n_points = layout.points_of(strand) as usize;
        check_points(&layout, strand, first, n_points, placement)?;
        if n_points == 1 {
            single_points.push(layout.single_point(strand, first));
        } else {
            groom.points.extend(
                (first..first + n_points)
                    .map(|ix| placement.to_groom(point_at(layout.points, 12 * ix))),
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
        .extend(diameter(&groom, placement.cm_per_unit));
    let mut notes = Vec::new();
    if !bytes.starts_with(b"HAIR") {
        let what = "the file starts with \"hair\" in small letters; it is read as if with HAIR";
        notes.push(Note::new(NoteKind::Assumed, what));
    }
    if !single_points.is_empty() {
        let n = single_points.len();
        let what = counted(
            n,
            "strand of a single point is",
            "strands of a single point are",
        ) + " kept for export but not drawn";
        notes.push(Note::new(NoteKind::SetAside, what));
    }
    let original = HairOriginal {
        header: [b"HAIR", &bytes[4..HEADER_BYTES]].concat(),
        single_points,
    };
    groom.source = GroomSource {
        cm_per_unit: placement.cm_per_unit,
        up: placement.up,
        original: Some(Original {
            format: INFO.name.to_owned(),
            data: original.to_bytes(),
        }),
        ..GroomSource::default()
    };
    Ok(Import::new(groom, notes))
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
            position: point_at(self.points, 12 * ix),
            thickness: value(0, 1, 0),
            transparency: value(1, 1, 0),
            color: [0, 1, 2].map(|component| value(2, 3, component)),
        }
    }
}

fn parse_layout<'a>(bytes: &'a [u8], options: &ImportOptions) -> Result<Layout<'a>> {
    let magic = &bytes[..bytes.len().min(4)];
    if !magic.eq_ignore_ascii_case(b"HAIR") {
        return Err(Error::invalid("file does not start with HAIR", 0));
    }
    if bytes.len() < HEADER_BYTES {
        let what = "file ends within its 128-byte header";
        return Err(Error::invalid(what, bytes.len() as u64));
    }
    let n_strands = u64::from(u32_at(bytes, 4));
    let n_points = u64::from(u32_at(bytes, 8));
    options.check_points(n_points)?;
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
            counted(rest.len(), "byte", "bytes") + " after the last array",
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
    placement: Placement,
) -> Result<()> {
    for point in 0..n_points {
        let position = point_at(layout.points, 12 * (first + point));
        placement.check(strand, point, position)?;
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

fn floats(bytes: &[u8], first: usize, count: usize) -> impl Iterator<Item = f32> + '_ {
    (first..first + count).map(|ix| f32_at(bytes, 4 * ix))
}
