//! Writing version 4.

use std::borrow::Cow;

use super::binary::{ARRAYS, POSITIONS_AT, V4_HEADER_BYTES};
use super::layout::{INVERSE_MASS, placement_for_export};
use crate::bytes::extend_floats;
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom};
use crate::groom_format::{Export, ExportOptions, Note, NoteKind};
use crate::validate::in_range;

/// Numbers of points that a strand can have.
const N_POINTS: std::ops::RangeInclusive<usize> = 4..=64;

pub(super) fn write(groom: &Groom, options: &ExportOptions) -> Result<Export> {
    let placement = placement_for_export(groom, options);
    let (groom, note) = of_equal_strands(groom)?;
    let n_strands = groom.n_strands();
    let masses = masses(&groom)?;
    let mut header = vec![0; V4_HEADER_BYTES];
    let put = |header: &mut Vec<u8>, at: usize, word: u32| {
        header[at..at + 4].copy_from_slice(&word.to_le_bytes());
    };
    put(&mut header, 0, 4f32.to_bits());
    put(&mut header, 4, n_strands as u32);
    put(&mut header, 8, groom.strand(0).len() as u32);
    put(&mut header, POSITIONS_AT.1, V4_HEADER_BYTES as u32);
    let mut arrays = Vec::with_capacity(16 * groom.points.len());
    for (&point, &mass) in groom.points.iter().zip(&masses) {
        extend_floats(&mut arrays, &placement.to_file(point));
        extend_floats(&mut arrays, &[mass]);
    }
    for (name, domain, components, _, at) in ARRAYS {
        let Some(attribute) = groom.attribute(name) else {
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
        let offset = V4_HEADER_BYTES + arrays.len();
        in_range(
            "bytes of a .tfx file",
            offset as f64,
            0.0,
            f64::from(u32::MAX),
        )?;
        put(&mut header, at, offset as u32);
        extend_floats(&mut arrays, &values_for(&groom, attribute, domain));
    }
    let mut export = Export::new([header, arrays].concat());
    export.n_points = note.is_some().then_some(groom.points.len());
    export.notes.extend(note);
    Ok(export)
}

/// `groom` where all strands have the same number of points as TressFX wants it; else resampled,
/// with a line about it.
fn of_equal_strands(groom: &Groom) -> Result<(Cow<'_, Groom>, Option<Note>)> {
    let counts = || (0..groom.n_strands()).map(|strand| groom.strand(strand).len());
    let (least, most) = counts().fold((usize::MAX, 0), |(least, most), n| {
        (least.min(n), most.max(n))
    });
    if least == most && most.is_power_of_two() && N_POINTS.contains(&most) {
        return Ok((Cow::Borrowed(groom), None));
    }
    let n = most
        .next_power_of_two()
        .clamp(*N_POINTS.start(), *N_POINTS.end());
    let mut resampled = groom.resampled(n as u32)?;
    let masses = resampled
        .attributes
        .iter_mut()
        .find(|a| a.name == INVERSE_MASS);
    let is_flag = |masses: &Attribute| masses.data.iter().all(|&mass| mass == 0.0 || mass == 1.0);
    if let Some(masses) = masses.filter(|_| groom.attribute(INVERSE_MASS).is_some_and(is_flag)) {
        // What moves or not does so after as before.
        masses.data.iter_mut().for_each(|mass| *mass = mass.round());
    }
    let had = match least == most {
        true => format!("{most}"),
        false => format!("{least} to {most}"),
    };
    let what = format!("strands of {had} points are resampled to {n} points each");
    let note = Note::new(NoteKind::Assumed, what);
    Ok((Cow::Owned(resampled), Some(note)))
}

/// Inverse masses of all points: the groom's own, or else those of strands that are held at their
/// first two points.
fn masses(groom: &Groom) -> Result<Vec<f32>> {
    let Some(attribute) = groom.attribute(INVERSE_MASS) else {
        let strands = (0..groom.n_strands()).map(|strand| groom.strand(strand).len());
        let masses = strands.flat_map(|n| (0..n).map(|ix| if ix < 2 { 0.0 } else { 1.0 }));
        return Ok(masses.collect());
    };
    if attribute.components != 1 {
        let key = format!("components of attribute {INVERSE_MASS}");
        return Err(Error::value(key, attribute.components, "1"));
    }
    Ok(values_for(groom, attribute, Domain::Point).into_owned())
}

/// The values of `attribute` for each element of `domain`; of points for a strand that of its root.
fn values_for<'a>(groom: &Groom, attribute: &'a Attribute, domain: Domain) -> Cow<'a, [f32]> {
    if attribute.domain == domain {
        return Cow::Borrowed(&attribute.data);
    }
    let n = attribute.components as usize;
    let mut data = Vec::with_capacity(groom.domain_len(domain) * n);
    let mut add = |element: usize| data.extend(&attribute.data[element * n..(element + 1) * n]);
    for strand in 0..groom.n_strands() {
        let points = groom.strand(strand);
        match (attribute.domain, domain) {
            (Domain::Groom, Domain::Point) => points.for_each(|_| add(0)),
            (Domain::Groom, _) => add(0),
            (Domain::Strand, Domain::Point) => points.for_each(|_| add(strand)),
            (Domain::Strand, _) => add(strand),
            (Domain::Point, Domain::Point) => points.for_each(&mut add),
            (Domain::Point, _) => add(points.start),
        }
    }
    Cow::Owned(data)
}
