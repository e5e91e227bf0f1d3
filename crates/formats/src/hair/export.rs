//! Writing `.hair` files.

use std::borrow::Cow;

use super::layout::{ATTRIBUTES, HEADER_BYTES, INFO, INFO_START, flag};
use super::original::{HairOriginal, SinglePoint};
use super::thickness::thickness;
use crate::bytes::{extend_floats, f32_at, u32_at};
use crate::error::{Error, Result};
use crate::groom::{Domain, Groom};
use crate::groom_format::{ExportOptions, Placement};
use crate::scene_hair::HairSection;
use crate::validate::in_range;

/// Header of a groom that does not come from a `.hair` file: the default diameter, opaque, white.
fn new_header(cm_per_unit: f64) -> Vec<u8> {
    let mut header = vec![0u8; HEADER_BYTES];
    header[..4].copy_from_slice(b"HAIR");
    let thickness = (HairSection::DEFAULT_DIAMETER_CM / cm_per_unit) as f32;
    for (at, value) in [(20, thickness), (24, 0.0), (28, 1.0), (32, 1.0), (36, 1.0)] {
        header[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    let info = b"Written by Strandlight";
    header[INFO_START..INFO_START + info.len()].copy_from_slice(info);
    header
}

/// The groom as a `.hair` file. Attributes `diameter` (as thickness), `transparency` and `color`
/// are written, as arrays or defaults.
///
/// # Errors
/// `Value` when the groom does not fit into the format: a strand of more than 65536 points among
/// strands of other lengths, or more than 2^32 - 1 points.
pub(super) fn write(groom: &Groom, options: &ExportOptions) -> Result<Vec<u8>> {
    let placement = options.placement(groom, &INFO);
    let original = match groom.source.original_of(INFO.name) {
        Some(bytes) => {
            let original = HairOriginal::from_bytes(bytes, groom.n_strands())?;
            Some(original.moved(Placement::from_source(groom), placement))
        }
        None => None,
    };
    let (mut header, single_points) = match &original {
        Some(original) => (original.header.clone(), &*original.single_points),
        None => (new_header(placement.cm_per_unit), &[][..]),
    };
    let strands = Strands::new(groom, single_points);
    let n_points = strands
        .segments
        .iter()
        .map(|&segments| u64::from(segments) + 1)
        .sum::<u64>();
    in_range(
        "number of points",
        n_points as f64,
        1.0,
        f64::from(u32::MAX),
    )?;
    let mut flags = flag::POINTS;

    // Lengths: the default if it holds for all strands, unless the original had an array.
    let old_flags = u32_at(&header, 12);
    let first = strands.segments[0];
    let uniform = strands.segments.iter().all(|&segments| segments == first);
    let segments = if uniform && old_flags & flag::SEGMENTS == 0 {
        header[16..20].copy_from_slice(&first.to_le_bytes());
        Vec::new()
    } else {
        flags |= flag::SEGMENTS;
        let longest = strands.segments.iter().max().copied().unwrap_or(0);
        in_range("segments of a strand", f64::from(longest), 0.0, 65535.0)?;
        let narrow = strands.segments.iter().map(|&segments| segments as u16);
        narrow.flat_map(u16::to_le_bytes).collect()
    };

    let mut arrays = Vec::new();
    for (name, flag, components, default_at) in ATTRIBUTES {
        let attribute = match flag {
            flag::THICKNESS => thickness(groom, placement.cm_per_unit),
            _ => groom.attribute(name).map(Cow::Borrowed),
        };
        let Some(attribute) = attribute else {
            continue;
        };
        if attribute.components as usize != components {
            let key = format!("components of attribute {name}");
            return Err(Error::value(
                key,
                attribute.components,
                components.to_string(),
            ));
        }
        if attribute.domain == Domain::Groom {
            for (ix, value) in attribute.data.iter().enumerate() {
                let at = default_at + 4 * ix;
                header[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
            continue;
        }
        flags |= flag;
        // Where the file had no such array, its single points had the default.
        let had_array = old_flags & flag != 0;
        let defaults: Vec<f32> = (0..components)
            .map(|ix| f32_at(&header, default_at + 4 * ix))
            .collect();
        strands.for_each(|strand| match strand {
            Strand::Single(_) if !had_array => extend_floats(&mut arrays, &defaults),
            Strand::Single(point) => {
                let [thickness, transparency] = [point.thickness, point.transparency];
                let values: &[f32] = match flag {
                    flag::THICKNESS => &[thickness],
                    flag::TRANSPARENCY => &[transparency],
                    _ => &point.color,
                };
                extend_floats(&mut arrays, values);
            }
            Strand::Whole(ix) => {
                for point in groom.strand(ix) {
                    let element = if attribute.domain == Domain::Point {
                        point
                    } else {
                        ix
                    };
                    let start = element * components;
                    extend_floats(&mut arrays, &attribute.data[start..start + components]);
                }
            }
        });
    }

    header[4..8].copy_from_slice(&(strands.segments.len() as u32).to_le_bytes());
    header[8..12].copy_from_slice(&(n_points as u32).to_le_bytes());
    header[12..16].copy_from_slice(&flags.to_le_bytes());
    let mut file = header;
    file.extend_from_slice(&segments);
    strands.for_each(|strand| match strand {
        Strand::Single(point) => extend_floats(&mut file, &point.position),
        Strand::Whole(ix) => {
            for &point in &groom.points[groom.strand(ix)] {
                extend_floats(&mut file, &placement.to_file(point));
            }
        }
    });
    file.extend_from_slice(&arrays);
    Ok(file)
}

/// The strands in the order of the file, single points put back in.
struct Strands<'a> {
    singles: &'a [SinglePoint],
    /// Number of segments of each strand.
    segments: Vec<u32>,
}

enum Strand<'a> {
    Single(&'a SinglePoint),
    /// Index into the groom.
    Whole(usize),
}

impl<'a> Strands<'a> {
    fn new(groom: &Groom, singles: &'a [SinglePoint]) -> Self {
        let mut strands = Strands {
            singles,
            segments: vec![0; groom.n_strands() + singles.len()],
        };
        let mut segments = Vec::with_capacity(strands.segments.len());
        strands.for_each(|strand| {
            segments.push(match strand {
                Strand::Single(_) => 0,
                Strand::Whole(ix) => groom.strand(ix).len() as u32 - 1,
            });
        });
        strands.segments = segments;
        strands
    }

    fn for_each(&self, mut act: impl FnMut(Strand<'a>)) {
        let mut singles = self.singles.iter().peekable();
        let mut whole = 0;
        for ix in 0..self.segments.len() {
            match singles.next_if(|point| point.strand as usize == ix) {
                Some(point) => act(Strand::Single(point)),
                None => {
                    act(Strand::Whole(whole));
                    whole += 1;
                }
            }
        }
    }
}
