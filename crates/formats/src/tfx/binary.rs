//! Versions 3 and 4, binary.

use super::layout::{
    COLOR, INFO, INVERSE_MASS, POINT_UV, THICKNESS, held_at_both_ends, placement, set_version,
    usual_notes,
};
use crate::bytes::{f32_at, point_at, u32_at};
use crate::error::{Error, Result};
use crate::groom::Domain;
use crate::groom_format::{Import, ImportOptions, Note, NoteKind};
use crate::strand_list::{StrandList, attribute};

pub(super) const V3_HEADER_BYTES: usize = 296;
pub(super) const V4_HEADER_BYTES: usize = 160;

/// An array of attributes: name, what it is for, components, where its offset stands in versions 3
/// and 4. In the order of version 4.
pub(super) const ARRAYS: [(&str, Domain, usize, usize, usize); 4] = [
    ("root_uv", Domain::Strand, 2, 152, 16),
    (POINT_UV, Domain::Point, 2, 164, 20),
    (THICKNESS, Domain::Strand, 1, 148, 24),
    (COLOR, Domain::Point, 4, 156, 28),
];
/// Where versions 3 and 4 have the offset of positions.
pub(super) const POSITIONS_AT: (usize, usize) = (144, 12);
/// Where version 3 has the offset of its list of guides.
const GUIDES_AT: usize = 160;

pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let cut = || Error::invalid("file ends within its header", bytes.len() as u64);
    let version = match bytes.get(..4).map(|start| f32_at(start, 0)) {
        Some(3.0) => 3,
        Some(4.0) => 4,
        Some(_) => return Err(Error::invalid("file is of no version of TressFX", 0)),
        None => return Err(cut()),
    };
    let header_bytes = if version == 3 {
        V3_HEADER_BYTES
    } else {
        V4_HEADER_BYTES
    };
    let header = bytes.get(..header_bytes).ok_or_else(cut)?;
    let (n_strands, n_points) = (u32_at(header, 4) as usize, u32_at(header, 8) as usize);
    let total = n_strands as u64 * n_points as u64;
    options.check_points(total)?;
    let array = |at: usize, name: &str, n: u64, n_bytes: u64| {
        let offset = u32_at(header, at) as usize;
        if offset == 0 {
            return Ok(None);
        }
        let wanted = n * n_bytes;
        let rest = bytes.get(offset..).filter(|_| offset >= header_bytes);
        let Some(rest) = rest else {
            let what =
                format!("offset {offset} of the {name} is not behind the header, in the file");
            return Err(Error::invalid(what, at as u64));
        };
        if wanted > rest.len() as u64 {
            let what = format!(
                "{name} take {wanted} bytes, the file has {} left",
                rest.len()
            );
            return Err(Error::invalid(what, offset as u64));
        }
        Ok(Some(&rest[..wanted as usize]))
    };
    if version == 3 && u32_at(header, GUIDES_AT) != 0 {
        let what = "the file marks some strands as guides, which is not read";
        return Err(Error::invalid(what, GUIDES_AT as u64));
    }
    let (positions_at, point_bytes) = match version {
        3 => (POSITIONS_AT.0, 12),
        _ => (POSITIONS_AT.1, 16),
    };
    let Some(positions) = array(positions_at, "positions", total, point_bytes as u64)? else {
        return Err(Error::invalid("file has no positions", positions_at as u64));
    };
    let mut list = StrandList::new(placement(version, options), options);
    // All strands have as many points; of none, and there are no bytes.
    let strand_bytes = n_points.saturating_mul(point_bytes).max(1);
    for (ix, strand) in positions.chunks_exact(strand_bytes).enumerate() {
        let points = strand.chunks_exact(point_bytes);
        list.push(ix, points.map(|point| point_at(point, 0)))?;
    }
    let n_follow = if version == 3 { u32_at(header, 12) } else { 0 };
    let mut notes = usual_notes(version, n_strands, n_follow, options);
    let mut groom = list.finish(INFO.name, &mut notes)?;
    set_version(&mut groom, version);

    if version == 4 {
        let masses = positions
            .chunks_exact(point_bytes)
            .map(|point| f32_at(point, 12));
        groom
            .attributes
            .push(attribute(INVERSE_MASS, Domain::Point, 1, masses.collect()));
    } else if u32_at(header, 16) != 0 {
        groom.attributes.push(held_at_both_ends(&groom));
    }
    let mut end = header_bytes + positions.len();
    let mut is_in_order = u32_at(header, positions_at) as usize == header_bytes;
    for (name, domain, components, v3_at, v4_at) in ARRAYS {
        let at = if version == 3 { v3_at } else { v4_at };
        let n = if domain == Domain::Point {
            total
        } else {
            n_strands as u64
        };
        let Some(values) = array(at, name, n, 4 * components as u64)? else {
            continue;
        };
        is_in_order &= u32_at(header, at) as usize == end;
        end += values.len();
        let data = values
            .chunks_exact(4)
            .map(|value| f32_at(value, 0))
            .collect();
        groom
            .attributes
            .push(attribute(name, domain, components as u32, data));
    }
    is_in_order &= end == bytes.len();
    if version == 4 && !(is_in_order && header[32..].iter().all(|&byte| byte == 0)) {
        let what =
            "the file has gaps, or its arrays in another order: it is not kept byte for byte";
        notes.push(Note::new(NoteKind::Dropped, what));
    }
    Ok(Import::new(groom, notes))
}
