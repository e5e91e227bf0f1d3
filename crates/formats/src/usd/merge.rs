//! One groom of the polylines of several prims.

use std::collections::HashMap;

use super::layer::Layer;
use super::pieces::{Piece, Values};
use crate::error::Result;
use crate::groom::{Attribute, Domain, Groom, MAX_DIAMETER_CM, MIN_DIAMETER_CM};
use crate::groom_format::{Note, NoteKind};
use crate::scene_hair::HairSection;

/// Name of the attribute that tells strands of several prims apart.
const GROUP: &str = "group_id";
/// Most prims that a note lists.
const MOST_LISTED: usize = 8;

/// The polylines and their values, one prim after another; there is at least one.
pub(super) fn merge(mut pieces: Vec<Piece>, notes: &mut Vec<Note>, layer: &Layer) -> Result<Groom> {
    let mut groom = Groom {
        strand_offsets: vec![0],
        ..Groom::default()
    };
    if pieces.len() > 1 && !pieces.iter().any(|piece| piece.find(GROUP).is_some()) {
        group(&mut pieces, notes);
    }
    groom.attributes = attributes(&pieces, notes, layer)?;
    // So that a file that is written again has them in the same order.
    groom.attributes.sort_by(|a, b| a.name.cmp(&b.name));
    // The points of a single prim are not copied.
    if let [piece] = &mut pieces[..] {
        groom.points = std::mem::take(&mut piece.points);
    }
    for piece in pieces {
        for length in piece.lengths {
            let last = groom.strand_offsets[groom.strand_offsets.len() - 1];
            groom.strand_offsets.push(last + length);
        }
        groom.points.extend(piece.points);
    }
    check_diameters(&mut groom, notes);
    Ok(groom)
}

impl Piece {
    fn find(&self, name: &str) -> Option<&Values> {
        self.values.iter().find(|values| values.name == name)
    }
}

/// Numbers the prims.
fn group(pieces: &mut [Piece], notes: &mut Vec<Note>) {
    let listed = pieces.iter().take(MOST_LISTED).enumerate();
    let mut list: Vec<String> = listed
        .map(|(ix, piece)| format!("{ix} {}", piece.path))
        .collect();
    if pieces.len() > MOST_LISTED {
        list.push(format!("{} more", pieces.len() - MOST_LISTED));
    }
    let text = format!(
        "{} prims are merged; their {GROUP}: {}",
        pieces.len(),
        list.join(", ")
    );
    notes.push(Note::new(NoteKind::Assumed, text));
    for (ix, piece) in pieces.iter_mut().enumerate() {
        piece.values.push(Values {
            name: GROUP.to_owned(),
            domain: Domain::Groom,
            components: 1,
            data: vec![ix as f32],
        });
    }
}

fn attributes(pieces: &[Piece], notes: &mut Vec<Note>, layer: &Layer) -> Result<Vec<Attribute>> {
    // In the order in which they are met, with the number of prims that have them.
    let mut names: Vec<&str> = Vec::new();
    let mut owners: HashMap<&str, usize> = HashMap::new();
    for values in pieces.iter().flat_map(|piece| &piece.values) {
        let n = owners.entry(&values.name).or_default();
        if *n == 0 {
            names.push(&values.name);
        }
        *n += 1;
    }
    let mut attributes = Vec::new();
    for name in names {
        let found = || pieces.iter().filter_map(|piece| piece.find(name));
        let components = found().next().map_or(1, |values| values.components);
        let is_everywhere = owners[name] == pieces.len();
        let without = || pieces.iter().find(|piece| piece.find(name).is_none());
        let without = if is_everywhere { None } else { without() };
        // What a prim has that says nothing.
        let fallback = match name {
            "diameter" => Some(HairSection::DEFAULT_DIAMETER_CM as f32),
            "guide" | GROUP => Some(0.0),
            _ => None,
        };
        let mut reason = None;
        if let (Some(piece), None) = (without, fallback) {
            reason = Some(format!("{} has none", piece.path));
        } else if found().any(|values| values.components != components) {
            reason = Some("prims have different numbers of components".to_owned());
        }
        if let Some(reason) = reason {
            let text = format!("attribute {name} left out: {reason}");
            notes.push(Note::new(NoteKind::Dropped, text));
            continue;
        }
        if let (Some(piece), "diameter") = (without, name) {
            let diameter = HairSection::DEFAULT_DIAMETER_CM;
            let text = format!("{} has no widths: drawn {diameter} cm thick", piece.path);
            notes.push(Note::new(NoteKind::Assumed, text));
        }
        let fallback = fallback.unwrap_or_default();
        attributes.push(attribute(pieces, name, (components, fallback), layer)?);
    }
    Ok(attributes)
}

fn attribute(
    pieces: &[Piece],
    name: &str,
    (components, fallback): (usize, f32),
    layer: &Layer,
) -> Result<Attribute> {
    let constant = |piece: &Piece| match piece.find(name) {
        Some(values) if values.domain == Domain::Groom => Some(values.data.clone()),
        Some(_) => None,
        None => Some(vec![fallback; components]),
    };
    let is_point = |piece: &Piece| {
        let values = piece.find(name);
        values.is_some_and(|values| values.domain == Domain::Point)
    };
    let first = constant(&pieces[0]);
    let domain = if first.is_some() && pieces.iter().all(|piece| constant(piece) == first) {
        Domain::Groom
    } else if pieces.iter().any(is_point) {
        Domain::Point
    } else {
        Domain::Strand
    };
    let mut data = Vec::new();
    for piece in pieces {
        let constant = constant(piece);
        let values = piece.find(name).map_or(&[][..], |values| &values.data);
        let own = piece
            .find(name)
            .map_or(Domain::Groom, |values| values.domain);
        match (domain, constant) {
            (Domain::Groom, Some(value)) => {
                data = value;
                break;
            }
            (_, Some(value)) => {
                let n = match domain {
                    Domain::Point => piece.lengths.iter().sum::<u32>() as usize,
                    _ => piece.lengths.len(),
                };
                // A constant may stand for any number of them.
                layer.spend_on(n, size_of_val(&value[..]))?;
                (0..n).for_each(|_| data.extend_from_slice(&value));
            }
            (Domain::Point, None) if own == Domain::Strand => {
                for (value, &n) in values.chunks_exact(components).zip(&piece.lengths) {
                    (0..n).for_each(|_| data.extend_from_slice(value));
                }
            }
            (_, None) => data.extend_from_slice(values),
        }
    }
    Ok(Attribute {
        name: name.to_owned(),
        domain,
        components: components as u32,
        data,
    })
}

/// Leaves out diameters that cannot be drawn; tips that taper to nothing keep the least diameter.
fn check_diameters(groom: &mut Groom, notes: &mut Vec<Note>) {
    let is_diameter = |attribute: &Attribute| attribute.name == "diameter";
    let Some(at) = groom.attributes.iter().position(is_diameter) else {
        return;
    };
    let data = &mut groom.attributes[at].data;
    let n = data.len();
    let bad = |value: &&f32| !(0.0..=MAX_DIAMETER_CM).contains(*value);
    let n_bad = data.iter().filter(bad).count();
    let n_thin = data
        .iter()
        .filter(|&&value| value < MIN_DIAMETER_CM)
        .count();
    if let Some(first) = data.iter().find(bad) {
        let text = format!(
            "widths left out: {n_bad} of {n} are not in 0..={MAX_DIAMETER_CM} cm, the first is {first}"
        );
        notes.push(Note::new(NoteKind::Dropped, text));
        groom.attributes.remove(at);
    } else if n_thin == n {
        let text = format!("widths left out: all {n} are thinner than {MIN_DIAMETER_CM} cm");
        notes.push(Note::new(NoteKind::Dropped, text));
        groom.attributes.remove(at);
    } else if n_thin > 0 {
        for value in data.iter_mut() {
            *value = value.max(MIN_DIAMETER_CM);
        }
        let text = format!(
            "{n_thin} of {n} widths are drawn {MIN_DIAMETER_CM} cm thick, for they are zero or less than that"
        );
        notes.push(Note::new(NoteKind::Assumed, text));
    }
}
